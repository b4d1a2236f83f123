//! The report of a mesh, from a file or from memory: what is said before anything is done, what was done, and the verdict at the end.

use std::path::Path;

use crate::contract::error::{Error, Result};
use crate::contract::hint::HintKind;
use crate::contract::progress::Progress;
use crate::contract::report::{
    BoundaryLoops, Certificate, Cost, Defects, EditSummary, FileFacts, Outcome, Regions, Repair, RepairName, Report,
    SCHEMA_VERSION, Task, Tolerances,
};
use crate::contract::settings::{Bodies, Hollow, Limits, Profile};
use crate::detect::certificate;
use crate::detect::fidelity;
use crate::detect::hints;
use crate::detect::review;
use crate::detect::review::Evidence;
use crate::detect::rules::Subject;
use crate::detect::verdict;
use crate::detect::walls;
use crate::detect::walls::Surface;
use crate::diagnosis::Diagnosis;
use crate::geometry::sums::Bounds;
use crate::io::read::{Finding, Loss};
use crate::output::edit::Edit;
use crate::repairs::{self, Account, Repaired, Steps};
use crate::submesh::near;

/// A mesh that a report is about.
pub(crate) struct Input<'a> {
    /// Where it comes from, as errors name it.
    pub(crate) path: &'a Path,
    /// Its hash may be still to come.
    pub(crate) facts: FileFacts,
    /// Oddities of its file.
    pub(crate) findings: &'a [Finding],
}

/// Refuses a profile that means nothing, before anything is done under it.
pub(crate) fn validate(path: &Path, profile: &Profile) -> Result<()> {
    profile.validate().map_err(|source| Error::Profile { path: path.into(), profile: profile.name.clone(), source })
}

/// What there is to say about an input before anything is done; its hash, outcome and cost are still to come.
pub(crate) fn begin(task: Task, input: &Input<'_>, diagnosis: &Diagnosis<'_>, profile: &Profile, limits: &Limits) -> Report {
    Report {
        schema_version: SCHEMA_VERSION,
        engine_version: env!("CARGO_PKG_VERSION").into(),
        task,
        outcome: Outcome::Clean,
        input: input.facts.clone(),
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
        volume_meant: None,
        volumes: None,
        skin: None,
        regions: Regions::default(),
        edit: EditSummary::default(),
        edit_records: None,
        verdict: verdict::judge(&diagnosis.defects, &flaws(input.findings)).under(profile.guarantee),
        certificate: None,
        hints: Vec::new(),
        objects: Vec::new(),
        attributes: None,
        thin_walls: None,
        features: None,
        residue: None,
        smoothed: None,
        simplified: None,
        stages: Vec::new(),
        cost: Cost::default(),
    }
}

/// Ends the report of an inspection, or of a mesh that nothing was done to: what was found in the input holds of `facts`.
pub(crate) fn conclude_unchanged(report: &mut Report, facts: &FileFacts, findings: &[Finding]) {
    report.outcome = if report.verdict.good { Outcome::Clean } else { Outcome::NotGood };
    if report.task == Task::Repair && !report.verdict.good && !report.profile.repair {
        report.verdict.reasons.push(format!("nothing was repaired: the profile `{}` says `repair = false`", report.profile.name));
    }
    tell_missing_first(report, findings);
    report.certificate = Some(certify(facts, &report.before, &flaws(findings)));
    report.hints = hints::hints(&report.before, &report.profile);
}

/// Parts that a file once had and lacks, in words.
fn missing(before: &Defects, findings: &[Finding]) -> Vec<String> {
    let is_open = before.boundary_edges > 0;
    let lost = findings.iter().filter(|f| f.loss == Loss::Certain || f.loss == Loss::IfOpen && is_open);
    lost.map(|f| format!("a part is missing: {}", f.text)).collect()
}

