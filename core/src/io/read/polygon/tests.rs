//! Areas, directions and edges of cut polygons.

use std::collections::BTreeMap;

use proptest::prelude::*;

use super::*;

/// Twice the area on the plane of x and y. Exact for small integers.
fn area(corners: &[Point]) -> f64 {
    let edges = corners.iter().zip(corners.iter().cycle().skip(1));
    edges.map(|(a, b)| f64::from(a[0]) * f64::from(b[1]) - f64::from(a[1]) * f64::from(b[0])).sum()
}

fn triangles(polygon: &[Point]) -> Vec<[usize; 3]> {
    let mut all = Vec::new();
    cut(polygon, |triangle| all.push(triangle));
    all
}

/// So many triangles as there must be, whose edges are the polygon's and pairs of opposite ones.
fn is_complete(polygon: &[Point], triangles: &[[usize; 3]]) -> bool {
    let mut edges = BTreeMap::new();
    let mut add = |a: usize, b: usize, by: i32| *edges.entry((a.min(b), a.max(b))).or_insert(0) += if a < b { by } else { -by };
    for [a, b, c] in triangles {
        [(a, b), (b, c), (c, a)].into_iter().for_each(|(a, b)| add(*a, *b, 1));
    }
    let count = polygon.len();
    (0..count).for_each(|corner| add(corner, (corner + 1) % count, -1));
    triangles.len() + 2 == count && edges.values().all(|sum| *sum == 0)
}

/// The smallest of the areas of the triangles, as a polygon that turns counter-clockwise on x and y has them.
fn smallest(polygon: &[Point]) -> f64 {
    let cut = triangles(polygon);
    assert!(is_complete(polygon, &cut), "{polygon:?} {cut:?}");
    cut.iter().map(|triangle| area(&triangle.map(|corner| polygon[corner]))).fold(f64::INFINITY, f64::min)
}

fn flat(corners: &[[i16; 2]]) -> Vec<Point> {
    corners.iter().map(|[x, y]| [f32::from(*x), f32::from(*y), 0.0]).collect()
}

#[test]
fn a_convex_quad_keeps_the_diagonal_that_readers_take() {
    let square = flat(&[[0, 0], [1, 0], [1, 1], [0, 1]]);
    assert_eq!(triangles(&square), [[0, 1, 2], [0, 2, 3]]);
    // Seen from below, it has the other direction and the same diagonal.
    let below: Vec<Point> = square.iter().rev().copied().collect();
    assert_eq!(triangles(&below), [[0, 1, 2], [0, 2, 3]]);
}

#[test]
fn a_quad_that_is_not_convex_is_cut_within() {
    // An arrow head; its corner that turns right comes at every place.
    let arrow = flat(&[[0, 0], [4, 4], [0, 2], [-4, 4]]);
    for shift in 0..4 {
        let mut turned = arrow.clone();
        turned.rotate_left(shift);
        assert_eq!(smallest(&turned), 8.0, "{shift}");
    }
}

#[test]
fn corners_in_a_row_cost_no_empty_triangle() {
    // A square with the middles of its sides; a triangle with three corners more on one side.
    let square = flat(&[[0, 0], [1, 0], [2, 0], [2, 1], [2, 2], [1, 2], [0, 2], [0, 1]]);
    let triangle = flat(&[[0, 0], [1, 0], [2, 0], [3, 0], [4, 0], [2, 5]]);
    let quad = flat(&[[0, 0], [1, 0], [2, 0], [1, 3]]);
    for polygon in [square, triangle, quad] {
        for shift in 0..polygon.len() {
            let mut turned = polygon.clone();
            turned.rotate_left(shift);
            assert!(smallest(&turned) > 0.0, "{turned:?}");
        }
    }
}

