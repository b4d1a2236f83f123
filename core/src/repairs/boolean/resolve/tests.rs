//! Small bodies that cross.

use std::collections::BTreeSet;

use crate::geometry::sums::Bounds;
use crate::repairs::boolean::meetings::meetings;
use crate::repairs::boolean::rounds::{BYTES_PER_PAIR, BYTES_PER_TRIANGLE};
use crate::repairs::boolean::state::{follow_neighbours, grown};
use crate::repairs::shared::pieces;
use crate::util::steps;
use std::path::Path;

use glam::DVec3;
use proptest::prelude::*;

use super::*;
use crate::contract::progress::Quiet;
use crate::contract::report::RegionMethod;
use crate::contract::settings::{Bodies, Limits};
use crate::geometry::arrange::Exact;
use crate::repairs::cleanup::duplicates;
use crate::testing::{After, Corners, after, cube, cuboid, diagnose, records, reversed, shifted};

fn resolved_by(triangles: &[Corners], profile: &Profile) -> After<Resolved> {
    after(triangles, |d, turned| {
        let work = &mut Work::new(&mut d.submesh);
        duplicates::drop_duplicates(&d.survey, work, Bodies::Union);
        let limits = Limits { threads: 1, ..Limits::default() };
        let means = Means { path: Path::new("test"), limits: &limits, progress: &Quiet };
        resolve(&Exact, &mut d.survey, work, turned, profile, false, &means).unwrap()
    })
}

fn resolved(triangles: &[Corners]) -> After<Resolved> {
    resolved_by(triangles, &Profile::default())
}

/// A hundred cubes, each across the next: more memory than the budget is a refusal that says how much, and nothing is changed by a budget
/// that is enough.
#[test]
fn what_would_take_more_memory_than_there_is_is_refused() {
    let row: Vec<Corners> =
        (0..100).flat_map(|k| shifted(&cube(), [0.75 * k as f32, 0.125 * (k % 3) as f32, 0.125 * (k % 2) as f32])).collect();
    let with = |memory_bytes: u64| {
        after(&row, |d, turned| {
            let limits = Limits { threads: 1, memory_bytes, ..Limits::default() };
            let means = Means { path: Path::new("test"), limits: &limits, progress: &Quiet };
            let work = &mut Work::new(&mut d.submesh);
            resolve(&Exact, &mut d.survey, work, turned, &Profile::default(), false, &means).map(|resolved| resolved.pairs)
        })
    };
    let most = Limits::default().memory_bytes;
    let enough = with(most);
    let pairs = enough.result.unwrap();
    assert!(enough.verdict.good);
    // The survey has its own budget, which is less than this.
    let needed = pairs * (BYTES_PER_PAIR + BYTES_PER_TRIANGLE / 2);
    let refused = with(needed).result.unwrap_err().to_string();
    assert!(refused.contains("needs about") && refused.contains("MiB") && refused.contains("--memory"), "{refused}");
}

#[test]
fn crossing_cubes_become_one_body() {
    let both = [cube(), shifted(&cube(), [0.5, 0.625, 0.75])].concat();
    let got = resolved(&both);
    assert!(got.verdict.good, "{:?}", got.verdict);
    assert_eq!((got.defects.components, got.result.bodies, got.result.rounds), (1, 1, 1));
    let shared = 0.5 * 0.375 * 0.25;
    assert!((got.defects.volume - (2.0 - shared)).abs() < 1e-9 && (got.result.volume - shared).abs() < 1e-9);
    // Six faces are cut, of two triangles each; the others are as they were.
    assert_eq!(got.untouched, 12);
}

#[test]
fn bodies_that_are_to_be_kept_go_on_crossing_and_one_that_crosses_itself_does_not() {
    let keep = Profile { bodies: Bodies::Keep, ..Profile::default() };
    let both = [cube(), shifted(&cube(), [0.5, 0.625, 0.75])].concat();
    assert_eq!(resolved_by(&both, &keep).untouched, 24);
    // Joined by a bar that shares a face with each, and reaches from one to the other inside of both.
    let mut bent = both.clone();
    bent.retain(|t| !cube()[..2].contains(t));
    bent.retain(|t| !shifted(&cube()[2..4], [0.5, 0.625, 0.75]).contains(t));
    let [a, b] = [[0.0f32, 0.0, 0.0], [0.5, 0.625, 1.75]];
    let square = |p: [f32; 3]| [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]].map(|[x, y]| [p[0] + x, p[1] + y, p[2]]);
    let (from, to) = (square(a), square(b));
    for k in 0..4 {
        let next = (k + 1) % 4;
        bent.extend([[from[k], from[next], to[next]], [from[k], to[next], to[k]]]);
    }
    let got = resolved_by(&bent, &keep);
    assert!(got.verdict.good && got.result.pairs > 0, "{:?}", got.verdict);
}

