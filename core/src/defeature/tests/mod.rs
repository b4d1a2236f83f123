//! Parts made here, without and with a feature.

mod kinds;
mod parts;

use super::feature::Kind;
use super::{Limits, Outcome, Removed, defeature};
use parts::Part;
use proptest::prelude::*;
use std::collections::BTreeMap;

const ALL: Limits =
    Limits { holes_below: Some(3.0), fillets_below: Some(3.0), grooves_below: Some(3.0), bosses_below: Some(3.0) };

/// Triangles after an edit, as positions.
fn apply(part: &Part, edit: &Removed) -> Vec<[[f32; 3]; 3]> {
    let is_kept = |t: &usize| edit.removed_triangles.binary_search(&(*t as u32)).is_err();
    let kept = (0..part.triangles.len()).filter(is_kept).map(|t| part.triangles[t].map(|v| part.points[v as usize]));
    kept.chain(edit.added.iter().copied()).collect()
}

fn volume(triangles: &[[[f32; 3]; 3]]) -> f64 {
    let six = |t: &[[f32; 3]; 3]| {
        let [[a, b, c], [d, e, f], [g, h, i]] = t.map(|p| p.map(f64::from));
        a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    };
    triangles.iter().map(six).sum::<f64>() / 6.0
}

/// Each directed edge once, and its opposite too.
fn is_closed(triangles: &[[[f32; 3]; 3]]) -> bool {
    let key = |p: [f32; 3]| p.map(|x| (x + 0.0).to_bits());
    let mut edges: BTreeMap<([u32; 3], [u32; 3]), u32> = BTreeMap::new();
    for t in triangles {
        (0..3).for_each(|k| *edges.entry((key(t[k]), key(t[(k + 1) % 3]))).or_default() += 1);
    }
    edges.iter().all(|((a, b), n)| *n == 1 && edges.get(&(*b, *a)) == Some(&1))
}

/// One feature of a kind and size is found and removed; what is left is closed and has the volume of the bare part.
fn check(part: &Part, kind: Kind, size: f64, volume_left: f64) {
    let edit = defeature(&part.points, &part.triangles, &ALL).unwrap();
    let found: Vec<_> = edit.features.iter().map(|f| (f.kind, f.outcome)).collect();
    assert_eq!(found, [(kind, Outcome::Removed)], "{:?}", edit.features);
    assert!((edit.features[0].size - size).abs() < 1e-3 * size, "{}", edit.features[0].size);
    assert!(edit.features[0].confidence > 0.5);
    let left = apply(part, &edit);
    assert!(is_closed(&left));
    assert!((volume(&left) / volume_left - 1.0).abs() < 1e-6, "{} {volume_left}", volume(&left));
}

#[test]
fn a_bare_box_has_no_features() {
    let part = parts::plate([30.0, 20.0, 5.0], &[]);
    assert_eq!(defeature(&part.points, &part.triangles, &ALL).unwrap(), Removed::default());
}

#[test]
fn a_through_hole_is_filled_on_both_sides() {
    // 8 sides are the least for a circle.
    for sides in [8, 16, 200] {
        let part = parts::plate([30.0, 20.0, 5.0], &[parts::circle([12.0, 9.0], 1.0, sides)]);
        check(&part, Kind::ThroughHole, 2.0, 3000.0);
    }
}

#[test]
fn a_hole_of_the_limit_stays() {
    let part = parts::plate([30.0, 20.0, 5.0], &[parts::circle([12.0, 9.0], 1.6, 32)]);
    assert_eq!(defeature(&part.points, &part.triangles, &ALL).unwrap(), Removed::default());
}

#[test]
fn depressions_and_bosses_leave_their_face_flat() {
    let part = |outline: &[[f64; 2]], depth: f64| parts::stepped([30.0, 20.0, 5.0], outline, depth);
    check(&part(&parts::circle([12.0, 9.0], 1.0, 24), -2.0), Kind::BlindHole, 2.0, 3000.0);
    check(&part(&parts::circle([12.0, 9.0], 1.0, 24), 2.5), Kind::Boss, 2.5, 3000.0);
    let letter = [[10.0, 5.0], [13.0, 5.0], [13.0, 6.0], [11.0, 6.0], [11.0, 10.0], [10.0, 10.0]];
    check(&part(&letter, 0.5), Kind::Boss, 0.5, 3000.0);
    let strip = [[10.0, 5.0], [18.0, 5.0], [18.0, 7.0], [10.0, 7.0]];
    check(&part(&strip, -0.5), Kind::Slot, 2.0, 3000.0);
}

