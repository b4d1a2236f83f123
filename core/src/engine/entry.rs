//! What a file becomes: by its own format, and by that of the result.

use std::path::Path;

use crate::contract::error::Result;
use crate::contract::progress::Progress;
use crate::contract::report::Report;
use crate::contract::settings::{Limits, Profile};
use crate::engine::clock::Clock;
use crate::engine::package;
use crate::engine::parts;
use crate::engine::work::Work;
use crate::engine::{files, formats, judging, making};
use crate::io::read::PackageFile;

/// Diagnoses `input` and writes nothing.
///
/// # Errors
/// [`crate::Error`], any of them; [`crate::Error::Profile`] before the file is opened.
pub(crate) fn inspect(input: &Path, profile: &Profile, limits: &Limits, progress: &dyn Progress) -> Result<Report> {
    let mut clock = Clock::start();
    judging::validate(input, profile)?;
    let limits = &limits.spooling_beside(input);
    if let Some(package) = PackageFile::open(input, limits, progress)? {
        let report = package::inspect(&package, Work { profile, limits, progress }, &mut clock)?;
        let triangles = report.input.triangles as usize;
        return clock.close(report, input, triangles);
    }
    let mesh = files::open(input, limits, progress)?;
    clock.stage("read");
    let report = if mesh.parts().len() < 2 {
        files::look(&mesh, (profile, limits), progress, &mut clock)?
    } else {
        parts::inspect(&mesh, Work { profile, limits, progress }, &mut clock)?
    };
    clock.close(report, mesh.path(), mesh.records().len())
}

/// Repairs `input` into the new file `output`, in the format that the profile names.
///
/// # Errors
/// [`crate::Error`], any of them; [`crate::Error::Profile`] before the file is opened.
pub(crate) fn repair(input: &Path, output: &Path, profile: &Profile, limits: &Limits, progress: &dyn Progress) -> Result<Report> {
    let mut clock = Clock::start();
    judging::validate(input, profile)?;
    let limits = &limits.spooling_beside(output);
    if let Some(package) = PackageFile::open(input, limits, progress)? {
        let report = package::repair_as(&package, output, Work { profile, limits, progress }, &mut clock)?;
        let triangles = report.input.triangles as usize;
        return clock.close(report, input, triangles);
    }
    let mesh = files::open(input, limits, progress)?;
    let triangles = mesh.records().len();
    let target = formats::target(mesh.format(), mesh.unit(), profile.format);
    let report = match target.layout {
        _ if mesh.parts().len() > 1 => {
            clock.stage("read");
            parts::repair((&mesh, input), output, target, Work { profile, limits, progress }, &mut clock)?
        }
        None => formats::into_stl(mesh, output, target, Work { profile, limits, progress }, &mut clock)?,
        Some(layout) => {
            let make = |mesh, spool: &Path, clock: &mut Clock| {
                making::make(mesh, spool, target.is_input, Work { profile, limits, progress }, clock)
            };
            formats::through_a_spool(
                (mesh, input),
                output,
                (target, layout),
                Work { profile, limits, progress },
                &mut clock,
                make,
            )?
        }
    };
    clock.close(report, input, triangles)
}
