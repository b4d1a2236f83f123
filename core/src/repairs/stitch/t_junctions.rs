//! Non-common vertices (T-junctions): the triangle whose edge a vertex lies on is split there, which keeps every position.

use crate::contract::report::RepairName;
use crate::repairs::cleanup::degenerate;
use crate::repairs::shared::context::{Changes, Done, Repair};
use crate::repairs::shared::work::Work;
use crate::submesh::Submesh;
use crate::submesh::near::{self, OnEdge, Tolerance};

/// T-junctions.
pub(crate) const REPAIR: Repair = Repair {
    name: RepairName::TJunction,
    changes: Changes::Surface,
    run: |cx| {
        let split = split_edges(&mut cx.work, cx.tolerance, cx.survey.threads());
        Ok(Done::count(split, "vertices inside a neighbour's edge, which was split there"))
    },
};

/// Splits boundary edges at the vertices that lie on them; returns how many vertices that were.
pub(crate) fn split_edges(work: &mut Work<'_>, tolerance: &Tolerance, threads: usize) -> u64 {
    let (submesh, edges) = work.edges();
    let on = near::noncommon_vertices(submesh, edges, tolerance, threads);
    if on.is_empty() {
        return 0;
    }
    let edges = work.take_edges();
    let mut count = 0;
    for group in on.chunk_by(|a, b| a.edge == b.edge) {
        let edge = edges.get(group[0].edge as usize);
        let t = edge.uses[0].triangle();
        if !work.triangles[t as usize].alive {
            continue;
        }
        let stops: Vec<u32> = admissible(work, t, [edge.low, edge.high], group);
        count += stops.len() as u64;
        degenerate::split(work, t, [edge.low, edge.high], &stops);
    }
    count
}

/// The vertices that may be joined to the opposite corner: the triangle is high enough not to be turned over, and the new edge
/// does not exist yet.
pub(crate) fn admissible(submesh: &Submesh, t: u32, ends: [u32; 2], group: &[OnEdge]) -> Vec<u32> {
    let Some(apex) = submesh.triangles[t as usize].v.into_iter().find(|v| !ends.contains(v)) else { return Vec::new() };
    let height = near::distance_to_line(
        submesh.positions[apex as usize],
        submesh.positions[ends[0] as usize],
        submesh.positions[ends[1] as usize],
    );
    let mut stops: Vec<u32> = Vec::new();
    let mut last_at = f64::NEG_INFINITY;
    for on in group {
        if on.distance * 4.0 < height && on.at > last_at && !submesh.has_edge(on.vertex, apex) {
            stops.push(on.vertex);
            last_at = on.at;
        }
    }
    stops
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{after, cube};

    #[test]
    fn a_vertex_in_the_middle_of_a_neighbours_edge_splits_the_neighbour() {
        let mut mesh = cube();
        let [a, b, c] = mesh.remove(0);
        let m = [0, 1, 2].map(|k| (a[k] + c[k]) / 2.0);
        mesh.extend([[a, b, m], [m, b, c]]);
        let got = after(&mesh, |d, _| {
            assert_eq!((d.defects.boundary_edges, d.defects.noncommon_vertices), (3, 1));
            split_edges(&mut Work::new(&mut d.submesh), &d.tolerance, 2)
        });
        // No vertex moved: only the neighbour is replaced.
        assert_eq!((got.result, got.untouched, got.defects.triangles), (1, 12, 14));
        assert!(got.verdict.good, "{:?}", got.verdict);
    }
}
