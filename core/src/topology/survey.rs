//! The topology of a whole file: chunks solved in parallel, then merged over the triangles they share.
//!
//! What comes out does not depend on the chunks: the irregular triangles (all triangles around irregular vertices), and the regions of regular
//! surface, numbered by their smallest triangle. Everything global is proportional to the seams and the defects, not to the file.

mod around;

use crate::topology::solving::{Solving, Tables, count_of, take_tables};
use std::path::Path;

use crate::contract::error::Result;
use crate::contract::progress::Progress;
use crate::contract::report::SelfIntersections;
use crate::contract::settings::Limits;
use crate::geometry::grid::Grid;
use crate::geometry::position;
use crate::geometry::sums::{Bounds, Measure};
use crate::io::digest;
use crate::io::read_ahead::Guide;
use crate::io::record::{self, Record};
use crate::io::write_behind;
use crate::stream::budget::{Budget, Purpose};
use crate::stream::members::{Members, Reads};
use crate::stream::plan::{ChunkId, HomeBox, Plan};
use crate::stream::source::{Seen, Triangle};
use crate::topology::chunk::{ChunkTopology, IrregularTriangle};
use crate::topology::chunk_regions::Parts;
use crate::topology::crossings::{self, Crossings, Pair};
use crate::topology::labels::Labels;
use crate::topology::region_sums::RegionSums;
use crate::topology::vertex_table::Weld;
use crate::util::bits;
use crate::util::ids::NONE;
use crate::util::words::Count;

/// Topology of the regular part of a file, and the list of what is not regular.
#[derive(Debug)]
pub(crate) struct Survey<'a> {
    pub(crate) records: &'a [Record],
    pub(crate) measure: Measure,
    pub(crate) bounds: Bounds,
    /// Triangles of the submesh, ascending, each once.
    pub(crate) irregular_triangles: Vec<IrregularTriangle>,
    /// The region of each irregular triangle's regular corners, or [`NONE`].
    pub(crate) irregular_triangle_regions: Vec<u32>,
    /// Regions by ascending smallest triangle. Sums leave the irregular triangles out.
    pub(crate) regions: Vec<RegionSums>,
    /// Runs of triangles with non-finite coordinates.
    pub(crate) nonfinite: Vec<(u32, u32)>,
    /// Triangles with finite coordinates.
    pub(crate) triangles: u64,
    /// `None` if they were not looked for.
    pub(crate) self_intersections: Option<SelfIntersections>,
    /// All of their pairs, unless there are too many to keep.
    pub(crate) crossing_pairs: Option<Vec<Pair>>,
    /// To be added to the volume in units of `measure`: not 0 only after a second look at what is open in another box.
    pub(crate) volume_beside: f64,
    /// Records that had been turned before they were surveyed, a bit each; empty if none was.
    pub(crate) turned: Vec<u64>,
    /// Regular vertices whose triangles were made irregular triangles.
    pub(crate) promoted: Vec<[f32; 3]>,
    /// Distinct positions, and those used by a triangle with three distinct vertices.
    pub(crate) vertices: u64,
    pub(crate) vertices_used: u64,
    guide: Guide<'a>,
    plan: Plan,
    members: Members,
    labels: Vec<Labels>,
    /// By chunk, the box of all regular triangles that it sees.
    reaches: Vec<Bounds>,
    parts: Parts,
    /// Part → region.
    merged: Vec<u32>,
    /// So many of the promoted vertices have divided the surface.
    dividing: usize,
    /// Memory that was counted while the chunks were solved, and is still held.
    budget: Budget,
    threads: usize,
}

/// The fate of regions that were divided.
pub(crate) struct Division {
    /// The new irregular triangles, ascending, with the regions they belonged to.
    pub(crate) fetched: Vec<(IrregularTriangle, u32)>,
    /// For each region now the one that it was a part of.
    pub(crate) divided_from: Vec<u32>,
}

impl<'a> Survey<'a> {
    /// Reads `records` twice (once to plan, once by chunks). Looks for self-intersections if asked to. Refuses
    /// when tables would not fit `limits.memory_bytes`.
    pub(crate) fn new(
        path: &Path,
        records: &'a [Record],
        self_intersections: bool,
        limits: &Limits,
        progress: &dyn Progress,
    ) -> Result<Self> {
        let (survey, _) = Self::of(path, records, self_intersections, None, limits, progress)?;
        Ok(survey)
    }

