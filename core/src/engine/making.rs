//! A mesh that is repaired, and then shaped as the profile wants it: rid of features and residue, smoothed, simplified.
//!
//! The repaired mesh is a nameless STL, which is judged by what the repair did to its input; an input that is good stays where it is. After each step it is
//! another one, which is judged by itself: it takes the place of the one before if it is no worse. The last step writes the output. An edit of the input says
//! what all of them did.

use std::path::{Path, PathBuf};

use crate::contract::error::Result;
use crate::contract::report::{FileFacts, Report};
use crate::contract::settings::Limits;
use crate::engine::clock::Clock;
use crate::engine::copying;
use crate::engine::files::{self, Good, Made};
use crate::engine::shaping::{self, Change, Origins, Step};
use crate::engine::work::Work;
use crate::io::read::MeshFile;
use crate::io::record::Record;
use crate::io::write_behind::Nameless;
use crate::output::edit::Edit;
use crate::output::emit::{self, Content, Written};

/// Makes `mesh` the new STL `output`, or a copy of its file where that is good, of the output's format and nothing is to be shaped.
///
/// # Errors
/// [`crate::Error`], any of them.
pub(crate) fn make(mesh: MeshFile, output: &Path, is_of_target: bool, work: Work<'_>, clock: &mut Clock) -> Result<Made> {
    let Work { profile, limits, progress } = work;
    let steps = shaping::steps(profile);
    if steps.is_empty() {
        let good = if is_of_target { Good::IsCopied } else { Good::IsWritten };
        return files::make(mesh, output, good, (profile, limits), progress, clock);
    }
    let good = if is_of_target { Good::Stays } else { Good::IsWritten };
    let spool = Nameless::new(limits)?;
    let mut made = files::make(mesh, &spool.path(), good, (profile, &of_spools(limits)), progress, clock)?;
    made.report.limits.defer_sync = limits.defer_sync;
    if made.report.output.is_none() {
        return Ok(made);
    }
    let mut last = if made.stays { Last::Input } else { Last::Spool(spool) };
    for (number, step) in (1..).zip(&steps) {
        let spooled = last.spool().map(|spool| files::open(&spool.path(), limits, progress)).transpose()?;
        let spooled = spooled.map(|mesh| mesh.called(made.mesh.path()));
        let current = spooled.as_ref().unwrap_or(&made.mesh);
        let origins = || Origins { of: made.edit.origins(made.mesh.records()), inputs: made.mesh.records().len() };
        match step.look((current.path(), current.records()), (&made.report, &origins), work)? {
            Ok(change) => {
                clock.stage(step.stage());
                let so_far = SoFar { report: &mut made.report, edit: &mut made.edit, records: made.mesh.records() };
                let output = (number == steps.len()).then_some(output);
                if let Some(next) = changed(current, (step, change), so_far, output, work)? {
                    last = next;
                }
            }
            Err(told) => told.put(&mut made.report),
        }
    }
    let facts = match last {
        Last::Output(written, facts) => {
            written.durable()?;
            facts
        }
        Last::Spool(spool) => copied(&copying::copy(&spool.path(), output, limits, progress)?, &made.report, work)?,
        Last::Input => copied(&copying::copy_open(&made.mesh, output, limits, progress)?, &made.report, work)?,
    };
    made.mesh.check_unchanged()?;
    clock.stage("emit");
    made.report.output = Some(facts);
    Ok(made)
}

/// Where the mesh is that the last step left.
enum Last {
    /// No step changed the input.
    Input,
    Spool(Nameless),
    /// At its place already, if maybe not on the disk.
    Output(Written, FileFacts),
}

impl Last {
    fn spool(&self) -> Option<&Nameless> {
        match self {
            Self::Spool(spool) => Some(spool),
            Self::Input | Self::Output(..) => None,
        }
    }
}

/// The facts of a result that is a copy of what was judged.
fn copied(written: &MeshFile, report: &Report, Work { limits, progress, .. }: Work<'_>) -> Result<FileFacts> {
    let facts = files::facts(written, files::hash(written, limits, progress));
    if report.certificate.as_ref().is_some_and(|certificate| certificate.blake3 != facts.blake3) {
        return Err(copying::differs(written.path()));
    }
    Ok(facts)
}

