//! What all fuzz targets share: the readers over any bytes, and what must hold whatever they make of them.
//!
//! A target fails on a panic, on more memory than [`MOST_MEMORY`], on a reading that differs from the first one of the same bytes, and on a
//! report that is no report. libFuzzer adds the time.
//!
//! The readers are the engine's own files, those of its folders `io`, `curves` and `toolpath` and of the folders that this one may import.

#[path = "../../../core/src/attributes/mod.rs"]
mod attributes;
#[path = "../../../core/src/contract/mod.rs"]
mod contract;
#[path = "../../../core/src/curves/mod.rs"]
mod curves;
#[path = "../../src/forms.rs"]
mod forms;
#[path = "../../../core/src/io/mod.rs"]
mod io;
mod memory;
pub mod seeds;
#[path = "../../src/stl.rs"]
mod stl;
#[path = "../../../core/src/toolpath/mod.rs"]
mod toolpath;
#[path = "../../../core/src/util/mod.rs"]
mod util;
#[path = "../../src/zip.rs"]
mod zip;

use std::io::Write;
use std::path::Path;

pub use crate::io::read::fuzzing::Reader;

use crate::contract::access::Access;
use crate::contract::error::{Error, ErrorClass};
use crate::contract::progress::Progress;
use crate::contract::settings::{Limits, Profile};
use crate::curves::fill::Options;
use crate::io::read::Finding;
use crate::io::read::fuzzing::{self, Made};
use crate::io::rows::fuzzing as rows;

#[global_allocator]
static COUNTED: memory::Counted = memory::Counted;

/// Memory that a reading of a small file may take, and beside it so much for each byte of the file.
const MOST_MEMORY: usize = 64 << 20;
const MEMORY_A_BYTE: usize = 8;
/// Spools go to memory: fuzzing writes very many of them.
const SPOOLS: &str = "/dev/shm";
/// Findings of a file, at most; a package has some for each of its objects.
const MOST_FINDINGS: usize = 32;
/// Bytes that a line of a report may have.
const LONGEST: usize = 4096;

/// Makes the caller's thread a pool of its own: to start a thread for each input takes longer than to read it.
fn alone() {
    static POOL: std::sync::Once = std::sync::Once::new();
    POOL.call_once(|| std::mem::forget(rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build()));
}

/// Reads `bytes` by `reader`, twice, and checks what it makes of them.
pub fn check(reader: Reader, bytes: &[u8]) {
    alone();
    let read = |threads| {
        let limits = limits(threads);
        within_bounds(bytes.len(), || fuzzing::read(reader, bytes, Path::new(SPOOLS), &limits))
    };
    let first = read(1);
    match &first {
        Ok(made) => plausible(made),
        Err(error) => refused(error),
    }
    let threads = if bytes.len().is_multiple_of(16) { 2 } else { 1 };
    let is_same = match (&first, &read(threads)) {
        (Ok(first), Ok(again)) => first.records() == again.records() && first.findings() == again.findings(),
        (Err(first), Err(again)) => first.to_string() == again.to_string(),
        _ => false,
    };
    assert!(is_same, "two readings of the same bytes differ");
}

/// Reads a package object by object, too, as repairs do.
pub fn check_package(bytes: &[u8]) {
    alone();
    check(Reader::Archive, bytes);
    if bytes.is_empty() {
        return;
    }
    let mut file = tempfile::NamedTempFile::new_in(SPOOLS).expect("a file");
    file.write_all(bytes).expect("it is written");
    let limits = Limits { spool: Some(SPOOLS.into()), ..limits(1) };
    if let Err(error) = within_bounds(bytes.len(), || fuzzing::read_objects(file.path(), &limits)) {
        refused(&error);
    }
}

/// Asks the rows of a file all that a writer would ask, once it is read.
pub fn check_rows(reader: Reader, bytes: &[u8]) {
    check(reader, bytes);
    if bytes.is_empty() {
        return;
    }
    let mut file = tempfile::NamedTempFile::new_in(SPOOLS).expect("a file");
    file.write_all(bytes).expect("it is written");
    let limits = Limits { spool: Some(SPOOLS.into()), ..limits(1) };
    // Bytes that another reader takes are that one's.
    let _ = within_bounds(bytes.len(), || rows::ask(file.path(), &limits));
}

