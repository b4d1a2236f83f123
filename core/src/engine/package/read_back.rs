//! The written package, read again: does each object hold the triangles that it should?

use std::path::Path;

use super::Work;
use super::change::Changed;
use crate::contract::error::{Error, Result};
use crate::geometry::position;
use crate::io::read::PackageFile;
use crate::io::record::Record;

/// A hash of corners, in order. Equal positions have equal bytes in it.
#[derive(Default)]
pub(super) struct Corners {
    hasher: blake3::Hasher,
    triangles: u64,
}

impl Corners {
    pub(super) fn add(&mut self, records: &[Record]) {
        let mut bytes = Vec::with_capacity(36 << 10);
        for group in records.chunks(1 << 10) {
            bytes.clear();
            for corner in group.iter().flat_map(position::corners) {
                bytes.extend(position::bits(corner).map(u32::to_le_bytes).as_flattened());
            }
            self.hasher.update(&bytes);
        }
        self.triangles += records.len() as u64;
    }

    pub(super) fn finish(self) -> (blake3::Hash, u64) {
        (self.hasher.finalize(), self.triangles)
    }
}

/// Reads the package at `output` and compares its objects with what is expected.
///
/// # Errors
/// [`Error::Io`] where one is another.
pub(super) fn confirm(package: &PackageFile, output: &Path, changed: &Changed, work: Work<'_>) -> Result<PackageFile> {
    let differs = |how: String| {
        let text = format!("the package does not hold what was written to it: {how}");
        Error::io(output, "reading back")(std::io::Error::other(text))
    };
    let written = PackageFile::open(output, work.limits, work.progress)?.ok_or_else(|| differs("it is no package".into()))?;
    let places = written.meshes();
    if places.len() != changed.expected.len() {
        return Err(differs(format!("{} objects, not {}", places.len(), changed.expected.len())));
    }
    for (place, expected) in places.into_iter().zip(&changed.expected) {
        let read = written.read(place, work.limits, work.progress)?;
        let mut corners = Corners::default();
        corners.add(read.parsed.records.all());
        let (hash, triangles) = corners.finish();
        let names = written.names(place);
        if names != package.names(expected.place) || triangles != expected.triangles {
            let (id, _, part) = names;
            return Err(differs(format!("object {id} of {part} has {triangles} triangles, not {}", expected.triangles)));
        }
        if hash != expected.hash {
            return Err(differs(format!("object {} of {} has other corners", names.0, names.2)));
        }
    }
    Ok(written)
}
