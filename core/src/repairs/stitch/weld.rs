//! Merging of boundary vertices that lie within the weld tolerance of each other: connected components
//! of the graph of pairs within tolerance, bounded in extent.
//!
//! A merge that would leave a new non-manifold edge is taken back.

use crate::contract::report::RepairName;
use crate::contract::settings::Bodies;
use crate::geometry::distance::cosine;
use crate::repairs::shared::context::{Changes, Done, Repair};
use crate::repairs::shared::snapshot::Snapshot;
use crate::repairs::shared::work::Work;
use crate::submesh::edges::Edges;
use crate::submesh::near::{self, Tolerance};
use crate::submesh::{Submesh, Vertex};
use crate::topology::survey::Survey;
use crate::util::ids::NONE;

/// The words for it in a report.
pub(crate) const NOTE: &str = "boundary vertices within the weld tolerance, moved to the one with most triangles";

/// Boundary vertices within the weld tolerance become one.
pub(crate) const REPAIR: Repair = Repair {
    name: RepairName::ToleranceWeld,
    changes: Changes::Surface,
    run: |cx| {
        // The mesh as it came was looked at already.
        if cx.work.version() == 0 && cx.before.weldable_vertices == 0 {
            return Ok(Done::count(0, NOTE));
        }
        let welded = weld(cx.survey, &mut cx.work, cx.tolerance);
        if welded.taken_back > 0 {
            tracing::info!(clusters = welded.taken_back, "Welds taken back, since they made an edge of more than two triangles.");
        }
        Ok(Done::count(welded.vertices, NOTE))
    },
};

/// Counts of the weld.
#[derive(Debug, Default)]
pub(crate) struct Welded {
    pub(crate) vertices: u64,
    pub(crate) taken_back: u64,
}

/// How often clusters that made a defect are taken out and the rest tried again.
const ATTEMPTS: usize = 4;

/// Welds boundary vertices. O(n log n) in the boundary.
pub(crate) fn weld(survey: &Survey<'_>, work: &mut Work<'_>, tolerance: &Tolerance) -> Welded {
    let (submesh, edges) = work.edges();
    let pairs = near::close_pairs(submesh, edges, tolerance, survey.threads());
    weld_pairs(survey, work, &pairs, tolerance.weld)
}

/// Welds pairs of boundary vertices, smaller number first, sorted, which lie within `tolerance` of each other.
pub(crate) fn weld_pairs(survey: &Survey<'_>, work: &mut Work<'_>, pairs: &[(Vertex, Vertex)], tolerance: f64) -> Welded {
    let clusters = clusters(work, pairs, tolerance);
    weld_clusters(survey, work, clusters, Moves::Any).0
}

/// The fate of triangles whose corners move.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Moves {
    /// Anything: the way is shorter than any that counts.
    Any,
    /// They face the way they did, about.
    Steady,
}

/// A moved triangle's normal keeps at least this cosine to what it was.
pub(crate) const STEADY: f64 = 0.7;

/// Makes each of some sets of vertices one vertex, but for those that spoil something. Returns where each vertex went, if any did.
pub(crate) fn weld_clusters(
    survey: &Survey<'_>,
    work: &mut Work<'_>,
    mut clusters: Vec<Vec<Vertex>>,
    moves: Moves,
) -> (Welded, Option<Vec<Vertex>>) {
    let mut result = Welded::default();
    if clusters.is_empty() {
        return (result, None);
    }
    let edges = work.take_edges();
    let before = work.snapshot();
    for _ in 0..ATTEMPTS {
        if clusters.is_empty() {
            return (result, None);
        }
        let target = targets(work, &clusters);
        work.move_to(&target);
        crate::repairs::cleanup::duplicates::drop_repeated(work);
        work.relink();
        crate::repairs::cleanup::duplicates::drop_duplicates(survey, work, Bodies::Union);
        let mut bad = newly_nonmanifold(work.edges().1, &edges, &clusters, &target);
        if moves == Moves::Steady {
            spoiled(work, &before, &clusters, &mut bad);
        }
        if !bad.iter().any(|b| *b) {
            result.vertices = clusters.iter().map(|c| c.len() as u64 - 1).sum();
            return (result, Some(target));
        }
        work.restore(&before);
        result.taken_back += bad.iter().filter(|b| **b).count() as u64;
        let mut bad = bad.into_iter();
        clusters.retain(|_| !bad.next().unwrap_or(false));
    }
    (result, None)
}

