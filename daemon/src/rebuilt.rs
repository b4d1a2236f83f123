//! A job store that was rebuilt by hand: a note beside it, so that the next daemon tells of it.

use std::path::{Path, PathBuf};

use crate::event::{Happening, Recovery};
use crate::event_bus::Bus;
use crate::{create, fsx};

/// Beside a store that was rebuilt: the name of the folder in which the damaged one is kept. It is there until a daemon has told of it.
fn note_of(state: &Path) -> PathBuf {
    state.with_file_name("rebuilt")
}

/// Notes that the store in `state` is a new one, and where the damaged one is.
pub(crate) fn note(state: &Path, aside: &Path) {
    let (note, name) = (note_of(state), aside.file_name().unwrap_or_default());
    let noted = create::replace(&note, name.as_encoded_bytes()).and_then(|()| fsx::sync_dir(fsx::folder_of(&note)));
    if let Err(error) = noted {
        tracing::warn!(%error, file = %note.display(), "The next daemon will not count that the store was rebuilt.");
    }
}

/// Tells of a store that was rebuilt since the last daemon. The note goes only then: after a kill, the next daemon tells of it.
pub(crate) fn tell(state: &Path, bus: &Bus) {
    let note = note_of(state);
    let told = fsx::text_if_there(&note).and_then(|name| {
        let Some(name) = name else { return Ok(()) };
        bus.tell(&Happening::StoreRecovered(Recovery::Rebuilt { aside: &state.join(name) }));
        fsx::remove_if_there(&note)
    });
    if let Err(error) = told {
        tracing::warn!(%error, file = %note.display(), "Whether the store was rebuilt cannot be told, or the note of it not removed.");
    }
}
