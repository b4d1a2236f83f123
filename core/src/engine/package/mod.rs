//! Packages: several meshes in one file, each of which is repaired by itself.
//!
//! Each object's triangles, or each volume's of a slicer's project, become a nameless STL, which goes the way of a file. What the repair did is then
//! written into the text of the object's part ([`crate::output::model`]), and the package is written anew around it. Two meshes are never
//! welded or united, not even if they touch. The written package is read again, and each object compared with what it should be.

mod change;
mod corners;
mod read_back;
mod section;
#[cfg(test)]
mod tests;
mod units;

use std::path::Path;

use crate::contract::error::{Error, Result};
use crate::contract::report::{FileFacts, Format, Outcome, Report, Task};
use crate::contract::settings::{OutputFormat, Profile, folder_of};
use crate::engine::carried;
use crate::engine::clock::Clock;
use crate::engine::copying;
use crate::engine::files;
use crate::engine::formats;
use crate::engine::judging;
use crate::engine::together::{certify, together};
use crate::engine::work::Work;
use crate::io::disk_space::{self, Need};
use crate::io::read::PackageFile;
use crate::io::write_behind::Nameless;
use crate::output::emit;
use crate::output::model::Account;
use crate::util::words::{self, Counted};
use change::{Changed, Maker};
use section::section;

/// Diagnoses every object of a package, and writes nothing.
///
/// # Errors
/// [`Error`], any of them.
pub(crate) fn inspect(package: &PackageFile, work: Work<'_>, clock: &mut Clock) -> Result<Report> {
    let mut sections = Vec::new();
    for place in package.meshes() {
        let read = package.read(place, work.limits, work.progress)?;
        clock.stage("read");
        for unit in units::of(package, place, &read)? {
            if !unit.is_repaired {
                continue;
            }
            let (mesh, _held) = units::spooled(package, &unit, &read, work)?;
            let report = files::look(&mesh, (work.profile, work.limits), work.progress, clock)?;
            sections.push(section(package, &unit, report, &read.parsed.findings));
        }
    }
    let mut report = together(&sections).ok_or_else(|| nothing(package))?;
    package.check_unchanged()?;
    report.task = Task::Inspect;
    report.input = facts(package, files::hash_of(package.bytes(), work.limits), report.input.triangles);
    certify(&mut report);
    Ok(report)
}

/// Repairs every object of a package into the new file `output`, in the format that the profile names: all that is built becomes one mesh in others
/// than 3MF.
///
/// # Errors
/// [`Error`], any of them.
pub(crate) fn repair_as(package: &PackageFile, output: &Path, work: Work<'_>, clock: &mut Clock) -> Result<Report> {
    if matches!(work.profile.format, OutputFormat::Input | OutputFormat::ThreeMf) {
        return repair(package, output, work, clock);
    }
    formats::refuse_unit(package.path(), Some(package.unit()), work.profile.format)?;
    let spool = Nameless::new(work.limits)?;
    let mut report = repair(package, &spool.path(), work, clock)?;
    if report.output.is_some() {
        // No other format has a place for them.
        if let Some(own) = report.attributes {
            let account = Account { lost: own.kept + own.lost, ..Account::default() };
            report.attributes = Some(account.told());
            if !carried::heed(&mut report, work.profile, carried::harm(account)) {
                return Ok(report);
            }
        }
        let converted = formats::convert(&spool.path(), output, work.profile.format, work.limits, work.progress)?;
        clock.stage("encode");
        report.output = Some(converted.output);
        judge_built(&mut report, output, work, clock)?;
        if package.has_negative() {
            let reason = "negative volumes of a slicer's project are left out: what they cut away is solid in the result";
            carried::ask_for_review(&mut report, reason.into());
        }
    }
    Ok(report)
}

