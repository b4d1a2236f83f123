//! The hot kernels by themselves, for the micro-benchmarks in `benches/`. No part of the engine's interface: anything here may change
//! or go at any time.

use std::hint::black_box;
use std::path::Path;

use crate::contract::error::Result;
use crate::contract::settings::Limits;
use crate::geometry::boxes::BoxTree;
use crate::geometry::sums::{Bounds, Measure};
use crate::geometry::tri_tri;
use crate::io::read_ahead::Guide;
use crate::io::record::{Record, corners};
use crate::stream::budget::{Budget, Loan};
use crate::stream::members::{Members, Reads};
use crate::stream::plan::{ChunkId, Plan};
use crate::topology::chunk::Scratch;
use crate::topology::intersect::Effort;
use crate::topology::vertex_table::{BATCH, Weld};

/// A triangle by the positions of its corners.
pub type Triangle = [[f32; 3]; 3];

/// Do two triangles cross or overlap? By the search for how they meet.
pub fn triangles_cross(a: &Triangle, b: &Triangle) -> bool {
    tri_tri::triangles_cross(a, b).is_crossing()
}

/// A mesh, and what a survey knows of it before its kernels run.
pub struct Mesh {
    records: Vec<Record>,
    limits: Limits,
    plan: Plan,
    members: Members,
    measure: Measure,
    weld: Weld,
    boxes: Vec<Bounds>,
    tree: BoxTree,
}

impl Mesh {
    /// Of a binary STL's bytes, in chunks of about `chunk_triangles`, on one thread.
    ///
    /// # Errors
    /// None, as long as the mesh is so small that nothing is spooled.
    pub fn new(file: &[u8], chunk_triangles: u32) -> Result<Self> {
        let (records, _) = file.get(84..).unwrap_or_default().as_chunks::<50>();
        let records = records.to_vec();
        let limits = Limits { threads: 1, chunk_triangles, ..Limits::default() };
        let plan = Plan::new(&records, &Guide::NONE, chunk_triangles);
        let members = gather(&records, &plan, &limits)?;
        let measure = Measure::new(&members.bounds);
        let boxes: Vec<_> = records.iter().map(bounds).collect();
        let tree = BoxTree::new(&boxes);
        Ok(Self { records, limits, plan, members, measure, weld: Weld::default(), boxes, tree })
    }

    /// Triangles.
    pub fn triangles(&self) -> usize {
        self.records.len()
    }

    /// The kd tree; returns its chunks.
    pub fn plan(&self) -> usize {
        Plan::new(&self.records, &Guide::NONE, self.limits.chunk_triangles).chunks()
    }

    /// The run lists of all chunks, with visitors, written; returns their bytes.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn gather(&self) -> Result<u64> {
        Ok(gather(&self.records, &self.plan, &self.limits)?.heap_bytes(1))
    }

    /// The run lists of all chunks, read; returns how many triangles are in them.
    pub fn list(&self) -> u64 {
        (0..self.plan.chunks() as u32).map(|chunk| self.members.count(ChunkId(chunk))).sum()
    }

    /// Positions to vertices, as many triangles at a time as a chunk has; returns how many vertices the last ones have.
    pub fn weld(&mut self) -> usize {
        let mut points = Vec::with_capacity(BATCH);
        let mut vertices = [0; BATCH];
        for chunk in self.records.chunks(self.limits.chunk_triangles as usize) {
            self.weld.reset(chunk.len() / 2);
            for batch in chunk.chunks(BATCH / 3) {
                points.clear();
                points.extend(batch.iter().flat_map(corners));
                self.weld.vertices(&points, black_box(&mut vertices));
            }
        }
        self.weld.positions().len()
    }

    /// All that topology decides inside chunks: weld, stars, regions, sums; returns the vertices at home in them.
    pub fn solve(&self) -> u64 {
        let budget = Budget::new(u64::MAX);
        let solved = self.members.each(
            (&self.records, &Guide::NONE, &self.plan),
            1,
            (Reads::Chunks, |_| true),
            Scratch::default,
            |scratch, chunk, seen, _| {
                scratch.solve(seen, self.plan.home_box(chunk), &self.measure, &[], &Loan::of(&budget)).vertices
            },
        );
        solved.into_iter().sum()
    }

    /// The same, and the search for self-intersections; returns how many pairs of triangles it tested.
    pub fn solve_and_cross(&self) -> u64 {
        let budget = Budget::new(u64::MAX);
        let tested = self.members.each(
            (&self.records, &Guide::NONE, &self.plan),
            1,
            (Reads::Chunks, |_| true),
            Scratch::default,
            |scratch, chunk, seen, visitors| {
                let cell = self.plan.home_box(chunk);
                let loan = Loan::of(&budget);
                black_box(scratch.solve(seen, cell, &self.measure, &[], &loan));
                scratch.cross(visitors, cell, Effort::ALL, &loan).tested
            },
        );
        tested.into_iter().sum()
    }

    /// Exact sums of area and volume; returns the volume.
    pub fn measure(&self) -> f64 {
        let mut volume = 0;
        for part in self.records.chunks(16) {
            let mut batch = [[[0.0; 3]; 3]; 16];
            batch.iter_mut().zip(part).for_each(|(place, record)| *place = corners(record));
            volume += self.measure.sum(&batch).volume;
        }
        volume as f64
    }

    /// A tree over the boxes of all triangles.
    pub fn grow_tree(&self) {
        black_box(BoxTree::new(&self.boxes));
    }

    /// The tree, asked once for each triangle; returns how often boxes meet.
    pub fn query_tree(&self) -> usize {
        let (mut found, mut all) = (Vec::new(), 0);
        for wanted in &self.boxes {
            self.tree.meeting(wanted, &mut found);
            all += found.len();
        }
        all
    }
}

fn gather(records: &[Record], plan: &Plan, limits: &Limits) -> Result<Members> {
    Members::gather(Path::new("memory"), (records, &Guide::NONE), plan, Some(0.0), limits, &crate::contract::progress::Quiet)
}

fn bounds(record: &Record) -> Bounds {
    let mut bounds = Bounds::EMPTY;
    bounds.include(&corners(record));
    bounds
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Corners, cuboid, plate, records};

    fn mesh(triangles: &[Corners]) -> Mesh {
        Mesh::new(&[&[0; 84], records(triangles).as_flattened()].concat(), 32).unwrap()
    }

    /// What is timed does its work: every kernel answers as it must for a plate of 8 × 8 squares.
    #[test]
    fn kernels_answer() {
        let mut plate = mesh(&plate(8, |_, _| true));
        assert_eq!((plate.triangles(), plate.plan(), plate.solve()), (128, 4, 81));
        assert!(plate.list() >= 128 && plate.gather().unwrap() > 0);
        // The last 32 triangles are two columns of squares.
        assert_eq!(plate.weld(), 3 * 9);
        assert!(plate.query_tree() > 128 * 6);
        // The plate lies in the plane that volumes are measured from.
        assert_eq!(plate.measure(), 0.0);
        plate.grow_tree();
        assert_eq!(mesh(&[]).solve(), 0);
    }

    #[test]
    fn the_search_tests_pairs_where_bodies_cross() {
        let one = cuboid([0.0; 3], [2.0; 3]);
        let through = cuboid([0.5, 0.5, -1.0], [1.0, 1.0, 3.0]);
        let apart = mesh(&one).solve_and_cross() + mesh(&through).solve_and_cross();
        assert!(mesh(&[one, through].concat()).solve_and_cross() > apart);
    }
}
