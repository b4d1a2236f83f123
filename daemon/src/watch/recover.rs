//! What an earlier life left: its jobs are taken up, and its work folders cleared away. Jobs are held by workers alone.

use std::sync::Arc;

use suture_store::job::Testimony;
use suture_store::{Job, StoreError, crash_point};

use crate::attempt::clear::clear;
use crate::attempt::{Context, IN_HAND, Slot, WITNESS};
use crate::event::{Happening, Recovery};
use crate::publish_error::PublishError;
use crate::schedule::Turn;
use crate::{fsx, uploads};

/// Takes up what an earlier life left, and clears its work folders away.
pub(crate) fn recover(context: &Arc<Context>) -> Result<(), StoreError> {
    // What lies in a folder that is another daemon's for now tells nothing of this one's jobs.
    let folder = |name: &str| context.folders.iter().find(|folder| folder.name == name && folder.check().is_ok());
    let testimony = |job: &Job| {
        let work = job.work.and_then(|work| Some(folder(&job.source.folder)?.work(work)));
        let there = |name: &str| work.as_ref().is_some_and(|work| fsx::exists(&work.join(name)).unwrap_or(false));
        match () {
            () if there(IN_HAND) => Testimony::InHand,
            () if there(WITNESS) => Testimony::Outlived,
            () => Testimony::None,
        }
    };
    let recovered = context.store.recover(&testimony)?;
    crash_point("daemon.recovered");
    if !recovered.is_empty() {
        context.bus.tell(&Happening::StoreRecovered(Recovery::Unfinished { jobs: recovered.len() }));
    }
    let mut slot = Slot::new(context);
    for found in recovered {
        if let Some(claim) = found.claim {
            slot.finish(&claim, found.job, Turn::Alone);
        }
        if context.failed.lock().is_ok_and(|failed| failed.is_some()) {
            return Ok(());
        }
    }
    // Before anything is cleared away: what is under way is known by its work folder.
    for folder in context.folders.iter().filter(|folder| folder.keeps() && folder.check().is_ok()) {
        match context.unread.read(&*context.store, folder, &context.bus) {
            Err(PublishError::Store(error)) => return Err(error),
            Err(error) => tracing::error!(%error, "What an earlier job store left cannot be read; it is tried again."),
            Ok(_) => {}
        }
    }
    // A folder that others serve, too, is cleared by whoever keeps it.
    for folder in context.folders.iter().filter(|folder| !folder.is_shared && folder.check().is_ok()) {
        uploads::clear(folder);
        clear(context, folder)?;
    }
    Ok(())
}
