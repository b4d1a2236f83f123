//! Room on the disks: a result needs some, and a half-full night is better than a broken one. A folder whose disk is nearly full waits; the others go on.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::PoisonError;
use std::time::{Duration, Instant};

use suture_store::StoreError;

use super::Keeper;
use crate::schedule::Hold;

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
        let folders = self.folders.iter().map(|kept| &kept.folder).filter(|folder| context.room(folder) == 0);
        let words = |root: &Path| format!("the disk of {} is nearly full", root.display());
        let full: BTreeMap<String, String> = folders.map(|folder| (folder.name.clone(), words(&folder.root))).collect();
        let all_are_full = full.len() == self.folders.len();
        context.schedule.hold(Hold::Disk, full.values().next().filter(|_| all_are_full).cloned());
        let before = {
            let mut known = context.full.lock().unwrap_or_else(PoisonError::into_inner);
            std::mem::replace(&mut *known, full.clone())
        };
        if before != full {
            context.store.shut(&full.keys().cloned().collect::<BTreeSet<_>>());
            context.schedule.news();
        }
        for (folder, words) in full.iter().filter(|(folder, _)| !before.contains_key(*folder)) {
            tracing::warn!(folder, reason = words, "A disk is nearly full; nothing new is taken of its folder.");
        }
        for folder in before.keys().filter(|folder| !full.contains_key(*folder)) {
            tracing::info!(folder, "There is room on the disk again.");
        }
        Ok(())
    }
}
