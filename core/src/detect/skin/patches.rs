//! Patches that a person would have closed the hole with, too.

use glam::DVec3;

use crate::contract::report::RepairName;
use crate::geometry::flatness;
use crate::submesh::components::Components;
use crate::submesh::{Origin, Submesh, Vertex};
use crate::topology::survey::Survey;
use crate::util::ids::NONE;
use crate::util::union_find::{find, unite};

/// A patch of this share of its body's area is small against it.
const SMALL: f64 = 0.02;

/// A patch of this share of its body's area closes a hole. A larger one closes a mouth, and what is seen through that is meant to be.
const HOLE: f64 = 0.01;

/// Triangles of patches, ascending.
pub(super) struct Patches {
    /// Those that lie in a plane, up to a reach, are small against their body, or are explained.
    pub(super) plausible: Vec<u32>,
    /// Triangles of patches that close holes.
    pub(super) holes: Vec<u32>,
}

/// Of all patches which are plausible, and which close holes. A patch is explained if some triangle of it is among the `explained` ones.
/// O(n log n) in the triangles of patches.
pub(super) fn judged(survey: &Survey<'_>, submesh: &Submesh, pieces: &Components, explained: &[u32], reach: f64) -> Patches {
    let is_of_patch = |t: &u32| submesh.triangles[*t as usize].origin == Origin::Added(RepairName::Fill);
    let all: Vec<u32> = submesh.living().filter(is_of_patch).collect();
    let (mut plausible, mut holes) = (Vec::new(), Vec::new());
    for patch in patches(submesh, &all) {
        let twice: i128 = patch.iter().map(|t| survey.measure.triangle(&submesh.points(*t)).area).sum();
        let piece = pieces.of_triangle[patch[0] as usize];
        let of_body = if piece == NONE { 0 } else { pieces.list[piece as usize].extent.area };
        let share = survey.measure.area_of(twice) / survey.measure.area_of(of_body);
        if share <= HOLE {
            holes.extend(&patch);
        }
        let is_explained = patch.iter().any(|t| explained.binary_search(t).is_ok());
        if share <= SMALL || is_explained || is_flat(submesh, &patch, reach) {
            plausible.extend(patch);
        }
    }
    plausible.sort_unstable();
    holes.sort_unstable();
    Patches { plausible, holes }
}

/// Triangles that hang together through edges.
fn patches(submesh: &Submesh, all: &[u32]) -> Vec<Vec<u32>> {
    let mut halves: Vec<([Vertex; 2], u32)> = Vec::with_capacity(3 * all.len());
    for (i, t) in (0..).zip(all) {
        let v = submesh.triangles[*t as usize].v;
        halves.extend((0..3).map(|k| ([v[k].min(v[(k + 1) % 3]), v[k].max(v[(k + 1) % 3])], i)));
    }
    halves.sort_unstable();
    let mut parents: Vec<u32> = (0..all.len() as u32).collect();
    for edge in halves.chunk_by(|a, b| a.0 == b.0) {
        edge.iter().for_each(|(_, i)| {
            unite(&mut parents, edge[0].1, *i);
        });
    }
    let mut patches = vec![Vec::new(); all.len()];
    (0..).zip(all).for_each(|(i, t)| patches[find(&mut parents, i) as usize].push(*t));
    patches.retain(|patch| !patch.is_empty());
    patches
}

/// Do all vertices lie within `reach` of a plane across the mean normal, or as near as a rim does that was cut by hand?
fn is_flat(submesh: &Submesh, patch: &[u32], reach: f64) -> bool {
    let corners = |t: &u32| submesh.triangles[*t as usize].v.map(|v| submesh.place(v));
    let normal: DVec3 = patch.iter().map(corners).map(|[a, b, c]| (b - a).cross(c - a)).sum();
    let height = flatness::height(patch.iter().flat_map(corners), normal);
    height <= 2.0 * reach || !flatness::is_ragged(height, normal.length() / 2.0)
}
