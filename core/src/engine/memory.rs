//! The way of one mesh in memory through all of it: as that of a file, but that nothing is read or written.

use std::path::Path;

use crate::contract::error::{Error, Result};
use crate::contract::progress::Progress;
use crate::contract::report::{Defects, FaceOrigin, FileFacts, Format, Report, Task};
use crate::contract::settings::{Limits, Profile};
use crate::detect::walls::Surface;
use crate::diagnosis::Diagnosis;
use crate::engine::clock::Clock;
use crate::engine::edited_mesh::EditedMesh;
use crate::engine::files;
use crate::engine::judging::{self, Input, Written};
use crate::engine::mesh::{Mesh, MeshError, MeshView};
use crate::io::disk_space;
use crate::io::read::PREFIX_BYTES;
use crate::io::record::Record;
use crate::output::edit::Edit;
use crate::repairs::{self, Steps};
use crate::topology::survey::Survey;
use crate::util::parallel;

/// How errors and reports name what has no path.
const NAME: &str = "mesh in memory";

/// The mesh that a repair made of one in memory, and its report.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct RepairedMesh {
    /// The mesh. If nothing was repaired, it is the input, array by array. Otherwise each position is one vertex, numbered by first appearance.
    pub mesh: Mesh,
    /// Where each of its faces comes from.
    pub origins: Vec<FaceOrigin>,
    /// The report: all findings and repairs, and the verdict on the mesh.
    pub report: Report,
}

/// A mesh in memory as the engine reads it.
pub(crate) struct Held {
    pub(crate) records: Vec<Record>,
}

impl Held {
    /// Refuses what has no faces.
    pub(crate) fn of(mesh: MeshView<'_>, limits: &Limits) -> Result<Self> {
        let records = mesh.records(limits.threads);
        if records.is_empty() {
            return Err(Error::Unreadable { path: Self::path().into(), reason: "it has no faces".into() });
        }
        disk_space::check(Self::path(), &[files::spool_need(&records, limits)])?;
        Ok(Self { records })
    }

    pub(crate) fn path() -> &'static Path {
        Path::new(NAME)
    }

    /// Everything that is to be known of it.
    pub(crate) fn diagnose(&self, profile: &Profile, limits: &Limits, progress: &dyn Progress) -> Result<Diagnosis<'_>> {
        Diagnosis::of(Self::path(), &self.records, profile, limits, progress)
    }

    /// The facts that stand for those of a file.
    pub(crate) fn facts(&self, limits: &Limits) -> FileFacts {
        facts(&self.records, files::hash_of(self.records.as_flattened(), limits))
    }
}

fn facts(records: &[Record], blake3: String) -> FileFacts {
    FileFacts {
        path: NAME.into(),
        bytes: (PREFIX_BYTES + size_of_val(records)) as u64,
        blake3,
        format: Format::Memory,
        unit: None,
        triangles: records.len() as u64,
        findings: Vec::new(),
    }
}

/// Diagnoses a mesh.
///
/// # Errors
/// [`Error`], but for those of reading and writing files.
pub(crate) fn inspect(mesh: MeshView<'_>, profile: &Profile, limits: &Limits, progress: &dyn Progress) -> Result<Report> {
    let mut clock = Clock::start();
    judging::validate(Held::path(), profile)?;
    let held = Held::of(mesh, limits)?;
    clock.stage("read");
    let mut diagnosis = held.diagnose(profile, limits, progress)?;
    clock.stage("topology");
    let facts = held.facts(limits);
    clock.stage("hash");
    let input = Input { path: Held::path(), facts: facts.clone(), findings: &[] };
    let mut report = judging::begin(Task::Inspect, &input, &diagnosis, profile, limits);
    judging::conclude_unchanged(&mut report, &facts, &[]);
    report.loops = repairs::recognise(&mut diagnosis, Held::path(), profile, limits, progress)?;
    drop(diagnosis);
    judging::look_for_thin_walls(&mut report, &Surface { records: &held.records, limits, progress })?;
    clock.close(report, Held::path(), held.records.len())
}

