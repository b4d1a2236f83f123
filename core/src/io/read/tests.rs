//! Whole files through [`MeshFile::open`], each built here from a few triangles.

mod damage;
mod hostile;
mod known;
mod spelling;
mod text;

use crate::contract::error::{Error, Result};
use crate::contract::progress::Progress;
use crate::contract::report::Format;
use crate::io::record::Record;
use std::fs::File;
use std::io::{Seek, SeekFrom, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use super::*;
use crate::contract::error::ErrorClass;
use crate::contract::settings::Limits;
use crate::io::record::{encode, flip};
use crate::util::words::Count;

/// A tetrahedron with its right angle at the origin.
pub(super) fn tetrahedron() -> Vec<Record> {
    let p = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]].map(|t: [usize; 3]| encode(t.map(|i| p[i]), 9)).to_vec()
}

fn binary_file(header: &[u8], count: u32, records: &[Record], tail: &[u8]) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(HEADER_BYTES, b' ');
    bytes.extend(count.to_le_bytes());
    bytes.extend(records.as_flattened());
    bytes.extend(tail);
    bytes
}

/// Opens `bytes` as a file of its own.
pub(super) fn open(bytes: &[u8]) -> Result<MeshFile> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("part.stl");
    File::create(&path).unwrap().write_all(bytes).unwrap();
    MeshFile::open(&path, folder.path(), &Limits::default(), &crate::contract::progress::Quiet)
}

/// Why `bytes` cannot be read.
pub(super) fn reason(bytes: &[u8]) -> String {
    match open(bytes) {
        Err(Error::Unreadable { reason, .. }) => reason,
        other => panic!("expected a refusal, got {other:?}"),
    }
}

pub(super) fn texts(file: &MeshFile) -> Vec<&str> {
    file.findings().iter().map(|finding| finding.text.as_str()).collect()
}

#[test]
fn a_sound_binary_file_is_read_in_place() {
    let bytes = binary_file(b"a part", 4, &tetrahedron(), b"");
    let file = open(&bytes).unwrap();
    assert_eq!(file.records(), tetrahedron());
    assert_eq!(file.format(), Format::BinaryStl);
    assert_eq!(texts(&file), [""; 0]);
    assert_eq!(file.output_header(), bytes[..80]);
    assert_eq!(file.bytes(), bytes);
    assert_eq!(file.byte_len(), 284);
}

#[test]
fn solid_in_a_binary_header_is_named_and_changed() {
    for (header, safe) in [("solid part", "model part"), ("  SoLiDworks", "  modelworks")] {
        let file = open(&binary_file(header.as_bytes(), 4, &tetrahedron(), b"")).unwrap();
        assert_eq!(file.records().len(), 4);
        assert!(texts(&file)[0].contains("begins with \"solid\""));
        assert!(!file.is_flawless());
        assert!(file.output_header().starts_with(safe.as_bytes()), "{header}");
    }
    let elsewhere = open(&binary_file(b"a solid part", 4, &tetrahedron(), b"")).unwrap();
    assert!(elsewhere.is_flawless());
    assert!(elsewhere.output_header().starts_with(b"a solid part"));
}

#[test]
fn the_length_is_believed_rather_than_the_count() {
    for count in [0, 3, 5, 1_000_000, u32::MAX] {
        let file = open(&binary_file(b"", count, &tetrahedron(), b"")).unwrap();
        assert_eq!(file.records(), tetrahedron(), "count {count}");
        assert!(texts(&file)[0].contains(&Count(count).to_string()) && texts(&file)[0].contains("holds 4"), "{:?}", texts(&file));
        assert!(!file.is_flawless());
    }
}

#[test]
fn trailing_bytes_are_no_triangles() {
    // A signature of two records' length, zero padding of three, and less than one record.
    for tail in [b"appended signature; ".repeat(5), vec![0; 150], vec![1]] {
        let file = open(&binary_file(b"", 4, &tetrahedron(), &tail)).unwrap();
        assert_eq!(file.records(), tetrahedron());
        assert!(texts(&file)[0].starts_with(&format!("{} byte", tail.len())), "{:?}", texts(&file));
        assert!(!file.is_flawless());
    }
}

#[test]
fn a_file_cut_in_mid_record_keeps_its_whole_triangles() {
    let bytes = binary_file(b"", 4, &tetrahedron(), b"");
    let file = open(&bytes[..bytes.len() - 20]).unwrap();
    assert_eq!(file.records(), &tetrahedron()[..3]);
    assert!(texts(&file)[0].contains("header says 4 triangles, file holds 3: cut off"));
    assert!(texts(&file)[1].starts_with("30 bytes after the last whole triangle"));
}

#[test]
fn what_holds_no_triangle_is_refused_in_words() {
    assert_eq!(reason(b""), "empty file");
    assert_eq!(reason(&binary_file(b"", 0, &[], b"")), "no triangles: the header says 0, and the file ends there");
    assert_eq!(reason(&binary_file(b"", 0, &[], b"\n")), "no triangles: the header says 0, and 1 byte without any follows");
    assert_eq!(
        reason(&binary_file(b"", 0, &[], &[0; 500])),
        "no triangles: the file is all zeros, as a copy that was interrupted leaves it"
    );
    assert_eq!(reason(b"\x89PNG\r\n\x1a\n"), "a PNG picture, not an STL mesh");
    assert_eq!(reason(&binary_file(b"", 7, &[], b"")), "only 84 bytes, too few for a single triangle");
}

