//! The way of one file through all of it.
//!
//! read → survey → submesh → repairs → edit → emit → read back → report. The output is surveyed as a whole only where the second look, at
//! what changed, cannot tell.

use std::path::Path;

use blake3::Hasher;

use crate::contract::error::{Error, Result};
use crate::contract::progress::Progress;
use crate::contract::report::{Defects, FileFacts, Report, Task};
use crate::contract::settings::{Limits, Profile, folder_of};
use crate::detect::review::Evidence;
use crate::detect::walls::Surface;
use crate::diagnosis::Diagnosis;
use crate::engine::clock::Clock;
use crate::engine::everywhere;
use crate::engine::judging::{self, Input, Written};
use crate::engine::welding;
use crate::geometry::sums::Bounds;
use crate::io::digest;
use crate::io::digest::Digest;
use crate::io::disk_space::{self, Need};
use crate::io::read::{MeshFile, PREFIX_BYTES};
use crate::io::read_ahead::Guide;
use crate::io::record::Record;
use crate::output::edit::Edit;
use crate::output::emit;
use crate::output::emit::{Ahead, Content, Draft};
use crate::output::incremental;
use crate::output::readback::Expectation;
use crate::repairs::{self, Steps};
use crate::stream::members;
use crate::stream::weld::Counts;
use crate::topology::survey::Survey;
use crate::util::parallel;

/// Fewer bytes are hashed by one thread: starting more would take longer.
pub(crate) const HASHED_BY_ONE: usize = 1 << 20;

/// Bytes that are hashed before their pages may go.
const HASHED_AT_ONCE: usize = 32 << 20;

/// Diagnoses a mesh.
pub(crate) fn look(
    mesh: &MeshFile,
    (profile, limits): (&Profile, &Limits),
    progress: &dyn Progress,
    clock: &mut Clock,
) -> Result<Report> {
    disk_space::check(mesh.path(), &[spool_need(mesh.records(), limits)])?;
    let mut diagnosis = Diagnosis::of(mesh.path(), mesh.records(), profile, limits, progress)?;
    clock.stage("topology");
    let blake3 = hash(mesh, limits, progress);
    clock.stage("hash");
    mesh.check_unchanged()?;
    let mut report = judging::begin(Task::Inspect, &subject(mesh, blake3), &diagnosis, profile, limits);
    let facts = report.input.clone();
    judging::conclude_unchanged(&mut report, &facts, mesh.findings());
    report.loops = repairs::recognise(&mut diagnosis, mesh.path(), profile, limits, progress)?;
    drop(diagnosis);
    judging::look_for_thin_walls(&mut report, &Surface { records: mesh.records(), limits, progress })?;
    Ok(report)
}

/// A mesh that was repaired into an STL.
pub(crate) struct Made {
    pub(crate) report: Report,
    /// As it was repaired: maybe welded first.
    pub(crate) mesh: MeshFile,
    /// Of its records.
    pub(crate) edit: Edit,
    /// Nothing was written: the file of the mesh is its own result.
    pub(crate) stays: bool,
}

/// The ways of a mesh that is good as it came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Good {
    /// Its file is not of the output's format: its triangles are written.
    IsWritten,
    /// Its file is copied.
    IsCopied,
    /// Nothing is written: more is to be done to it.
    Stays,
}

/// Makes `mesh` the new STL `output`; `good`: or what else, where it is good.
pub(crate) fn make(
    mesh: MeshFile,
    output: &Path,
    good: Good,
    (profile, limits): (&Profile, &Limits),
    progress: &dyn Progress,
    clock: &mut Clock,
) -> Result<Made> {
    if !profile.repair {
        let report = pass_on(&mesh, output, good != Good::IsWritten, (profile, limits), progress, clock)?;
        return Ok(Made { report, mesh, edit: Edit::default(), stays: false });
    }
    let (mesh, welded) = welding::in_the_stream(mesh, profile, limits, progress)?;
    clock.stage("read");
    check_space(&mesh, output, limits)?;
    let ahead = if good == Good::Stays { Ahead::Nothing } else { Ahead::All };
    let (report, edit, stays) = emit::draft(&mesh, (output, ahead), limits, progress, |draft| {
        let mended = mend(draft, (&mesh, welded.as_ref()), (output, good), profile, limits, progress, clock);
        mended.map_err(|error| or_changed(error, &mesh, progress))
    })?;
    Ok(Made { report, mesh, edit, stays })
}