/// Repairs a mesh by these steps.
///
/// # Errors
/// [`Error`], but for those of reading and writing files.
pub(crate) fn repair(
    mesh: MeshView<'_>,
    steps: Steps,
    profile: &Profile,
    limits: &Limits,
    progress: &dyn Progress,
) -> Result<RepairedMesh> {
    let mut clock = Clock::start();
    judging::validate(Held::path(), profile)?;
    let held = Held::of(mesh, limits)?;
    clock.stage("read");
    let mut diagnosis = held.diagnose(profile, limits, progress)?;
    clock.stage("topology");
    let surface = diagnosis.surface_bounds();
    let input = Input { path: Held::path(), facts: facts(&held.records, String::new()), findings: &[] };
    let mut report = judging::begin(Task::Repair, &input, &diagnosis, profile, limits);
    let repaired = judging::repair_diagnosed(&mut diagnosis, steps, &input, &mut report, (profile, limits), progress)?;
    clock.stage("repair");
    let (edit, evidence) = repaired.unwrap_or_default();
    let survey = diagnosis.into_survey();
    report.edit = edit.summary(held.records.len());
    report.edit_records = limits.list_edit.then(|| edit.listed());
    let faces = held.records.len();
    if edit.is_empty() {
        drop(survey);
        report.input = held.facts(limits);
        clock.stage("hash");
        let facts = report.input.clone();
        judging::conclude_unchanged(&mut report, &facts, &[]);
        judging::look_for_thin_walls(&mut report, &Surface { records: &held.records, limits, progress })?;
        judging::advise(&mut report, &evidence);
        report.output = Some(facts);
        let origins = (0..faces as u32).map(FaceOrigin::Input).collect();
        return Ok(RepairedMesh { mesh: mesh.to_mesh(), origins, report: clock.close(report, Held::path(), faces)? });
    }
    let (edited, (blake3, looked)) = emit(mesh, &held, survey, &edit, profile, limits);
    report.input.blake3 = blake3;
    let mut edited = edited.map_err(|error| Error::Refused {
        path: NAME.into(),
        reason: error.to_string(),
        advice: "divide the mesh".into(),
    })?;
    clock.stage("emit");
    let Held { mut records } = held;
    edited.apply(&mut records);
    if records.is_empty() {
        judging::conclude_empty(&mut report);
    } else {
        let defects = judged(looked, &records, profile, limits, progress)?;
        let facts = facts(&records, files::hash_of(records.as_flattened(), limits));
        judging::conclude(&mut report, &[], (&surface, &evidence), Written { facts, findings: &[], defects });
        judging::look_for_thin_walls(&mut report, &Surface { records: &records, limits, progress })?;
    }
    judging::advise(&mut report, &evidence);
    clock.stage("verify");
    let EditedMesh { mesh, origins, .. } = edited;
    Ok(RepairedMesh { mesh, origins, report: clock.close(report, Held::path(), faces)? })
}

/// The mesh as `edit` leaves it; side by side with that, the hash of the input, and what the second look finds, if that tells.
fn emit(
    mesh: MeshView<'_>,
    held: &Held,
    survey: Survey<'_>,
    edit: &Edit,
    profile: &Profile,
    limits: &Limits,
) -> (std::result::Result<EditedMesh, MeshError>, (String, Option<Defects>)) {
    let expected = files::expectation(&held.records, edit, survey.irregular_triangles.len() as u64, limits);
    let bytes = held.records.as_flattened();
    let threads = if bytes.len() < files::HASHED_BY_ONE { 1 } else { limits.threads };
    let positions = survey.nonfinite.is_empty().then_some(survey.vertices);
    let look = || {
        let blake3 = files::hash_of(bytes, &Limits { threads: 1, ..limits.clone() });
        (blake3, files::second_look(survey, expected.as_ref(), profile))
    };
    parallel::both(threads, || EditedMesh::of(mesh, &held.records, positions, edit), look)
}

/// The defects of the result: as the second look found them, or by a survey of its own.
fn judged(
    looked: Option<Defects>,
    records: &[Record],
    profile: &Profile,
    limits: &Limits,
    progress: &dyn Progress,
) -> Result<Defects> {
    match looked {
        Some(defects) => Ok(defects),
        None => Ok(Diagnosis::of(Held::path(), records, profile, limits, progress)?.defects),
    }
}

#[cfg(test)]
mod tests;
