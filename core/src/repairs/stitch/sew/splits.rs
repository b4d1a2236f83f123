//! Where the vertices of two rims that run along each other differ: edges are split at the vertices of the other rim.
//!
//! A split is wanted where a piece of the edge, from one split to the next or to an end, has a boundary edge of the other rim along it. One that has
//! closed neither of its two pieces in the end was of no use.

use crate::repairs::cleanup::degenerate;
use crate::repairs::shared::work::Work;
use crate::repairs::stitch::sew::rims::{RimEdge, Rims};
use crate::repairs::stitch::t_junctions;
use crate::submesh::edges::Edges;
use crate::submesh::near::{self, OnEdge};
use crate::submesh::{Submesh, Vertex};

/// A split: where, and the three vertices on the edge around it.
pub(crate) struct Split {
    edge: u32,
    at: [Vertex; 3],
}

/// Boundary vertices of other rims on boundary edges, by edge and place on it, which lie at the end of an edge that runs along.
pub(crate) fn wanted(submesh: &Submesh, edges: &Edges, rims: &Rims<'_>, threads: usize) -> Vec<OnEdge> {
    let on = near::on_edges(submesh, edges, |v| rims.reach[v as usize], threads);
    if on.is_empty() {
        return on;
    }
    let mut places: Vec<(u32, Vertex)> = on.iter().map(|on| (on.edge, on.vertex)).collect();
    places.sort_unstable();
    let mut at_vertex: Vec<(Vertex, u32)> = (0..).zip(&rims.boundary.edges).flat_map(|(i, e)| e.ends.map(|v| (v, i))).collect();
    at_vertex.sort_unstable();
    let along = Along { submesh, rims, places, at_vertex };
    on.iter().copied().filter(|on| along.has_partner(on)).collect()
}

struct Along<'r> {
    submesh: &'r Submesh,
    rims: &'r Rims<'r>,
    /// Vertices with the edges that they lie on, ascending.
    places: Vec<(u32, Vertex)>,
    /// The boundary edges at each vertex, ascending.
    at_vertex: Vec<(Vertex, u32)>,
}

impl Along<'_> {
    /// Does a boundary edge at the vertex run along the edge that it lies on?
    fn has_partner(&self, on: &OnEdge) -> bool {
        let Ok(place) = self.rims.boundary.edges.binary_search_by_key(&on.edge, |e| e.number) else { return false };
        let edge = &self.rims.boundary.edges[place];
        let from = self.at_vertex.partition_point(|(v, _)| *v < on.vertex);
        self.at_vertex[from..].iter().take_while(|(v, _)| *v == on.vertex).any(|(_, i)| {
            let other = &self.rims.boundary.edges[*i as usize];
            let next = if other.ends[0] == on.vertex { other.ends[1] } else { other.ends[0] };
            self.runs_along(edge, other, next).is_some_and(|apart| self.rims.may_join(edge, other, true, apart.max(on.distance)))
        })
    }

    /// How far the other end of an edge lies off, if it is on the edge, or near its end, or the end lies on it; and both run against each other.
    fn runs_along(&self, edge: &RimEdge, other: &RimEdge, next: Vertex) -> Option<f64> {
        let [a, b] = [edge, other].map(|e| self.submesh.vector(e.ends[0], e.ends[1]));
        if a.dot(b) >= 0.0 {
            return None;
        }
        if self.places.binary_search(&(edge.number, next)).is_ok() {
            let [p, q] = edge.ends.map(|v| self.submesh.positions[v as usize]);
            return Some(near::distance_to_line(self.submesh.positions[next as usize], p, q));
        }
        let reach = |v: Vertex| self.rims.reach[v as usize];
        let near_end = edge.ends.into_iter().map(|end| (self.submesh.distance(end, next), reach(end).min(reach(next))));
        if let Some((away, _)) = near_end.into_iter().find(|(away, reach)| away <= reach) {
            return Some(away);
        }
        edge.ends.into_iter().any(|end| self.places.binary_search(&(other.number, end)).is_ok()).then_some(0.0)
    }
}

/// Splits edges, as far as their triangles are high enough.
pub(crate) fn make(work: &mut Work<'_>, wanted: &[OnEdge]) -> Vec<Split> {
    let edges = work.take_edges();
    let mut made = Vec::new();
    for group in wanted.chunk_by(|a, b| a.edge == b.edge) {
        let edge = edges.get(group[0].edge as usize);
        let t = edge.uses[0].triangle();
        if !work.triangles[t as usize].alive {
            continue;
        }
        let stops = t_junctions::admissible(work, t, [edge.low, edge.high], group);
        let line: Vec<Vertex> = std::iter::once(edge.low).chain(stops.iter().copied()).chain([edge.high]).collect();
        made.extend(line.windows(3).map(|w| Split { edge: group[0].edge, at: [w[0], w[1], w[2]] }));
        degenerate::split(work, t, [edge.low, edge.high], &stops);
    }
    made
}

/// The splits neither of whose pieces is closed, ascending, by edge and vertex; `target`: where vertices went since.
pub(crate) fn idle(work: &mut Work<'_>, made: &[Split], target: Option<&[Vertex]>) -> Vec<(u32, Vertex)> {
    let now = |v: Vertex| target.map_or(v, |target| target[v as usize]);
    let (_, edges) = work.edges();
    let is_closed = |a: Vertex, b: Vertex| edges.between(now(a), now(b)).is_some_and(|e| e.uses.len() == 2);
    let mut idle: Vec<(u32, Vertex)> = made
        .iter()
        .filter(|split| !is_closed(split.at[0], split.at[1]) && !is_closed(split.at[1], split.at[2]))
        .map(|split| (split.edge, split.at[1]))
        .collect();
    idle.sort_unstable();
    idle
}
