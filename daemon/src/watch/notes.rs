//! What a daemon notes at its beginning, for whoever comes later.

use std::sync::Arc;

use crate::config::{Config, default_state};
use crate::folder::Folder;
use crate::ground::note_traces;
use crate::{create, fsx, shared};

/// Tells `suture jobs` where the store is, if it is not where it would look.
pub(super) fn note_state(config: &Config, folders: &[Arc<Folder>]) {
    for folder in folders.iter().filter(|folder| folder.check().is_ok()) {
        let note = folder.root.join(".suture").join("state-path");
        if folder.is_shared {
            // The state of one machine is of no use on another one; the database is.
            let noted = fsx::remove_if_there(&note).and_then(|()| shared::note_in_folder(&folder.root, config.store.as_ref()));
            if let Err(error) = noted {
                tracing::warn!(%error, folder = %folder.root.display(), "The place of the job store could not be noted.");
            }
            continue;
        }
        let state = std::path::absolute(&config.state).unwrap_or_else(|_| config.state.clone());
        let result = if state == default_state(&folder.root) {
            fsx::remove_if_there(&note)
        } else {
            create::replace(&note, state.as_os_str().as_encoded_bytes())
        };
        if let Err(error) = result {
            tracing::warn!(%error, file = %note.display(), "The place of the job store could not be noted.");
        }
    }
}

/// Notes what tells the folders again, so that the next daemon knows one whose mount is gone.
pub(super) fn note_folders(config: &Config, folders: &[Arc<Folder>]) {
    let traces = folders.iter().map(|folder| (folder.name.clone(), folder.trace())).collect();
    if let Err(error) = note_traces(&config.state, &traces) {
        tracing::warn!(%error, "What tells the folders again could not be noted.");
    }
}
