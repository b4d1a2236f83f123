//! Room on the disks: a result needs some, and a half-full night is better than a broken one. A folder whose disk is nearly full waits; the others go on.

use std::collections::BTreeSet;
use std::sync::{Arc, PoisonError};
use std::time::{Duration, Instant};

use suture_store::StoreError;

use super::Keeper;
use crate::folder::Folder;
use crate::schedule::Hold;
use crate::sentinel::Answer;

/// Disks are looked at this often.
const EVERY: Duration = Duration::from_secs(5);

impl Keeper {
    /// Takes nothing new of folders whose disk, or that of their results, is nearly full.
    pub(super) fn look_at_disk(&mut self, now: Instant) -> Result<(), StoreError> {
        if self.disk_looked.is_some_and(|then| now.duration_since(then) < EVERY) {
            return Ok(());
        }
        self.disk_looked = Some(now);
        let context = &self.context;
        context.store.check()?;
        let is_full = |folder: &&Arc<Folder>| match folder.answers() {
            Answer::Yes => context.room(folder) == 0,
            // As it was.
            Answer::NotYet => context.full.lock().unwrap_or_else(PoisonError::into_inner).contains(&folder.name),
            Answer::Silent => false,
        };
        let folders: Vec<_> = self.folders.iter().map(|kept| &kept.folder).filter(is_full).collect();
        // A folder in a bucket is never among the full ones.
        let all_are_full = folders.len() == context.folders.len();
        context.schedule.hold(Hold::Disk, folders.first().filter(|_| all_are_full).map(|folder| folder.nearly_full()));
        let full: BTreeSet<String> = folders.iter().map(|folder| folder.name.clone()).collect();
        let mut known = context.full.lock().unwrap_or_else(PoisonError::into_inner);
        if *known != full {
            context.store.shut(&full);
            for folder in full.difference(&known) {
                tracing::warn!(folder, "A disk is nearly full; nothing new is taken of its folder.");
            }
            for folder in known.difference(&full) {
                tracing::info!(folder, "There is room on the disk again.");
            }
            *known = full;
            drop(known);
            context.schedule.news();
        }
        Ok(())
    }
}
