//! Tests of an edit before it is made.

use super::super::feature::Kind;
use super::super::features::Candidate;
use super::super::mesh::Mesh;
use super::super::reason::Reason;
use super::super::vector::{six_volumes, sub};
use super::plan::Edit;
use std::collections::BTreeMap;

/// Why an edit does not close the mesh, and the edge that is there already, if that is why.
pub(crate) type Clash = (Reason, Option<(u32, u32)>);

/// The half-edges that begin at each vertex: a vertex where the surface touches itself has several fans of them.
pub(crate) struct Star {
    starts: Vec<u32>,
    halves: Vec<u32>,
}

impl Star {
    /// O(n).
    pub(crate) fn new(mesh: &Mesh) -> Self {
        let mut starts = vec![0_u32; mesh.points.len() + 1];
        mesh.triangles.iter().flatten().for_each(|v| starts[*v as usize] += 1);
        let mut sum = 0;
        for start in &mut starts {
            sum += *start;
            *start = sum;
        }
        // Filled from the end of each vertex's place to its beginning.
        let mut halves = vec![0; mesh.triangles.len() * 3];
        for half in (0..mesh.triangles.len() as u32 * 3).rev() {
            let place = &mut starts[mesh.from(half) as usize];
            *place -= 1;
            halves[*place as usize] = half;
        }
        Self { starts, halves }
    }

    fn around(&self, vertex: u32) -> &[u32] {
        let at = |k: usize| self.starts.get(k).map_or(0, |s| *s as usize);
        self.halves.get(at(vertex as usize)..at(vertex as usize + 1)).unwrap_or(&[])
    }
}

/// Whether an edit closes the mesh again: each new edge is shared by two new triangles and by no triangle that stays, or runs
/// along what was removed. O(n log n) in the edit.
pub(crate) fn closes(mesh: &Mesh, edit: &Edit, star: &Star) -> Result<(), Clash> {
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
            return Err((if up == down { Reason::NotManifold } else { Reason::Open }, None));
        }
        let is_old = (*a as usize) < mesh.points.len() && (*b as usize) < mesh.points.len();
        if is_old && stays_elsewhere(mesh, star, (*a, *b), &removed) {
            return Err((Reason::NotManifold, Some((*a, *b))));
        }
    }
    Ok(())
}

/// Whether an edit takes away or adds what its feature has: the volume between old and new surface is more than a layer of the
/// flatness's thickness over the feature, and on the side of its kind. O(n) in the edit.
pub(crate) fn changes(mesh: &Mesh, edit: &Edit, candidate: &Candidate) -> Result<(), Reason> {
    let at = |v: u32| edit.at(mesh, v);
    let origin = edit.removed.first().map_or([0.0; 3], |t| mesh.centroid(*t));
    let sum = |triangles: &mut dyn Iterator<Item = [u32; 3]>| -> f64 {
        triangles.map(|t| six_volumes(t.map(|v| sub(at(v), origin)))).sum()
    };
    let gain = sum(&mut edit.triangles.iter().copied()) - sum(&mut edit.removed.iter().map(|t| mesh.triangles[*t as usize]));
    let area: f64 = candidate.entry.triangles.iter().map(|t| mesh.areas[*t as usize]).sum();
    let change = match candidate.entry.kind {
        Kind::Fillet | Kind::Chamfer => gain.abs(),
        Kind::Boss => -gain,
        _ => gain,
    };
    if change > 6.0 * mesh.flatness() * area { Ok(()) } else { Err(Reason::Unchanged) }
}

/// Whether an edge between old vertices belongs to two triangles that stay.
fn stays_elsewhere(mesh: &Mesh, star: &Star, (a, b): (u32, u32), removed: &impl Fn(u32) -> bool) -> bool {
    let ways = [(a, b), (b, a)];
    let mut halves = ways.into_iter().flat_map(|(p, q)| star.around(p).iter().filter(move |half| mesh.to(**half) == q));
    halves.any(|half| !removed(half / 3) && !removed(mesh.across(*half)))
}
