//! Copies of files.

use std::path::Path;

use crate::contract::error::{Error, Result};
use crate::contract::progress::Progress;
use crate::contract::settings::Limits;
use crate::engine::files;
use crate::io::read::MeshFile;
use crate::output::emit::{self, Content};

/// Copies the file `input` to the new file `output`, and opens the copy.
pub(crate) fn copy(input: &Path, output: &Path, limits: &Limits, progress: &dyn Progress) -> Result<MeshFile> {
    copy_open(&files::open(input, limits, progress)?, output, limits, progress)
}

/// Copies the file of a mesh to the new file `output`, and opens the copy.
pub(crate) fn copy_open(mesh: &MeshFile, output: &Path, limits: &Limits, progress: &dyn Progress) -> Result<MeshFile> {
    emit::write(mesh, output, &Content::Input, limits, progress)?.durable()?;
    mesh.check_unchanged()?;
    files::open(output, limits, progress)
}

/// The error of a written file that, read back, is another one.
pub(crate) fn differs(path: &Path) -> Error {
    Error::io(path, "reading back")(std::io::Error::other("the file does not hold what was written to it"))
}
