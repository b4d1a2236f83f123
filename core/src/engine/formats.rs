//! Results in other formats than STL.
//!
//! A mesh is repaired into a nameless STL, which is judged. Its triangles then become the output, which is read back and compared with them corner
//! by corner: so the verdict holds of the output, too. A file that is good as it comes, and of the output's format, is copied instead.

use std::path::Path;

use rayon::prelude::*;

use crate::contract::error::{Error, Result};
use crate::contract::progress::Progress;
use crate::contract::report::{Converted, Format, Report};
use crate::contract::settings::{Limits, OutputFormat, folder_of};
use crate::engine::carried;
use crate::engine::clock::Clock;
use crate::engine::files::{self, Made};
use crate::engine::work::Work;
use crate::geometry::position;
use crate::io::disk_space::{self, Need};
use crate::io::read::MeshFile;
use crate::io::record::{self, Record};
use crate::io::rows::Said;
use crate::io::write_behind::Nameless;
use crate::output::edit::Edit;
use crate::output::emit::{self, Content};
use crate::output::encode::{self, Layout};
use crate::output::indexed::Indexed;
use crate::output::model::Account;
use crate::output::rows::Planned;
use crate::util::parallel;
use crate::util::words::triangles;

/// The format of an output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Target {
    /// `None`: binary STL.
    pub(crate) layout: Option<Layout>,
    /// The input is of this format: where it is good, it is copied.
    pub(crate) is_input: bool,
}

/// The format of the result of an input of this format, where the profile wants `wanted`.
pub(crate) fn target(input: Format, unit: Option<&'static str>, wanted: OutputFormat) -> Target {
    let own = layout_of(input, unit);
    let layout = match wanted {
        OutputFormat::Input => own,
        OutputFormat::Stl => None,
        OutputFormat::Ply => Some(Layout::Ply),
        OutputFormat::Off => Some(Layout::Off),
        OutputFormat::Obj => Some(Layout::Obj),
        OutputFormat::Amf => Some(amf(unit)),
    };
    Target { layout, is_input: layout == own && input != Format::ThreeMf }
}

/// AMF has no centimeter, and another name for the foot; a file without a unit is one of millimeters to all printers.
fn amf(unit: Option<&'static str>) -> Layout {
    Layout::Amf(match unit {
        Some(unit @ ("inch" | "meter" | "micron")) => unit,
        Some("feet" | "foot") => "feet",
        _ => "millimeter",
    })
}

fn layout_of(format: Format, unit: Option<&'static str>) -> Option<Layout> {
    match format {
        // A package is written around its own text.
        Format::BinaryStl | Format::AsciiStl | Format::ThreeMf | Format::Memory => None,
        Format::Amf => Some(amf(unit)),
        Format::Obj => Some(Layout::Obj),
        Format::Ply => Some(Layout::Ply),
        Format::Off => Some(Layout::Off),
    }
}

/// Makes `mesh` of `input` the new file `output` in `layout`, by an STL that `make` writes. What the file says besides positions and faces is kept
/// where the output is of its format.
///
/// # Errors
/// [`Error`], any of them.
pub(crate) fn through_a_spool(
    (mesh, input): (MeshFile, &Path),
    output: &Path,
    (target, layout): (Target, Layout),
    work: Work<'_>,
    clock: &mut Clock,
    make: impl FnOnce(MeshFile, &Path, &mut Clock) -> Result<Made>,
) -> Result<Report> {
    let Work { profile, limits, progress } = work;
    check_space(&mesh, output, Some(layout), limits)?;
    let nameless = Nameless::new(limits)?;
    let spool = nameless.path();
    let made = make(mesh, &spool, clock)?;
    let mut report = made.report.clone();
    let Some(facts) = report.output.as_ref() else { return Ok(report) };
    let is_copy = target.is_input && facts.blake3 == report.input.blake3;
    let said = Said::by(&made.mesh);
    let planned = if target.is_input && !is_copy { carried::plan(&said, &made) } else { None };
    let triangles = made.mesh.records().len();
    let account = carried::account(&said, planned.as_ref(), triangles);
    let account = account.map(|account| if is_copy { Account { kept: triangles as u64, ..Account::default() } } else { account });
    report.attributes = account.map(Account::told);
    if !carried::heed(&mut report, profile, account.and_then(carried::harm)) {
        return Ok(report);
    }
    let written =
        if is_copy { copy(input, output, limits, progress)? } else { write(&spool, output, (planned, layout), work, clock)? };
    let facts = files::facts(&written, files::hash(&written, limits, progress));
    if is_copy && facts.blake3 != report.input.blake3 {
        return Err(Error::Changed { path: input.into() });
    }
    clock.stage("read back");
    if let Some(certificate) = &mut report.certificate {
        (certificate.blake3, certificate.bytes) = (facts.blake3.clone(), facts.bytes);
    }
    report.output = Some(facts);
    Ok(report)
}

