use proptest::prelude::*;

use super::*;
use crate::geometry::self_crossing::{SelfCrossing, self_crossing};
use crate::geometry::tri_tri::Triangle;
use crate::util::ids::NONE;
use crate::util::parallel::in_pool;

/// A torus of n × n squares with bumps of a height.
fn torus(n: u32, bumps: f64) -> (Vec<Point>, Vec<[u32; 3]>) {
    let angle = |i: u32| f64::from(i) / f64::from(n) * std::f64::consts::TAU;
    let point = |i: u32| {
        let (u, v) = (angle(i / n), angle(i % n));
        let r = 1.0 + bumps * (5.0 * u).sin() * (3.0 * v).cos();
        let out = 3.0 + r * v.cos();
        [out * u.cos(), out * u.sin(), r * v.sin()].map(|x| x as f32)
    };
    let at = |i: u32, j: u32| i % n * n + j % n;
    let squares = (0..n * n).map(|s| (s / n, s % n));
    let faces = squares.flat_map(|(i, j)| {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[a, b, c], [a, c, d]]
    });
    ((0..n * n).map(point).collect(), faces.collect())
}

fn all<'a>(points: &'a [Point], faces: &'a [[u32; 3]]) -> Input<'a> {
    Input { points, faces, region: None, fixed: None, within: None }
}

fn triangles(points: &[Point], faces: &[[u32; 3]]) -> Vec<Triangle> {
    faces.iter().map(|f| f.map(|v| points[v as usize])).collect()
}

/// Each edge is run along once each way.
fn is_closed(faces: &[[u32; 3]]) -> bool {
    let mut edges: Vec<[u32; 2]> = faces.iter().flat_map(|f| [[f[0], f[1]], [f[1], f[2]], [f[2], f[0]]]).collect();
    edges.sort_unstable();
    edges.windows(2).all(|two| two[0] != two[1]) && edges.iter().all(|e| edges.binary_search(&[e[1], e[0]]).is_ok())
}

#[test]
fn a_torus_in_many_cells_stays_a_torus() {
    let (points, faces) = torus(40, 0.1);
    let options = Options { triangles: Some(800), ..Options::default() };
    let outcome = in_cells(&all(&points, &faces), &options, 200).unwrap();
    assert!(is_closed(&outcome.faces));
    assert_eq!(outcome.points.len(), outcome.faces.len() / 2, "Euler's number is 0, as that of the input");
    // The last collapse takes two triangles.
    assert!((799..=800).contains(&outcome.faces.len()) && outcome.ended == Ended::Count, "{}", outcome.faces.len());
    assert_eq!(self_crossing(&triangles(&outcome.points, &outcome.faces), u64::MAX), SelfCrossing::None);
}

#[test]
fn the_result_does_not_depend_on_threads() {
    let (points, faces) = torus(40, 0.1);
    let options = Options { triangles: Some(900), ..Options::default() };
    let with = |threads: usize| in_pool(threads, || in_cells(&all(&points, &faces), &options, 150).unwrap());
    let (one, four) = (with(1), with(4));
    assert_eq!((one.points, one.faces, one.proved), (four.points, four.faces, four.proved));
}

#[test]
fn a_deviation_is_kept_and_a_larger_one_leaves_less() {
    let (points, faces) = torus(40, 0.1);
    let left = [0.002, 0.01, 0.05].map(|d| {
        let options = Options { max_deviation: Some(d), ..Options::default() };
        let outcome = in_cells(&all(&points, &faces), &options, 300).unwrap();
        let proved = outcome.proved.unwrap();
        assert!(proved.forward.max(proved.backward) <= d);
        outcome.faces.len()
    });
    assert!(left[0] > left[1] && left[1] > left[2] && left[2] < faces.len() / 3, "{left:?}");
}

