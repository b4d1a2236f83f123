//! Fewer triangles of a mesh that is larger than memory: pass after pass, each over cells of space, and over strips along the seams of these cells, or over
//! cells that lie elsewhere.
//!
//! **In:** the records of a mesh, and what a profile wants of it.
//! **Out:** the triangles that go and come, and a bound of the distance both ways: the sum of the bounds of all passes, by the triangle inequality.
//! **Promise:** as of [`crate::simplify`]. Cells hold numbers of triangles that depend on the mesh alone, so that the result does not depend on
//! threads, nor on memory: too little is a refusal.

mod cell;
mod cells;
mod pass;
mod strips;
#[cfg(test)]
mod tests;

use std::path::Path;

use rayon::prelude::*;

use super::change::{Change, Told};
use super::simplifying;
use crate::contract::error::Result;
use crate::contract::report::Simplified;
use crate::engine::nameless_stl::Spooled;
use crate::engine::work::Work;
use crate::geometry::sums::Bounds;
use crate::io::record::{self, Record};
use crate::output::edit::NewRecords;
use crate::simplify::{Ended, MOST_DEVIATION};
use crate::stream::plan::Plan;
use crate::util::{bits, parallel};
use cells::{Parting, Stop};
use pass::{Pass, Passed};
use strips::BLOCK;

/// The parts of space that a pass goes over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Turn {
    /// Cells.
    First,
    /// Strips along the seams of these cells.
    Strips,
    /// Cells whose planes lie elsewhere.
    Shifted,
    /// All as a single cell.
    Whole,
}

impl Turn {
    /// The share that it takes of the deviation that is left. The first one takes a small part of it, as more is wanted of the last one, of seams or of all.
    fn share(self) -> f64 {
        match self {
            Self::First => 0.3,
            Self::Strips => 0.5,
            Self::Shifted | Self::Whole => 1.0,
        }
    }
}

/// How far the planes between [`Turn::Shifted`] cells are shifted.
const SHIFT: f64 = -0.1;

/// Counts of triangles.
pub(super) struct Sizes {
    /// A cell, about.
    cell: u32,
    /// All that is left is one cell from this count on.
    whole: usize,
}

impl Sizes {
    /// A cell takes about 80 MiB of memory, what is one cell in the end at most 320 MiB.
    pub(super) const USUAL: Self = Self { cell: 1 << 18, whole: 1 << 20 };
}

/// Whether a mesh of so many triangles is simplified by cells. As many as 3 Mi would take nearly the gigabyte that is the usual bound of memory.
pub(super) fn is_large(triangles: usize) -> bool {
    triangles > 3 << 20
}

/// The mesh with fewer triangles, or why that cannot be.
///
/// # Errors
/// [`crate::Error::NoSpace`], [`crate::Error::Io`], which is that of a cancelled work, too.
pub(super) fn simplify(of: (&Path, &[Record]), sizes: &Sizes, work: Work<'_>) -> Result<std::result::Result<Change, String>> {
    match Course::new(of, sizes, work).and_then(Course::run) {
        Ok(change) => Ok(Ok(change)),
        Err(Stop::Refused(why)) => Ok(Err(why)),
        Err(Stop::Failed(error)) => Err(error),
    }
}

/// A mesh on its way through the passes.
struct Course<'a> {
    path: &'a Path,
    records: &'a [Record],
    sizes: &'a Sizes,
    work: Work<'a>,
    wanted: Option<usize>,
    /// The largest deviation that may be.
    most: f64,
    /// Triangles that the last pass left: new triangles, then those of the input.
    spool: Option<Spooled>,
    /// Triangles of the input that are still there, a bit each, and how many they are.
    stays: Vec<u64>,
    survivors: usize,
    proved: [f64; 2],
    volume: f64,
    ended: Ended,
    /// The last turn, the planes of the last cells, and how many more triangles were left in these than were wanted.
    last: Option<Turn>,
    plan: Option<Plan>,
    missed: usize,
}

impl<'a> Course<'a> {
    fn new((path, records): (&'a Path, &'a [Record]), sizes: &'a Sizes, work: Work<'a>) -> std::result::Result<Self, Stop> {
        let wanted = simplifying::wanted(work.profile, records.len());
        let bounds = bounds(records, work)?;
        let within = work.profile.simplify_within_mm;
        let most = match wanted {
            _ if within > 0.0 => within,
            Some(_) => MOST_DEVIATION * bounds.diagonal(),
            None => f64::INFINITY,
        };
        Ok(Self {
            path,
            records,
            sizes,
            work,
            wanted,
            most,
            spool: None,
            stays: bits::all(records.len()),
            survivors: records.len(),
            proved: [0.0; 2],
            volume: 0.0,
            ended: Ended::default(),
            last: None,
            plan: None,
            missed: 0,
        })
    }

    /// The triangles that are there now.
    fn current(&self) -> &[Record] {
        self.spool.as_ref().map_or(self.records, |spool| spool.0.records())
    }

    fn run(mut self) -> std::result::Result<Change, Stop> {
        while let Some(turn) = self.next() {
            let before = self.current().len();
            let passed = self.pass(turn).run()?;
            let after = passed.spool.0.records().len();
            tracing::debug!("{turn:?}: {before} triangles become {after}, proved within {:?}", passed.taken.proved);
            self.take(turn, passed);
        }
        Ok(self.change())
    }

