//! What an archive holds: a 3MF package, all that it builds as one mesh; or a packed AMF.

use super::archive::{Archive, shown};
use super::finding::Rejection;
use super::parsed::Parsed;
use super::spool::Context;
use super::threemf::{Model, slicer};
use super::{amf, built, package_file};
use crate::contract::error::Result;
use crate::contract::report::Format;

/// Reads the mesh of an archive. Call it within a pool of threads.
///
/// # Errors
/// [`crate::Error::Unreadable`] for an archive that is neither, or is damaged; [`crate::Error::NoSpace`], [`crate::Error::Io`].
pub(super) fn read(bytes: &[u8], context: &Context<'_>) -> Result<(Parsed, Format)> {
    let archive = Archive::open(bytes).map_err(|rejection| rejection.at(context.path))?;
    if archive.find(package_file::CONTENT_TYPES).is_some() {
        let model = Model::open(bytes, context)?;
        let configs = slicer::configs(&archive, context)?;
        let volumes = configs.first().map_or(&[][..], |config| config.volumes.as_slice());
        return Ok((built::mesh((&model, volumes), package_file::is_repaired, bytes.len(), context)?, Format::ThreeMf));
    }
    let is_amf = |name: &str| name.to_ascii_lowercase().ends_with(".amf");
    let files: Vec<_> = archive.entries.iter().filter(|entry| !entry.is_folder()).collect();
    match files.as_slice() {
        [entry] if is_amf(&entry.name) => {
            let text = archive.spooled(entry, context)?;
            Ok((amf::read(text.all().as_flattened(), bytes.len(), &context.passing(text.map()))?, Format::Amf))
        }
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
