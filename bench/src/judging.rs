//! The judge's word on one file, on the terminal.

use std::error::Error;
use std::path::Path;
use std::process::ExitCode;

use suture_bench::judge::{self, Judgement, Same};

use crate::compare::Judged;
use crate::mesh;

/// Prints what is to be said of a binary STL by itself, or beside the input it was made from. Exit code 1: it is not sound.
///
/// # Errors
/// When a file cannot be read.
pub(crate) fn judge_file(file: &Path, reference: Option<&Path>, json: bool) -> Result<ExitCode, Box<dyn Error>> {
    let judgement = judge::judge(file)?;
    if !json {
        let yes = |good| if good { "yes" } else { "no" };
        let Judgement { counts, .. } = judgement;
        println!("{judgement:#?}");
        println!("closed {}, manifold {}, oriented {}", yes(counts.closed()), yes(counts.manifold()), yes(counts.oriented()));
    }
    if let Some(reference) = reference {
        let records = judge::kept_in_order(reference, file, Same::Record)?;
        let corners = judge::kept_in_order(reference, file, Same::Corners)?;
        if json {
            println!("{}", serde_json::to_string(&Judged { judgement, records, corners })?);
        } else {
            println!("of {} records kept in order: {} whole, {} by corners", records.of, records.in_order, corners.in_order);
        }
    }
    Ok(ExitCode::from(u8::from(!judgement.sound())))
}

/// Prints how far a file is from what was meant.
///
/// # Errors
/// When a file cannot be read.
pub(crate) fn judge_intended(file: &Path, intended: &Path) -> Result<ExitCode, Box<dyn Error>> {
    let (triangles, intended) = (mesh::read(file)?, mesh::read(intended)?);
    println!("{:#?}", judge::fidelity(&triangles, &intended));
    println!("bodies: {}", judge::judge_triangles(&triangles).positive_bodies);
    Ok(ExitCode::SUCCESS)
}

/// Prints what of the skin of `before` is lost.
///
/// # Errors
/// When a file cannot be read.
pub(crate) fn judge_skin(file: &Path, before: &Path) -> Result<ExitCode, Box<dyn Error>> {
    println!("{:#?}", judge::skin(&mesh::read(before)?, &mesh::read(file)?));
    Ok(ExitCode::SUCCESS)
}

/// Prints the fault that keeps a file from being printed. Exit code 1: there is one.
///
/// # Errors
/// When a file cannot be read.
pub(crate) fn judge_solid(file: &Path) -> Result<ExitCode, Box<dyn Error>> {
    let found = judge::solid(file)?;
    match found.fault() {
        Some(fault) => println!("not printable: {} ({} triangles cross or overlap)", fault.name(), found.meeting),
        None => println!("printable"),
    }
    Ok(ExitCode::from(u8::from(found.fault().is_some())))
}
