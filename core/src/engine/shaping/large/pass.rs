//! One pass: cells, some at a time, each simplified by itself; what they leave follows on a new spool. Meanwhile the next ones are read, and those before
//! are written.

use std::ops::Range;
use std::path::Path;

use rayon::prelude::*;

use super::super::simplifying::BYTES_A_TRIANGLE;
use super::cell::{Cell, Made};
use super::cells::{Cells, Parting, Stop};
use super::strips::BLOCK;
use crate::contract::error::{Error, Result as Failing};
use crate::engine::nameless_stl::{self, Spooled};
use crate::engine::work::Work;
use crate::io::record::Record;
use crate::simplify::{Ended, Options};
use crate::stream::plan::Plan;
use crate::util::{bits, parallel};

/// The triangles of so many cells for each thread at a time: some are done sooner than others.
const CELLS_A_THREAD: u64 = 2;

/// Memory for each triangle of the cells that are read meanwhile, and of those before.
const BYTES_BESIDE: u64 = 96;

/// A pass that is to be made.
pub(super) struct Pass<'a> {
    pub(super) path: &'a Path,
    pub(super) records: &'a [Record],
    pub(super) parting: Parting<'a>,
    /// Triangles to be left of all.
    pub(super) wanted: Option<usize>,
    /// The largest deviation that may be.
    pub(super) most: f64,
    /// It takes from its cells what is wanted of all, also where that is more than their share.
    pub(super) is_of_all: bool,
    /// No proved bound needs to be lower than this.
    pub(super) enough: f64,
    pub(super) work: Work<'a>,
}

/// A pass that was made.
pub(super) struct Passed {
    /// New triangles, by cells, then those that stay, in their order.
    pub(super) spool: Spooled,
    pub(super) taken: Taken,
    /// The planes between the cells.
    pub(super) plan: Option<Plan>,
}

/// The results of cells, taken together.
pub(super) struct Taken {
    /// Triangles that stay, a bit each.
    pub(super) stays: Vec<u64>,
    /// Bounds of the distance both ways.
    pub(super) proved: [f64; 2],
    /// The change of the volume.
    pub(super) volume: f64,
    pub(super) ended: Ended,
    /// How many more triangles are left in cells than were wanted there.
    pub(super) missed: usize,
}

impl Taken {
    /// No cell yet: so many triangles stay.
    fn new(triangles: usize) -> Self {
        Self { stays: bits::all(triangles), proved: [0.0; 2], volume: 0.0, ended: Ended::Count, missed: 0 }
    }

    /// Takes from cells, in their order, what came of them.
    fn take(&mut self, all: Vec<Made>, append: &mut dyn FnMut(&[Record]) -> Failing<()>) -> Failing<()> {
        for made in all {
            append(&made.added)?;
            made.gone.iter().for_each(|number| bits::take(&mut self.stays, *number as usize));
            self.proved = [0, 1].map(|k| self.proved[k].max(made.proved[k]));
            self.volume += made.volume;
            self.ended = later(self.ended, made.ended);
            self.missed += made.missed;
        }
        Ok(())
    }
}

impl Pass<'_> {
    pub(super) fn run(&self) -> Result<Passed, Stop> {
        let progress = self.work.progress;
        let cells = Cells::new(self.path, self.records, self.parting, self.work)?;
        // How many own triangles are to be left in each, if a count is wanted.
        let left = self.wanted.map(|wanted| shares(&cells.own(), self.records.len(), (wanted, self.is_of_all)));
        let batches = self.batches(&cells)?;
        let mut taken = Taken::new(self.records.len());
        let spool = nameless_stl::filled(self.path, self.records.len(), self.work, |append| {
            let mut read = batches.first().map(|batch| cells.read(batch)).unwrap_or_default();
            let mut made = Vec::new();
            for (number, batch) in (1..).zip(&batches) {
                progress.at("simplify", u64::from(batch.start), cells.len() as u64);
                if progress.cancelled() {
                    return Err(Error::cancelled(self.path, "simplify"));
                }
                let (current, before) = (std::mem::take(&mut read), std::mem::take(&mut made));
                let beside = || {
                    taken.take(before, append)?;
                    Ok(batches.get(number).map(|batch| cells.read(batch)).unwrap_or_default())
                };
                let (next, new) =
                    parallel::both(self.work.limits.threads, beside, || self.simplified(current, left.as_deref(), batch));
                (read, made) = (next?, new);
            }
            taken.take(made, append)?;
            self.append_what_stays(&taken.stays, append)
        })?;
        Ok(Passed { spool, taken, plan: cells.into_plan() })
    }

    /// Cells in their order, some at a time, so that each batch has room in memory.
    fn batches(&self, cells: &Cells<'_>) -> Result<Vec<Range<u32>>, Stop> {
        let limits = self.work.limits;
        let held = cells.heap_bytes() + self.records.len() as u64 / 4;
        let room = limits.memory_bytes.saturating_sub(held);
        let bytes_a_triangle = BYTES_A_TRIANGLE + if cells.len() > 1 { BYTES_BESIDE } else { 0 };
        let (Parting::Shifted(cell, _) | Parting::Strips(cell, _)) = self.parting;
        let most = (limits.threads.max(1) as u64 * CELLS_A_THREAD * u64::from(cell)).saturating_mul(bytes_a_triangle).min(room);
        let (mut batches, mut sum): (Vec<Range<u32>>, u64) = (Vec::new(), 0);
        for cell in 0..cells.len() as u32 {
            let bytes = cells.count(cell) * bytes_a_triangle;
            if bytes > room {
                let [needed, given] = [held + bytes, limits.memory_bytes].map(|bytes| bytes.div_ceil(1 << 20));
                let why = format!("it takes {needed} MiB of memory for the triangles of a part, and {given} MiB may be used");
                return Err(Stop::Refused(why));
            }
            match batches.last_mut().filter(|_| sum + bytes <= most) {
                Some(batch) => (batch.end, sum) = (cell + 1, sum + bytes),
                None => {
                    batches.push(cell..cell + 1);
                    sum = bytes;
                }
            }
        }
        Ok(batches)
    }

    /// Simplifies the cells of a batch; in their order.
    fn simplified(&self, all: Vec<Cell<'_>>, left: Option<&[usize]>, batch: &Range<u32>) -> Vec<Made> {
        let Work { profile, limits, .. } = self.work;
        let options = Options {
            max_deviation: Some(self.most),
            feature_angle: Some(profile.keep_edges_degrees.to_radians()),
            enough: Some(self.enough),
            ..Options::default()
        };
        let left = |at: usize| left.and_then(|left| left.get(batch.start as usize + at)).copied();
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

/// How many triangles are to be left of each cell's `own`, if so many of all are wanted: their share, or, where what is wanted is taken `of all`, so many fewer
/// as others have beyond theirs, but no less than half of it.
fn shares(own: &[usize], all: usize, (wanted, is_of_all): (usize, bool)) -> Vec<usize> {
    let sum: usize = own.iter().sum();
    let share = (sum as u128 * wanted as u128 / all.max(1) as u128) as usize;
    let left = if is_of_all { wanted.saturating_sub(all - sum).max(share / 2) } else { share };
    own.iter().map(|own| (*own as u128 * left as u128 / sum.max(1) as u128) as usize).collect()
}

/// Why a pass ended: for the reasons of both.
fn later(a: Ended, b: Ended) -> Ended {
    match (a, b) {
        (Ended::Count, other) | (other, Ended::Count) => other,
        _ if a == b => a,
        _ => Ended::Both,
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