/// Reads curves, twice, and finds their loops, lengths and exact forms.
pub fn check_curves(bytes: &[u8]) {
    let read = || within_bounds(bytes.len(), || curves::read(bytes));
    let (network, again) = match (read(), read()) {
        (Ok(network), Ok(again)) => (network, again),
        (Err(first), Err(again)) => {
            assert_eq!(first, again);
            return one_line(&first.to_string());
        }
        _ => panic!("two readings of the same bytes differ"),
    };
    assert!(network == again, "two readings of the same bytes differ");
    network.findings.iter().for_each(|finding| one_line(&finding.text));
    for closes_gaps in [false, true] {
        let options = curves::loops::Options { closes_gaps, ..Default::default() };
        let loops = within_bounds(bytes.len(), || curves::loops::find(&network, &options));
        let count = network.curves.len() + loops.added.len();
        assert!(loops.loops.iter().flat_map(|own| &own.uses).all(|own| own.curve < count), "a loop is of curves that are there");
    }
    for curve in network.curves.iter().take(64) {
        let length = curve.shape.length(1e-6);
        assert!(length >= 0.0, "a length of {length}");
        let _ = curve.shape.to_spline();
    }
}

/// Points within a surface, at most: a short file of huge curves asks for as many as it may.
const INNER: usize = 500;

/// Fills the loops of curves, twice, and writes their surfaces in both forms.
pub fn check_filled(bytes: &[u8]) {
    alone();
    let Ok(network) = curves::read(bytes) else { return };
    for from_faces in [true, false] {
        let how = curves::loops::Options { closes_gaps: !from_faces, ..Default::default() };
        let options = Options { inner: INNER, ..Options::default() };
        let filled = || curves::fill::fill_network(&network, (from_faces, &how), &options);
        let (Ok(first), Ok(again)) = (within_bounds(bytes.len(), filled), filled()) else { continue };
        assert!(first.filled == again.filled, "two fillings of the same curves differ");
        let mesh = &first.filled.mesh;
        assert!(
            mesh.triangles.iter().flatten().all(|corner| (*corner as usize) < mesh.points.len()),
            "a corner is a point that is there"
        );
        assert!(mesh.points.iter().flatten().all(|x| x.is_finite()), "points are numbers");
        assert_eq!(first.filled.surfaces.len(), first.outlines.len());
        let (body, _) = curves::fill::body(&first.shapes(&network), &first.outlines, &first.filled, &network.unit);
        let header = curves::export::Header { name: "fuzz", time: None, system: "fuzz" };
        let mut text = Vec::new();
        for written in
            [curves::export::write_iges(&body, &header, &mut text), curves::export::write_step(&body, &header, &mut text)]
        {
            if let Err(error) = written {
                one_line(&error.to_string());
            }
        }
    }
}

/// Moves and executed blocks of a tool path, at most: what their own bounds allow takes longer than an input has.
const MOVES: u64 = 20_000;

/// Reads a tool path, twice; its moves go by one by one, and memory does not grow with them.
pub fn check_path(bytes: &[u8]) {
    let options = toolpath::Options { moves_max: MOVES, steps_max: MOVES, ..Default::default() };
    let read = || {
        let (mut moves, mut mixed) = (0_u64, 0_u64);
        let header = within_bounds(bytes.len(), || {
            toolpath::stream(bytes, &options, &mut |one| {
                moves += 1;
                for x in one.from.into_iter().chain(one.to).chain(one.axis) {
                    assert!(x.is_finite(), "a move of line {} to {x}", one.line);
                    mixed = mixed.rotate_left(7) ^ x.to_bits();
                }
                std::ops::ControlFlow::Continue(())
            })
        });
        (header, moves, mixed)
    };
    let first = read();
    assert!(first == read(), "two readings of the same bytes differ");
    match &first.0 {
        Ok(header) => header.findings.iter().for_each(|finding| one_line(&finding.text)),
        Err(error) => one_line(&error.to_string()),
    }
}

