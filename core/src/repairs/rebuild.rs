//! What no exact repair made valid is cut out with a few rings around it, and closed anew, there only.
//!
//! A **place** is the triangles that are in the way of a solid and hang together: around vertices and edges that surfaces could not be taken apart
//! at, at edges that are open or disagree, of pairs that cross ([`places`]). Of each a region is cut out: first all surfaces at it but one, then
//! all, then with more and more rings of triangles around it ([`regions`]). The loops around it are closed as holes are, but each for itself. A
//! place is settled if nothing is wrong there then: every edge has two coherent triangles, every vertex one fan, and no new triangle crosses
//! anything ([`check`]); else it is put back exactly as it was, and tried with more around it. Bodies are never cut out whole.
//!
//! Everything is bounded by counts. What is left is the wrap's, whole bodies at a time.

mod check;
mod places;
mod regions;

use std::collections::{BTreeMap, BTreeSet};

use crate::contract::report::{Region, RegionMethod, RepairName};
use crate::contract::settings::{Guarantee, PatchShape, Profile};
use crate::geometry::position::Position;
use crate::geometry::sums::Bounds;
use crate::repairs::holes::fill;
use crate::repairs::shared::context::{Changes, Context, Done, Repair};
use crate::repairs::wrap;
use crate::util::words::{Count, Short};
use check::{Owners, Verdict};
use places::Place;
use regions::{Cut, Stays};

/// Places where nothing else made the surface valid.
pub(crate) const REPAIR: Repair = Repair {
    name: RepairName::Rebuild,
    changes: Changes::Surface,
    run: |cx| {
        let is_wanted = cx.profile.guarantee == Guarantee::Wrap
            && (cx.handed.may_cross || wrap::is_broken(&mut cx.work, cx.survey.threads()));
        let rebuilt = if is_wanted { rebuild(cx) } else { Rebuilt::default() };
        let (count, triangles) = (rebuilt.places, rebuilt.triangles);
        rebuilt.tell(cx);
        Ok(Done::count(
            count,
            format!("places of {} triangles that nothing else made valid, cut out and closed anew", Count(triangles)),
        ))
    },
};

/// How much is cut out, and whether its patches are shaped, from try to try.
const TRIES: [(usize, Stays, bool); 10] = [
    (0, Stays::Largest, false),
    (0, Stays::Closed, false),
    (1, Stays::Closed, true),
    (1, Stays::Closed, false),
    (2, Stays::Closed, true),
    (2, Stays::Closed, false),
    (4, Stays::Closed, true),
    (4, Stays::Closed, false),
    (8, Stays::Closed, true),
    (8, Stays::Closed, false),
];

/// Defects are everywhere if the triangles at them are more than this share of all surface: nothing is rebuilt then.
const EVERYWHERE: f64 = 0.25;

/// How often places are taken back until what is left stands by itself; then all are.
const CHECKS: usize = 8;

/// Count and size of the places that were cut out and closed.
#[derive(Default)]
struct Rebuilt {
    places: u64,
    triangles: u64,
    /// Area that was cut out, and the volume that came or went.
    area: f64,
    volume: f64,
    /// How far the surface moved.
    moved: f64,
    regions: Vec<Region>,
    /// Where vertices of what was wrong were, ascending.
    gone: Vec<Position>,
    /// Nothing is left.
    all: bool,
}

/// Cuts out and closes all places, as far as that is possible.
fn rebuild(cx: &mut Context<'_, '_>) -> Rebuilt {
    let mut rebuilt = Rebuilt::default();
    let pieces = cx.pieces();
    let whole: f64 = pieces.list.iter().map(|piece| cx.survey.measure.area(piece.extent)).sum();
    let Some(mut places) = places::find(cx) else { return rebuilt };
    let at_defects: f64 = places.iter().flat_map(|place| &place.seeds).map(|t| cx.work.normal(*t).length() / 2.0).sum();
    if places.is_empty() || at_defects > EVERYWHERE * whole {
        return rebuilt;
    }
    tracing::debug!(places = places.len(), "Places that nothing made valid.");
    for (rings, stays, shaped) in TRIES {
        if places.is_empty() || cx.progress.cancelled() {
            break;
        }
        let cuts = regions::cut_out(cx, &mut places, (rings, stays), whole);
        attempt(cx, &mut places, cuts, shaped, &mut rebuilt);
        tracing::debug!(rings, left = places.len(), "Places were cut out and closed.");
    }
    rebuilt.all = places.is_empty();
    rebuilt
}

