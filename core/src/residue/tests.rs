//! A floor and a slope that a few passes cut: heights are known from the tool's outline alone.

use super::profile::Profile;
use super::sweep::nearest;
use super::{Corrections, Cuts, Error, Found, Kind, Mesh, Options, find, repair};
use crate::curves::vector::{Point, add, scale, sub};
use crate::toolpath::{Kind as Way, Move, Moves, Shape, Tool};

const UP: Point = [0.0, 0.0, 1.0];

fn cuts(lines: &[[Point; 2]]) -> Moves {
    let mut moves = Moves::default();
    let mut last = [0.0; 3];
    for [from, to] in lines {
        let one = Move { from: last, to: *from, kind: Way::Rapid, axis: UP, tool: 1, feed: 0.0, line: 1 };
        moves.push(&one);
        moves.push(&Move { from: *from, to: *to, kind: Way::Feed, ..one });
        last = *to;
    }
    moves
}

/// Passes along Y, a millimetre apart along X, over a floor at 0.
fn floor() -> Moves {
    cuts(&(0..7).map(|k| [[f64::from(k), 0.0, 0.0], [f64::from(k), 10.0, 0.0]]).collect::<Vec<_>>())
}

/// A grid over the passes and a little beyond, a quarter of a millimetre wide, each vertex where a ball of radius 3 leaves the part.
fn scallops() -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let (columns, rows) = (33, 45);
    let mut points = Vec::new();
    for (j, i) in (0..rows).flat_map(|j| (0..columns).map(move |i| (j, i))) {
        let (x, y) = (f64::from(i) * 0.25 - 1.0, f64::from(j) * 0.25 - 0.5);
        let away = |k: i32| (x - f64::from(k)).hypot((y - y.clamp(0.0, 10.0)).abs());
        let near = (0..7).map(away).fold(f64::INFINITY, f64::min);
        points.push([x, y, 3.0 - (9.0 - near * near).sqrt()].map(|x| x as f32));
    }
    let at = |i: i32, j: i32| (j * columns + i) as u32;
    let cells = (0..rows - 1).flat_map(|j| (0..columns - 1).map(move |i| (i, j)));
    let faces = cells
        .flat_map(|(i, j)| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]])
        .collect();
    (points, faces)
}

fn search(moves: &Moves, shape: Shape, options: &Options<'_>) -> Result<Found, Error> {
    let (points, faces) = scallops();
    let cuts = Cuts::new(moves, &[Tool::new(1, shape, 6.0)], options.go_on)?;
    find(Mesh { points: &points, faces: &faces }, &cuts, options)
}

/// Ripples are as high as r − √(r² − s²/4), a step apart, and lie between the first and the last pass and within their length.
#[test]
fn ripples_of_a_floor() {
    let found = search(&floor(), Shape::Ball, &Options::default()).expect("a search");
    let (points, faces) = scallops();
    let [region] = &found.regions[..] else { panic!("{:?}", found.regions) };
    assert_eq!(region.kind, Kind::Ripples);
    assert!((region.height - (3.0 - 8.75f64.sqrt())).abs() < 1e-4 && (region.pitch - 1.0).abs() < 1e-5, "{region:?}");
    for (face, label) in faces.iter().zip(&found.labels) {
        let middle = face.iter().map(|v| points[*v as usize].map(f64::from)).fold([0.0; 3], add);
        let [x, y, _] = scale(middle, 1.0 / 3.0);
        let is_within = x > 0.0 && x < 6.0 && y > 0.0 && y < 10.0;
        // A cell at the corner of two borders may fall to either side.
        let is_corner = !(0.25..=5.75).contains(&x) && !(0.25..=9.75).contains(&y);
        assert!(is_corner || is_within == (*label != u32::MAX), "{x} {y} {label}");
    }
}

/// The repair is flat at 0, and all that is outside or on a border has the same bits.
#[test]
fn the_floor_is_flat_again() {
    let found = search(&floor(), Shape::Ball, &Options::default()).expect("a search");
    let (points, faces) = scallops();
    let repaired = repair(Mesh { points: &points, faces: &faces }, &found, &Options::default()).expect("a repair");
    for (vertex, (place, is_fixed)) in repaired.points.iter().zip(&repaired.is_fixed).enumerate() {
        if *is_fixed {
            assert_eq!(place.map(f32::to_bits), points[vertex].map(f32::to_bits));
        } else {
            assert!(place[2].abs() < 1e-6, "{place:?}");
        }
    }
    assert!(repaired.moved > 600 && repaired.volume < 0.0);
    assert!((repaired.displacement - (3.0 - 8.75f64.sqrt())).abs() < 1e-5);
}

/// A floor meets a slope of 1 in 10, and passes are far apart on the floor and near on the slope: what lies between two passes is not
/// believed to be deeper than both of them, whatever the slope beside them is.
#[test]
fn uneven_passes_make_no_hollow() {
    let (floor, slope) = ((0..5).map(|k| 1.1 * f64::from(k) - 4.4), (1..12).map(|k| 0.15 * f64::from(k)));
    let passes: Vec<[f64; 2]> = floor.map(|x| [x, 0.0]).chain(slope.map(|x| [x, 0.1 * x])).collect();
    let moves = cuts(&passes.iter().map(|[x, z]| [[*x, 0.0, *z], [*x, 10.0, *z]]).collect::<Vec<_>>());
    // The lower side of a tool with a radius of 2 and a corner of 1.
    let rise = |far: f64| if far < 2.0 { 1.0 - (1.0 - (far - 1.0).max(0.0).powi(2)).sqrt() } else { f64::INFINITY };
    let (columns, rows) = (61, 11);
    let mut points = Vec::new();
    for (j, i) in (0..rows).flat_map(|j| (0..columns).map(move |i| (j, i))) {
        let (x, y) = (f64::from(i) * 0.1 - 4.4, f64::from(j));
        let z = passes.iter().map(|[at, z]| z + rise((x - at).abs())).fold(f64::INFINITY, f64::min);
        points.push([x, y, z].map(|x| x as f32));
    }
    let cuts = Cuts::new(&moves, &[Tool::new(1, Shape::BullNose { corner: 1.0 }, 4.0)], &|| true).expect("cuts");
    let found = find(Mesh { points: &points, faces: &[] }, &cuts, &Options::default()).expect("a search");
    let known: Vec<f32> = found.targets.iter().map(|target| target[2]).filter(|z| z.is_finite()).collect();
    let least = known.iter().copied().fold(f32::INFINITY, f32::min);
    assert!(known.len() > points.len() / 2 && least > -0.001, "{} of {}, {least}", known.len(), points.len());
}

