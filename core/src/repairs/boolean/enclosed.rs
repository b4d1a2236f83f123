//! Bodies inside the material of others: they bound nothing, since there is material on both of their sides.
//!
//! A piece of surface that crosses nothing lies in one cell of the rest, so that the winding number of the closed pieces around one of its
//! points says on how much material its outer side looks out; its inner side has one more or, of a cavity, one less. Material is where the
//! winding number is positive (Jacobson et al., "Robust inside-outside segmentation using generalized winding numbers", ACM TOG 32(4), 2013;
//! of closed pieces it is an integer). Integers from exact predicates: nothing is decided by a margin.
//!
//! What is removed is lost, so that only what the file itself says counts: a piece that was closed or turned by a repair is not removed, one that was
//! closed by more than small patches does not swallow anything (a vessel whose mouth was closed would swallow what stands in it), and nothing is
//! removed where an open piece might be the wall of a cavity. Of a body that stays for that, somebody must see what it is. A sheet in the material of a
//! body stays: it may be the floor of a hole whose walls lack.

use std::cmp::Reverse;

use crate::contract::report::RepairName;
use crate::contract::report::{Region, RegionMethod};
use crate::contract::settings::{Bodies, Profile};
use crate::detect::bodies;
use crate::detect::review::Enclosed;
use crate::geometry::boxes::BoxTree;
use crate::geometry::sums::Bounds;
use crate::repairs::shared::context::{Changes, Done, Repair};
use crate::repairs::shared::pieces::{are_patched, crossing, lies_in_material, take_away};
use crate::repairs::shared::unsaid;
use crate::repairs::shared::work::Work;
use crate::submesh::components::{Component, Components, Reversed};
use crate::submesh::{Origin, Submesh};
use crate::topology::survey::Survey;
use crate::util::ids::NONE;
use crate::util::words::{Count, Short, span};

/// Specks of which nothing is told are together no more than this share of all volume.
const SPECK: f64 = 1e-3;

/// Bodies in the material of others.
pub(crate) const REPAIR: Repair = Repair {
    name: RepairName::Enclosed,
    changes: Changes::Pieces,
    run: |cx| {
        if cx.profile.bodies != Bodies::Union {
            return Ok(Done::count(0, ""));
        }
        let pieces = cx.pieces();
        let mut enclosed = remove(cx.survey, &mut cx.work, &mut cx.reversed, &pieces, cx.profile);
        let Enclosed { bodies, volume, .. } = enclosed;
        // Cavities that went are no bodies.
        let changed = !enclosed.regions.is_empty();
        cx.account.regions.append(&mut enclosed.regions);
        cx.account.enclose(bodies, volume);
        cx.account.enclosed.filled = volume;
        if let Some(bounds) = enclosed.left {
            cx.account.doubts.push(format!(
                "a body lies in the material of another one, and a repair has closed or turned one of both: it may stand in a vessel, or bound a hollow; \
                 the largest is {}",
                span([bounds.lo, bounds.hi])
            ));
        }
        let note = format!("bodies in the material of others removed: {}, of {} units³ together", Count(bodies), Short(volume));
        Ok(Done { changed, ..Done::count(bodies, note) })
    },
};

