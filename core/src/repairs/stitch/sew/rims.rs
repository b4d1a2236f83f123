//! Which boundary edges run along each other.
//!
//! Two boundary edges may be the two sides of a crack if both ends lie within reach of each other, by the width of the step and a share of the
//! shortest edges there, and
//!
//! * they run against each other, as they do where a surface goes on. Without that, a tenth of the reach must do: one of the two is
//!   turned over;
//! * their triangles part: where they end in about the same direction, as the two skins of a thin wall do, they lead away from the edge by
//!   much more than they lie apart now, as at the edge of a wedge;
//! * beyond the first step, half of each rim is matched, by length: surfaces that come near each other with a part of their rims only may stand
//!   side by side;
//! * not both belong to bodies with holes, unless to the same one or within the first step: there may be a clearance between them. A body
//!   with holes has more area than a flat piece can have within a rim as long as all of its rims together (the isoperimetric inequality). For
//!   edges that do not run against each other, as those of the two walls of a clearance, within each rim for itself.

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::sync::Arc;

use glam::DVec3;

use crate::geometry::boxes::BoxTree;
use crate::geometry::distance::cosine;
use crate::geometry::sums::Bounds;
use crate::repairs::shared::work::Work;
use crate::submesh::components::Components;
use crate::submesh::edges::{Edge, Edges};
use crate::submesh::near::{Tolerance, around, boundary_vertices};
use crate::submesh::{Submesh, Vertex};
use crate::topology::survey::Survey;
use crate::util::{parallel, union_find};

/// Less evidence, less reach.
const UNSURE: f64 = 0.1;

/// Triangles that end in directions with a larger cosine than this must part.
const ALIKE: f64 = 0.5;

/// So many times as far as they lie apart.
const PART: f64 = 4.0;

/// So much of a rim must be matched, beyond the first step.
const HALF: f64 = 0.5;

/// An edge with more others within reach is in a tangle that nothing is known of.
const MOST: usize = 64;

/// How wide a step is.
pub(crate) struct Width {
    pub(crate) tolerance: Tolerance,
    /// No clearance between bodies is as narrow.
    pub(crate) is_crack: bool,
}

/// A boundary edge, as its triangle runs through it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RimEdge {
    pub(crate) ends: [Vertex; 2],
    pub(crate) triangle: u32,
    /// Its number in [`Edges`].
    pub(crate) number: u32,
    /// From it to the opposite corner, square to it.
    inward: DVec3,
}

/// Two that are to become one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Match {
    /// How far their ends lie apart, at most.
    pub(crate) width: f64,
    /// By place in [`Boundary::edges`].
    pub(crate) edges: [u32; 2],
    /// They run against each other.
    pub(crate) against: bool,
}

/// All boundary edges of a mesh, with what it takes to judge them at any width.
pub(crate) struct Boundary {
    pub(crate) edges: Vec<RimEdge>,
    /// Their ends, ascending.
    pub(crate) vertices: Vec<Vertex>,
    /// By place in `vertices`: the length of the shortest edge there.
    shortest: Vec<f64>,
    components: Arc<Components>,
    /// By edge: a vertex of all of its rim.
    of_rim: Vec<Vertex>,
    /// By component: a body with holes, by all rims together, and by each.
    is_body: Vec<[bool; 2]>,
    /// Of the middles of the edges.
    middles: BoxTree,
}

impl Boundary {
    /// O(n log n) in the boundary, and a few looks at the submesh.
    pub(crate) fn of(survey: &Survey<'_>, work: &mut Work<'_>) -> Self {
        let components = work.components(survey);
        let (submesh, edges) = work.edges();
        let rim_edge = |(edge, number): (Edge<'_>, u32)| {
            let (ends, triangle): ([Vertex; 2], u32) = (edge.directed(&edge.uses[0]).into(), edge.uses[0].triangle());
            RimEdge { ends, triangle, number, inward: inward(submesh, triangle, ends) }
        };
        let mut all: Vec<RimEdge> = Vec::with_capacity(edges.iter().filter(Edge::is_boundary).count());
        all.extend(edges.iter().zip(0..).filter(|(e, _)| e.is_boundary()).map(rim_edge));
        let vertices = boundary_vertices(edges);
        let middles = || BoxTree::new(&all.iter().map(|e| middle(submesh, e.ends, 0.0)).collect::<Vec<_>>());
        let rims = || {
            let rim_of = by_vertex(submesh, edges);
            let of_rim = all.iter().map(|e| rim_of[e.ends[0] as usize]).collect();
            (of_rim, bodies(survey, submesh, edges, &components, &rim_of))
        };
        let (middles, (of_rim, is_body)) = parallel::both(survey.threads(), middles, rims);
        let shortest = vertices.iter().map(|v| submesh.shortest_edge(*v)).collect();
        Self { edges: all, vertices, shortest, components, of_rim, is_body, middles }
    }
}

