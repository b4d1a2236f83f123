//! The chunks of a file, solved in parallel and within a budget.

use crate::contract::error::{Error, Result};
use crate::contract::progress::Progress;
use crate::contract::settings::Limits;
use crate::geometry::sums::Measure;
use crate::io::read_ahead::Guide;
use crate::io::record::Record;
use crate::stream::budget::{Budget, Loan, Purpose};
use crate::stream::members::{Members, Reads};
use crate::stream::plan::HomeBox;
use crate::stream::plan::{ChunkId, Plan};
use crate::stream::source::Seen;
use crate::topology::chunk::{self, ChunkTopology, Scratch};
use crate::topology::crossings::{self, Crossings};
use crate::topology::intersect::Effort;
use crate::topology::room;
use crate::topology::star;
use crate::util::words::Count;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

/// The records and the plan that chunks are solved from, and the limits of that.
pub(crate) struct Solving<'s, 'a> {
    pub(crate) path: &'s Path,
    pub(crate) records: &'a [Record],
    pub(crate) guide: &'s Guide<'a>,
    pub(crate) plan: &'s Plan,
    pub(crate) members: &'s Members,
    pub(crate) measure: &'s Measure,
    pub(crate) budget: &'s Budget,
    pub(crate) threads: usize,
    pub(crate) progress: &'s dyn Progress,
}

/// Findings so far that have to be kept.
struct Found {
    irregular_triangles: AtomicU64,
    /// Corners that are not regular, each counted where it is at home.
    irregular_corners: AtomicU64,
    regions: AtomicU64,
}

impl Found {
    fn new(irregular_triangles: u64, regions: u64) -> Self {
        let [irregular_triangles, irregular_corners, regions] = [irregular_triangles, 0, regions].map(AtomicU64::new);
        Self { irregular_triangles, irregular_corners, regions }
    }

    fn add(&self, topology: &ChunkTopology) {
        let corners = topology.irregular_triangles.iter().map(|t| u64::from(t.irregular.count_ones())).sum();
        self.irregular_corners.fetch_add(corners, Ordering::Relaxed);
        self.irregular_triangles.fetch_add(topology.irregular_triangles.len() as u64, Ordering::Relaxed);
        self.regions.fetch_add(topology.regions.len() as u64, Ordering::Relaxed);
    }

    fn corners(&self) -> u64 {
        self.irregular_corners.load(Ordering::Relaxed)
    }
}

impl Solving<'_, '_> {
    /// Once it is clear that there is too much to keep, the rest need not be known.
    fn is_given_up(&self) -> bool {
        self.progress.cancelled() || self.budget.is_exceeded()
    }

    /// All chunks, with the self-intersections that they own if these are looked for; `None` if more than `most_irregular` corners are not regular, in
    /// which case little of the work is done.
    pub(crate) fn all(&self, self_intersections: bool, most_irregular: Option<u64>) -> Result<Option<Vec<ChunkTopology>>> {
        let triangles = self.records.len() as u64;
        if !self_intersections {
            return self.each(None, most_irregular);
        }
        let many = crossings::many_tested(triangles);
        let Some(mut chunks) = self.each(Some(many), most_irregular)? else { return Ok(None) };
        if chunks.iter().map(|c| c.crossings.tested).fold(0, u64::saturating_add) > many {
            self.cross_askew(&mut chunks, crossings::most_tested(triangles))?;
        }
        Ok(Some(chunks))
    }

    /// Looks for the self-intersections once more, where boxes select badly.
    fn cross_askew(&self, chunks: &mut [ChunkTopology], most_tested: u64) -> Result<()> {
        let _span = tracing::debug_span!("askew").entered();
        for chunk in chunks.iter_mut() {
            self.budget.give_back(Purpose::Seams, std::mem::take(&mut chunk.crossings).seam_bytes());
        }
        let more = Tables::fitting(&Tables::counts(self.members, self.plan), self.budget, self.threads, room::askew_bytes);
        self.budget.take(Purpose::Tables, more.bytes);
        self.budget.check(self.path, || "many triangles lie askew in each other's boxes".into())?;
        let around = star::line_of_hubs(chunks.iter().flat_map(|chunk| chunk.hubs.iter().copied()));
        let effort = Effort { allowance: most_tested, askew: true, around };
        let [tested, kept] = [const { AtomicU64::new(0) }; 2];
        let loan = Loan::of(self.budget);
        let crossings = self.members.each(
            (self.records, self.guide, self.plan),
            more.threads,
            (Reads::Chunks, |_| true),
            Scratch::default,
            |scratch, chunk, seen, visitors| {
                if self.is_given_up() {
                    return Crossings::default();
                }
                let cell = self.plan.home_box(chunk);
                scratch.solve(seen, cell, self.measure, &[], &loan);
                let crossings = Self::cross(scratch, (visitors, cell, &loan), effort, [&tested, &kept]);
                self.budget.take(Purpose::Seams, crossings.seam_bytes());
                crossings
            },
        );
        let found = Found::new(0, 0);
        chunks.iter().for_each(|chunk| found.add(chunk));
        self.check(found, &loan)?;
        self.budget.give_back(Purpose::Tables, more.bytes);
        chunks.iter_mut().zip(crossings).for_each(|(chunk, crossings)| chunk.crossings = crossings);
        Ok(())
    }

