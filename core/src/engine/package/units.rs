//! The meshes of an object: all of it, or the volumes of a slicer's project.

use std::ops::Range;

use crate::contract::error::Result;
use crate::engine::nameless_stl;
use crate::engine::work::Work;
use crate::io::read::{MeshFile, MeshRecords, PackageFile, Place};
use crate::io::write_behind::Nameless;

/// Triangles of an object that are one mesh.
pub(super) struct UnitOf {
    pub(super) place: Place,
    pub(super) triangles: Range<usize>,
    /// Part of the model; another one only tells the slicer where settings hold.
    pub(super) is_repaired: bool,
    /// Its number among the object's volumes, in words; empty for an object that is one mesh.
    pub(super) volume: String,
}

/// The meshes of an object, in the order of its triangles; none of an object without any.
///
/// # Errors
/// [`crate::Error::Unreadable`] if the object's volumes are not its triangles, one volume after the other, or a triangle has no vertices.
pub(super) fn of(package: &PackageFile, place: Place, read: &MeshRecords) -> Result<Vec<UnitOf>> {
    let count = read.parsed.records.all().len();
    let refuse = |reason: &str| package.refused(place, reason);
    if read.triangles != count as u64 {
        return Err(refuse("has triangles whose vertices are not there"));
    }
    if count == 0 {
        // Blanks alone stand between the tags.
        return Ok(Vec::new());
    }
    let volumes = package.volumes_of(place);
    if volumes.is_empty() {
        return Ok(vec![UnitOf { place, triangles: 0..count, is_repaired: true, volume: String::new() }]);
    }
    let mut at = 0;
    let mut all = Vec::new();
    for (number, volume) in volumes.iter().enumerate() {
        let [from, to] = [volume.triangles.start, volume.triangles.end].map(|end| usize::try_from(end).unwrap_or(usize::MAX));
        if from != at || to > count {
            return Err(refuse("has volumes that are not its triangles, one volume after the other"));
        }
        at = to;
        let words = if volumes.len() > 1 { format!("volume {}", number + 1) } else { String::new() };
        all.push(UnitOf { place, triangles: from..to, is_repaired: volume.is_part, volume: words });
    }
    if at != count {
        return Err(refuse("has volumes that are not its triangles, one volume after the other"));
    }
    Ok(all)
}

/// The triangles of a unit as an STL of their own, opened; it is there as long as the file is held. Errors and reports name it as the package.
///
/// # Errors
/// [`crate::Error::NoSpace`], [`crate::Error::Io`].
pub(super) fn spooled(package: &PackageFile, unit: &UnitOf, read: &MeshRecords, work: Work<'_>) -> Result<(MeshFile, Nameless)> {
    let all = &read.parsed.records;
    let records = all.all().get(unit.triangles.clone()).unwrap_or_default();
    nameless_stl::open(package.path(), &read.parsed.header, records, || all.let_go(), work)
}