    /// As [`Self::new`]; `None` if more than `most_irregular` corners of triangles are not regular, which is found with less work and memory.
    pub(crate) fn unless_irregular(
        path: &Path,
        records: &'a [Record],
        self_intersections: bool,
        most_irregular: u64,
        limits: &Limits,
        progress: &dyn Progress,
    ) -> Result<Option<Self>> {
        let (survey, is_whole) = Self::of(path, records, self_intersections, Some(most_irregular), limits, progress)?;
        Ok(is_whole.then_some(survey))
    }

    /// A survey, and whether it is whole: without `most_irregular` it is.
    fn of(
        path: &Path,
        records: &'a [Record],
        self_intersections: bool,
        most_irregular: Option<u64>,
        limits: &Limits,
        progress: &dyn Progress,
    ) -> Result<(Self, bool)> {
        let span = tracing::debug_span!("plan").entered();
        progress.at("plan", 0, records.len() as u64);
        let guide = Guide::new(records.as_flattened(), limits);
        let plan = Plan::new(records, &guide, limits.chunk_triangles);
        let visitors = self_intersections.then_some(0.0);
        let members = Members::gather(path, (records, &guide), &plan, visitors, limits, progress)?;
        drop(span);
        let mut survey = Self::unsolved(records, guide, plan, members, limits);
        let tables = survey.take_tables(path, &survey.budget, limits)?;
        let _span = tracing::debug_span!("chunks", count = survey.plan.chunks()).entered();
        let solving = survey.solving(path, (&survey.budget, tables.threads), progress);
        let Some(chunks) = solving.all(self_intersections, most_irregular)? else { return Ok((survey, false)) };
        survey.budget.give_back(Purpose::Tables, tables.bytes);
        survey.merge(chunks, self_intersections);
        Ok((survey, true))
    }

    /// A survey before its chunks are solved.
    fn unsolved(records: &'a [Record], guide: Guide<'a>, plan: Plan, mut members: Members, limits: &Limits) -> Self {
        let bounds = members.bounds.normalised();
        let nonfinite = std::mem::take(&mut members.nonfinite);
        Self {
            records,
            measure: Measure::new(&bounds),
            bounds,
            irregular_triangles: Vec::new(),
            irregular_triangle_regions: Vec::new(),
            regions: Vec::new(),
            triangles: records.len() as u64 - count_of(&nonfinite),
            nonfinite,
            self_intersections: None,
            crossing_pairs: None,
            volume_beside: 0.0,
            turned: Vec::new(),
            promoted: Vec::new(),
            vertices: 0,
            vertices_used: 0,
            parts: Parts::none(plan.chunks()),
            guide,
            plan,
            members,
            reaches: Vec::new(),
            labels: Vec::new(),
            merged: Vec::new(),
            dividing: 0,
            budget: Budget::new(limits.memory_bytes),
            threads: limits.threads,
        }
    }

    /// Takes from the budget what is needed before chunks are solved.
    fn take_tables(&self, path: &Path, budget: &Budget, limits: &Limits) -> Result<Tables> {
        // A copy of the file and its digest may be in the making.
        let beside = write_behind::most_dirty(limits) + digest::heap_bytes(size_of_val(self.records) as u64);
        budget.take(Purpose::Tables, beside);
        take_tables(path, budget, &self.plan, &self.members, count_of(&self.nonfinite), limits)
    }

    fn solving<'s>(
        &'s self,
        path: &'s Path,
        (budget, threads): (&'s Budget, usize),
        progress: &'s dyn Progress,
    ) -> Solving<'s, 'a> {
        Solving {
            path,
            records: self.records,
            guide: &self.guide,
            plan: &self.plan,
            members: &self.members,
            measure: &self.measure,
            budget,
            threads,
            progress,
        }
    }