#[test]
fn a_body_through_another_is_cut_where_they_meet_and_gone_between() {
    let bar = cuboid([0.25, 0.25, -1.0], [0.5, 0.5, 2.0]);
    let got = resolved(&[cube(), bar].concat());
    assert!(got.verdict.good, "{:?}", got.verdict);
    assert!((got.defects.volume - (1.0 + 2.0 / 16.0)).abs() < 1e-9, "{}", got.defects.volume);
    // A hole, of a body inside out.
    let got = resolved(&[cube(), reversed(&cuboid([0.25, 0.25, -1.0], [0.5, 0.5, 2.0]))].concat());
    assert!(got.verdict.good, "{:?}", got.verdict);
    assert!((got.defects.volume - (1.0 - 1.0 / 16.0)).abs() < 1e-9, "{}", got.defects.volume);
}

#[test]
fn bodies_that_share_part_of_a_face_become_one() {
    for at in [[1.0, 0.25, 0.25], [0.5, 0.0, 0.0], [1.0, 0.0, 0.5]] {
        let got = resolved(&[cube(), shifted(&cube(), at)].concat());
        assert!(got.verdict.good, "{at:?}: {:?}", got.verdict);
        assert_eq!(got.defects.components, 1);
        assert!((got.defects.volume - if at[0] == 1.0 { 2.0 } else { 1.5 }).abs() < 1e-9, "{at:?}: {}", got.defects.volume);
    }
}

/// A body over a triangle that goes round counterclockwise, from one height to another.
fn prism(corners: [[f32; 2]; 3], heights: [f32; 2]) -> Vec<Corners> {
    let [low, high] = heights.map(|z| corners.map(|[x, y]| [x, y, z]));
    let sides = (0..3).map(|k| (k, (k + 1) % 3)).flat_map(|(i, j)| [[low[i], low[j], high[j]], [low[i], high[j], high[i]]]);
    [high, [low[0], low[2], low[1]]].into_iter().chain(sides).collect()
}

#[test]
fn a_surface_that_passes_through_another_edge_along_edge_is_on_both_of_its_sides() {
    // One of its sides goes into the cube from an edge of the cube, the other one away from it; with the faces there both only touch.
    let beside = prism([[1.0, 1.0], [0.5, -1.0], [3.0, -1.0]], [-1.0, 2.0]);
    let got = resolved(&[cube(), beside].concat());
    assert!(got.verdict.good && got.result.left.is_empty(), "{:?}, {:?}", got.verdict, got.result.left);
    assert!((got.defects.volume - (1.0 + 7.5 - 0.125)).abs() < 1e-7, "{}", got.defects.volume);
}

#[test]
fn a_body_that_stands_on_another_with_an_edge_shares_that_edge() {
    // Nothing of either goes, and yet they cross as long as the face has no edge there.
    let standing = prism([[1.0, 0.5], [2.0, 0.25], [2.0, 0.75]], [0.25, 0.75]);
    let got = resolved(&[cube(), standing].concat());
    assert!(got.result.left.is_empty() && got.defects.self_intersections.is_some_and(|found| found.is_free()));
    assert!(got.defects.nonmanifold_edges > 0 && (got.defects.volume - 1.125).abs() < 1e-9, "{}", got.defects.volume);
}

#[test]
fn a_sheet_through_a_body_is_not_for_the_arrangement() {
    let sheet = vec![[[-1.0, 0.5, 0.5], [2.0, 0.5, 0.5], [0.5, 3.0, 0.625]]];
    let got = resolved(&[cube(), sheet].concat());
    assert_eq!((got.result.pairs, got.untouched), (0, 13));
}