/// Marks the clusters with a corner of a triangle that was turned over or flattened.
fn spoiled(submesh: &Submesh, before: &Snapshot, clusters: &[Vec<Vertex>], bad: &mut [bool]) {
    let of_vertex = of_vertices(submesh.positions.len(), clusters);
    let normal = |v: [Vertex; 3]| submesh.vector(v[0], v[1]).cross(submesh.vector(v[0], v[2]));
    let both = (0..before.len() as u32).map(|t| before.corners(t)).zip(&submesh.triangles);
    for (old, now) in both.filter(|(old, now)| now.alive && *old != now.v) {
        if cosine(normal(old), normal(now.v)) < STEADY {
            for v in old {
                if let Some(b) = bad.get_mut(of_vertex[v as usize] as usize) {
                    *b = true;
                }
            }
        }
    }
}

/// By vertex: the set that it is in, or [`NONE`].
fn of_vertices(vertices: usize, clusters: &[Vec<Vertex>]) -> Vec<u32> {
    let mut all = vec![NONE; vertices];
    for (i, cluster) in clusters.iter().enumerate() {
        cluster.iter().for_each(|v| all[*v as usize] = i as u32);
    }
    all
}

/// Connected components of the pairs. One wider than four tolerances is cut up greedily, in order of vertex number.
fn clusters(submesh: &Submesh, pairs: &[(Vertex, Vertex)], tolerance: f64) -> Vec<Vec<Vertex>> {
    let mut vertices: Vec<Vertex> = pairs.iter().flat_map(|(a, b)| [*a, *b]).collect();
    vertices.sort_unstable();
    vertices.dedup();
    let number = |v: Vertex| vertices.binary_search(&v).unwrap_or(0) as u32;
    let mut parents: Vec<u32> = (0..vertices.len() as u32).collect();
    for (a, b) in pairs {
        crate::util::union_find::unite(&mut parents, number(*a), number(*b));
    }
    let mut by_root: Vec<(u32, Vertex)> =
        (0..vertices.len() as u32).map(|i| (crate::util::union_find::find(&mut parents, i), vertices[i as usize])).collect();
    by_root.sort_unstable();
    let mut all = Vec::new();
    for group in by_root.chunk_by(|a, b| a.0 == b.0) {
        let mut rest: Vec<Vertex> = group.iter().map(|g| g.1).collect();
        while let Some(first) = rest.first().copied() {
            // A component that hangs together within the bound is taken whole: its first vertex then reaches all of it.
            let (near, far): (Vec<Vertex>, Vec<Vertex>) =
                rest.iter().partition(|v| submesh.distance(first, **v) <= 2.0 * tolerance);
            if near.len() > 1 && !share_a_triangle(submesh, &near) {
                all.push(near);
                rest = far;
            } else {
                rest.remove(0);
            }
        }
    }
    all.sort_unstable();
    all
}

/// Two of them are corners of one triangle, which would lose its area.
fn share_a_triangle(submesh: &Submesh, cluster: &[Vertex]) -> bool {
    cluster.iter().any(|v| {
        submesh
            .star(*v)
            .any(|(t, _)| submesh.triangles[t as usize].v.iter().filter(|w| cluster.binary_search(w).is_ok()).count() > 1)
    })
}

