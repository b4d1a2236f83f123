//! Engine: the way of one file through all of it.
//!
//! **In:** a path, a profile, limits, a progress.
//! **Out:** a report; for a repair, the file at the path for it.
//! **Promise:** what stands at that path is complete and synced when a report is returned. The input is what it was at the beginning, or
//! the result is thrown away.
//!
//! read → survey → submesh → repairs → edit → emit → read back → report. The output is surveyed as a whole only where the second look, at
//! what changed, cannot tell.

use crate::repairs::Repaired;
use std::path::Path;
use std::time::Instant;

use blake3::Hasher;

use crate::contract::error::{Error, Result};
use crate::contract::finite;
use crate::contract::progress::Progress;
use crate::contract::report::{
    BoundaryLoops, Certificate, Cost, Defects, EditSummary, FileFacts, Outcome, Regions, Report, SCHEMA_VERSION, Stage, Task,
    Tolerances,
};
use crate::contract::settings::{Bodies, Limits, Profile, folder_of};
use crate::detect::certificate;
use crate::detect::review;
use crate::detect::review::Enclosed;
use crate::detect::rules::Subject;
use crate::detect::verdict;
use crate::diagnosis::Diagnosis;
use crate::geometry::sums::Bounds;
use crate::io::digest;
use crate::io::digest::Digest;
use crate::io::disk_space::{self, Need};
use crate::io::read::{Loss, MeshFile, PREFIX_BYTES};
use crate::io::read_ahead::Guide;
use crate::io::record;
use crate::output::edit::Edit;
use crate::output::emit;
use crate::output::emit::{Content, Draft};
use crate::output::incremental;
use crate::output::readback::Expectation;
use crate::repairs;
use crate::stream::members;
use crate::submesh::near;
use crate::util::cost;
use crate::util::parallel;

/// Fewer bytes are hashed by one thread: starting more would take longer.
const HASHED_BY_ONE: usize = 1 << 20;

/// What is spent by stage while a file is worked on.
pub(crate) struct Clock {
    start: Instant,
    lap: Instant,
    cpu_seconds_before: f64,
    stages: Vec<Stage>,
    peak_anonymous_bytes: u64,
}

impl Clock {
    fn start() -> Self {
        let now = Instant::now();
        Self { start: now, lap: now, cpu_seconds_before: cost::cpu_seconds(), stages: Vec::new(), peak_anonymous_bytes: 0 }
    }

    /// Ends the stage that ran until now.
    pub(crate) fn stage(&mut self, name: &str) {
        let seconds = self.lap.elapsed().as_secs_f64();
        self.lap = Instant::now();
        self.peak_anonymous_bytes = self.peak_anonymous_bytes.max(cost::anonymous_bytes());
        tracing::debug!(stage = name, seconds, "Stage done.");
        self.stages.push(Stage { name: name.into(), seconds });
    }

    /// Puts what was spent on `mesh` into its report, which is complete then and can be told to anyone.
    fn close(self, mut report: Report, mesh: &MeshFile) -> Result<Report> {
        report.cost = self.cost(mesh.records().len() as u64);
        report.stages = self.stages;
        finite::checked(mesh.path(), report)
    }

    fn cost(&self, triangles: u64) -> Cost {
        let wall_seconds = self.start.elapsed().as_secs_f64();
        Cost {
            wall_seconds,
            cpu_seconds: cost::cpu_seconds() - self.cpu_seconds_before,
            triangles_per_second: triangles as f64 / wall_seconds.max(1e-9),
            peak_resident_bytes: cost::peak_resident_bytes(),
            peak_anonymous_bytes: self.peak_anonymous_bytes,
        }
    }
}

/// Refuses a profile that means nothing, before anything is done under it.
fn validate(input: &Path, profile: &Profile) -> Result<()> {
    profile.validate().map_err(|source| Error::Profile { path: input.into(), profile: profile.name.clone(), source })
}