#[test]
fn what_lies_along_an_edge_is_filled_up_to_where_faces_meet() {
    // The outline of a bar along z: a rectangle of 20 by 10 but for one feature.
    let bar = |outline: &[[f64; 2]]| parts::bar(outline, 30.0);
    let groove = [[0.0, 0.0], [20.0, 0.0], [20.0, 10.0], [12.0, 10.0], [12.0, 8.0], [10.0, 8.0], [10.0, 10.0], [0.0, 10.0]];
    check(&bar(&groove), Kind::Groove, 2.0, 6000.0);
    let notch = [[0.0, 0.0], [20.0, 0.0], [20.0, 10.0], [12.0, 10.0], [11.0, 8.5], [10.0, 10.0], [0.0, 10.0]];
    check(&bar(&notch), Kind::Groove, 2.0, 6000.0);
    let chamfer = [[0.0, 0.0], [20.0, 0.0], [20.0, 9.0], [19.0, 10.0], [0.0, 10.0]];
    check(&bar(&chamfer), Kind::Chamfer, 2.0_f64.sqrt(), 6000.0);
    let mut convex = vec![[0.0, 0.0], [20.0, 0.0]];
    convex.extend(parts::arc([18.0, 8.0], 2.0, [0.0, 90.0], 6));
    convex.push([0.0, 10.0]);
    check(&bar(&convex), Kind::Fillet, 2.0, 6000.0);
    // An L of 20 by 10 with a square of 10 by 5 missing; its inner corner is rounded.
    let mut concave = vec![[0.0, 0.0], [20.0, 0.0], [20.0, 5.0]];
    concave.extend(parts::arc([12.0, 7.0], 2.0, [270.0, 180.0], 6));
    concave.extend([[10.0, 10.0], [0.0, 10.0]]);
    check(&bar(&concave), Kind::Fillet, 2.0, 4500.0);
}

#[test]
fn triangles_of_a_fillet_may_run_askew() {
    // The vertices of both ends are on one cylinder, at other angles: no two triangles lie in a plane.
    let outline = |power: f64| {
        let mut outline = vec![[0.0, 0.0], [20.0, 0.0]];
        let angle = |k: i32| 90.0_f64.to_radians() * (f64::from(k) / 8.0).powf(power);
        outline.extend((0..=8).map(|k| [18.0 + 2.0 * angle(k).cos(), 8.0 + 2.0 * angle(k).sin()]));
        outline.push([0.0, 10.0]);
        outline
    };
    check(&parts::lofted(&outline(1.0), &outline(1.15), 30.0), Kind::Fillet, 2.0, 6000.0);
}

/// The tip of a tooth between steep flanks, and the narrow floor of a V, are no bevelled edges: where their faces meet is far away.
#[test]
fn narrow_flats_between_steep_faces_are_no_chamfers() {
    let limits = Limits { fillets_below: Some(3.0), ..Limits::default() };
    let tooth = [[0.0, 0.0], [20.0, 0.0], [20.0, 5.0], [12.0, 5.0], [10.5, 9.0], [9.5, 9.0], [8.0, 5.0], [0.0, 5.0]];
    let floor = [[0.0, 0.0], [20.0, 0.0], [20.0, 10.0], [12.0, 10.0], [10.5, 6.0], [9.5, 6.0], [8.0, 10.0], [0.0, 10.0]];
    for outline in [tooth, floor] {
        let part = parts::bar(&outline, 30.0);
        assert_eq!(defeature(&part.points, &part.triangles, &limits).unwrap(), Removed::default());
    }
}

