//! The embedded store: the queue over sled 0.34, with what sled leaves out put around it.
//!
//! **On disk**, in the daemon's state folder:
//!
//! | name             | what                                                                                               |
//! |------------------|----------------------------------------------------------------------------------------------------|
//! | `LOCK`           | locked by the daemon that owns the folder; its process number as text                              |
//! | `SEQ`            | how far the store got: `suture-seq 1 <epoch> <transition> <crc32>`; see below                      |
//! | `db/`            | the sled database: trees `meta`, `jobs`, `by_state`, `outbox`: see [`crate::queue`]   |
//! | `db.trial/`      | only while a damaged database is being examined                                                    |
//! | `corrupt-<ms>/`  | a damaged database that was replaced, alone or with its `SEQ`; for people                          |
//!
//! The tree `folders` is reserved. Values are records (`crate::record`: magic, schema version, checksum, JSON, little more
//! than 4 KiB at most); whatever is larger (reports, meshes) is a file elsewhere.
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
//! or advanced. It is opened anew, as a new epoch, by a new process, or by the same one with a new program: handles of a database in
//! doubt are not dropped, since sled waits at their end, now and then, for a write that never comes.

use std::collections::BTreeSet;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::id::{Clock, JobId, Recipe, Seq, SystemClock, Time};
use crate::job::{Job, Kind, Past, Source, Step, Testimony};
use crate::news::{News, Notice};
use crate::queue::Queue;
use crate::share::Shares;
use crate::store::{
    Claim, Control, Filter, JobStore, Lease, Look, Page, Query, Recovered, StoreError, Submission, Submitted, Waiting,
};
use crate::transfer::{Holdings, Transfer};

mod files;
#[cfg(test)]
mod kill_tests;
mod open;
#[cfg(test)]
mod size_tests;
mod tables;
#[cfg(test)]
mod tests;

pub use open::{Opening, Verified};
use tables::SledTables;

/// The embedded [`JobStore`].
pub struct SledStore {
    state: PathBuf,
    queue: Queue<SledTables>,
    opening: Opening,
    /// The folder is ours until every handle of the database is gone: dropped last.
    lock: StateLock,
}

/// The lock of a state folder, which one daemon has at a time; it ends with the process, however that ends.
pub struct StateLock(File);

impl StateLock {
    /// Takes the lock of the folder `state`, which is made if it is missing.
    ///
    /// # Errors
    /// [`StoreError::Locked`] when another daemon has it; [`StoreError::Io`].
    pub fn take(state: &Path) -> Result<Self, StoreError> {
        files::make_folder(state)?;
        files::lock(state).map(Self)
    }
}

impl Drop for StateLock {
    fn drop(&mut self) {
        // Closing the file would do, but for a child that was started just now and has not let go of it yet.
        if let Err(error) = self.0.unlock() {
            tracing::warn!(%error, "the lock of the store could not be released; it ends with the process");
        }
    }
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
        let lock = StateLock::take(state)?;
        let (queue, opening) = open::queue(state, &clock)?;
        Ok(Self { state: state.to_owned(), queue, opening, lock })
    }

    /// All jobs of the store in `state`, by number, without opening it: nothing is written, so that neither the right to write nor
    /// room on its disk is needed.
    ///
    /// # Errors
    /// [`StoreError::Locked`] while a daemon owns the folder; else as [`SledStore::open`].
    pub fn peek(state: &Path) -> Result<Vec<Job>, StoreError> {
        open::peek(state)
    }

    /// Looks at every record of the store in `state`, on a copy in a temporary folder: nothing of the store is changed.
    ///
    /// # Errors
    /// [`StoreError::Locked`] while a daemon owns the folder, [`StoreError::Newer`], and what keeps the files from being read. Damage is a
    /// finding, not an error.
    pub fn verify(state: &Path) -> Result<Verified, StoreError> {
        open::verify(state, &(Arc::new(SystemClock) as Arc<dyn Clock>))
    }

    /// Moves a database that cannot be trusted aside, with the mark of how far it got, so that a new one can be begun; where they are now.
    /// `None`: the database is sound, and nothing was changed.
    ///
    /// # Errors
    /// [`StoreError::Locked`] while a daemon owns the folder; else whatever keeps it from being looked at, or moved.
    pub fn set_aside(state: &Path) -> Result<Option<PathBuf>, StoreError> {
        let _lock = StateLock(files::lock(state)?);
        open::set_untrusted_aside(state, &(Arc::new(SystemClock) as Arc<dyn Clock>))
    }

    /// What the opening met.
    pub fn opening(&self) -> &Opening {
        &self.opening
    }
}