/// Of a file that is not good, whoever reads why is to know first that a part of it never came: no other settings bring that back.
fn tell_missing_first(report: &mut Report, findings: &[Finding]) {
    if !report.verdict.good {
        let missing = missing(&report.before, findings);
        // Some of it is a flaw of the file as well.
        report.verdict.reasons.retain(|reason| !missing.iter().any(|missing| missing.ends_with(reason.as_str())));
        report.verdict.reasons.splice(0..0, missing);
    }
}

/// Repairs what was diagnosed by these steps, if there is anything to be repaired: what is to be edited, and what a
/// review needs to know. `None`: it is good as it is, or the profile repairs nothing.
pub(crate) fn repair_diagnosed(
    diagnosis: &mut Diagnosis<'_>,
    steps: Steps,
    input: &Input<'_>,
    report: &mut Report,
    (profile, limits): (&Profile, &Limits),
    progress: &dyn Progress,
) -> Result<Option<(Edit, Evidence)>> {
    // What lies in the material of others, or cannot be seen, makes a file no less printable, but it does not belong there.
    let holds_more = match profile.bodies {
        Bodies::Union => report.before.nested_positive > 0,
        Bodies::Visible => report.before.components > 1,
        Bodies::Keep => profile.hollow == Hollow::Keep && report.before.nested_positive > 0,
    };
    if !profile.repair || report.verdict.good && !holds_more {
        return Ok(None);
    }
    let repaired = repairs::run(diagnosis, steps, input.path, profile, limits, progress)?;
    let edit = Edit::of(&diagnosis.survey, &diagnosis.submesh, &repaired.reversed, &repaired.wrapped);
    Ok(Some((edit, take_account(report, repaired))))
}

/// Puts into the report what was done; returns what else the verdict needs.
fn take_account(report: &mut Report, repaired: Repaired) -> Evidence {
    let Repaired { mut account, regions, .. } = repaired;
    report.repairs = account.repairs();
    report.loops = account.loops.take().unwrap_or_default();
    report.loops_left = std::mem::take(&mut account.loops_left);
    report.sheets_dropped = std::mem::take(&mut account.sheets);
    report.wraps = std::mem::take(&mut account.wraps);
    report.volume_meant = account.enclosed.meant;
    report.volumes = account.volumes.take();
    report.skin = account.skin.take();
    report.regions = regions;
    let Account { enclosed, doubts, explained, asked, open_sheets, .. } = account;
    Evidence { enclosed, doubts, explained, asked, open_sheets }
}

/// Ends the report of a mesh from which nothing was left.
pub(crate) fn conclude_empty(report: &mut Report) {
    report.outcome = Outcome::NotGood;
    report.verdict.good = false;
    // Of the defects that were there, none is left either.
    report
        .verdict
        .reasons
        .insert(0, "no triangle was left after the repair: the file has no surface that encloses anything".into());
}

/// The file or mesh that is written, or returned.
pub(crate) struct Written<'a> {
    pub(crate) facts: FileFacts,
    pub(crate) findings: &'a [Finding],
    pub(crate) defects: Defects,
}

/// Ends the report of a repair by a verdict on what came of it, against the box of the input's surface and what the repairs know.
pub(crate) fn conclude(report: &mut Report, input: &[Finding], (surface, evidence): (&Bounds, &Evidence), written: Written<'_>) {
    let Written { facts, findings, defects } = written;
    let flaws = flaws(findings);
    report.verdict = verdict::judge(&defects, &flaws).under(report.profile.guarantee);
    report.outcome = if report.verdict.good { Outcome::Repaired } else { Outcome::NotGood };
    tell_missing_first(report, input);
    let mut faithful = None;
    if report.verdict.good {
        let mut surface = *surface;
        surface.add(&evidence.asked.bounds);
        let before = Defects { area: report.before.area + evidence.asked.area, ..report.before.clone() };
        // What was closed had to be guessed: nobody knows what stood in the part that is missing.
        let missing = missing(&report.before, input);
        let change = review::Change {
            before: &before,
            surface: &surface,
            evidence,
            after: &defects,
            volumes: report.volumes.as_ref(),
            skin: report.skin.as_ref(),
            sheets: &report.sheets_dropped,
            wraps: &report.wraps,
            missing: &missing,
        };
        let measured = review::measure(&change, &report.profile);
        faithful = Some(fidelity::certify((&report.input.blake3, report.input.bytes), &measured));
        let concerns = fidelity::concerns(measured, review::closed_openings(&evidence.explained, &defects));
        if !concerns.is_empty() {
            report.outcome = Outcome::NeedsReview;
            report.verdict.reasons = concerns;
        }
    }
    report.certificate = Some(Certificate { faithful, ..certify(&facts, &defects, &flaws) });
    report.hints = hints::hints(&defects, &report.profile);
    report.after = Some(defects);
    report.output = Some(facts);
}

