//! Small surfaces whose openings are of a known kind.

use super::*;
use crate::contract::report::LoopClass::{
    AnnularCoplanar, AnnularParallel, Crack, Gap, Island, Machining, Misaligned, Nested, Simple,
};
use crate::testing::{Corners, diagnose, plate, records, reversed};

/// Classes and partners of a surface's loops but for the `longest`, which is the rim of the sheet itself, if asked to leave it out.
fn classes(triangles: &[Corners], leave_longest: bool) -> Vec<LoopClass> {
    let records = records(triangles);
    let d = diagnose(&records);
    let edges = Edges::of(&d.submesh);
    let mut all: Vec<_> = classify(&d.submesh, &edges, &loops::find(&d.submesh, &edges), &d.tolerance, 0.35).collect();
    for (i, l) in all.iter().enumerate() {
        if let Some(partner) = l.partner {
            assert_ne!(partner as usize, i);
        }
    }
    if leave_longest {
        let longest = (0..all.len()).max_by(|a, b| all[*a].perimeter.total_cmp(&all[*b].perimeter)).unwrap();
        all.remove(longest);
    }
    all.iter().map(|l| l.class).collect()
}

/// A plate whose points are moved.
fn moved(side: u8, keep: impl Fn(u8, u8) -> bool, to: impl Fn([f32; 3]) -> [f32; 3]) -> Vec<Corners> {
    plate(side, keep).iter().map(|t| t.map(&to)).collect()
}

/// A plate of 12 × 12 with a slit along x = 6, the points of whose right side are moved, but for the slit's ends.
fn slit(to: impl Fn([f32; 3]) -> [f32; 3]) -> Vec<Corners> {
    plate(12, |_, _| true)
        .into_iter()
        .map(|t| {
            let right = t.iter().any(|p| p[0] > 6.0);
            t.map(|p| if right && p[0] == 6.0 && p[1] > 2.0 && p[1] < 10.0 { to(p) } else { p })
        })
        .collect()
}

#[test]
fn a_slit_whose_sides_run_alike_is_a_gap() {
    assert_eq!(classes(&slit(|[x, y, z]| [x + 0.2, y, z]), true), [Gap]);
    assert_eq!(classes(&slit(|[x, y, z]| [x + 0.1, y + 0.4, z]), true), [Gap], "and its vertices need not face each other");
}

#[test]
fn a_slit_whose_sides_do_not_is_misaligned() {
    let jagged = |[x, y, _]: [f32; 3]| [x + 0.1, y, if (y as u8).is_multiple_of(2) { 0.25 } else { -0.25 }];
    assert_eq!(classes(&slit(jagged), true), [Misaligned]);
}

#[test]
fn a_slit_too_wide_for_its_edges_is_none_of_these() {
    assert_eq!(classes(&slit(|[x, y, z]| [x + 0.5, y, z]), true), [Simple]);
}

#[test]
fn a_vertex_on_a_neighbours_edge_is_a_crack() {
    let mut triangles = plate(6, |_, _| true);
    // The edge from (3, 3) to (4, 4), split on one side only.
    let at = triangles.iter().position(|t| t[0] == [3.0, 3.0, 0.0] && t[1][0] == 4.0 && t[1][1] == 3.0).unwrap();
    let [a, b, c] = triangles[at];
    let middle = [3.5, 3.5, 0.0];
    triangles[at] = [a, b, middle];
    triangles.push([middle, b, c]);
    assert_eq!(classes(&triangles, true), [Crack]);
}

#[test]
fn holes_side_by_side_are_simple_and_such_that_meet_are_nested() {
    let apart = |x: u8, y: u8| !((2..4).contains(&y) && ((2..4).contains(&x) || (5..7).contains(&x)));
    assert_eq!(classes(&plate(9, apart), true), [Simple, Simple]);
    let meeting = |x: u8, y: u8| !(((2..4).contains(&x) && (2..4).contains(&y)) || ((4..6).contains(&x) && (4..6).contains(&y)));
    assert_eq!(classes(&plate(9, meeting), true), [Nested, Nested]);
}

#[test]
fn a_ring_missing_from_a_plate_is_annular_and_a_speck_in_a_hole_an_island() {
    let around = |x: u8, y: u8| x.abs_diff(8).max(y.abs_diff(8));
    assert_eq!(classes(&plate(17, |x, y| !(4..6).contains(&around(x, y))), true), [AnnularCoplanar, AnnularCoplanar]);
    assert_eq!(classes(&plate(17, |x, y| !(1..6).contains(&around(x, y))), true), [Island, Island]);
}

/// A tube of radius 4 around z, 24 facets around, `rings` of which are there.
fn tube(rings: impl Fn(u8) -> bool) -> Vec<Corners> {
    let at = |i: u8, z: u8| {
        let turn = std::f32::consts::TAU * f32::from(i % 24) / 24.0;
        [4.0 * turn.cos(), 4.0 * turn.sin(), f32::from(z)]
    };
    (0..20)
        .filter(|z| rings(*z))
        .flat_map(|z| (0..24).map(move |i| (i, z)))
        .flat_map(|(i, z)| [[at(i, z), at(i + 1, z), at(i + 1, z + 1)], [at(i, z), at(i + 1, z + 1), at(i, z + 1)]])
        .collect()
}

