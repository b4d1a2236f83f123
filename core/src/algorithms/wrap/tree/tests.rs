use proptest::prelude::*;

use super::*;
use crate::algorithms::wrap::angle::argument;
use crate::testing::{cuboid, reversed};

#[test]
fn arguments_are_those_of_the_standard_library() {
    for k in -1000..=1000 {
        let angle = f64::from(k) / 1000.0 * std::f64::consts::PI;
        let got = argument(angle.cos(), angle.sin()) * 2.0 * std::f64::consts::PI;
        assert!((got - angle).abs() < 1e-9 || (got.abs() - std::f64::consts::PI).abs() < 1e-9, "{got} for {angle}");
    }
}

#[test]
fn bodies_count_once_each_and_cavities_are_air() {
    let mesh = [cuboid([0.0; 3], [8.0; 3]), cuboid([4.0; 3], [12.0; 3]), reversed(&cuboid([1.0; 3], [3.0; 3]))].concat();
    let tree = Tree::winding(&mesh);
    for (x, want) in [(-1.0, 0.0), (0.5, 1.0), (2.1, 0.0), (3.5, 1.0), (6.3, 2.0), (11.0, 1.0), (13.0, 0.0), (100.0, 0.0)] {
        let got = tree.winding_number(DVec3::new(x, x + 0.125, x));
        assert!((got - want).abs() < 0.01, "{got} at {x}");
    }
}

#[test]
fn half_a_turn_in_the_mouth_of_an_open_box() {
    let mut open = cuboid([0.0; 3], [2.0; 3]);
    open.drain(2..4);
    let tree = Tree::winding(&open);
    let got = tree.winding_number(DVec3::new(1.0, 1.0, 1.999_999));
    assert!((got - 0.5).abs() < 1e-5, "{got}");
    assert!(tree.winding_number(DVec3::new(1.0, 1.0, 0.1)) > 0.9);
}

/// Half a box, with its rim in a plane where points are asked for too.
#[test]
fn rays_and_caps_tell_what_solid_angles_tell() {
    let mut open = cuboid([0.0; 3], [2.0; 3]);
    open.extend(cuboid([3.0; 3], [5.0; 3]));
    open.extend(cuboid([1.0; 3], [4.0; 3]));
    open.drain(2..4);
    let by_rays = Tree::winding(&open);
    assert!(by_rays.caps.as_ref().is_some_and(|caps| caps.triangles.len() == 4));
    let plain = Tree::new(&open).with_moments();
    for n in 0..4096 {
        let p = DVec3::new(f64::from(n % 16), f64::from(n / 16 % 16), f64::from(n / 256)) * 0.5 - 1.25;
        for p in [p, DVec3::new(p.x, p.y, 2.0)] {
            let (got, want) = (by_rays.winding_number(p), plain.solid_angle(p));
            assert!((got - want).abs() < 0.05, "{got} instead of {want} at {p}");
        }
    }
}

#[test]
fn a_segment_leaves_where_it_passes_a_face_outwards() {
    let tree = Tree::new(&cuboid([0.0; 3], [2.0; 3]));
    let at = |from: [f64; 3], to: [f64; 3]| tree.leaves(DVec3::from_array(from), DVec3::from_array(to));
    assert_eq!(at([1.0, 1.0, 1.0], [1.0, 1.0, 5.0]), Some(0.25));
    assert_eq!(at([1.0, 1.0, -1.0], [1.0, 1.0, 3.0]), Some(0.75), "it enters before");
    assert_eq!(at([1.0, 1.0, -1.0], [1.0, 1.0, 1.0]), Some(0.5), "it only enters");
    assert_eq!(at([3.0, 1.0, -1.0], [3.0, 1.0, 1.0]), None);
}

proptest! {
    /// To the last bit, and with each kind of vectors; on whole numbers, where many points are in a triangle's plane or on it.
    #[test]
    fn points_together_get_what_each_gets_alone(
        triangles in prop::collection::vec(prop::array::uniform3(prop::array::uniform3(-5i8..5)), 1..80),
        points in prop::collection::vec(prop::array::uniform3(-6i8..6), 1..30),
        scale in prop_oneof![Just(1.0), Just(0.3)],
    ) {
        let triangles: Vec<Corners> = triangles.iter().map(|t| t.map(|p| p.map(f32::from))).collect();
        let points: Vec<DVec3> = points.iter().map(|p| DVec3::from_array(p.map(f64::from)) * scale).collect();
        let bits = |of: &[f64]| of.iter().map(|w| w.to_bits()).collect::<Vec<_>>();
        let tree = Tree::winding(&triangles);
        let alone: Vec<f64> = points.iter().map(|p| tree.winding_number(*p)).collect();
        prop_assert_eq!(bits(&tree.winding_numbers(&points)), bits(&alone));
        let plain = Tree::new(&triangles).with_moments();
        for points in points.chunks(WIDTH) {
            let alone: Vec<f64> = points.iter().map(|p| plain.solid_angle(*p)).collect();
            prop_assert_eq!(bits(&plain.walk(points)[..points.len()]), bits(&alone));
            #[cfg(target_arch = "x86_64")]
            if is_x86_feature_detected!("avx2") {
                // SAFETY: the processor has what it is compiled for.
                prop_assert_eq!(bits(&unsafe { plain.solid_angles_avx2(points) }[..points.len()]), bits(&alone));
            }
        }
    }

    /// Far nodes taken together change little, and the nearest triangle is the nearest.
    #[test]
    fn answers_are_those_of_a_plain_loop(
        triangles in prop::collection::vec(prop::array::uniform3(prop::array::uniform3(-9i8..9)), 1..80),
        p in prop::array::uniform3(-12.0f64..12.0),
    ) {
        let triangles: Vec<Corners> = triangles.iter().map(|t| t.map(|p| p.map(f32::from))).collect();
        let p = DVec3::from_array(p);
        let tree = Tree::winding(&triangles);
        let mut plain = Angle::default();
        triangles.iter().for_each(|t| plain.add(t, p));
        prop_assert!((tree.winding_number(p) - plain.turns()).abs() < 0.05 * (1.0 + triangles.len() as f64 / 20.0));
        let nearest = triangles.iter().map(|t| square_distance(p, t.map(place))).fold(f64::INFINITY, f64::min).sqrt();
        prop_assert!((tree.distance(p) - nearest).abs() < 1e-9);
    }
}