/// Writes the STL `spool` to the new file `output`, in the rows of its file where there is a plan of that, and reads it back.
fn write(
    spool: &Path,
    output: &Path,
    (planned, layout): (Option<Planned<'_>>, Layout),
    Work { limits, progress, .. }: Work<'_>,
    clock: &mut Clock,
) -> Result<MeshFile> {
    let made = files::open(spool, limits, progress)?;
    let written = match &planned {
        Some(planned) => carried::write(planned, output, limits, progress)?,
        None => encode(&made, output, layout, limits, progress)?,
    };
    clock.stage("encode");
    match &planned {
        Some(planned) => carried::confirm(planned, &made, &written)?,
        None => confirm(&made, &written, limits)?,
    }
    Ok(written)
}

/// Writes the triangles of the file `input` to the new file `output` in another format, and changes nothing of them. A file that has this format is
/// copied.
///
/// # Errors
/// [`Error`], any of them; [`Error::Refused`] for a triangle that no format but STL can hold.
pub(crate) fn convert(
    input: &Path,
    output: &Path,
    format: OutputFormat,
    limits: &Limits,
    progress: &dyn Progress,
) -> Result<Converted> {
    let limits = &limits.spooling_beside(output);
    let mesh = files::open(input, limits, progress)?;
    let target = target(mesh.format(), mesh.unit(), format);
    check_space(&mesh, output, target.layout, limits)?;
    let written = match target.layout {
        Some(layout) if !target.is_input => {
            refuse_infinite(&mesh)?;
            let written = encode(&mesh, output, layout, limits, progress)?;
            confirm(&mesh, &written, limits)?;
            written
        }
        None if !target.is_input => {
            let edit = Edit::default();
            let made = emit::draft(&mesh, output, limits, progress, |draft| draft.finish(&Content::Edited(&edit)));
            made?.0.durable()?;
            let written = files::open(output, limits, progress)?;
            confirm(&mesh, &written, limits)?;
            written
        }
        _ => copy(input, output, limits, progress)?,
    };
    mesh.check_unchanged()?;
    let facts = |mesh: &MeshFile| files::facts(mesh, files::hash(mesh, limits, progress));
    Ok(Converted { input: facts(&mesh), output: facts(&written) })
}

/// No decimal number is infinite, nor none at all.
fn refuse_infinite(mesh: &MeshFile) -> Result<()> {
    let count = mesh.records().iter().filter(|record| !record::all_finite(record)).count();
    if count == 0 {
        return Ok(());
    }
    Err(Error::Refused {
        path: mesh.path().into(),
        reason: format!("{} with coordinates that are no finite numbers", triangles(count as u64)),
        advice: "`suture repair` leaves them out".into(),
    })
}

/// Is there room for the output? (That for the STL is looked at when it is written.)
fn check_space(mesh: &MeshFile, output: &Path, layout: Option<Layout>, limits: &Limits) -> Result<()> {
    let folder = if emit::is_nameless(output) { limits.spool_folder() } else { folder_of(output).into() };
    let each = layout.map_or(size_of::<Record>() as u64, Layout::bytes_a_triangle);
    let bytes = (mesh.records().len() as u64 * each).max(mesh.byte_len());
    disk_space::check(mesh.path(), &[Need { folder, bytes, what: "the output" }])
}

/// Copies the file `input` to the new file `output`, and opens the copy.
pub(crate) fn copy(input: &Path, output: &Path, limits: &Limits, progress: &dyn Progress) -> Result<MeshFile> {
    let mesh = files::open(input, limits, progress)?;
    let (written, _) = emit::draft(&mesh, output, limits, progress, |draft| draft.finish(&Content::Input))?;
    written.durable()?;
    mesh.check_unchanged()?;
    files::open(output, limits, progress)
}

fn encode(made: &MeshFile, output: &Path, layout: Layout, limits: &Limits, progress: &dyn Progress) -> Result<MeshFile> {
    let indexed = Indexed::of(output, made.records(), limits, progress)?;
    let name = concat!("Suture ", env!("CARGO_PKG_VERSION"));
    encode::write((&indexed, made.records().len()), (layout, name), output, limits, progress)?;
    drop(indexed);
    files::open(output, limits, progress)
}

/// Does the written file hold the triangles that were made?
fn confirm(made: &MeshFile, written: &MeshFile, limits: &Limits) -> Result<()> {
    let same = |(a, b): (&Record, &Record)| position::corners(a).map(position::bits) == position::corners(b).map(position::bits);
    let (made, records) = (made.records(), written.records());
    let holds = parallel::in_pool(limits.threads, || made.len() == records.len() && made.par_iter().zip(records).all(same));
    if !holds || !written.is_flawless() {
        let source = std::io::Error::other("the file does not hold what was written to it");
        return Err(Error::io(written.path(), "reading back")(source));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_profile_decides_and_else_the_input() {
        let of = |wanted| target(Format::AsciiStl, None, wanted);
        assert_eq!(of(OutputFormat::Ply), Target { layout: Some(Layout::Ply), is_input: false });
        assert_eq!([of(OutputFormat::Input), of(OutputFormat::Stl)], [Target { layout: None, is_input: true }; 2]);
    }
}
