//! What is wrong everywhere in the same way, found in the stream: surface that is drawn several times, and triangles that face here and there.
//!
//! **In:** records. **Out:** which of them go, and which turn, so that the surface is drawn once and its triangles agree.
//!
//! The submesh takes what is wrong here and there; a file of which every triangle is wrong would go into it as a whole. So where most corners are not regular,
//! what can be told from edges alone is told chunk by chunk, with no more memory than a bit or two a triangle. Only whole pieces of surface are
//! touched: those that are drawn equally often everywhere, and those that can be made to agree. What is done to them is what the repairs would do
//! (`repairs/cleanup/duplicates`, `repairs/orient/directions`), and all else is left to these.

use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::contract::error::{Error, Result};
use crate::contract::progress::Progress;
use crate::contract::settings::Limits;
use crate::io::read_ahead::Guide;
use crate::io::record::Record;
use crate::stream::budget::{Budget, Purpose};
use crate::stream::members::{Members, Reads};
use crate::stream::plan::Plan;
use crate::stream::source::Source;
use crate::topology::solving;
use crate::util::bits::{self, Shared};

mod chunk;
mod seams;

use chunk::{Chunk, Piece, Pieces};
use seams::Fates;

/// Smaller files are worked on as a whole.
pub(crate) const FEWEST: usize = 1 << 17;

/// Triangles are turned here if more than this share of them meets one that disagrees; fewer are looked at one by one.
const CONTRADICTING: f64 = 1.0 / 16.0;

/// Stage name under which this reports progress.
const STAGE: &str = "everywhere";

/// Records that go and records that turn, a bit each, and how many.
#[derive(Debug, Default)]
pub(crate) struct Everywhere {
    pub(crate) gone: Vec<u64>,
    pub(crate) turned: Vec<u64>,
    pub(crate) copies: u64,
    pub(crate) turns: u64,
    /// Edges of two triangles that disagree.
    pub(crate) contradictions: u64,
}

/// How many corners of so many triangles are not regular where something is wrong everywhere; `None` for fewer triangles than are worth the look.
pub(crate) fn most_irregular(triangles: usize) -> Option<u64> {
    (triangles >= FEWEST).then_some(3 * triangles as u64 / 2)
}

/// Looks for what is wrong everywhere; `None` if there is no such thing. The same for any chunks. O(n) where vertices have few edges.
///
/// # Errors
/// [`Error::Starved`] where pieces and seams do not fit the budget.
pub(crate) fn look(path: &Path, records: &[Record], limits: &Limits, progress: &dyn Progress) -> Result<Option<Everywhere>> {
    let guide = Guide::new(records.as_flattened(), limits);
    let plan = Plan::new(records, &guide, limits.chunk_triangles);
    let members = Members::gather(path, (records, &guide), &plan, None, limits, progress)?;
    let budget = Budget::new(limits.memory_bytes);
    let tables = solving::take_tables(path, &budget, &plan, &members, 0, limits)?;
    // Two bits a triangle.
    budget.take(Purpose::Surface, records.len() as u64 / 4);
    let stream = Stream { records, guide: &guide, plan: &plan, members: &members, threads: tables.threads };
    let mut chunks = stream.pieces(&budget, progress);
    if progress.cancelled() {
        return Err(Error::cancelled(path, STAGE));
    }
    budget.check(path, || "most corners of triangles lie at defects".into())?;
    let contradictions = chunks.iter().map(|c| c.contradictions).sum::<u64>();
    let fates = Fates::of(&mut chunks, contradictions as f64 >= CONTRADICTING * records.len() as f64);
    let [gone, turned] = stream.apply(&chunks, &fates);
    let [copies, turns] = [&gone, &turned].map(|records| bits::count(records));
    Ok((copies + turns > 0).then_some(Everywhere { gone, turned, copies, turns, contradictions }))
}

/// Triangles by chunks.
struct Stream<'s, 'a> {
    records: &'a [Record],
    guide: &'s Guide<'a>,
    plan: &'s Plan,
    members: &'s Members,
    threads: usize,
}

impl Stream<'_, '_> {
    /// The pieces of each chunk; nothing of those that come after the budget is exceeded.
    fn pieces(&self, budget: &Budget, progress: &dyn Progress) -> Vec<Pieces> {
        let (all, done) = (self.records.len() as u64, AtomicU64::new(0));
        let source = (self.records, self.guide, self.plan);
        self.members.each(source, self.threads, (Reads::Chunks, |_| true), Chunk::default, |chunk, number, seen, _| {
            if progress.cancelled() || budget.is_exceeded() {
                return Pieces::default();
            }
            let pieces = chunk.solve(seen, self.plan.home_box(number));
            budget.take(Purpose::Surface, heap_bytes(&pieces));
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            progress.at(STAGE, done * all / self.plan.chunks() as u64, all);
            pieces
        })
    }

    /// The records that go, and those that turn. Every chunk that sees a triangle says the same of it.
    fn apply(&self, chunks: &[Pieces], fates: &Fates) -> [Vec<u64>; 2] {
        let [gone, turned] = [(); 2].map(|()| Shared::none(self.records.len()));
        let source = (self.records, self.guide, self.plan);
        self.members.each(
            source,
            self.threads,
            (Reads::Chunks, |_| true),
            || (),
            |(), number, seen, _| {
                let number = number.0 as usize;
                let told = &chunks[number];
                let (mut label, mut i) = (told.labels.by_place(), 0);
                seen.for_each(|t, _| {
                    let fate = fates.get(number, label(i));
                    let [is_odd, is_copy] = [&told.odd, &told.copies].map(|of| bits::holds(of, i));
                    i += 1;
                    if fate.drops_copies && is_copy {
                        gone.put(t);
                    } else if fate.turns == Some(is_odd) {
                        turned.put(t);
                    }
                });
            },
        );
        [gone, turned].map(Shared::into_bits)
    }
}

/// What a chunk keeps until all is decided, seams with their copy in the merge.
fn heap_bytes(pieces: &Pieces) -> u64 {
    let bits = (pieces.odd.len() + pieces.copies.len()) * size_of::<u64>();
    let merged = 3 * size_of::<Piece>() + size_of::<seams::Fate>() + 5;
    let seams = 2 * size_of_val(&*pieces.seams);
    (bits + seams + merged * pieces.pieces.len()) as u64 + pieces.labels.heap_bytes()
}

#[cfg(test)]
mod tests;