impl Drop for SledStore {
    fn drop(&mut self) {
        let tables = self.queue.tables();
        if let Err(error) = tables.note(self.queue.reached()) {
            tracing::warn!(%error, "the store could not note how far it got; nothing acknowledged is lost");
        }
    }
}

impl Transfer for SledStore {
    fn holdings(&self) -> Result<Holdings, StoreError> {
        self.queue.holdings()
    }

    fn take_over(&self, holdings: &Holdings) -> Result<(), StoreError> {
        self.queue.take_over(holdings)
    }
}

impl JobStore for SledStore {
    fn submit(&self, found: &[Submission]) -> Result<Vec<Submitted>, StoreError> {
        self.queue.submit(found)
    }

    fn claim(&self, want: &Filter) -> Result<Option<Claim>, StoreError> {
        self.queue.claim(want)
    }

    fn has_parked(&self) -> Result<bool, StoreError> {
        self.queue.has_parked()
    }

    fn waiting(&self, want: &Filter) -> Result<Option<Waiting>, StoreError> {
        self.queue.waiting(want)
    }

    fn shut(&self, folders: &BTreeSet<String>) {
        self.queue.shut(folders);
    }

    fn share(&self, shares: &Shares) {
        self.queue.share(shares);
    }

    fn heartbeat(&self, claim: &Claim) -> Result<Lease, StoreError> {
        self.queue.heartbeat(claim)
    }

    fn advance(&self, claim: &Claim, step: Step) -> Result<Job, StoreError> {
        self.queue.advance(claim, step)
    }

    fn control(&self, id: JobId, wish: Control) -> Result<Job, StoreError> {
        self.queue.control(id, wish)
    }

    fn recover(&self, testimony: &dyn Fn(&Job) -> Testimony) -> Result<Vec<Recovered>, StoreError> {
        self.queue.recover(testimony)
    }

    fn get(&self, id: JobId) -> Result<Option<Job>, StoreError> {
        self.queue.get(id)
    }

    fn list(&self, query: &Query) -> Result<Vec<Job>, StoreError> {
        self.queue.list(query)
    }

    fn page(&self, look: &Look) -> Result<Page, StoreError> {
        self.queue.page(look)
    }

    fn find(&self, source: &Source) -> Result<Option<JobId>, StoreError> {
        self.queue.find(source)
    }

    fn results(&self, size: u64, recipe: Option<Recipe>) -> Result<Vec<Job>, StoreError> {
        self.queue.results(size, recipe)
    }

    fn check(&self) -> Result<(), StoreError> {
        files::check_lock(&self.state, &self.lock.0)
    }

    fn forget(&self, ids: &[JobId]) -> Result<u64, StoreError> {
        self.queue.forget(ids)
    }

    fn is_unfilled(&self) -> Result<bool, StoreError> {
        self.queue.is_unfilled()
    }

    fn restore(&self, past: &[Past]) -> Result<Vec<JobId>, StoreError> {
        self.queue.restore(past)
    }

    fn set_filled(&self) -> Result<(), StoreError> {
        self.queue.set_filled()
    }

    fn subscribe(&self, names: &[String]) -> Result<(), StoreError> {
        self.queue.subscribe(names)
    }

    fn notices(&self, name: &str, most: usize) -> Result<Vec<Notice>, StoreError> {
        self.queue.notices(name, most)
    }

    fn acknowledge(&self, name: &str, seq: Seq) -> Result<(), StoreError> {
        self.queue.acknowledge(name, seq)
    }

    fn backlog(&self, name: &str) -> Result<u64, StoreError> {
        self.queue.backlog(name)
    }

    fn tell(&self, news: &News) -> Result<bool, StoreError> {
        self.queue.tell(news)
    }

    fn last_night(&self) -> Result<Option<Time>, StoreError> {
        self.queue.last_night()
    }

    fn begin_night(&self, at: Time) -> Result<(), StoreError> {
        self.queue.begin_night(at)
    }

    fn counts(&self) -> Result<Vec<(Kind, u64)>, StoreError> {
        self.queue.counts()
    }
}
