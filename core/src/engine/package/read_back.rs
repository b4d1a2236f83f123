//! The written package, read again: does each object hold the triangles that it should?

use std::path::Path;

use super::change::Changed;
use super::corners::Corners;
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