/// Is there room for the output of `mesh`, and for what is spooled?
fn check_space(mesh: &MeshFile, output: &Path, limits: &Limits) -> Result<()> {
    // The output is as large as its input but for what is added; what the input spools is gone by then, but the output spools as much.
    let bytes = (PREFIX_BYTES + size_of_val(mesh.records())) as u64;
    let folder = if emit::is_nameless(output) { limits.spool_folder() } else { folder_of(output).into() };
    disk_space::check(mesh.path(), &[Need { folder, bytes, what: "the output" }, spool_need(mesh.records(), limits)])
}

/// What was copied before the input changed is not what is read back: nothing is wrong with the disk.
fn or_changed(error: Error, mesh: &MeshFile, progress: &dyn Progress) -> Error {
    match error {
        Error::Io { .. } if !progress.cancelled() => mesh.check_unchanged().err().unwrap_or(error),
        other => other,
    }
}

/// For a profile that repairs nothing: makes `mesh` the new file `output` if it is good, and writes nothing if it is not.
fn pass_on(
    mesh: &MeshFile,
    output: &Path,
    is_of_target: bool,
    (profile, limits): (&Profile, &Limits),
    progress: &dyn Progress,
    clock: &mut Clock,
) -> Result<Report> {
    clock.stage("read");
    check_space(mesh, output, limits)?;
    let mut diagnosis = Diagnosis::of(mesh.path(), mesh.records(), profile, limits, progress)?;
    clock.stage("topology");
    let mut report = judging::begin(Task::Repair, &subject(mesh, String::new()), &diagnosis, profile, limits);
    if report.verdict.good {
        drop(diagnosis);
        let passed = copy((mesh, is_of_target), output, &mut report, limits, progress, clock);
        passed.map_err(|error| or_changed(error, mesh, progress))?;
    } else {
        report.input.blake3 = hash(mesh, limits, progress);
        clock.stage("hash");
        let facts = report.input.clone();
        judging::conclude_unchanged(&mut report, &facts, mesh.findings());
        report.loops = repairs::recognise(&mut diagnosis, mesh.path(), profile, limits, progress)?;
    }
    mesh.check_unchanged()?;
    Ok(report)
}

/// Copies a good file, or its triangles where it is not of the output's format, and reads the copy back.
fn copy(
    (mesh, is_of_target): (&MeshFile, bool),
    output: &Path,
    report: &mut Report,
    limits: &Limits,
    progress: &dyn Progress,
    clock: &mut Clock,
) -> Result<()> {
    let edit = Edit::default();
    let content = if is_of_target { Content::Input } else { Content::Edited(&edit) };
    let (written, digest) = emit::draft(mesh, (output, Ahead::All), limits, progress, |draft| draft.finish(&content))?;
    report.input.blake3 = digest::hash(mesh.bytes(), &digest);
    clock.stage("emit");
    report.edit = edit.summary(mesh.records().len());
    report.edit_records = limits.list_edit.then(|| edit.listed());
    if is_of_target {
        confirm_copy(report, mesh, output, limits, progress)?;
    } else {
        let surface = report.before.bounds.map_or(Bounds::EMPTY, |[lo, hi]| Bounds { lo, hi });
        let known = Some((Expectation::of(mesh.records(), &edit), Digest::new(), Some(report.before.clone())));
        verify(report, mesh, (&surface, &Evidence::default()), known, output, limits, progress)?;
    }
    written.durable()?;
    clock.stage("verify");
    Ok(())
}

/// Makes `draft` the repaired `mesh` and judges what then stands at `output`; cost and stages are still to come.
fn mend(
    draft: Draft<'_, '_>,
    (mesh, welded): (&MeshFile, Option<&Counts>),
    (output, good): (&Path, Good),
    profile: &Profile,
    limits: &Limits,
    progress: &dyn Progress,
    clock: &mut Clock,
) -> Result<(Report, Edit, bool)> {
    let (survey, set_right) = everywhere::survey(mesh, profile, limits, progress)?;
    let mut diagnosis = everywhere::diagnose((survey, set_right.as_ref()), mesh, profile, limits, progress)?;
    clock.stage("topology");
    let surface = diagnosis.surface_bounds();
    let input = subject(mesh, String::new());
    let mut report = judging::begin(Task::Repair, &input, &diagnosis, profile, limits);
    let repaired = judging::repair_diagnosed(&mut diagnosis, Steps::All, &input, &mut report, (profile, limits), progress)?;
    if repaired.is_some() {
        clock.stage("repair");
    }
    let (edit, evidence) = repaired.unwrap_or_default();
    // Of the input's survey, the second look may go on; the memory of its submesh is needed for that of the output.
    let survey = diagnosis.into_survey();
    let edit = match &set_right {
        Some(set_right) => set_right.edit(edit, mesh),
        None => edit,
    };
    let survey = Some(survey).filter(|_| set_right.is_none());
    let good = if welded.is_none() { good } else { Good::IsWritten };
    let mended = Mended { edit, evidence, surface, good };
    let (written, stays) = write(draft, mesh, &mended, survey, &mut report, (output, limits, progress), clock)?;
    judging::advise(&mut report, &mended.evidence);
    if let Some(counts) = welded {
        welding::tell(&mut report, counts, (mesh, &mended.edit));
    }
    if let Some(set_right) = &set_right {
        set_right.tell(&mut report);
    }
    written.durable()?;
    clock.stage("verify");
    mesh.check_unchanged()?;
    Ok((report, mended.edit, stays))
}