    /// The self-intersections that a solved chunk owns, if all chunks did not count too many pairs yet.
    fn cross(
        scratch: &mut Scratch,
        (visitors, cell, loan): (&Seen<'_>, HomeBox, &Loan<'_>),
        effort: Effort,
        [tested, kept]: [&AtomicU64; 2],
    ) -> Crossings {
        let allowance = effort.allowance.checked_sub(tested.load(Ordering::Relaxed));
        let Some(allowance) = allowance else { return Crossings::default() };
        let mut crossings = scratch.cross(visitors, cell, Effort { allowance, ..effort }, loan);
        tested.fetch_add(crossings.tested, Ordering::Relaxed);
        crossings.keep(kept);
        crossings
    }

    fn each(&self, many_tested: Option<u64>, most_irregular: Option<u64>) -> Result<Option<Vec<ChunkTopology>>> {
        let (found, [done, tested, kept]) = (Found::new(0, 0), [const { AtomicU64::new(0) }; 3]);
        let all = self.records.len() as u64;
        let loan = Loan::of(self.budget);
        let chunks = self.members.each(
            (self.records, self.guide, self.plan),
            self.threads,
            (Reads::Chunks, |_| true),
            Scratch::default,
            |scratch, chunk, seen, visitors| {
                // Too much to keep may be too much that is irregular: the same is found in any memory.
                let is_enough = most_irregular.map_or_else(|| self.budget.is_exceeded(), |most| found.corners() > most);
                if self.progress.cancelled() || is_enough {
                    return ChunkTopology::default();
                }
                let cell = self.plan.home_box(chunk);
                let mut topology = scratch.solve(seen, cell, self.measure, &[], &loan);
                if self.budget.is_exceeded() {
                    found.add(&topology);
                    return ChunkTopology::default();
                }
                if let Some(allowance) = many_tested {
                    let effort = Effort { allowance, askew: false, around: None };
                    topology.crossings = Self::cross(scratch, (visitors, cell, &loan), effort, [&tested, &kept]);
                }
                found.add(&topology);
                topology.take(self.budget);
                let chunks_done = done.fetch_add(1, Ordering::Relaxed) + 1;
                self.progress.at(STAGE, chunks_done * all / self.plan.chunks() as u64, all);
                topology
            },
        );
        if most_irregular.is_some_and(|most| found.corners() > most) && !self.progress.cancelled() {
            return Ok(None);
        }
        self.check(found, &loan)?;
        Ok(Some(chunks))
    }

    /// Some chunks again, with vertices that count as irregular, by the chunk where they are at home. `kept`: how many irregular triangles and regions there are
    /// beside what is found.
    pub(crate) fn again(
        &self,
        is_wanted: &[bool],
        irregular: &[(ChunkId, [f32; 3])],
        kept: [u64; 2],
    ) -> Result<Vec<(ChunkId, ChunkTopology)>> {
        let found = Found::new(kept[0], kept[1]);
        let loan = Loan::of(self.budget);
        let chunks = self.members.each(
            (self.records, self.guide, self.plan),
            self.threads,
            (Reads::Chunks, |chunk| is_wanted[chunk.0 as usize]),
            Scratch::default,
            |scratch, chunk, seen, _| {
                if self.is_given_up() {
                    return (chunk, ChunkTopology::default());
                }
                let cut: Vec<[f32; 3]> = at_home(irregular, chunk).iter().map(|(_, p)| *p).collect();
                let topology = scratch.solve(seen, self.plan.home_box(chunk), self.measure, &cut, &loan);
                found.add(&topology);
                topology.take(self.budget);
                (chunk, topology)
            },
        );
        self.check(found, &loan)?;
        Ok(chunks)
    }

