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
    let mesh = files::open(input, limits, progress)?;
    let (written, _) = emit::draft(&mesh, output, limits, progress, |draft| draft.finish(&Content::Input))?;
    written.durable()?;
    mesh.check_unchanged()?;
    files::open(output, limits, progress)
}

/// The error of a written file that, read back, is another one.
pub(crate) fn differs(path: &Path) -> Error {
    Error::io(path, "reading back")(std::io::Error::other("the file does not hold what was written to it"))
}