#[test]
fn the_rounded_end_of_a_shaft_is_a_fillet() {
    // Narrow strips of the torus are cylinders within the tolerance, its last row is a cone; of the wider one, little of the
    // shaft's end is left.
    for (minor, steps, columns) in [(0.9, 16, 64), (3.0, 6, 48)] {
        let mut profile = vec![[6.0, 0.0]];
        profile.extend(parts::arc([6.0 - minor, 12.0 - minor], minor, [0.0, 90.0], steps));
        let part = parts::shaft(&profile, columns);
        let limits = Limits { fillets_below: Some(4.0), ..Limits::default() };
        let edit = defeature(&part.points, &part.triangles, &limits).unwrap();
        let found: Vec<_> = edit.features.iter().map(|f| (f.kind, f.outcome)).collect();
        assert_eq!(found, [(Kind::Fillet, Outcome::Removed)]);
        assert!((edit.features[0].size - minor).abs() < 1e-3 * minor, "{}", edit.features[0].size);
        let left = apply(&part, &edit);
        assert!(is_closed(&left));
        let off = |p: &[f32; 3]| f64::from(p[0]).hypot(f64::from(p[1])) - 6.0;
        assert!(left.iter().flatten().all(|p| off(p).abs() < 1e-5 && (p[2].abs() < 1e-5 || (p[2] - 12.0).abs() < 1e-5)));
        assert!((volume(&left) / (std::f64::consts::PI * 36.0 * 12.0) - 1.0).abs() < 5e-3, "{}", volume(&left));
    }
}

#[test]
fn nested_features_go_from_within() {
    // A boss of 3 mm with a blind hole of 1 mm in it.
    let part = parts::tower([30.0, 20.0, 5.0], [12.0, 9.0], [(3.0, 2.0), (1.0, -1.0)]);
    let edit = defeature(&part.points, &part.triangles, &ALL).unwrap();
    let kinds: Vec<Kind> = edit.features.iter().map(|f| f.kind).collect();
    assert_eq!(kinds, [Kind::BlindHole, Kind::Boss]);
    let left = apply(&part, &edit);
    assert!(is_closed(&left) && (volume(&left) - 3000.0).abs() < 1e-2);
}

#[test]
fn faces_that_no_feature_touches_stay_as_they_are() {
    let part = parts::plate([30.0, 20.0, 5.0], &[parts::circle([12.0, 9.0], 1.0, 16)]);
    let edit = defeature(&part.points, &part.triangles, &ALL).unwrap();
    assert_eq!(edit.features[0].triangles.len(), 32);
    // The wall of 16 quads goes, and both faces around it become two triangles each; the four sides stay.
    let height = |t: u32| part.triangles[t as usize].map(|v| part.points[v as usize][2]);
    let sides = (0..part.triangles.len() as u32).filter(|t| !edit.removed_triangles.contains(t));
    assert_eq!(sides.inspect(|t| assert_ne!(height(*t)[0] + height(*t)[1] + height(*t)[2], 15.0)).count(), 8);
    assert_eq!(edit.added.len(), 4);
}

#[test]
fn many_holes_hold_most_triangles() {
    let places: Vec<_> =
        (0..12).map(|k| parts::circle([3.0 + f64::from(k % 4) * 7.0, 4.0 + f64::from(k / 4) * 6.0], 1.0, 24)).collect();
    let part = parts::plate([30.0, 20.0, 5.0], &places);
    let edit = defeature(&part.points, &part.triangles, &ALL).unwrap();
    assert_eq!(edit.features.len(), 12);
    let left = apply(&part, &edit);
    assert!(is_closed(&left));
    assert_eq!(left.len(), 12);
}

#[test]
fn a_mesh_with_a_rim_is_refused() {
    let part = parts::plate([3.0, 2.0, 1.0], &[]);
    assert!(matches!(defeature(&part.points, &part.triangles[1..], &ALL), Err(super::DefeatureError::Open(..))));
    assert!(matches!(defeature(&part.points, &[[0, 1, 99]], &ALL), Err(super::DefeatureError::Index(0))));
    assert_eq!(defeature(&[], &[], &ALL).unwrap(), Removed::default());
}

#[test]
fn a_smooth_body_has_no_features() {
    // A wavy ball of latitudes and longitudes, uneven as scans are: patches of it are nearly flat, none is a slot.
    let part = parts::ball(120, |[x, y, z]: [f64; 3]| 50.0 * (1.0 + 0.1 * (3.1 * x + 1.0).sin() * (2.3 * y + 2.0 * z).cos()));
    assert_eq!(defeature(&part.points, &part.triangles, &ALL).unwrap(), Removed::default());
}