/// What the repairs come to.
struct Mended {
    edit: Edit,
    evidence: Evidence,
    /// The box of the input's surface.
    surface: Bounds,
    /// If there is nothing to repair.
    good: Good,
}

/// Makes `draft` what the edit says, and judges it; and whether nothing was written. `survey`: of the records that the edit is of, if it was made of them.
fn write(
    draft: Draft<'_, '_>,
    mesh: &MeshFile,
    Mended { edit, evidence, surface, good }: &Mended,
    survey: Option<Survey<'_>>,
    report: &mut Report,
    (output, limits, progress): (&Path, &Limits, &dyn Progress),
    clock: &mut Clock,
) -> Result<(emit::Written, bool)> {
    // Good as it came, or nothing in it could be repaired.
    let same = edit.is_empty() && *good != Good::IsWritten && judging::flaws(mesh.findings()).is_empty();
    let expected = survey
        .as_ref()
        .filter(|_| !same)
        .and_then(|survey| expectation(mesh.records(), edit, survey.irregular_triangles.len() as u64, limits));
    let content = match good {
        Good::Stays if same => Content::Nothing,
        _ if same => Content::Input,
        _ => Content::Edited(edit),
    };
    let emit = || draft.finish(&content);
    // What the file will hold is looked at while it is written. It counts when the file was read back and does hold that.
    let look = || second_look(survey?, expected.as_ref(), &report.profile);
    let threads = if mesh.bytes().len() < HASHED_BY_ONE { 1 } else { limits.threads };
    let (written, looked) = parallel::both(threads, emit, look);
    let (written, mut digest) = written?;
    report.input.blake3 = digest::hash(mesh.bytes(), &digest);
    if !mesh.is_in_place() {
        // The records stand elsewhere.
        digest.clear();
    }
    clock.stage("emit");
    report.edit = edit.summary(mesh.records().len());
    report.edit_records = limits.list_edit.then(|| edit.listed());
    if matches!(content, Content::Nothing) {
        // The input is its own result: all that was found in it holds.
        let facts = report.input.clone();
        conclude(report, mesh, facts, limits, progress)?;
        return Ok((written, true));
    }
    if same {
        confirm_copy(report, mesh, output, limits, progress)?;
    } else {
        let known = expected.map(|expected| (expected, digest, looked));
        verify(report, mesh, (surface, evidence), known, output, limits, progress)?;
    }
    Ok((written, false))
}

/// What the file will hold after `edit`, where a look at the difference costs less than reading all of it, and its tables fit in memory.
pub(crate) fn expectation<'e>(
    records: &'e [Record],
    edit: &'e Edit,
    irregular_triangles: u64,
    limits: &Limits,
) -> Option<Expectation<'e>> {
    let (gone, added) = (edit.gone(), edit.added_with_origins().count() as u64);
    let is_worthwhile = incremental::is_worthwhile(gone, added, records.len())
        && incremental::bytes(irregular_triangles, gone + added) <= limits.memory_bytes;
    is_worthwhile.then(|| Expectation::of(records, edit))
}

/// The defects of what is expected, by the survey of the input and what differs from it; `None` if that does not tell.
pub(crate) fn second_look(survey: Survey<'_>, expected: Option<&Expectation<'_>>, profile: &Profile) -> Option<Defects> {
    let (survey, submesh) = incremental::look(survey, &expected?.difference)?;
    Some(Diagnosis::count(survey, submesh, profile).defects)
}

/// The disk space that the topology of `records` takes for a spool.
pub(crate) fn spool_need(records: &[Record], limits: &Limits) -> Need {
    Need {
        folder: limits.spool_folder(),
        bytes: members::spool_bytes(records, &Guide::new(records.as_flattened(), limits), limits),
        what: "sorting triangles by place",
    }
}

/// The written file should be the input, byte for byte: its hash is compared, and what was found in the input holds.
fn confirm_copy(report: &mut Report, input: &MeshFile, output: &Path, limits: &Limits, progress: &dyn Progress) -> Result<()> {
    let written = open(output, limits, progress)?;
    let facts = facts(&written, hash(&written, limits, progress));
    if facts.blake3 != report.input.blake3 {
        return Err(Error::Changed { path: input.path().into() });
    }
    conclude(report, &written, facts, limits, progress)
}

