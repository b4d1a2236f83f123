//! A mesh that is repaired, and then rid of the features that the profile does not want.
//!
//! The repaired mesh is a nameless STL, which is judged by what the repair did to its input. Without the features it is another one, which is judged
//! by itself: it is the result if it is good, and the repaired mesh is the result if it is not. An edit of the input says what both did.

use std::path::Path;

use crate::contract::error::Result;
use crate::contract::report::{Features, RepairName};
use crate::defeature::Removed;
use crate::engine::clock::Clock;
use crate::engine::copying;
use crate::engine::features;
use crate::engine::files::{self, Made};
use crate::engine::work::Work;
use crate::io::read::MeshFile;
use crate::io::write_behind::Nameless;
use crate::output::edit::Edit;
use crate::output::emit::{self, Content};

/// Makes `mesh` the new STL `output`, or a copy of its file where that is good, of the output's format and without features that are to go.
///
/// # Errors
/// [`crate::Error`], any of them.
pub(crate) fn make(mesh: MeshFile, output: &Path, is_of_target: bool, work: Work<'_>, clock: &mut Clock) -> Result<Made> {
    let Work { profile, limits, progress } = work;
    let plain =
        |mesh, output: &Path, clock: &mut Clock| files::make(mesh, output, is_of_target, (profile, limits), progress, clock);
    let Some(below) = features::limits_of(profile) else { return plain(mesh, output, clock) };
    let spool = Nameless::new(limits)?;
    let mut made = plain(mesh, &spool.path(), clock)?;
    if made.report.output.is_none() {
        return Ok(made);
    }
    let repaired = files::open(&spool.path(), limits, progress)?.called(made.mesh.path());
    let (without, features) = match features::find((repaired.path(), repaired.records()), &made.report, &below, work)? {
        Ok(removed) => {
            clock.stage("features");
            without(&repaired, &removed, &mut made, work)?
        }
        Err(why_not) => (None, Features { why_not: Some(why_not), ..Features::default() }),
    };
    made.report.features = Some(features);
    let result = without.as_ref().unwrap_or(&spool);
    let written = copying::copy(&result.path(), output, limits, progress)?;
    clock.stage("emit");
    let facts = files::facts(&written, files::hash(&written, limits, progress));
    if made.report.certificate.as_ref().is_some_and(|certificate| certificate.blake3 != facts.blake3) {
        return Err(copying::differs(output));
    }
    made.report.output = Some(facts);
    Ok(made)
}

/// Writes the mesh without the features, if there are any and it is good then; completes the report and the edit.
fn without(mesh: &MeshFile, removed: &Removed, made: &mut Made, work: Work<'_>) -> Result<(Option<Nameless>, Features)> {
    let Work { profile, limits, progress } = work;
    let features = features::told(removed);
    if removed.removed_triangles.is_empty() && removed.added.is_empty() {
        return Ok((None, features));
    }
    let added = features::added(removed);
    let own = Edit::default().then(mesh.records(), &removed.removed_triangles, added.clone(), RepairName::Defeature);
    let spool = Nameless::new(limits)?;
    let path = spool.path();
    emit::draft(mesh, &path, limits, progress, |draft| draft.finish(&Content::Edited(&own)))?.0.durable()?;
    let written = files::open(&path, limits, progress)?.called(mesh.path());
    let judged = files::look(&written, (profile, limits), progress, &mut Clock::start())?;
    if !judged.verdict.good {
        return Ok((None, features::left(features, &judged)));
    }
    let edit = std::mem::take(&mut made.edit);
    made.edit = edit.then(made.mesh.records(), &removed.removed_triangles, added, RepairName::Defeature);
    features::tell(&mut made.report, &features, judged, Some((&made.edit, made.mesh.records().len())));
    Ok((Some(spool), features))
}
