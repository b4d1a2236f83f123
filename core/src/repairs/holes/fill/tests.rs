use super::*;
use crate::contract::report::LoopClass;
use crate::testing::{After, Corners, after, cube, cuboid, plate, reversed, shifted};
use proptest::prelude::*;
use std::collections::BTreeMap;

/// A cube without its top.
fn filled(profile: &Profile) -> After<Closed> {
    let mut open = cube();
    open.drain(2..4);
    after(&open, |d, _| fill(d, profile))
}

#[test]
fn an_open_cube_is_closed() {
    let got = filled(&Profile::default());
    assert_eq!((got.result.loops, got.result.left.len(), got.untouched), (1, 0, 10));
    assert!(got.verdict.good && (got.defects.volume - 1.0).abs() < 1e-9, "{:?}", got.verdict);
}

#[test]
fn what_the_profile_does_not_admit_is_left_and_said() {
    // The loop has four edges of length 1; the diagonal is 1.73.
    let few_edges = Profile { max_hole_edges: 3, ..Profile::default() };
    let short = Profile { max_hole_perimeter_relative: 2.0, ..Profile::default() };
    let none = Profile { fill_holes: false, ..Profile::default() };
    for (profile, words) in [(few_edges, "3 edges"), (short, "longer"), (none, "fills no holes")] {
        let got = filled(&profile);
        assert_eq!((got.result.loops, got.result.left.len(), got.defects.boundary_edges), (0, 1, 4));
        assert!(got.result.left[0].reason.contains(words), "{}", got.result.left[0].reason);
        assert_eq!((got.result.left[0].edges, got.result.left[0].perimeter), (4, 4.0));
    }
}

#[test]
fn holes_that_meet_in_a_vertex_leave_one_fan_there() {
    let pinched = plate(4, |x, y| !(x == y && (1..3).contains(&x)));
    // The plate's own rim, of 16 edges, stays open.
    let profile = Profile { max_hole_edges: 4, ..Profile::default() };
    let got = after(&pinched, |d, _| {
        assert_eq!(d.defects.nonmanifold_vertices, 1, "a bow-tie");
        fill(d, &profile).loops
    });
    assert_eq!((got.result, got.defects.nonmanifold_vertices, got.defects.boundary_loops), (2, 0, 1));
}

/// A globe of radius 10 without its cap: rows of 7.5° from the pole, 48 columns.
fn open_globe() -> Vec<Corners> {
    let at = |i: u8, j: u8| {
        let (polar, turn) = (f32::from(i) * std::f32::consts::PI / 24.0, f32::from(j % 48) * std::f32::consts::TAU / 48.0);
        if i == 24 {
            return [0.0, 0.0, -10.0];
        }
        [10.0 * polar.sin() * turn.cos(), 10.0 * polar.sin() * turn.sin(), 10.0 * polar.cos()]
    };
    let quad = |i, j| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]];
    let all = (4..24).flat_map(|i| (0..48).flat_map(move |j| quad(i, j)));
    all.filter(|[a, b, c]| a != b && b != c && c != a).collect()
}

#[test]
fn a_patch_continues_the_globe() {
    let got = after(&open_globe(), |d, _| {
        let closed = fill(d, &Profile::default());
        let new: Vec<f64> = d.submesh.positions.iter().map(|p| crate::geometry::distance::place(*p).length()).collect();
        (closed, new.into_iter().map(|r| (r - 10.0).abs()).fold(0.0, f64::max))
    });
    assert!(got.verdict.good, "{:?}", got.verdict);
    assert_eq!(got.result.0.by_method, BTreeMap::from([("planar (shaped like what is around)".into(), 1)]));
    // A flat cap would leave 1.3 of height out; the facets of the globe leave 0.021.
    assert!(got.result.1 < 0.03, "{}", got.result.1);
    let flat = Profile { patch_shape: PatchShape::Flat, ..Profile::default() };
    let got = after(&open_globe(), |d, _| fill(d, &flat));
    assert_eq!(got.result.by_method, BTreeMap::from([("planar".into(), 1)]));
}