#[test]
fn holes_with_bridges_stay_open() {
    // A square with two holes: one bridge goes on from the corner where the other one ends, and one hole touches the outline.
    let one = flat(&[[0, 0], [9, 0], [9, 9], [0, 9], [0, 0], [3, 3], [3, 6], [6, 6], [6, 3], [3, 3]]);
    let touching = flat(&[[0, 0], [9, 0], [9, 9], [0, 9], [0, 0], [3, 0], [3, 6], [6, 6], [6, 3], [3, 0]]);
    let two = flat(&[
        [0, 0],
        [9, 0],
        [9, 9],
        [0, 9],
        [0, 0],
        [2, 2],
        [2, 4],
        [4, 4],
        [6, 6],
        [6, 8],
        [8, 8],
        [8, 6],
        [6, 6],
        [4, 4],
        [4, 2],
        [2, 2],
    ]);
    for polygon in [one, two] {
        for shift in 0..polygon.len() {
            let mut turned = polygon.clone();
            turned.rotate_left(shift);
            assert!(smallest(&turned) > 0.0, "{turned:?}");
        }
    }
    assert!(smallest(&touching) >= 0.0);
}

#[test]
fn repeated_corners_and_spikes_cost_triangles_without_area() {
    for polygon in [
        flat(&[[0, 0], [0, 0], [4, 0], [4, 4], [4, 4], [4, 4], [0, 4]]),
        flat(&[[0, 0], [4, 0], [4, 4], [2, 2], [4, 4], [0, 4]]),
        flat(&[[0, 0], [4, 0], [4, 4], [8, 8], [4, 4], [0, 4]]),
    ] {
        assert_eq!(smallest(&polygon), 0.0, "{polygon:?}");
    }
}

#[test]
fn polygons_without_a_plane_are_fans() {
    let nan = [[f32::NAN; 3]; 5];
    let point = [[1.0; 3]; 6];
    let line = flat(&[[0, 0], [1, 1], [2, 2], [3, 3]]);
    for polygon in [&nan[..], &point, &line] {
        assert!(is_complete(polygon, &triangles(polygon)));
    }
    for short in 0..3 {
        assert_eq!(triangles(&point[..short]), [[0; 3]; 0]);
    }
}

/// How a polygon is cut, whatever its triangles are; as many of them as there must be.
fn way(polygon: &[Point]) -> Cut {
    let mut count = 0;
    let way = cut(polygon, |_| count += 1);
    assert_eq!(count + 2, polygon.len());
    way
}

#[test]
fn a_fan_that_may_lie_outside_is_told() {
    // Without a plane: a bow tie of five corners whose halves cancel.
    let bow = flat(&[[0, 0], [2, 2], [2, 0], [1, 1], [0, 2]]);
    let nan = [[f32::NAN; 3]; 5];
    assert_eq!([way(&bow), way(&nan)], [Cut::Fan; 2]);
    // Of corners on a line, and of one place, no triangle has an area, whatever they are.
    let line = flat(&[[0, 0], [1, 1], [3, 3], [2, 2]]);
    assert_eq!([way(&line), way(&[[1.0; 3]; 4])], [Cut::Whole; 2]);
    // A convex polygon of any number of corners, and a triangle, are fans that cover it.
    let square = |count: i16| {
        let arc = (0..count).map(|k| [f32::from(k), f32::from(k) * f32::from(k) / 100.0, 0.0]);
        arc.chain([[0.0, 1e6, 0.0]]).collect::<Vec<Point>>()
    };
    assert_eq!([way(&square(1000)), way(&flat(&[[0, 0], [1, 0], [0, 1]]))], [Cut::Whole; 2]);
    let arrow = flat(&[[0, 0], [4, 4], [0, 2], [-4, 4], [-1, 2]]);
    assert_eq!(way(&arrow), Cut::Whole);
}

/// Walks around nine positions that cross themselves everywhere: no corner but those that repeat is an ear.
fn tangle(corners: usize) -> Vec<Point> {
    let mut state = 1u32;
    let mut any = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        ((state >> 24) % 3) as f32
    };
    (0..corners).map(|_| [any(), any(), 0.0]).collect()
}