    /// Takes in what all chunks found, of self-intersections if these were looked for.
    fn merge(&mut self, mut chunks: Vec<ChunkTopology>, self_intersections: bool) {
        let span = tracing::debug_span!("merge").entered();
        let mut fresh: Vec<(ChunkId, &mut ChunkTopology)> = (0..).map(ChunkId).zip(&mut chunks).collect();
        let known = (self.records, &self.measure);
        (self.parts, self.irregular_triangles) = self.parts.renewed(known, Vec::new(), &mut fresh, |_| true);
        (self.regions, self.merged) = self.parts.united();
        self.irregular_triangle_regions = self.parts.regions_of(&self.irregular_triangles, &self.merged);
        drop(span);
        if self_intersections {
            let parts = chunks.iter_mut().map(|c| std::mem::take(&mut c.crossings));
            let (summed, pairs) = Crossings::sum(parts, crossings::most_tested(self.records.len() as u64));
            (self.self_intersections, self.crossing_pairs) = (Some(summed), pairs);
        }
        self.vertices = chunks.iter().map(|c| c.vertices).sum();
        self.vertices_used = chunks.iter().map(|c| c.vertices_used).sum();
        self.reaches = chunks.iter().map(|c| c.reach).collect();
        self.labels = chunks.into_iter().map(|c| c.labels).collect();
    }

    /// Divides the surface at the regular vertices among `positions`: they count as irregular, so that their triangles become irregular triangles, and
    /// what hangs together only through them, or what was promoted before, becomes several regions. Solves the chunks again where they are at home,
    /// and those that share triangles with these. Refuses when tables would not fit `limits.memory_bytes`.
    pub(crate) fn divide(
        &mut self,
        path: &Path,
        positions: &[[f32; 3]],
        limits: &Limits,
        progress: &dyn Progress,
    ) -> Result<Division> {
        let _span = tracing::debug_span!("divide", positions = positions.len()).entered();
        let budget = Budget::new(limits.memory_bytes);
        let threads = self.take_tables(path, &budget, limits)?.threads;
        let fetched = self.beyond_the_submesh(positions);
        let all: Vec<[f32; 3]> = self.promoted.iter().chain(positions).copied().collect();
        let mut is_cut = vec![false; self.plan.chunks()];
        all[self.dividing..].iter().for_each(|p| is_cut[self.plan.home(*p).0 as usize] = true);
        let is_fresh = self.parts.with_neighbours(&is_cut);
        let by_home = self.by_home(&all);
        let kept = (0..self.plan.chunks()).filter(|c| !is_fresh[*c]);
        self.parts.take(&budget, kept.clone().map(|c| &self.labels[c]), self.irregular_elsewhere(&is_fresh));
        let regions = kept.map(|c| self.parts.of_chunk(ChunkId(c as u32)).len() as u64).sum();
        let mut solved = self.solving(path, (&budget, threads), progress).again(
            &is_fresh,
            &by_home,
            [self.irregular_triangles.len() as u64, regions],
        )?;
        let irregular = self.irregular();
        let mut fresh: Vec<(ChunkId, &mut ChunkTopology)> =
            solved.iter_mut().map(|(chunk, topology)| (*chunk, topology)).collect();
        let known = (self.records, &self.measure);
        let (parts, irregular_triangles) =
            self.parts.renewed(known, self.irregular_triangles.clone(), &mut fresh, |chunk| is_cut[chunk]);
        let (regions, merged) = parts.united();
        self.promoted.extend(positions.iter().filter(|p| irregular.find(**p).is_none()));
        self.dividing = self.promoted.len();
        // By what was true before.
        let divided_from = self.regions_at(regions.iter().map(|region| region.first));
        self.irregular_triangle_regions = parts.regions_of(&irregular_triangles, &merged);
        (self.irregular_triangles, self.regions, self.merged, self.parts) = (irregular_triangles, regions, merged, parts);
        for (chunk, topology) in solved {
            self.reaches[chunk.0 as usize] = topology.reach;
            self.labels[chunk.0 as usize] = topology.labels;
        }
        Ok(Division { fetched, divided_from })
    }

    /// Irregular triangles that none of these chunks tells of.
    fn irregular_elsewhere(&self, chunks: &[bool]) -> u64 {
        let is_told = |s: &IrregularTriangle, corners: [[f32; 3]; 3]| {
            (0..3)
                .filter(|k| s.irregular >> k & 1 == 1)
                .any(|k| chunks[self.plan.home(position::canonical(corners[k])).0 as usize])
        };
        self.irregular_corners().filter(|(s, corners)| !is_told(s, *corners)).count() as u64
    }

