//! A folder of files that went through the daemon, and what that cost, by where its jobs were.

use serde::{Deserialize, Serialize};

use super::child::Cost;

/// Where jobs are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Keeper {
    /// In the store of the machine.
    Embedded,
    /// In a database server on the same machine, reached by its socket.
    Postgres,
}

impl Keeper {
    pub(super) const ALL: [Self; 2] = [Self::Embedded, Self::Postgres];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Embedded => "sled, of the daemon's own",
            Self::Postgres => "PostgreSQL",
        }
    }
}

/// One process over one folder.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Stored {
    pub(crate) keeper: Keeper,
    /// Of each file.
    pub(crate) triangles: u64,
    pub(crate) files: u64,
    /// Files that have a result.
    pub(crate) done: u64,
    /// The program that ran.
    pub(crate) program: String,
    /// Runs of equal round are a pair.
    pub(crate) round: usize,
    pub(crate) cost: Cost,
}

impl Stored {
    pub(super) fn files_a_second(&self) -> f64 {
        self.files as f64 / self.cost.wall_seconds
    }
}