/// The limits for spools: these need not be on the disk, since nobody finds them after a fall of the machine.
fn of_spools(limits: &Limits) -> Limits {
    Limits { defer_sync: true, ..limits.clone() }
}

/// All that was done so far.
struct SoFar<'a> {
    report: &'a mut Report,
    /// Of the input's records.
    edit: &'a mut Edit,
    records: &'a [Record],
}

/// Writes the changed mesh, if it changes and is no worse then; completes the report and the edit. The last step's mesh is written to `output`, which becomes a
/// copy of the mesh before if it is worse.
fn changed(
    mesh: &MeshFile,
    (step, mut change): (&Step, Change),
    SoFar { report, edit, records }: SoFar<'_>,
    output: Option<&Path>,
    work: Work<'_>,
) -> Result<Option<Last>> {
    let Work { profile, limits, progress } = work;
    if change.is_none() {
        change.told.put(report);
        return Ok(None);
    }
    // They may be many: there is one copy of them.
    let own = Edit::default().then(mesh.records(), &change.gone, std::mem::take(&mut change.added), step.repair());
    let counts = [change.count_gone(), own.added_with_origins().count() as u64];
    let next = Next::write(mesh, &own, output, work)?;
    let written = files::open(&next.path(), limits, progress)?.called(mesh.path());
    let judged = files::look(&written, (profile, limits), progress, &mut Clock::start())?;
    if !shaping::is_no_worse(report, &judged) {
        change.told.left(&judged).put(report);
        drop(written);
        return next.give_up(mesh, report, work);
    }
    let facts = FileFacts { path: next.path(), ..judged.input.clone() };
    *edit = match std::mem::take(edit) {
        // The mesh is of the input's records.
        so_far if so_far.is_empty() => own,
        so_far => so_far.then(records, &change.gone, own.into_added(), step.repair()),
    };
    shaping::tell(report, (step, change.told, counts), judged, Some((edit, records.len())));
    Ok(Some(match next {
        Next::Spool(spool) => Last::Spool(spool),
        Next::Output(written, _) => Last::Output(written, facts),
    }))
}

/// A mesh that is written, and not judged yet.
enum Next<'a> {
    Spool(Nameless),
    Output(Written, &'a Path),
}

impl<'a> Next<'a> {
    fn write(mesh: &MeshFile, edit: &Edit, output: Option<&'a Path>, work: Work<'_>) -> Result<Self> {
        let Work { limits, progress, .. } = work;
        let content = Content::Edited(edit);
        if let Some(path) = output {
            return Ok(Self::Output(emit::write(mesh, path, &content, limits, progress)?, path));
        }
        let spool = Nameless::new(limits)?;
        emit::write(mesh, &spool.path(), &content, &of_spools(limits), progress)?.durable()?;
        Ok(Self::Spool(spool))
    }

    fn path(&self) -> PathBuf {
        match self {
            Self::Spool(spool) => spool.path(),
            Self::Output(_, path) => path.into(),
        }
    }

