//! Features of machine parts that a print does not need, found and removed.
//!
//! **In:** a closed triangle mesh of a CAD part, and limits.
//! **Out:** a [`Removed`]: features, numbers of triangles to remove, triangles to add.
//! **Promise:** triangles that belong to no feature stay as they are to the last bit, but those of flat and cylindrical faces
//! that go on where a feature was, which take fewer then; the mesh is closed and manifold again; what cannot be removed well is left, with the reason. The same result for
//! any number of threads. O(n log n) for each of at most `ROUNDS` rounds: features inside features go first.
//!
//! Based on: attributed adjacency (Joshi, Chang, Computer-Aided Design 20, 1988), and a half-space view of removal: neighbours'
//! surfaces are continued to where they meet.

mod apply;
mod feature;
mod features;
mod loops;
mod mesh;
mod reason;
mod remove;
mod segments;
mod sets;
mod surface;
#[cfg(test)]
mod tests;
mod vector;

pub(crate) use feature::{Feature, Limits, Outcome};
pub(crate) use mesh::DefeatureError;
use reason::Reason;

use apply::Work;
use rayon::prelude::*;

/// Rounds of removal: features within features, or next to each other, take one each.
const ROUNDS: usize = 12;

/// Triangles that all rounds together look at, two rounds excepted.
const MOST_WORK: usize = 6_000_000;

/// Triangles of a mesh whose segments are looked for again behind the last edit.
const MOST_FRESH: usize = 300_000;

/// An edit of the input.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Removed {
    /// Features that were found, removed ones first.
    pub(crate) features: Vec<Feature>,
    /// Numbers of triangles of the input that go, rising.
    pub(crate) removed_triangles: Vec<u32>,
    /// Triangles that take their place, mm.
    pub(crate) added: Vec<[[f32; 3]; 3]>,
}

/// Finds features below the limits and removes them.
///
/// # Errors
/// A mesh that is not closed, manifold and coherently oriented.
pub(crate) fn defeature(points: &[[f32; 3]], triangles: &[[u32; 3]], limits: &Limits) -> Result<Removed, DefeatureError> {
    let points: Vec<vector::Point> = points.iter().map(|p| p.map(f64::from)).collect();
    let mut work = Work::new(points, triangles.to_vec())?;
    let mut removed = Vec::new();
    let mut left = Vec::new();
    let rounds = (MOST_WORK / triangles.len().max(1)).clamp(2, ROUNDS);
    let mut segments = segments::Segments::new(&work.mesh);
    // A large mesh of little but single facets is a scan.
    let is_scan = triangles.len() > 200_000 && segments.list.len() * 10 > triangles.len() * 7;
    let mut is_fresh = true;
    for _ in 0..if is_scan { 0 } else { rounds } {
        let candidates = features::find(&work.mesh, &segments, limits);
        let star = remove::guard::Star::new(&work.mesh);
        let plans: Vec<_> =
            candidates.par_iter().map(|candidate| remove::plan(&work.mesh, &segments, candidate, &star)).collect();
        let mut round = work.choose(candidates, plans);
        left = std::mem::take(&mut round.left);
        if round.removed.is_empty() {
            // A fresh look at all of what is there finds what edits left in pieces.
            if is_fresh || work.mesh.triangles.len() > MOST_FRESH {
                break;
            }
            segments = segments::Segments::new(&work.mesh);
            is_fresh = true;
            continue;
        }
        // Where edits do not go together, fewer of them are made; the others come in the next round.
        let mut count = round.edits.len();
        let next = loop {
            match work.apply(round.edits.get(..count).unwrap_or(&[]), &segments) {
                Ok(next) => break Some(next),
                Err(_) if count > 1 => count /= 2,
                Err(_) => break None,
            }
        };
        let Some(next) = next else {
            left.extend(
                round.removed.into_iter().flatten().map(|f| Feature { outcome: Outcome::Left(Reason::NotManifold), ..f }),
            );
            break;
        };
        segments = next;
        is_fresh = false;
        round.removed.truncate(count);
        work.note(&round.removed);
        removed.extend(round.removed.into_iter().flatten());
    }
    work.tidy(&segments);
    let (removed_triangles, added) = work.edit();
    removed.extend(left);
    Ok(Removed { features: removed, removed_triangles, added })
}
