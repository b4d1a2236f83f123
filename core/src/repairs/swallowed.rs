//! Bodies and sheets inside the material of others (METHODS B5): they bound nothing, since there is material on both of their sides.
//!
//! A piece of surface that crosses nothing lies in one cell of the rest, so that the winding number of the closed pieces around one of its
//! points says on how much material its outer side looks out; its inner side has one more or, of a cavity, one less. Material is where the
//! winding number is positive (Jacobson et al., "Robust inside-outside segmentation using generalized winding numbers", ACM TOG 32(4), 2013;
//! of closed pieces it is an integer). Integers from exact predicates: nothing is decided by a margin.

use super::guard::components_of_records;
use super::orient;
use super::work::Work;
use crate::bodies;
use crate::chunk::NONE;
use crate::settings::{Bodies, Profile};
use crate::shop::Shop;
use crate::shop::components::{Component, Components, Reversed};
use crate::survey::Survey;

/// What was swallowed.
#[derive(Clone, Debug, Default)]
pub(crate) struct Swallowed {
    pub(crate) bodies: u64,
    pub(crate) sheets: u64,
    /// What the bodies enclose less their cavities, which lies in the bodies around them as well. In the file's units, cubed.
    pub(crate) volume: f64,
    /// Which patches of sound surface go with them; empty: none.
    pub(crate) patches: Vec<bool>,
}

/// Removes what lies in the material of others and crosses nothing. Nothing is removed if it is not known what crosses what. Reads the
/// chunks where pieces lie inside others' boxes.
pub(super) fn remove(survey: &Survey<'_>, work: &mut Work<'_>, reversed: &Reversed, profile: &Profile) -> Swallowed {
    let mut swallowed = Swallowed::default();
    let Some(crossing_pairs) = survey.crossing_pairs.as_deref().filter(|_| profile.bodies == Bodies::Union) else {
        return swallowed;
    };
    let pieces = orient::pieces(survey, work, reversed);
    let shop: &Shop = work;
    let around = bodies::surroundings(survey, shop, &pieces, reversed, |_| true);
    if around.iter().all(|a| a.winding() < 1) {
        return swallowed;
    }
    let crossing = crossing(survey, shop, &pieces, crossing_pairs.iter().map(|pair| pair.triangles));
    let is_swallowed: Vec<bool> = pieces
        .list
        .iter()
        .zip(&around)
        .zip(&crossing)
        .map(|((piece, around), crosses)| !crosses && lies_in_material(piece, around.winding()))
        .collect();
    for (piece, _) in pieces.list.iter().zip(&is_swallowed).filter(|(_, gone)| **gone) {
        if piece.open {
            swallowed.sheets += 1;
        } else {
            swallowed.bodies += u64::from(piece.extent.volume > 0);
            swallowed.volume += survey.measure.volume(piece.extent);
        }
    }
    if !is_swallowed.contains(&true) {
        return swallowed;
    }
    let goes = |piece: &u32| *piece != NONE && is_swallowed[*piece as usize];
    swallowed.patches = pieces.of_patch.iter().map(goes).collect();
    let doomed: Vec<u32> = shop.living().filter(|t| goes(&pieces.of_triangle[*t as usize])).collect();
    doomed.into_iter().for_each(|t| work.kill(t));
    swallowed
}

/// Is there material on both sides of a piece outside of which the others wind so many times?
fn lies_in_material(piece: &Component, outside: i32) -> bool {
    let inside = match piece.extent.volume.signum() {
        _ if piece.open => outside,
        1 => outside + 1,
        -1 => outside - 1,
        _ => return false,
    };
    outside.min(inside) >= 1
}

/// Which pieces cross another one.
fn crossing(survey: &Survey<'_>, shop: &Shop, pieces: &Components, pairs: impl Iterator<Item = [u32; 2]> + Clone) -> Vec<bool> {
    let mut crossing = vec![false; pieces.list.len()];
    let of_record = components_of_records(survey, shop, pieces, pairs.clone().flatten());
    for pair in pairs {
        // What is gone crosses nothing any more.
        if let [Some(a), Some(b)] = pair.map(|record| of_record.get(&record).copied().filter(|piece| *piece != NONE))
            && a != b
        {
            crossing[a as usize] = true;
            crossing[b as usize] = true;
        }
    }
    crossing
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{After, Corners, after, cuboid, plate, reversed, shifted};

    fn nested(size: f32) -> Vec<Corners> {
        cuboid([-size; 3], [size; 3])
    }

    fn removed(mesh: &[Corners], bodies: Bodies) -> After<(u64, u64, f64)> {
        let profile = Profile { bodies, ..Profile::default() };
        after(mesh, |d, turned| {
            let Swallowed { bodies, sheets, volume, patches } = remove(&d.survey, &mut Work::new(&mut d.shop), turned, &profile);
            turned.dropped = patches;
            (bodies, sheets, volume)
        })
    }

    #[test]
    fn a_body_inside_another_goes_and_a_cavity_with_what_floats_in_it_stays() {
        let hollow = [nested(4.0), reversed(&nested(2.0)), nested(1.0)].concat();
        let inside = shifted(&nested(0.5), [3.0, 3.0, 3.0]);
        let got = removed(&[hollow.clone(), inside.clone()].concat(), Bodies::Union);
        assert_eq!((got.result, got.untouched), ((1, 0, 1.0), 36));
        assert!((got.defects.volume - (512.0 - 64.0 + 8.0)).abs() < 1e-9, "{}", got.defects.volume);
        assert_eq!(removed(&[hollow, inside].concat(), Bodies::Keep).untouched, 48);
    }

    #[test]
    fn a_hollow_body_inside_another_goes_with_its_cavity_and_what_floats_there() {
        let got = removed(&[nested(8.0), nested(4.0), reversed(&nested(2.0)), nested(1.0)].concat(), Bodies::Union);
        assert_eq!((got.result, got.untouched), ((2, 0, 512.0 - 64.0 + 8.0), 12));
    }

    #[test]
    fn a_sheet_inside_a_body_goes_and_one_outside_stays() {
        let sheet = shifted(&plate(2, |_, _| true), [-1.0, -1.0, 0.5]);
        let got = removed(&[nested(4.0), sheet.clone(), shifted(&sheet, [20.0, 0.0, 0.0])].concat(), Bodies::Union);
        assert_eq!((got.result, got.untouched), ((0, 1, 0.0), 20));
    }

    #[test]
    fn a_body_that_sticks_out_is_not_swallowed() {
        // Its box is not in the other's, or it crosses: two needles, one through the octahedron-shaped corner of a slanted body.
        let needle = cuboid([-0.1, -0.1, -1.0], [0.1, 0.1, 5.0]);
        assert_eq!(removed(&[nested(4.0), needle].concat(), Bodies::Union).result, (0, 0, 0.0));
    }
}
