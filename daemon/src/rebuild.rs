//! `suture jobs rebuild`: a job store that cannot be trusted is kept aside, and a new one takes from receipts what is done.
//!
//! It knows a hot folder, not how that is served: what is left to do there, and what other folders of the store hold, the next daemon
//! finds, since the new store says until then that it lacks its past.

use std::path::{Path, PathBuf};

use suture_store::SledStore;

use crate::config::FolderConfig;
use crate::exit::Exit;
use crate::folder::{Folder, FolderError};
use crate::ground::read_traces;
use crate::past::{Which, fill};
use crate::publish_error::PublishError;
use crate::reach::{Failure, must_be_hot, state_of, unseen, watched};
use crate::rebuilt;
use crate::shared::noted;

/// What came of it.
pub(crate) struct Rebuilt {
    /// Where the damaged store is.
    pub aside: PathBuf,
    /// Jobs that came back.
    pub jobs: usize,
}

/// Rebuilds the job store of a hot folder.
///
/// # Errors
/// When `dir` is no hot folder, a daemon serves it or has the store, the store is sound, or cannot be moved.
pub(crate) fn rebuild(dir: &Path) -> Result<Rebuilt, Failure> {
    must_be_hot(dir)?;
    watched()?;
    let state = state_of(dir).map_err(|error| unseen(dir, &error))?;
    if let Some(address) = noted(&state).map_err(|error| unseen(&state, &error))? {
        let line =
            format!("{}: the jobs are in {address}; `suture store verify --store {address}` looks at them", state.display());
        return Err(Failure { line, exit: Exit::Refused });
    }
    // Held until all is done: no daemon begins meanwhile.
    let folder = served_as(dir, &state).and_then(|config| Folder::open(&config, None)).map_err(|error| Failure {
        exit: if let FolderError::Owned { .. } = error { Exit::Owned } else { Exit::TryAgain },
        line: error.to_string(),
    })?;
    let Some(aside) = SledStore::set_aside(&state)? else {
        let line = format!("{}: the job store is sound; nothing was changed", state.display());
        return Err(Failure { line, exit: Exit::Refused });
    };
    rebuilt::note(&state, &aside);
    let store = SledStore::open(&state)?;
    let jobs = fill(&store, &folder, Which::AtRest).map_err(|error| match error {
        PublishError::Store(error) => error.into(),
        error => {
            let line =
                format!("{error}; the damaged store is kept in {}, and the next daemon reads the receipts", aside.display());
            Failure { line, exit: Exit::TryAgain }
        }
    })?;
    Ok(Rebuilt { aside, jobs })
}

/// The folder under the name that the last daemon gave it.
fn served_as(dir: &Path, state: &Path) -> Result<FolderConfig, FolderError> {
    let plain = FolderConfig::of(dir);
    for (name, trace) in read_traces(state)? {
        if trace.leads_here(dir).map_err(FolderError::unseen(dir))? {
            return Ok(FolderConfig { name, ..plain });
        }
    }
    Ok(plain)
}
