//! A mesh in memory that is repaired, and then rid of the features that the profile does not want: as [`crate::engine::making`] does with files.

use crate::contract::error::Result;
use crate::contract::progress::Progress;
use crate::contract::report::{FaceOrigin, Features, RepairName};
use crate::contract::settings::{Limits, Profile};
use crate::defeature::Removed;
use crate::engine::features;
use crate::engine::memory::{self, Held, RepairedMesh};
use crate::engine::mesh::{Mesh, MeshView};
use crate::engine::work::Work;
use crate::repairs::Steps;

/// Repairs a mesh, and removes features.
///
/// # Errors
/// [`crate::Error`], but for those of reading and writing files.
pub(crate) fn repair(mesh: MeshView<'_>, profile: &Profile, limits: &Limits, progress: &dyn Progress) -> Result<RepairedMesh> {
    let mut repaired = memory::repair(mesh, Steps::All, profile, limits, progress)?;
    let Some(below) = features::limits_of(profile).filter(|_| repaired.report.output.is_some()) else { return Ok(repaired) };
    let work = Work { profile, limits, progress };
    let records = repaired.mesh.view().records(limits.threads);
    let found = features::find((Held::path(), &records), &repaired.report, &below, work)?;
    drop(records);
    let told = match found {
        Ok(removed) => without(&mut repaired, &removed, work)?,
        Err(why_not) => Features { why_not: Some(why_not), ..Features::default() },
    };
    repaired.report.features = Some(told);
    Ok(repaired)
}

/// Takes the features away, if there are any and the mesh is good then; completes its report.
fn without(repaired: &mut RepairedMesh, removed: &Removed, Work { profile, limits, progress }: Work<'_>) -> Result<Features> {
    let features = features::told(removed);
    if removed.removed_triangles.is_empty() && removed.added.is_empty() {
        return Ok(features);
    }
    let is_gone = |k: &usize| removed.removed_triangles.binary_search(&(*k as u32)).is_ok();
    let stay: Vec<usize> = (0..repaired.origins.len()).filter(|k| !is_gone(k)).collect();
    let corners: Vec<[[f32; 3]; 3]> = repaired.mesh.view().triangles().collect();
    let triangles: Vec<[[f32; 3]; 3]> = stay.iter().filter_map(|k| corners.get(*k)).chain(&removed.added).copied().collect();
    let Ok(mesh) = Mesh::from_triangles(&triangles) else { return Ok(features) };
    let judged = memory::inspect(mesh.view(), profile, limits, progress)?;
    if !judged.verdict.good {
        return Ok(features::left(features, &judged));
    }
    let origins = stay.iter().filter_map(|k| repaired.origins.get(*k)).copied();
    let added = removed.added.iter().map(|_| FaceOrigin::Repair(RepairName::Defeature));
    (repaired.origins, repaired.mesh) = (origins.chain(added).collect(), mesh);
    let facts = judged.input.clone();
    features::tell(&mut repaired.report, &features, judged, None);
    count(repaired);
    repaired.report.output = Some(facts);
    Ok(features)
}

/// The edit in numbers, by where the faces come from.
fn count(repaired: &mut RepairedMesh) {
    let of = |is: fn(&FaceOrigin) -> bool| repaired.origins.iter().filter(|origin| is(origin)).count() as u64;
    let edit = &mut repaired.report.edit;
    edit.untouched = of(|origin| matches!(origin, FaceOrigin::Input(_)));
    edit.flipped = of(|origin| matches!(origin, FaceOrigin::Flipped(_)));
    edit.moved = of(|origin| matches!(origin, FaceOrigin::Moved(_)));
    let stay = edit.untouched + edit.flipped + edit.moved;
    edit.deleted = repaired.report.input.triangles.saturating_sub(stay);
    edit.added = repaired.origins.len() as u64 - stay;
}
