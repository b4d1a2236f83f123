//! The weld by tolerance in the stream: for files whose triangles hardly share a position, as exporters write them that transform facet by facet.
//!
//! **In:** records, a tolerance. **Out:** a copy of the records in which boundary vertices that lie together are one, and what was found on the way.
//!
//! Boundary vertices within reach of each other hang together; the reach of a vertex is the tolerance, but no more than a share of the shortest edge
//! of the triangles at it. Where that is less, vertices also hang together across edges that came apart, and so do those that crowd in a small cell (`links`). What hangs
//! together becomes one vertex: the one with most triangles, the smallest of equals. What is wider than four tolerances is split by place, and becomes
//! one vertex in each cell (`targets`). So a triangle that is smaller than what its corners were moved by loses its area, and its neighbours meet.
//!
//! A chunk sees all triangles within a margin around its cell, so that it knows whatever hangs together with a position at home in it, or that this
//! is too wide, and the same of all that lies in the cells of such positions. It moves the corners at home in it, and no others: each corner of the file
//! is moved once, and the result does not depend on the chunks.

use std::path::Path;
use std::sync::{Mutex, PoisonError};

use memmap2::{Mmap, MmapMut};

use crate::contract::error::{Error, Result};
use crate::contract::progress::Progress;
use crate::contract::settings::Limits;
use crate::geometry::distance::{Tolerance, longest_edge};
use crate::geometry::position;
use crate::io::read_ahead::Guide;
use crate::io::record::{self, Record};
use crate::io::write_behind;
use crate::stream::members::{Members, Reads};
use crate::stream::plan::Plan;
use crate::util::parallel;

mod cluster;
mod links;
mod look;
mod reach;
mod targets;

pub(crate) use cluster::Counts;
use cluster::{Chunk, Move};
pub(crate) use look::{bounds, widest_if_nothing_is_shared};
use reach::{CELL, WIDEST};

/// A chunk knows so many tolerances around its cell: the cells that it touches (by their diagonal), whatever hangs together with what is there, and how:
/// one step more, one on to what is as near to that, and some to spare.
const MARGIN: f64 = 1.75 * CELL + WIDEST + 2.0 + 0.5;

/// A triangle without an edge longer than so many tolerances is small.
const SMALL: f64 = 8.0;

/// One triangle of so many may be crushed: more, and the tolerance is too wide for some part of the file.
const CRUSHED: u64 = 1024;

/// Records after the weld, and what was done.
#[derive(Debug)]
pub(crate) struct Welded {
    pub(crate) records: Mmap,
    pub(crate) counts: Counts,
}

impl Welded {
    /// Is what was welded still there?
    pub(crate) fn keeps_all(&self) -> bool {
        self.counts.crushed * CRUSHED <= self.counts.triangles
    }
}

/// Welds `records` into a file without a name. O(n log n) time; memory for chunks and member lists alone.
///
/// # Errors
/// [`Error::NoSpace`] without room for the copy, [`Error::Io`] where it cannot be made.
pub(crate) fn weld(
    path: &Path,
    records: &[Record],
    reach: Tolerance,
    limits: &Limits,
    progress: &dyn Progress,
) -> Result<Welded> {
    let guide = Guide::new(records.as_flattened(), limits);
    let plan = Plan::new(records, &guide, limits.chunk_triangles);
    let margin = (MARGIN * reach.weld) as f32;
    let members = Members::gather(path, (records, &guide), &plan, Some(margin), limits, progress)?;
    let copy = Mutex::new(copied(path, records, &guide, limits)?);
    let all = records.len() as u64;
    let found = members.each(
        (records, &guide, &plan),
        limits.threads,
        (Reads::Chunks, |_| true),
        Chunk::default,
        |chunk, number, seen, visitors| {
            if progress.cancelled() {
                return Counts::default();
            }
            let cell = plan.home_box(number);
            let (moves, counts) = chunk.solve([seen, visitors], cell, margin, reach);
            apply(&mut copy.lock().unwrap_or_else(PoisonError::into_inner), moves);
            progress.at("weld", (u64::from(number.0) + 1) * all / plan.chunks() as u64, all);
            counts
        },
    );
    let mut counts = Counts::default();
    found.iter().for_each(|found| counts.add(found));
    counts.triangles = all - members.nonfinite.iter().map(|(_, count)| u64::from(*count)).sum::<u64>();
    let copy = copy.into_inner().unwrap_or_else(PoisonError::into_inner);
    let welded = copy.make_read_only().map_err(Error::io(&limits.spool_folder(), "mapping"))?;
    (counts.moved_triangles, counts.crushed) = compared(records, welded.as_chunks().0, reach.weld, limits.threads);
    Ok(Welded { records: welded, counts })
}

/// A copy of the records, in a file without a name.
fn copied(path: &Path, records: &[Record], guide: &Guide<'_>, limits: &Limits) -> Result<MmapMut> {
    let need = (size_of_val(records) as u64, "the triangles after the weld");
    let file = write_behind::spooled(path, limits, need, |append| {
        guide.blocks(records).try_for_each(|block| append(block.as_flattened()))
    })?;
    // SAFETY: the file has no name and this is its only handle: nobody else changes or truncates it.
    unsafe { MmapMut::map_mut(&file) }.map_err(Error::io(&limits.spool_folder(), "mapping"))
}

/// How many records are not what they were, and how many of these were crushed: none of their edges is longer than [`SMALL`] tolerances, and two of their
/// corners are one now. Slivers are not: they are for the weld to close.
fn compared(before: &[Record], now: &[Record], weld: f64, threads: usize) -> (u64, u64) {
    const PIECE: usize = 1 << 15;
    let is_crushed = |before: &Record, now: &Record| {
        let [a, b, c] = position::corners(now);
        (a == b || b == c || c == a) && longest_edge(&record::corners(before)) <= SMALL * weld
    };
    let compared = |(before, now): (&[Record], &[Record])| {
        let differ = before.iter().zip(now).filter(|(before, now)| before != now);
        differ.fold((0, 0), |(differ, crushed), (before, now)| (differ + 1, crushed + u64::from(is_crushed(before, now))))
    };
    let pieces: Vec<_> = before.chunks(PIECE).zip(now.chunks(PIECE)).collect();
    let all = parallel::map(threads, pieces.len(), |i| compared(pieces[i]));
    all.into_iter().fold((0, 0), |sum, of| (sum.0 + of.0, sum.1 + of.1))
}

/// Puts corners to where they go.
fn apply(copy: &mut [u8], moves: &[Move]) {
    let records = copy.as_chunks_mut::<{ size_of::<Record>() }>().0;
    for Move { triangle, corner, to } in moves {
        record::put_corner(&mut records[*triangle as usize], usize::from(*corner), *to);
    }
}

#[cfg(test)]
mod tests;