/// A flat tool leaves nothing on a floor, and what a ball left there is not its work.
#[test]
fn a_flat_tool_leaves_no_ripples() {
    let found = search(&floor(), Shape::Flat, &Options::default()).expect("a search");
    assert!(found.regions.is_empty() && found.labels.iter().all(|label| *label == u32::MAX));
}

/// Boxes, lists and masks count more than what is found, in this order.
#[test]
fn corrections_count() {
    let (_, faces) = scallops();
    let mask: Vec<bool> = (0..faces.len()).map(|face| face != 1500).collect();
    let exclude = [[[-9.0; 3], [2.0, 99.0, 9.0]]];
    let corrections = Corrections { exclude: &exclude, triangles: &[0], mask: &mask, ..Corrections::default() };
    let found = search(&floor(), Shape::Ball, &Options { corrections, ..Options::default() }).expect("a search");
    let plain = search(&floor(), Shape::Ball, &Options::default()).expect("a search");
    assert!(plain.labels[1500] != u32::MAX && plain.labels[0] == u32::MAX);
    assert!(found.labels[1500] == u32::MAX && found.labels[0] != u32::MAX);
    let count = |found: &Found| found.labels.iter().filter(|label| **label != u32::MAX).count();
    assert!(count(&found) < count(&plain) * 3 / 4);
}

/// Refusals: no cut, an unknown tool, a caller who stops, a triangle without a vertex, a mask of another mesh.
#[test]
fn refusals() {
    let ball = Shape::Ball;
    assert_eq!(search(&cuts(&[]), ball, &Options::default()).err(), Some(Error::NoCuts));
    assert_eq!(search(&floor(), ball, &Options { go_on: &|| false, ..Options::default() }).err(), Some(Error::Stopped));
    let (points, faces) = scallops();
    let mesh = Mesh { points: &points, faces: &faces };
    assert_eq!(Cuts::new(&floor(), &[], &|| true).err(), Some(Error::Tool(1)));
    let cuts = Cuts::new(&floor(), &[Tool::new(1, ball, 6.0)], &|| true).expect("cuts");
    assert_eq!(find(mesh, &cuts, &Options { go_on: &|| false, ..Options::default() }).err(), Some(Error::Stopped));
    let corrections = Corrections { mask: &[true], ..Corrections::default() };
    let options = Options { corrections, ..Options::default() };
    assert_eq!(search(&floor(), ball, &options).err(), Some(Error::Mask { mask: 1, faces: faces.len() }));
    let mesh = Mesh { points: &points, faces: &[[0, 1, 9999]] };
    assert_eq!(find(mesh, &cuts, &Options::default()).err(), Some(Error::Vertex(0)));
}

proptest::proptest! {
    /// The cut that the hierarchy finds is as near as the nearest of all, for upright and for leaning tools.
    #[test]
    fn the_hierarchy_misses_nothing(
        ends in proptest::collection::vec((-9.0..9.0f64, -9.0..9.0f64, -3.0..3.0f64), 4..60),
        form in 0..4usize,
        lean in 0.0..0.9f64,
        x in -9.0..9.0f64, y in -9.0..9.0f64, z in -9.0..3.0f64,
    ) {
        let axis = if lean < 0.4 { UP } else { [lean, 0.0, (1.0 - lean * lean).sqrt()] };
        let shape = [Shape::Ball, Shape::Flat, Shape::BullNose { corner: 0.5 }, Shape::Drill { angle: 118.0 }][form];
        let tool = Tool::new(1, shape, 3.0);
        let mut moves = Moves::default();
        let ends: Vec<Point> = ends.iter().map(|(x, y, z)| [*x, *y, *z]).collect();
        for pair in ends.windows(2) {
            moves.push(&Move { from: pair[0], to: pair[1], kind: Way::Feed, axis, tool: 1, feed: 0.0, line: 1 });
        }
        let cuts = Cuts::new(&moves, std::slice::from_ref(&tool), &|| true).expect("cuts");
        let profile = Profile::new(&tool, axis == UP).expect("a tool");
        let point = [x, y, z];
        // Samples along each move; between two of them the tool moves by less than 0.04.
        let mut least = f64::INFINITY;
        for pair in ends.windows(2) {
            for step in 0..=700 {
                let tip = add(pair[0], scale(sub(pair[1], pair[0]), f64::from(step) / 700.0));
                least = least.min(profile.depth(sub(point, tip), axis));
            }
        }
        let found = nearest(&cuts.families[0], point, 1e3, None, None, &mut Vec::new()).expect("a cut");
        proptest::prop_assert!(found.distance <= least + 1e-9 && found.distance > least - 0.04, "{} {least}", found.distance);
    }
}