#[test]
fn a_shape_that_crosses_another_body_is_given_up_for_a_patch_that_does_not() {
    // The cap's plane is at 8.66, the globe ends at 10.
    let needle = cuboid([-0.1, -0.1, 9.5], [0.1, 0.1, 12.0]);
    let got = after(&[open_globe(), needle].concat(), |d, _| fill(d, &Profile::default()));
    assert_eq!(got.result.by_method, BTreeMap::from([("planar".into(), 1)]));
    assert!(got.verdict.good, "{:?}", got.verdict);
}

#[test]
fn a_loop_that_every_patch_would_close_through_another_body_stays_open() {
    let needle = cuboid([-0.1, -0.1, 5.0], [0.1, 0.1, 12.0]);
    let got = after(&[open_globe(), needle].concat(), |d, _| fill(d, &Profile::default()));
    assert_eq!((got.result.loops, got.result.left.len(), got.defects.boundary_loops), (0, 1, 1));
    assert!(got.result.left[0].reason.contains("crosses the surface around"), "{}", got.result.left[0].reason);
    assert_eq!(got.defects.self_intersections.as_ref().map(|si| si.triangles), Some(0));
}

#[test]
fn a_single_triangle_is_held_against_other_bodies_too() {
    let mut open = cube();
    open.remove(2);
    let needle = cuboid([0.6, 0.2, 0.9], [0.7, 0.3, 1.1]);
    let got = after(&[open, needle].concat(), |d, _| fill(d, &Profile::default()));
    assert_eq!((got.result.loops, got.defects.boundary_loops), (0, 1), "{:?}", got.result);
}

#[test]
fn holes_of_two_bodies_that_face_each_other_are_closed_each() {
    // Turned over around the x axis, above the other.
    let other: Vec<Corners> = open_globe().iter().map(|t| t.map(|[x, y, z]| [x, -y, 24.0 - z])).collect();
    let got = after(&[open_globe(), other].concat(), |d, _| fill(d, &Profile::default()));
    assert_eq!(got.result.by_method, BTreeMap::from([("planar (shaped like what is around)".into(), 2)]));
    assert_eq!(got.defects.components, 2);
    assert!(got.verdict.good, "{:?}", got.verdict);
}

#[test]
fn bodies_that_cross_already_are_closed_all_the_same() {
    let needle = cuboid([-0.1, -0.1, -12.0], [0.1, 0.1, 12.0]);
    let got = after(&[open_globe(), needle].concat(), |d, _| fill(d, &Profile::default()));
    assert_eq!(got.result.by_method, BTreeMap::from([("planar (across a body met already)".into(), 1)]));
    assert_eq!(got.defects.boundary_edges, 0);
}

#[test]
fn the_rim_of_a_lone_sheet_stays_open_unless_asked() {
    let hole = |x: u8, y: u8| !((2..4).contains(&x) && (2..4).contains(&y));
    let got = after(&plate(6, hole), |d, _| fill(d, &Profile::default()));
    assert_eq!((got.result.loops, got.defects.boundary_edges), (1, 24), "the hole is none");
    assert!(got.result.left[0].reason.contains("lone sheet"), "{}", got.result.left[0].reason);
    // A relief encloses something. (Without the two corners that would lie in the plane of its rim.)
    let hill: Vec<Corners> = plate(6, |x, y| x.abs_diff(y) < 5)
        .iter()
        .map(|t| t.map(|[x, y, _]| [x, y, x * (6.0 - x) * y * (6.0 - y) / 40.0]))
        .collect();
    assert_eq!(after(&hill, |d, _| fill(d, &Profile::default())).defects.boundary_edges, 0);
}

#[test]
fn a_profile_leaves_a_kind_of_loop_open() {
    let profile = Profile { leave_open: vec![LoopClass::Simple], ..Profile::default() };
    let got = filled(&profile);
    assert_eq!(got.result.left[0].reason, "the profile leaves simple loops open");
}

