use std::path::Path;

use proptest::prelude::*;

use super::*;
use crate::contract::progress::Quiet;
use crate::contract::report::RegionMethod;
use crate::contract::settings::Limits;
use crate::diagnosis::Diagnosis;
use crate::io::record::Record;
use crate::output::edit::Edit;
use crate::submesh::components::Reversed;
use crate::testing::{After, Corners, after, cuboid, records, reversed, written};

fn separated(triangles: &[Corners]) -> After<Separated> {
    after(triangles, |d, turned| separate(&d.survey, &mut Work::new(&mut d.submesh), turned, &Profile::default()))
}

/// The skin of the unit cubes of a 4 × 4 × 4 grid whose bits are set. `diagonals`: which way the square faces are divided.
fn voxels(bits: u64, diagonals: u64) -> Vec<Corners> {
    let is_filled = |at: [i32; 3]| at.iter().all(|x| (0..4).contains(x)) && bits >> (at[0] + 4 * at[1] + 16 * at[2]) & 1 == 1;
    let mut mesh = Vec::new();
    for n in 0..64 {
        let at = [n % 4, n / 4 % 4, n / 16];
        if !is_filled(at) {
            continue;
        }
        let lo = at.map(|x| x as f32);
        for (side, face) in cuboid(lo, lo.map(|x| x + 1.0)).chunks_exact(2).enumerate() {
            let mut beyond = at;
            beyond[2 - side / 2] += if side % 2 == 1 { 1 } else { -1 };
            if !is_filled(beyond) {
                let [[a, b, c], [_, _, d]] = [face[0], face[1]];
                let turned = diagonals.rotate_left(n as u32 + 11 * side as u32) & 1 == 1;
                mesh.extend(if turned { [[b, c, d], [b, d, a]] } else { [[a, b, c], [a, c, d]] });
            }
        }
    }
    mesh
}

fn check(mesh: &[Corners]) -> Result<After<Separated>, TestCaseError> {
    let got = separated(mesh);
    let d = &got.defects;
    let wrong =
        [d.boundary_edges, d.nonmanifold_edges, d.nonmanifold_vertices, d.unbalanced_edges, d.degenerate_area, got.result.left];
    prop_assert_eq!(wrong, [0; 6], "{:?}", got.result);
    prop_assert!(d.self_intersections.as_ref().is_some_and(|found| found.is_free()), "{:?}", d.self_intersections);
    Ok(got)
}

#[test]
fn of_two_cubes_at_an_edge_the_second_draws_back() {
    let mesh = [cuboid([0.0; 3], [1.0; 3]), cuboid([1.0, 1.0, 0.0], [2.0, 2.0, 1.0])].concat();
    let got = separated(&mesh);
    assert_eq!((got.result.vertices, got.result.edges, got.result.left), (2, 0, 0));
    // Both ends of the edge are one region.
    let regions: Vec<_> = got.result.regions.iter().map(|region| (region.method, region.count, region.moved)).collect();
    assert_eq!(regions, [(RegionMethod::Separated, 2, got.result.farthest)]);
    // All of the first one's triangles are as they were.
    assert!(got.untouched >= 12 && got.verdict.good && got.defects.bodies == 2, "{:?}", got.verdict);
    assert!((got.defects.bounds.unwrap(), got.result.farthest < 1e-6) == ([[0.0; 3], [2.0, 2.0, 1.0]], true));
}

/// The same mesh, every unit so many steps of single precision at this offset.
fn shrunk(mesh: &[Corners], steps: f32, offset: f32) -> Vec<Corners> {
    let step = offset.next_up() - offset;
    mesh.iter().map(|t| t.map(|p| p.map(|x| offset + x * steps * step))).collect()
}

#[test]
fn a_copy_may_go_farther_than_its_edges_are_long() {
    let cubes = [cuboid([0.0; 3], [1.0; 3]), cuboid([1.0, 1.0, 0.0], [2.0, 2.0, 1.0])].concat();
    let got = separated(&shrunk(&cubes, 2.0, 1000.0));
    assert_eq!((got.result.vertices, got.result.edges, got.result.left), (2, 0, 0));
    assert!(got.verdict.good && got.defects.bodies == 2, "{:?}", got.verdict);
}

#[test]
fn a_bridge_that_narrows_to_an_edge_is_opened_in_its_middle() {
    // Two of four cubes, across from each other, between two slabs: whichever end of their edge, the two are one there.
    let got = separated(&voxels(0x33 << 32 | 0x21 << 16 | 0x33, 0));
    assert_eq!((got.result.vertices, got.result.edges, got.result.left), (0, 1, 0));
    // With a way through between the two.
    assert!(got.verdict.good && got.defects.bodies == 1 && got.defects.euler == Some(0), "{:?}", got.defects);
}