/// Judges what was written of all objects where they are placed: they may cross there, and coordinates are rounded anew.
fn judge_built(report: &mut Report, output: &Path, work: Work<'_>, clock: &mut Clock) -> Result<()> {
    let built = files::open(output, work.limits, work.progress)?;
    let judged = files::look(&built, (work.profile, work.limits), work.progress, clock)?;
    report.after = Some(judged.before);
    judging::certify_anew(report, judged.certificate);
    if judged.verdict.good {
        if report.outcome == Outcome::Clean {
            // Good as it came, and yet other bytes.
            report.outcome = Outcome::Repaired;
        }
        certify(report);
        return Ok(());
    }
    let own = std::mem::take(&mut report.verdict.reasons);
    report.outcome = Outcome::NotGood;
    report.verdict = judged.verdict;
    let all = report.verdict.reasons.iter().map(|reason| format!("all objects as one mesh: {reason}"));
    report.verdict.reasons = all.chain(own).collect();
    Ok(())
}

/// Repairs every object of a package into the new file `output`.
///
/// # Errors
/// [`Error`], any of them.
pub(crate) fn repair(package: &PackageFile, output: &Path, work: Work<'_>, clock: &mut Clock) -> Result<Report> {
    let folder = if emit::is_nameless(output) { work.limits.spool_folder() } else { folder_of(output).into() };
    // What is packed anew takes about as much as before.
    disk_space::check(package.path(), &[Need { folder, bytes: package.bytes().len() as u64 * 5 / 4, what: "the output" }])?;
    let mut maker = Maker::new(package, work);
    let mut sections = Vec::new();
    for place in package.meshes() {
        maker.object(place, &mut sections, clock)?;
    }
    let mut report = together(&sections).ok_or_else(|| nothing(package))?;
    let input_hash = files::hash_of(package.bytes(), work.limits);
    report.input = facts(package, input_hash, sections.iter().map(|section| section.report.input.triangles).sum());
    let changed = maker.finish()?;
    report.attributes = changed.account.is_any().then(|| changed.account.told());
    let is_written = judge(package, &changed, &mut report, work.profile);
    if is_written {
        if changed.is_none() {
            copying::copy(package.path(), output, work.limits, work.progress)?;
        } else {
            changed.write(package, output, work)?;
        }
        clock.stage("pack");
        let written = read_back::confirm(package, output, &changed, work)?;
        clock.stage("read back");
        let triangles = report.after.as_ref().unwrap_or(&report.before);
        let triangles = triangles.triangles + triangles.nonfinite;
        report.output = Some(facts(&written, files::hash_of(written.bytes(), work.limits), triangles));
    } else {
        report.output = None;
        report.certificate = None;
    }
    package.check_unchanged()?;
    certify(&mut report);
    Ok(report)
}

/// Outcome and reasons that are of the package as a whole; whether there is something to write.
fn judge(package: &PackageFile, changed: &Changed, report: &mut Report, profile: &Profile) -> bool {
    if changed.is_none() {
        // Good as it came; or not good, and nothing in it could be repaired, or was to be.
        return report.outcome == Outcome::Clean || profile.repair;
    }
    if report.outcome == Outcome::Clean {
        report.outcome = Outcome::Repaired;
    }
    let sets = Counted(changed.objects_without_sets, "object", "objects");
    if changed.objects_without_sets > 0 {
        report.input.findings.push(format!(
            "sets of triangles of {sets} are left out: there are too many, or they are in a form that is not understood"
        ));
    }
    let triangles = changed.account.lost + changed.account.approximated;
    let harm = match changed.objects_without_sets {
        0 => carried::harm(changed.account),
        _ => Some(format!(
            "attributes of {} are lost or only about right, and sets of triangles of {sets} are left out",
            words::triangles(triangles)
        )),
    };
    if !carried::heed(report, profile, harm) {
        return false;
    }
    if package.is_signed() {
        carried::ask_for_review(report, "the package is signed, and no signature holds of a package that was changed".into());
    }
    true
}

fn facts(package: &PackageFile, blake3: String, triangles: u64) -> FileFacts {
    FileFacts {
        path: package.path().into(),
        bytes: package.bytes().len() as u64,
        blake3,
        format: Format::ThreeMf,
        unit: Some(package.unit().into()),
        triangles,
        findings: package.findings().iter().map(|finding| finding.text.clone()).collect(),
    }
}

fn nothing(package: &PackageFile) -> Error {
    Error::Unreadable { path: package.path().into(), reason: "a package without a mesh of triangles that is printed".into() }
}

impl Account {
    fn is_any(&self) -> bool {
        *self != Self::default()
    }
}
