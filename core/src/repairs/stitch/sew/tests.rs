use super::*;
use crate::testing::{After, Corners, after, cube, cuboid, plate, reversed, shifted};

fn sewn(mesh: &[Corners]) -> After<Sewn> {
    after(mesh, |d, _| sew(&d.survey, &mut Work::new(&mut d.submesh), &d.tolerance, &Profile::default()))
}

/// Each side of the cube by so much off.
fn loose(by: f32) -> Vec<Corners> {
    let off = |side: usize| [[0.0, by, 0.0], [by, 0.0, 0.0], [0.0, 0.0, by], [by, 0.0, by], [0.0, -by, by], [by, by, 0.0]][side];
    cube().chunks(2).enumerate().flat_map(|(side, two)| shifted(two, off(side))).collect()
}

#[test]
fn the_sides_of_a_cube_are_sewn_whatever_little_they_are_off() {
    // The weld tolerance is 1.7e-5.
    for by in [1e-4, 1e-3, 5e-3] {
        let got = sewn(&loose(by));
        assert_eq!((got.result.vertices, got.defects.vertices), (16, 8), "{by}");
        assert!(got.verdict.good, "{:?}", got.verdict);
        assert!(got.result.widest >= f64::from(by) && got.result.widest <= 3.0 * f64::from(by));
    }
    assert_eq!(sewn(&loose(0.1)).result.vertices, 0, "wider than the profile's share of the diagonal");
}

#[test]
fn an_edge_is_split_where_the_other_rim_has_a_vertex() {
    let left = vec![[[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]];
    // Within the first step, so that one side of three is enough.
    let by = 1.0 + 1e-4;
    let right = [[[by, 0.0, 0.0], [2.0, 0.5, 0.0], [by, 0.5, 0.0]], [[by, 0.5, 0.0], [2.0, 0.5, 0.0], [by, 1.0, 0.0]]];
    let got = sewn(&[left, right.to_vec()].concat());
    assert_eq!((got.result.vertices, got.result.splits), (2, 1));
    assert_eq!((got.defects.triangles, got.defects.boundary_loops, got.defects.boundary_edges), (4, 1, 4));
}

#[test]
fn the_skins_of_a_thin_wall_are_left_alone() {
    let bottom = reversed(&plate(2, |_, _| true));
    let top = shifted(&plate(2, |_, _| true), [0.0, 0.0, 0.02]);
    assert_eq!(sewn(&[bottom, top].concat()).result.vertices, 0);
}

#[test]
fn a_clearance_between_two_bodies_with_holes_is_kept() {
    // The sides that face each other are lost. Beyond the first step only.
    let pair = |gap: f32| {
        let left = cube().into_iter().filter(|t| t.iter().any(|p| p[0] < 1.0)).collect::<Vec<_>>();
        let right = cuboid([1.0 + gap, 0.0, 0.0], [2.0 + gap, 1.0, 1.0]);
        let right = right.into_iter().filter(|t| t.iter().any(|p| p[0] > 1.5)).collect::<Vec<_>>();
        sewn(&[left, right].concat()).result.vertices
    };
    assert_eq!([pair(0.01), pair(1e-4)], [0, 4]);
}

#[test]
fn nothing_is_sewn_if_the_profile_says_so() {
    let profile = Profile { sew_relative: 0.0, ..Profile::default() };
    let got = after(&loose(1e-3), |d, _| sew(&d.survey, &mut Work::new(&mut d.submesh), &d.tolerance, &profile));
    assert_eq!(got.result.vertices, 0);
}