#[test]
fn a_side_that_lacks_beside_another_body_is_closed() {
    let open: Vec<Corners> = cube().into_iter().filter(|t| !t.iter().all(|p| p[0] == 1.0)).collect();
    let got = after(&[open, shifted(&cube(), [1.0, 1.0, 0.0])].concat(), |d, _| fill(d, &Profile::default()));
    // The bodies touch along an edge, as they are meant to.
    assert_eq!((got.result.loops, got.defects.boundary_edges, got.defects.nonmanifold_edges), (1, 0, 1), "{:?}", got.result);
    assert!((got.defects.volume - 2.0).abs() < 1e-9, "{}", got.defects.volume);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    /// Two skins with holes, islands, and corners where these meet.
    #[test]
    fn what_stays_open_is_said_and_no_edge_becomes_nonmanifold(
        gone in prop::collection::vec(any::<prop::sample::Index>(), 0..90),
        apart in prop::sample::select(vec![0.05_f32, 0.5, 3.0]),
    ) {
        let top = plate(7, |_, _| true);
        let bottom = reversed(&shifted(&top, [0.0, 0.0, -apart]));
        let mut skins = [top, bottom].concat();
        for at in gone {
            skins.swap_remove(at.index(skins.len()));
        }
        let got = after(&skins, |d, _| fill(d, &Profile::default()));
        let said: u64 = got.result.left.iter().map(|left| left.edges).sum();
        prop_assert_eq!((got.defects.boundary_edges, got.defects.nonmanifold_edges), (said, 0), "{:?}", got.result);
    }
}

/// What lies between circles about the axis: radius and height of each, upwards and outwards. The first and last one may be points.
fn turned(profile: &[[f32; 2]]) -> Vec<Corners> {
    const SIDES: u32 = 24;
    let at = |[r, z]: [f32; 2], side: u32| {
        let turn = std::f32::consts::TAU * (side % SIDES) as f32 / SIDES as f32;
        [r * turn.cos(), r * turn.sin(), z]
    };
    let between = |(low, high): (&[f32; 2], &[f32; 2]), side: u32| {
        let quad = [at(*low, side), at(*low, side + 1), at(*high, side + 1), at(*high, side)];
        [[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]
    };
    let rows = profile.iter().zip(&profile[1..]);
    let all = rows.flat_map(|row| (0..SIDES).flat_map(move |side| between(row, side)));
    all.filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]).collect()
}

#[test]
fn half_of_a_ball_is_a_doubtful_guess_and_a_tube_is_none() {
    let judged = |profile: &[[f32; 2]]| after(&turned(profile), |d, _| fill(d, &Profile::default())).result.judged;
    // From the equator to the pole.
    let half: Vec<[f32; 2]> = (0..=12)
        .map(|row| {
            let turn = std::f32::consts::FRAC_PI_2 * row as f32 / 12.0;
            [if row == 12 { 0.0 } else { turn.cos() }, turn.sin()]
        })
        .collect();
    let of_half = judged(&half);
    assert_eq!((of_half.doubts.len(), of_half.area), (1, 0.0));
    assert!(of_half.doubts[0].contains("mouth"), "{}", of_half.doubts[0]);
    // The same height in straight rows, without top and bottom.
    let tube: Vec<[f32; 2]> = (0..=12).map(|row| [1.0, row as f32 / 12.0]).collect();
    let of_tube = judged(&tube);
    assert!(of_tube.doubts.is_empty(), "{:?}", of_tube.doubts);
    // Two polygons of 24 sides.
    let lids = 24.0 * (std::f64::consts::TAU / 24.0).sin();
    assert!((of_tube.area - lids).abs() < 1e-4, "{} {lids}", of_tube.area);
}

