//! The embedded store: the queue over sled 0.34, with what sled leaves out put around it.
//!
//! **On disk**, in the daemon's state folder:
//!
//! | name             | what                                                                                               |
//! |------------------|----------------------------------------------------------------------------------------------------|
//! | `LOCK`           | locked by the daemon that owns the folder; its process number as text                              |
//! | `SEQ`            | how far the store got: `suture-seq 1 <epoch> <transition> <crc32>`; see below                      |
//! | `db/`            | the sled database: trees `meta`, `jobs`, `by_state`, `by_key`, laid out as [`crate::queue`] says   |
//! | `db.trial/`      | only while a damaged database is being examined                                                    |
//! | `corrupt-<ms>/`  | a damaged database that was replaced; for people                                                   |
//!
//! Trees `folders` and `outbox` are reserved. Values are records (`crate::record`: magic, schema version, checksum, JSON, at most
//! 4 KiB); whatever is larger (reports, meshes) is a file elsewhere.
//!
//! **Durable** means: transaction over the trees, then `flush`, then `fdatasync` of the database file through a handle of our own,
//! since sled's flush is a `sync_file_range`, which neither empties the drive's cache nor orders anything. Transitions of several
//! threads that arrive while one sync runs share the next one.
//!
//! **Opening.** `LOCK` first. Then left-over `snap.*.generating` files go: a kill while sled writes its snapshot leaves one, and sled
//! would take it for the newest snapshot and never open again (deleting it is safe, the old snapshot goes only after the rename).
//! When sled still finds the database damaged, a copy without snapshots is tried, and taken only if it is not older than `SEQ`.
//! `SEQ` is written before the database is made, then at every opening, every 64 transitions and at shutdown, always after what
//! it speaks of is durable; any opening that falls behind it is refused, because a store that silently went back in time would
//! publish twice.
//!
//! **Errors.** sled stays broken after a failed write, so the first error of any kind poisons the store: nothing more is claimed
//! or advanced until [`SledStore::reopen`] has dropped every handle and opened it anew (as a new epoch).

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, RwLock};

use crate::id::{Clock, Epoch, JobId, SystemClock};
use crate::job::{Job, Kind, Step};
use crate::queue::Queue;
use crate::store::{Claim, Control, Filter, JobStore, Lease, Query, Recovered, StoreError, Submission, Submitted};

mod files;
#[cfg(test)]
mod kill_tests;
mod open;
mod tables;
#[cfg(test)]
mod tests;

use tables::SledTables;

/// What opening the store met.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Opening {
    /// The epoch that began.
    pub epoch: Epoch,
    /// Torn snapshots that were removed.
    pub torn_snapshots: u32,
    /// Where a damaged database was put, when the store could go on without it.
    pub set_aside: Option<PathBuf>,
}

/// The embedded [`JobStore`].
pub struct SledStore {
    state: PathBuf,
    clock: Arc<dyn Clock>,
    live: RwLock<Live>,
    opening: Mutex<Opening>,
    /// The folder is ours until every handle of the database is gone.
    lock: File,
}

enum Live {
    Open(Box<Queue<SledTables>>),
    Closed(String),
}

impl SledStore {
    /// Opens, or makes, the store in the folder `state`, and begins a new epoch. What earlier daemons left running is found by
    /// [`JobStore::recover`].
    ///
    /// # Errors
    /// [`StoreError::Locked`] when another daemon owns the folder; [`StoreError::Unusable`], [`StoreError::RolledBack`],
    /// [`StoreError::Corrupt`], [`StoreError::Newer`] when the database cannot be trusted: nothing was changed then.
    pub fn open(state: &Path) -> Result<Self, StoreError> {
        Self::open_with(state, Arc::new(SystemClock))
    }

