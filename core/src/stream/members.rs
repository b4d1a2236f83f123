//! Which triangles each chunk sees: every triangle with a corner at home there, in ascending order.
//!
//! One pass over the records makes run-coded lists. A coherent file stays inside the current chunk's box for long stretches, so a list
//! costs about 0.02 bytes a triangle; a shuffled one costs up to 2. Where lists would not do (they would take too much memory, or lead all
//! over a file that is larger than the page cache), the same pass copies the triangles into a [`Spool`] instead.

use crate::stream::run_list::RunList;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::contract::error::Result;
use crate::contract::progress::Progress;
use crate::contract::settings::{Limits, Spill};
use crate::geometry::sums::Bounds;
use crate::io::disk_space::{self, Need};
use crate::io::read_ahead::Guide;
use crate::io::record::{self, Point, Record};
use crate::stream::columns::{CellColumns, Columns, Extremes};
use crate::stream::plan::{ChunkId, HomeBox, Plan};
use crate::stream::source::{Mapped, Seen, Spooled};
use crate::stream::spool::{self, Loaded, Spool, Unsorted};
use crate::stream::stretches::{self, Stretches};
use crate::util::parallel;

/// Who sees what, and what the same pass learns about the whole file.
///
/// A chunk's **visitors** are the triangles whose box meets its cell with no corner at home there. Self-intersections need them; where those
/// are not looked for, there are none.
#[derive(Debug)]
pub(crate) struct Members {
    kept: Kept,
    /// Runs of triangles with a NaN or infinite coordinate: first and count.
    pub(crate) nonfinite: Vec<(u32, u32)>,
    pub(crate) bounds: Bounds,
}

#[derive(Debug)]
enum Kept {
    /// `members[chunk][piece]`: pieces are consecutive stretches of the file.
    Lists {
        members: Vec<Vec<RunList>>,
        visitors: Vec<Vec<RunList>>,
        stretches: Stretches,
    },
    Spool(Spool),
}

/// The part of its chunks that a pass reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reads {
    /// All: some chunks are asked for while those before them are worked on.
    Chunks,
    /// The stretches that [`Seen::each_near`] finds near, and asks for itself.
    Near,
}

/// Takes down who sees what in one stretch of the file.
trait Take {
    /// Triangles that are members of this chunk alone.
    fn take_run(&mut self, chunk: ChunkId, first: u32, run: &[Record]);
    /// A triangle that is a member of all `members` and a visitor of all `visitors`, which are all distinct.
    fn take(&mut self, members: &[ChunkId], visitors: &[ChunkId], number: u32, record: &Record);
    /// Is it of no use to go on?
    fn given_up(&self) -> bool;
    /// Told at every [`stretches::SHORTEST`]th record of a piece, with all that follow in it.
    fn go_on(&mut self, at: usize, rest: &[Record]);
}

/// Lists of one piece.
struct Lists<'a> {
    members: Vec<RunList>,
    visitors: Vec<RunList>,
    /// By stretch, each of so many records.
    boxes: Vec<Bounds>,
    stretch: usize,
    /// Bytes not yet counted in `held`.
    uncounted: usize,
    /// Bytes in the lists of all pieces, and how many there may be.
    held: &'a AtomicU64,
    most: u64,
}

impl Lists<'_> {
    fn count(&mut self, bytes: usize) {
        self.uncounted += bytes;
        if self.uncounted >= 64 << 10 {
            self.held.fetch_add(self.uncounted as u64, Ordering::Relaxed);
            self.uncounted = 0;
        }
    }
}

impl Take for Lists<'_> {
    fn take_run(&mut self, chunk: ChunkId, first: u32, run: &[Record]) {
        let bytes = self.members[chunk.0 as usize].push(first, run.len() as u32);
        self.count(bytes);
    }

    fn take(&mut self, members: &[ChunkId], visitors: &[ChunkId], number: u32, _: &Record) {
        let bytes: usize = members.iter().map(|c| self.members[c.0 as usize].push(number, 1)).sum();
        let more: usize = visitors.iter().map(|c| self.visitors[c.0 as usize].push(number, 1)).sum();
        self.count(bytes + more);
    }

    fn given_up(&self) -> bool {
        is_too_much(self.held, self.most)
    }

    fn go_on(&mut self, at: usize, rest: &[Record]) {
        if at.is_multiple_of(self.stretch) {
            self.boxes.push(stretches::bounds(&rest[..rest.len().min(self.stretch)]));
        }
    }
}