/// Removes what lies in the material of others and crosses nothing. Nothing is removed if it is not known what crosses what. Reads the
/// chunks where pieces lie inside others' boxes.
/// `pieces`: as [`crate::repairs::shared::pieces::pieces`] finds them.
pub(crate) fn remove(
    survey: &Survey<'_>,
    work: &mut Work<'_>,
    reversed: &mut Reversed,
    pieces: &Components,
    profile: &Profile,
) -> Enclosed {
    let mut enclosed = Enclosed::default();
    let Some(crossing_pairs) = survey.crossing_pairs.as_deref().filter(|_| profile.bodies == Bodies::Union) else {
        return enclosed;
    };
    let submesh: &Submesh = work;
    let around = bodies::surroundings(survey, submesh, pieces, reversed, |piece| !piece.open);
    if around.iter().all(|a| a.winding() < 1) {
        return enclosed;
    }
    let crossing = crossing(survey, submesh, pieces, crossing_pairs.iter().map(|pair| pair.triangles));
    let (is_as_read, is_patched) = (are_as_read(survey, submesh, pieces, reversed), are_patched(survey, submesh, pieces));
    let open: Vec<Bounds> = pieces.list.iter().filter(|piece| piece.open).map(|piece| piece.bounds).collect();
    let open = BoxTree::new(&open);
    let mut met = Vec::new();
    let mut in_material = |i: usize| {
        let piece = &pieces.list[i];
        open.meeting(&piece.bounds, &mut met);
        !crossing[i] && met.is_empty() && lies_in_material(piece, around[i].winding())
    };
    let in_material: Vec<bool> = (0..pieces.list.len()).map(&mut in_material).collect();
    let is_known = |i: usize| is_as_read[i] && around[i].around.iter().all(|(outer, _)| !is_patched[*outer as usize]);
    let is_enclosed: Vec<bool> = (0..pieces.list.len()).map(|i| in_material[i] && is_known(i)).collect();
    let left = (0..pieces.list.len()).filter(|i| in_material[*i] && !is_enclosed[*i]).map(|i| &pieces.list[i]);
    let left: Vec<&Component> = left.filter(|piece| piece.extent.volume > 0).collect();
    let all: f64 = pieces.list.iter().map(|piece| piece.extent.volume.abs() as f64).sum();
    let told = unsaid::told(&left.iter().map(|piece| piece.extent.volume as f64).collect::<Vec<_>>(), SPECK * all);
    let left = left.into_iter().zip(told).filter(|(_, told)| *told).map(|(piece, _)| piece);
    let largest = left.max_by_key(|piece| (piece.extent.volume, Reverse(piece.sample)));
    enclosed.left = largest.map(|piece| piece.bounds.normalised());
    for (piece, _) in pieces.list.iter().zip(&is_enclosed).filter(|(_, gone)| **gone) {
        enclosed.bodies += u64::from(piece.extent.volume > 0);
        enclosed.volume += survey.measure.volume(piece.extent);
        let Bounds { lo, hi } = piece.bounds.normalised();
        let (method, bounds, count) = (RegionMethod::Dropped, [lo, hi], piece.triangles);
        enclosed.regions.push(Region { method, bounds, count, rounds: 0, moved: 0.0, reason: None });
    }
    if !is_enclosed.contains(&true) {
        return enclosed;
    }
    take_away(work, reversed, pieces, &is_enclosed);
    enclosed
}