/// Boxes in and beside each other, without some of their triangles.
fn with_holes(missing: &[prop::sample::Index]) -> Vec<Corners> {
    let mut mesh = [cuboid([0.0; 3], [6.0; 3]), cuboid([4.0; 3], [9.0; 3]), reversed(&cuboid([1.0; 3], [3.0; 3]))].concat();
    for i in missing {
        mesh.remove(i.index(mesh.len()));
    }
    mesh
}

proptest! {
    /// On columns of several points and of one, on corners and edges, too.
    #[test]
    fn sides_are_those_of_winding_numbers(
        missing in prop::collection::vec(any::<prop::sample::Index>(), 0..4),
        columns in prop::collection::vec(((-2i8..24, -2i8..24), prop::collection::vec(-2i8..24, 1..6)), 1..12),
    ) {
        let tree = Tree::winding(&with_holes(&missing));
        let mut points = Vec::new();
        for ((x, y), mut zs) in columns {
            zs.sort_unstable();
            points.extend(zs.into_iter().map(|z| DVec3::from_array([x, y, z].map(f64::from)) / 2.0));
        }
        for (told, p) in tree.windings_or_sides(&points).into_iter().zip(points) {
            let want = tree.winding_number(p);
            prop_assert!(if told.is_finite() { told.to_bits() == want.to_bits() } else { (told > 0.0) == (want > 0.5) }, "{told} at {p}");
        }
    }

    #[test]
    fn the_farthest_is_that_of_all_distances(
        triangles in prop::collection::vec(prop::array::uniform3(prop::array::uniform3(-9i8..9)), 1..60),
        points in prop::collection::vec(prop::array::uniform3(-12i8..12), 0..20),
    ) {
        let triangles: Vec<Corners> = triangles.iter().map(|t| t.map(|p| p.map(f32::from))).collect();
        let points = || points.iter().map(|p| DVec3::from_array(p.map(f64::from)));
        let tree = Tree::new(&triangles);
        let want = points().map(|p| tree.distance(p)).fold(0.0, f64::max);
        prop_assert_eq!(tree.farthest(points()).to_bits(), want.to_bits());
    }
}

/// A block of small triangles with a hole in its roof, far from most points.
#[test]
fn what_is_far_from_holes_is_told_in_few_steps() {
    const SIDE: usize = 40;
    let mut mesh: Vec<Corners> = Vec::new();
    let mut quad = |corners: [[usize; 3]; 4]| {
        let [a, b, c, d] = corners.map(|[x, y, up]| [x as f32, y as f32, if up == 1 { 0.0 } else { -30.0 }]);
        mesh.extend([[a, b, c], [a, c, d]]);
    };
    for (x, y) in (0..SIDE).flat_map(|x| (0..SIDE).map(move |y| (x, y))) {
        if (x, y) != (20, 20) {
            quad([[x, y, 1], [x + 1, y, 1], [x + 1, y + 1, 1], [x, y + 1, 1]]);
        }
        quad([[x, y, 0], [x, y + 1, 0], [x + 1, y + 1, 0], [x + 1, y, 0]]);
    }
    for i in 0..SIDE {
        quad([[i, 0, 0], [i + 1, 0, 0], [i + 1, 0, 1], [i, 0, 1]]);
        quad([[i + 1, SIDE, 0], [i, SIDE, 0], [i, SIDE, 1], [i + 1, SIDE, 1]]);
        quad([[0, i + 1, 0], [0, i, 0], [0, i, 1], [0, i + 1, 1]]);
        quad([[SIDE, i, 0], [SIDE, i + 1, 0], [SIDE, i + 1, 1], [SIDE, i, 1]]);
    }
    let tree = Tree::winding(&mesh);
    let column: Vec<DVec3> = (1..25).rev().map(|z| DVec3::new(5.5, 5.25, -f64::from(z))).collect();
    let (steps, told) = steps::of(|| tree.windings_or_sides(&column));
    assert!(told.iter().all(|w| *w == f64::INFINITY), "{told:?}");
    assert!(steps < 1000, "{steps}");
    // The first point tells how far they are, and all others need one way down.
    let away = || (0..64).map(|k| DVec3::new(5.5, 5.25, 9.0 - f64::from(k) / 8.0));
    let (one, _) = steps::of(|| tree.farthest(away().take(1)));
    let (all, _) = steps::of(|| tree.farthest(away()));
    assert!(2 * all < 64 * one, "{all} after {one}");
}
