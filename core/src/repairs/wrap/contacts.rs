//! What wraps run into: other pieces, and each other.

use super::outcome::Outcome;
use super::site::Site;
use crate::algorithms::wrap::tree::Corners;
use crate::geometry::boxes::BoxTree;
use crate::geometry::position::Position;
use crate::geometry::sums::Bounds;
use crate::io::record;
use crate::repairs::shared::overlay::{Held, Overlay, Which};
use crate::repairs::shared::pieces::components_of_records;
use crate::util::ids::NONE;
use std::collections::BTreeMap;

/// Wraps that are not given up yet, and what they replace.
struct Accepted<'o> {
    groups: Vec<(&'o Vec<u32>, &'o Outcome)>,
    /// By piece: a wrap replaces it.
    goes: Vec<bool>,
    /// How many triangles all wraps have.
    count: u32,
    /// Where the triangles of each group begin.
    starts: Vec<u32>,
    /// The triangles of wraps in whose boxes there may be something else, by number: a piece that stays, or another group's wrap. (No wrap meets itself.)
    exposed: Vec<(u32, Corners)>,
}

impl<'o> Accepted<'o> {
    fn of(site: &Site<'_, '_>, outcomes: &'o BTreeMap<Vec<u32>, Outcome>) -> Self {
        let groups: Vec<(&Vec<u32>, &Outcome)> = outcomes.iter().filter(|(_, o)| o.told.left.is_none()).collect();
        let mut goes = vec![false; site.pieces.list.len()];
        groups.iter().flat_map(|(group, _)| group.iter()).for_each(|piece| goes[*piece as usize] = true);
        let wraps: Vec<&[Corners]> = groups.iter().map(|(_, outcome)| outcome.triangles.as_slice()).collect();
        let starts = wraps.iter().scan(0, |end, wrap| Some(std::mem::replace(end, *end + wrap.len() as u32))).collect();
        let count = wraps.iter().map(|wrap| wrap.len() as u32).sum();
        let stays = (0..).zip(&site.pieces.list).filter(|(piece, _): &(usize, _)| !goes[*piece]);
        let exposed = exposed(&wraps, stays.map(|(_, piece)| piece.bounds));
        Self { groups, goes, count, starts, exposed }
    }

    fn goes(&self, piece: u32) -> bool {
        piece != NONE && self.goes[piece as usize]
    }

    /// A piece of the group that a triangle of a wrap replaces; `number`: among the triangles of wraps.
    fn piece_of(&self, number: u32) -> u32 {
        self.groups[self.starts.partition_point(|s| *s <= number) - 1].0[0]
    }

    /// Records that go, ascending.
    fn gone(&self, site: &Site<'_, '_>) -> Vec<u32> {
        let of_submesh = site.submesh.living().filter(|t| self.goes(site.pieces.of_triangle[*t as usize]));
        let mut gone: Vec<u32> = of_submesh.map(|t| site.submesh.record(t)).collect();
        let regular = site.survey.visit_regular(
            |region| self.goes(site.pieces.of_region[region as usize]),
            Vec::new,
            |list: &mut Vec<u32>, record, _| list.push(record),
        );
        gone.extend(regular.into_iter().flatten());
        gone.sort_unstable();
        gone
    }

    /// Pieces, one of them of a wrap, whose triangles cross. `None` if that is too much work to tell.
    fn crossing(&self, site: &Site<'_, '_>) -> Option<Vec<[u32; 2]>> {
        let overlay = Overlay::of(site.survey, site.submesh, site.reversed)?;
        let gone = self.gone(site);
        let pairs = overlay.met_by_others(
            site.survey,
            site.submesh,
            (self.count, &self.exposed),
            |t| !self.goes(site.pieces.of_triangle[t as usize]),
            |record| gone.binary_search(&record).is_ok(),
        )?;
        let old = pairs.iter().flatten().filter_map(|held| match held {
            Held::Surface(number) => overlay.record_of(*number),
            Held::Other(_) => None,
        });
        let of_record = components_of_records(site.survey, site.submesh, site.pieces, old);
        let piece = |held: Held| match held {
            Held::Other(new) => self.piece_of(new),
            Held::Surface(number) => match overlay.which(number) {
                Which::Submesh(t) => site.pieces.of_triangle[t as usize],
                Which::Record(record) => of_record.get(&record).copied().unwrap_or(NONE),
            },
        };
        Some(pairs.into_iter().map(|pair| pair.map(piece)).collect())
    }