/// Where the deviation was missed, something is done again, and the mesh stays one that is closed and does not cross itself; a proof of all of it says
/// what the proofs of its parts said.
#[test]
fn places_that_miss_a_deviation_are_done_again() {
    let (points, faces) = torus(60, 0.3);
    let open: Vec<u32> = (0..points.len() as u32).collect();
    for (wanted, most) in [(None, 0.05), (Some(900), 0.05)] {
        let options = Options { triangles: wanted, max_deviation: Some(most), ..Options::default() };
        let with = |threads: usize| in_pool(threads, || in_cells(&all(&points, &faces), &options, 300).unwrap());
        let outcome = with(1);
        assert!(outcome.attempts > 1, "nothing was missed");
        assert!(is_closed(&outcome.faces) && outcome.points.len() == outcome.faces.len() / 2, "a torus");
        assert_eq!(self_crossing(&triangles(&outcome.points, &outcome.faces), u64::MAX), SelfCrossing::None);
        let pairing = proof::Pairing {
            points: &points,
            faces: &faces,
            new_points: &outcome.points,
            new_faces: &outcome.faces,
            became: &outcome.became,
            open: &open,
        };
        let proved = [outcome.proved.unwrap(), proof::prove(&pairing, most, most).proved];
        assert!(proved.iter().all(|proved| proved.forward.max(proved.backward) <= most), "{proved:?}");
        assert!(outcome.faces.len() < faces.len() / 3, "{}", outcome.faces.len());
        let four = with(4);
        assert_eq!((outcome.points, outcome.faces, outcome.became), (four.points, four.faces, four.became));
    }
}

/// Of a smooth surface, as many triangles are left as the reciprocal of the deviation, also where each vertex that is left stands for forty: to do far places
/// again then parts nearly the whole mesh, each time for others.
#[test]
fn coarse_places_that_miss_a_deviation_do_not_make_the_rest_fine() {
    let (points, faces) = torus(150, 0.3);
    let left = [0.03, 0.06].map(|d| {
        let options = Options { max_deviation: Some(d), ..Options::default() };
        let outcome = simplify(&all(&points, &faces), &options).unwrap();
        assert!(outcome.attempts > 1 && outcome.attempts < 5, "{}", outcome.attempts);
        outcome.faces.len()
    });
    assert!(left[1] as f64 <= 0.55 * left[0] as f64, "{left:?}");
}

/// A count that the deviation keeps out of reach changes nothing: quadrics that were made anew for it would not know how far the mesh is already.
#[test]
fn a_count_out_of_reach_leaves_as_much_as_the_deviation_alone() {
    let (points, faces) = torus(60, 0.3);
    let left = |triangles: Option<usize>, cell: usize| {
        let options = Options { triangles, max_deviation: Some(0.1), ..Options::default() };
        in_cells(&all(&points, &faces), &options, cell).unwrap().faces.len()
    };
    assert_eq!(left(Some(4), CELL), left(None, CELL));
    let (with, without) = (left(Some(4), 1200), left(None, 1200));
    assert!(with * 20 <= without * 21, "{with} {without}");
}

/// The first round has a margin above the whole, and nothing to do; half of the mesh stays, and is not counted on.
#[test]
fn a_count_just_below_the_whole_is_reached() {
    let (points, faces) = torus(40, 0.1);
    let region: Vec<bool> = (0..faces.len()).map(|f| f < faces.len() / 2).collect();
    for (region, wanted) in [(None, 3100), (Some(&region[..]), 3100), (Some(&region[..]), 2200)] {
        let options = Options { triangles: Some(wanted), ..Options::default() };
        let outcome = in_cells(&Input { region, ..all(&points, &faces) }, &options, 200).unwrap();
        assert!((wanted - 1..=wanted).contains(&outcome.faces.len()), "{} of {wanted}", outcome.faces.len());
    }
}