#[test]
fn a_ring_missing_from_a_tube_is_annular() {
    for gap in 1..8 {
        let found = classes(&tube(|z| !(6..6 + gap).contains(&z)), false);
        // The ends of the tube look away from each other.
        assert_eq!(found.iter().filter(|c| **c == AnnularParallel).count(), 2, "{gap} missing: {found:?}");
    }
}

/// The surface that a polyline of (radius, height) sweeps around the z axis, 24 facets around; seen from outside if it ascends. It stands at x.
fn turned(profile: &[[f32; 2]], x: f32) -> Vec<Corners> {
    let at = |i: u8, [r, z]: [f32; 2]| {
        let (sin, cos) = (std::f32::consts::TAU * f32::from(i % 24) / 24.0).sin_cos();
        [x + r * cos, r * sin, z]
    };
    let quad = |i: u8, p: [f32; 2], q: [f32; 2]| [[at(i, p), at(i + 1, p), at(i + 1, q)], [at(i, p), at(i + 1, q), at(i, q)]];
    profile.windows(2).flat_map(|w| (0..24).flat_map(move |i| quad(i, w[0], w[1]))).collect()
}

#[test]
fn a_ring_missing_from_a_bore_is_annular_and_a_bores_ends_are_not() {
    let outside_in = |t: Vec<Corners>| reversed(&t);
    assert_eq!(classes(&outside_in(tube(|z| z < 4)), false), [Simple, Simple], "a bore alone");
    let found = classes(&outside_in(tube(|z| !(6..9).contains(&z))), false);
    assert_eq!(found.iter().filter(|c| **c == AnnularParallel).count(), 2, "{found:?}");
}

#[test]
fn the_missing_ends_of_a_wall_are_annular_however_thick_the_wall() {
    for bore in [0.5, 1.0, 2.0, 3.5] {
        let pipe = [turned(&[[4.0, 0.0], [4.0, 10.0]], 0.0), turned(&[[bore, 10.0], [bore, 0.0]], 0.0)].concat();
        assert_eq!(classes(&pipe, false), [AnnularCoplanar; 4], "{bore}");
    }
    let two_bores = [
        turned(&[[4.0, 0.0], [4.0, 10.0]], 0.0),
        turned(&[[0.8, 10.0], [0.8, 0.0]], 2.0),
        turned(&[[0.6, 10.0], [0.6, 0.0]], -2.0),
    ];
    assert_eq!(classes(&two_bores.concat(), false), [AnnularCoplanar; 6]);
    // From outside to inside: material, a narrow room, material.
    let in_each_other: Vec<Corners> = [[4.0, 1.0], [2.4, -1.0], [2.0, 1.0], [1.0, -1.0]]
        .iter()
        .flat_map(|[r, up]| turned(&[[*r, -5.0 * up], [*r, 5.0 * up]], 0.0))
        .collect();
    let records = records(&in_each_other);
    let d = diagnose(&records);
    let edges = Edges::of(&d.submesh);
    let all = classify(&d.submesh, &edges, &loops::find(&d.submesh, &edges), &d.tolerance, 0.35).collect::<Vec<_>>();
    for l in &all {
        let partner = &all[l.partner.unwrap() as usize];
        let [larger, smaller] = if l.perimeter > partner.perimeter { [l, partner] } else { [partner, l] };
        let thickness = (larger.perimeter - smaller.perimeter) / 6.27;
        assert!((thickness - 1.6).abs() < 0.1 || (thickness - 1.0).abs() < 0.1, "{thickness}");
    }
}

#[test]
fn the_inner_mouth_of_a_vessel_may_lie_deep() {
    let vessel = |deep: f32| {
        let inside = turned(&[[4.5, 9.0 - deep], [4.5, 1.0], [0.1, 1.0]], 0.0);
        let all = classes(&[turned(&[[0.1, 0.0], [5.0, 0.0], [5.0, 9.0]], 0.0), inside].concat(), false);
        all.iter().filter(|c| [AnnularCoplanar, AnnularParallel].contains(c)).count()
    };
    assert_eq!([0.0, 2.0, 3.5, 4.4].map(vessel), [2; 4]);
    assert_eq!(vessel(5.5), 0, "two caps have less area");
    let narrow = [turned(&[[4.0, 0.0], [4.0, 10.0]], 0.0), turned(&[[1.5, 7.0], [1.5, 1.0], [0.1, 1.0]], 0.0)].concat();
    assert_eq!(classes(&narrow, false)[..], [Simple; 4], "too deep for what differs so in size");
}

