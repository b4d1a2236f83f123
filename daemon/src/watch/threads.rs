//! The daemon's threads: how they begin, and what becomes of one that ends in an error.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, Scope, ScopedJoinHandle};

use suture_store::{Role, StoreError};

use crate::attempt::{Context, Slot};

/// A thread that ends in a panic, for want of another thread or by a defect, must not leave the others waiting: the daemon ends with it,
/// and begins anew.
pub(super) fn guarded(work: impl FnOnce() -> Result<(), StoreError>) -> Result<(), StoreError> {
    catch_unwind(AssertUnwindSafe(work))
        .unwrap_or_else(|_| Err(StoreError::Poisoned { reason: "a thread of the daemon ended in an internal error".into() }))
}

pub(super) fn thread(name: &str) -> Builder {
    Builder::new().name(name.into())
}

pub(super) fn no_thread(source: std::io::Error) -> StoreError {
    StoreError::Io { path: "thread".into(), action: "starting one", source }
}

/// Has idle slots look when other daemons may have brought something to claim.
fn hear(context: &Arc<Context>) {
    let idle = Arc::downgrade(context);
    context.store.hear(Arc::new(move || idle.upgrade().iter().for_each(|context| context.schedule.news())));
}

/// The threads that work on jobs.
pub(super) struct Slots<'s, 'e> {
    scope: &'s Scope<'s, 'e>,
    context: &'s Arc<Context>,
    threads: Mutex<Vec<ScopedJoinHandle<'s, ()>>>,
}

impl<'s, 'e> Slots<'s, 'e> {
    /// None yet; those to come are woken by what other daemons bring, too.
    pub(super) fn new(scope: &'s Scope<'s, 'e>, context: &'s Arc<Context>) -> Self {
        hear(context);
        Self { scope, context, threads: Mutex::default() }
    }

    fn threads(&self) -> MutexGuard<'_, Vec<ScopedJoinHandle<'s, ()>>> {
        self.threads.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sees to it that so many can compute, and as many bring a result into place meanwhile; with one worker, one job is done after the other. Those that
    /// are there stay: the schedule lets no more compute than may.
    pub(super) fn raise(&self, workers: usize) -> Result<(), StoreError> {
        let context = self.context;
        let mut threads = self.threads();
        let most = match workers {
            // Others work.
            _ if !context.has(Role::Worker) => 0,
            1 => 1,
            workers => 2 * workers,
        };
        while threads.len() < most {
            let slot = move || {
                let worked = guarded(|| {
                    Slot::new(context).run();
                    Ok(())
                });
                // The job in work is taken up by the next life.
                worked.unwrap_or_else(|error| context.fail(error));
            };
            threads.push(thread("slot").spawn_scoped(self.scope, slot).map_err(no_thread)?);
        }
        Ok(())
    }

    pub(super) fn are_at_work(&self) -> bool {
        self.threads().iter().any(|slot| !slot.is_finished())
    }
}