/// Which pieces hold nothing but triangles of the file, the way round that they have there.
fn are_as_read(survey: &Survey<'_>, submesh: &Submesh, pieces: &Components, reversed: &Reversed) -> Vec<bool> {
    let mut as_read = vec![true; pieces.list.len()];
    let turned = pieces.of_region.iter().zip(&reversed.regions).filter(|(piece, turned)| **turned && **piece != NONE);
    turned.for_each(|(piece, _)| as_read[*piece as usize] = false);
    for t in submesh.beside_records(survey).filter(|t| submesh.lives(*t)) {
        let is_as_read = match submesh.triangles[t as usize].origin {
            Origin::Input(_) => {
                let [a, b, c] = submesh.points(t);
                submesh.as_read(survey.records, t) != Some([a, c, b])
            }
            Origin::Part(_) => true,
            Origin::Added(_) => false,
        };
        let piece = pieces.of_triangle[t as usize];
        if !is_as_read && piece != NONE {
            as_read[piece as usize] = false;
        }
    }
    as_read
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::repairs::holes::fill;
    use crate::repairs::orient::directions;
    use crate::repairs::shared::pieces;
    use crate::testing::{After, Corners, after, cuboid, plate, reversed, shifted};

    fn nested(size: f32) -> Vec<Corners> {
        cuboid([-size; 3], [size; 3])
    }

    fn removed(mesh: &[Corners], bodies: Bodies) -> After<(u64, f64)> {
        let profile = Profile { bodies, ..Profile::default() };
        after(mesh, |d, turned| {
            let work = &mut Work::new(&mut d.submesh);
            directions::make_coherent(&d.survey, work, turned, &[]);
            fill::fill_loops(&d.survey, work, turned, &d.tolerance, (&profile, None), 1);
            let pieces = pieces::pieces(&d.survey, work, turned);
            directions::make_outward(&d.survey, work, turned, &pieces);
            let pieces = pieces::pieces(&d.survey, work, turned);
            let Enclosed { bodies, volume, .. } = remove(&d.survey, work, turned, &pieces, &profile);
            (bodies, volume)
        })
    }

    #[test]
    fn a_body_inside_another_goes_and_a_cavity_with_what_floats_in_it_stays() {
        let hollow = [nested(4.0), reversed(&nested(2.0)), nested(1.0)].concat();
        let inside = shifted(&nested(0.5), [3.0, 3.0, 3.0]);
        let got = removed(&[hollow.clone(), inside.clone()].concat(), Bodies::Union);
        assert_eq!((got.result, got.untouched), ((1, 1.0), 36));
        assert!((got.defects.volume - (512.0 - 64.0 + 8.0)).abs() < 1e-9, "{}", got.defects.volume);
        assert_eq!(removed(&[hollow, inside].concat(), Bodies::Keep).untouched, 48);
    }

    #[test]
    fn a_hollow_body_inside_another_goes_with_its_cavity_and_what_floats_there() {
        let got = removed(&[nested(8.0), nested(4.0), reversed(&nested(2.0)), nested(1.0)].concat(), Bodies::Union);
        assert_eq!((got.result, got.untouched), ((2, 512.0 - 64.0 + 8.0), 12));
    }

    #[test]
    fn a_sheet_inside_a_body_stays_and_so_does_what_may_be_behind_it() {
        let sheet = shifted(&plate(2, |_, _| true), [-1.0, -1.0, 0.5]);
        let beside = shifted(&nested(0.5), [3.0, 3.0, 3.0]);
        assert_eq!(removed(&[nested(4.0), sheet.clone(), beside].concat(), Bodies::Union).result.0, 1);
        let beneath = shifted(&nested(0.5), [0.0, 0.0, 0.25]);
        let got = removed(&[nested(4.0), sheet, beneath].concat(), Bodies::Union);
        assert_eq!((got.result.0, got.untouched), (0, 32));
    }

    #[test]
    fn what_a_repair_has_closed_or_turned_encloses_nothing_and_is_not_enclosed() {
        let inside = || shifted(&nested(0.5), [1.0, 1.0, 1.0]);
        // A tray without its top.
        let mut tray = nested(4.0);
        tray.drain(2..4);
        assert_eq!(removed(&[tray, inside()].concat(), Bodies::Union).result.0, 0);
        // A shell of which half is turned may have been meant for a cavity.
        let mut torn = nested(2.0);
        (0..6).for_each(|i| torn[i] = reversed(&torn[i..=i])[0]);
        assert_eq!(removed(&[nested(4.0), torn].concat(), Bodies::Union).result.0, 0);
        assert_eq!(removed(&[nested(4.0), inside()].concat(), Bodies::Union).result.0, 1);
    }

    #[test]
    fn many_bodies_that_are_each_a_speck_are_told_of() {
        // Each closed by a patch, so that nobody knows if it is to go, and a five-thousandth of the host.
        let open = |i: u8| shifted(&nested(0.25), [f32::from(i % 4) - 2.0, f32::from(i / 4) - 2.0, 0.0])[1..].to_vec();
        let is_told = |count: u8| {
            let all: Vec<Corners> = std::iter::once(nested(4.0)).chain((0..count).map(open)).flatten().collect();
            let got = after(&all, |d, turned| {
                let work = &mut Work::new(&mut d.submesh);
                fill::fill_loops(&d.survey, work, turned, &d.tolerance, (&Profile::default(), None), 1);
                let pieces = pieces::pieces(&d.survey, work, turned);
                remove(&d.survey, work, turned, &pieces, &Profile::default()).left.is_some()
            });
            got.result
        };
        assert_eq!([1, 16].map(is_told), [false, true]);
    }

    #[test]
    fn a_body_that_sticks_out_is_not_enclosed() {
        let needle = cuboid([-0.1, -0.1, -1.0], [0.1, 0.1, 5.0]);
        assert_eq!(removed(&[nested(4.0), needle].concat(), Bodies::Union).result.0, 0);
        // Its box lies in the other's, which it crosses: a corner of the slanted half of a cube.
        let [x, y, z] = [[4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 4.0]];
        let o = [0.0; 3];
        let wedge: Vec<Corners> = vec![[o, y, x], [o, x, z], [o, z, y], [x, y, z]];
        let crossing = cuboid([0.5; 3], [2.0; 3]);
        assert_eq!(removed(&[wedge.clone(), crossing].concat(), Bodies::Union).result.0, 0);
        assert_eq!(removed(&[wedge, cuboid([0.5; 3], [0.75; 3])].concat(), Bodies::Union).result.0, 1);
    }
}