/// A box of 12 × 12 without these cells of its top and bottom.
fn perforated(height: f32, top: impl Fn(u8, u8) -> bool, bottom: impl Fn(u8, u8) -> bool) -> Vec<Corners> {
    let upper = moved(12, |x, y| !top(x, y), |[x, y, _]| [x, y, height]);
    let lower = reversed(&plate(12, |x, y| !bottom(x, y)));
    let rim = (0..12u8).flat_map(|i| [[i, 0, i + 1, 0], [12, i, 12, i + 1], [12 - i, 12, 11 - i, 12], [0, 12 - i, 0, 11 - i]]);
    let sides = rim.flat_map(|edge| {
        let [ax, ay, bx, by] = edge.map(f32::from);
        [[[ax, ay, 0.0], [bx, by, 0.0], [bx, by, height]], [[ax, ay, 0.0], [bx, by, height], [ax, ay, height]]]
    });
    upper.into_iter().chain(lower).chain(sides).collect()
}

#[test]
fn holes_back_to_back_are_a_way_through_a_plate_and_two_holes_of_a_box() {
    let square = |from: u8| move |x: u8, y: u8| (from..from + 6).contains(&x) && (from..from + 6).contains(&y);
    for height in [0.01, 1.0, 2.5] {
        assert_eq!(classes(&perforated(height, square(3), square(3)), false), [AnnularParallel; 2], "{height}");
    }
    for height in [4.0, 12.0] {
        assert_eq!(classes(&perforated(height, square(3), square(3)), false), [Simple; 2], "{height}");
    }
    assert_eq!(classes(&perforated(1.0, square(3), square(5)), false), [Simple; 2], "the outlines do not agree");
}

#[test]
fn holes_at_the_poles_of_a_ball_are_two() {
    for north in [2_u8, 4, 7] {
        let profile: Vec<[f32; 2]> = (north..=24 - north)
            .map(|i| (std::f32::consts::PI * f32::from(i) / 24.0).sin_cos())
            .map(|(sin, cos)| [10.0 * sin, -10.0 * cos])
            .collect();
        assert_eq!(classes(&turned(&profile, 0.0), false), [Simple; 2], "{north}");
    }
}

#[test]
fn a_slender_loop_that_folds_back_along_an_axis_is_machining() {
    let bent = |rows: std::ops::Range<u8>, to: fn(f32, f32) -> f32| {
        let hole = |x: u8, y: u8| (2..10).contains(&x) && rows.contains(&y);
        classes(&moved(12, |x, y| !hole(x, y), |[x, y, _]| [x, y, to(x - 6.0, y - 6.0)]), true)
    };
    let roof = |x: f32, _: f32| -x.abs();
    assert_eq!(bent(5..6, roof), [Machining], "seen along the ridge, it goes up one side and down again");
    assert_eq!(bent(3..9, roof), [Simple], "a wide one does so as well, but is open to the top");
    assert_eq!(bent(5..6, |x, _| x), [Simple], "flat, however it leans");
}

/// A slit along x = 6 whose sides run past each other, `by` so much to both sides, and down.
fn crossed(by: f32) -> Vec<Corners> {
    let right = slit(|[x, y, _]| [x - by, y, -by]);
    let left = |t: &Corners| t.iter().all(|p| p[0] <= 6.0) && t.iter().all(|p| p[2] == 0.0);
    let down = |p: [f32; 3]| if p[0] == 6.0 && p[1] > 2.0 && p[1] < 10.0 { [6.0 + by, p[1], -by] } else { p };
    right.into_iter().map(|t| if left(&t) { t.map(down) } else { t }).collect()
}

#[test]
fn a_loop_whose_sides_run_past_each_other_is_machining_and_folds_at_its_ends() {
    let triangles = crossed(0.5);
    assert_eq!(classes(&triangles, true), [Machining]);
    let records = records(&triangles);
    let d = diagnose(&records);
    let found: Vec<_> = loops::find(&d.submesh, &Edges::of(&d.submesh))
        .iter()
        .filter_map(|rim| folds(&d.submesh, rim).map(|ends| ends.map(|i| d.submesh.positions[rim.vertices[i] as usize])))
        .collect();
    let mut ends = found[0];
    ends.sort_by(|a, b| a[1].total_cmp(&b[1]));
    assert_eq!((found.len(), ends), (1, [[6.0, 2.0, 0.0], [6.0, 10.0, 0.0]]));
}

#[test]
fn holes_of_two_bodies_with_islands_that_look_at_each_other_are_no_ring() {
    // Two domes face to face, each with a hole and an island in it.
    let keep = |x: u8, y: u8| x.min(y) < 2 || x.max(y) > 13 || [(7, 7), (8, 7), (7, 8), (8, 8)].contains(&(x, y));
    let dome = |[x, y, _]: [f32; 3]| [x, y, -0.1 * ((x - 8.0) * (x - 8.0) + (y - 8.0) * (y - 8.0))];
    let one = moved(16, keep, dome);
    // Turned half around the x axis, above.
    let other: Vec<Corners> = one.iter().map(|t| t.map(|[x, y, z]| [x, 16.0 - y, 3.0 - z])).collect();
    let found = classes(&[one, other].concat(), false);
    assert_eq!(found.iter().filter(|c| **c == Island).count(), 4, "{found:?}");
}