    /// Refuses what the chunks found to be too much to keep.
    fn check(&self, found: Found, loan: &Loan<'_>) -> Result<()> {
        if self.progress.cancelled() {
            return Err(Error::cancelled(self.path, STAGE));
        }
        loan.check(self.path, || "a large chunk has more than one vertex for two triangles".into())?;
        let [irregular_triangles, pieces] = [found.irregular_triangles, found.regions].map(AtomicU64::into_inner);
        self.budget.check(self.path, || {
            format!(
                "at least {} triangles lie at defects, in {} pieces of surface or more",
                Count(irregular_triangles),
                Count(pieces)
            )
        })?;
        refuse_more_than(self.path, MOST_SUSPECTS, irregular_triangles, "triangles lie at defects")?;
        refuse_more_than(self.path, chunk::MOST_REGIONS, pieces, "pieces of surface, counted by chunks, are there")
    }
}

/// Most triangles a submesh can number the corners of, with room for what repairs add.
const MOST_SUSPECTS: u64 = 1 << 30;

/// Stage name under which the survey reports progress.
const STAGE: &str = "topology";

/// The positions of a chunk, of positions by chunk.
pub(crate) fn at_home(by_home: &[(ChunkId, [f32; 3])], chunk: ChunkId) -> &[(ChunkId, [f32; 3])] {
    let from = by_home.partition_point(|(home, _)| *home < chunk);
    &by_home[from..from + by_home[from..].partition_point(|(home, _)| *home == chunk)]
}

/// Triangles in runs of them.
pub(crate) fn count_of(runs: &[(u32, u32)]) -> u64 {
    runs.iter().map(|run| u64::from(run.1)).sum()
}

/// Refuses what could not be numbered.
fn refuse_more_than(path: &Path, most: u64, there: u64, what: &str) -> Result<()> {
    if there <= most {
        return Ok(());
    }
    let advice = format!("at most {} can be worked on: split the file", Count(most));
    Err(Error::Refused { path: path.into(), reason: format!("{} {what}", Count(there)), advice })
}

/// Tables for chunks, one set a thread: bytes, and threads that they are for.
pub(crate) struct Tables {
    pub(crate) bytes: u64,
    pub(crate) threads: usize,
}

impl Tables {
    /// Members and visitors of each chunk, most first.
    fn counts(members: &Members, plan: &Plan) -> Vec<u64> {
        let mut counts: Vec<u64> = (0..plan.chunks()).map(|c| members.count(ChunkId(c as u32))).collect();
        counts.sort_unstable_by(|a, b| b.cmp(a));
        counts
    }

    /// For as many threads, up to `threads`, as three quarters of the budget have room for, and for one at least; `each` tells the bytes for so many
    /// triangles. A thread's tables are as large as its largest chunk, and no two threads work on the same one.
    fn fitting(counts: &[u64], budget: &Budget, threads: usize, each: impl Fn(u64) -> u64) -> Self {
        let of = |threads: usize| Self { bytes: counts.iter().take(threads).map(|n| each(*n)).sum(), threads };
        let fits = |tables: &Self| tables.bytes <= budget.left() / 4 * 3;
        (2..=threads).rev().map(of).find(fits).unwrap_or_else(|| of(1))
    }
}

/// Takes what is known to be needed for chunks, and for so many triangles that are `nonfinite`, before the chunks are solved; returns how much of it is
/// free again once they are, and the threads that may solve them.
pub(crate) fn take_tables(
    path: &Path,
    budget: &Budget,
    plan: &Plan,
    members: &Members,
    nonfinite: u64,
    limits: &Limits,
) -> Result<Tables> {
    let counts = Tables::counts(members, plan);
    budget.take(Purpose::Tables, members.heap_bytes(limits.threads) + plan.heap_bytes());
    let tables = Tables::fitting(&counts, budget, limits.threads, room::scratch_bytes);
    budget.take(Purpose::Tables, tables.bytes);
    let largest = counts.first().copied().unwrap_or(0);
    budget.check(path, || format!("the largest chunk holds {} triangles", Count(largest)))?;
    budget.take(Purpose::Defects, nonfinite * crate::stream::budget::BYTES_PER_NONFINITE);
    budget.check(path, || format!("{} triangles have coordinates that are no finite numbers", Count(nonfinite)))?;
    Ok(tables)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fewer_threads_solve_what_does_not_fit_many_times() {
        let threads = |budget: u64, threads: usize| Tables::fitting(&[100, 90, 10], &Budget::new(budget), threads, |n| n).threads;
        assert_eq!([threads(1000, 1), threads(1000, 3), threads(1000, 8)], [1, 3, 8]);
        assert_eq!([threads(260, 2), threads(260, 3), threads(250, 2)], [2, 2, 1], "three quarters");
        assert_eq!([threads(50, 2), threads(50, 1)], [1, 1], "too little for one is another's to refuse");
        let budget = Budget::new(1000);
        budget.take(Purpose::Tables, 800);
        assert_eq!(Tables::fitting(&[100, 90], &budget, 2, |n| n).bytes, 100, "of what is left");
    }
}
