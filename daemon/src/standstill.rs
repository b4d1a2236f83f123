//! What an operator has stopped: a mark beside the job store, so that it holds over restarts, until an operator goes on.

use std::io;
use std::path::{Path, PathBuf};

use crate::{create, fsx};

/// In words, for `suture jobs list` and the log.
pub(crate) const WORDS: &str = "an operator has paused it; `suture jobs resume` goes on";

fn mark(state: &Path) -> PathBuf {
    state.with_file_name("paused")
}

/// Is the daemon of this job store paused?
pub(crate) fn is_set(state: &Path) -> io::Result<bool> {
    fsx::exists(&mark(state))
}

/// Pauses the daemon of this job store, or lets it go on.
///
/// # Errors
/// As the file system's.
pub(crate) fn set(state: &Path, paused: bool) -> io::Result<()> {
    let mark = mark(state);
    if paused {
        create::mark(&mark)?
    } else {
        fsx::remove_if_there(&mark)?
    }
    fsx::sync_dir(fsx::folder_of(&mark))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pause_lasts_until_it_is_taken_back() {
        let dir = tempfile::tempdir().unwrap();
        let state = dir.path().join("state");
        assert!(!is_set(&state).unwrap());
        for _ in 0..2 {
            set(&state, true).unwrap();
            assert!(is_set(&state).unwrap());
        }
        for _ in 0..2 {
            set(&state, false).unwrap();
            assert!(!is_set(&state).unwrap());
        }
    }
}
