//! Pieces of surface, and what of them lies in boxes.

use std::sync::Arc;

use crate::geometry::boxes::BoxTree;
use crate::geometry::distance::place;
use crate::geometry::places::{Places, Stretch};
use crate::geometry::sums::Bounds;
use crate::geometry::tri_tri::Triangle as Corners;
use crate::io::record;
use crate::repairs::shared::work::Work;
use crate::repairs::stitch::layer::{Facet, Reach, RimEdge, around};
use crate::submesh::Submesh;
use crate::submesh::components::{Component, Components};
use crate::submesh::edges::Edge;
use crate::submesh::near::Tolerance;
use crate::topology::survey::Survey;
use crate::util::parallel;

/// Surfaces lie on each other within this share of the diagonals of their boxes together.
const LAP: f64 = 1e-4;

/// Triangles that are looked at together, at most; where there are more, nothing is cut. By count, so that memory decides nothing.
pub(crate) const MOST: usize = crate::stream::budget::OVERLAPS_LOOKED_FOR;

/// A triangle of the mesh: regular, or of the submesh.
#[derive(Clone, Copy, Debug)]
pub(super) enum Number {
    /// The record of a triangle with regular corners only.
    Record(u32),
    /// A triangle of the submesh.
    Submesh(u32),
}

impl Number {
    pub(super) fn record(self) -> Option<u32> {
        match self {
            Self::Record(record) => Some(record),
            Self::Submesh(_) => None,
        }
    }

    pub(super) fn submesh(self) -> Option<u32> {
        match self {
            Self::Submesh(t) => Some(t),
            Self::Record(_) => None,
        }
    }
}

/// A triangle of a piece.
#[derive(Clone, Copy, Debug)]
pub(super) struct Member {
    pub(super) piece: u32,
    pub(super) corners: Corners,
    pub(super) number: Number,
}

/// Pieces of surface with what is needed to compare them.
pub(super) struct Pieces {
    pub(super) components: Arc<Components>,
    /// All boundary edges, by piece, with the share of their triangle's height that a reach may have.
    pub(super) rims: Vec<(RimEdge, f64)>,
    /// Diagonals of the boxes.
    pub(super) sizes: Vec<f64>,
    /// What is nearer than this to where a piece ends is a matter of welding.
    pub(super) weld: f64,
}

impl Pieces {
    pub(super) fn of(survey: &Survey<'_>, work: &mut Work<'_>, tolerance: &Tolerance) -> Self {
        let components = work.components(survey);
        let (submesh, edges) = work.edges();
        let boundary = || edges.iter().filter(Edge::is_boundary);
        let of_edge = |e: Edge<'_>| {
            let t = e.uses[0].triangle();
            let facet = Facet::of(&submesh.points(t), components.of_triangle[t as usize]);
            let ends = [submesh.place(e.low), submesh.place(e.high)];
            (RimEdge { ends, normal: facet.normal, piece: facet.piece }, facet.height() * tolerance.edge_share)
        };
        let mut rims = Vec::with_capacity(boundary().count());
        rims.extend(boundary().map(of_edge));
        rims.sort_by_key(|(rim, _)| rim.piece);
        let sizes = components.list.iter().map(|c| c.bounds.diagonal()).collect();
        Self { components, rims, sizes, weld: tolerance.weld }
    }

    pub(super) fn list(&self) -> &[Component] {
        &self.components.list
    }

    /// How near two pieces lie on each other, where a triangle of one is so high that it may do so within `most`.
    pub(super) fn reach(&self, a: u32, b: u32, most: f64) -> Reach {
        self.reach_of(self.sizes[a as usize] + self.sizes[b as usize], most)
    }

    pub(super) fn reach_of(&self, sizes: f64, most: f64) -> Reach {
        let rim = (LAP * sizes).max(self.weld);
        Reach { on: rim.min(most), rim }
    }

    /// For each piece that ends, the others in whose box it may do so; numbered as the pieces are.
    pub(super) fn neighbours(&self) -> Vec<Vec<u32>> {
        let mut all = vec![Vec::new(); self.list().len()];
        let mut ends = vec![false; all.len()];
        self.rims.iter().for_each(|(r, _)| ends[r.piece as usize] = true);
        if !ends.contains(&true) || all.len() < 2 {
            return all;
        }
        let boxes: Vec<Bounds> = self.list().iter().map(|c| c.bounds).collect();
        let tree = BoxTree::new(&boxes);
        let largest = self.sizes.iter().copied().fold(0.0, f64::max);
        for (a, near) in (0..).zip(&mut all).filter(|(a, _)| ends[*a as usize]) {
            tree.meeting(&widened(&boxes[a as usize], self.reach_of(self.sizes[a as usize] + largest, f64::INFINITY).rim), near);
            near.retain(|b| *b != a);
        }
        all
    }

    pub(super) fn rims_of(&self, piece: u32) -> Vec<RimEdge> {
        let from = self.rims.partition_point(|(r, _)| r.piece < piece);
        self.rims[from..].iter().map(|(r, _)| *r).take_while(|r| r.piece == piece).collect()
    }

    /// All triangles of wanted pieces whose boxes meet one of these; `None` if they are too many.
    pub(super) fn gather(
        &self,
        survey: &Survey<'_>,
        submesh: &Submesh,
        is_wanted: impl Fn(u32) -> bool + Sync,
        boxes: &[Bounds],
    ) -> Option<Vec<Member>> {
        let places = Places::of(boxes);
        let everywhere = Stretch::default();
        let living: Vec<u32> = submesh.living().collect();
        let mut all = parallel::gather(survey.threads(), &living, |_, (_, t), all| {
            let (piece, corners) = (self.components.of_triangle[t as usize], submesh.points(t));
            if is_wanted(piece) && places.meet(&everywhere, &Bounds::of(&corners)) {
                all.push(Member { piece, corners, number: Number::Submesh(t) });
            }
        });
        let of_region = &self.components.of_region;
        let found = survey.visit_regular_near(
            |region| is_wanted(of_region[region as usize]),
            |reach| places.within(reach).map(|stretch| (stretch, Vec::new())),
            |(stretch, _), bounds| places.enter(stretch, bounds),
            |(stretch, _), corners| places.meet(stretch, &Bounds::of(corners)),
            |(_, found): &mut (Stretch, Vec<(u32, u32)>), triangle, region| found.push((triangle, region)),
        );
        let mut regular: Vec<(u32, u32)> = found.into_iter().flat_map(|(_, found)| found).collect();
        regular.sort_unstable();
        all.extend(survey.ahead(regular.into_iter(), |(record, _)| Some(*record)).map(|(record, region)| {
            let corners = record::corners(&survey.records[record as usize]);
            Member { piece: of_region[region as usize], corners, number: Number::Record(record) }
        }));
        (all.len() <= MOST).then_some(all)
    }
}

/// Wider on all sides, rounded outward.
pub(super) fn widened(b: &Bounds, by: f64) -> Bounds {
    around(&[place(b.lo), place(b.hi)], by)
}