/// Diagnoses `input` and writes nothing.
///
/// # Errors
/// [`Error`], any of them; [`Error::Profile`] before the file is opened.
pub(crate) fn inspect(input: &Path, profile: &Profile, limits: &Limits, progress: &dyn Progress) -> Result<Report> {
    let mut clock = Clock::start();
    validate(input, profile)?;
    let limits = &limits.spooling_beside(input);
    let mesh = open(input, limits, progress)?;
    clock.stage("read");
    disk_space::check(input, &[spool_need(&mesh, limits)])?;
    let mut diagnosis = Diagnosis::of(input, mesh.records(), profile, limits, progress)?;
    clock.stage("topology");
    let blake3 = hash(&mesh, limits, progress);
    clock.stage("hash");
    mesh.check_unchanged()?;
    let mut report = report(Task::Inspect, &mesh, &diagnosis, profile, limits);
    report.input.blake3 = blake3;
    report.certificate = Some(certify(&report.input, &report.before, &flaws(&mesh)));
    report.loops = repairs::recognise(&mut diagnosis, mesh.path(), profile, limits, progress)?;
    report.outcome = if report.verdict.good { Outcome::Clean } else { Outcome::NotGood };
    clock.close(report, &mesh)
}

/// What there is to say about an input before anything is done; its hash, outcome and cost are still to come.
fn report(task: Task, mesh: &MeshFile, diagnosis: &Diagnosis<'_>, profile: &Profile, limits: &Limits) -> Report {
    Report {
        schema_version: SCHEMA_VERSION,
        engine_version: env!("CARGO_PKG_VERSION").into(),
        task,
        outcome: Outcome::Clean,
        input: facts(mesh, String::new()),
        output: None,
        profile: profile.clone(),
        limits: limits.clone(),
        tolerances: tolerances(diagnosis),
        before: diagnosis.defects.clone(),
        after: None,
        loops: BoundaryLoops::default(),
        repairs: Vec::new(),
        loops_left: Vec::new(),
        sheets_dropped: Vec::new(),
        wraps: Vec::new(),
        volumes: None,
        regions: Regions::default(),
        edit: EditSummary::default(),
        edit_records: None,
        verdict: verdict::judge(&diagnosis.defects, &flaws(mesh)).under(profile.guarantee),
        certificate: None,
        stages: Vec::new(),
        cost: Cost::default(),
    }
}

/// Repairs `input` into the new file `output`.
///
/// # Errors
/// [`Error`], any of them; [`Error::Profile`] before the file is opened.
pub(crate) fn repair(input: &Path, output: &Path, profile: &Profile, limits: &Limits, progress: &dyn Progress) -> Result<Report> {
    let mut clock = Clock::start();
    validate(input, profile)?;
    let limits = &limits.spooling_beside(output);
    let mesh = open(input, limits, progress)?;
    clock.stage("read");
    // The output is as large as its input but for what is added; what the input spools is gone by then, but the output spools as much.
    let bytes = (PREFIX_BYTES + size_of_val(mesh.records())) as u64;
    let folder = if emit::is_nameless(output) { limits.spool_folder() } else { folder_of(output).into() };
    disk_space::check(input, &[Need { folder, bytes, what: "the output" }, spool_need(&mesh, limits)])?;
    emit::draft(&mesh, output, limits, progress, |draft| {
        let mended = mend(draft, &mesh, output, profile, limits, progress, &mut clock);
        // What was copied before the input changed is not what is read back: nothing is wrong with the disk.
        let report = mended.map_err(|error| match error {
            Error::Io { .. } if !progress.cancelled() => mesh.check_unchanged().err().unwrap_or(error),
            other => other,
        })?;
        clock.close(report, &mesh)
    })
}

