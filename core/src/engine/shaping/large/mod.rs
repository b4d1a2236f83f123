//! Fewer triangles of a mesh that is larger than memory: pass after pass, each over cells of space, and over cells that lie elsewhere.
//!
//! **In:** the records of a mesh, and what a profile wants of it.
//! **Out:** the triangles that go and come, and a bound of the distance both ways: the sum of the bounds of all passes, by the triangle inequality.
//! **Promise:** as of [`crate::simplify`]. Cells hold numbers of triangles that depend on the mesh alone, so that the result does not depend on
//! threads, nor on memory: too little is a refusal.

mod cell;
mod pass;
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
use crate::util::{bits, parallel};
use pass::{BLOCK, Pass, Passed, Stop};

/// A pass over cells.
#[derive(Clone, Copy)]
struct Turn {
    /// How far the planes between cells are shifted.
    shift: f64,
    /// The share that it takes of the deviation that is left.
    share: f64,
    /// How many times as many triangles as are wanted it may leave.
    margin: f64,
}

/// The first pass takes the small part of the deviation, as the last one decides how many triangles are left. Its seams go in the second one, whose own
/// seams are as the first one left them.
const TURNS: [Turn; 2] = [Turn { shift: 0.0, share: 0.3, margin: 1.4 }, Turn { shift: -0.1, share: 1.0, margin: 1.0 }];

/// The last pass where what is left is one cell.
const WHOLE: Turn = Turn { shift: 0.0, share: 1.0, margin: 1.0 };

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
        })
    }

    /// The triangles that are there now.
    fn current(&self) -> &[Record] {
        self.spool.as_ref().map_or(self.records, |spool| spool.0.records())
    }

    fn run(mut self) -> std::result::Result<Change, Stop> {
        let mut turns = TURNS.into_iter();
        loop {
            let before = self.current().len();
            if self.wanted.is_some_and(|wanted| before <= wanted) {
                break;
            }
            let next = turns.next();
            // Where no count is wanted, the last turn has taken all of the deviation.
            let is_whole = before <= self.sizes.whole && (next.is_some() || self.wanted.is_some());
            let Some(turn) = (if is_whole { Some(WHOLE) } else { next }) else { break };
            let passed = self.pass(turn, is_whole).run()?;
            let after = passed.spool.0.records().len();
            tracing::debug!("a pass: {before} triangles become {after}, proved within {:?}", passed.proved);
            self.take(passed);
            if is_whole {
                break;
            }
        }
        Ok(self.change())
    }

    fn pass(&self, Turn { shift, share, margin }: Turn, is_whole: bool) -> Pass<'_> {
        let rest = (self.most - self.proved[0].max(self.proved[1])).max(0.0);
        // What is one cell in the end is simplified by one measure for all of it: so much is left for that.
        let least = if is_whole { 0 } else { self.sizes.whole / 10 * 9 };
        Pass {
            path: self.path,
            records: self.current(),
            cell: if is_whole { u32::MAX } else { self.sizes.cell },
            shift,
            wanted: self.wanted.map(|wanted| ((wanted as f64 * margin) as usize).max(least)),
            most: rest * share,
            is_last: margin <= 1.0,
            is_tight: self.work.profile.simplify_within_mm <= 0.0,
            work: self.work,
        }
    }

    /// Goes on with what a pass left.
    fn take(&mut self, passed: Passed) {
        // The last ones before the pass were those of the input.
        let new = self.current().len() - self.survivors;
        let before = std::mem::take(&mut self.stays);
        self.stays = bits::of(
            self.records.len(),
            bits::ones(&before).zip(new..).filter(|(_, at)| bits::holds(&passed.stays, *at)).map(|(number, _)| number),
        );
        self.survivors = bits::count(&self.stays) as usize;
        // Each bound is rounded upwards when it is made, and so is their sum.
        for (sum, bound) in self.proved.iter_mut().zip(passed.proved) {
            *sum = if bound > 0.0 { (*sum + bound).next_up() } else { *sum };
        }
        self.volume += passed.volume;
        self.ended = passed.ended;
        self.spool = Some(passed.spool);
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
