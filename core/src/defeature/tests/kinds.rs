//! Kinds of holes, grooves and fillets that take more than one face, or are more than one feature.

use super::super::feature::{Feature, Kind, Limits, Outcome};
use super::super::reason::Reason;
use super::parts::{self, Part};
use super::{ALL, apply, check, is_closed, volume};
use crate::defeature::defeature;

/// Features of a kind and size, all removed; what is left is closed and has a volume.
fn check_all(part: &Part, limits: &Limits, kinds: &[(Kind, f64)], volume_left: f64) -> Vec<Feature> {
    let edit = defeature(&part.points, &part.triangles, limits).unwrap();
    let found: Vec<_> = edit.features.iter().map(|f| (f.kind, f.outcome)).collect();
    assert_eq!(found, kinds.iter().map(|(kind, _)| (*kind, Outcome::Removed)).collect::<Vec<_>>());
    for (feature, (_, size)) in edit.features.iter().zip(kinds) {
        assert!((feature.size - size).abs() < 1e-3 * size, "{}", feature.size);
    }
    let left = apply(part, &edit);
    assert!(is_closed(&left));
    assert!((volume(&left) / volume_left - 1.0).abs() < 1e-6, "{} {volume_left}", volume(&left));
    edit.features
}

fn is_near(a: [f64; 3], b: [f64; 3]) -> bool {
    (0..3).all(|k| (a[k] - b[k]).abs() < 1e-4)
}

/// The rims are as wide as the limit; the bore is not.
#[test]
fn bevelled_edges_of_a_hole_do_not_count() {
    check(&parts::bevelled([30.0, 20.0, 5.0], [12.0, 9.0], 1.0, 0.5), Kind::ThroughHole, 2.0, 3000.0);
    check(&parts::bevelled([30.0, 20.0, 5.0], [12.0, 9.0], 0.7, 0.7), Kind::CountersunkHole, 2.8, 3000.0);
}

#[test]
fn a_hole_across_a_step_leaves_both_faces_and_the_wall() {
    let found = check_all(&parts::stepped_hole(), &ALL, &[(Kind::ThroughHole, 2.0)], 3000.0 + 720.0);
    assert!(is_near(found[0].centre, [12.0, 10.0, 4.0]) && (found[0].depth - 8.0).abs() < 1e-4, "{found:?}");
}

#[test]
fn bores_that_cross_are_two_holes() {
    let holes = [(Kind::ThroughHole, 2.0); 2];
    let found = check_all(&parts::crossed_bores(), &ALL, &holes, 600.0);
    assert!(found.iter().all(|f| is_near(f.centre, [0.0; 3]) && (f.depth - 10.0).abs() < 1e-4), "{found:?}");
    assert!(found[0].axis[0].abs() + found[1].axis[0].abs() > 0.99 && found[0].axis[1].abs() + found[1].axis[1].abs() > 0.99);
}

#[test]
fn grooves_that_cross_go_together() {
    // 2 mm along x, 1.5 mm along y, both 2 mm deep; a groove of the limit's width crosses nothing.
    let cross = |wide: f64| {
        let planes: [&[f64]; 3] = [&[0.0, 12.0, 13.5, 30.0], &[0.0, 8.0, 8.0 + wide, 20.0], &[0.0, 3.0, 5.0]];
        parts::cells(planes, |[i, j, k]| k == 0 || (i != 1 && j != 1))
    };
    let found = check_all(&cross(2.0), &ALL, &[(Kind::Groove, 2.0)], 3000.0);
    assert!(is_near(found[0].centre, [15.0, 10.0, 4.0]) && (found[0].depth - 2.0).abs() < 1e-4, "{found:?}");
    let part = cross(3.5);
    assert!(defeature(&part.points, &part.triangles, &ALL).unwrap().features.is_empty());
}