/// A tube stays as round as a hundredth of its size wants it, though one triangle is asked for.
#[test]
fn a_count_out_of_reach_does_not_cost_the_shape() {
    let (points, faces) = torus(40, 0.1);
    let diagonal = Bounds::of(&points).diagonal();
    let options = Options { triangles: Some(1), ..Options::default() };
    let outcome = in_cells(&all(&points, &faces), &options, 300).unwrap();
    let proved = outcome.proved.unwrap();
    assert!(proved.forward.max(proved.backward) <= 0.01 * diagonal && outcome.ended == Ended::Both, "{:?}", outcome.ended);
    let free = Options { max_deviation: Some(f64::INFINITY), ..options };
    let farther = in_cells(&all(&points, &faces), &free, 300).unwrap();
    assert!(farther.faces.len() < outcome.faces.len() && farther.ended == Ended::Edges);
}

#[test]
fn the_volume_is_told() {
    let (points, faces) = torus(40, 0.0);
    let options = Options { triangles: Some(800), ..Options::default() };
    let outcome = in_cells(&all(&points, &faces), &options, 300).unwrap();
    // 2π²Rr² of the round torus; a polygon of forty corners has less.
    let whole = 2.0 * std::f64::consts::PI.powi(2) * 3.0;
    let [before, after] = outcome.volume.map(|v| v / whole);
    assert!((0.98..1.0).contains(&before) && (0.95..before).contains(&after), "{before} {after}");
}

#[test]
fn what_may_not_change_has_the_same_bits() {
    let (points, faces) = torus(30, 0.1);
    let region: Vec<bool> = (0..faces.len()).map(|f| f < faces.len() / 2).collect();
    let options = Options { triangles: Some(0), max_deviation: Some(f64::INFINITY), ..Options::default() };
    let outcome = in_cells(&Input { region: Some(&region), ..all(&points, &faces) }, &options, 200).unwrap();
    let kept: Vec<u32> = outcome.origins.iter().copied().filter(|f| *f != NONE).collect();
    let outside: Vec<u32> = (faces.len() as u32 / 2..faces.len() as u32).collect();
    assert!(outside.iter().all(|f| kept.contains(f)));
    for (face, origin) in outcome.faces.iter().zip(&outcome.origins).filter(|(_, origin)| **origin != NONE) {
        let was = faces[*origin as usize].map(|v| points[v as usize]);
        assert_eq!(face.map(|v| outcome.points[v as usize]), was);
    }
    assert!(outcome.faces.len() < faces.len() * 2 / 3);
}