/// Makes `draft` the repaired `mesh` and judges what then stands at `output`; cost and stages are still to come.
fn mend(
    draft: Draft<'_, '_>,
    mesh: &MeshFile,
    output: &Path,
    profile: &Profile,
    limits: &Limits,
    progress: &dyn Progress,
    clock: &mut Clock,
) -> Result<Report> {
    let mut diagnosis = Diagnosis::of(mesh.path(), mesh.records(), profile, limits, progress)?;
    clock.stage("topology");
    let surface = diagnosis.surface_bounds();
    let mut report = report(Task::Repair, mesh, &diagnosis, profile, limits);
    let repaired = repair_diagnosed(&mut diagnosis, mesh, &mut report, (profile, limits), progress)?;
    if repaired.is_some() {
        clock.stage("repair");
    }
    let (edit, enclosed) = repaired.unwrap_or_default();
    // Of the input's survey, the second look may go on; the memory of its submesh is needed for that of the output.
    let survey = diagnosis.into_survey();
    // Good as it came, or nothing in it could be repaired.
    let same = edit.is_empty() && flaws(mesh).is_empty();
    let expected = if same { None } else { expectation(mesh, &edit, survey.irregular_triangles.len() as u64, limits) };
    let emit = || draft.finish(&if same { Content::Input } else { Content::Edited(&edit) });
    // What the file will hold is looked at while it is written. It counts when the file was read back and does hold that.
    let look = || {
        let looked = expected.as_ref().and_then(|expected| incremental::look(survey, &expected.difference));
        looked.map(|(survey, submesh)| Diagnosis::count(survey, submesh, profile).defects)
    };
    let threads = if mesh.bytes().len() < HASHED_BY_ONE { 1 } else { limits.threads };
    let (written, looked) = parallel::both(threads, emit, look);
    let (written, mut digest) = written?;
    report.input.blake3 = digest::hash(mesh.bytes(), &digest);
    if !mesh.is_in_place() {
        // Of a text.
        digest.clear();
    }
    clock.stage("emit");
    report.edit = edit.summary(mesh.records().len());
    report.edit_records = limits.list_edit.then(|| edit.listed());
    if same {
        confirm_copy(&mut report, mesh, output, limits, progress)?;
    } else {
        verify(
            &mut report,
            mesh,
            (&surface, &enclosed),
            expected.map(|expected| (expected, digest, looked)),
            output,
            limits,
            progress,
        )?;
    }
    written.durable()?;
    clock.stage("verify");
    mesh.check_unchanged()?;
    Ok(report)
}

/// What the file will hold after `edit`, where a look at the difference costs less than reading all of it, and its tables fit in memory.
fn expectation<'e>(mesh: &'e MeshFile, edit: &'e Edit, irregular_triangles: u64, limits: &Limits) -> Option<Expectation<'e>> {
    let (gone, added) = (edit.gone(), edit.added.len() as u64);
    let is_worthwhile = incremental::is_worthwhile(gone, added, mesh.records().len())
        && incremental::bytes(irregular_triangles, gone + added) <= limits.memory_bytes;
    is_worthwhile.then(|| Expectation::of(mesh.records(), edit))
}

/// Repairs what was diagnosed, if there is anything to be repaired: what is to be edited, and what lay in the material of others.
/// `None`: it is good as it is.
fn repair_diagnosed(
    diagnosis: &mut Diagnosis<'_>,
    mesh: &MeshFile,
    report: &mut Report,
    (profile, limits): (&Profile, &Limits),
    progress: &dyn Progress,
) -> Result<Option<(Edit, Enclosed)>> {
    // What lies in the material of others, or cannot be seen, makes a file no less printable, but it does not belong there.
    let holds_more = match profile.bodies {
        Bodies::Union => report.before.nested_positive > 0,
        Bodies::Visible => report.before.components > 1,
        Bodies::Keep => false,
    };
    if report.verdict.good && !holds_more {
        return Ok(None);
    }
    progress.at("repair", 0, mesh.records().len() as u64);
    let repaired = repairs::run(diagnosis, mesh.path(), profile, limits, progress)?;
    let mut edit = Edit::of(&diagnosis.survey, &diagnosis.submesh, &repaired.reversed);
    edit.added.extend(repaired.wrapped.iter().map(|corners| record::encode(*corners, 0)));
    Ok(Some((edit, take_account(report, repaired))))
}

/// Puts into the report what was done; what lay in the material of others is needed for the verdict.
fn take_account(report: &mut Report, repaired: Repaired) -> Enclosed {
    let Repaired { mut account, regions, .. } = repaired;
    report.repairs = account.repairs();
    report.loops = account.loops.unwrap_or_default();
    report.loops_left = account.loops_left;
    report.sheets_dropped = account.sheets;
    report.wraps = account.wraps;
    report.volumes = account.volumes;
    report.regions = regions;
    account.enclosed
}

