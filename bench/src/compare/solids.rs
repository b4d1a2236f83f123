//! What becomes of the files of a folder when every program is asked for a solid: printable or not, what is kept of the surface, how
//! far it moved, and whether all bodies are still there.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use suture_bench::judge::{self, Bodies, BodiesFound, Fault, Solid};

use super::child::{self, Ended};
use super::closing::{Bench, Options};
use super::record::{Journal, Line, Way};
use super::{Error, Side};
use crate::holes::{self, Change};
use crate::mesh;

/// What one program made of one file.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Solved {
    /// Its name.
    pub(crate) file: String,
    pub(crate) triangles: u64,
    /// Some component of the file encloses something, as it is or when its rims are closed.
    pub(crate) may_be_solid: bool,
    /// What keeps the file itself from being printed.
    pub(crate) before: Option<String>,
    /// Signed volume of the file; means something only where it is closed and oriented.
    pub(crate) volume: f64,
    pub(crate) side: Side,
    /// What ran: a version, and the hash of the binary or the script.
    pub(crate) program: String,
    /// How the process ended, and with which exit code.
    pub(crate) end: String,
    pub(crate) code: Option<i32>,
    /// Until the output was on the disk.
    pub(crate) seconds: f64,
    /// The judge's word on the output; `None`: there is none that can be read.
    pub(crate) after: Option<Solid>,
    /// Why there is none.
    #[serde(default)]
    pub(crate) complaint: String,
    pub(crate) change: Option<Change>,
    pub(crate) bodies: Option<BodiesFound>,
    /// Of suture: what its report says.
    pub(crate) report: Option<Report>,
}

/// Of a report of suture's.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Report {
    /// `clean`, `repaired`, `needs_review` or `not_good`.
    pub(crate) outcome: String,
    /// Its certificate's word.
    pub(crate) printable: bool,
    /// Regions that were wrapped.
    pub(crate) wraps: u64,
    /// Why it is not good, or needs review.
    pub(crate) reasons: Vec<String>,
}

impl Solved {
    /// It can be printed, by the judge's word.
    pub(crate) fn is_printable(&self) -> bool {
        self.after.as_ref().is_some_and(|after| after.fault().is_none())
    }

    /// What keeps it from being printed.
    pub(crate) fn reason(&self) -> String {
        match &self.after {
            Some(after) => after.fault().map_or(String::new(), |fault| match fault {
                Fault::SelfIntersecting => format!("{}, {} triangles", fault.name(), after.meeting),
                Fault::Open => format!("{}, {} edges", fault.name(), after.judgement.counts.boundary_edges),
                _ => fault.name().into(),
            }),
            None if self.complaint.is_empty() => format!("nothing written, {}", self.end),
            None => format!("nothing written: {}", self.complaint),
        }
    }

    /// Farthest that the surface is from the other, either way, as a share of the diagonal.
    pub(crate) fn distance(&self) -> Option<f64> {
        self.change.map(|change| change.taken.max(change.added))
    }
}

impl Report {
    /// `None` when a program said no report.
    fn read(said: &str) -> Option<Self> {
        let report: serde_json::Value = serde_json::from_str(said).ok()?;
        let reasons = report["verdict"]["reasons"].as_array().into_iter().flatten();
        Some(Self {
            outcome: report["outcome"].as_str()?.into(),
            printable: report["certificate"]["printable"].as_bool().unwrap_or(false),
            wraps: report["wraps"].as_array().map_or(0, |wraps| wraps.len() as u64),
            reasons: reasons.filter_map(|reason| reason.as_str().map(Into::into)).collect(),
        })
    }
}

