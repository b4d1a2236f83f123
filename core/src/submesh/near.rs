//! What lies near the boundary: vertices that should be one, and vertices inside another triangle's edge.

use super::crowds::{Crowds, Member};
use super::edges::{Edge, Edges};
use super::{Submesh, Vertex, distance};
use crate::geometry::boxes::BoxTree;
pub(crate) use crate::geometry::distance::Tolerance;
use crate::geometry::distance::{place, share_along};
use crate::geometry::sums::Bounds;
use crate::util::each::Each;
use crate::util::{parallel, steps};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

impl Tolerance {
    /// The tolerance at `v`.
    pub(crate) fn at(&self, submesh: &Submesh, v: Vertex) -> f64 {
        self.weld.min(submesh.shortest_edge(v) * self.edge_share)
    }
}

/// Ends of boundary edges, ascending.
pub(crate) fn boundary_vertices(edges: &Edges) -> Vec<Vertex> {
    let mut all: Vec<Vertex> = edges.iter().filter(|e| e.is_boundary()).flat_map(|e| [e.low, e.high]).collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// Pairs of boundary vertices, smaller number first, within the tolerance that holds at both; sorted. Vertices joined by an edge
/// are never within it. Of a crowd, whose vertices are all within the tolerance of each other, only as many pairs as connect it, and one with each
/// crowd that it is near to: so many vertices at one place take as many pairs, not their square.
pub(crate) fn close_pairs(submesh: &Submesh, edges: &Edges, tolerance: &Tolerance, threads: usize) -> Vec<(Vertex, Vertex)> {
    let vertices = boundary_vertices(edges);
    if vertices.is_empty() || tolerance.weld <= 0.0 {
        return Vec::new();
    }
    let crowds = Crowds::of(submesh, &vertices, |v| tolerance.at(submesh, v), threads);
    let tree = BoxTree::by(threads, &crowds.all.iter().map(|crowd| crowd.bounds).collect::<Vec<_>>());
    let mut pairs = parallel::gather(threads, &crowds.all, |met, (_, crowd), pairs| {
        pairs.extend(crowds.members(&crowd).windows(2).map(|two| (two[0].vertex, two[1].vertex)));
        tree.meeting(&wider(&crowd.bounds, crowd.most), met);
        steps::count(met.len() + crowd.count as usize);
        // Of two crowds, the one that reaches less far looks for the other.
        let others = met.iter().map(|j| &crowds.all[*j as usize]);
        let others = others.filter(|other| (crowd.least, crowd.first) < (other.least, other.first));
        pairs.extend(others.filter_map(|other| crowds.pair_of(submesh, &crowd, other)));
    });
    pairs.sort_unstable();
    pairs
}

/// For each of some vertices the nearest of the others within both reaches that it shares no triangle with, by place in `vertices`;
/// of equally near ones the first.
pub(crate) fn nearest_apart(submesh: &Submesh, vertices: &[Vertex], reach: &[f64]) -> Vec<Option<usize>> {
    let boxes: Vec<Bounds> = vertices.iter().map(|v| around(&[submesh.positions[*v as usize]], 0.0)).collect();
    if boxes.is_empty() {
        return Vec::new();
    }
    let tree = BoxTree::new(&boxes);
    let mut found = Vec::new();
    let mut nearest = Vec::with_capacity(vertices.len());
    for (i, v) in vertices.iter().enumerate() {
        tree.meeting(&around(&[submesh.positions[*v as usize]], reach[i]), &mut found);
        let mut best: Option<(f64, usize)> = None;
        for j in found.iter().map(|j| *j as usize).filter(|j| *j != i) {
            let away = submesh.distance(*v, vertices[j]);
            if away <= reach[i].min(reach[j]) && best.is_none_or(|(d, _)| away < d) && !submesh.has_edge(*v, vertices[j]) {
                best = Some((away, j));
            }
        }
        nearest.push(best.map(|(_, j)| j));
    }
    nearest
}

/// Boundary vertices within tolerance of another one.
pub(crate) fn weldable_vertices(submesh: &Submesh, edges: &Edges, tolerance: &Tolerance, threads: usize) -> Vec<Vertex> {
    let mut all: Vec<Vertex> = close_pairs(submesh, edges, tolerance, threads).into_iter().flat_map(|(a, b)| [a, b]).collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// A boundary vertex inside a boundary edge of another triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct OnEdge {
    /// Number of the edge in [`Edges`].
    pub(crate) edge: u32,
    /// Where on it, from its low end: 0 to 1.
    pub(crate) at: f64,
    pub(crate) vertex: Vertex,
    pub(crate) distance: f64,
}

/// Every boundary vertex that lies within its reach of the inside of a boundary edge whose triangle it does not belong to, with its nearest
/// such edge, by edge and place on it.
pub(crate) fn on_edges(submesh: &Submesh, edges: &Edges, reach: impl Fn(Vertex) -> f64 + Sync, threads: usize) -> Vec<OnEdge> {
    let boundary: Vec<u32> = (0..edges.len() as u32).filter(|i| edges.get(*i as usize).is_boundary()).collect();
    if boundary.is_empty() {
        return Vec::new();
    }
    let ends = |i: u32| {
        let e = edges.get(i as usize);
        [submesh.positions[e.low as usize], submesh.positions[e.high as usize]]
    };
    let tree = BoxTree::by(threads, &boundary.iter().map(|i| around(&ends(*i), 0.0)).collect::<Vec<_>>());
    let crowds = Crowds::of(submesh, &boundary_vertices(edges), reach, threads);
    let mut all = parallel::gather(threads, &crowds.all, |met: &mut Vec<u32>, (_, crowd), all| {
        tree.meeting(&wider(&crowd.bounds, crowd.most), met);
        steps::count(met.len());
        met.iter_mut().for_each(|i| *i = boundary[*i as usize]);
        if crowd.count > 1 {
            met.retain(|edge| crowd.may_have_one_on(ends(*edge)));
        }
        for Member { vertex, reach } in crowds.members(&crowd) {
            all.extend(nearest_of(submesh, edges, met, *vertex, *reach));
        }
    });
    all.sort_by(|a: &OnEdge, b| a.edge.cmp(&b.edge).then(a.at.total_cmp(&b.at)).then(a.vertex.cmp(&b.vertex)));
    all
}

/// The nearest of some boundary edges that a vertex is on, if it is on one.
pub(super) fn nearest_of(submesh: &Submesh, edges: &Edges, of: &[u32], vertex: Vertex, tolerance: f64) -> Option<OnEdge> {
    let p = submesh.positions[vertex as usize];
    let mut nearest: Option<OnEdge> = None;
    steps::count(of.len());
    for edge in of {
        let e = edges.get(*edge as usize);
        if submesh.triangles[e.uses[0].triangle() as usize].v.contains(&vertex) {
            continue;
        }
        let [a, b] = [e.low, e.high].each(|v| submesh.positions[v as usize]);
        let (at, off) = project(p, a, b);
        let length = distance(a, b);
        // Strictly inside, by more than the tolerance: what is nearer to an end is a matter of welding.
        let inside = at * length > tolerance && (1.0 - at) * length > tolerance;
        if inside && off <= tolerance && nearest.is_none_or(|n| off < n.distance) {
            nearest = Some(OnEdge { edge: *edge, at, vertex, distance: off });
        }
    }
    nearest
}

/// Boundary vertices inside a boundary edge of another triangle (T-junctions), with their edges.
pub(crate) fn noncommon_vertices(submesh: &Submesh, edges: &Edges, tolerance: &Tolerance, threads: usize) -> Vec<OnEdge> {
    on_edges(submesh, edges, |v| tolerance.at(submesh, v), threads)
}

/// How near a boundary vertex comes to a boundary edge of a triangle that it does not belong to, at least, of those that are within the
/// tolerance; infinite if none is. Below, there is no weldable vertex and none on an edge.
pub(crate) fn nearest_edge(submesh: &Submesh, edges: &Edges, tolerance: &Tolerance, threads: usize) -> f64 {
    let boundary: Vec<Edge<'_>> = edges.iter().filter(|e| e.is_boundary()).collect();
    if boundary.is_empty() {
        return f64::INFINITY;
    }
    let ends = |e: &Edge<'_>| [e.low, e.high].each(|v| submesh.positions[v as usize]);
    let tree = BoxTree::by(threads, &boundary.iter().map(|e| around(&ends(e), 0.0)).collect::<Vec<_>>());
    // Distances are not negative, so that their bits are in their order.
    let nearest = AtomicU64::new(f64::INFINITY.to_bits());
    let known = || f64::from_bits(nearest.load(Relaxed));
    parallel::gather(threads, &boundary_vertices(edges), |_, (_, v), _: &mut Vec<()>| {
        if known() <= 0.0 {
            return;
        }
        let (p, reach) = (submesh.positions[v as usize], tolerance.at(submesh, v).min(known()));
        tree.each_meeting(&around(&[p], reach), |i| {
            let edge = &boundary[i as usize];
            if !submesh.triangles[edge.uses[0].triangle() as usize].v.contains(&v) {
                let [a, b] = ends(edge);
                let away = distance_to_line(p, a, b);
                // What is as near as the tolerance may be farther by rounding.
                if away * ALMOST <= reach {
                    nearest.fetch_min((away * ALMOST).to_bits(), Relaxed);
                }
            }
        });
    });
    known()
}

/// Less than rounding makes of a distance.
const ALMOST: f64 = 1.0 - 1e-9;

/// Foot of `p` on the line a–b as a fraction from a, clamped to the segment, and its distance. 0 for an edge of no length.
fn project(p: [f32; 3], a: [f32; 3], b: [f32; 3]) -> (f64, f64) {
    let [p, a, b] = [p, a, b].each(place);
    let at = share_along(p, a, b);
    (at, (p - a - (b - a) * at).length())
}

/// Distance of `p` from the segment a–b.
pub(crate) fn distance_to_line(p: [f32; 3], a: [f32; 3], b: [f32; 3]) -> f64 {
    project(p, a, b).1
}

/// The box around some points, wider by `by` on all sides.
pub(crate) fn around(points: &[[f32; 3]], by: f64) -> Bounds {
    wider(&Bounds::of(points), by)
}

/// A box, wider by `by` on all sides.
fn wider(b: &Bounds, by: f64) -> Bounds {
    // Rounded outward, so that nothing is missed.
    Bounds {
        lo: b.lo.each(|x| ((f64::from(x) - by) as f32).next_down()),
        hi: b.hi.each(|x| ((f64::from(x) + by) as f32).next_up()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Corners, diagnose, records};

    /// A large triangle with its long edge on the x axis from 0 to 10, below it.
    const BELOW: Corners = [[0.0; 3], [5.0, -10.0, 0.0], [10.0, 0.0, 0.0]];

    fn on_edge(tip: [f32; 3], weld: f64) -> Vec<OnEdge> {
        let records = records(&[BELOW, [tip, [12.0, 10.0, 0.0], [-2.0, 10.0, 0.0]]]);
        let d = diagnose(&records);
        noncommon_vertices(&d.submesh, &Edges::of(&d.submesh), &Tolerance { weld, edge_share: 0.25 }, 2)
    }

    #[test]
    fn the_nearest_edge_is_told_within_the_tolerance() {
        let nearest = |tip: f32, weld: f64| {
            let records = records(&[BELOW, [[3.0, tip, 0.0], [12.0, 10.0, 0.0], [-2.0, 10.0, 0.0]]]);
            let d = diagnose(&records);
            nearest_edge(&d.submesh, &Edges::of(&d.submesh), &Tolerance { weld, edge_share: 0.25 }, 2)
        };
        assert!((nearest(0.5, 1.0) - 0.5).abs() < 1e-6);
        assert!((nearest(0.5, 0.5) - 0.5).abs() < 1e-6, "as near as the tolerance");
        assert_eq!(nearest(0.5, 0.4), f64::INFINITY);
        // A quarter of the shortest edge there.
        assert_eq!(nearest(4.0, 9.0), f64::INFINITY);
    }

    #[test]
    fn a_vertex_near_the_inside_of_an_edge_is_on_it() {
        let found = on_edge([2.5, 0.5, 0.0], 0.5);
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].at, found[0].distance), (0.25, 0.5));
        assert!(on_edge([2.5, 0.5, 0.0], 0.4).is_empty(), "too far");
        assert!(on_edge([0.4, 0.0, 0.0], 0.5).is_empty(), "so near to the end, it is a matter of welding");
    }

    #[test]
    fn vertices_are_close_by_the_tolerance_and_by_the_edges_around() {
        let pairs = |size: f32, weld: f64| {
            let small: Corners = [[0.0, 0.1, 0.0], [-size, size, 0.0], [0.0, size, 0.0]];
            let records = records(&[BELOW, small]);
            let d = diagnose(&records);
            close_pairs(&d.submesh, &Edges::of(&d.submesh), &Tolerance { weld, edge_share: 0.25 }, 2).len()
        };
        assert_eq!(pairs(5.0, 0.2), 1);
        assert_eq!(pairs(5.0, 0.05), 0, "beyond the tolerance");
        assert_eq!(pairs(0.3, 0.2), 0, "a small feature is not welded away: its edges are 0.2 long");
        assert_eq!(pairs(5.0, 0.0), 0, "switched off");
    }
}