    /// Bytes held, but for irregular triangles.
    pub(crate) fn heap_bytes(&self) -> u64 {
        let labels: u64 = self.labels.iter().map(Labels::heap_bytes).sum();
        let regions = size_of_val(&*self.regions) + size_of_val(&*self.merged) + size_of_val(&*self.turned);
        self.plan.heap_bytes() + self.members.heap_bytes(self.threads) + labels + self.parts.heap_bytes() + regions as u64
    }

    /// The corners of irregular triangles that are irregular.
    fn irregular(&self) -> Weld {
        let mut irregular = Weld::default();
        irregular.reset(self.irregular_triangles.len());
        for (irregular_triangle, corners) in self.irregular_corners() {
            (0..3).filter(|k| irregular_triangle.irregular >> k & 1 == 1).for_each(|k| {
                irregular.vertex(corners[k]);
            });
        }
        irregular
    }

    /// The regions of some triangles with a regular corner.
    fn regions_at(&self, triangles: impl Iterator<Item = u32>) -> Vec<u32> {
        let triangles: Vec<u32> = triangles.collect();
        let read = self.ahead(triangles.iter(), |t| Some(**t));
        let positions: Vec<[f32; 3]> = read.flat_map(|t| position::corners(&self.records[*t as usize])).collect();
        // Around positions that are not regular there may be triangles of no region, or of the submesh.
        let around = self.beyond_the_submesh(&positions);
        let region = |t: u32| match self.irregular_triangles.binary_search_by_key(&t, |s| s.triangle) {
            Ok(i) => self.irregular_triangle_regions[i],
            Err(_) => around.binary_search_by_key(&t, |(s, _)| s.triangle).map_or(NONE, |i| around[i].1),
        };
        triangles.into_iter().map(region).collect()
    }

    /// The region of an irregular triangle's regular corners, if it has any.
    pub(crate) fn region_of_irregular_triangle(&self, record: u32) -> u32 {
        self.irregular_triangles
            .binary_search_by_key(&record, |s| s.triangle)
            .map_or(NONE, |i| self.irregular_triangle_regions[i])
    }

    /// Positions with the chunks where they are at home, by chunk.
    fn by_home(&self, positions: &[[f32; 3]]) -> Vec<(ChunkId, [f32; 3])> {
        let mut by_home: Vec<(ChunkId, [f32; 3])> = positions.iter().map(|p| (self.plan.home(*p), *p)).collect();
        by_home.sort_by_key(|(home, _)| *home);
        by_home
    }

    /// Refuses the work on `path` if what is to be known of so many edges of one triangle in the submesh, in `bytes`, does not fit the budget
    /// beside what was counted while the chunks were solved.
    pub(crate) fn take_boundary(&self, path: &Path, boundary_edges: u64, bytes: u64) -> Result<()> {
        self.budget.take(Purpose::Defects, bytes);
        self.budget.check(path, || {
            format!(
                "{} triangles lie at defects, with {} edges that only one triangle has",
                Count(self.irregular_triangles.len()),
                Count(boundary_edges)
            )
        })
    }

    /// Had a record been turned before it was surveyed?
    pub(crate) fn was_turned(&self, record: u32) -> bool {
        bits::holds(&self.turned, record as usize)
    }

    /// Threads to work with.
    pub(crate) fn threads(&self) -> usize {
        self.threads
    }

    /// As [`Guide::ahead`] of the file's records.
    pub(crate) fn ahead<T>(&self, items: impl Iterator<Item = T>, number: impl Fn(&T) -> Option<u32>) -> impl Iterator<Item = T> {
        self.guide.ahead(items, number)
    }

    /// The irregular triangles with the corners of their records, ascending.
    pub(crate) fn irregular_corners(&self) -> impl Iterator<Item = (&IrregularTriangle, [[f32; 3]; 3])> {
        let all = self.ahead(self.irregular_triangles.iter(), |s| Some(s.triangle));
        all.map(|s| (s, record::corners(&self.records[s.triangle as usize])))
    }

    /// Merged regions of a chunk, by the chunk's own numbers.
    fn regions_of(&self, chunk: ChunkId) -> &[u32] {
        &self.merged[self.parts.of_chunk(chunk)]
    }