#[test]
fn a_cavity_that_breaks_through_the_wall_opens_it() {
    let cavity = reversed(&cuboid([0.25; 3], [0.75, 0.75, 1.5]));
    let got = resolved(&[cube(), cavity].concat());
    assert!(got.verdict.good, "{:?}", got.verdict);
    assert!((got.defects.volume - (1.0 - 0.25 * 0.75)).abs() < 1e-9, "{}", got.defects.volume);
}

/// One beside two others, which share a face the same way: its wall with them goes, their face stays with both.
#[test]
fn a_wall_in_common_beside_a_face_that_is_there_twice() {
    let large = cuboid([0.0; 3], [1.0, 2.0, 1.0]);
    let boxes = [cuboid([1.0, 1.0, 0.0], [2.0, 2.0, 1.0]), large, cuboid([0.0, 1.0, 0.0], [1.0, 2.0, 1.0])];
    let got = resolved(&boxes.concat());
    assert!(got.verdict.good && (got.defects.volume - 3.0).abs() < 1e-9, "{}: {:?}", got.defects.volume, got.verdict);
}

/// Boxes on a grid, some inside out, far from the origin or not.
fn boxes() -> impl Strategy<Value = Vec<([u8; 3], [u8; 3])>> {
    let corner = || prop::array::uniform3(0u8..4);
    prop::collection::vec((corner(), corner()), 1..6)
        .prop_map(|all| all.into_iter().map(|(at, size)| (at, size.map(|s| s % 3 + 1))).collect())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    /// Of boxes on a grid, where everything coincides with everything, the cells that any of them holds are left.
    #[test]
    fn of_boxes_on_a_grid_their_union_is_left(boxes in boxes()) {
        let solid = |at: &[u8; 3], size: &[u8; 3]| {
            cuboid(at.map(f32::from), std::array::from_fn(|k| f32::from(at[k] + size[k])))
        };
        let mesh: Vec<Corners> = boxes.iter().flat_map(|(at, size)| solid(at, size)).collect();
        let holds = |cell: [u8; 3]| {
            boxes.iter().any(|(at, size)| (0..3).all(|k| at[k] <= cell[k] && cell[k] < at[k] + size[k]))
        };
        let cells = (0..512u32).filter(|n| holds([n % 8, n / 8 % 8, n / 64].map(|x| x as u8))).count();
        let got = resolved(&mesh);
        prop_assert!(got.defects.boundary_edges + got.defects.unbalanced_edges == 0, "{:?}", got.verdict);
        prop_assert!(got.defects.self_intersections.as_ref().is_some_and(|s| s.is_free()), "{:?}", got.verdict);
        // Bodies that cross nothing but lie in others are not this pass's.
        if got.defects.nested_positive == 0 {
            prop_assert!((got.defects.volume - cells as f64).abs() < 1e-6, "{} instead of {cells}", got.defects.volume);
        }
    }

    /// Slanted tetrahedra and boxes: everything crosses, nothing coincides, and f32 has to round.
    #[test]
    fn of_slanted_bodies_a_closed_surface_is_left(
        corners in prop::collection::vec(prop::array::uniform4(prop::array::uniform3(-8.0f32..8.0)), 1..6),
        far in prop_oneof![Just(0.0f32), Just(1000.0)],
    ) {
        let tetrahedron = |[a, b, c, d]: [[f32; 3]; 4]| {
            let place = |p: [f32; 3]| DVec3::from_array(p.map(f64::from));
            let [o, x, y, z] = [a, b, c, d].map(place);
            let faces = [[a, c, b], [a, b, d], [b, c, d], [c, a, d]];
            if (x - o).cross(y - o).dot(z - o) > 0.0 { faces.to_vec() } else { reversed(&faces) }
        };
        let mesh: Vec<Corners> = corners.into_iter().flat_map(tetrahedron).collect();
        let mesh = shifted(&mesh, [far; 3]);
        let got = resolved(&mesh);
        prop_assert!(got.defects.boundary_edges + got.defects.unbalanced_edges == 0, "{:?}", got.verdict);
        prop_assert!(got.defects.self_intersections.as_ref().is_some_and(|s| s.is_free()), "{:?}", got.verdict);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    /// Two boxes wall to wall, but that the walls are some steps of f32 out of true, and divided otherwise.
    #[test]
    fn walls_that_nearly_lie_on_each_other_become_free_of_crossings(
        steps in prop::array::uniform8(-3i32..=3),
        y in 0u8..6,
        z in 0u8..6,
        far in prop_oneof![Just(1.0f32), Just(1000.0)],
    ) {
        let step = far.next_up() - far;
        let [y, z] = [y, z].map(|k| f32::from(k) / 7.0 - 0.3);
        let wall = |p: [f32; 3], corner: usize| -> [f32; 3] {
            if p[0] == far { [far + step * steps[corner] as f32, p[1], p[2]] } else { p }
        };
        let which = |p: [f32; 3], first: usize, lo: [f32; 2]| first + usize::from(p[1] > lo[0]) + 2 * usize::from(p[2] > lo[1]);
        let one: Vec<Corners> =
            cuboid([far - 1.0, 0.0, 0.0], [far, 1.0, 1.0]).iter().map(|t| t.map(|p| wall(p, which(p, 0, [0.0; 2])))).collect();
        let two = cuboid([far, y, z], [far + 1.0, y + 1.0, z + 1.0]);
        let two: Vec<Corners> = two.iter().map(|t| t.map(|p| wall(p, which(p, 4, [y, z])))).collect();
        let got = resolved(&[one, two].concat());
        prop_assert!(got.defects.boundary_edges + got.defects.unbalanced_edges == 0, "{:?}", got.verdict);
        prop_assert!(got.defects.self_intersections.as_ref().is_some_and(|s| s.is_free()), "{:?}", got.verdict);
        prop_assert!(got.result.left.is_empty(), "{:?}", got.result);
        prop_assert!((got.defects.volume - 2.0).abs() < 1e-5 * f64::from(far), "{}", got.defects.volume);
        if got.defects.nonmanifold_edges + got.defects.nonmanifold_vertices == 0 {
            // Flakes between the walls are no bodies.
            prop_assert_eq!(got.result.bodies + got.defects.bodies, 2);
        }
    }
}

/// A triangle that many others cross far from each other is within reach; as many that all cross each other in one place are not.
#[test]
fn what_crosses_too_much_is_told_by_its_worst_triangle() {
    let fan: Vec<[u32; 2]> = (1..40_000).map(|t| [0, t]).collect();
    let along = |t: u32| Bounds { lo: [t as f32, 0.0, 0.0], hi: [t as f32 + 0.5, 1.0, 1.0] };
    let below_all = |t: u32| if t == 0 { Bounds { lo: [0.0; 3], hi: [40_000.0, 1.0, 1.0] } } else { along(t) };
    assert_eq!(meetings(below_all, &fan), Ok(0));
    let all: Vec<[u32; 2]> = (0..400).flat_map(|a| (a + 1..400).map(move |b| [a, b])).chain([[7, 400]]).collect();
    assert_eq!(meetings(|_| Bounds { lo: [0.0; 3], hi: [1.0; 3] }, &all), Err(7));
}

/// Bodies that cross each other are one region, others another.
#[test]
fn every_cluster_is_told_of() {
    let both = [cube(), shifted(&cube(), [0.5, 0.625, 0.75])].concat();
    let got = resolved(&[both.clone(), shifted(&both, [16.0, 0.0, 0.0])].concat()).result;
    let bounds = |at: f32| [[at, 0.0, 0.0], [at + 1.5, 1.625, 1.75]];
    let told: Vec<_> = got.regions.iter().map(|region| (region.method, region.bounds, region.rounds, region.moved)).collect();
    assert_eq!(told, [(RegionMethod::Cut, bounds(0.0), 1, 0.0), (RegionMethod::Cut, bounds(16.0), 1, 0.0)]);
    assert!(got.regions.iter().all(|region| region.count > 3) && got.regions_left.is_empty());
}

/// A cone that was cut off, with the same upper end as others, but for the corner that its fan of needles goes from.
fn pot(sides: usize, corner: usize, [radius, depth]: [f64; 2]) -> Vec<[DVec3; 3]> {
    let ring = |radius: f64, z: f64| -> Vec<DVec3> {
        let angle = |k: usize| std::f64::consts::TAU * k as f64 / sides as f64;
        (0..sides).map(|k| DVec3::new(radius * angle(k).cos(), radius * angle(k).sin(), z)).collect()
    };
    let (low, high) = (ring(radius, -depth), ring(1.0, 0.0));
    let walls =
        (0..sides).map(|i| (i, (i + 1) % sides)).flat_map(|(i, j)| [[low[i], low[j], high[j]], [low[i], high[j], high[i]]]);
    let at = |i: usize| (i + corner) % sides;
    let ends =
        (1..sides - 1).flat_map(|i| [[high[at(0)], high[at(i)], high[at(i + 1)]], [low[at(0)], low[at(i + 1)], low[at(i)]]]);
    walls.chain(ends).collect()
}

/// As in assemblies that were turned before they were written: their common planes are planes no more, and bodies with the same corners have
/// different triangles there.
#[test]
fn bodies_whose_faces_lie_in_planes_that_f32_cannot_hold_are_spread_by_some_steps() {
    let bodies: Vec<[DVec3; 3]> = (0..6).flat_map(|k| pot(60, 11 * k, [0.9 - 0.1 * k as f64, 0.5 + 0.2 * k as f64])).collect();
    let turn = glam::DMat3::from_euler(glam::EulerRot::XYZ, 0.4, 0.7, 1.1);
    let turned = |p: DVec3| (turn * p * 10.0 + DVec3::splat(50.0)).to_array().map(|x| x as f32);
    let mesh: Vec<Corners> = bodies.into_iter().map(|t| t.map(turned)).collect();
    let got = after(&mesh, |d, turned| {
        let limits = Limits { threads: 1, ..Limits::default() };
        let means = Means { path: Path::new("test"), limits: &limits, progress: &Quiet };
        let (survey, work) = (&mut d.survey, &mut Work::new(&mut d.submesh));
        let overlay = Overlay::of(survey, work, turned).unwrap();
        let pairs = overlay.crossing_pairs(survey, work).unwrap();
        divide(survey, work, turned, corners(survey, work, &overlay, &pairs), &means).unwrap();
        let pieces = pieces::pieces(survey, work, turned);
        let mut state = State {
            clusters: Clusters::of(&pieces, &vec![false; pieces.list.len()]),
            track: Track::default(),
            first_triangle: work.triangles.len() as u32,
            first_vertex: work.positions.len() as Vertex,
            step: above(survey.bounds.largest_coordinate()) * FINEST,
            before: Before { triangles: work.snapshot(), reversed: turned.clone() },
            survey,
            work,
            reversed: turned,
        };
        let levels = vec![Level::Perturbed; pieces.list.len()];
        let profile = Profile::default();
        let (overlay, pairs, levels) = (&overlay, &pairs[..], &levels[..]);
        let by = Attempt { engine: &Exact, overlay, pairs, levels, profile: &profile, limits: &limits, progress: &Quiet };
        let Ok(resolved) = state.attempt(&by) else { panic!("resolved") };
        let regions = state.track.regions(&mut state.clusters);
        assert!(regions.iter().all(|region| region.method == RegionMethod::Perturbed) && regions.len() == 1, "{regions:?}");
        resolved.displaced / state.step
    });
    assert!(got.verdict.good && got.defects.components == 1, "{:?}", got.verdict);
    // Five bodies against the one that stays, out of up to three planes at once.
    assert!(got.result > 8.0 && got.result <= 5.0 * 8.0 * 3.0 + 2.0, "{}", got.result);
}

#[test]
fn triangles_that_follow_their_neighbours_take_steps_in_proportion() {
    // A strip, of which the surface of the last triangle is known: turns come against the order of the triangles.
    steps::assert_near_linear(500, |n| {
        let at = |i: usize| [(i / 2) as f32, (i % 2) as f32, 0.0];
        let strip: Vec<Corners> = (0..n).map(|i| [at(i), at(i + 1), at(i + 2)]).collect();
        let records = records(&strip);
        let d = diagnose(&records);
        let mut piece_of = vec![NONE; n];
        piece_of[n - 1] = 7;
        let left: Vec<usize> = (0..n - 1).collect();
        let (steps, ()) = steps::of(|| follow_neighbours(&d.submesh, &left, &mut piece_of));
        assert!(piece_of.iter().all(|piece| *piece == 7));
        steps
    });
}

#[test]
fn a_triangle_follows_the_neighbour_whose_turn_came_first() {
    // Around a vertex: 0 and 3 are known. 1 and 2 touch both there, and take the smaller one; 4 touches 3 only.
    let fan: Vec<Corners> = (0..4u8)
        .map(|i| [[0.0; 3], [1.0, f32::from(i), 0.0], [1.0, f32::from(i + 1), 0.0]])
        .chain([[[1.0, 4.0, 0.0], [2.0, 4.0, 0.0], [2.0, 5.0, 0.0]]])
        .collect();
    let records = records(&fan);
    let d = diagnose(&records);
    let mut piece_of = [5, NONE, NONE, 3, NONE];
    follow_neighbours(&d.submesh, &[1, 2, 4], &mut piece_of);
    assert_eq!(piece_of, [5, 3, 3, 3, 3]);
}

#[test]
fn edges_that_run_along_each_other_from_ring_to_ring_take_steps_in_proportion() {
    // Each triangle leads to the next one.
    steps::assert_near_linear(500, |n| {
        let next = |fresh: &[u32]| Some(fresh.iter().map(|t| (t + 1).min(n as u32)).collect());
        let (steps, all) = steps::of(|| grown(&BTreeSet::from([0]), next));
        assert_eq!(all.map(|all| all.len()), Some(n + 1));
        steps
    });
}

#[test]
fn what_is_fetched_is_found_in_one_table_of_positions() {
    // Nothing of a regular cube is in the submesh before a star is asked for.
    let records = records(&cube());
    let mut d = diagnose(&records);
    let positions = [cube()[0][0]];
    let new = d.survey.promote(&positions);
    let mut work = Work::new(&mut d.submesh);
    work.extend_at(&d.survey, &new, &positions);
    assert!(work.living().count() >= 3);
    // Again, with nothing new: one table, and the star lists made anew.
    let (steps, _) = steps::of(|| work.extend_at(&d.survey, &[], &positions));
    assert_eq!(steps, (work.positions.len() + work.triangles.len()) as u64);
    assert_eq!(work.complete.iter().filter(|complete| **complete).count(), 1);
}

#[test]
fn dust_that_cutting_left_goes_and_is_named() {
    // Three slots from side to side, inside out, cut a cube into eight: the smallest of them is a cube at the corner.
    let slots = |crumb: f32| {
        let slot = |k: usize| {
            let (mut lo, mut hi) = ([-1.0; 3], [2.0; 3]);
            (lo[k], hi[k]) = (crumb, 0.25);
            reversed(&cuboid(lo, hi))
        };
        resolved(&[cube(), slot(0), slot(1), slot(2)].concat())
    };
    // A cube as thick as 2⁻¹³ of the diagonal, which is that of the slots, would have 1/525: a third of its size is its thickness.
    let (seen, dust) = ((-9f32).exp2(), (-10f32).exp2());
    let got = slots(seen);
    assert_eq!((got.result.dust.len(), got.defects.components), (0, 8), "a crumb that can be seen");
    let got = slots(dust);
    assert!(got.verdict.good, "{:?}", got.verdict);
    assert_eq!(got.defects.components, 7);
    let [region] = &got.result.dust[..] else { panic!("{:?}", got.result.dust) };
    assert_eq!((region.method, region.bounds, region.count), (RegionMethod::Dropped, [[0.0; 3], [dust; 3]], 12));
}

#[test]
fn dust_that_the_file_itself_has_stays() {
    // Next to two cubes that cross: a tiny cube, and two tiny ones that cross each other.
    let size = (-15f32).exp2();
    let tiny = |at: f32| cuboid([at; 3], [at + 2.0 * size; 3]);
    let both = [cube(), shifted(&cube(), [0.5, 0.625, 0.75])].concat();
    let got = resolved(&[both, tiny(3.0), tiny(3.5), tiny(3.5 + size)].concat());
    assert!(got.verdict.good, "{:?}", got.verdict);
    assert_eq!((got.result.dust.len(), got.defects.components, got.result.bodies), (0, 3, 2));
}
