//! The configuration was read anew while the daemon runs.

use suture_store::job::Kind;
use suture_store::{Control, Query, Role, StoreError};

use super::{Keeper, control, pace};
use crate::deliver;
use crate::settings::Reload;

impl Keeper {
    /// The configuration was read anew: what of it the keeper works by, and what may go on now. Says what came of it, in one line.
    pub(super) fn go_by(&mut self, reload: Reload) -> Result<(), StoreError> {
        match reload {
            Reload::NoFile => tracing::warn!("SIGHUP changes nothing: this daemon was started without a configuration file."),
            Reload::Refused(reason) => {
                tracing::error!(reason, "The configuration was read anew and not taken over; the one before stays in force.");
            }
            Reload::Done(changes) => {
                for kept in &mut self.folders {
                    (kept.reconciler.rest, kept.rescan) = pace(&self.context, kept.polled);
                }
                self.disk_looked = None;
                if self.context.has(Role::Control) {
                    deliver::subscribe(&self.context)?;
                }
                self.context.store.share(&self.context.settings.now().shares());
                self.announced = None;
                // Whoever mended a setting need not wait for the next try.
                self.hasten_waiting()?;
                let changes = if changes.is_empty() { "none".into() } else { changes.join(", ") };
                tracing::info!(changes, "The configuration was read anew and is in force.");
            }
        }
        Ok(())
    }

    /// What waits is tried now: with `--once`, whoever starts a run may have put right what it waits for, and no other run may follow.
    pub(super) fn hasten_waiting(&self) -> Result<(), StoreError> {
        for job in self.context.store.list(&Query { kinds: vec![Kind::Waiting], ..Query::default() })? {
            control(&self.context, job.id, Control::Hasten)?;
        }
        self.context.schedule.news();
        Ok(())
    }
}