/// Where each vertex goes: to the one of its cluster with most triangles, the smallest of equals.
fn targets(submesh: &Submesh, clusters: &[Vec<Vertex>]) -> Vec<Vertex> {
    let mut target: Vec<Vertex> = (0..submesh.positions.len() as u32).collect();
    for cluster in clusters {
        let chosen = cluster.iter().copied().min_by_key(|v| (std::cmp::Reverse(submesh.star(*v).count()), *v)).unwrap_or(0);
        cluster.iter().for_each(|v| target[*v as usize] = chosen);
    }
    target
}

/// Clusters at an edge of more than two triangles that was not one before.
fn newly_nonmanifold(now: &Edges, before: &Edges, clusters: &[Vec<Vertex>], target: &[Vertex]) -> Vec<bool> {
    let cluster_of = of_vertices(target.len(), clusters);
    let mut old: Vec<(Vertex, Vertex)> = before
        .iter()
        .filter(|e| e.is_nonmanifold())
        .map(|e| (target[e.low as usize], target[e.high as usize]))
        .map(|(a, b)| (a.min(b), a.max(b)))
        .collect();
    old.sort_unstable();
    let mut bad = vec![false; clusters.len()];
    for edge in now.iter().filter(|e| e.is_nonmanifold()) {
        if old.binary_search(&(edge.low, edge.high)).is_err() {
            for v in [edge.low, edge.high] {
                if let Some(b) = bad.get_mut(cluster_of[v as usize] as usize) {
                    *b = true;
                }
            }
        }
    }
    bad
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Corners, after, cube, shifted};

    #[test]
    fn the_jittered_corners_of_a_soup_become_one_vertex_each() {
        // Each triangle a little elsewhere, within the tolerance of 1.7e-5: no two share a vertex.
        let soup: Vec<Corners> = cube().iter().zip(0u8..).flat_map(|(t, i)| shifted(&[*t], [f32::from(i) * 1e-6; 3])).collect();
        let got = after(&soup, |d, _| {
            assert_eq!(d.defects.vertices, 36);
            weld(&d.survey, &mut Work::new(&mut d.submesh), &d.tolerance)
        });
        assert_eq!((got.result.vertices, got.result.taken_back, got.defects.vertices), (28, 0, 8));
        assert!(got.verdict.good, "{:?}", got.verdict);
    }

    #[test]
    fn two_vertices_of_one_triangle_are_never_merged() {
        // The first triangle's short edge is bridged by other triangles' tips, each within reach of the next.
        let tip = |i: u8| {
            let (x, y) = (f32::from(i) / 4.0, 10.0 * f32::from(i));
            [[x, 0.0, 0.0], [x, y, 1.0], [x, y, 9.0]]
        };
        let mesh = [[[0.0; 3], [1.0, 0.0, 0.0], [0.0, -9.0, 0.0]], tip(1), tip(2), tip(3)];
        let got =
            after(&mesh, |d, _| weld(&d.survey, &mut Work::new(&mut d.submesh), &Tolerance { weld: 1.0, edge_share: 0.25 }));
        // Four in a row, but not the fifth: both ends of the edge are left.
        assert_eq!(got.result.vertices, 3);
        assert_eq!((got.defects.triangles, got.defects.degenerate_index), (4, 0));
    }

    #[test]
    fn a_weld_that_makes_an_edge_of_three_triangles_is_taken_back() {
        let (a, b) = ([0.0; 3], [1.0, 0.0, 0.0]);
        let near = |p: [f32; 3]| [p[0], p[1], 1e-6];
        let mesh = [[a, b, [0.0, 1.0, 0.0]], [b, a, [0.0, -1.0, 0.0]], [near(a), near(b), [0.0, 0.0, 1.0]]];
        let got = after(&mesh, |d, _| weld(&d.survey, &mut Work::new(&mut d.submesh), &d.tolerance));
        assert_eq!((got.result.vertices, got.result.taken_back), (0, 2));
        assert_eq!((got.defects.nonmanifold_edges, got.untouched), (0, 3));
    }
}