/// Reads a project of CAMotics, a table of tools, and a tool of the command line.
pub fn check_tools(bytes: &[u8]) {
    let said = |error: &toolpath::ReadError| one_line(&error.to_string());
    let project = || within_bounds(bytes.len(), || toolpath::project::read(bytes));
    let first = project();
    assert!(first == project(), "two readings of the same bytes differ");
    let _ = first.map_err(|error| said(&error));
    match within_bounds(bytes.len(), || toolpath::tools::read_table(bytes, toolpath::Units::Millimetres)) {
        Ok((_, findings)) => findings.iter().for_each(|finding| one_line(&finding.text)),
        Err(error) => said(&error),
    }
    if let Ok(text) = std::str::from_utf8(bytes) {
        let _ = toolpath::tools::parse(text).map_err(|error| said(&error));
    }
}

/// A packed AMF around `text`, as it is.
pub fn packed_amf(text: &[u8]) -> Vec<u8> {
    zip::write(&[("part.amf", text)], 0)
}

/// A 3MF package around the text of its model, as it is.
pub fn package_of_model(text: &[u8]) -> Vec<u8> {
    let mut parts = forms::parts("", &[]);
    parts.iter_mut().filter(|(name, _)| *name == "3D/3dmodel.model").for_each(|(_, content)| *content = text);
    zip::write(&parts, 0)
}

/// What stands between two parts of the input of [`package_of_parts`].
pub const BETWEEN: u8 = 0xff;
/// The names of the parts, in the order of the input.
const PARTS: [&str; 7] = [
    "[Content_Types].xml",
    "_rels/.rels",
    "3D/3dmodel.model",
    "3D/_rels/3dmodel.model.rels",
    "3D/Objects/a.model",
    "Metadata/Slic3r_PE_model.config",
    "Metadata/model_settings.config",
];

/// A 3MF package of parts that stand in `bytes` one behind the other. An empty one is not there.
pub fn package_of_parts(bytes: &[u8]) -> Vec<u8> {
    let contents = bytes.split(|byte| *byte == BETWEEN);
    let parts: Vec<(&str, &[u8])> = PARTS.into_iter().zip(contents).filter(|(_, content)| !content.is_empty()).collect();
    zip::write(&parts, 0)
}

fn limits(threads: usize) -> Limits {
    Limits { threads, access: Access::COPIED, ..Limits::default() }
}

fn within_bounds<R>(length: usize, read: impl FnOnce() -> R) -> R {
    let (result, most) = memory::most_during(read);
    let bound = MOST_MEMORY + MEMORY_A_BYTE * length;
    assert!(most <= bound, "{most} bytes of memory at once for a file of {length}");
    result
}

fn plausible(made: &Made) {
    assert!(!made.records().is_empty(), "a mesh has a triangle");
    let findings = made.findings();
    findings.iter().for_each(|Finding { text, .. }| one_line(text));
    assert!(findings.len() <= MOST_FINDINGS, "{} findings", findings.len());
    let mut texts: Vec<&str> = findings.iter().map(|finding| finding.text.as_str()).collect();
    texts.sort_unstable();
    assert!(texts.windows(2).all(|pair| pair[0] != pair[1]), "a finding is there twice: {texts:?}");
}

fn refused(error: &Error) {
    assert!(matches!(error.class(), ErrorClass::Unreadable | ErrorClass::Refused), "not the file's fault: {error}");
    one_line(&error.to_string());
}

fn one_line(text: &str) {
    assert!(!text.is_empty() && text.len() <= LONGEST, "{} bytes in a line", text.len());
    assert!(!text.chars().any(char::is_control), "control characters in a line: {text:?}");
}

/// What a reading cost.
pub struct Measured {
    pub seconds: f64,
    /// Bytes of memory, at once.
    pub most: usize,
    /// Triangles and findings, or why there are none.
    pub said: String,
}

/// Reads `bytes` on one thread, by the reader that they choose.
pub fn measure(bytes: &[u8]) -> Measured {
    let begin = std::time::Instant::now();
    let (result, most) = memory::most_during(|| fuzzing::read(Reader::Sniffed, bytes, Path::new(SPOOLS), &limits(1)));
    let said = match result {
        Ok(made) => format!(
            "{} triangles, {:?}",
            made.records().len(),
            made.findings().iter().map(|finding| &finding.text).collect::<Vec<_>>()
        ),
        Err(error) => error.to_string(),
    };
    Measured { seconds: begin.elapsed().as_secs_f64(), most, said }
}
