//! Why the result of a job could not be brought into place.

use std::io;
use std::path::{Path, PathBuf};

use suture_store::StoreError;

/// Why a job could not be brought further.
#[derive(Debug, thiserror::Error)]
pub(crate) enum PublishError {
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The state says what is to be done; it can be tried again at any time.
    #[error("{}: {source}", path.display())]
    Io { path: PathBuf, source: io::Error },
    /// The hot folder is not the one that the job is of.
    #[error("{0}")]
    Folder(String),
}

pub(crate) fn io_at(path: &Path) -> impl FnOnce(io::Error) -> PublishError {
    let path = path.to_owned();
    move |source| PublishError::Io { path, source }
}