/// While a list grows, it takes up to three times its bytes.
fn is_too_much(held: &AtomicU64, most: u64) -> bool {
    held.load(Ordering::Relaxed).saturating_mul(3) > most
}

impl Take for spool::Writer<'_> {
    fn take_run(&mut self, chunk: ChunkId, first: u32, run: &[Record]) {
        self.take_run(chunk, first, run);
    }

    fn take(&mut self, members: &[ChunkId], visitors: &[ChunkId], number: u32, record: &Record) {
        self.take(members, visitors, number, record);
    }

    fn given_up(&self) -> bool {
        self.has_failed()
    }

    fn go_on(&mut self, _: usize, _: &[Record]) {}
}

/// Findings made in passing.
struct Passing {
    nonfinite: Vec<(u32, u32)>,
    bounds: Bounds,
}

impl Passing {
    const NOTHING: Self = Self { nonfinite: Vec::new(), bounds: Bounds::EMPTY };

    fn note_nonfinite(&mut self, number: u32) {
        match self.nonfinite.last_mut() {
            Some((first, count)) if *first + *count == number => *count += 1,
            _ => self.nonfinite.push((number, 1)),
        }
    }

    fn add(&mut self, next: Self) {
        self.nonfinite.extend(next.nonfinite);
        self.bounds.add(&next.bounds);
    }
}

