//! What was done to each cluster, for the report.

use std::collections::{BTreeMap, BTreeSet};

use crate::contract::report::{Region, RegionMethod};
use crate::geometry::sums::Bounds;
use crate::repairs::boolean::clusters::Clusters;
use crate::submesh::Submesh;
use crate::util::steps;

/// The account of one piece of surface, or of several.
#[derive(Clone, Copy)]
struct Done {
    /// Around its triangles that crossed something, in whatever round.
    bounds: Bounds,
    /// The triangles of the first round.
    triangles: u64,
    /// The last round in which any did.
    rounds: u32,
    snapped: bool,
    perturbed: bool,
    refilled: bool,
    moved: f64,
}

impl Done {
    const NOTHING: Self =
        Self { bounds: Bounds::EMPTY, triangles: 0, rounds: 0, snapped: false, perturbed: false, refilled: false, moved: 0.0 };

    fn add(&mut self, other: &Self) {
        self.bounds.add(&other.bounds);
        self.triangles += other.triangles;
        self.rounds = self.rounds.max(other.rounds);
        self.snapped |= other.snapped;
        self.perturbed |= other.perturbed;
        self.refilled |= other.refilled;
        self.moved = self.moved.max(other.moved);
    }

    fn region(&self, method: RegionMethod) -> Region {
        let bounds = self.bounds.normalised();
        Region {
            method,
            bounds: [bounds.lo, bounds.hi],
            count: self.triangles,
            rounds: self.rounds,
            moved: self.moved,
            reason: None,
        }
    }
}

/// By piece, since clusters grow while they are resolved.
#[derive(Default)]
pub(crate) struct Track(BTreeMap<u32, Done>);

impl Track {
    /// In this round (from 1 on) these triangles cross something, and are cut.
    pub(crate) fn crossed(&mut self, submesh: &Submesh, clusters: &Clusters, triangles: &BTreeSet<u32>, round: u32) {
        for t in triangles {
            let done = self.0.entry(clusters.of_triangle[*t as usize]).or_insert(Done::NOTHING);
            done.bounds.include(&submesh.points(*t));
            done.triangles += u64::from(round == 1);
            done.rounds = round;
        }
    }

    /// Something of this triangle's piece was made one with what is so far away.
    pub(crate) fn snapped(&mut self, clusters: &Clusters, triangle: u32, by: f64) {
        let piece = clusters.of_triangle.get(triangle as usize);
        if let Some(done) = piece.and_then(|piece| self.0.get_mut(piece)) {
            done.snapped = true;
            done.moved = done.moved.max(by);
        }
    }

    /// This piece was grown by so much.
    pub(crate) fn perturb(&mut self, piece: u32, by: f64) {
        let done = self.0.entry(piece).or_insert(Done::NOTHING);
        done.perturbed = true;
        done.moved = done.moved.max(by);
    }

    /// This triangle was taken out, and a patch came in its place that is so far away.
    pub(crate) fn refilled(&mut self, clusters: &Clusters, triangle: u32, by: f64) {
        let piece = clusters.of_triangle.get(triangle as usize);
        if let Some(done) = piece.and_then(|piece| self.0.get_mut(piece)) {
            done.refilled = true;
            done.moved = done.moved.max(by);
        }
    }

    /// A vertex of this triangle's piece was rounded by so much.
    pub(crate) fn moved(&mut self, clusters: &Clusters, triangle: u32, by: f64) {
        let piece = clusters.of_triangle.get(triangle as usize);
        if let Some(done) = piece.and_then(|piece| self.0.get_mut(piece)) {
            done.moved = done.moved.max(by);
        }
    }

    /// One region a cluster.
    pub(crate) fn regions(&self, clusters: &mut Clusters) -> Vec<Region> {
        let mut by_cluster: BTreeMap<u32, Done> = BTreeMap::new();
        for (piece, done) in &self.0 {
            by_cluster.entry(crate::util::union_find::find(&mut clusters.parents, *piece)).or_insert(Done::NOTHING).add(done);
        }
        let method = |done: &Done| match done {
            Done { refilled: true, .. } => RegionMethod::Refilled,
            Done { perturbed: true, .. } => RegionMethod::Perturbed,
            Done { snapped: true, .. } => RegionMethod::Snapped,
            _ => RegionMethod::Cut,
        };
        by_cluster.values().map(|done| done.region(method(done))).collect()
    }

    /// The region of some pieces that are left as they were, ascending: all, if there is none.
    pub(crate) fn left(&self, pieces: &[u32], reason: String) -> Region {
        let mut all = Done::NOTHING;
        if pieces.is_empty() {
            self.0.values().for_each(|done| all.add(done));
        }
        steps::count(pieces.len());
        pieces.iter().filter_map(|piece| self.0.get(piece)).for_each(|done| all.add(done));
        Region { moved: 0.0, reason: Some(reason), ..all.region(RegionMethod::Left) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_region_of_many_pieces_takes_steps_in_proportion() {
        steps::assert_near_linear(1000, |n| {
            let pieces: Vec<u32> = (0..n as u32).map(|piece| 2 * piece).collect();
            let done = |piece: &u32| (*piece, Done { triangles: 1, ..Done::NOTHING });
            let track = Track(pieces.iter().map(done).collect());
            // Every other one, and as many that are not there.
            let asked: Vec<u32> = (0..n as u32).map(|piece| 2 * piece + piece % 2).collect();
            let (steps, region) = steps::of(|| track.left(&asked, String::new()));
            assert_eq!(region.count, n.div_ceil(2) as u64);
            steps
        });
    }
}
