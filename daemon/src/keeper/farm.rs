//! This daemon and its farm, by the store: an operator says there whether it is drained, and it says in which folders it looks for drops.

use std::time::{Duration, Instant};

use suture_store::patience::brief;
use suture_store::{Role, StoreError};

use super::Keeper;
use crate::folder::Folder;
use crate::schedule::Hold;
use crate::shared::station;

/// It is asked this often.
const EVERY: Duration = Duration::from_secs(1);
/// Why nothing is taken.
const WORDS: &str = "this host is drained; `suture hosts resume` ends that";

impl Keeper {
    /// Tells what it is and in which folders it looks for drops, unless that was told already.
    pub(super) fn announce(&mut self) {
        let context = &self.context;
        let is_kept = |name: &str| self.folders.iter().any(|kept| kept.is_kept && kept.folder.name == name);
        // Of drops in a bucket, each daemon with that role looks for all.
        let looks = |folder: &Folder| context.has(Role::Intake) && (folder.bucket.is_some() || is_kept(&folder.name));
        let keeps: Vec<String> =
            context.folders.iter().filter(|folder| looks(folder)).map(|folder| folder.name.clone()).collect();
        if self.announced.as_ref() != Some(&keeps) {
            context.store.announce(&station(&context.settings.now(), keeps.clone()));
            self.announced = Some(keeps);
        }
    }

    /// Takes nothing new while this daemon is drained. The store gives it nothing either; this spares it the asking, and says so.
    pub(super) fn look_at_farm(&mut self, now: Instant) -> Result<(), StoreError> {
        let context = &self.context;
        if !context.has(Role::Worker) || self.farm_looked.is_some_and(|then| now.duration_since(then) < EVERY) {
            return Ok(());
        }
        self.farm_looked = Some(now);
        let drains = match brief(|| context.store.is_draining()) {
            // As it was.
            Err(StoreError::Away { .. }) => return Ok(()),
            drains => drains?,
        };
        if context.schedule.hold(Hold::Drain, drains.then(|| WORDS.into())) {
            if drains {
                tracing::info!("This host is drained: jobs in work are finished, nothing new is taken.");
            } else {
                tracing::info!("This host takes jobs again.");
            }
        }
        Ok(())
    }
}