/// Boundary edges at a width.
pub(crate) struct Rims<'b> {
    pub(crate) boundary: &'b Boundary,
    /// By vertex: within which distance it may find its partner. 0 but for ends of edges that take part.
    pub(crate) reach: Vec<f64>,
    /// By edge: it stays open. Empty if none does.
    stays_open: Vec<bool>,
    is_crack: bool,
}

impl<'b> Rims<'b> {
    /// Without the edges that have both ends among `left_open` (ascending).
    pub(crate) fn of(boundary: &'b Boundary, submesh: &Submesh, width: &Width, left_open: &[Vertex]) -> Self {
        let is_left = |e: &RimEdge| e.ends.iter().all(|v| left_open.binary_search(v).is_ok());
        let stays_open = if left_open.is_empty() { Vec::new() } else { boundary.edges.iter().map(is_left).collect() };
        let mut reach = vec![0.0; submesh.positions.len()];
        let Tolerance { weld, edge_share } = width.tolerance;
        let at = |place: usize| weld.min(boundary.shortest[place] * edge_share);
        if stays_open.is_empty() {
            boundary.vertices.iter().enumerate().for_each(|(place, v)| reach[*v as usize] = at(place));
        } else {
            let taking_part = boundary.edges.iter().zip(&stays_open).filter(|(_, stays)| !**stays);
            for v in taking_part.flat_map(|(e, _)| e.ends) {
                reach[v as usize] = boundary.vertices.binary_search(&v).map_or(0.0, at);
            }
        }
        Self { boundary, reach, stays_open, is_crack: width.is_crack }
    }

    fn takes_part(&self, edge: u32) -> bool {
        self.stays_open.get(edge as usize) != Some(&true)
    }

    /// Leaves out the matches on rims of which less than half is used; says if there were any.
    pub(crate) fn drop_poor(&self, submesh: &Submesh, is_used: &[bool], matches: &mut Vec<Match>) -> bool {
        if self.is_crack {
            return false;
        }
        let mut shares: BTreeMap<Vertex, [f64; 2]> = BTreeMap::new();
        let Boundary { edges, of_rim, .. } = self.boundary;
        for i in (0..edges.len()).filter(|i| self.takes_part(*i as u32)) {
            let length = submesh.distance(edges[i].ends[0], edges[i].ends[1]);
            let [used, all] = shares.entry(of_rim[i]).or_default();
            *used += if is_used[i] { length } else { 0.0 };
            *all += length;
        }
        let is_poor = |i: u32| shares.get(&of_rim[i as usize]).is_some_and(|[used, all]| *used > 0.0 && used / all < HALF);
        let before = matches.len();
        matches.retain(|m| !m.edges.iter().any(|i| is_poor(*i)));
        matches.len() < before
    }

    /// May these two edges, which run against each other or not, become one, if their ends lie so far apart?
    pub(crate) fn may_join(&self, a: &RimEdge, b: &RimEdge, against: bool, apart: f64) -> bool {
        let alike = cosine(a.inward, b.inward);
        let parts = alike <= ALIKE || {
            let height = a.inward.length().min(b.inward.length());
            height * (1.0 - alike * alike).max(0.0).sqrt() >= PART * apart
        };
        let [of_a, of_b] = [a, b].map(|e| self.boundary.components.of_triangle[e.triangle as usize]);
        let body = |c: u32| self.boundary.is_body.get(c as usize).is_some_and(|is| is[usize::from(!against)]);
        parts && a.triangle != b.triangle && (self.is_crack || of_a == of_b || !body(of_a) || !body(of_b))
    }

    /// How far the ends of two edges lie apart, if they are within reach of each other.
    fn apart(&self, submesh: &Submesh, a: [Vertex; 2], b: [Vertex; 2], share: f64) -> Option<f64> {
        let mut most = 0.0f64;
        for (v, w) in [(a[0], b[0]), (a[1], b[1])] {
            let away = submesh.distance(v, w);
            if away > share * self.reach[v as usize].min(self.reach[w as usize]) {
                return None;
            }
            most = most.max(away);
        }
        Some(most)
    }

