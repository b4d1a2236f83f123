//! The readers over bytes in memory, for the fuzz targets in `tests/fuzz`; in no other build.
//!
//! **In:** bytes, and the reader that takes them, whatever they look like.
//! **Out:** the records and the findings of that reader.

use std::path::Path;

use super::access::Bytes;
use super::finding::Finding;
use super::mesh_file::Content;
use super::package_file::PackageFile;
use super::sniff;
use super::spool::Context;
use crate::contract::error::Result;
use crate::contract::progress::Quiet;
use crate::contract::settings::Limits;
use crate::io::record::Record;

/// A reader.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reader {
    /// The reader that the bytes themselves choose.
    Sniffed,
    /// Text STL.
    Text,
    /// PLY.
    Ply,
    /// OFF.
    Off,
    /// OBJ.
    Obj,
    /// AMF, not packed.
    Amf,
    /// An archive: 3MF, or a packed AMF.
    Archive,
}

/// All that a reader makes of bytes.
pub struct Made {
    input: Bytes,
    content: Content,
}

impl Made {
    /// The triangles.
    pub fn records(&self) -> &[Record] {
        self.content.records(&self.input)
    }

    /// Oddities of the file.
    pub fn findings(&self) -> &[Finding] {
        &self.content.findings
    }
}

/// Reads `bytes`; spools go to `spool`.
///
/// # Errors
/// Those of [`super::MeshFile::open`], but for those of opening.
pub fn read(reader: Reader, bytes: &[u8], spool: &Path, limits: &Limits) -> Result<Made> {
    let path = Path::new("fuzz");
    let input = mapped(bytes);
    let kind = match reader {
        Reader::Sniffed => sniff::sniff(&input).map_err(|rejection| rejection.at(path))?,
        Reader::Text => sniff::Kind::Text(sniff::Text { start: 0, findings: Vec::new() }),
        Reader::Ply => sniff::Kind::Ply,
        Reader::Off => sniff::Kind::Off,
        Reader::Obj => sniff::Kind::Obj(0),
        Reader::Amf => sniff::Kind::Amf,
        Reader::Archive => sniff::Kind::Archive,
    };
    let content = Content::of(kind, &input, &Context { path, spool, limits, progress: &Quiet, passed: None })?;
    Ok(Made { input, content })
}

/// Opens the package at `path`, and reads each object that is repaired; how many there are.
///
/// # Errors
/// As [`PackageFile::open`].
pub fn read_objects(path: &Path, limits: &Limits) -> Result<usize> {
    let Some(package) = PackageFile::open(path, limits, &Quiet)? else { return Ok(0) };
    let meshes = package.meshes();
    for place in &meshes {
        package.read(*place, limits, &Quiet)?;
        let (text, vertices, triangles) = package.mesh_at(*place);
        assert!(text.get(vertices).is_some() && text.get(triangles).is_some(), "a mesh stands in its text");
        let (_, _, _) = package.names(*place);
        assert!(package.sets_at(*place).is_none_or(|sets| text.get(sets).is_some()), "sets stand in their text");
        package.volumes_of(*place);
    }
    Ok(meshes.len())
}

/// `bytes` as a map, which cannot be empty.
fn mapped(bytes: &[u8]) -> Bytes {
    let mut map = memmap2::MmapMut::map_anon(bytes.len().max(1)).expect("a map");
    map.get_mut(..bytes.len()).into_iter().for_each(|map| map.copy_from_slice(bytes));
    Bytes::Copied(map.make_read_only().expect("a map"))
}