/// Adds to a report that has its verdict what there is to say of thin walls in the surface that it is of, if the profile asks for that.
pub(crate) fn look_for_thin_walls(report: &mut Report, surface: &Surface<'_>) -> Result<()> {
    let minimum = report.profile.thin_wall_mm;
    if minimum == 0.0 {
        return Ok(());
    }
    surface.progress.at(WALLS, 0, surface.records.len() as u64);
    let defects = report.after.as_ref().unwrap_or(&report.before);
    let bounds = defects.bounds.map_or(Bounds::EMPTY, |[lo, hi]| Bounds { lo, hi });
    let found = if report.verdict.closed && report.verdict.oriented {
        walls::measure(surface, (&bounds, defects.area), minimum)
    } else {
        Err("its surface does not enclose material everywhere".into())
    };
    if surface.progress.cancelled() {
        return Err(Error::cancelled(&report.input.path, WALLS));
    }
    report.hints.extend(hints::walls(&found));
    report.thin_walls = found.ok();
    Ok(())
}

/// The stage in which thin walls are looked for.
const WALLS: &str = "walls";

/// Adds to a report what the stream did before all repairs: to what the same repair did, or as the first.
pub(crate) fn add_first(report: &mut Report, name: RepairName, count: u64, note: &str) {
    match report.repairs.iter_mut().find(|repair| repair.name == name) {
        Some(repair) => repair.count += count,
        None => report.repairs.insert(0, Repair { name, count, note: note.into(), seconds: 0.0 }),
    }
}

/// Adds to a report what was done after all repairs.
pub(crate) fn add_last(report: &mut Report, name: RepairName, count: u64, note: String) {
    report.repairs.push(Repair { name, count, note, seconds: 0.0 });
}

/// Says of a result that is not good what would make it so.
pub(crate) fn advise(report: &mut Report, evidence: &Evidence) {
    if report.outcome == Outcome::NotGood {
        // It explains the edges that are open.
        report.verdict.reasons.splice(0..0, review::open_sheets(evidence.open_sheets));
    }
}

/// The certificate of a file of these facts, counts and flaws.
pub(crate) fn certify(facts: &FileFacts, defects: &Defects, flaws: &[String]) -> Certificate {
    certificate::certify(facts, &Subject { defects, flaws })
}

/// Puts the certificate of what was written in the end into the report of a repair, which keeps what it measured of fidelity.
pub(crate) fn certify_anew(report: &mut Report, certificate: Option<Certificate>) {
    let faithful = report.certificate.take().and_then(|certificate| certificate.faithful);
    report.certificate = certificate.map(|certificate| Certificate { faithful, ..certificate });
}

/// Takes back the hints on units of a mesh whose file says its unit.
pub(crate) fn know_the_unit(report: &mut Report) {
    report.hints.retain(|hint| !matches!(hint.kind, HintKind::Inches | HintKind::Metres));
}

/// Findings that make a file itself less than flawless.
pub(crate) fn flaws(findings: &[Finding]) -> Vec<String> {
    findings.iter().filter(|f| !f.harmless).map(|f| f.text.clone()).collect()
}

fn tolerances(diagnosis: &Diagnosis<'_>) -> Tolerances {
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
