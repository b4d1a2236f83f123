//! Is the database away, and since when: what all calls of a store know of it together, and say once.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::id::{Clock, SystemClock, Time};
use crate::store::StoreError;

/// A database that comes back sooner was not away: it restarts, or its connections were closed.
const TELL_AFTER: Duration = Duration::from_secs(1);
/// While it is away, whoever is in a hurry tries no more often than this.
const TRY_EVERY: Duration = Duration::from_secs(1);

/// What is known of a database.
pub(super) struct Outage {
    /// Where it is, for people.
    place: String,
    now: Mutex<Option<Failing>>,
}

/// It has not answered since.
struct Failing {
    since: Instant,
    wall: Time,
    tried: Instant,
    reason: String,
    told: bool,
}

impl Outage {
    pub(super) fn new(place: String) -> Self {
        Self { place, now: Mutex::default() }
    }

    fn lock(&self) -> MutexGuard<'_, Option<Failing>> {
        self.now.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A call was answered.
    pub(super) fn end(&self) {
        if let Some(failing) = self.lock().take().filter(|failing| failing.told) {
            tracing::info!(seconds = failing.since.elapsed().as_secs(), "The job database answers again.");
        }
    }

    /// A call was not.
    pub(super) fn go_on(&self, reason: &str) {
        let mut now = self.lock();
        let failing = now.get_or_insert_with(|| Failing {
            since: Instant::now(),
            wall: SystemClock.now(),
            tried: Instant::now(),
            reason: String::new(),
            told: false,
        });
        (failing.tried, failing.reason) = (Instant::now(), reason.to_owned());
        if failing.since.elapsed() >= TELL_AFTER && !std::mem::replace(&mut failing.told, true) {
            tracing::warn!(reason, place = self.place, "The job database does not answer; work waits for it.");
        }
    }

    /// Since when, once that was told.
    pub(super) fn since(&self) -> Option<Time> {
        self.lock().as_ref().filter(|failing| failing.told).map(|failing| failing.wall)
    }

    /// Whoever is in a hurry need not try: it is away, as others found just now.
    pub(super) fn is_certain(&self) -> bool {
        self.lock().as_ref().is_some_and(|failing| failing.told && failing.tried.elapsed() < TRY_EVERY)
    }

    /// What answers there cannot show who it is.
    pub(super) fn distrust(&self, reason: &str) -> StoreError {
        StoreError::Unusable {
            path: self.place.clone().into(),
            reason: reason.to_owned(),
            advice:
                "name the file of the authority that has signed the server's certificate with sslrootcert=…, or ask its owner"
                    .into(),
        }
    }

    /// As a call says it that gives up.
    pub(super) fn error(&self) -> StoreError {
        let now = self.lock();
        let (seconds, reason) =
            now.as_ref().map_or((0, String::new()), |failing| (failing.since.elapsed().as_secs(), failing.reason.clone()));
        StoreError::Away { place: self.place.clone(), seconds, reason }
    }
}
