//! The written package, read again: does each object hold the triangles that it should?

use std::path::Path;

use super::change::Changed;
use super::corners::Triangles;
use crate::contract::error::{Error, Result};
use crate::engine::work::Work;
use crate::io::read::PackageFile;

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
        let mut left = read.parsed.records.all();
        let (names, count) = (written.names(place), left.len() as u64);
        let (id, part) = (names.0, &names.2);
        let wanted: u64 = expected.units.iter().map(|unit| unit.count).sum();
        if names != package.names(expected.place) || count != wanted {
            return Err(differs(format!("object {id} of {part} has {count} triangles, not {wanted}")));
        }
        for unit in &expected.units {
            let (own, others) = left.split_at(left.len().min(unit.count as usize));
            if Triangles::of(own, work.limits.threads) != *unit {
                return Err(differs(format!("object {id} of {part} has other corners")));
            }
            left = others;
        }
    }
    Ok(written)
}
