//! Stars of regular vertices: they are in the file alone, and are fetched from it.

use super::Survey;
use crate::geometry::grid::Grid;
use crate::geometry::sums::Bounds;
use crate::io::record;
use crate::stream::members::Reads;
use crate::stream::source::Triangle;
use crate::topology::chunk::IrregularTriangle;
use crate::topology::solving::at_home;
use crate::topology::vertex_table::{Sieve, Weld};
use crate::util::ids::NONE;

impl Survey<'_> {
    /// Makes irregular triangles of all triangles around the regular vertices at `positions`, and returns the new ones, ascending.
    /// Reads the chunks where the vertices are at home.
    pub(crate) fn promote(&mut self, positions: &[[f32; 3]]) -> Vec<(IrregularTriangle, u32)> {
        self.promoted.extend(positions);
        let new = self.beyond_the_submesh(positions);
        for (irregular_triangle, region) in self.guide.ahead(new.iter(), |(s, _)| Some(s.triangle)) {
            let sum = &mut self.regions[*region as usize];
            let extent = self.measure.triangle(&record::corners(&self.records[irregular_triangle.triangle as usize]));
            sum.triangles -= 1;
            sum.extent -= extent;
        }
        let mut all: Vec<(IrregularTriangle, u32)> = self
            .irregular_triangles
            .iter()
            .copied()
            .zip(self.irregular_triangle_regions.iter().copied())
            .chain(new.iter().copied())
            .collect();
        all.sort_unstable();
        (self.irregular_triangles, self.irregular_triangle_regions) = all.into_iter().unzip();
        new
    }

    /// The triangles around regular vertices at `positions` that are no irregular triangles, ascending, each with the corners that are there and
    /// the region it belongs to. Reads the chunks where the vertices are at home.
    pub(crate) fn beyond_the_submesh(&self, positions: &[[f32; 3]]) -> Vec<(IrregularTriangle, u32)> {
        let mut wanted = Weld::default();
        wanted.reset(positions.len() * 8);
        positions.iter().for_each(|p| {
            wanted.vertex(*p);
        });
        let by_home = self.by_home(positions);
        let at_home = |chunk| at_home(&by_home, chunk);
        let found = self.members.each(
            (self.records, &self.guide, &self.plan),
            self.threads,
            (Reads::Near, |chunk| !at_home(chunk).is_empty()),
            <(Sieve, Grid)>::default,
            |(sieve, grid), chunk, seen, _| {
                sieve.fill(at_home(chunk).iter().map(|(_, p)| *p));
                grid.mark(at_home(chunk).iter().map(|(_, p)| Bounds { lo: *p, hi: *p }));
                let regions = self.regions_of(chunk);
                let mut region_at = self.labels[chunk.0 as usize].by_place();
                let mut found = Vec::new();
                seen.each_near(&mut found, &|_, bounds| grid.may_meet(bounds), |found, place, triangle, record| {
                    let region = region_at(place);
                    let corners = record.corners();
                    if !sieve.may_hold(&corners) {
                        return;
                    }
                    let irregular = (0..3).filter(|k| wanted.find(corners[*k]).is_some()).fold(0, |mask, k| mask | 1 << k);
                    if irregular != 0 {
                        // Only irregular triangles are in no region, and those are known.
                        found.push((
                            IrregularTriangle { triangle, irregular },
                            regions.get(region as usize).copied().unwrap_or(NONE),
                        ));
                    }
                });
                found
            },
        );
        let mut all: Vec<(IrregularTriangle, u32)> = found.into_iter().flatten().collect();
        all.sort_unstable();
        all.dedup_by_key(|(s, _)| s.triangle);
        all.retain(|(s, _)| self.irregular_triangles.binary_search_by_key(&s.triangle, |t| t.triangle).is_err());
        all
    }
}
