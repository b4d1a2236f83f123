//! One pass: the cells of a plan, some at a time, each simplified by itself; what they leave follows on a new spool.

use std::ops::Range;
use std::path::Path;

use rayon::prelude::*;

use super::super::simplifying::BYTES_A_TRIANGLE;
use super::cell::{Cell, Made};
use crate::contract::error::{Error, Result as Failing};
use crate::engine::nameless_stl::{self, Spooled};
use crate::engine::work::Work;
use crate::io::read_ahead::Guide;
use crate::io::record::{self, Record};
use crate::simplify::{Ended, Options};
use crate::stream::members::{Members, Reads};
use crate::stream::plan::{ChunkId, Plan};
use crate::util::{bits, parallel};

/// So many cells for each thread at a time: some are done sooner than others.
const CELLS_A_THREAD: usize = 2;

/// Records that a thread looks at together, at least, or that are copied at once.
pub(super) const BLOCK: usize = 1 << 14;

/// Why nothing is simplified.
#[derive(Debug)]
pub(super) enum Stop {
    Failed(Error),
    Refused(String),
}

impl From<Error> for Stop {
    fn from(error: Error) -> Self {
        Self::Failed(error)
    }
}

/// A pass that is to be made.
pub(super) struct Pass<'a> {
    pub(super) path: &'a Path,
    pub(super) records: &'a [Record],
    /// Triangles of a cell, about.
    pub(super) cell: u32,
    /// How far the planes are shifted.
    pub(super) shift: f64,
    /// Triangles to be left of all.
    pub(super) wanted: Option<usize>,
    /// The largest deviation that may be.
    pub(super) most: f64,
    /// No pass over cells follows that could take from the seams of these what is still wanted.
    pub(super) is_last: bool,
    /// Bounds are to be as low as they can be.
    pub(super) is_tight: bool,
    pub(super) work: Work<'a>,
}

/// A pass that was made.
pub(super) struct Passed {
    /// New triangles, by cells, then those that stay, in their order.
    pub(super) spool: Spooled,
    /// Triangles that stay, a bit each.
    pub(super) stays: Vec<u64>,
    /// Bounds of the distance both ways.
    pub(super) proved: [f64; 2],
    /// The change of the volume.
    pub(super) volume: f64,
    pub(super) ended: Ended,
}

/// The triangles by cells.
struct Cells<'a> {
    guide: Guide<'a>,
    plan: Plan,
    members: Members,
    /// How many own triangles are to be left in each, if a count is wanted.
    left: Option<Vec<usize>>,
}

