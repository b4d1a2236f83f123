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
mod trial;

use super::features::patch::{Candidate, extent};
use super::mesh::Mesh;
use super::reason::Reason;
use super::segments::Segments;
use guard::{Clash, Star};
use plan::{Edit, Plan};
use trial::Trial;

/// Edges that a filling goes around.
const MOST_AVOIDED: usize = 6;

/// Plans the removal of a candidate. Where an edge of the filling is there already, beside a sliver of the face, flat faces are
/// made anew as a whole; where that does not help, such edges are divided.
pub(crate) fn plan(mesh: &Mesh, segments: &Segments, candidate: &Candidate, star: &Star) -> Result<Edit, Reason> {
    if let Some(reason) = candidate.barred {
        return Err(reason);
    }
    let mut trial = Trial::default();
    let first = checked(mesh, segments, candidate, star, &trial);
    let Err((Reason::NotManifold, mut edge)) = first else { return first.map_err(|(reason, _)| reason) };
    if let Ok(edit) = checked(mesh, segments, candidate, star, &Trial { is_anew: true, ..Trial::default() }) {
        return Ok(edit);
    }
    while let Some(ends) = edge.filter(|_| trial.avoided.len() < MOST_AVOIDED) {
        trial.avoided.push(ends);
        match checked(mesh, segments, candidate, star, &trial) {
            Ok(edit) => return Ok(edit),
            Err((_, next)) => edge = next.filter(|ends| !trial.avoided.contains(ends)),
        }
    }
    Err(Reason::NotManifold)
}

fn checked(mesh: &Mesh, segments: &Segments, candidate: &Candidate, star: &Star, trial: &Trial) -> Result<Edit, Clash> {
    let mut edit = planned(mesh, segments, candidate, trial).map_err(|reason| (reason, None))?;
    edit.removed.sort_unstable();
    edit.removed.dedup();
    guard::closes(mesh, &edit, star)?;
    guard::changes(mesh, &edit, candidate).map_err(|reason| (reason, None))?;
    Ok(edit)
}

fn planned(mesh: &Mesh, segments: &Segments, candidate: &Candidate, trial: &Trial) -> Result<Edit, Reason> {
    let reach = 2.0 * extent(mesh, &candidate.entry.triangles);
    if !candidate.strips.is_empty() {
        return network::plan(mesh, segments, candidate, reach, trial);
    }
    let mut plan = Plan::new(mesh, segments, reach);
    for rim in &candidate.loops {
        let runs = plan.follow(rim)?;
        plan.close(runs)?;
    }
    plan.finish(&candidate.entry.triangles, trial)
}