    /// Pieces, one of them of a wrap, that have a vertex in one place: it would be one vertex when the file is read.
    fn touching(&self, site: &Site<'_, '_>) -> Vec<[u32; 2]> {
        let mut corners: Vec<(Position, u32)> = Vec::with_capacity(3 * self.exposed.len());
        for (number, triangle) in &self.exposed {
            corners.extend(triangle.map(|p| (Position::of(p), self.piece_of(*number))));
        }
        corners.sort_unstable();
        corners.dedup();
        let same_place = corners.windows(2).filter(|pair| pair[0].0 == pair[1].0);
        let mut met: Vec<[u32; 2]> = same_place.map(|pair| [pair[0].1, pair[1].1]).collect();
        let at = |p: [f32; 3]| {
            let found = corners.partition_point(|(q, _)| *q < Position::of(p));
            corners.get(found).filter(|(q, _)| *q == Position::of(p)).map(|(_, piece)| *piece)
        };
        for t in site.submesh.living() {
            let own = site.pieces.of_triangle[t as usize];
            if !self.goes(own) {
                met.extend(site.submesh.points(t).into_iter().filter_map(at).map(|piece| [piece, own]));
            }
        }
        let mut bounds = Bounds::EMPTY;
        self.exposed.iter().for_each(|(_, t)| bounds.include(t));
        let touched = site.survey.visit_regular_near(
            |region| !site.reversed.dropped[region as usize] && !self.goes(site.pieces.of_region[region as usize]),
            |reach| reach.overlap(&bounds).map(|_| Vec::new()),
            |_, some| some.overlap(&bounds).is_some(),
            |_, corners| corners.iter().any(|p| at(*p).is_some()),
            |list: &mut Vec<(u32, u32)>, record, region| list.push((record, region)),
        );
        for (record, region) in touched.into_iter().flatten() {
            let corners = record::corners(&site.survey.records[record as usize]);
            met.extend(corners.into_iter().filter_map(at).map(|piece| [piece, site.pieces.of_region[region as usize]]));
        }
        met
    }
}

/// The triangles of wraps that a box of what stays meets, or of another wrap, by their numbers among all. O(n log boxes).
fn exposed(wraps: &[&[Corners]], stays: impl Iterator<Item = Bounds>) -> Vec<(u32, Corners)> {
    let mut boxes: Vec<Bounds> = wraps.iter().map(|wrap| Bounds::of(wrap.as_flattened())).collect();
    boxes.extend(stays.filter(|bounds| !bounds.is_empty()));
    let others = BoxTree::new(&boxes);
    let own = (0..).zip(wraps).flat_map(|(own, wrap)| wrap.iter().map(move |corners| (own, *corners)));
    let numbered = (0..).zip(own).filter(|(_, (own, corners))| others.meets_another(&Bounds::of(corners), *own));
    numbered.map(|(number, (_, corners))| (number, corners)).collect()
}

/// Which pieces an accepted wrap meets, with one of its own; or which two wraps' pieces meet. `None` if that is too much work to tell.
pub(crate) fn contacts(site: &Site<'_, '_>, outcomes: &BTreeMap<Vec<u32>, Outcome>) -> Option<Vec<[u32; 2]>> {
    let accepted = Accepted::of(site, outcomes);
    if accepted.exposed.is_empty() {
        return Some(Vec::new());
    }
    let mut met = accepted.crossing(site)?;
    met.append(&mut accepted.touching(site));
    met.retain(|[a, b]| a != b && *a != NONE && *b != NONE);
    met.sort_unstable();
    met.dedup();
    Some(met)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{plate, shifted};

    #[test]
    fn a_wrap_is_held_against_nothing_where_nothing_else_is() {
        let one = plate(20, |_, _| true);
        let far = Bounds { lo: [90.0; 3], hi: [91.0; 3] };
        assert!(exposed(&[&one], [far, Bounds::EMPTY].into_iter()).is_empty());
        // The piece in its middle meets the triangles there, and another wrap those at one side; numbers go through both.
        let inside = Bounds { lo: [10.25; 3].map(|x| x - 0.125), hi: [10.25; 3] };
        let near = |z: f32| Bounds { lo: [inside.lo[0], inside.lo[1], z], hi: [inside.hi[0], inside.hi[1], z] };
        let found = exposed(&[&one], [near(0.0), near(7.0)].into_iter());
        assert!((1..=2).contains(&found.len()) && found.iter().all(|(number, t)| one[*number as usize] == *t), "{found:?}");
        let beside = shifted(&one, [20.0, 0.0, 0.0]);
        let found = exposed(&[&one, &beside], std::iter::empty());
        let all = [one.clone(), beside].concat();
        assert!(found.iter().all(|(number, t)| all[*number as usize] == *t && t.iter().any(|p| p[0] == 20.0)));
        assert_eq!(found.len(), all.iter().filter(|t| t.iter().any(|p| p[0] == 20.0)).count());
    }
}