#[test]
fn a_ragged_hole_in_both_skins_of_a_plate_is_no_way_through() {
    // Squares stand into the hole from all of its sides.
    let is_tooth =
        |x: u8, y: u8| ([4, 11].contains(&x) && [5, 7, 9].contains(&y)) || ([4, 11].contains(&y) && [6, 8].contains(&x));
    let square = |x: u8, y: u8| !((4..12).contains(&x) && (4..12).contains(&y));
    let ragged = |x: u8, y: u8| square(x, y) || is_tooth(x, y);
    let methods = |is_there: &dyn Fn(u8, u8) -> bool| {
        let low = reversed(&plate(16, is_there));
        let skins = [shifted(&plate(16, is_there), [0.0, 0.0, 0.5]), low].concat();
        let profile = Profile { max_hole_edges: 60, ..Profile::default() };
        after(&skins, |d, _| fill(d, &profile)).result.by_method
    };
    // The plate's own rim is longer than that.
    assert_eq!(methods(&ragged), BTreeMap::from([("planar".into(), 2)]));
    assert_eq!(methods(&square), BTreeMap::from([("annular".into(), 2)]));
}

/// A cube of side 10 in unit squares, of which those of three faces are missing that are less than `missing` from the corner between these.
fn corner_lost(missing: u8) -> Vec<Corners> {
    let is_there = |x: u8, y: u8| x + missing < 10 || y + missing < 10;
    let (whole, part) = (reversed(&plate(10, |_, _| true)), plate(10, is_there));
    let on = |axis: usize, at: f32, face: &[Corners]| -> Vec<Corners> {
        let place = |p: [f32; 3]| std::array::from_fn(|k| [at, p[0], p[1]][(k + 3 - axis) % 3]);
        face.iter().map(|t| t.map(place)).collect()
    };
    (0..3).flat_map(|axis| [on(axis, 0.0, &whole), on(axis, 10.0, &part)]).flatten().collect()
}

/// Half of what is missing counts, as seen from the middle of its rim: 6 % of the cube for squares up to 5 from its corner, 11 % up to 6.
#[test]
fn planes_that_are_let_go_on_around_a_tenth_of_the_body_are_a_doubtful_guess() {
    let doubts = |missing: u8, beside: &[Corners]| {
        let closed = after(&[&corner_lost(missing), beside].concat(), |d, _| fill(d, &Profile::default())).result;
        assert_eq!(closed.by_method, BTreeMap::from([("planes to where they meet".into(), 1)]), "{missing}");
        closed.judged.doubts
    };
    assert_eq!(doubts(5, &[]), Vec::<String>::new());
    let of_six = doubts(6, &[]);
    assert!(of_six.len() == 1 && of_six[0].contains("around 11 % of the body"), "{of_six:?}");
    // Nobody need look at a detail: a body of less than a tenth of all volume.
    let block = |height: f32| cuboid([20.0, 0.0, 0.0], [30.0, 10.0, height]);
    assert_eq!((doubts(6, &block(89.0)).len(), doubts(6, &block(91.0)).len()), (1, 0));
}

#[test]
fn an_end_that_breaks_off_is_a_guess_however_long_the_tube_is() {
    let rows: Vec<[f32; 2]> = (0..=60).map(|row| [1.0, row as f32 / 2.0]).collect();
    let whole = turned(&rows);
    let judged = |tube: &[Corners]| after(tube, |d, _| fill(d, &Profile::default())).result.judged;
    assert!(judged(&whole).doubts.is_empty());
    // Cut to fit another tube.
    let saddle: Vec<Corners> = whole.iter().map(|t| t.map(|[x, y, z]| [x, y, z * (1.0 + 0.01 * (x * x - y * y))])).collect();
    assert!(judged(&saddle).doubts.is_empty());
    // Of the last row, the triangles that point up are left.
    let points_up = |t: &Corners| t.iter().filter(|p| p[2] > 29.9).count() < 2;
    let ragged: Vec<Corners> = whole.iter().copied().filter(points_up).collect();
    assert_eq!(ragged.len() + 24, whole.len());
    let of_ragged = judged(&ragged);
    assert!(of_ragged.doubts.len() == 1 && of_ragged.doubts[0].contains("ragged edge"), "{:?}", of_ragged.doubts);
}
