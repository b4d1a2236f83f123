//! Results in other formats than STL.
//!
//! A mesh is repaired into a nameless STL, which is judged. Its triangles then become the output, which is read back and compared with them corner
//! by corner: so the verdict holds of the output, too. A file that is good as it comes, and of the output's format, is copied instead.

use std::os::fd::AsRawFd;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use crate::contract::error::{Error, Result};
use crate::contract::progress::Progress;
use crate::contract::report::{Format, Report};
use crate::contract::settings::{Limits, folder_of};
use crate::engine::clock::Clock;
use crate::engine::files;
use crate::geometry::position;
use crate::io::disk_space::{self, Need};
use crate::io::read::MeshFile;
use crate::io::record::Record;
use crate::io::write_behind;
use crate::output::emit::{self, Content};
use crate::output::encode::{self, Layout};
use crate::output::indexed::Indexed;
use crate::util::parallel;

/// The format of an output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Target {
    /// `None`: binary STL.
    pub(crate) layout: Option<Layout>,
    /// The input is of this format: where it is good, it is copied.
    pub(crate) is_input: bool,
}

/// The format that `output` is to have: that of its name's ending; a name without a known one takes the input's.
pub(crate) fn target(input: Format, output: &Path) -> Target {
    let ending = output.extension().map(|ending| ending.to_ascii_lowercase());
    let own = layout_of(input);
    let layout = match ending.as_deref().and_then(|ending| ending.to_str()) {
        Some("stl") => None,
        Some("ply") => Some(Layout::Ply),
        Some("off") => Some(Layout::Off),
        Some("obj") => Some(Layout::Obj),
        Some("amf") => Some(Layout::Amf("millimeter")),
        _ => own,
    };
    Target { layout, is_input: layout == own }
}

fn layout_of(format: Format) -> Option<Layout> {
    match format {
        Format::BinaryStl | Format::AsciiStl | Format::Memory => None,
        Format::Ply => Some(Layout::Ply),
        Format::Off => Some(Layout::Off),
    }
}

/// Makes `mesh` of `input` the new file `output` in `layout`, by an STL that `make` writes.
///
/// # Errors
/// [`Error`], any of them.
pub(crate) fn through_a_spool(
    (mesh, input): (MeshFile, &Path),
    output: &Path,
    (target, layout): (Target, Layout),
    limits: &Limits,
    progress: &dyn Progress,
    clock: &mut Clock,
    make: impl FnOnce(MeshFile, &Path, &mut Clock) -> Result<Report>,
) -> Result<Report> {
    check_space(&mesh, output, layout, limits)?;
    let (file, _) = write_behind::nameless(&limits.spool_folder(), limits)?;
    let spool = PathBuf::from(format!("/proc/self/fd/{}", file.as_raw_fd()));
    let mut report = make(mesh, &spool, clock)?;
    let Some(made) = report.output.as_ref() else { return Ok(report) };
    let is_copy = target.is_input && made.blake3 == report.input.blake3;
    let written = if is_copy {
        copy(input, output, limits, progress)?
    } else {
        let made = files::open(&spool, limits, progress)?;
        let written = encode(&made, output, layout, limits, progress)?;
        clock.stage("encode");
        confirm(&made, &written, limits)?;
        written
    };
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

/// Is there room for the output? (That for the STL is looked at when it is written.)
fn check_space(mesh: &MeshFile, output: &Path, layout: Layout, limits: &Limits) -> Result<()> {
    let folder = if emit::is_nameless(output) { limits.spool_folder() } else { folder_of(output).into() };
    let bytes = (mesh.records().len() as u64 * layout.bytes_a_triangle()).max(mesh.byte_len());
    disk_space::check(mesh.path(), &[Need { folder, bytes, what: "the output" }])
}

/// Copies the file `input` to the new file `output`.
fn copy(input: &Path, output: &Path, limits: &Limits, progress: &dyn Progress) -> Result<MeshFile> {
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
    fn the_ending_of_a_name_decides_and_else_the_input() {
        let of = |name: &str| target(Format::BinaryStl, Path::new(name));
        assert_eq!(of("a.PLY"), Target { layout: Some(Layout::Ply), is_input: false });
        assert_eq!(of("a.b.stl"), Target { layout: None, is_input: true });
        assert_eq!([of("part"), of("/proc/self/fd/7"), of("a.bin")], [of("a.stl"); 3]);
    }
}