    /// An output becomes a copy of the mesh before.
    fn give_up(self, before: &MeshFile, report: &Report, work: Work<'_>) -> Result<Option<Last>> {
        let Self::Output(written, path) = self else { return Ok(None) };
        let written = emit::rewrite(before, written, work.limits, work.progress)?;
        let facts = copied(&files::open(path, work.limits, work.progress)?, report, work)?;
        Ok(Some(Last::Output(written, facts)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contract::error::Error;
    use crate::contract::progress::{Progress, Quiet};
    use crate::contract::report::Outcome;
    use crate::contract::settings::Profile;
    use crate::engine::entry::repair;
    use crate::testing::{Corners, cube, records, shaken_torus};

    struct Place {
        folder: tempfile::TempDir,
        input: PathBuf,
    }

    impl Place {
        /// A binary STL.
        fn of(triangles: &[Corners]) -> Self {
            let folder = tempfile::tempdir().unwrap();
            let input = folder.path().join("part.stl");
            let records = records(triangles);
            let count = (records.len() as u32).to_le_bytes();
            std::fs::write(&input, [&[0; 80][..], &count, records.as_flattened()].concat()).unwrap();
            Self { folder, input }
        }

        fn simplify(&self, triangles: u64, progress: &dyn Progress) -> Result<(Report, Vec<u8>)> {
            let output = self.folder.path().join(format!("{triangles}.stl"));
            let profile = Profile { simplify_triangles: triangles, ..Profile::default() };
            let report = repair(&self.input, &output, &profile, &Limits { threads: 2, ..Limits::default() }, progress)?;
            Ok((report, std::fs::read(output).unwrap_or_default()))
        }
    }

    /// Appends to the file when the step begins.
    struct Touch<'a>(&'a Path);

    impl Progress for Touch<'_> {
        fn at(&self, stage: &'static str, _: u64, _: u64) {
            if stage == "simplify" {
                let mut bytes = std::fs::read(self.0).unwrap();
                bytes.push(7);
                std::fs::write(self.0, bytes).unwrap();
            }
        }
    }

    /// No step changes it: it is a copy, to the last byte.
    #[test]
    fn a_good_file_to_which_nothing_is_to_be_done_is_copied() {
        let place = Place::of(&cube());
        let (report, written) = place.simplify(100, &Quiet).unwrap();
        assert_eq!((report.outcome, report.edit.untouched), (Outcome::Clean, 12));
        assert_eq!(written, std::fs::read(&place.input).unwrap());
        assert_eq!(report.output.unwrap().blake3, report.input.blake3);
    }

    /// The result is that of a file that had to be written anew first.
    #[test]
    fn a_good_file_is_shaped_where_it_is() {
        let good = shaken_torus(0.0);
        let (report, written) = Place::of(&good).simplify(20_000, &Quiet).unwrap();
        assert_eq!((report.outcome, report.edit.untouched + report.edit.added), (Outcome::Repaired, 20_000));
        // One triangle without area more, which goes first.
        let broken: Vec<Corners> = good.iter().copied().chain([[good[0][0]; 3]]).collect();
        let (other, same) = Place::of(&broken).simplify(20_000, &Quiet).unwrap();
        assert_eq!(written, same);
        assert_eq!((other.edit.deleted, other.edit.added), (report.edit.deleted + 1, report.edit.added));
    }

    /// A triangle less is written, at a name and at none; then it is given up.
    #[test]
    fn an_output_that_is_worse_becomes_the_mesh_before() {
        let place = Place::of(&cube());
        let (report, _) = place.simplify(100, &Quiet).unwrap();
        let (profile, limits) = (Profile::default(), Limits { threads: 2, ..Limits::default() });
        let work = Work { profile: &profile, limits: &limits, progress: &Quiet };
        let mesh = files::open(&place.input, &limits, &Quiet).unwrap();
        let gone = crate::util::bits::of(12, std::iter::once(3));
        let edit = Edit::default().then(mesh.records(), &gone, Default::default(), crate::contract::report::RepairName::Simplify);
        let nameless = Nameless::new(&limits.spooling_beside(&place.input)).unwrap();
        for output in [place.folder.path().join("worse.stl"), nameless.path()] {
            let next = Next::write(&mesh, &edit, Some(&output), work).unwrap();
            assert_eq!(files::open(&next.path(), &limits, &Quiet).unwrap().records().len(), 11);
            let Some(Last::Output(written, facts)) = next.give_up(&mesh, &report, work).unwrap() else { unreachable!() };
            written.durable().unwrap();
            assert_eq!(std::fs::read(&output).unwrap(), std::fs::read(&place.input).unwrap());
            assert_eq!((facts.path, facts.blake3, facts.triangles), (output, report.input.blake3.clone(), 12));
        }
    }

    #[test]
    fn a_file_that_changes_while_it_is_shaped_is_an_error() {
        // As it is, and made simpler.
        for triangles in [200_000, 20_000] {
            let place = Place::of(&shaken_torus(0.0));
            let result = place.simplify(triangles, &Touch(&place.input));
            assert!(matches!(result, Err(Error::Changed { .. })), "{result:?}");
        }
    }
}