    /// Visits every triangle with three regular corners whose region is `wanted`, exactly once, with its region: chunks in parallel, results in
    /// chunk order (which the plan decides: only sums of integers and sets may be made of them).
    pub(crate) fn visit_regular<R: Send>(
        &self,
        wanted: impl Fn(u32) -> bool + Sync,
        make: impl Fn() -> R + Sync,
        visit: impl Fn(&mut R, u32, u32) + Sync,
    ) -> Vec<R> {
        self.visit_regular_near(wanted, |_| Some(make()), |_, _| true, |_, _| true, visit)
    }

    /// As [`Self::visit_regular`], those that `pass`. `make` is given the box of all regular triangles that a chunk sees, and says `None` if none of
    /// them is of interest; `near` is given the box of some of them before these are visited, and says false only if none in it passes.
    /// `passes` is asked before it is found out whose turn a triangle is, which may take longer.
    pub(crate) fn visit_regular_near<R: Send>(
        &self,
        wanted: impl Fn(u32) -> bool + Sync,
        make: impl Fn(&Bounds) -> Option<R> + Sync,
        near: impl Fn(&mut R, &Bounds) -> bool + Sync,
        passes: impl Fn(&R, &[[f32; 3]; 3]) -> bool + Sync,
        visit: impl Fn(&mut R, u32, u32) + Sync,
    ) -> Vec<R> {
        let makes = |chunk: ChunkId| make(&self.reaches[chunk.0 as usize]);
        let is_wanted = |chunk: ChunkId| self.regions_of(chunk).iter().any(|p| wanted(*p)) && makes(chunk).is_some();
        let of_chunk = |around: &mut Grid, chunk: ChunkId, seen: &Seen<'_>, _: &Seen<'_>| {
            let mut result = makes(chunk)?;
            let regions = self.regions_of(chunk);
            // Many a region that is wanted is a small part of its chunk.
            let mine: Vec<Bounds> = regions.iter().filter(|r| wanted(**r)).map(|r| self.regions[*r as usize].bounds).collect();
            let is_everywhere = mine.iter().any(|bounds| bounds.contains(&self.reaches[chunk.0 as usize]));
            around.mark(mine.iter().copied().filter(|_| !is_everywhere));
            let near = |result: &mut R, bounds: &Bounds| (is_everywhere || around.may_meet(bounds)) && near(result, bounds);
            let cell = self.plan.home_box(chunk);
            let mut region_at = self.labels[chunk.0 as usize].by_place();
            seen.each_near(&mut result, &near, |result, place, number, triangle| {
                let region = region_at(place);
                if region == NONE || !wanted(regions[region as usize]) {
                    return;
                }
                let corners = triangle.corners();
                if !passes(result, &corners) || self.irregular_triangles.binary_search_by_key(&number, |s| s.triangle).is_ok() {
                    return;
                }
                // A regular triangle has a label in every chunk that sees it; the lowest of them visits it.
                if corners.iter().all(|p| cell.holds(*p)) || corners.iter().all(|p| self.plan.home(*p) >= chunk) {
                    visit(result, number, regions[region as usize]);
                }
            });
            Some(result)
        };
        let visited = self.members.each(
            (self.records, &self.guide, &self.plan),
            self.threads,
            (Reads::Near, is_wanted),
            Grid::default,
            of_chunk,
        );
        visited.into_iter().flatten().collect()
    }

    /// `work` on every wanted chunk: its cell, its members, and its visitors, which there are if self-intersections were looked for; the disk is
    /// asked only for what [`Seen::each_near`] visits. Results by
    /// chunk, so only sums and sets may be made of them.
    pub(crate) fn each_chunk<S, R: Send>(
        &self,
        wanted: impl Fn(ChunkId) -> bool + Sync,
        scratch: impl Fn() -> S + Sync,
        work: impl Fn(&mut S, (ChunkId, HomeBox), [&Seen<'_>; 2]) -> R + Sync,
    ) -> Vec<R> {
        self.members.each(
            (self.records, &self.guide, &self.plan),
            self.threads,
            (Reads::Near, wanted),
            scratch,
            |scratch, chunk, members, visitors| work(scratch, (chunk, self.plan.home_box(chunk)), [members, visitors]),
        )
    }

    /// The cells of the chunks.
    pub(crate) fn plan(&self) -> &Plan {
        &self.plan
    }
}

#[cfg(test)]
mod tests;