/// The crest and the foot of a ring are flat where its sections are even: facets of the body, not faces that a hole leads between.
#[test]
fn the_throat_of_a_ring_is_no_hole() {
    for (wide, high, sections) in [(2.0, 2.0, 20), (2.0, 3.0, 20), (3.0, 2.0, 28)] {
        let section = |k: usize| [std::f64::consts::TAU * (k as f64 + 0.5) / sections as f64].map(f64::sin_cos)[0];
        let profile: Vec<_> = (0..sections).map(section).map(|(s, c)| [10.0 + wide * c, high * s]).collect();
        let part = parts::ring(&profile, 48);
        let limits =
            Limits { holes_below: Some(50.0), fillets_below: Some(1.0), grooves_below: Some(50.0), bosses_below: Some(50.0) };
        assert_eq!(defeature(&part.points, &part.triangles, &limits).unwrap(), Removed::default());
    }
    // The same throat between flat faces is one.
    let part = parts::ring(&[[8.0, -2.0], [15.0, -2.0], [15.0, 2.0], [8.0, 2.0]], 48);
    let edit = defeature(&part.points, &part.triangles, &Limits { holes_below: Some(50.0), ..Limits::default() }).unwrap();
    assert_eq!(edit.features.iter().map(|f| (f.kind, f.outcome)).collect::<Vec<_>>(), [(Kind::ThroughHole, Outcome::Removed)]);
}

/// Each valley between triangles of a coarse sculpture has two walls that lean towards each other: three vertices lie on a plane
/// anywhere.
#[test]
fn valleys_of_a_free_form_are_no_grooves() {
    let part = parts::ball(14, |[x, y, z]: [f64; 3]| {
        8.0 + 0.7 * (11.3 * x + 1.0).sin() * (9.7 * y + 2.0).cos() + 0.6 * (8.9 * z + 7.1 * x).sin()
    });
    assert_eq!(defeature(&part.points, &part.triangles, &ALL).unwrap(), Removed::default());
}

#[test]
fn what_was_removed_is_not_found_again() {
    let part = parts::stepped([30.0, 20.0, 5.0], &parts::circle([12.0, 9.0], 1.0, 24), -2.0);
    let left = apply(&part, &defeature(&part.points, &part.triangles, &ALL).unwrap());
    let points: Vec<[f32; 3]> = left.iter().flatten().copied().collect();
    let place = |p: &[f32; 3]| points.iter().position(|q| q == p).map_or(0, |k| k as u32);
    let triangles: Vec<[u32; 3]> = left.iter().map(|t| [place(&t[0]), place(&t[1]), place(&t[2])]).collect();
    assert_eq!(defeature(&points, &triangles, &ALL).unwrap(), Removed::default());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Wherever a hole is and however the part lies: the result is closed and has the volume of the part without it.
    #[test]
    fn holes_anywhere(x in 3.0..27.0, y in 3.0..17.0, r in 0.2..1.4, sides in 8_usize..80, turn in 0.0..6.0, scale in 0.1..10.0) {
        let mut part = parts::plate([30.0, 20.0, 5.0], &[parts::circle([x, y], r, sides)]);
        part.turn(turn, scale);
        let limits = Limits { holes_below: Some(3.0 * scale), ..Limits::default() };
        let edit = defeature(&part.points, &part.triangles, &limits).unwrap();
        prop_assert_eq!(edit.features.len(), 1);
        let left = apply(&part, &edit);
        prop_assert!(is_closed(&left));
        prop_assert!((volume(&left) / (3000.0 * scale.powi(3)) - 1.0).abs() < 1e-5);
    }

    /// Meshes of no part, with vertices moved at random: whatever is done, the result is closed.
    #[test]
    fn dented_parts_stay_closed(moves in prop::collection::vec((0_usize..60, -0.4_f32..0.4), 1..20), depth in -3.0..3.0) {
        let mut part = parts::stepped([30.0, 20.0, 5.0], &parts::circle([12.0, 9.0], 2.0, 16), depth);
        for (vertex, by) in moves {
            let count = part.points.len();
            part.points[vertex % count][vertex % 3] += by;
        }
        let edit = defeature(&part.points, &part.triangles, &ALL).unwrap();
        prop_assert!(is_closed(&apply(&part, &edit)));
        prop_assert_eq!(edit, defeature(&part.points, &part.triangles, &ALL).unwrap());
    }
}
