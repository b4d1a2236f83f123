//! Results in other formats than STL.
//!
//! A mesh is repaired into a nameless STL, which is judged. Its triangles then become the output, which is read back and compared with them corner
//! by corner: so the verdict holds of the output, too. A file that is good as it comes, and of the output's format, is copied instead.

use std::path::Path;

use rayon::prelude::*;

use crate::contract::error::{Error, Result};
use crate::contract::progress::Progress;
use crate::contract::report::{Converted, Format, Report};
use crate::contract::settings::{KeepAttributes, Limits, OutputFormat, Profile, folder_of};
use crate::engine::carried;
use crate::engine::clock::Clock;
use crate::engine::copying;
use crate::engine::files::{self, Made};
use crate::engine::making;
use crate::engine::work::Work;
use crate::geometry::position;
use crate::io::disk_space::{self, Need};
use crate::io::read::{MeshFile, Part};
use crate::io::record::{self, Record};
use crate::io::rows::Said;
use crate::io::write_behind::Nameless;
use crate::output::edit::Edit;
use crate::output::emit::{self, Content};
use crate::output::encode::{self, Body, Heading, Layout};
use crate::output::indexed::Indexed;
use crate::output::model::Account;
use crate::output::rows::Planned;
use crate::util::parallel;
use crate::util::words::triangles;

/// Triangles that are compared before their pages may go.
const COMPARED: usize = 1 << 18;

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
        OutputFormat::ThreeMf => Some(three_mf(unit)),
    };
    let is_input = match input {
        Format::ThreeMf => matches!(wanted, OutputFormat::Input | OutputFormat::ThreeMf),
        _ => layout == own,
    };
    Target { layout, is_input }
}

/// AMF has no centimeter, and another name for the foot; a file without a unit is one of millimeters to all printers.
fn amf(unit: Option<&'static str>) -> Layout {
    Layout::Amf(match unit {
        Some(unit @ ("inch" | "meter" | "micron")) => unit,
        Some("feet" | "foot") => "feet",
        _ => "millimeter",
    })
}

