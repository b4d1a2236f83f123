//! What the checks are written with: a clock that is set by hand, and the usual steps.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::id::{Boot, Clock, Hash, JobId, Time};
use crate::job::{Ending, Job, Priority, Publication, Source, Step, Testimony};
use crate::path::{PathError, RelPath};
use crate::store::{Claim, Filter, JobStore, Seen, StoreError, Submission};

/// A clock that stands still until it is set.
#[derive(Debug)]
pub struct ManualClock {
    now: AtomicU64,
    ticks: AtomicU64,
    boot: AtomicU64,
}

impl ManualClock {
    /// A clock at `now`.
    pub fn new(now: Time) -> Self {
        Self { now: AtomicU64::new(now.0), ticks: AtomicU64::new(0), boot: AtomicU64::new(1) }
    }

    /// Sets it, forwards or backwards. The clock that only goes forward knows nothing of it.
    pub fn set(&self, now: Time) {
        self.now.store(now.0, Ordering::SeqCst);
    }

    /// Lets `ms` pass.
    pub fn pass(&self, ms: u64) {
        self.now.fetch_add(ms, Ordering::SeqCst);
        self.ticks.fetch_add(ms, Ordering::SeqCst);
    }

    /// The machine goes down and comes up again.
    pub fn reboot(&self) {
        self.boot.fetch_add(1, Ordering::SeqCst);
    }
}

impl Clock for ManualClock {
    fn now(&self) -> Time {
        Time(self.now.load(Ordering::SeqCst))
    }

    fn boot(&self) -> Boot {
        Boot(self.boot.load(Ordering::SeqCst))
    }

    fn ticks(&self) -> u64 {
        self.ticks.load(Ordering::SeqCst)
    }
}

/// A store under test.
pub trait Subject {
    /// It, in its present life.
    fn store(&self) -> &dyn JobStore;
    /// The daemon dies, and another opens the same store.
    fn restart(&mut self);
}

/// A dropped file of the name `name` and `size` bytes; its inode is a checksum of the name.
///
/// # Errors
/// When `name` is no plain relative path.
pub fn dropped(name: &str, size: u64) -> Result<Submission, PathError> {
    let source = Source {
        folder: "hot".into(),
        path: RelPath::new(name)?,
        dev: 1,
        ino: u64::from(crc32fast::hash(name.as_bytes())),
        size,
        mtime_ns: 1_700_000_000_000_000_000,
        profile: "default".into(),
    };
    Ok(Submission { source, foreign: None, priority: Priority::default(), seen: Seen::Now })
}

/// A result of `ending` under the names of the source.
pub fn result_of(job: &Job, ending: Ending) -> Publication {
    Publication {
        ending,
        reason: String::new(),
        output: Some(job.source.path.clone()),
        output_hash: Some(Hash([7; 32])),
        report_hash: Some(Hash([8; 32])),
        recipe: None,
        reused: None,
        source_ctime_ns: None,
        original: Some(job.source.path.clone()),
        stays: false,
        decision: None,
    }
}

pub(super) fn named(name: &str, size: u64) -> Result<Submission, StoreError> {
    dropped(name, size).map_err(|error| StoreError::TooLong { what: error.to_string() })
}

pub(super) fn submit_one(store: &dyn JobStore, name: &str, size: u64) -> Result<JobId, StoreError> {
    let answers = store.submit(&[named(name, size)?])?;
    assert_eq!(answers.len(), 1);
    answers.first().map(|answer| answer.id).ok_or(StoreError::Unknown(JobId(0)))
}

pub(super) fn claim_any(store: &dyn JobStore) -> Result<Claim, StoreError> {
    store.claim(&Filter::default())?.ok_or(StoreError::Unknown(JobId(0)))
}

pub(super) fn job(store: &dyn JobStore, id: JobId) -> Result<Job, StoreError> {
    store.get(id)?.ok_or(StoreError::Unknown(id))
}

pub(super) fn no_one_is_innocent(_: &Job) -> Testimony {
    Testimony::None
}

/// Takes a claim to its end; `moves`: the original leaves `in/`.
pub(super) fn finish(store: &dyn JobStore, claim: &Claim, ending: Ending, moves: bool) -> Result<Job, StoreError> {
    let mut publication = result_of(&claim.job, ending);
    if !moves {
        publication.original = None;
    }
    store.advance(claim, Step::Intend(publication))?;
    store.advance(claim, Step::Placed)?;
    store.advance(claim, Step::Finished)
}