    /// All that may be matched, the nearest first.
    pub(crate) fn matches(&self, submesh: &Submesh, threads: usize) -> Vec<Match> {
        let mut all = parallel::gather(threads, &self.boundary.edges, |near, (i, edge), all| {
            let (i, reach) = (i as u32, edge.ends.map(|v| self.reach[v as usize]));
            self.boundary.middles.meeting(&middle(submesh, edge.ends, reach[0].min(reach[1])), near);
            near.retain(|j| *j > i && self.takes_part(*j));
            if self.takes_part(i) && near.len() <= MOST {
                all.extend(near.iter().filter_map(|j| self.matching(submesh, [i, *j])));
            }
        });
        all.sort_by(|a: &Match, b| a.width.total_cmp(&b.width).then(a.edges.cmp(&b.edges)));
        all
    }

    fn matching(&self, submesh: &Submesh, edges: [u32; 2]) -> Option<Match> {
        let [a, b] = edges.map(|i| &self.boundary.edges[i as usize]);
        let [from, to] = b.ends;
        let (width, against) = match self.apart(submesh, a.ends, [to, from], 1.0) {
            Some(width) => (width, true),
            None => (self.apart(submesh, a.ends, [from, to], UNSURE)?, false),
        };
        self.may_join(a, b, against, width).then_some(Match { width, edges, against })
    }
}

/// By vertex: one of all that hang together with it by boundary edges.
fn by_vertex(submesh: &Submesh, edges: &Edges) -> Vec<Vertex> {
    let mut parents: Vec<Vertex> = (0..submesh.positions.len() as u32).collect();
    for edge in edges.iter().filter(Edge::is_boundary) {
        union_find::unite(&mut parents, edge.low, edge.high);
    }
    (0..parents.len() as u32).map(|v| union_find::find(&mut parents, v)).collect()
}

/// Which components are bodies with holes, by all rims together and by each.
fn bodies(survey: &Survey<'_>, submesh: &Submesh, edges: &Edges, components: &Components, rim_of: &[Vertex]) -> Vec<[bool; 2]> {
    let rims = edges.iter().filter(|e| e.is_boundary());
    let of = |e: &Edge<'_>| components.of_triangle[e.uses[0].triangle() as usize];
    let mut lengths: Vec<(u32, u32, f64)> =
        rims.map(|e| (of(&e), rim_of[e.low as usize], submesh.distance(e.low, e.high))).collect();
    lengths.sort_by(|a, b| (a.0, a.1).cmp(&(b.0, b.1)).then(a.2.total_cmp(&b.2)));
    let disc = |perimeter: f64| perimeter * perimeter / (4.0 * PI);
    let sum = |rim: &[(u32, u32, f64)]| rim.iter().map(|(_, _, length)| length).sum::<f64>();
    let mut all = vec![[false; 2]; components.list.len()];
    for own in lengths.chunk_by(|a, b| a.0 == b.0) {
        if let Some(component) = components.list.get(own[0].0 as usize) {
            let area = survey.measure.area_of(component.extent.area);
            let each: f64 = own.chunk_by(|a, b| a.1 == b.1).map(|rim| disc(sum(rim))).sum();
            all[own[0].0 as usize] = [area > disc(sum(own)), area > each];
        }
    }
    all
}

/// From an edge of a triangle to its opposite corner, square to the edge.
fn inward(submesh: &Submesh, triangle: u32, [from, to]: [Vertex; 2]) -> DVec3 {
    let apex = submesh.triangles[triangle as usize].v.into_iter().find(|v| ![from, to].contains(v)).unwrap_or(from);
    let (along, to_apex) = (submesh.vector(from, to), submesh.vector(from, apex));
    to_apex - along * (to_apex.dot(along) / along.dot(along).max(f64::MIN_POSITIVE))
}

/// The box around the middle of an edge.
fn middle(submesh: &Submesh, [a, b]: [Vertex; 2], by: f64) -> Bounds {
    let middle = (submesh.place(a) + submesh.place(b)) / 2.0;
    around(&[[middle.x as f32, middle.y as f32, middle.z as f32]], by)
}