/// A cube whose sides are grids: with features, its twelve edges stay, and its volume with them.
#[test]
fn edges_of_a_cube_stay_where_they_are() {
    let n = 8_u32;
    let mut soup: Vec<Triangle> = Vec::new();
    for (axis, side) in (0..3).flat_map(|axis| [(axis, 0_u32), (axis, n)]) {
        let at = |i: u32, j: u32| {
            let mut p = [0.0; 3];
            p[axis] = side as f32;
            // The sides at the far end are turned round.
            let (x, y) = if side == 0 { (j, i) } else { (i, j) };
            (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (x as f32, y as f32);
            p
        };
        for (i, j) in (0..n * n).map(|s| (s / n, s % n)) {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            soup.extend([[a, b, c], [a, c, d]]);
        }
    }
    let mut points: Vec<Point> = soup.iter().flatten().copied().collect();
    points.sort_by(|a, b| a.partial_cmp(b).unwrap());
    points.dedup();
    let number = |p: &Point| points.iter().position(|q| q == p).unwrap() as u32;
    let faces: Vec<[u32; 3]> = soup.iter().map(|t| [number(&t[0]), number(&t[1]), number(&t[2])]).collect();
    assert!(is_closed(&faces));
    let options = Options { feature_angle: Some(0.5), max_deviation: Some(1e-3), ..Options::default() };
    let outcome = simplify(&all(&points, &faces), &options).unwrap();
    assert!(outcome.faces.len() <= 40, "{}", outcome.faces.len());
    let proved = outcome.proved.unwrap();
    assert!(proved.forward.max(proved.backward) < 1e-6, "only rounding: {proved:?}");
    let is_on_edge = |p: &Point| p.iter().filter(|x| **x == 0.0 || **x == n as f32).count() >= 2;
    assert!(points.iter().filter(|p| p.iter().all(|x| *x == 0.0 || *x == n as f32)).all(|p| outcome.points.contains(p)));
    assert!(is_closed(&outcome.faces) && outcome.points.iter().filter(|p| is_on_edge(p)).count() >= 8);
}

/// Half a pipe of n × n squares, open on all sides.
fn half_pipe(n: u32) -> (Vec<Point>, Vec<[u32; 3]>) {
    let m = n + 1;
    let angle = |i: u32| f64::from(i) / f64::from(n) * std::f64::consts::PI;
    let point = |i: u32| [(angle(i % m).cos()) as f32, (angle(i % m).sin()) as f32, (i / m) as f32 * 3.0 / n as f32];
    let squares = (0..m * m).filter(|i| i % m < n && i / m < n);
    ((0..m * m).map(point).collect(), squares.flat_map(|a| [[a, a + 1, a + m + 1], [a, a + m + 1, a + m]]).collect())
}

/// Edges that are run along once, from their beginnings.
fn rim(faces: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let edges: Vec<[u32; 2]> = faces.iter().flat_map(|f| [[f[0], f[1]], [f[1], f[2]], [f[2], f[0]]]).collect();
    edges.iter().copied().filter(|e| !edges.contains(&[e[1], e[0]])).collect()
}

/// The rim of a sheet gets fewer vertices, too, stays one loop, and as near to the old one as the surface.
#[test]
fn a_rim_collapses_along_itself() {
    let (points, faces) = half_pipe(24);
    let options = Options { max_deviation: Some(0.02), ..Options::default() };
    for cell in [80, 1000] {
        let outcome = in_cells(&all(&points, &faces), &options, cell).unwrap();
        let proved = outcome.proved.unwrap();
        assert!(proved.forward.max(proved.backward) <= 0.02, "{proved:?}");
        let mut left = rim(&outcome.faces);
        assert!(left.len() < 96 / 2, "{} of 96 edges", left.len());
        let (mut at, mut steps) = (left[0][0], 0);
        while let Some(next) = left.iter().position(|e| e[0] == at) {
            (at, steps) = (left.swap_remove(next)[1], steps + 1);
        }
        assert!(left.is_empty() && steps > 3, "one loop");
        let vertices = outcome.points.len() as i64;
        let edges = (3 * outcome.faces.len() as i64 + steps) / 2;
        assert_eq!(vertices - edges + outcome.faces.len() as i64, 1, "a disc");
        // The places that are wanted on the straight sides and the round ones.
        for [v, w] in rim(&outcome.faces) {
            for p in [v, w].map(|v| outcome.points[v as usize]) {
                let off = |x: f32, y: f32| f64::from(x - y).abs();
                let straight = off(p[1], 0.0).hypot(off(p[0].abs(), 1.0));
                let round = off(p[2], 0.0).min(off(p[2], 3.0)).hypot(f64::from(p[0]).hypot(f64::from(p[1])) - 1.0);
                assert!(straight.min(round) < 0.04, "{p:?}");
            }
        }
        assert_eq!(self_crossing(&triangles(&outcome.points, &outcome.faces), u64::MAX), SelfCrossing::None);
    }
}

/// How many triangles are left of a closed mesh if four are asked for.
fn left_of(points: &[Point], faces: &[[u32; 3]], feature_angle: Option<f64>) -> usize {
    assert!(is_closed(faces));
    let options = Options { triangles: Some(4), feature_angle, ..Options::default() };
    let outcome = simplify(&all(points, faces), &options).unwrap();
    assert!(is_closed(&outcome.faces));
    assert_eq!(self_crossing(&triangles(&outcome.points, &outcome.faces), u64::MAX), SelfCrossing::None);
    let proved = outcome.proved.unwrap();
    assert!(proved.forward.max(proved.backward) <= 0.01 * Bounds::of(points).diagonal());
    outcome.faces.len()
}

/// A box whose floor and roof are n × n squares, with walls of one row.
fn thin_box(n: u32, side: f32, height: f32) -> (Vec<Point>, Vec<[u32; 3]>) {
    let m = n + 1;
    let at = |i: u32, j: u32, k: u32| (k * m + j) * m + i;
    let point = |v: u32| [(v % m) as f32 * side, (v / m % m) as f32 * side, (v / m / m) as f32 * height];
    let mut faces = Vec::new();
    let mut square = |[a, b, c, d]: [u32; 4]| faces.extend([[a, b, c], [a, c, d]]);
    for (i, j) in (0..n * n).map(|s| (s % n, s / n)) {
        square([at(i, j, 0), at(i, j + 1, 0), at(i + 1, j + 1, 0), at(i + 1, j, 0)]);
        square([at(i, j, 1), at(i + 1, j, 1), at(i + 1, j + 1, 1), at(i, j + 1, 1)]);
    }
    for i in 0..n {
        square([at(i, 0, 0), at(i + 1, 0, 0), at(i + 1, 0, 1), at(i, 0, 1)]);
        square([at(i + 1, n, 0), at(i, n, 0), at(i, n, 1), at(i + 1, n, 1)]);
        square([at(0, i + 1, 0), at(0, i, 0), at(0, i, 1), at(0, i + 1, 1)]);
        square([at(n, i, 0), at(n, i + 1, 0), at(n, i + 1, 1), at(n, i, 1)]);
    }
    ((0..2 * m * m).map(point).collect(), faces)
}

/// A ball of so many sides and rows.
fn ball(sides: u32, rows: u32) -> (Vec<Point>, Vec<[u32; 3]>) {
    let mut points: Vec<Point> = vec![[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]];
    let mut faces = Vec::new();
    let at = |i: u32, j: u32| match j {
        0 => 0,
        j if j == rows => 1,
        j => 2 + (j - 1) * sides + i % sides,
    };
    for (j, i) in (1..rows).flat_map(|j| (0..sides).map(move |i| (j, i))) {
        let (turn, up) =
            (f64::from(i) / f64::from(sides) * std::f64::consts::TAU, f64::from(j) / f64::from(rows) * std::f64::consts::PI);
        points.push([up.sin() * turn.cos(), up.sin() * turn.sin(), -up.cos()].map(|x| x as f32));
    }
    for (j, i) in (0..rows).flat_map(|j| (0..sides).map(move |i| (j, i))) {
        let square = [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]];
        faces.extend(square.into_iter().filter(|[a, b, c]| a != b && b != c && c != a));
    }
    (points, faces)
}

