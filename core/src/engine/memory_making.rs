//! A mesh in memory that is repaired, and then shaped as the profile wants it: as [`crate::engine::making`] does with files.

use crate::contract::error::Result;
use crate::contract::progress::Progress;
use crate::contract::report::FaceOrigin;
use crate::contract::settings::{Limits, Profile};
use crate::engine::memory::{self, Held, RepairedMesh};
use crate::engine::mesh::{Mesh, MeshView};
use crate::engine::shaping::{self, Change, Origins, Step};
use crate::engine::work::Work;
use crate::io::record;
use crate::repairs::Steps;
use crate::util::bits;

/// Repairs a mesh, and shapes it.
///
/// # Errors
/// [`crate::Error`], but for those of reading and writing files.
pub(crate) fn repair(mesh: MeshView<'_>, profile: &Profile, limits: &Limits, progress: &dyn Progress) -> Result<RepairedMesh> {
    let mut repaired = memory::repair(mesh, Steps::All, profile, limits, progress)?;
    if repaired.report.output.is_none() {
        return Ok(repaired);
    }
    let work = Work { profile, limits, progress };
    for step in shaping::steps(profile) {
        let records = repaired.mesh.view().records(limits.threads);
        let of = || repaired.origins.iter().map(|origin| origin.input_face()).collect();
        let origins = || Origins { of: of(), inputs: mesh.faces().len() };
        let found = step.look((Held::path(), &records), (&repaired.report, &origins), work)?;
        drop(records);
        match found {
            Ok(change) => changed(&mut repaired, (&step, change), work)?,
            Err(told) => told.put(&mut repaired.report),
        }
    }
    Ok(repaired)
}

/// Changes the mesh, if it is no worse then; completes its report.
fn changed(
    repaired: &mut RepairedMesh,
    (step, change): (&Step, Change),
    Work { profile, limits, progress }: Work<'_>,
) -> Result<()> {
    let is_gone = |k: &usize| bits::holds(&change.gone, *k);
    let stay: Vec<usize> = (0..repaired.origins.len()).filter(|k| !is_gone(k)).collect();
    let corners: Vec<[[f32; 3]; 3]> = repaired.mesh.view().triangles().collect();
    let added = change.added.iter().map(record::corners);
    let triangles: Vec<[[f32; 3]; 3]> = stay.iter().filter_map(|k| corners.get(*k)).copied().chain(added).collect();
    let mesh = Mesh::from_triangles(&triangles);
    let (false, Ok(mesh)) = (change.is_none(), mesh) else {
        change.told.put(&mut repaired.report);
        return Ok(());
    };
    let judged = memory::inspect(mesh.view(), profile, limits, progress)?;
    if !shaping::is_no_worse(&repaired.report, &judged) {
        change.told.left(&judged).put(&mut repaired.report);
        return Ok(());
    }
    let origins = stay.iter().filter_map(|k| repaired.origins.get(*k)).copied();
    let added = change.added.iter().map(|_| FaceOrigin::Repair(step.repair()));
    (repaired.origins, repaired.mesh) = (origins.chain(added).collect(), mesh);
    let facts = judged.input.clone();
    let counts = [change.count_gone(), change.added.len() as u64];
    shaping::tell(&mut repaired.report, (step, change.told, counts), judged, None);
    count(repaired);
    repaired.report.output = Some(facts);
    Ok(())
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
