//! What was taken apart, for the report.

use std::collections::BTreeMap;

use crate::contract::report::{Region, RegionMethod};
use crate::geometry::sums::Bounds;
use crate::repairs::shared::region_report::Unsettled;
use crate::repairs::shared::work::Work;
use crate::submesh::components::nonmanifold_vertices;
use crate::submesh::{Submesh, Vertex};
use crate::topology::survey::Survey;
use crate::util::words::{Count, Short};
use std::fmt;

/// Counts and distances of the surfaces that were taken apart.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Separated {
    /// Fans that got a copy of their vertex.
    pub(crate) vertices: u64,
    /// Edges that got a vertex in their middle, for one wedge of theirs.
    pub(crate) edges: u64,
    /// Fans that were closed without their vertex ([`crate::repairs::separate::pinch_vertices`]).
    pub(crate) removed: u64,
    /// Vertices that still have several fans, or an edge of more than two triangles.
    pub(crate) left: u64,
    /// How far a copy is from where it was made, or a surface from where its vertex was.
    pub(crate) farthest: f64,
    /// Where: copies that share triangles are in one.
    pub(crate) regions: Vec<Region>,
    /// And where surfaces still meet: each vertex for itself.
    pub(crate) regions_left: Vec<Unsettled>,
}

impl Separated {
    /// Some fans were closed without their vertex.
    pub(crate) fn closed(&mut self, survey: &Survey<'_>, work: &Work<'_>, mut regions: Vec<Region>) {
        self.removed += regions.len() as u64;
        self.farthest = regions.iter().fold(self.farthest, |farthest, region| farthest.max(region.moved));
        self.regions.append(&mut regions);
        *self = std::mem::take(self).but(work, &nonmanifold_vertices(work, survey.threads()));
    }

    /// At these vertices surfaces still meet.
    pub(crate) fn but(self, submesh: &Submesh, vertices: &[Vertex]) -> Self {
        let one = |v: &Vertex| {
            let at = submesh.positions[*v as usize];
            let reason = Some("surfaces that meet there could not be taken apart".into());
            let region = Region { method: RegionMethod::Left, bounds: [at; 2], count: 1, rounds: 0, moved: 0.0, reason };
            Unsettled { region, at }
        };
        let regions_left = vertices.iter().map(one).collect();
        Self { left: vertices.len() as u64, regions_left, ..self }
    }
}

impl fmt::Display for Separated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [vertices, edges, removed, left] = [self.vertices, self.edges, self.removed, self.left].map(Count);
        let farthest = Short(self.farthest);
        write!(
            f,
            "surfaces that met given a vertex of their own: {vertices} at vertices, {edges} on edges, moved by at most {farthest}"
        )?;
        if self.removed > 0 {
            write!(f, "; closed without it: {removed}")?;
        }
        if self.left > 0 {
            write!(f, "; vertices where surfaces still meet: {left}")?;
        }
        Ok(())
    }
}

/// The copies of vertices, `first` the first of them, by what hangs together. `away`: how far each is from where it was made.
pub(crate) fn regions(submesh: &Submesh, first: Vertex, away: &[f64]) -> Vec<Region> {
    let mut parents: Vec<u32> = (0..away.len() as u32).collect();
    for copy in 0..away.len() as u32 {
        for (t, _) in submesh.star(first + copy) {
            let others = submesh.triangles[t as usize].v.into_iter().filter_map(|v| v.checked_sub(first));
            others.for_each(|other| {
                crate::util::union_find::unite(&mut parents, copy, other);
            });
        }
    }
    let mut all: BTreeMap<u32, (Bounds, u64, f64)> = BTreeMap::new();
    for (copy, away) in (0..).zip(away) {
        let (bounds, count, moved) =
            all.entry(crate::util::union_find::find(&mut parents, copy)).or_insert((Bounds::EMPTY, 0, 0.0));
        bounds.include(&[submesh.positions[(first + copy) as usize]]);
        (*count, *moved) = (*count + 1, away.max(*moved));
    }
    let region = |(bounds, count, moved): (Bounds, u64, f64)| {
        let Bounds { lo, hi } = bounds.normalised();
        Region { method: RegionMethod::Separated, bounds: [lo, hi], count, rounds: 0, moved, reason: None }
    };
    all.into_values().map(region).collect()
}
