//! Why a comparison ends early.

use std::io;
use std::path::PathBuf;

use suture_bench::generate;

/// Why a comparison ended.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Error {
    /// The system failed.
    #[error("{action} failed: {source}")]
    Io { action: String, source: io::Error },
    /// Cargo said why above.
    #[error("suture could not be built; `--suture PATH` names another binary")]
    Build,
    /// A group could not be made.
    #[error("a memory cgroup cannot be made, for which root's rights are usual: {0}")]
    Cgroup(io::Error),
    /// An input could not be made.
    #[error(transparent)]
    Generate(#[from] generate::Error),
    /// A record could not be written as JSON.
    #[error(transparent)]
    Json(#[from] serde_json::Error),
    /// A raw file holds something else.
    #[error("{}, line {line}: {source}", path.display())]
    Line { path: PathBuf, line: usize, source: serde_json::Error },
    /// There is nothing to publish.
    #[error("there are no raw runs (*.jsonl) in {}", .0.display())]
    NoRuns(PathBuf),
    /// A mesh could not be read or written.
    #[error("{0}")]
    Mesh(String),
    /// A plot could not be drawn.
    #[error("drawing {}: {reason}", path.display())]
    Plot { path: PathBuf, reason: String },
}

impl Error {
    pub(super) fn io(action: impl Into<String>) -> impl FnOnce(io::Error) -> Self {
        let action = action.into();
        move |source| Self::Io { action, source }
    }
}
