//! What can go wrong with one mesh file. A defect of the mesh is never an error: it is counted, repaired or reported.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

/// Who can do something about an error; decides exit codes and whether a job is tried again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ErrorClass {
    /// The file is no mesh we can read. Trying again gives the same answer.
    Unreadable,
    /// The file is readable, but beyond a stated limit (budget, counts). Trying again with the same settings gives the same
    /// answer.
    Refused,
    /// The world around the file failed (I/O, space, permission). Trying again may help.
    Environment,
    /// The file changed while it was worked on. It must be looked at anew.
    Changed,
}

/// An error that ended the work on one file. No output was published.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Not a mesh, or damaged beyond reading; `reason` says how that was decided.
    #[error("{}: cannot be read as a mesh: {reason}", path.display())]
    Unreadable { path: PathBuf, reason: String },

    /// Readable, but a stated bound refuses it; `advice` says which setting would let it through.
    #[error("{}: refused: {reason}; {advice}", path.display())]
    Refused { path: PathBuf, reason: String, advice: String },

    /// The disk has too little room for what would be written; nothing was.
    #[error("{}: refused: {reason}; {advice}", path.display())]
    NoSpace { path: PathBuf, reason: String, advice: String },

    /// Reading, writing or mapping failed.
    #[error("{}: {action} failed: {source}", path.display())]
    Io { path: PathBuf, action: &'static str, source: std::io::Error },

    /// Size, mtime, ctime or inode differ between start and end of the work.
    #[error("{}: changed while it was being worked on; it will be looked at again once it is at rest", path.display())]
    Changed { path: PathBuf },
}

impl Error {
    pub(crate) fn io(path: &Path, action: &'static str) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Io { path, action, source }
    }

    /// Who can do something about it.
    pub fn class(&self) -> ErrorClass {
        match self {
            Self::Unreadable { .. } => ErrorClass::Unreadable,
            Self::Refused { .. } => ErrorClass::Refused,
            Self::NoSpace { .. } | Self::Io { .. } => ErrorClass::Environment,
            Self::Changed { .. } => ErrorClass::Changed,
        }
    }
}

/// The result of work on one file.
pub type Result<T> = std::result::Result<T, Error>;
