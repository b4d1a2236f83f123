//! Removal: a patch is taken out and the faces around it go on where it was.
//!
//! **In:** a patch of triangles. **Out:** an edit, or the reason why there is none.
//! **Promise:** new triangles lie on the carriers, face as they do and close the mesh again; O(n log n) in the patch and its
//! rims.

mod develop;
mod fill;
pub(crate) mod guard;
pub(crate) mod meet;
pub(crate) mod network;
pub(crate) mod pierce;
pub(crate) mod plan;

use super::features::patch::{Candidate, extent};
use super::mesh::Mesh;
use super::reason::Reason;
use super::segments::Segments;
use plan::{Edit, Plan};

/// Plans the removal of a candidate. `star`: a half-edge for each vertex. Where an edge of the filling is there already, beside
/// a sliver of the face, flat faces are made anew as a whole.
pub(crate) fn plan(mesh: &Mesh, segments: &Segments, candidate: &Candidate, star: &[u32]) -> Result<Edit, Reason> {
    match checked(mesh, segments, candidate, star, false) {
        Err(Reason::NotManifold) => checked(mesh, segments, candidate, star, true),
        outcome => outcome,
    }
}

fn checked(mesh: &Mesh, segments: &Segments, candidate: &Candidate, star: &[u32], is_anew: bool) -> Result<Edit, Reason> {
    let mut edit = planned(mesh, segments, candidate, is_anew)?;
    edit.removed.sort_unstable();
    edit.removed.dedup();
    guard::closes(mesh, &edit, star)?;
    Ok(edit)
}

fn planned(mesh: &Mesh, segments: &Segments, candidate: &Candidate, is_anew: bool) -> Result<Edit, Reason> {
    let reach = 2.0 * extent(mesh, &candidate.triangles);
    if !candidate.strips.is_empty() {
        return network::plan(mesh, segments, candidate, reach, is_anew);
    }
    let mut plan = Plan::new(mesh, segments, reach);
    for rim in &candidate.loops {
        let runs = plan.follow(rim)?;
        plan.close(runs)?;
    }
    plan.finish(&candidate.triangles, is_anew)
}
