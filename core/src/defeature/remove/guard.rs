//! Tests of an edit before it is made.

use super::super::mesh::{Mesh, next};
use super::super::reason::Reason;
use super::plan::Edit;
use std::collections::BTreeMap;

/// Triangles around one vertex that are looked at.
const MOST_AROUND: usize = 1 << 16;

/// Whether an edit closes the mesh again: each new edge is shared by two new triangles and by no triangle that stays, or runs
/// along what was removed. O(n log n) in the edit.
pub(crate) fn closes(mesh: &Mesh, edit: &Edit, star: &[u32]) -> Result<(), Reason> {
    let removed = |t: u32| edit.removed.binary_search(&t).is_ok();
    let mut balance: BTreeMap<(u32, u32), [i32; 2]> = BTreeMap::new();
    let mut count = |a: u32, b: u32, step: i32| {
        let entry = balance.entry((a.min(b), a.max(b))).or_default();
        entry[usize::from(a > b)] += step;
    };
    for [a, b, c] in &edit.triangles {
        count(*a, *b, 1);
        count(*b, *c, 1);
        count(*c, *a, 1);
    }
    for half in edit.removed.iter().flat_map(|t| 3 * t..3 * t + 3) {
        if !removed(mesh.across(half)) {
            count(mesh.to(half), mesh.from(half), 1);
        }
    }
    for ((a, b), [up, down]) in &balance {
        if *up != 1 || *down != 1 {
            return Err(if up == down { Reason::NotManifold } else { Reason::Open });
        }
        let is_old = (*a as usize) < mesh.points.len() && (*b as usize) < mesh.points.len();
        if is_old && stays_elsewhere(mesh, star, (*a, *b), &removed) {
            return Err(Reason::NotManifold);
        }
    }
    Ok(())
}

/// Whether an edge between old vertices belongs to two triangles that stay.
fn stays_elsewhere(mesh: &Mesh, star: &[u32], (a, b): (u32, u32), removed: &impl Fn(u32) -> bool) -> bool {
    let Some(&first) = star.get(a as usize).filter(|half| **half != u32::MAX) else { return false };
    let mut half = first;
    for _ in 0..MOST_AROUND {
        if mesh.to(half) == b {
            return !removed(half / 3) && !removed(mesh.across(half));
        }
        half = next(mesh.twin[half as usize]);
        if half == first {
            break;
        }
    }
    false
}

/// A half-edge that begins at each vertex.
pub(crate) fn star(mesh: &Mesh) -> Vec<u32> {
    let mut star = vec![u32::MAX; mesh.points.len()];
    for half in (0..mesh.triangles.len() as u32 * 3).rev() {
        star[mesh.from(half) as usize] = half;
    }
    star
}
