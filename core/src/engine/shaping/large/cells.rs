//! The cells of a pass: those of a plan, or strips along the planes of an earlier one.

use std::ops::Range;
use std::path::Path;

use rayon::prelude::*;

use super::cell::Cell;
use super::strips::{BLOCK, Strip, Strips};
use crate::contract::error::Error;
use crate::engine::work::Work;
use crate::io::read_ahead::Guide;
use crate::io::record::{self, Record};
use crate::stream::members::{Members, Reads};
use crate::stream::plan::{ChunkId, Plan};
use crate::stream::source::{Source, Triangle};
use crate::util::parallel;

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

/// How space is parted.
#[derive(Clone, Copy)]
pub(super) enum Parting<'a> {
    /// Into cells of so many triangles, about, by planes that are shifted so far.
    Shifted(u32, f64),
    /// Into strips along the planes of a plan, in pieces of so many triangles.
    Strips(u32, &'a Plan),
}

/// The triangles by cells.
pub(super) struct Cells<'a> {
    records: &'a [Record],
    guide: Guide<'a>,
    threads: usize,
    kept: Kept<'a>,
}

enum Kept<'a> {
    OfPlan(Plan, Members),
    Strips(Strips, &'a Plan),
}

impl<'a> Cells<'a> {
    /// Looks at all records.
    pub(super) fn new(path: &Path, records: &'a [Record], parting: Parting<'a>, work: Work<'_>) -> Result<Self, Stop> {
        let Work { limits, progress, .. } = work;
        let guide = Guide::new(records.as_flattened(), limits);
        let kept = match parting {
            Parting::Shifted(cell, shift) => {
                let plan = Plan::shifted(records, &guide, cell, shift);
                let members = Members::gather(path, (records, &guide), &plan, Some(0.0), limits, progress)?;
                Kept::OfPlan(plan, members)
            }
            Parting::Strips(most, plan) => Kept::Strips(Strips::new((records, &guide), plan, most, limits.threads), plan),
        };
        Ok(Self { records, guide, threads: limits.threads, kept })
    }

    pub(super) fn len(&self) -> usize {
        match &self.kept {
            Kept::OfPlan(plan, _) => plan.chunks(),
            Kept::Strips(strips, _) => strips.all().len(),
        }
    }

    /// The plan by whose planes they are parted, if there is one.
    pub(super) fn into_plan(self) -> Option<Plan> {
        match self.kept {
            Kept::OfPlan(plan, _) => Some(plan),
            Kept::Strips(..) => None,
        }
    }

    /// Bytes held.
    pub(super) fn heap_bytes(&self) -> u64 {
        match &self.kept {
            Kept::OfPlan(plan, members) => members.heap_bytes(self.threads) + plan.heap_bytes(),
            Kept::Strips(strips, _) => strips.heap_bytes(),
        }
    }

    /// How many triangles reach into a cell.
    pub(super) fn count(&self, cell: u32) -> u64 {
        match &self.kept {
            Kept::OfPlan(_, members) => members.count(ChunkId(cell)),
            Kept::Strips(strips, _) => strips.all().get(cell as usize).map_or(0, |strip| strip.members.len() as u64),
        }
    }

    /// How many triangles are each cell's own: those with all corners there.
    pub(super) fn own(&self) -> Vec<usize> {
        let plan = match &self.kept {
            Kept::OfPlan(plan, _) => plan,
            Kept::Strips(strips, _) => return strips.all().iter().map(|strip| strip.own).collect(),
        };
        let none = || vec![0_usize; plan.chunks()];
        let count = |mut counts: Vec<usize>, record: &Record| {
            if let Some(home) = plan.home_of_all(record::corners(record)) {
                counts.iter_mut().skip(home.0 as usize).take(1).for_each(|count| *count += 1);
            }
            counts
        };
        let add = |mut a: Vec<usize>, b: Vec<usize>| {
            a.iter_mut().zip(b).for_each(|(sum, count)| *sum += count);
            a
        };
        parallel::in_pool(self.threads, || self.records.par_iter().with_min_len(BLOCK).fold(none, count).reduce(none, add))
    }

    /// Some cells in their order, with their triangles.
    pub(super) fn read(&self, batch: &Range<u32>) -> Vec<Cell<'_>> {
        match &self.kept {
            Kept::OfPlan(plan, members) => {
                let wanted = |chunk: ChunkId| batch.contains(&chunk.0);
                let of = (self.records, &self.guide, plan);
                members.each(
                    of,
                    self.threads,
                    (Reads::Chunks, wanted),
                    || (),
                    |(), chunk, members, visitors| {
                        let mut cell = Cell::new(plan.home_box(chunk).half_open(), None, members.count() + visitors.count());
                        for seen in [members, visitors] {
                            seen.for_each(|number, triangle| cell.add(number, triangle.corners()));
                        }
                        cell
                    },
                )
            }
            Kept::Strips(strips, plan) => {
                let strips = strips.all().get(batch.start as usize..batch.end as usize).unwrap_or_default();
                self.guide.ask_for(strips.iter().flat_map(|strip| &strip.members).map(|number| (*number, 1)));
                strips.iter().map(|strip| self.strip(strip, plan)).collect()
            }
        }
    }

    fn strip(&self, strip: &Strip, plan: &'a Plan) -> Cell<'a> {
        let mut cell = Cell::new(strip.within, Some(plan), strip.members.len());
        strip.members.iter().for_each(|number| cell.add(*number, record::corners(&self.records[*number as usize])));
        cell
    }
}