impl Members {
    /// Reads all records once, or twice if lists turn out to take too much memory. Lists visitors only if asked to: those that come so near to a cell, 0 for those that meet it.
    ///
    /// # Errors
    /// Where spooling fails.
    pub(crate) fn gather(
        path: &Path,
        (records, guide): (&[Record], &Guide<'_>),
        plan: &Plan,
        visitors: Option<f32>,
        limits: &Limits,
        progress: &dyn Progress,
    ) -> Result<Self> {
        let told = || Told { progress, done: AtomicU64::new(0), total: records.len() as u64 };
        let most = if limits.spill == Spill::Never { u64::MAX } else { limits.memory_bytes / 4 };
        if spool_bytes(records, guide, limits) == 0
            && let Some(members) = Self::list((records, guide), plan, visitors, limits.threads, most, &told())
        {
            return Ok(members);
        }
        Self::spool(path, (records, guide), plan, visitors, limits, &told())
    }

    /// `None` if the lists would take more than `most` bytes.
    fn list(
        (records, guide): (&[Record], &Guide<'_>),
        plan: &Plan,
        visitors: Option<f32>,
        threads: usize,
        most: u64,
        told: &Told<'_>,
    ) -> Option<Self> {
        // More pieces than threads only even out the load: lists of all pieces together say the same for any number of pieces.
        let pieces = if records.len() < 1 << 16 { 1 } else { threads * 4 };
        let stretch = Stretches::length(records.len());
        let held = AtomicU64::new(0);
        let empty = || vec![RunList::default(); plan.chunks()];
        let results = in_pieces((records, stretch), threads, pieces, |piece, offset| {
            let boxes = Vec::with_capacity(piece.len().div_ceil(stretch));
            let mut lists = Lists { members: empty(), visitors: empty(), boxes, stretch, uncounted: 0, held: &held, most };
            let passing = gather_piece((piece, guide), offset, plan, visitors, &mut lists, told);
            held.fetch_add(lists.uncounted as u64, Ordering::Relaxed);
            lists.members.iter_mut().chain(&mut lists.visitors).for_each(RunList::shrink);
            (lists.members, lists.visitors, lists.boxes, passing)
        });
        if is_too_much(&held, most) {
            return None;
        }
        let (mut all, mut all_visitors) = (vec![Vec::new(); plan.chunks()], vec![Vec::new(); plan.chunks()]);
        let mut passed = Passing::NOTHING;
        let mut boxes = Vec::with_capacity(records.len().div_ceil(stretch));
        for (members, visitors, own, passing) in results {
            passed.add(passing);
            boxes.extend(own);
            for (lists, of_chunks) in [(members, &mut all), (visitors, &mut all_visitors)] {
                let filled = lists.into_iter().zip(of_chunks).filter(|(list, _)| !list.is_empty());
                filled.for_each(|(list, of_chunk)| of_chunk.push(list));
            }
        }
        let stretches = Stretches::new(boxes, stretch);
        Some(Self::of(Kept::Lists { members: all, visitors: all_visitors, stretches }, passed))
    }

    fn spool(
        path: &Path,
        (records, guide): (&[Record], &Guide<'_>),
        plan: &Plan,
        visitors: Option<f32>,
        limits: &Limits,
        told: &Told<'_>,
    ) -> Result<Self> {
        // Asked again, for the lists may have led here.
        let need = Need { folder: limits.spool_folder(), bytes: entries_bytes(records), what: "sorting triangles by place" };
        disk_space::check(path, &[need])?;
        let spool = Unsorted::new(path, spool::Layout::new(records.len(), plan, limits), plan, limits)?;
        // One piece a thread: every piece ends with extents that are not full.
        let results = in_pieces((records, 1), limits.threads, limits.threads, |piece, offset| {
            let mut writer = spool.writer(plan.chunks());
            let passing = gather_piece((piece, guide), offset, plan, visitors, &mut writer, told);
            (writer.finish(), passing)
        });
        let mut passed = Passing::NOTHING;
        let parts = results
            .into_iter()
            .map(|(part, passing)| {
                passed.add(passing);
                part
            })
            .collect();
        Ok(Self::of(Kept::Spool(spool.sorted(parts, plan.chunks(), visitors.unwrap_or(0.0))?), passed))
    }

    fn of(kept: Kept, passing: Passing) -> Self {
        Self { kept, nonfinite: passing.nonfinite, bounds: passing.bounds }
    }

    /// Does `work` on every wanted chunk with its members and its visitors; results by chunk. Each thread makes one `scratch`.
    pub(crate) fn each<S, R: Send>(
        &self,
        (records, guide, plan): (&[Record], &Guide<'_>, &Plan),
        threads: usize,
        (reads, wanted): (Reads, impl Fn(ChunkId) -> bool + Sync),
        scratch: impl Fn() -> S + Sync,
        work: impl Fn(&mut S, ChunkId, &Seen<'_>, &Seen<'_>) -> R + Sync,
    ) -> Vec<R> {
        match &self.kept {
            Kept::Lists { members, visitors, stretches } => {
                let chunks: Vec<ChunkId> = (0..members.len() as u32).map(ChunkId).filter(|c| wanted(*c)).collect();
                let group = guide.group(members.len()).filter(|_| reads == Reads::Chunks);
                let ask = |group: &[ChunkId]| {
                    let lists = group.iter().flat_map(|c| members[c.0 as usize].iter().chain(&visitors[c.0 as usize]));
                    guide.ask_for(lists.flat_map(RunList::runs));
                };
                parallel::map_with(threads, chunks.len(), scratch, |scratch, i| {
                    // Chunks are taken in order: this group was asked for by whoever began with the one before.
                    if let Some(group) = group
                        && i % group == 0
                    {
                        let mut groups = chunks[i..].chunks(group);
                        let this = groups.next().filter(|_| i == 0);
                        this.into_iter().chain(groups.next()).for_each(ask);
                    }
                    let seen = [members, visitors].map(|lists| Mapped {
                        records,
                        lists: &lists[chunks[i].0 as usize],
                        stretches,
                        guide,
                    });
                    let [members, visitors] = seen.map(Seen::Mapped);
                    work(scratch, chunks[i], &members, &visitors)
                })
            }
            Kept::Spool(spool) => {
                let buckets: Vec<usize> = (0..spool.buckets()).filter(|b| spool.chunks(*b).any(&wanted)).collect();
                let scratch = || (scratch(), Loaded::default());
                let results = parallel::map_with(threads, buckets.len(), scratch, |(scratch, loaded), i| {
                    spool.load(plan, buckets[i], loaded);
                    let chunks = spool.chunks(buckets[i]).filter(|c| wanted(*c));
                    let seen = |entries| Seen::Spooled(Spooled { entries });
                    chunks
                        .map(|chunk| work(scratch, chunk, &seen(loaded.members(chunk)), &seen(loaded.visitors(chunk))))
                        .collect::<Vec<R>>()
                });
                results.into_iter().flatten().collect()
            }
        }
    }

    /// How many triangles `chunk` sees, visitors included.
    pub(crate) fn count(&self, chunk: ChunkId) -> u64 {
        match &self.kept {
            Kept::Lists { members, visitors, .. } => {
                let lists = members[chunk.0 as usize].iter().chain(&visitors[chunk.0 as usize]);
                lists.flat_map(RunList::runs).map(|(_, count)| u64::from(count)).sum()
            }
            Kept::Spool(spool) => spool.seen(chunk),
        }
    }

    /// Bytes held, with what [`Self::each`] takes on so many threads.
    pub(crate) fn heap_bytes(&self, threads: usize) -> u64 {
        let kept = match &self.kept {
            Kept::Lists { members, visitors, stretches } => {
                let both = || members.iter().chain(visitors);
                let pieces = both().flatten().map(|l| l.heap_bytes() + size_of::<RunList>()).sum::<usize>();
                (pieces + both().count() * size_of::<Vec<RunList>>() + stretches.heap_bytes()) as u64
            }
            Kept::Spool(spool) => spool.heap_bytes() as u64 + spool.loaded_bytes(threads),
        };
        kept + self.nonfinite.capacity() as u64 * 8
    }
}

/// `work(piece, number of its first record)` on `pieces` parts of the file, which begin at multiples of `whole` records; results in their order.
fn in_pieces<R: Send>(
    (records, whole): (&[Record], usize),
    threads: usize,
    pieces: usize,
    work: impl Fn(&[Record], u32) -> R + Sync,
) -> Vec<R> {
    let size = records.len().div_ceil(pieces.max(1)).max(1).next_multiple_of(whole);
    parallel::map(threads, records.len().div_ceil(size), |piece| {
        let from = piece * size;
        work(&records[from..records.len().min(from + size)], from as u32)
    })
}

/// What will be spooled to find out who sees what, in bytes; 0 if lists will do, as far as can be told beforehand.
pub(crate) fn spool_bytes(records: &[Record], guide: &Guide<'_>, limits: &Limits) -> u64 {
    let spooled = match limits.spill {
        Spill::Always => true,
        Spill::Never => false,
        Spill::Auto => guide.is_needed() && is_scattered(records, guide),
    };
    if spooled { entries_bytes(records) } else { 0 }
}

/// What a spool of these triangles takes, some of which lie across buckets.
fn entries_bytes(records: &[Record]) -> u64 {
    (records.len() * size_of::<spool::Entry>()) as u64 / 20 * 21
}

/// Stretches of the file that are looked at to find out how scattered its triangles are, and triangles in each.
const STRETCHES: usize = 256;
const STRETCH: usize = 64;

/// Do neighbours in the file lie far from each other (in different parts of some hundred) more often than once in a page of triangles?
/// (Whether they lie in the same chunk would not tell: rows of a grid cross many of them, but the next chunks continue where these end.)
fn is_scattered(records: &[Record], guide: &Guide<'_>) -> bool {
    let parts = Plan::new(records, guide, (records.len() / STRETCHES).try_into().unwrap_or(u32::MAX));
    let step = (records.len() / STRETCHES).max(STRETCH);
    guide.ask_for((0..records.len()).step_by(step).map(|first| (first as u32, STRETCH.min(records.len() - first) as u32)));
    let (mut changes, mut looked_at) = (0, 0);
    for stretch in records.chunks(step) {
        let mut last = None;
        for record in stretch.iter().take(STRETCH).filter(|r| record::all_finite(r)) {
            let part = parts.home(record::corners(record)[0]);
            changes += usize::from(last.is_some_and(|l| l != part));
            looked_at += 1;
            last = Some(part);
        }
    }
    changes * STRETCH > looked_at
}

/// Says how far the pass over the records is.
struct Told<'a> {
    progress: &'a dyn Progress,
    done: AtomicU64,
    total: u64,
}

impl Told<'_> {
    /// Records between two words.
    const EVERY: usize = 1 << 18;

    /// So many records of a piece were seen, a multiple of [`stretches::SHORTEST`].
    fn at(&self, seen: usize) {
        if !seen.is_multiple_of(Self::EVERY) {
            return;
        }
        let done = self.done.fetch_add(Self::EVERY as u64, Ordering::Relaxed) + Self::EVERY as u64;
        self.progress.at("plan", done.min(self.total), self.total);
    }
}

/// Where triangles are seen by one chunk alone.
fn well_inside(plan: &Plan, chunk: ChunkId, visitors: Option<f32>) -> CellColumns {
    CellColumns::of(&plan.home_box(chunk).grown(-visitors.unwrap_or(0.0)))
}

/// The chunks of three corners, each once, and how many there are.
fn distinct([a, b, c]: [ChunkId; 3]) -> ([ChunkId; 3], usize) {
    match (a == b, b == c || a == c) {
        (true, true) => ([a; 3], 1),
        (true, false) => ([a, c, c], 2),
        (false, true) => ([a, b, b], 2),
        (false, false) => ([a, b, c], 3),
    }
}

/// The chunks whose cells come within reach of a triangle's box, but for those where its corners are at home.
fn note_visited(plan: &Plan, corners: &[Point; 3], homes: [ChunkId; 3], reach: Option<f32>, visited: &mut Vec<ChunkId>) {
    visited.clear();
    let Some(reach) = reach else { return };
    let (lo, hi) = HomeBox::around(corners, reach).ends();
    plan.meeting(lo, hi, &mut |chunk| {
        if !homes.contains(&chunk) {
            visited.push(chunk);
        }
    });
}

fn gather_piece(
    (records, guide): (&[Record], &Guide<'_>),
    offset: u32,
    plan: &Plan,
    visitors: Option<f32>,
    take: &mut impl Take,
    told: &Told<'_>,
) -> Passing {
    let mut passing = Passing::NOTHING;
    let mut visited = Vec::new();
    let mut current = ChunkId(0);
    let mut cell = well_inside(plan, current, visitors);
    let mut extremes = Extremes::EMPTY;
    let (mut run_start, mut block_start) = (0usize, 0usize);
    for block in guide.blocks(records) {
        for (i, record) in (block_start..).zip(block) {
            if i.is_multiple_of(stretches::SHORTEST) {
                take.go_on(i, &records[i..]);
                told.at(i + stretches::SHORTEST);
            }
            record::prefetch_after(record);
            let columns = Columns::of(record);
            if cell.holds(&columns) {
                extremes.include(&columns);
                continue;
            }
            if i > run_start {
                take.take_run(current, offset + run_start as u32, &records[run_start..i]);
            }
            run_start = i + 1;
            if take.given_up() {
                return passing;
            }
            let (number, corners) = (offset + i as u32, record::corners(record));
            if !corners.iter().flatten().all(|x| x.is_finite()) {
                passing.note_nonfinite(number);
                continue;
            }
            passing.bounds.include(&corners);
            let homes = corners.map(|p| plan.home(p));
            if homes[0] == homes[1] && homes[0] == homes[2] {
                current = homes[0];
                cell = well_inside(plan, current, visitors);
                if cell.holds(&columns) {
                    run_start = i;
                    continue;
                }
            }
            note_visited(plan, &corners, homes, visitors, &mut visited);
            let (once, count) = distinct(homes);
            take.take(&once[..count], &visited, number, record);
        }
        block_start += block.len();
    }
    if records.len() > run_start {
        take.take_run(current, offset + run_start as u32, &records[run_start..]);
    }
    extremes.add_to(&mut passing.bounds);
    passing
}

#[cfg(test)]
mod tests;
