//! Hints: the system tells that something happened in a hot folder, and which names were renamed into place. They only wake the scan.

use std::mem::ManuallyDrop;
use std::panic::{AssertUnwindSafe, catch_unwind};

use crossbeam::channel::Sender;
use notify::event::{EventKind, ModifyKind, RenameMode};
use notify::{RecursiveMode, Watcher};

use crate::attempt::Event;
use crate::folder::Folder;

/// Tells of changes until the process ends.
pub(crate) type Watching = ManuallyDrop<notify::RecommendedWatcher>;

/// Begins to listen at a folder: for names in `in/` and below, and for another `in/` in its place.
///
/// # Errors
/// When the system cannot be had to tell.
pub(crate) fn watcher(folder: &Folder, events: Sender<Event>) -> notify::Result<Watching> {
    let mut watcher = notify::recommended_watcher(move |event: notify::Result<notify::Event>| {
        let hint = match event {
            Ok(event) if matches!(event.kind, EventKind::Access(_)) => return,
            Ok(event) => match event.kind {
                EventKind::Modify(ModifyKind::Name(RenameMode::To)) => Event::Hint { renamed: event.paths },
                EventKind::Modify(ModifyKind::Name(RenameMode::Both)) => {
                    Event::Hint { renamed: event.paths.into_iter().skip(1).collect() }
                }
                _ => Event::Hint { renamed: Vec::new() },
            },
            // Lost events and the like: look for oneself.
            Err(_) => Event::Hint { renamed: Vec::new() },
        };
        // The daemon is ending.
        let _ = events.send(hint);
    })?;
    // notify 8.2 says nothing where its thread cannot start, and panics at the next word, and again when it is dropped: it is asked
    // something harmless first, and never dropped (the process ends with it).
    let watching = catch_unwind(AssertUnwindSafe(|| {
        watcher.configure(notify::Config::default())?;
        // `in/` itself may go, and be made anew.
        watcher.watch(&folder.root, RecursiveMode::NonRecursive)?;
        watcher.watch(&folder.inbox(), RecursiveMode::Recursive)
    }));
    let watcher = ManuallyDrop::new(watcher);
    watching.unwrap_or_else(|_| Err(notify::Error::generic("its thread could not start"))).map(|()| watcher)
}
