//! What goes by itself, and when: `[keep]` in the configuration. Without it, every file stays.

use std::path::{Path, PathBuf};
use std::time::Duration;

/// So many jobs at rest are remembered unless the configuration says otherwise: about 40 MiB of store.
pub(crate) const HISTORY_JOBS: u64 = 20_000;

/// How long, and how much of it, something stays. `None`: without a bound.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Bound {
    /// What is older goes.
    pub age: Option<Duration>,
    /// Of more bytes than this in a hot folder, the oldest go.
    pub size: Option<u64>,
}

impl Bound {
    /// Does it let everything stay?
    pub(crate) fn is_open(&self) -> bool {
        *self == Self::default()
    }
}

/// How long what a job leaves is kept.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Keep {
    /// Repaired meshes in `out/`, and best attempts.
    pub results: Bound,
    /// Reports, and receipts of results that are gone.
    pub reports: Bound,
    /// Originals in `done/`, `failed/` and `quarantine/`: these move to the archive, and go nowhere else.
    pub originals: Bound,
    /// Where originals move to.
    pub archive: Option<PathBuf>,
    /// Records of jobs that ended so long ago go.
    pub history: Option<Duration>,
    /// Of more jobs that ended, the records of the oldest go.
    pub history_jobs: u64,
}

impl Default for Keep {
    /// All files, and as many records as a store holds well.
    fn default() -> Self {
        Self {
            results: Bound::default(),
            reports: Bound::default(),
            originals: Bound::default(),
            archive: None,
            history: None,
            history_jobs: HISTORY_JOBS,
        }
    }
}

impl Keep {
    /// The archive, if originals are to move there.
    pub(crate) fn archive(&self) -> Option<&Path> {
        self.archive.as_deref().filter(|_| !self.originals.is_open())
    }
}
