//! A mesh that is repaired, and then shaped as the profile wants it: rid of features and residue, smoothed, simplified.
//!
//! The repaired mesh is a nameless STL, which is judged by what the repair did to its input. After each step it is another one, which is judged
//! by itself: it takes the place of the one before if it is no worse. An edit of the input says what all of them did.

use std::path::Path;

use crate::contract::error::Result;
use crate::contract::settings::Limits;
use crate::engine::clock::Clock;
use crate::engine::copying;
use crate::engine::files::{self, Made};
use crate::engine::shaping::{self, Change, Origins, Step};
use crate::engine::work::Work;
use crate::io::read::MeshFile;
use crate::io::write_behind::Nameless;
use crate::output::edit::Edit;
use crate::output::emit::{self, Content};

/// Makes `mesh` the new STL `output`, or a copy of its file where that is good, of the output's format and nothing is to be shaped.
///
/// # Errors
/// [`crate::Error`], any of them.
pub(crate) fn make(mesh: MeshFile, output: &Path, is_of_target: bool, work: Work<'_>, clock: &mut Clock) -> Result<Made> {
    let Work { profile, limits, progress } = work;
    let steps = shaping::steps(profile);
    if steps.is_empty() {
        return files::make(mesh, output, is_of_target, (profile, limits), progress, clock);
    }
    let mut spool = Nameless::new(limits)?;
    let mut made = files::make(mesh, &spool.path(), is_of_target, (profile, &of_spools(limits)), progress, clock)?;
    made.report.limits.defer_sync = limits.defer_sync;
    if made.report.output.is_none() {
        return Ok(made);
    }
    for step in &steps {
        let current = files::open(&spool.path(), limits, progress)?.called(made.mesh.path());
        let origins = || Origins { of: made.edit.origins(made.mesh.records()), inputs: made.mesh.records().len() };
        match step.look((current.path(), current.records()), (&made.report, &origins), work)? {
            Ok(change) => {
                clock.stage(step.stage());
                if let Some(next) = changed(&current, (step, change), &mut made, work)? {
                    drop(current);
                    spool = next;
                }
            }
            Err(told) => told.put(&mut made.report),
        }
    }
    let written = copying::copy(&spool.path(), output, limits, progress)?;
    clock.stage("emit");
    let facts = files::facts(&written, files::hash(&written, limits, progress));
    if made.report.certificate.as_ref().is_some_and(|certificate| certificate.blake3 != facts.blake3) {
        return Err(copying::differs(output));
    }
    made.report.output = Some(facts);
    Ok(made)
}

/// The limits for spools: these need not be on the disk, since nobody finds them after a fall of the machine.
fn of_spools(limits: &Limits) -> Limits {
    Limits { defer_sync: true, ..limits.clone() }
}

/// Writes the changed mesh, if it changes and is no worse then; completes the report and the edit.
fn changed(mesh: &MeshFile, (step, mut change): (&Step, Change), made: &mut Made, work: Work<'_>) -> Result<Option<Nameless>> {
    let Work { profile, limits, progress } = work;
    if change.is_none() {
        change.told.put(&mut made.report);
        return Ok(None);
    }
    // They may be many: there is one copy of them.
    let own = Edit::default().then(mesh.records(), &change.gone, std::mem::take(&mut change.added), step.repair());
    let spool = Nameless::new(limits)?;
    let path = spool.path();
    emit::draft(mesh, &path, &of_spools(limits), progress, |draft| draft.finish(&Content::Edited(&own)))?.0.durable()?;
    let written = files::open(&path, limits, progress)?.called(mesh.path());
    change.added = own.into_added();
    let judged = files::look(&written, (profile, limits), progress, &mut Clock::start())?;
    if !shaping::is_no_worse(&made.report, &judged) {
        change.told.left(&judged).put(&mut made.report);
        return Ok(None);
    }
    let edit = std::mem::take(&mut made.edit);
    let counts = [change.count_gone(), change.added.len() as u64];
    made.edit = edit.then(made.mesh.records(), &change.gone, change.added, step.repair());
    shaping::tell(&mut made.report, (step, change.told, counts), judged, Some((&made.edit, made.mesh.records().len())));
    Ok(Some(spool))
}
