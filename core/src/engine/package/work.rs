//! Settings of a work on a package, and the reports of its meshes.

use super::units::UnitOf;
use crate::contract::hint::HintKind;
use crate::contract::progress::Progress;
use crate::contract::report::{Outcome, Report, Task};
use crate::contract::settings::{Limits, Profile};
use crate::engine::judging;
use crate::engine::together::Section;
use crate::io::read::{Finding, PackageFile};

/// Settings of a work on a package.
#[derive(Clone, Copy)]
pub(crate) struct Work<'a> {
    pub(crate) profile: &'a Profile,
    pub(crate) limits: &'a Limits,
    pub(crate) progress: &'a dyn Progress,
}

/// The report of one mesh as a section of the package's.
pub(super) fn section(package: &PackageFile, unit: &UnitOf, mut report: Report, findings: &[Finding]) -> Section {
    // A package says its unit.
    report.hints.retain(|hint| !matches!(hint.kind, HintKind::Inches | HintKind::Metres));
    let flaws = judging::flaws(findings);
    report.input.findings = findings.iter().map(|finding| finding.text.clone()).collect();
    if report.task == Task::Inspect && !flaws.is_empty() {
        report.verdict.good = false;
        report.outcome = Outcome::NotGood;
        report.verdict.reasons.extend(flaws);
    }
    let (id, name, part) = package.names(unit.place);
    let name = if unit.volume.is_empty() { name } else { [name.as_str(), unit.volume.as_str()].join(" ").trim().to_owned() };
    Section { id, name, part, report }
}
