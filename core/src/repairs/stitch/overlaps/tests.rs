use super::*;
use crate::geometry::tri_tri::Triangle as Corners;
use crate::testing::{After, after, cuboid, plate, reversed, shifted};

/// Two pieces this far apart.
fn cut(lower: &[Corners], upper: &[Corners], up: f32) -> After<u64> {
    after(&[lower, &shifted(upper, [0.0, 0.0, up])].concat(), |d, _| {
        cut_back(&mut d.survey, &mut Work::new(&mut d.submesh), &d.tolerance)
    })
}

#[test]
fn of_two_plates_that_lap_one_is_cut_back_and_joined() {
    let [left, right] = [plate(8, |x, _| x < 5), plate(8, |x, _| x >= 3)];
    // Sixteen squares lie on the other plate, as far as a ten-thousandth of their size goes. Both end at x = 5 then.
    let got = cut(&left, &right, 0.001);
    assert_eq!((got.result, got.defects.boundary_loops, got.defects.boundary_edges), (32, 1, 32));
    assert_eq!(got.defects.triangles, 128);
    assert_eq!(cut(&left, &right, 0.01).result, 0, "too far apart");
    assert_eq!(cut(&left, &reversed(&right), 0.001).result, 0, "a thin wall");
}

#[test]
fn what_is_left_of_a_piece_ends_in_front_of_the_other() {
    // Its squares are shifted by half of one.
    let right = shifted(&plate(8, |x, y| x >= 3 && (2..6).contains(&y)), [0.5, 0.5, 0.0]);
    let got = cut(&plate(8, |x, _| x < 5), &right, 0.001);
    // Of eight triangles a row of squares, two that reach over the end.
    assert_eq!(got.result, 4 * 4);
    assert_eq!((got.defects.boundary_loops, got.defects.components), (2, 2));
}

#[test]
fn a_lid_is_cut_to_its_hole() {
    let around = plate(8, |x, y| !(3..5).contains(&x) || !(3..5).contains(&y));
    let lid = plate(8, |x, y| (2..6).contains(&x) && (2..6).contains(&y));
    let got = cut(&around, &lid, 0.0005);
    assert_eq!((got.result, got.defects.triangles, got.defects.boundary_loops), (24, 128, 1));
}

#[test]
fn a_region_that_lies_on_a_body_goes_and_one_that_reaches_beyond_stays() {
    let body = cuboid([0.0, 0.0, -8.0], [8.0, 8.0, 0.0]);
    let got = cut(&body, &plate(8, |x, _| (2..6).contains(&x)), 0.001);
    assert_eq!(got.result, 64);
    assert!(got.verdict.good, "{:?}", got.verdict);
    let beyond = shifted(&plate(8, |_, _| true), [4.0, 0.0, 0.0]);
    assert_eq!(cut(&body, &beyond, 0.001).result, 0);
}

#[test]
fn neighbours_stay() {
    let [left, right] = [plate(8, |x, _| x < 4), plate(8, |x, _| x >= 4)];
    for up in [0.0, 0.001] {
        assert_eq!(cut(&left, &right, up).result, 0);
    }
    // A plate with a loose region in its hole.
    let around = plate(8, |x, y| !(3..5).contains(&x) || !(3..5).contains(&y));
    assert_eq!(cut(&around, &plate(8, |x, y| (3..5).contains(&x) && (3..5).contains(&y)), 0.001).result, 0);
}
