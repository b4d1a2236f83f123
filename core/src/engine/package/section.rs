//! The report of one mesh of a package.

use super::units::UnitOf;
use crate::contract::report::{Outcome, Report, Task};
use crate::engine::judging;
use crate::engine::together::Section;
use crate::io::read::{Finding, PackageFile};

/// The report of one mesh as a section of the package's.
pub(super) fn section(package: &PackageFile, unit: &UnitOf, mut report: Report, findings: &[Finding]) -> Section {
    // A package says its unit.
    judging::know_the_unit(&mut report);
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