/// Closes what these cuts left open. Places that are valid then are settled, and go; the others are as they were.
fn attempt(cx: &mut Context<'_, '_>, places: &mut Vec<Place>, cuts: Vec<Cut>, shaped: bool, rebuilt: &mut Rebuilt) {
    if cuts.is_empty() {
        return;
    }
    let first = cx.work.triangles.len() as u32;
    cuts.iter().flat_map(|cut| &cut.triangles).for_each(|t| cx.work.kill(*t));
    let mut owners = Owners::of(&cx.work, &cuts);
    let patch_shape = if shaped { cx.profile.patch_shape } else { PatchShape::Flat };
    let profile = Profile { patch_shape, ..cx.profile.clone() };
    let is_asked = |v| owners.of_vertex(v).is_some();
    fill::close_again(cx.survey, &mut cx.work, &cx.reversed, cx.tolerance, (&profile, &is_asked), cx.limits.threads);
    owners.take_in(&cx.work, first);
    let (cuts, moved) = valid_ones(cx, cuts, &owners, first);
    let new: Vec<u32> = (first..cx.work.triangles.len() as u32).filter(|t| cx.work.lives(*t)).collect();
    new.iter().for_each(|t| cx.work.attribute(*t, RepairName::Rebuild));
    for cut in &cuts {
        rebuilt.take_in(cx, cut, &places[cut.place as usize], moved.get(&cut.place).copied().unwrap_or(0.0));
    }
    let volume = |triangles: &mut dyn Iterator<Item = &u32>| -> f64 {
        let measure = &cx.survey.measure;
        triangles.map(|t| measure.volume(measure.triangle(&cx.work.points(*t)))).sum()
    };
    rebuilt.volume += (volume(&mut new.iter()) - volume(&mut cuts.iter().flat_map(|cut| &cut.triangles))).abs();
    let is_settled: BTreeSet<u32> = cuts.iter().map(|cut| cut.place).collect();
    let all = std::mem::take(places).into_iter().zip(0..);
    *places = all.filter(|(_, number)| !is_settled.contains(number)).map(|(place, _)| place).collect();
}

/// The cuts that were closed validly, and how far the surface is from where it was at each; the others are taken back. What was put back may be in
/// the way of what was closed beside it, so that the rest is looked at anew, and taken back as a whole after so many rounds.
fn valid_ones(cx: &mut Context<'_, '_>, mut cuts: Vec<Cut>, owners: &Owners, first: u32) -> (Vec<Cut>, BTreeMap<u32, f64>) {
    for round in 0..=CHECKS {
        let Verdict { mut blamed, moved } = check::verdict(cx, &cuts, owners, first);
        if blamed.is_empty() {
            return (cuts, moved);
        }
        if round == CHECKS {
            blamed = cuts.iter().map(|cut| cut.place).collect();
        }
        let is_theirs = |t: &u32| owners.of_new(*t).is_none_or(|place| blamed.contains(&place));
        let theirs: Vec<u32> = (first..cx.work.triangles.len() as u32).filter(|t| cx.work.lives(*t) && is_theirs(t)).collect();
        theirs.into_iter().for_each(|t| cx.work.kill(t));
        let (back, stay): (Vec<Cut>, Vec<Cut>) = cuts.into_iter().partition(|cut| blamed.contains(&cut.place));
        cx.work.revive(back.into_iter().flat_map(|cut| cut.triangles));
        cuts = stay;
    }
    (cuts, BTreeMap::new())
}

impl Rebuilt {
    fn take_in(&mut self, cx: &Context<'_, '_>, cut: &Cut, place: &Place, moved: f64) {
        let mut bounds = Bounds::EMPTY;
        cut.triangles.iter().for_each(|t| bounds.include(&cx.work.points(*t)));
        let Bounds { lo, hi } = bounds.normalised();
        let count = cut.triangles.len() as u64;
        self.places += 1;
        self.triangles += count;
        self.area += cut.area;
        self.moved = self.moved.max(moved);
        self.regions.push(Region { method: RegionMethod::Rebuilt, bounds: [lo, hi], count, rounds: 0, moved, reason: None });
        self.gone.extend(place.seeds.iter().flat_map(|t| cx.work.points(*t)).map(Position::of));
    }

    /// Hands over what was done.
    fn tell(mut self, cx: &mut Context<'_, '_>) {
        if self.places == 0 {
            return;
        }
        self.gone.sort_unstable();
        self.gone.dedup();
        let is_gone = |at: [f32; 3]| self.gone.binary_search(&Position::of(at)).is_ok();
        cx.account.loops_left.retain(|left| !is_gone(left.at));
        cx.handed.unsettled.retain(|left| !is_gone(left.at));
        cx.handed.may_cross &= !self.all;
        cx.account.regions.append(&mut self.regions);
        cx.changed(RepairName::Rebuild, Changes::Surface);
        let pieces = cx.pieces();
        let measure = &cx.survey.measure;
        let (area, volume) = pieces
            .list
            .iter()
            .fold((0.0, 0.0), |(area, volume), piece| (area + measure.area(piece.extent), volume + measure.volume(piece.extent)));
        let [area, volume] = [self.area / area, self.volume / volume.abs()];
        let moved = self.moved / cx.survey.bounds.diagonal();
        if area.max(volume).max(moved) > cx.profile.wrap_review_share {
            cx.account.doubts.push(format!(
                "{} places that nothing else made valid were cut out and closed anew: {:.2} % of the surface, which moved by up to {}, and {:.2} % of the volume",
                Count(self.places), area * 100.0, Short(self.moved), volume * 100.0
            ));
        }
    }
}

#[cfg(test)]
mod tests;