/// What working out the topology of `mesh` spools.
fn spool_need(mesh: &MeshFile, limits: &Limits) -> Need {
    Need {
        folder: limits.spool_folder(),
        bytes: members::spool_bytes(mesh.records(), &Guide::new(mesh.records().as_flattened(), limits), limits),
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
    report.outcome = if report.verdict.good { Outcome::Clean } else { Outcome::NotGood };
    report.certificate = Some(certify(&facts, &report.before, &flaws(&written)));
    report.output = Some(facts);
    Ok(())
}

/// Reads the written file again and judges it, against the box of the input's surface and the bodies in it that lay in others.
fn verify(
    report: &mut Report,
    input: &MeshFile,
    (surface, enclosed): (&Bounds, &Enclosed),
    known: Option<(Expectation<'_>, Digest, Option<Defects>)>,
    output: &Path,
    limits: &Limits,
    progress: &dyn Progress,
) -> Result<()> {
    let written = match open(output, limits, progress) {
        // Nothing was left to write: there is no mesh to judge.
        Err(Error::Unreadable { .. }) if report.edit.untouched + report.edit.added == 0 => {
            report.outcome = Outcome::NotGood;
            report.verdict.good = false;
            report.verdict.reasons.push("no triangle was left after the repair".into());
            return Ok(());
        }
        other => other?,
    };
    let (blake3, defects) = look_again(known, &written, &report.profile, limits, progress)?;
    let facts = facts(&written, blake3);
    report.verdict = verdict::judge(&defects, &flaws(&written)).under(report.profile.guarantee);
    report.outcome = if report.verdict.good { Outcome::Repaired } else { Outcome::NotGood };
    if report.verdict.good {
        let mut concerns = review::counts(&report.before, surface, enclosed, &defects, &report.profile);
        concerns.extend(report.volumes.iter().flat_map(|volumes| review::volumes(volumes, &report.profile)));
        concerns.extend(review::sheets(&report.before, &report.sheets_dropped, &report.profile));
        concerns.extend(review::wraps(&report.wraps, &report.profile));
        // What was closed had to be guessed: nobody knows what stood in the part that is missing.
        let is_open = report.before.boundary_edges > 0;
        let lost = input.findings().iter().filter(|f| f.loss == Loss::Certain || f.loss == Loss::IfOpen && is_open);
        concerns.extend(lost.map(|f| format!("a part is missing: {}", f.text)));
        if !concerns.is_empty() {
            report.outcome = Outcome::NeedsReview;
            report.verdict.reasons = concerns;
        }
    }
    report.certificate = Some(certify(&facts, &defects, &flaws(&written)));
    report.after = Some(defects);
    report.output = Some(facts);
    Ok(())
}

/// The certificate of a file of these facts, counts and flaws.
fn certify(facts: &FileFacts, defects: &Defects, flaws: &[String]) -> Certificate {
    certificate::certify(facts, &Subject { defects, flaws })
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

/// What makes the file itself less than flawless.
pub(crate) fn flaws(mesh: &MeshFile) -> Vec<String> {
    mesh.findings().iter().filter(|f| !f.harmless).map(|f| f.text.clone()).collect()
}

fn facts(mesh: &MeshFile, blake3: String) -> FileFacts {
    FileFacts {
        path: mesh.path().into(),
        bytes: mesh.byte_len(),
        blake3,
        format: mesh.format(),
        triangles: mesh.records().len() as u64,
        findings: mesh.findings().iter().map(|f| f.text.clone()).collect(),
    }
}

fn hash(mesh: &MeshFile, limits: &Limits, progress: &dyn Progress) -> String {
    let bytes = mesh.bytes();
    progress.at("hash", 0, mesh.records().len() as u64);
    if limits.threads < 2 || bytes.len() < HASHED_BY_ONE {
        return hash_blocks(bytes, limits, Hasher::update);
    }
    parallel::in_pool(limits.threads, || hash_blocks(bytes, limits, Hasher::update_rayon))
}

fn hash_blocks(bytes: &[u8], limits: &Limits, update: for<'h> fn(&'h mut Hasher, &[u8]) -> &'h mut Hasher) -> String {
    let mut hasher = Hasher::new();
    for block in Guide::new(bytes, limits).blocks(bytes) {
        update(&mut hasher, block);
    }
    hasher.finalize().to_hex().to_string()
}

pub(crate) fn tolerances(diagnosis: &Diagnosis<'_>) -> Tolerances {
    let near::Tolerance { weld, edge_share } = diagnosis.tolerance;
    Tolerances {
        diagonal: diagnosis.survey.bounds.diagonal(),
        weld,
        weld_reason: if weld > 0.0 {
            format!(
                "a share of the diagonal, at least four f32 steps of the largest coordinate, at most {edge_share} of the shortest edge at a vertex"
            )
        } else {
            "switched off by the profile".into()
        },
    }
}

#[cfg(test)]
mod tests;