    /// The next turn, if one is of use. What is one cell in the end is simplified by one measure for all of it.
    fn next(&self) -> Option<Turn> {
        let left = self.current().len();
        if self.wanted.is_some_and(|wanted| left <= wanted) {
            return None;
        }
        let whole = Some(Turn::Whole).filter(|_| left <= self.sizes.whole);
        match self.last {
            None => whole.or(Some(Turn::First)),
            // Where no more than a third of what is to go is of cells that could not become as small as they were to be, the rest is of seams.
            Some(Turn::First) => {
                let is_of_seams = self.wanted.is_some_and(|wanted| 3 * self.missed <= left - wanted);
                whole.or(Some(if is_of_seams { Turn::Strips } else { Turn::Shifted }))
            }
            Some(Turn::Strips) => whole.or(Some(Turn::Shifted)),
            // Where no count is wanted, it has taken all of the deviation.
            Some(Turn::Shifted) => whole.filter(|_| self.wanted.is_some()),
            Some(Turn::Whole) => None,
        }
    }

    fn pass(&self, turn: Turn) -> Pass<'_> {
        let rest = (self.most - self.proved[0].max(self.proved[1])).max(0.0);
        let parting = match (turn, &self.plan) {
            (Turn::Strips, Some(plan)) => Parting::Strips(self.sizes.cell, plan),
            (Turn::First, _) => Parting::Shifted(self.sizes.cell, 0.0),
            (Turn::Shifted | Turn::Strips, _) => Parting::Shifted(self.sizes.cell, SHIFT),
            (Turn::Whole, _) => Parting::Shifted(u32::MAX, 0.0),
        };
        // So much is left for one cell in the end.
        let least = if turn == Turn::Whole { 0 } else { self.sizes.whole / 10 * 9 };
        let most = rest * turn.share();
        Pass {
            path: self.path,
            records: self.current(),
            parting,
            wanted: self.wanted.map(|wanted| wanted.max(least)),
            most,
            is_of_all: turn != Turn::First,
            enough: self.enough(turn, most),
            work: self.work,
        }
    }

    /// The bound below which no lower one is searched for: the deviation that is wanted; where none is, bounds are as low as they can be, but in strips, as
    /// most of the sum is of the turn before.
    fn enough(&self, turn: Turn, most: f64) -> f64 {
        match turn {
            _ if self.work.profile.simplify_within_mm > 0.0 => most,
            Turn::Strips => 0.4 * self.proved[0].max(self.proved[1]),
            Turn::First | Turn::Shifted | Turn::Whole => 0.0,
        }
    }

    /// Goes on with what a pass left.
    fn take(&mut self, turn: Turn, Passed { spool, taken, plan }: Passed) {
        // The last ones before the pass were those of the input.
        let new = self.current().len() - self.survivors;
        let before = std::mem::take(&mut self.stays);
        self.stays = bits::of(
            self.records.len(),
            bits::ones(&before).zip(new..).filter(|(_, at)| bits::holds(&taken.stays, *at)).map(|(number, _)| number),
        );
        self.survivors = bits::count(&self.stays) as usize;
        // Each bound is rounded upwards when it is made, and so is their sum.
        for (sum, bound) in self.proved.iter_mut().zip(taken.proved) {
            *sum = if bound > 0.0 { (*sum + bound).next_up() } else { *sum };
        }
        self.volume += taken.volume;
        self.ended = taken.ended;
        (self.last, self.plan, self.missed) = (Some(turn), plan, taken.missed);
        self.spool = Some(spool);
    }

    /// The triangles that go and come.
    fn change(mut self) -> Change {
        let after = self.current().len();
        let within = Some(self.work.profile.simplify_within_mm).filter(|within| *within > 0.0);
        let why_not = self.wanted.filter(|wanted| after > *wanted).map(|wanted| simplifying::why_not(wanted, self.ended, within));
        let told = Simplified {
            before: self.records.len() as u64,
            after: after as u64,
            to_result: self.proved[0],
            from_result: self.proved[1],
            volume_change: self.volume,
            why_not,
        };
        // As many as memory may not hold: they stay where they are.
        let count = after - self.survivors;
        let added = self
            .spool
            .take()
            .map(|(mesh, spool)| NewRecords::File { mesh: Box::new(mesh), _spool: spool, count })
            .unwrap_or_default();
        let mut gone = bits::all(self.records.len());
        gone.iter_mut().zip(&self.stays).for_each(|(gone, stays)| *gone &= !stays);
        Change { gone, added, told: Told::Simplified(told) }
    }
}

/// The box around all triangles; an error where one is nowhere.
fn bounds(records: &[Record], work: Work<'_>) -> std::result::Result<Bounds, Stop> {
    let of = |block: &[Record]| {
        let mut bounds = Bounds::EMPTY;
        let is_finite = block.iter().all(|record| {
            bounds.include(&record::corners(record));
            record::all_finite(record)
        });
        is_finite.then_some(bounds)
    };
    let unite = |mut a: Bounds, b: Bounds| {
        a.add(&b);
        a
    };
    let all = parallel::in_pool(work.limits.threads, || {
        records.par_chunks(BLOCK).map(of).try_reduce(|| Bounds::EMPTY, |a, b| Some(unite(a, b)))
    });
    all.ok_or_else(|| Stop::Refused("a triangle has a coordinate that is not finite".into()))
}