#[test]
fn a_groove_is_as_long_and_deep_as_its_walls() {
    let outline = [[0.0, 0.0], [20.0, 0.0], [20.0, 10.0], [12.0, 10.0], [12.0, 8.0], [10.0, 8.0], [10.0, 10.0], [0.0, 10.0]];
    let found = check_all(&parts::bar(&outline, 30.0), &ALL, &[(Kind::Groove, 2.0)], 6000.0);
    assert!(is_near(found[0].centre, [11.0, 9.0, 15.0]) && is_near(found[0].axis, [0.0, 1.0, 0.0]), "{found:?}");
    assert!((found[0].length - 30.0).abs() < 1e-4 && (found[0].depth - 2.0).abs() < 1e-4);
}

#[test]
fn vents_of_a_hollow_ball_are_closed_by_both_spheres() {
    // Radii 10 and 8; a bore of 2 mm along the axis, through both walls.
    let arc = |radius: f64, steps: usize| -> Vec<[f64; 2]> {
        let end = (1.0 / radius).asin();
        let angle = |k: usize| end + (std::f64::consts::PI - 2.0 * end) * k as f64 / steps as f64;
        (0..=steps).map(|k| [radius * angle(k).sin(), -radius * angle(k).cos()]).collect()
    };
    let mut profile = arc(10.0, 40);
    profile.extend(arc(8.0, 32).into_iter().rev());
    let part = parts::ring(&profile, 64);
    let edit = defeature(&part.points, &part.triangles, &ALL).unwrap();
    assert_eq!(edit.features.iter().map(|f| (f.kind, f.outcome)).collect::<Vec<_>>(), [(Kind::ThroughHole, Outcome::Removed); 2]);
    assert!(edit.features.iter().all(|f| (f.size - 2.0).abs() < 1e-3));
    let left = apply(&part, &edit);
    assert!(is_closed(&left));
    let far = |p: &[f32; 3]| p.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>().sqrt();
    assert!(left.iter().flatten().all(|p| (far(p) - 10.0).abs() < 1e-5 || (far(p) - 8.0).abs() < 1e-5));
    // Chords of 1/64 of a turn take 0.3 % of a ball's volume.
    let whole = 4.0 / 3.0 * std::f64::consts::PI * (1000.0 - 512.0);
    assert!(volume(&left) < whole && volume(&left) > 0.99 * whole, "{}", volume(&left));
}

#[test]
fn both_rounded_rims_of_a_bore_are_told_of() {
    let mut profile = vec![[9.0, 0.0], [9.0, 6.0]];
    profile.extend(parts::arc([4.5, 5.5], 0.5, [90.0, 180.0], 6));
    profile.extend(parts::arc([4.5, 0.5], 0.5, [180.0, 270.0], 6));
    let part = parts::ring(&profile, 64);
    let limits = Limits { fillets_below: Some(1.0), ..Limits::default() };
    // A polygon of 64 sides in place of each circle.
    let share = 32.0 * (std::f64::consts::TAU / 64.0).sin();
    let found = check_all(&part, &limits, &[(Kind::Fillet, 0.5); 2], share * (81.0 - 16.0) * 6.0);
    assert!((found[0].centre[2] - found[1].centre[2]).abs() > 5.0);
}

#[test]
fn holes_that_overlap_are_told_of_and_left() {
    let mut outline = parts::arc([10.0, 10.0], 1.0, [45.0, 315.0], 24);
    outline.extend(parts::arc([10.0 + 2.0_f64.sqrt(), 10.0], 1.0, [225.0, 495.0], 24).into_iter().skip(1).take(23));
    let part = parts::plate([30.0, 20.0, 5.0], &[outline]);
    let limits = Limits { holes_below: Some(3.0), ..Limits::default() };
    let edit = defeature(&part.points, &part.triangles, &limits).unwrap();
    let found: Vec<_> = edit.features.iter().map(|f| (f.kind, f.outcome)).collect();
    assert_eq!(found, [(Kind::ThroughHole, Outcome::Left(Reason::Walls)); 2]);
    assert!(edit.removed_triangles.is_empty());
}
