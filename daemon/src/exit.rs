//! What the process tells its caller.

use std::io;
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
    /// The machine or the store cannot serve now; try again.
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

impl Exit {
    /// Of an error that keeps the daemon from starting. What runs short and what a disk says by the way is not the caller's mistake, and a
    /// service manager tries again.
    pub(crate) fn of_start(error: &io::Error) -> Self {
        use libc::{EAGAIN, EBUSY, EDQUOT, EINTR, EIO, EMFILE, ENFILE, ENOMEM, ENOSPC, ESTALE, ETIMEDOUT};
        match error.raw_os_error() {
            Some(EAGAIN | EBUSY | EDQUOT | EINTR | EIO | EMFILE | ENFILE | ENOMEM | ENOSPC | ESTALE | ETIMEDOUT) => {
                Self::TryAgain
            }
            _ => Self::Refused,
        }
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit.code())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A full disk at the start was taken for wrong usage, and a service manager gave up.
    #[test]
    fn a_shortage_passes_and_a_mistake_does_not() {
        let of = |errno| Exit::of_start(&io::Error::from_raw_os_error(errno));
        assert_eq!([libc::ENOSPC, libc::EDQUOT, libc::EMFILE, libc::EIO].map(of), [Exit::TryAgain; 4]);
        assert_eq!([libc::EACCES, libc::EROFS, libc::ENOTDIR].map(of), [Exit::Refused; 3]);
    }
}
