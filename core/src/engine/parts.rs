//! Files of several meshes beside packages: the objects of an AMF, and the volumes in them.
//!
//! Each mesh becomes a nameless STL, which goes the way of a file; the results become one file again. Two meshes are never welded or united, not even if
//! they touch. Where the output's format holds one mesh alone, they stand in it one behind the other.

use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::Path;

use crate::contract::error::{Error, Result};
use crate::contract::report::{Outcome, Report, Task};
use crate::contract::settings::Limits;
use crate::engine::carried;
use crate::engine::clock::Clock;
use crate::engine::copying;
use crate::engine::formats::{self, Target, Whole};
use crate::engine::together::{Section, certify, together};
use crate::engine::work::Work;
use crate::engine::{files, judging, making, nameless_stl};
use crate::io::read::{HEADER_BYTES, MeshFile, PREFIX_BYTES, Part};
use crate::io::record::{self, Record};
use crate::io::rows::Said;
use crate::io::write_behind::{self, Nameless, WriteBehind};
use crate::output::model::Account;

/// Diagnoses every mesh of a file, and writes nothing.
///
/// # Errors
/// [`Error`], any of them.
pub(crate) fn inspect(mesh: &MeshFile, work: Work<'_>, clock: &mut Clock) -> Result<Report> {
    let mut sections = Vec::new();
    for part in mesh.parts() {
        let (own, _held) = spooled(mesh, part, work)?;
        let report = files::look(&own, (work.profile, work.limits), work.progress, clock)?;
        sections.push(section(mesh, part, sections.len(), report));
    }
    let mut report = together(&sections).ok_or_else(|| nothing(mesh))?;
    mesh.check_unchanged()?;
    report.task = Task::Inspect;
    report.input = files::facts(mesh, files::hash(mesh, work.limits, work.progress));
    let flaws = judging::flaws(mesh.findings());
    if !flaws.is_empty() {
        (report.verdict.good, report.outcome) = (false, Outcome::NotGood);
        report.verdict.reasons.extend(flaws);
    }
    certify(&mut report);
    Ok(report)
}

/// Repairs every mesh of the file `input` into the new file `output`.
///
/// # Errors
/// [`Error`], any of them.
pub(crate) fn repair(
    (mesh, input): (&MeshFile, &Path),
    output: &Path,
    target: Target,
    work: Work<'_>,
    clock: &mut Clock,
) -> Result<Report> {
    let Work { limits, progress, .. } = work;
    let mut results = Results::new(mesh, limits)?;
    let mut sections = Vec::new();
    for part in mesh.parts() {
        let report = mend(mesh, part, &mut results, work, clock)?;
        sections.push(section(mesh, part, sections.len(), report));
    }
    let mut report = together(&sections).ok_or_else(|| nothing(mesh))?;
    report.input = files::facts(mesh, files::hash(mesh, limits, progress));
    let is_copy = !results.differ && target.is_input && judging::flaws(mesh.findings()).is_empty();
    if !is_written(mesh, is_copy, results.differ, &mut report, work) {
        (report.output, report.certificate) = (None, None);
        return Ok(report);
    }
    let (made, parts, _held) = results.finish(mesh, work)?;
    let written = match target.layout {
        _ if is_copy => copying::copy(input, output, limits, progress)?,
        Some(layout) => {
            let whole = Whole { made: &made, title: mesh.title(), parts: &parts, input };
            formats::encode(&whole, output, layout, work, clock)?
        }
        None => copying::copy(made.path(), output, limits, progress)?,
    };
    mesh.check_unchanged()?;
    report.output = Some(files::facts(&written, files::hash(&written, limits, progress)));
    clock.stage("read back");
    certify(&mut report);
    Ok(report)
}

/// Is there a result? Tells of attributes.
fn is_written(mesh: &MeshFile, is_copy: bool, differ: bool, report: &mut Report, work: Work<'_>) -> bool {
    let triangles = Said::by(mesh).triangles(mesh.records().len());
    if triangles > 0 {
        let (kept, lost) = if is_copy { (triangles, 0) } else { (0, triangles) };
        let account = Account { kept, lost, ..Account::default() };
        report.attributes = Some(account.told());
        if !carried::heed(report, work.profile, carried::harm(account)) {
            return false;
        }
    }
    if !is_copy {
        if report.outcome == Outcome::Clean {
            // Good as it came, and yet other bytes.
            report.outcome = Outcome::Repaired;
        }
        carried::ask_if_doubtful(report, mesh.doubt());
    }
    // Good as it came; or not good, and what could be repaired of it is.
    differ || report.outcome == Outcome::Clean || work.profile.repair
}

