//! What becomes of the files of a folder when every program is asked for a solid: printable or not, what is kept of the surface, how
//! far it moved, and whether all bodies are still there.

use std::path::{Path, PathBuf};

use suture_bench::judge::{self, Bodies, Solid};

use super::child::{self, Ended};
use super::closing::{Bench, Options};
use super::error::Error;
use super::folders::{name_of, read_or_say};
use super::made::{Report, Solved};
use super::record::Line;
use super::sides::Side;
use super::way::Way;
use crate::holes;
use crate::mesh;

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
        let name = name_of(path);
        let is_done = |side: Side, program: &str| {
            bench.journal.has(|line| matches!(line, Line::Solved(done) if (done.file.as_str(), done.side, done.program.as_str()) == (&name, side, program)))
        };
        let due: Vec<_> = present.iter().filter(|(side, program)| again || !is_done(*side, program)).collect();
        if due.is_empty() {
            continue;
        }
        // All are given the same finite triangles in the same binary format.
        let Some(triangles) = read_or_say(path) else { continue };
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
    bench.journal.retain_newest(|line| match line {
        Line::Solved(done) => Some((done.file.clone(), done.side)),
        _ => None,
    })
}

/// The judge's word on an output, and its triangles.
fn look(output: &Path) -> (Option<Solid>, Option<Vec<mesh::Triangle>>) {
    match judge::solid(output) {
        Ok(found) => (Some(found), mesh::read(output).ok()),
        Err(_) => (None, None),
    }
}