/// Walls become two triangles each, or nearly, and as high as before, however low they are.
#[test]
fn thin_parts_get_fewer_triangles_as_thick_ones_do() {
    for (n, side, height) in [(20, 5.0, 0.001), (20, 5.0, 1e-5), (1, 1000.0, 0.25), (20, 5.0, 5.0)] {
        let (points, faces) = thin_box(n, side, height);
        let left = left_of(&points, &faces, Some(0.5));
        assert!((12..=16).contains(&left), "{left} of {n} {side} {height}");
    }
}

/// Triangles are needles here, and their number comes from the sides.
#[test]
fn a_ball_of_needles_gets_fewer_triangles() {
    for (sides, rows) in [(600, 6), (1500, 3)] {
        let (points, faces) = ball(sides, rows);
        let left = left_of(&points, &faces, None);
        assert!(left < 200, "{left} of {}", faces.len());
    }
}

/// The same mesh at another scale becomes the same mesh at that scale, however small or large it is.
#[test]
fn the_result_does_not_depend_on_the_scale() {
    let (points, faces) = torus(40, 0.1);
    // Without digits that are lost where numbers are as small as they can be.
    let points: Vec<Point> = points.iter().map(|p| p.map(|x| (x * 4096.0).round() / 4096.0)).collect();
    let options = Options { triangles: Some(800), ..Options::default() };
    let at = |exponent: i32| {
        let scale = |points: &[Point], by: f32| points.iter().map(|p| p.map(|x| x * by)).collect::<Vec<Point>>();
        let points = scale(&points, 2.0_f32.powi(exponent));
        let outcome = in_cells(&all(&points, &faces), &options, 200).unwrap();
        (scale(&outcome.points, 2.0_f32.powi(-exponent)), outcome.faces)
    };
    let usual = at(0);
    assert_eq!(usual.1.len(), 800);
    for exponent in [-80, -60, 60, 110] {
        assert!(at(exponent) == usual, "2^{exponent}");
    }
}

