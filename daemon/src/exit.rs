//! What the process tells its caller.

use std::process::ExitCode;

/// Exit statuses, the better before the worse; of several files, the worst counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Exit {
    /// Good under the profile.
    Good,
    /// Done, but not good.
    NotGood,
    /// Unreadable or refused input, wrong usage.
    Refused,
    /// The state directory is owned by another daemon.
    Owned,
    /// The store cannot be used; try again.
    TryAgain,
    /// A worker could not read what it was asked, or say what came of it.
    Cut,
    /// Stopped by a signal.
    Interrupted,
}

/// Of a worker that is cut off from its supervisor (`EX_OSERR`).
pub(crate) const WORKER_CUT: u8 = 71;

impl Exit {
    /// `sysexits` where they fit: 73 cannot create, 75 temporary failure; 130 as shells report SIGINT.
    pub(crate) fn code(self) -> u8 {
        match self {
            Self::Good => 0,
            Self::NotGood => 1,
            Self::Refused => 2,
            Self::Owned => 73,
            Self::TryAgain => 75,
            Self::Cut => WORKER_CUT,
            Self::Interrupted => 130,
        }
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit.code())
    }
}