/// Repairs one mesh, and appends what came of it.
fn mend(mesh: &MeshFile, part: &Part, results: &mut Results, work: Work<'_>, clock: &mut Clock) -> Result<Report> {
    let Work { limits, progress, .. } = work;
    let (own, _held) = spooled(mesh, part, work)?;
    let spool = Nameless::new(limits)?;
    let made = making::make(own, &spool.path(), true, work, clock)?;
    if made.report.output.is_some() {
        let result = files::open(&spool.path(), limits, progress)?;
        results.differ |= result.records() != made.mesh.as_it_came();
        results.append(&part.name, result.records())?;
    } else if made.mesh.as_it_came().iter().all(record::all_finite) {
        results.append(&part.name, made.mesh.as_it_came())?;
    } else {
        // No format writes what is no number.
        results.differ = true;
    }
    Ok(made.report)
}

fn spooled(mesh: &MeshFile, part: &Part, work: Work<'_>) -> Result<(MeshFile, Nameless)> {
    let records = mesh.records().get(part.triangles.clone()).unwrap_or_default();
    nameless_stl::open(mesh.path(), &mesh.output_header(), records, || (), work)
}

/// The report of the mesh of this number, from 0.
fn section(mesh: &MeshFile, part: &Part, number: usize, mut report: Report) -> Section {
    if mesh.unit().is_some() {
        judging::know_the_unit(&mut report);
    }
    Section { id: number as u32 + 1, name: part.name.clone(), part: String::new(), report }
}

fn nothing(mesh: &MeshFile) -> Error {
    Error::Unreadable { path: mesh.path().into(), reason: "no mesh".into() }
}

/// Results of all meshes, one behind the other in a nameless STL.
struct Results {
    file: File,
    behind: WriteBehind,
    parts: Vec<Part>,
    triangles: usize,
    /// One is not as it came.
    differ: bool,
    limits: Limits,
}

impl Results {
    fn new(mesh: &MeshFile, limits: &Limits) -> Result<Self> {
        let (file, behind) = write_behind::nameless(&limits.spool_folder(), limits)?;
        let results = Self { file, behind, parts: Vec::new(), triangles: 0, differ: false, limits: limits.clone() };
        // The count is known at the end.
        results.put(&mesh.output_header())?;
        results.put(&[0; PREFIX_BYTES - HEADER_BYTES])?;
        Ok(results)
    }

    fn put(&self, bytes: &[u8]) -> Result<()> {
        self.behind.append(bytes).map_err(Error::io(&self.limits.spool_folder(), "spooling"))
    }

    /// Appends a mesh; one without triangles is gone.
    fn append(&mut self, name: &str, records: &[Record]) -> Result<()> {
        records.chunks(1 << 14).try_for_each(|chunk| self.put(chunk.as_flattened()))?;
        let triangles = self.triangles..self.triangles + records.len();
        self.triangles = triangles.end;
        if !triangles.is_empty() {
            self.parts.push(Part { name: name.into(), triangles });
        }
        Ok(())
    }

    /// All of them as a file, and where each is in it.
    fn finish(self, mesh: &MeshFile, work: Work<'_>) -> Result<(MeshFile, Vec<Part>, Nameless)> {
        let folder = self.limits.spool_folder();
        let spooling = || Error::io(&folder, "spooling");
        self.behind.finish().map_err(spooling())?;
        let count = u32::try_from(self.triangles).map_err(|_| nothing(mesh))?;
        self.file.write_all_at(&count.to_le_bytes(), HEADER_BYTES as u64).map_err(spooling())?;
        let spool = Nameless::of(self.file);
        Ok((files::open(&spool.path(), work.limits, work.progress)?, self.parts, spool))
    }
}

#[cfg(test)]
mod tests;