    /// The same with a clock of the caller's.
    ///
    /// # Errors
    /// As [`SledStore::open`].
    pub fn open_with(state: &Path, clock: Arc<dyn Clock>) -> Result<Self, StoreError> {
        if !state.exists() {
            std::fs::create_dir_all(state).map_err(files::io(state, "making the folder"))?;
            if let Some(parent) = state.parent().filter(|parent| !parent.as_os_str().is_empty()) {
                files::sync_dir(parent)?;
            }
        }
        let lock = files::lock(state)?;
        let (queue, opening) = open::queue(state, &clock)?;
        Ok(Self {
            state: state.to_owned(),
            clock,
            live: RwLock::new(Live::Open(Box::new(queue))),
            opening: Mutex::new(opening),
            lock,
        })
    }

    /// What the last opening met.
    pub fn opening(&self) -> Opening {
        self.opening.lock().unwrap_or_else(std::sync::PoisonError::into_inner).clone()
    }

    /// Drops every handle of the database and opens it anew, as a new epoch: all claims are void afterwards and come back
    /// through [`JobStore::recover`]. For use after an error, once its cause (a full disk) may be gone.
    ///
    /// # Errors
    /// As [`SledStore::open`]; the store stays closed then, and may be reopened again.
    pub fn reopen(&self) -> Result<(), StoreError> {
        let mut live = self.live.write().unwrap_or_else(std::sync::PoisonError::into_inner);
        *live = Live::Closed("it is being opened again".into());
        match open::queue(&self.state, &self.clock) {
            Ok((queue, opening)) => {
                *live = Live::Open(Box::new(queue));
                *self.opening.lock().unwrap_or_else(std::sync::PoisonError::into_inner) = opening;
                Ok(())
            }
            Err(error) => {
                *live = Live::Closed(error.to_string());
                Err(error)
            }
        }
    }

    fn with<T>(&self, act: impl FnOnce(&Queue<SledTables>) -> Result<T, StoreError>) -> Result<T, StoreError> {
        match &*self.live.read().unwrap_or_else(std::sync::PoisonError::into_inner) {
            Live::Open(queue) => act(queue),
            Live::Closed(reason) => Err(StoreError::Poisoned { reason: reason.clone() }),
        }
    }
}

impl Drop for SledStore {
    fn drop(&mut self) {
        let live = self.live.get_mut().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Live::Open(queue) = live
            && let Err(error) = queue.tables().note(queue.reached())
        {
            tracing::warn!(%error, "the store could not note how far it got; nothing acknowledged is lost");
        }
        *live = Live::Closed("it was closed".into());
        // Closing the file would do, but for a child that was started just now and has not let go of it yet.
        if let Err(error) = self.lock.unlock() {
            tracing::warn!(%error, "the lock of the store could not be released; it ends with the process");
        }
    }
}

impl JobStore for SledStore {
    fn submit(&self, found: &[Submission]) -> Result<Vec<Submitted>, StoreError> {
        self.with(|queue| queue.submit(found))
    }

    fn claim(&self, want: &Filter) -> Result<Option<Claim>, StoreError> {
        self.with(|queue| queue.claim(want))
    }

    fn heartbeat(&self, claim: &Claim) -> Result<Lease, StoreError> {
        self.with(|queue| queue.heartbeat(claim))
    }

    fn advance(&self, claim: &Claim, step: Step) -> Result<Job, StoreError> {
        self.with(|queue| queue.advance(claim, step))
    }

    fn control(&self, id: JobId, wish: Control) -> Result<Job, StoreError> {
        self.with(|queue| queue.control(id, wish))
    }

    fn recover(&self, innocent: &dyn Fn(&Job) -> bool) -> Result<Vec<Recovered>, StoreError> {
        self.with(|queue| queue.recover(innocent))
    }

    fn get(&self, id: JobId) -> Result<Option<Job>, StoreError> {
        self.with(|queue| queue.get(id))
    }

    fn list(&self, query: &Query) -> Result<Vec<Job>, StoreError> {
        self.with(|queue| queue.list(query))
    }

    fn counts(&self) -> Result<Vec<(Kind, u64)>, StoreError> {
        self.with(|queue| queue.counts())
    }
}
