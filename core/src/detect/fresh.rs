//! Self-intersections of a written file, where those of its input are known: pairs of untouched triangles are as they were, so only
//! pairs with a fresh triangle are tested.
//!
//! Every fresh triangle is tested against everything whose box meets its own, chunk by chunk: the cell that has the lowest corner of the
//! boxes' overlap owns the pair, and both triangles are there as members or visitors.

mod placed;

use crate::contract::report::SelfIntersections;
use crate::detect::difference::Difference;
pub(crate) use crate::detect::fresh::placed::Listed;
use crate::detect::fresh::placed::Placed;
use crate::geometry::boxes::BoxTree;
use crate::geometry::grid::Grid;
use crate::geometry::position::canonical;
use crate::geometry::sums::Bounds;
use crate::geometry::tri_tri::{self, Contact, Triangle as Corners, common};
use crate::io::record;
use crate::stream::plan::{ChunkId, HomeBox};
use crate::stream::source::{Seen, Triangle};
use crate::topology::crossings::{Crossings, Pair, most_tested};
use crate::topology::intersect::leave_out_apart;
use crate::topology::survey::Survey;
use crate::util::steps;

/// All self-intersections of the written file, numbered as its records are; `None` if those of the input are not all known, or too many
/// boxes meet. O(n) boxes are held against a grid of the fresh ones around.
pub(crate) fn self_intersections(survey: &Survey<'_>, difference: &Difference) -> Option<SelfIntersections> {
    let is_gone = |place: u32| difference.gone.binary_search(&place).is_ok();
    let known = survey.crossing_pairs.as_ref()?.iter().filter(|pair| !pair.triangles.iter().any(|t| is_gone(*t)));
    let of = |i: usize| (difference.fresh[i].0, record::corners(&difference.fresh[i].1));
    let fresh = Listed { count: difference.fresh.len(), of: &of };
    let new = met_by(survey, fresh, Listed::NONE, is_gone, difference.written_records as u64, self_intersection)?;
    let mut pairs: Vec<Pair> = known.copied().chain(new).collect();
    for pair in &mut pairs {
        // The numbers keep their order.
        pair.triangles = pair.triangles.map(|place| difference.number(place));
        pair.triangles.sort_unstable();
    }
    Some(Crossings::of_pairs(pairs))
}

/// How two triangles with an area, whose boxes meet, meet in a way that is asked for. Those that are apart do not.
pub(crate) type Meets = fn(&Corners, &Corners) -> Option<Contact>;

/// Crossing or overlapping, as [`Meets`].
pub(crate) fn self_intersection(a: &Corners, b: &Corners) -> Option<Contact> {
    tri_tri::self_intersection(a, b, common(a, b))
}

/// All pairs in which one of the `fresh` triangles meets another of them, one of those `beside`, or one of the input that is not gone, in the
/// way that is asked for; `None` if too many boxes meet for a file of so many triangles. O(n) boxes where a chunk holds a fresh one are held
/// against a grid of these. Memory of a chunk's, and [`placed`]'s.
pub(crate) fn met_by(
    survey: &Survey<'_>,
    fresh: Listed<'_>,
    beside: Listed<'_>,
    is_gone: impl Fn(u32) -> bool + Sync,
    triangles: u64,
    meets: Meets,
) -> Option<Vec<Pair>> {
    if fresh.count == 0 {
        return Some(Vec::new());
    }
    let mut around = Grid::default();
    around.mark(fresh.bounds());
    // Often few are fresh of very many.
    let here = [
        Here { all: fresh, placed: Placed::of(survey.plan(), fresh, |_| true) },
        Here { all: beside, placed: Placed::of(survey.plan(), beside, |bounds| around.may_meet(bounds)) },
    ];
    let per_chunk = survey.each_chunk(
        |chunk| here[0].placed.may_meet(chunk),
        Search::default,
        |search, chunk, seen| search.chunk(&here, &is_gone, (chunk, meets), seen),
    );
    if per_chunk.iter().map(|found| found.tested).sum::<u64>() > most_tested(triangles) {
        return None;
    }
    Some(per_chunk.into_iter().flat_map(|found| found.pairs).collect())
}

/// Triangles, and the chunks they meet.
struct Here<'a> {
    all: Listed<'a>,
    placed: Placed,
}

/// A triangle that has an area, with its box.
struct Solid {
    place: u32,
    corners: Corners,
    bounds: Bounds,
}

impl Solid {
    fn of(place: u32, corners: Corners) -> Option<Self> {
        let corners = corners.map(canonical);
        let [a, b, c] = &corners;
        // Two equal corners are collinear with any third.
        (!crate::geometry::collinear::is_collinear(a, b, c)).then(|| Self { place, corners, bounds: Bounds::of(&corners) })
    }
}

/// Triangles that can intersect anything.
struct Solids {
    all: Vec<Solid>,
    tree: BoxTree,
}