#[test]
fn noise_is_not_taken_for_triangles() {
    // Bytes of a linear congruential generator: a quarter of the exponents are beyond any model, and no normal is unit.
    let mut state = 1u32;
    let noise: Vec<u8> = std::iter::repeat_with(|| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    })
    .take(5000)
    .collect();
    assert!(reason(&noise).starts_with("neither text nor binary"));
}

#[test]
fn a_wrong_count_needs_normals_that_make_sense() {
    let with_normal =
        |n: [f32; 3]| tetrahedron().iter().map(|r| crate::io::record::assemble(n, crate::io::record::corners(r), 0)).collect();
    let askew: Vec<Record> = with_normal([3.0, 4.0, -5.0]);
    for count in [0, 5, u32::MAX] {
        assert!(reason(&binary_file(b"", count, &askew, b"")).starts_with("neither text nor binary"), "count {count}");
    }
    // A count that is met is evidence enough, with or without something behind the triangles.
    for tail in [b"".as_slice(), b"tail"] {
        assert_eq!(open(&binary_file(b"", 4, &askew, tail)).unwrap().records(), askew);
    }
    // No normals, and normals as long as the triangle is large.
    let none: Vec<Record> = with_normal([0.0; 3]);
    let long: Vec<Record> = tetrahedron()
        .iter()
        .map(|r| crate::io::record::assemble(crate::io::record::normal(r).map(|x| x * 7.0), crate::io::record::corners(r), 0))
        .collect();
    for records in [none, long] {
        assert_eq!(open(&binary_file(b"", 5, &records, b"")).unwrap().records(), records);
    }
}

#[test]
fn triangles_that_are_not_numbers_stay() {
    let mut records = tetrahedron();
    records[2] = encode([[f32::NAN, 0.0, 0.0], [1.0, f32::INFINITY, 0.0], [0.0; 3]], 0);
    let file = open(&binary_file(b"", 4, &records, b"")).unwrap();
    assert_eq!(file.records(), records);
    assert!(file.is_flawless(), "a defect of the mesh, not of the file");
}

#[test]
fn more_triangles_than_a_count_holds_are_refused() {
    let layout = binary::within_bounds(MAX_TRIANGLES as usize + 1, Vec::new());
    let error = layout.unwrap_err().at(Path::new("huge.stl"));
    assert_eq!(error.class(), ErrorClass::Refused);
    assert!(error.to_string().contains("more than 4 294 967 295 triangles"), "{error}");
    assert!(binary::within_bounds(MAX_TRIANGLES as usize, Vec::new()).is_ok());
}

#[test]
fn lengths_beyond_32_bits_are_no_limit() {
    // 50 times this count overflows a u32 by a little. The file is sparse: it takes no space.
    let count = 85_899_346;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("part.stl");
    let mut out = File::create(&path).unwrap();
    out.write_all(&binary_file(b"", count, &[], b"")).unwrap();
    let whole = PREFIX_BYTES as u64 + 50 * u64::from(count);
    out.seek(SeekFrom::Start(whole - 200)).unwrap();
    out.write_all(tetrahedron().as_flattened()).unwrap();
    // SAFETY: nobody else knows this folder.
    let limits = Limits { access: unsafe { crate::contract::access::Access::mapped() }, ..Limits::default() };
    let file = MeshFile::open(&path, folder.path(), &limits, &crate::contract::progress::Quiet).unwrap();
    assert_eq!(file.records().len(), count as usize);
    assert!(file.is_flawless());
}

#[test]
fn a_change_underneath_is_noticed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("part.stl");
    let open = || MeshFile::open(&path, folder.path(), &Limits::default(), &crate::contract::progress::Quiet).unwrap();
    std::fs::write(&path, binary_file(b"", 4, &tetrahedron(), b"")).unwrap();
    let file = open();
    file.check_unchanged().unwrap();
    // Overwritten in place with the same length.
    let flipped: Vec<Record> = tetrahedron().iter().map(flip).collect();
    std::thread::sleep(std::time::Duration::from_millis(20));
    std::fs::write(&path, binary_file(b"", 4, &flipped, b"")).unwrap();
    assert_eq!(file.check_unchanged().unwrap_err().class(), ErrorClass::Changed);
    // Another mode: only ctime tells.
    let file = open();
    std::thread::sleep(std::time::Duration::from_millis(20));
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o640)).unwrap();
    assert_eq!(file.check_unchanged().unwrap_err().class(), ErrorClass::Changed);
    // Replaced by another file of the same content, and gone.
    let file = open();
    std::fs::copy(&path, folder.path().join("copy")).unwrap();
    std::fs::rename(folder.path().join("copy"), &path).unwrap();
    assert_eq!(file.check_unchanged().unwrap_err().class(), ErrorClass::Changed);
    let file = open();
    std::fs::remove_file(&path).unwrap();
    assert_eq!(file.check_unchanged().unwrap_err().class(), ErrorClass::Changed);
}

#[test]
fn what_is_no_file_is_refused_without_waiting() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("pipe.stl");
    rustix::fs::mknodat(rustix::fs::CWD, &pipe, rustix::fs::FileType::Fifo, rustix::fs::Mode::RUSR, 0).unwrap();
    for (path, word) in [(folder.path(), "folder"), (&pipe, "pipe")] {
        let error = MeshFile::open(path, folder.path(), &Limits::default(), &crate::contract::progress::Quiet).unwrap_err();
        assert_eq!(error.class(), ErrorClass::Unreadable);
        assert!(error.to_string().contains(word), "{error}");
    }
    let error = MeshFile::open(&folder.path().join("none"), folder.path(), &Limits::default(), &crate::contract::progress::Quiet)
        .unwrap_err();
    assert_eq!(error.class(), ErrorClass::Environment);
}