impl Pass<'_> {
    pub(super) fn run(&self) -> Result<Passed, Stop> {
        let Work { limits, progress, .. } = self.work;
        let guide = Guide::new(self.records.as_flattened(), limits);
        let plan = Plan::shifted(self.records, &guide, self.cell, self.shift);
        let members = Members::gather(self.path, (self.records, &guide), &plan, Some(0.0), limits, progress)?;
        let left = self.wanted.map(|wanted| shares(&self.own(&plan), self.records.len(), (wanted, self.is_last)));
        let cells = Cells { guide, plan, members, left };
        let batches = self.batches(&cells)?;
        let mut stays = bits::all(self.records.len());
        let (mut proved, mut volume, mut ended) = ([0.0_f64; 2], 0.0, Ended::Count);
        let spool = nameless_stl::filled(self.path, self.records.len(), self.work, |append| {
            for batch in batches {
                progress.at("simplify", u64::from(batch.start), cells.plan.chunks() as u64);
                if progress.cancelled() {
                    return Err(Error::cancelled(self.path, "simplify"));
                }
                for made in self.simplified(&cells, &batch) {
                    append(&made.added)?;
                    made.gone.iter().for_each(|number| bits::take(&mut stays, *number as usize));
                    proved = [0, 1].map(|k| proved[k].max(made.proved[k]));
                    volume += made.volume;
                    ended = later(ended, made.ended);
                }
            }
            self.append_what_stays(&stays, append)
        })?;
        Ok(Passed { spool, stays, proved, volume, ended })
    }

    /// How many triangles are each cell's own: those with all corners there.
    fn own(&self, plan: &Plan) -> Vec<usize> {
        let none = || vec![0_usize; plan.chunks()];
        let count = |mut counts: Vec<usize>, record: &Record| {
            let [a, b, c] = record::corners(record).map(|p| plan.home(p));
            if a == b && b == c {
                counts.iter_mut().skip(a.0 as usize).take(1).for_each(|count| *count += 1);
            }
            counts
        };
        let add = |mut a: Vec<usize>, b: Vec<usize>| {
            a.iter_mut().zip(b).for_each(|(sum, count)| *sum += count);
            a
        };
        parallel::in_pool(self.work.limits.threads, || {
            self.records.par_iter().with_min_len(BLOCK).fold(none, count).reduce(none, add)
        })
    }

    /// Cells in their order, some at a time, so that each batch has room in memory.
    fn batches(&self, cells: &Cells<'_>) -> Result<Vec<Range<u32>>, Stop> {
        let limits = self.work.limits;
        let held = cells.members.heap_bytes(limits.threads) + cells.plan.heap_bytes() + self.records.len() as u64 / 4;
        let room = limits.memory_bytes.saturating_sub(held);
        let most = limits.threads.max(1) * CELLS_A_THREAD;
        let (mut batches, mut sum): (Vec<Range<u32>>, u64) = (Vec::new(), 0);
        for cell in 0..cells.plan.chunks() as u32 {
            let bytes = cells.members.count(ChunkId(cell)) * BYTES_A_TRIANGLE;
            if bytes > room {
                let [needed, given] = [held + bytes, limits.memory_bytes].map(|bytes| bytes.div_ceil(1 << 20));
                let why = format!("it takes {needed} MiB of memory for the triangles of a part, and {given} MiB may be used");
                return Err(Stop::Refused(why));
            }
            match batches.last_mut().filter(|batch| sum + bytes <= room && batch.len() < most) {
                Some(batch) => (batch.end, sum) = (cell + 1, sum + bytes),
                None => {
                    batches.push(cell..cell + 1);
                    sum = bytes;
                }
            }
        }
        Ok(batches)
    }

    /// Simplifies some cells; in their order.
    fn simplified(&self, cells: &Cells<'_>, batch: &Range<u32>) -> Vec<Made> {
        let Work { profile, limits, .. } = self.work;
        let options = Options {
            max_deviation: Some(self.most),
            feature_angle: Some(profile.keep_edges_degrees.to_radians()),
            tight: self.is_tight,
            ..Options::default()
        };
        let Cells { guide, plan, members, left } = cells;
        let of = (self.records, guide, plan);
        let wanted = |chunk: ChunkId| batch.contains(&chunk.0);
        let all = members.each(
            of,
            limits.threads,
            (Reads::Chunks, wanted),
            || (),
            |(), chunk, members, visitors| Cell::new(plan, chunk, [members, visitors]),
        );
        let left = |at: usize| left.as_ref().and_then(|left| left.get(batch.start as usize + at)).copied();
        parallel::in_pool(limits.threads, || {
            let each = all.into_par_iter().enumerate().with_max_len(1);
            each.map(|(at, cell)| cell.simplified(left(at), &options)).collect()
        })
    }

    fn append_what_stays(&self, stays: &[u64], append: &mut dyn FnMut(&[Record]) -> Failing<()>) -> Failing<()> {
        for (number, block) in self.records.chunks(BLOCK).enumerate() {
            let here = (number * BLOCK..).zip(block);
            let kept: Vec<Record> = here.filter(|(at, _)| bits::holds(stays, *at)).map(|(_, record)| *record).collect();
            append(&kept)?;
        }
        Ok(())
    }
}

/// How many triangles are to be left of each cell's `own`, if so many of all are wanted: their share, or in the last pass so many fewer as seams have
/// beyond theirs, but no less than half of it.
fn shares(own: &[usize], all: usize, (wanted, is_last): (usize, bool)) -> Vec<usize> {
    let sum: usize = own.iter().sum();
    let share = (sum as u128 * wanted as u128 / all.max(1) as u128) as usize;
    let left = if is_last { wanted.saturating_sub(all - sum).max(share / 2) } else { share };
    own.iter().map(|own| (*own as u128 * left as u128 / sum.max(1) as u128) as usize).collect()
}

/// Why a pass ended: for the deviation, if a cell did.
fn later(a: Ended, b: Ended) -> Ended {
    match (a, b) {
        (Ended::Deviation, _) | (_, Ended::Deviation) => Ended::Deviation,
        (Ended::Count, other) | (other, _) => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of 100 triangles 20 are of seams.
    #[test]
    fn cells_have_shares_of_what_is_wanted() {
        assert_eq!(shares(&[60, 20], 100, (60, false)), [36, 12], "60 % of each");
        assert_eq!(shares(&[60, 20], 100, (60, true)), [30, 10], "all but the seams");
        assert_eq!(shares(&[60, 20], 100, (25, true)), [7, 2], "10 of 80, rounded down, and not the 5 beside the seams");
        assert_eq!(shares(&[0, 0], 100, (60, true)), [0, 0]);
    }
}