#[test]
fn f13_a_polygon_of_too_many_corners_is_a_fan() {
    let polygon = tangle(MOST_CLIPPED + 1);
    assert_eq!(way(&polygon), Cut::Fan);
    let first = triangles(&polygon).into_iter().take(2).collect::<Vec<_>>();
    assert_eq!(first, [[0, 1, 2], [0, 2, 3]]);
}

#[test]
fn a_great_comb_is_cut_soon() {
    // Deep narrow teeth: half of the corners turn right, and an ear may reach far.
    let teeth = 20_000i16;
    let mut comb: Vec<Point> = vec![[f32::from(teeth), -2000.0, 0.0]];
    comb.extend((0..teeth).rev().flat_map(|tooth| [[f32::from(tooth) + 0.5, 1000.0, 0.0], [f32::from(tooth), -1000.0, 0.0]]));
    comb.push([0.0, -2000.0, 0.0]);
    assert!(smallest(&comb) > 0.0);
}

/// Distances from a centre, one for each direction.
fn radii() -> impl Strategy<Value = Vec<u16>> {
    prop::collection::vec(1000u16..4000, 4..60)
}

/// Whole numbers, so that areas are exact.
fn star(radii: &[u16], scale: f32) -> Vec<Point> {
    let step = std::f32::consts::TAU / radii.len() as f32;
    let corner = |(place, radius): (usize, &u16)| {
        let (sin, cos) = (place as f32 * step).sin_cos();
        [(f32::from(*radius) * scale * cos).round(), (f32::from(*radius) * scale * sin).round(), 0.0]
    };
    radii.iter().enumerate().map(corner).collect()
}

proptest! {
    #[test]
    fn stars_are_covered_exactly(radii in radii()) {
        let polygon = star(&radii, 1.0);
        prop_assert!(smallest(&polygon) > 0.0);
        let sum: f64 = triangles(&polygon).iter().map(|triangle| area(&triangle.map(|corner| polygon[corner]))).sum();
        prop_assert_eq!(sum, area(&polygon));
    }

    /// A star-shaped hole in a star, joined from each of the corners.
    #[test]
    fn keyholes_are_covered_exactly(radii in radii(), hole in radii(), from in 0usize..60) {
        let count = radii.len().min(hole.len());
        let outer = star(&radii[..count], 16.0);
        // Rounding to whole numbers leaves a ray through the centre off by too little to cross an edge.
        let inner = star(&hole[..count], 2.0);
        let from = from % count;
        let walk = (0..=count).map(|step| outer[(from + step) % count]);
        let polygon: Vec<Point> = walk.chain((0..=count).map(|step| inner[(from + count - step) % count])).collect();
        prop_assert!(smallest(&polygon) > 0.0);
    }

    #[test]
    fn stars_anywhere_in_space_keep_their_direction(radii in radii(), axis in prop::array::uniform3(-1.0f32..1.0), angle in 0.0f32..6.0) {
        let axis = glam::Vec3::from(axis);
        prop_assume!(axis.length() > 0.1);
        let turn = glam::Quat::from_axis_angle(axis.normalize(), angle);
        let polygon: Vec<Point> = star(&radii, 1.0).into_iter().map(|corner| (turn * glam::Vec3::from(corner)).into()).collect();
        let cut = triangles(&polygon);
        prop_assert!(is_complete(&polygon, &cut));
        let normal = turn * glam::Vec3::Z;
        for triangle in cut {
            let [a, b, c] = triangle.map(|corner| glam::Vec3::from(polygon[corner]));
            // Rounding may bend three corners that were nearly in a row.
            prop_assert!((b - a).cross(c - a).dot(normal) > -1.0e4);
        }
    }

    #[test]
    fn any_corners_give_the_same_triangles_twice(corners in prop::collection::vec([-3i16..4, -3..4], 3..40)) {
        let polygon = flat(&corners);
        let cut = triangles(&polygon);
        prop_assert!(is_complete(&polygon, &cut));
        prop_assert_eq!(cut, triangles(&polygon));
    }
}