/// With features, a rim keeps its corners: of a flat sheet, two triangles are left.
#[test]
fn a_flat_sheet_becomes_two_triangles() {
    let n = 9_u32;
    let points: Vec<Point> = (0..n * n).map(|i| [(i % n) as f32, (i / n) as f32, 0.0]).collect();
    let squares = (0..n * n).filter(|i| i % n + 1 < n && i / n + 1 < n);
    let faces: Vec<[u32; 3]> = squares.flat_map(|a| [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]]).collect();
    let options = Options { max_deviation: Some(1e-3), feature_angle: Some(0.5), ..Options::default() };
    let outcome = simplify(&all(&points, &faces), &options).unwrap();
    assert_eq!(outcome.faces.len(), 2);
    assert!(outcome.proved.is_some_and(|proved| proved.forward.max(proved.backward) < 1e-6));
}

#[test]
fn what_is_no_mesh_is_refused() {
    let refused = |points: &[Point], faces: &[[u32; 3]]| simplify(&all(points, faces), &Options::default()).err();
    assert_eq!(refused(&[[0.0; 3]; 3], &[[0, 1, 2], [0, 1, 3]]), Some(Error::NoVertex(1)));
    assert_eq!(refused(&[[0.0; 3], [f32::NAN, 0.0, 0.0]], &[]), Some(Error::NotFinite(1)));
    assert_eq!(refused(&[], &[]), None);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    /// Two sheets, bent alike and nearer to each other than the bends are high, so that collapses would make them cross.
    #[test]
    fn sheets_that_are_near_each_other_do_not_cross(heights in prop::collection::vec(0u8..8, 144), gap in 0.02f32..0.3, left in 40usize..300) {
        let n = 12_u32;
        let mut points: Vec<Point> = Vec::new();
        let mut faces = Vec::new();
        for sheet in 0..2 {
            let height = |i: u32| f32::from(heights[i as usize]) / 8.0 + gap * sheet as f32;
            points.extend((0..n * n).map(|i| [(i % n) as f32, (i / n) as f32, height(i)]));
            let squares = (0..n * n).filter(|i| i % n + 1 < n && i / n + 1 < n);
            faces.extend(squares.map(|i| i + sheet * n * n).flat_map(|a| [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]]));
        }
        prop_assert_eq!(self_crossing(&triangles(&points, &faces), u64::MAX), SelfCrossing::None);
        let options = Options { triangles: Some(left), max_deviation: Some(f64::INFINITY), ..Options::default() };
        let outcome = in_cells(&all(&points, &faces), &options, 100).unwrap();
        prop_assert_eq!(self_crossing(&triangles(&outcome.points, &outcome.faces), u64::MAX), SelfCrossing::None);
        prop_assert!(outcome.faces.len() < faces.len());
    }

    /// Any faces between a few points: nothing breaks, and what is called unchanged is.
    #[test]
    fn faces_without_sense_break_nothing(p in prop::collection::vec(prop::array::uniform3(-3i8..4), 1..12), f in prop::collection::vec(prop::array::uniform3(0u32..12), 0..40), cell in 1usize..9) {
        let points: Vec<Point> = p.iter().map(|v| v.map(f32::from)).collect();
        let faces: Vec<[u32; 3]> = f.iter().map(|f| f.map(|v| v % points.len() as u32)).collect();
        let options = Options { triangles: Some(2), ..Options::default() };
        let outcome = in_cells(&all(&points, &faces), &options, cell).unwrap();
        for (face, origin) in outcome.faces.iter().zip(&outcome.origins) {
            let now = face.map(|v| outcome.points[v as usize]);
            prop_assert!(*origin == NONE || now == faces[*origin as usize].map(|v| points[v as usize]));
        }
    }
}