impl Solids {
    /// Those of a chunk's that are `wanted`, in their order.
    fn of(here: &Here<'_>, (chunk, cell): (ChunkId, &Bounds), lent: &mut Vec<u32>, wanted: impl Fn(&Bounds) -> bool) -> Self {
        here.placed.meeting(chunk, cell, lent);
        let all = lent.iter().filter_map(|i| {
            let (place, corners) = (here.all.of)(*i as usize);
            Solid::of(place, corners).filter(|solid| wanted(&solid.bounds))
        });
        let all: Vec<Solid> = all.collect();
        steps::count(all.len());
        let tree = BoxTree::new(&all.iter().map(|f| f.bounds).collect::<Vec<_>>());
        Self { all, tree }
    }
}

/// Findings of a chunk.
#[derive(Default)]
struct Found {
    tested: u64,
    pairs: Vec<Pair>,
}

/// A worker's lists, used again from chunk to chunk.
#[derive(Default)]
struct Search {
    met: Vec<u32>,
    grid: Grid,
}

impl Search {
    fn chunk(
        &mut self,
        [fresh, beside]: &[Here<'_>; 2],
        is_gone: &impl Fn(u32) -> bool,
        ((chunk, cell), meets): ((ChunkId, HomeBox), Meets),
        seen: [&Seen<'_>; 2],
    ) -> Found {
        let mut found = Found::default();
        let (lo, hi) = cell.ends();
        let ends = Bounds { lo, hi };
        // Both triangles of a cell's pair meet the cell; other cells' pairs are left to them.
        let fresh = Solids::of(fresh, (chunk, &ends), &mut self.met, |_| true);
        if fresh.all.is_empty() {
            return found;
        }
        self.grid.mark(fresh.all.iter().map(|f| f.bounds));
        let beside = Solids::of(beside, (chunk, &ends), &mut self.met, |bounds| self.grid.may_meet(bounds));
        let asked = Asked { cell, meets };
        for (i, one) in (0..).zip(&fresh.all) {
            for (others, first) in [(&fresh, i + 1), (&beside, 0)] {
                self.met.clear();
                others.tree.each_meeting(&one.bounds, |j| {
                    if j >= first {
                        self.met.push(j)
                    }
                });
                found.test(asked, one, &mut self.met, |j| &others.all[j as usize], true);
            }
        }
        let Self { met, grid } = self;
        for triangles in seen {
            triangles.each_near(&mut found, &|_, bounds| grid.may_meet(bounds), |found, _, place, triangle| {
                let corners = triangle.corners();
                let bounds = Bounds::of(&corners);
                // Where much is fresh, most of what was read there is gone.
                if !grid.may_meet(&bounds) || is_gone(place) {
                    return;
                }
                met.clear();
                fresh.tree.each_meeting(&bounds, |i| met.push(i));
                if met.is_empty() {
                    return;
                }
                if let Some(one) = Solid::of(place, corners) {
                    found.test(asked, &one, met, |i| &fresh.all[i as usize], false);
                }
            });
        }
        found
    }
}

/// The question that a cell asks of its pairs.
#[derive(Clone, Copy)]
struct Asked {
    cell: HomeBox,
    meets: Meets,
}

impl Found {
    /// Decides the pairs of one triangle with others, whose boxes meet its own, as far as the cell owns them. They may come in any order; pairs are found
    /// in that of their numbers.
    fn test<'s>(
        &mut self,
        asked: Asked,
        one: &Solid,
        others: &mut Vec<u32>,
        solid: impl Fn(u32) -> &'s Solid,
        comes_first: bool,
    ) {
        others.retain(|other| {
            let other = &solid(*other).bounds;
            asked.cell.holds(std::array::from_fn(|k| one.bounds.lo[k].max(other.lo[k])))
        });
        self.tested += others.len() as u64;
        leave_out_apart(&one.corners, others, |other| solid(other).corners);
        others.sort_unstable();
        for other in others.iter().map(|other| solid(*other)) {
            let [a, b] = if comes_first { [one, other] } else { [other, one] };
            if let Some(contact) = (asked.meets)(&a.corners, &b.corners) {
                self.pairs.push(Pair { triangles: [a.place, b.place], contact });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{diagnose, plate, records, shifted};

    #[test]
    fn of_what_is_beside_fresh_triangles_only_what_is_near_is_indexed() {
        let input = records(&plate(2, |_, _| true));
        let d = diagnose(&input);
        let beside = shifted(&plate(60, |_, _| true), [0.0, 0.0, 1.0]);
        let fresh = [[30.25, 30.25, 0.0], [30.5, 30.25, 0.0], [30.25, 30.5, 2.0]];
        let (one, numbered) = (|_| (999, fresh), |i: usize| (1000 + i as u32, beside[i]));
        let numbered = Listed { count: beside.len(), of: &numbered };
        let met = || met_by(&d.survey, Listed { count: 1, of: &one }, numbered, |_| false, 10_000, self_intersection);
        let (steps, pairs) = steps::of(met);
        assert!(pairs.is_some_and(|pairs| pairs.iter().any(|pair| pair.triangles[0] == 999)));
        assert!(steps < 100, "{steps}");
        let (steps, pairs) = steps::of(|| met_by(&d.survey, Listed::NONE, numbered, |_| false, 10_000, self_intersection));
        assert!(pairs.is_some_and(|pairs| pairs.is_empty()) && steps == 0);
    }
}
