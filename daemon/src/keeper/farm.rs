//! What a farm wants of this daemon: whether it is drained, which an operator says to the store.

use std::time::{Duration, Instant};

use suture_store::patience::brief;
use suture_store::{Role, StoreError};

use super::Keeper;
use crate::schedule::Hold;

/// It is asked this often.
const EVERY: Duration = Duration::from_secs(1);
/// Why nothing is taken.
const WORDS: &str = "this host is drained; `suture hosts resume` ends that";

impl Keeper {
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
