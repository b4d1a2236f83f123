//! Boundary loops of sets of triangles.

use super::mesh::{Mesh, next};

/// The half-edges inside a set whose other side is not, chained to loops; each loop has the set on its left and stays with the
/// fan of triangles where the set touches itself in a vertex. `triangles` lists the set. O(n log n) in the set.
pub(crate) fn loops(mesh: &Mesh, triangles: &[u32], is_inside: impl Fn(u32) -> bool) -> Vec<Vec<u32>> {
    let halves = triangles.iter().flat_map(|t| 3 * t..3 * t + 3);
    let mut rim: Vec<u32> = halves.filter(|half| !is_inside(mesh.across(*half))).collect();
    rim.sort_unstable();
    let mut done = vec![false; rim.len()];
    let mut found = Vec::new();
    for first in 0..rim.len() {
        if done[first] {
            continue;
        }
        let mut chain = Vec::new();
        let mut at = first;
        while !done[at] {
            done[at] = true;
            chain.push(rim[at]);
            let mut half = next(rim[at]);
            // Each turn leaves one triangle of the set; a vertex has no more of them than the mesh.
            while is_inside(mesh.across(half)) {
                half = next(mesh.twin[half as usize]);
            }
            let Ok(place) = rim.binary_search(&half) else { break };
            at = place;
        }
        found.push(chain);
    }
    found
}
