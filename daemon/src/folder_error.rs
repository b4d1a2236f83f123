//! Why a hot folder cannot be served.

use std::io;
use std::path::{Path, PathBuf};

use suture_core::ErrorClass;

/// Why a folder cannot be served.
#[derive(Debug, thiserror::Error)]
pub(crate) enum FolderError {
    #[error("{} is served by another daemon{}", root.display(), pid.map(|pid| format!(" (process {pid})")).unwrap_or_default())]
    Owned { root: PathBuf, pid: Option<u32> },
    #[error("{} lies in the hot folder {}, which would take its files; put it beside that one, or remove {}/.suture if that is none any more", root.display(), outer.display(), outer.display())]
    Within { root: PathBuf, outer: PathBuf },
    #[error("{} and {} are one folder, or one lies in the other: results would be taken for drops", a.display(), b.display())]
    Mixed { a: PathBuf, b: PathBuf },
    #[error("{} is shared by daemons that run; stop them, or add `shared = true` to the folder in the configuration of this one, too", root.display())]
    Shared { root: PathBuf },
    #[error("{}: this machine sees other numbers of files than the one that served it first, and jobs tell files by them; mount it so that the server's numbers are seen (SMB: `serverino`), or, if it was moved or restored since, remove {}", root.display(), noted.display())]
    Numbers { root: PathBuf, noted: PathBuf },
    #[error("{} is called `{other}` by the daemons that share it, and not `{name}`: add `name = \"{other}\"` to the folder in the configuration, or give all of them another one, and remove {}", root.display(), noted.display())]
    Called { root: PathBuf, name: String, other: String, noted: PathBuf },
    #[error("{}: does not answer: its server is gone or its disk hangs; see to its mount (`umount -f` gives it up)", root.display())]
    Silent { root: PathBuf },
    #[error("{0}")]
    Bucket(String),
    #[error("{}: {action}: {source}", path.display())]
    Io { path: PathBuf, action: &'static str, source: io::Error },
}

impl FolderError {
    /// Can the folder be served later, without anyone's change of the settings: when another daemon ends, or there is room again?
    pub(crate) fn passes(&self) -> bool {
        match self {
            Self::Owned { .. } | Self::Shared { .. } => true,
            Self::Io { source, .. } => ErrorClass::of(source) == ErrorClass::Shortage,
            Self::Within { .. }
            | Self::Mixed { .. }
            | Self::Silent { .. }
            | Self::Bucket(_)
            | Self::Numbers { .. }
            | Self::Called { .. } => false,
        }
    }

    /// Of a path that cannot be looked at.
    pub(crate) fn unseen(path: &Path) -> impl FnOnce(io::Error) -> Self {
        failed(path, "cannot be looked at")
    }
}

/// The error of a path at which something could not be done.
pub(crate) fn failed(path: &Path, action: &'static str) -> impl FnOnce(io::Error) -> FolderError {
    let path = path.to_owned();
    move |source| FolderError::Io { path, action, source }
}
