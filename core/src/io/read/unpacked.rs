//! What an archive holds: a 3MF package, all that it builds as one mesh; or a packed AMF.

use super::archive::{Archive, shown};
use super::finding::{Finding, Rejection};
use super::parsed::Parsed;
use super::spool::Context;
use super::threemf::Model;
use super::threemf::slicer::Volumes;
use super::{amf, built, package_file};
use crate::contract::error::Result;
use crate::contract::report::Format;
use crate::util::words::Counted;

/// Reads the mesh of an archive. Call it within a pool of threads.
///
/// # Errors
/// [`crate::Error::Unreadable`] for an archive that is neither, or is damaged; [`crate::Error::NoSpace`], [`crate::Error::Io`].
pub(super) fn read(bytes: &[u8], context: &Context<'_>) -> Result<(Parsed, Format)> {
    let archive = Archive::open(bytes).map_err(|rejection| rejection.at(context.path))?;
    if archive.find(package_file::CONTENT_TYPES).is_some() {
        let model = Model::open(bytes, context)?;
        let volumes = Volumes::of(&model, &archive, context)?;
        return Ok((built::mesh((&model, volumes.all()), package_file::is_repaired, bytes.len(), context)?, Format::ThreeMf));
    }
    let is_amf = |name: &str| name.to_ascii_lowercase().ends_with(".amf");
    let files: Vec<_> = archive.entries.iter().filter(|entry| !entry.is_folder()).collect();
    // What macOS and others put beside a file to say more of it has the file's name.
    let is_beside =
        |name: &str| name.starts_with("__MACOSX/") || name.rsplit('/').next().is_some_and(|own| own.starts_with("._"));
    let mut meshes = files.iter().filter(|entry| is_amf(&entry.name) && !is_beside(&entry.name));
    if let (Some(entry), None) = (meshes.next(), meshes.next()) {
        let text = archive.spooled(entry, context)?;
        let mut parsed = amf::read(text.all().as_flattened(), bytes.len(), &context.passing(text.map()))?;
        if files.len() > 1 {
            let others = Counted(files.len() as u64 - 1, "other file", "other files");
            let text = format!("{others} in the archive, of which only a copy has any");
            parsed.findings.push(Finding { harmless: true, ..Finding::flaw(text) });
        }
        return Ok((parsed, Format::Amf));
    }
    match files.as_slice() {
        [] => Err(Rejection::Unreadable("an archive without a file in it".into()).at(context.path)),
        [first, ..] => {
            let reason = format!(
                "a ZIP archive, but neither a 3MF package nor a packed AMF: it holds {} and {} more; unpack it and take the meshes",
                shown(&first.name),
                files.len() - 1
            );
            Err(Rejection::Unreadable(reason).at(context.path))
        }
    }
}