/// Concludes a report on a mesh to which nothing was done.
fn conclude(report: &mut Report, mesh: &MeshFile, facts: FileFacts, limits: &Limits, progress: &dyn Progress) -> Result<()> {
    judging::conclude_unchanged(report, &facts, mesh.findings());
    report.output = Some(facts);
    judging::look_for_thin_walls(report, &Surface { records: mesh.records(), limits, progress })
}

/// Reads the written file again and judges it, against the box of the input's surface and the bodies in it that lay in others.
fn verify(
    report: &mut Report,
    input: &MeshFile,
    (surface, evidence): (&Bounds, &Evidence),
    known: Option<(Expectation<'_>, Digest, Option<Defects>)>,
    output: &Path,
    limits: &Limits,
    progress: &dyn Progress,
) -> Result<()> {
    let written = match open(output, limits, progress) {
        // Nothing was left to write: there is no mesh to judge.
        Err(Error::Unreadable { .. }) if report.edit.untouched + report.edit.added == 0 => {
            judging::conclude_empty(report);
            return Ok(());
        }
        other => other?,
    };
    let (blake3, defects) = look_again(known, &written, &report.profile, limits, progress)?;
    let facts = facts(&written, blake3);
    let judged = Written { facts, findings: written.findings(), defects };
    judging::conclude(report, input.findings(), (surface, evidence), judged);
    judging::look_for_thin_walls(report, &Surface { records: written.records(), limits, progress })
}

/// The hash and the defects of a written file: what was `known` of it before, if it holds what it should, or else by a survey of its own.
fn look_again(
    known: Option<(Expectation<'_>, Digest, Option<Defects>)>,
    written: &MeshFile,
    profile: &Profile,
    limits: &Limits,
    progress: &dyn Progress,
) -> Result<(String, Defects)> {
    let blake3 = match known {
        Some((expected, digest, looked)) => {
            let blake3 = expected.confirm(written, &digest, limits, progress)?;
            if let Some(defects) = looked {
                return Ok((blake3, defects));
            }
            tracing::debug!("The difference does not tell: the written file is surveyed.");
            blake3
        }
        None => hash(written, limits, progress),
    };
    let diagnosis = Diagnosis::of(written.path(), written.records(), profile, limits, progress)?;
    Ok((blake3, diagnosis.defects))
}

/// Opens a mesh file.
pub(crate) fn open(input: &Path, limits: &Limits, progress: &dyn Progress) -> Result<MeshFile> {
    MeshFile::open(input, &limits.spool_folder(), limits, progress)
}

/// The file that a report is about.
fn subject(mesh: &MeshFile, blake3: String) -> Input<'_> {
    Input { path: mesh.path(), facts: facts(mesh, blake3), findings: mesh.findings() }
}

pub(crate) fn facts(mesh: &MeshFile, blake3: String) -> FileFacts {
    FileFacts {
        path: mesh.path().into(),
        bytes: mesh.byte_len(),
        blake3,
        format: mesh.format(),
        unit: mesh.unit().map(String::from),
        triangles: mesh.records().len() as u64,
        findings: mesh.findings().iter().map(|f| f.text.clone()).collect(),
    }
}

pub(crate) fn hash(mesh: &MeshFile, limits: &Limits, progress: &dyn Progress) -> String {
    progress.at("hash", 0, mesh.records().len() as u64);
    hash_blocks(mesh.bytes(), limits, || mesh.let_input_go())
}

/// BLAKE3, hexadecimal.
pub(crate) fn hash_of(bytes: &[u8], limits: &Limits) -> String {
    hash_blocks(bytes, limits, || ())
}

/// `passed` is called behind each part.
fn hash_blocks(bytes: &[u8], limits: &Limits, passed: impl Fn() + Sync) -> String {
    let hash = |update: for<'h> fn(&'h mut Hasher, &[u8]) -> &'h mut Hasher| {
        let mut hasher = Hasher::new();
        for part in Guide::new(bytes, limits).blocks(bytes).flat_map(|block| block.chunks(HASHED_AT_ONCE)) {
            update(&mut hasher, part);
            passed();
        }
        hasher.finalize().to_hex().to_string()
    };
    if limits.threads < 2 || bytes.len() < HASHED_BY_ONE {
        return hash(Hasher::update);
    }
    parallel::in_pool(limits.threads, || hash(Hasher::update_rayon))
}

#[cfg(test)]
mod tests;