/// Has `sides` make a solid of each of `files`, and adds what came out to the raw file. What the same program did with a file of the
/// same name already is not run again, unless `again` is said.
///
/// # Errors
/// When suture cannot be built, or the system fails. A file that is no STL is named and left out.
pub(crate) fn solids(options: &Options, files: &[PathBuf], sides: &[Side], again: bool) -> Result<(), Error> {
    let mut bench = Bench::open(options, sides)?;
    let mut present = Vec::new();
    for &side in sides.iter().filter(|&&side| bench.has(side)) {
        present.push((side, bench.programs.identity(side)?));
    }
    let (input, output) = (bench.folder.path().join("in.stl"), bench.folder.path().join("out.stl"));
    for path in files {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let due: Vec<_> =
            present.iter().filter(|(side, program)| again || !is_done(&bench.journal, &name, *side, program)).collect();
        if due.is_empty() {
            continue;
        }
        // All are given the same finite triangles in the same binary format.
        let Some(triangles) = mesh::read(path).ok().filter(|triangles| !triangles.is_empty()) else {
            eprintln!("{name} is no STL, or an empty one");
            continue;
        };
        mesh::write(&input, &triangles).map_err(Error::Mesh)?;
        let before = judge::solid(&input).map_err(|error| Error::Mesh(error.to_string()))?;
        let (volume, before) = (before.judgement.volume, before.fault().map(|fault| fault.name().to_owned()));
        let bodies = Bodies::of(&triangles);
        eprintln!("{name}, {} triangles", triangles.len());
        for (side, program) in due {
            let command = bench.programs.command(&Way::plain(*side), 1, &input, &output);
            let Ended { cost, said } = child::measure(command, Some(&output), true, options.limit)?;
            let (after, made) = if cost.exited { look(&output) } else { (None, None) };
            let complaint = cost.complaint.lines().last().unwrap_or_default().replace(&*input.to_string_lossy(), "IN");
            let solved = Solved {
                file: name.clone(),
                triangles: triangles.len() as u64,
                may_be_solid: bodies.may_be_solid(),
                before: before.clone(),
                volume,
                side: *side,
                program: program.clone(),
                end: cost.end,
                code: cost.code,
                seconds: cost.wall_seconds,
                complaint: if after.is_none() { complaint } else { String::new() },
                after,
                change: made.as_ref().filter(|made| !made.is_empty()).map(|made| holes::change(&triangles, made)),
                bodies: made.as_ref().map(|made| bodies.find_in(made)),
                report: if side.is_suture() { Report::read(&said) } else { None },
            };
            let verdict = if solved.is_printable() { "printable".into() } else { solved.reason() };
            eprintln!("  {:20} {:>9.3} s  {}, {verdict}", side.facts().name, solved.seconds, solved.end);
            bench.journal.write(Line::Solved(Box::new(solved)))?;
            if output.exists() {
                std::fs::remove_file(&output).map_err(Error::io("removing an output"))?;
            }
        }
    }
    bench.journal.retain(newest)
}

/// Of all lines about a file and a side, the last one; and all other lines.
fn newest(lines: &[Line]) -> Vec<bool> {
    let mut seen = HashSet::new();
    let mut keep: Vec<bool> = lines
        .iter()
        .rev()
        .map(|line| match line {
            Line::Solved(done) => seen.insert((&done.file, done.side)),
            _ => true,
        })
        .collect();
    keep.reverse();
    keep
}

/// The judge's word on an output, and its triangles.
fn look(output: &Path) -> (Option<Solid>, Option<Vec<mesh::Triangle>>) {
    match judge::solid(output) {
        Ok(found) => (Some(found), mesh::read(output).ok()),
        Err(_) => (None, None),
    }
}

fn is_done(journal: &Journal, file: &str, side: Side, program: &str) -> bool {
    journal.lines.iter().any(|line| match line {
        Line::Solved(done) => done.file == file && done.side == side && done.program == program,
        _ => false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_is_read_as_far_as_it_is_needed() {
        let said = r#"{"outcome": "needs_review", "certificate": {"printable": true}, "wraps": [{}, {}], "verdict": {"reasons": ["far"]}}"#;
        let report = Report::read(said).unwrap();
        assert_eq!((report.outcome.as_str(), report.printable, report.wraps), ("needs_review", true, 2));
        assert_eq!(report.reasons, ["far"]);
        let plain = Report::read(r#"{"outcome": "clean"}"#).unwrap();
        assert_eq!((plain.printable, plain.wraps), (false, 0));
        assert!(Report::read("").is_none());
    }
}
