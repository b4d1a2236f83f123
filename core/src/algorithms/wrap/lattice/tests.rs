use proptest::prelude::*;

use super::*;
use crate::contract::progress::Quiet;
use crate::testing::{cuboid, diagnose, plate, records, reversed, shifted, soup};

fn wrapped(triangles: &[Corners], cubes: u32) -> Option<Wrapping> {
    wrap(triangles, &Tree::winding(triangles), cubes, 1, &Quiet)
}

/// Whatever the engine finds in a wrapped surface.
fn check(wrapping: &Wrapping) {
    if wrapping.triangles.is_empty() {
        return;
    }
    let records = records(&wrapping.triangles);
    let d = diagnose(&records);
    let verdict = crate::detect::verdict::judge(&d.defects, &[]);
    assert!(verdict.good, "{:?}", verdict.reasons);
    assert_eq!(d.defects.nested_positive, 0);
    let off = (d.defects.volume - wrapping.volume).abs();
    assert!(off <= 1e-6 * d.defects.volume, "{} instead of {}", wrapping.volume, d.defects.volume);
}

#[test]
fn a_box_keeps_its_volume_and_its_faces_stay_flat() {
    let mesh = cuboid([-3.0, 1.0, 7.0], [9.0, 13.0, 19.0]);
    let got = wrapped(&mesh, 4000).unwrap();
    check(&got);
    assert!((got.volume / 12.0f64.powi(3) - 1.0).abs() < 0.01, "{}", got.volume);
    let on = |axis: usize, at: f32| got.triangles.iter().filter(|t| t.iter().all(|p| (p[axis] - at).abs() < 0.01)).count();
    // About a sixth each, with what is lost at the rims.
    assert!(on(0, -3.0) * 8 > got.triangles.len() && on(2, 7.0) * 8 > got.triangles.len());
}

#[test]
fn the_mouth_of_an_open_box_is_closed_and_a_cavity_kept() {
    let mut open = cuboid([0.0; 3], [8.0; 3]);
    open.drain(2..4);
    let cavity = reversed(&cuboid([2.0; 3], [4.0; 3]));
    let got = wrapped(&[open, cavity].concat(), 4000).unwrap();
    check(&got);
    let records = records(&got.triangles);
    let found = diagnose(&records).defects;
    assert_eq!((found.bodies, found.cavities), (1, 1));
    assert!(got.volume > 0.8 * 504.0 && got.volume < 1.1 * 504.0, "{}", got.volume);
}

#[test]
fn bodies_that_run_into_each_other_become_one() {
    let mesh = [cuboid([0.0; 3], [4.0; 3]), cuboid([2.0; 3], [6.0; 3])].concat();
    let got = wrapped(&mesh, 4000).unwrap();
    check(&got);
    assert!((got.volume / 120.0 - 1.0).abs() < 0.02, "{}", got.volume);
}

#[test]
fn a_flat_sheet_encloses_nothing_and_a_point_has_no_lattice() {
    assert!(wrapped(&plate(4, |_, _| true), 1000).unwrap().triangles.is_empty());
    assert!(wrapped(&[[[1.0; 3]; 3]], 1000).is_none());
    // Ten f32 steps in all.
    let tiny = shifted(&cuboid([0.0; 3], [1.0; 3]), [1e6; 3]);
    assert!(wrapped(&tiny, 1000).is_none());
}

#[test]
fn far_from_the_origin_everything_is_exact_still() {
    for far in [100.0, 10_000.0, 300_000.0] {
        let mesh = shifted(&[cuboid([0.0; 3], [64.0; 3]), cuboid([32.0; 3], [96.0; 3])].concat(), [far, -far, 0.0]);
        check(&wrapped(&mesh, 2000).unwrap());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// Whatever goes in, what comes out is a solid, and the same one from any number of threads.
    #[test]
    fn any_soup_becomes_a_solid(soup in soup(), scale in -20i32..20, by in prop::array::uniform3(-4i32..4)) {
        let scale = 2.0f32.powi(scale) * 1.1;
        let finite = soup.into_iter().filter(|t| t.as_flattened().iter().all(|x| x.is_finite()));
        let by = by.map(|x| x as f32 * 1.7);
        let moved: Vec<Corners> =
            finite.map(|t| t.map(|p| std::array::from_fn(|k| (p[k] + by[k]) * scale))).collect();
        if let Some(got) = wrapped(&moved, 300) {
            check(&got);
            let again = wrap(&moved, &Tree::winding(&moved), 300, 3, &Quiet).unwrap();
            prop_assert_eq!(got.triangles, again.triangles);
        }
    }
}
