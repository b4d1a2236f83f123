//! What can go wrong with one mesh file. A defect of the mesh is never an error: it is counted, repaired or reported.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::contract::ranges::ProfileError;

/// Who can do something about an error; decides exit codes and whether a job is tried again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ErrorClass {
    /// The file is no mesh we can read. Trying again gives the same answer.
    Unreadable,
    /// The file is readable, but beyond a stated limit that memory does not decide (counts, numbers, settings). Trying again with the
    /// same settings gives the same answer.
    Refused,
    /// The file needs more memory than the budget allows. Trying again with more memory may succeed.
    Starved,
    /// The world around the file failed (I/O, permission). Trying again may help.
    Environment,
    /// The machine has no room, no quota, no process or no file handle to spare. No try of the file changes that; it is to wait.
    Shortage,
    /// The file changed while it was worked on. It must be looked at anew.
    Changed,
}

/// An error that ended the work on one file, at `path`, or on a mesh in memory. No output was published. `reason`, `action` and `advice` are
/// parts of the sentence that it is shown as.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "each variant says what its fields are")]
pub enum Error {
    /// Not a mesh, or damaged beyond reading; `reason` says how that was decided.
    #[error("{}: cannot be read as a mesh: {reason}", path.display())]
    Unreadable { path: PathBuf, reason: String },

    /// Readable, but a stated bound refuses it, and more memory would not help; `advice` says what would.
    #[error("{}: refused: {reason}; {advice}", path.display())]
    Refused { path: PathBuf, reason: String, advice: String },

    /// Readable, but it needs more memory than the budget allows; `reason` and `advice` have the numbers.
    #[error("{}: refused: {reason}; {advice}", path.display())]
    Starved { path: PathBuf, reason: String, advice: String },

    /// A setting of the profile has a value that means nothing. The file was not opened.
    #[error("{}: refused: profile `{profile}`: {source}", path.display())]
    Profile { path: PathBuf, profile: String, source: ProfileError },

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

/// Files without a name are reached by paths in this folder.
pub(crate) const DESCRIPTORS: &str = "/proc/self/fd";

impl Error {
    pub(crate) fn io(path: &Path, action: &'static str) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Io { path, action, source }
    }

    /// The error of work on `path`: an error at a file without a name is one at that path, since no user has seen the other.
    pub(crate) fn of_work_on(mut self, path: &Path) -> Self {
        let (Self::Unreadable { path: own, .. }
        | Self::Refused { path: own, .. }
        | Self::Starved { path: own, .. }
        | Self::Profile { path: own, .. }
        | Self::NoSpace { path: own, .. }
        | Self::Io { path: own, .. }
        | Self::Changed { path: own }) = &mut self;
        if own.starts_with(DESCRIPTORS) {
            *own = path.into();
        }
        self
    }

    /// `progress` has ended the work on `path` during `action`.
    pub(crate) fn cancelled(path: &Path, action: &'static str) -> Self {
        Self::io(path, action)(std::io::ErrorKind::Interrupted.into())
    }

    /// The work ended because its [`Progress`](crate::Progress) said so.
    pub fn is_cancellation(&self) -> bool {
        matches!(self, Self::Io { source, .. } if source.kind() == std::io::ErrorKind::Interrupted)
    }

    /// Who can do something about it.
    pub fn class(&self) -> ErrorClass {
        match self {
            Self::Unreadable { .. } => ErrorClass::Unreadable,
            Self::Refused { .. } | Self::Profile { .. } => ErrorClass::Refused,
            Self::Starved { .. } => ErrorClass::Starved,
            Self::NoSpace { .. } => ErrorClass::Shortage,
            Self::Io { source, .. } => ErrorClass::of(source),
            Self::Changed { .. } => ErrorClass::Changed,
        }
    }
}

impl ErrorClass {
    /// Of an error of the system: [`ErrorClass::Shortage`] or [`ErrorClass::Environment`].
    pub fn of(error: &std::io::Error) -> Self {
        use rustix::io::Errno;
        use std::io::ErrorKind::{QuotaExceeded, StorageFull, WouldBlock};
        let handles = [Errno::MFILE, Errno::NFILE].map(|errno| Some(errno.raw_os_error()));
        let short = matches!(error.kind(), StorageFull | QuotaExceeded | WouldBlock) || handles.contains(&error.raw_os_error());
        if short { Self::Shortage } else { Self::Environment }
    }
}

/// The result of work on one file.
pub type Result<T> = std::result::Result<T, Error>;

#[cfg(test)]
mod tests {
    use rustix::io::Errno;

    use super::*;

    /// A program that has more memory to give must know which refusals that would help.
    #[test]
    fn only_a_want_of_memory_is_starved() {
        let (path, reason, advice) = (PathBuf::from("a.stl"), String::from("too much"), String::from("raise --memory"));
        let starved = Error::Starved { path: path.clone(), reason: reason.clone(), advice: advice.clone() };
        assert_eq!(starved.class(), ErrorClass::Starved);
        assert_eq!(serde_json::to_string(&starved.class()).unwrap(), "\"starved\"");
        assert_eq!(starved.to_string(), "a.stl: refused: too much; raise --memory");
        let refused = Error::Refused { path: path.clone(), reason: reason.clone(), advice: advice.clone() };
        assert_eq!(refused.class(), ErrorClass::Refused);
        assert_eq!(
            Error::NoSpace { path: path.clone(), reason, advice }.class(),
            ErrorClass::Shortage,
            "room on the disk is no memory"
        );
        let class = |errno: Errno| Error::io(&path, "writing")(errno.into()).class();
        assert_eq!([Errno::NOSPC, Errno::DQUOT, Errno::MFILE].map(class), [ErrorClass::Shortage; 3]);
        assert_eq!([Errno::IO, Errno::ACCESS].map(class), [ErrorClass::Environment; 2], "another try may end otherwise");
    }

    /// A user knows the input, and not the numbers of open files.
    #[test]
    fn errors_at_files_without_a_name_are_at_the_input() {
        let input = Path::new("part.stl");
        let at = |path: &str| Error::io(Path::new(path), "reading back")(Errno::IO.into()).of_work_on(input).to_string();
        assert!(at("/proc/self/fd/4").starts_with("part.stl: reading back failed: "));
        assert!(at("other.stl").starts_with("other.stl: reading back failed: "));
    }
}