#[test]
fn cavities_that_meet_in_a_vertex_draw_back_from_each_other() {
    let cavities = [cuboid([1.0; 3], [2.0; 3]), cuboid([2.0; 3], [3.0; 3])].concat();
    let got = separated(&[cuboid([0.0; 3], [4.0; 3]), reversed(&cavities)].concat());
    assert_eq!((got.result.vertices, got.result.edges, got.result.left), (1, 0, 0));
    assert!(got.verdict.good && got.defects.cavities == 2, "{:?}", got.defects);
}

#[test]
fn what_a_profile_wants_to_stay_stays() {
    let mesh = [cuboid([0.0; 3], [1.0; 3]), cuboid([1.0; 3], [2.0; 3])].concat();
    let profile = Profile { separate: false, ..Profile::default() };
    let got = after(&mesh, |d, turned| separate(&d.survey, &mut Work::new(&mut d.submesh), turned, &profile));
    assert_eq!((got.result, got.untouched), (Separated::default(), 24));
}

#[test]
fn a_vertex_beside_a_boundary_is_left_alone() {
    let mut mesh = [cuboid([0.0; 3], [1.0; 3]), cuboid([1.0; 3], [2.0; 3])].concat();
    let one = mesh.iter().position(|t| t.contains(&[1.0; 3])).unwrap();
    mesh.remove(one);
    let got = separated(&mesh);
    let Separated { vertices, edges, left, ref regions_left, .. } = got.result;
    assert_eq!((vertices, edges, left, regions_left.len(), got.untouched), (0, 0, 1, 1, 23));
}

/// The records that come of a mesh that is looked at in chunks of so many triangles.
fn written_by(mesh: &[Corners], chunk_triangles: u32) -> Vec<Record> {
    let input = records(mesh);
    let limits = Limits { threads: 1, chunk_triangles, ..Limits::default() };
    let mut d = Diagnosis::of(Path::new("test"), &input, &Profile::default(), &limits, &Quiet).unwrap();
    let none = Reversed::none(&d.survey);
    separate(&d.survey, &mut Work::new(&mut d.submesh), &none, &Profile::default());
    written(&Edit::of(&d.survey, &d.submesh, &Reversed::none(&d.survey), &[]), &input)
}

proptest! {
    #[test]
    fn chunks_do_not_show_in_the_result(bits in any::<u64>(), diagonals in any::<u64>()) {
        let mesh = voxels(bits, diagonals);
        let whole = written_by(&mesh, u32::MAX);
        for chunk_triangles in [1, 7, 50] {
            prop_assert!(written_by(&mesh, chunk_triangles) == whole);
        }
    }

    /// Cubes of a grid touch in edges and vertices in all ways.
    #[test]
    fn any_cubes_of_a_grid_become_a_manifold(bits in any::<u64>(), more in any::<u64>(), diagonals in any::<u64>(), dense in 0..3) {
        let bits = [bits, bits & more, bits | more][dense as usize];
        prop_assume!(bits != 0);
        let got = check(&voxels(bits, diagonals))?;
        prop_assert!((got.defects.volume - f64::from(bits.count_ones())).abs() < 1e-3);
        prop_assert!(got.result.farthest < 1e-5, "{:?}", got.result);
    }

    /// So do cubes of a few steps of single precision.
    #[test]
    fn cubes_of_a_few_steps_become_a_manifold(bits in any::<u64>(), more in any::<u64>(), diagonals in any::<u64>(), steps in 2..9) {
        prop_assume!(bits & more != 0);
        check(&shrunk(&voxels(bits & more, diagonals), steps as f32, 1000.0))?;
    }

    /// So do bodies whose faces lie anyhow, near the origin and far from it.
    #[test]
    fn any_bodies_that_touch_become_a_manifold(
        bits in any::<u64>(),
        diagonals in any::<u64>(),
        moves in prop::collection::vec(-0.2_f32..0.2, 375),
        offset in prop::sample::select(vec![0.0_f32, -1.5, 100.0, 10_000.0]),
    ) {
        prop_assume!(bits != 0);
        let placed = |p: [f32; 3]| {
            let n = p[0] as usize + 5 * p[1] as usize + 25 * p[2] as usize;
            [0, 1, 2].map(|k| p[k] + moves[3 * n + k] + offset)
        };
        let mesh: Vec<Corners> = voxels(bits, diagonals).iter().map(|t| t.map(placed)).collect();
        let is_free = after(&mesh, |d, _| d.defects.self_intersections.as_ref().is_some_and(|found| found.is_free())).result;
        prop_assume!(is_free);
        check(&mesh)?;
    }
}
