//! How many jobs ended in the last day, and how. All records are read for it, so that it is counted now and then: as often as it takes little of the machine's
//! time. A page waits for it only
//! where it takes next to nothing.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::Builder;
use std::time::{Duration, Instant};

use suture_store::{Ending, Job, Kind, Look, State, StoreError};

use crate::attempt::Context;
use crate::shown::hint;

/// Counted are jobs of so many milliseconds.
const DAY_MS: u64 = 24 * 3600 * 1000;
/// Records that are read at a time, and altogether.
const AT_A_TIME: usize = 500;
const MOST: usize = 200_000;
/// A count stands for so many times as long as it took.
const SHARE: u32 = 30;
/// Good results with a note that are kept, and so shown.
pub(super) const MOST_NOTED: usize = 25;
/// What takes no longer, a page waits for.
const SHORT: Duration = Duration::from_millis(20);

/// Jobs that ended in the last day.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Ended {
    /// Good as they came.
    pub clean: u64,
    pub repaired: u64,
    /// Not repaired, since there is a result of that name.
    pub skipped: u64,
    /// No meshes, but files that meshes name.
    pub carried: u64,
    /// Of those that are clean or repaired: copies of earlier results.
    pub reused: u64,
    pub needs_review: u64,
    /// By a person, after a review.
    pub rejected: u64,
    pub failed: u64,
    pub quarantined: u64,
    /// Good results of which a person may want to know something before they print them; and the latest of these.
    pub noted: u64,
    pub latest_noted: Vec<Job>,
}

impl Ended {
    fn add(&mut self, job: &Job) {
        let State::Ended { publication } = &job.state else { return };
        let (ending, is_copy) = (publication.ending, publication.reused.is_some());
        let count = match ending {
            Ending::Clean => &mut self.clean,
            Ending::Repaired => &mut self.repaired,
            Ending::Skipped => &mut self.skipped,
            Ending::Carried => &mut self.carried,
            Ending::NeedsReview if job.kind() == Kind::Rejected => &mut self.rejected,
            Ending::NeedsReview => &mut self.needs_review,
            Ending::Quarantined => &mut self.quarantined,
            Ending::NotGood | Ending::Unreadable | Ending::Refused | Ending::NameTaken | Ending::Environment => &mut self.failed,
        };
        *count += 1;
        self.reused += u64::from(is_copy);
        if hint(job).is_some() {
            self.noted += 1;
            if self.latest_noted.len() < MOST_NOTED {
                self.latest_noted.push(job.clone());
            }
        }
    }
}

struct Counted {
    at: Instant,
    took: Duration,
    ended: Ended,
}

/// The last count.
#[derive(Default)]
pub(super) struct Tally {
    last: Mutex<Option<Counted>>,
    /// Held by whoever counts.
    counting: Mutex<()>,
}

impl Tally {
    /// As of now, or of a little while ago.
    ///
    /// # Errors
    /// As the store's.
    pub(super) fn of(self: &Arc<Self>, context: &Arc<Context>) -> Result<Ended, StoreError> {
        let now = context.world.steady();
        let Some((ended, age, took)) = self.known(now) else {
            // The first count is waited for.
            let _turn = self.counting.lock().unwrap_or_else(PoisonError::into_inner);
            return self.count(context);
        };
        if age < SHARE * took {
            return Ok(ended);
        }
        if took < SHORT {
            return self.count(context);
        }
        let (tally, other) = (Arc::clone(self), Arc::clone(context));
        let count = move || {
            // Someone else may count already; a store that does not answer, the next page tells of.
            if let Ok(_turn) = tally.counting.try_lock() {
                let _ = tally.count(&other);
            }
        };
        // Where no thread is to be had, the next page tries again.
        let _ = Builder::new().name("tally".into()).spawn(count);
        Ok(ended)
    }

    fn last(&self) -> MutexGuard<'_, Option<Counted>> {
        self.last.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The last count, its age, and how long it took.
    fn known(&self, now: Instant) -> Option<(Ended, Duration, Duration)> {
        self.last().as_ref().map(|counted| (counted.ended.clone(), now.saturating_duration_since(counted.at), counted.took))
    }

    fn count(&self, context: &Context) -> Result<Ended, StoreError> {
        let begun = context.world.steady();
        let ended = count(context)?;
        let at = context.world.steady();
        *self.last() = Some(Counted { at, took: at.saturating_duration_since(begun), ended: ended.clone() });
        Ok(ended)
    }
}

fn count(context: &Context) -> Result<Ended, StoreError> {
    let since = context.world.wall().0.saturating_sub(DAY_MS);
    let mut ended = Ended::default();
    let mut look = Look { limit: AT_A_TIME, ..Look::default() };
    for _ in 0..MOST / AT_A_TIME {
        let page = context.store.page(&look)?;
        for job in page.jobs.iter().filter(|job| job.changed.0 >= since) {
            ended.add(job);
        }
        look.before = page.next;
        if look.before.is_none() {
            break;
        }
    }
    Ok(ended)
}