/// 3MF has the units of all other formats.
fn three_mf(unit: Option<&'static str>) -> Layout {
    Layout::ThreeMf(match unit {
        Some(unit @ ("micron" | "centimeter" | "inch" | "foot" | "meter")) => unit,
        Some("feet") => "foot",
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

/// Makes `mesh` the new STL `output`, in which attribute words of an STL have a place, and nothing else that a file says besides positions and faces.
///
/// # Errors
/// [`Error`], any of them.
pub(crate) fn into_stl(mesh: MeshFile, output: &Path, target: Target, work: Work<'_>, clock: &mut Clock) -> Result<Report> {
    let Work { profile, limits, progress } = work;
    let says = if target.is_input { None } else { Some(Said::by(&mesh).triangles(mesh.records().len())) };
    // A result that the profile refuses is never at its place.
    let is_at_risk = profile.attributes == KeepAttributes::Refuse && says.unwrap_or_else(|| mesh.coloured()) > 0;
    let nameless = if is_at_risk { Some(Nameless::new(limits)?) } else { None };
    let spool = nameless.as_ref().map(Nameless::path);
    let doubt = mesh.doubt();
    let made = making::make(mesh, spool.as_deref().unwrap_or(output), target.is_input, work, clock)?;
    let Made { mut report, mesh, edit, .. } = made;
    carried::ask_if_doubtful(&mut report, doubt);
    if report.output.is_none() {
        return Ok(report);
    }
    let account = match says {
        None => carried::words_account(&mesh, &edit, profile),
        Some(lost) => (lost > 0).then(|| Account { lost, ..Account::default() }),
    };
    report.attributes = account.map(Account::told);
    if !carried::heed(&mut report, profile, account.and_then(carried::harm)) {
        return Ok(report);
    }
    if let Some(spool) = spool {
        let written = copying::copy(&spool, output, limits, progress)?;
        report.output = Some(files::facts(&written, files::hash(&written, limits, progress)));
    }
    Ok(report)
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
    carried::ask_if_doubtful(&mut report, made.mesh.doubt());
    let Some(facts) = report.output.as_ref() else { return Ok(report) };
    let is_copy = target.is_input && facts.blake3 == report.input.blake3;
    let said = Said::by(&made.mesh);
    let planned = if target.is_input && !is_copy { carried::plan(&said, &made) } else { None };
    let triangles = made.mesh.records().len();
    let account = carried::account(&said, planned.as_ref(), triangles);
    let kept = || Account { kept: said.triangles(triangles), ..Account::default() };
    let account = account.map(|account| if is_copy { kept() } else { account });
    report.attributes = account.map(Account::told);
    if !carried::heed(&mut report, profile, account.and_then(carried::harm)) {
        return Ok(report);
    }
    let written = if is_copy {
        copying::copy(input, output, limits, progress)?
    } else {
        let judged = files::open(&spool, limits, progress)?;
        write(&Whole { made: &judged, ..Whole::of(&made.mesh, input) }, output, (planned, layout), work, clock)?
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

/// A mesh that is written, and what its file says of it.
pub(crate) struct Whole<'a> {
    /// Its triangles.
    pub(crate) made: &'a MeshFile,
    /// As [`MeshFile::title`].
    pub(crate) title: &'a str,
    /// Meshes of their own, if there are several, as they are in `made`; of one alone, its name counts.
    pub(crate) parts: &'a [Part],
    /// Refusals name it.
    pub(crate) input: &'a Path,
}

impl<'a> Whole<'a> {
    /// A file as it stands.
    fn of(mesh: &'a MeshFile, input: &'a Path) -> Self {
        Self { made: mesh, title: mesh.title(), parts: mesh.parts(), input }
    }
}

/// Writes a mesh to the new file `output`, in the rows of its file where there is a plan of that, and reads it back.
fn write(
    whole: &Whole<'_>,
    output: &Path,
    (planned, layout): (Option<Planned<'_>>, Layout),
    work: Work<'_>,
    clock: &mut Clock,
) -> Result<MeshFile> {
    let Work { limits, progress, .. } = work;
    let Some(planned) = &planned else { return encode(whole, output, layout, work, clock) };
    let written = carried::write(planned, output, limits, progress)?;
    clock.stage("encode");
    carried::confirm(planned, whole.made, &written)?;
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
            refuse_unit(input, mesh.unit(), format)?;
            let work = Work { profile: &Profile::default(), limits, progress };
            encode(&Whole::of(&mesh, input), output, layout, work, &mut Clock::start())?
        }
        None if !target.is_input => {
            let edit = Edit::default();
            emit::write(&mesh, output, &Content::Edited(&edit), limits, progress)?.durable()?;
            let written = files::open(output, limits, progress)?;
            confirm(&mesh, &written, limits)?;
            written
        }
        _ => copying::copy(input, output, limits, progress)?,
    };
    mesh.check_unchanged()?;
    let facts = |mesh: &MeshFile| files::facts(mesh, files::hash(mesh, limits, progress));
    let attributes_lost = if target.is_input { 0 } else { Said::by(&mesh).triangles(mesh.records().len()) };
    let mut facts_of_input = facts(&mesh);
    if !target.is_input {
        facts_of_input.findings.extend_from_slice(mesh.left_out());
    }
    Ok(Converted { input: facts_of_input, output: facts(&written), attributes_lost })
}

/// AMF has no centimetre (ISO/ASTM 52915:2020, section 5.2): its readers would take other lengths.
pub(crate) fn refuse_unit(path: &Path, unit: Option<&str>, format: OutputFormat) -> Result<()> {
    if format != OutputFormat::Amf || unit != Some("centimeter") {
        return Ok(());
    }
    Err(Error::Refused {
        path: path.into(),
        reason: "coordinates in centimetres, a unit that AMF does not have".into(),
        advice: "take 3MF for the result".into(),
    })
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

/// The three vertices of a 3MF's triangle must be distinct (3MF Core 1.3, section 4.1: Triangle), and readers refuse a package where they are not.
fn refuse_repeated(mesh: &MeshFile, path: &Path, layout: Layout, limits: &Limits) -> Result<()> {
    if !matches!(layout, Layout::ThreeMf(_)) {
        return Ok(());
    }
    let is_repeated = |record: &&Record| {
        let [a, b, c] = position::corners(record).map(position::bits);
        a == b || b == c || c == a
    };
    let count = parallel::in_pool(limits.threads, || mesh.records().par_iter().filter(is_repeated).count());
    if count == 0 {
        return Ok(());
    }
    Err(Error::Refused {
        path: path.into(),
        reason: format!("{} with two corners at one place, which 3MF does not allow", triangles(count as u64)),
        advice: "`suture repair` takes them out, and other formats hold them".into(),
    })
}

/// Is there room for the output? (That for the STL is looked at when it is written.)
fn check_space(mesh: &MeshFile, output: &Path, layout: Option<Layout>, limits: &Limits) -> Result<()> {
    let folder = if emit::is_nameless(output) { limits.spool_folder() } else { folder_of(output).into() };
    let each = layout.map_or(size_of::<Record>() as u64, Layout::bytes_a_triangle);
    let triangles = mesh.records().len() as u64;
    let mut needs = vec![Need { folder, bytes: (triangles * each).max(mesh.byte_len()), what: "the output" }];
    if let Some(bytes) = layout.and_then(Layout::unpacked_bytes_a_triangle) {
        needs.push(Need { folder: limits.spool_folder(), bytes: triangles * bytes, what: "the text of the package" });
    }
    disk_space::check(mesh.path(), &needs)
}

/// Writes a mesh to the new file `output`, in meshes of their own where there are several and the format holds them; reads the file back, and compares.
///
/// # Errors
/// [`Error`], any of them; [`Error::Refused`] for a triangle that the format cannot hold.
pub(crate) fn encode(
    whole: &Whole<'_>,
    output: &Path,
    layout: Layout,
    Work { limits, progress, .. }: Work<'_>,
    clock: &mut Clock,
) -> Result<MeshFile> {
    let Whole { made, title, parts, input } = *whole;
    refuse_repeated(made, input, layout, limits)?;
    let name = parts.first().filter(|_| parts.len() == 1).map(|part| part.name.clone()).unwrap_or_default();
    let all = [Part { name, triangles: 0..made.records().len() }];
    let parts = if layout.holds_several() && parts.len() > 1 { parts } else { &all };
    let body = |part: &'_ Part| {
        let records = made.records().get(part.triangles.clone()).unwrap_or_default();
        Ok((Indexed::of(output, records, limits, progress)?, records.len()))
    };
    let bodies: Result<Vec<_>> = parts.iter().map(body).collect();
    let bodies: Vec<_> =
        bodies?.into_iter().zip(parts).map(|((mesh, records), part)| Body { name: &part.name, mesh, records }).collect();
    let heading = Heading { maker: concat!("Suture ", env!("CARGO_PKG_VERSION")), title };
    encode::write(&bodies, (layout, heading), output, limits, progress)?;
    drop(bodies);
    made.let_go();
    let written = files::open(output, limits, progress)?;
    clock.stage("encode");
    confirm(made, &written, limits)?;
    // Of one mesh, its name alone may make it a part.
    let ranges = |parts: &[Part]| parts.iter().skip(1).map(|part| part.triangles.clone()).collect::<Vec<_>>();
    if matches!(layout, Layout::Amf(_)) && ranges(written.parts()) != ranges(parts) {
        return Err(copying::differs(written.path()));
    }
    Ok(written)
}

/// Does the written file hold the triangles that were made?
fn confirm(made: &MeshFile, written: &MeshFile, limits: &Limits) -> Result<()> {
    let same = |(a, b): (&Record, &Record)| position::corners(a).map(position::bits) == position::corners(b).map(position::bits);
    let (files, made, records) = ([made, written], made.records(), written.records());
    let is_same = |(made, records): (&[Record], &[Record])| {
        let is_same = made.par_iter().zip(records).all(same);
        // Pages of two whole meshes would be resident.
        files.iter().for_each(|file| file.let_go());
        is_same
    };
    let holds = parallel::in_pool(limits.threads, || {
        made.len() == records.len() && made.chunks(COMPARED).zip(records.chunks(COMPARED)).all(is_same)
    });
    if holds && written.is_flawless() { Ok(()) } else { Err(copying::differs(written.path())) }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;
    use crate::contract::progress::Quiet;
    use crate::contract::report::Outcome;
    use crate::contract::settings::Profile;
    use crate::testing::{Corners, cube, plate, records};

    #[test]
    fn the_profile_decides_and_else_the_input() {
        let of = |wanted| target(Format::AsciiStl, None, wanted);
        assert_eq!(of(OutputFormat::Ply), Target { layout: Some(Layout::Ply), is_input: false });
        assert_eq!([of(OutputFormat::Input), of(OutputFormat::Stl)], [Target { layout: None, is_input: true }; 2]);
        let package = |wanted| target(Format::ThreeMf, Some("inch"), wanted).is_input;
        assert!(package(OutputFormat::Input) && package(OutputFormat::ThreeMf) && !package(OutputFormat::Stl));
    }

    #[test]
    fn a_package_has_the_unit_of_the_input() {
        let unit = |input, unit| target(input, unit, OutputFormat::ThreeMf).layout;
        assert_eq!(unit(Format::Amf, Some("feet")), Some(Layout::ThreeMf("foot")));
        assert_eq!(unit(Format::Amf, Some("micron")), Some(Layout::ThreeMf("micron")));
        assert_eq!(unit(Format::Off, None), Some(Layout::ThreeMf("millimeter")));
    }

    /// The path of a new STL of these triangles.
    fn stl(folder: &Path, triangles: &[Corners]) -> PathBuf {
        let (path, records) = (folder.join("part.stl"), records(triangles));
        std::fs::write(&path, [&[0; 80][..], &(records.len() as u32).to_le_bytes(), records.as_flattened()].concat()).unwrap();
        path
    }

    fn repaired(input: &Path, output: &Path, format: OutputFormat, limits: &Limits) -> Report {
        let profile = Profile { format, ..Profile::default() };
        crate::repair(input, output, &profile, limits, &Quiet).unwrap()
    }

    #[test]
    fn a_mesh_becomes_a_package_whatever_memory_and_threads() {
        let folder = tempfile::tempdir().unwrap();
        let input = stl(folder.path(), &plate(110, |x, y| (x, y) != (50, 50)));
        let mut packages = Vec::new();
        for (memory_bytes, threads) in [(1 << 30, 1), (64 << 20, 3)] {
            let limits = Limits { memory_bytes, threads, ..Limits::default() };
            let output = folder.path().join(format!("{threads}.3mf"));
            convert(&input, &output, OutputFormat::ThreeMf, &limits, &Quiet).unwrap();
            let [came, made] = [&input, &output].map(|path| files::open(path, &limits, &Quiet).unwrap());
            assert_eq!((made.format(), made.unit(), made.is_flawless()), (Format::ThreeMf, Some("millimeter"), true));
            assert!(came.records().iter().map(record::corners).eq(made.records().iter().map(record::corners)));
            packages.push(std::fs::read(output).unwrap());
        }
        assert_eq!(packages[0], packages[1]);
    }

    #[test]
    fn what_is_repaired_becomes_a_package_that_is_good() {
        let folder = tempfile::tempdir().unwrap();
        let limits = Limits { threads: 2, ..Limits::default() };
        let mut open = cube();
        open.pop();
        let [first, again] = ["first.3mf", "again.3mf"].map(|name| folder.path().join(name));
        let report = repaired(&stl(folder.path(), &open), &first, OutputFormat::ThreeMf, &limits);
        assert_eq!((report.outcome, report.verdict.good), (Outcome::Repaired, true));
        let facts = report.output.unwrap();
        assert_eq!((facts.format, facts.triangles, facts.bytes), (Format::ThreeMf, 12, first.metadata().unwrap().len()));
        assert_eq!(report.certificate.map(|certificate| certificate.blake3), Some(facts.blake3));
        // A package that is good is copied, by either name of its format.
        for format in [OutputFormat::ThreeMf, OutputFormat::Input] {
            let report = repaired(&first, &again, format, &limits);
            assert_eq!(report.outcome, Outcome::Clean);
            assert_eq!(std::fs::read(&again).unwrap(), std::fs::read(&first).unwrap());
            std::fs::remove_file(&again).unwrap();
        }
        convert(&first, &again, OutputFormat::ThreeMf, &limits, &Quiet).unwrap();
        assert_eq!(std::fs::read(&again).unwrap(), std::fs::read(&first).unwrap());
    }

    /// Readers refuse a package with such a triangle.
    #[test]
    fn a_triangle_with_two_corners_at_one_place_becomes_no_package() {
        let folder = tempfile::tempdir().unwrap();
        let limits = Limits { threads: 2, ..Limits::default() };
        let mut triangles = cube();
        // Zeros of either sign are one place.
        triangles.push([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [-0.0, 0.0, 0.0]]);
        let (input, output) = (stl(folder.path(), &triangles), folder.path().join("part.3mf"));
        let refused = convert(&input, &output, OutputFormat::ThreeMf, &limits, &Quiet).unwrap_err();
        assert!(matches!(&refused, Error::Refused { path, .. } if *path == input), "{refused}");
        assert!(refused.to_string().contains("1 triangle with two corners at one place") && !output.exists(), "{refused}");
        convert(&input, &folder.path().join("part.off"), OutputFormat::Off, &limits, &Quiet).unwrap();
        let report = repaired(&input, &output, OutputFormat::ThreeMf, &limits);
        assert_eq!((report.outcome, report.output.map(|facts| facts.triangles)), (Outcome::Repaired, Some(12)));
    }
}
