//! Which records of jobs are to go. Their files stay as they are, and receipts tell of them.
//!
//! A job that answers for a file which still lies in `in/` (an original that is left there, one that an operator has cancelled) is remembered
//! for as long as that lies there: without its record the file would be taken once more.

use suture_store::job::Kind;
use suture_store::{Job, JobId, JobStore, Query, StoreError, Time};

use crate::config::keep::Keep;
use crate::units::{show_count, write_duration};

/// Jobs that are read at a time.
const PAGE: usize = 1000;

/// Records that go, for one reason.
#[derive(Debug, PartialEq)]
pub(crate) struct Past {
    pub ids: Vec<JobId>,
    /// In words.
    pub why: String,
}

/// Those of a store. `is_needed`: does a file lie in `in/` for which this job answers?
///
/// # Errors
/// Store errors only.
pub(crate) fn past(
    store: &dyn JobStore,
    keep: &Keep,
    now: Time,
    is_needed: &dyn Fn(&Job) -> bool,
) -> Result<Vec<Past>, StoreError> {
    let counts = store.counts()?;
    let ended: u64 = counts.iter().filter(|(kind, _)| kind.is_at_rest()).map(|(_, count)| count).sum();
    if keep.history.is_none() && ended <= keep.history_jobs {
        return Ok(Vec::new());
    }
    let kinds: Vec<Kind> = Kind::ALL.into_iter().filter(|kind| kind.is_at_rest()).collect();
    let (mut all, mut after) = (Vec::new(), JobId(0));
    loop {
        let page = store.list(&Query { kinds: Vec::new(), after, limit: PAGE })?;
        let Some(last) = page.last() else { break };
        after = last.id;
        all.extend(page.into_iter().filter(|job| kinds.contains(&job.kind())).map(|job| (job.changed, job.id)));
    }
    choose(all, keep, now, &mut |id| Ok(store.get(id)?.is_some_and(|job| !is_needed(&job))))
}

/// The same of jobs at hand.
pub(crate) fn past_of(jobs: &[Job], keep: &Keep, now: Time, is_needed: &dyn Fn(&Job) -> bool) -> Vec<Past> {
    let all = jobs.iter().filter(|job| job.kind().is_at_rest()).map(|job| (job.changed, job.id)).collect();
    let may_go = &mut |id| Ok(jobs.iter().find(|job| job.id == id).is_some_and(|job| !is_needed(job)));
    // Nothing here fails.
    choose(all, keep, now, may_go).unwrap_or_default()
}

fn choose(
    mut all: Vec<(Time, JobId)>,
    keep: &Keep,
    now: Time,
    may_go: &mut dyn FnMut(JobId) -> Result<bool, StoreError>,
) -> Result<Vec<Past>, StoreError> {
    all.sort_unstable();
    let age = keep.history.map(|age| u64::try_from(age.as_millis()).unwrap_or(u64::MAX));
    let is_old = |time: Time| age.is_some_and(|age| now.0.saturating_sub(time.0) > age);
    let most = usize::try_from(keep.history_jobs).unwrap_or(usize::MAX);
    let (mut old, mut many, mut left) = (Vec::new(), Vec::new(), all.len());
    for (time, id) in all {
        let list = match is_old(time) {
            true => &mut old,
            false if left > most => &mut many,
            false => break,
        };
        if may_go(id)? {
            list.push(id);
            left -= 1;
        }
    }
    let why_old = keep.history.map(|age| format!("ended more than {} ago", write_duration(age))).unwrap_or_default();
    let why_many = format!("more than {} jobs have ended", show_count(keep.history_jobs));
    let past = [(old, why_old), (many, why_many)];
    Ok(past.into_iter().filter(|(ids, _)| !ids.is_empty()).map(|(ids, why)| Past { ids, why }).collect())
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicU64, Ordering};
    use std::time::Duration;

    use suture_store::{Boot, Clock, Control, MemoryStore, Priority, RelPath, Seen, Source, Submission};

    use super::*;

    const DAY: u64 = 24 * 3600 * 1000;

    /// A clock that is set by hand.
    struct Days(AtomicU64);

    impl Clock for Days {
        fn now(&self) -> Time {
            Time(self.0.load(Ordering::SeqCst))
        }

        fn boot(&self) -> Boot {
            Boot(1)
        }

        fn ticks(&self) -> u64 {
            self.0.load(Ordering::SeqCst)
        }
    }

    /// A job a day, for ten days; the last one waits still.
    fn ten_days() -> (MemoryStore, Time) {
        let clock = Arc::new(Days(AtomicU64::new(1000 * DAY)));
        let store = MemoryStore::new(Arc::<Days>::clone(&clock));
        for day in 1..=10 {
            let path = RelPath::new(format!("{day}.stl")).unwrap();
            let (folder, profile) = ("hot".into(), "default".into());
            let source = Source { folder, path, dev: 1, ino: day, size: 84, mtime_ns: 5, profile };
            store.submit(&[Submission { source, foreign: None, priority: Priority::default(), seen: Seen::Now }]).unwrap();
            if day < 10 {
                store.control(JobId(day), Control::Cancel).unwrap();
            }
            clock.0.fetch_add(DAY, Ordering::SeqCst);
        }
        (store, clock.now())
    }

    fn ids(past: &[Past]) -> Vec<Vec<u64>> {
        past.iter().map(|past| past.ids.iter().map(|id| id.0).collect()).collect()
    }

    fn keep(days: Option<u64>, jobs: u64) -> Keep {
        Keep { history: days.map(|days| Duration::from_millis(days * DAY)), history_jobs: jobs, ..Keep::default() }
    }

    #[test]
    fn by_age_and_by_number() {
        let (store, now) = ten_days();
        let past = |days, jobs| past(&store, &keep(days, jobs), now, &|_| false).unwrap();
        assert!(past(None, 9).is_empty() && past(Some(10), 9).is_empty());
        assert_eq!(ids(&past(Some(7), 9)), [[1, 2, 3]]);
        let both = past(Some(8), 5);
        assert_eq!(ids(&both), [vec![1, 2], vec![3, 4]]);
        assert_eq!(both[0].why, "ended more than 8d ago");
        assert_eq!(both[1].why, "more than 5 jobs have ended");
        let all: Vec<u64> = ids(&past(Some(0), 1)).concat();
        assert_eq!(all, [1, 2, 3, 4, 5, 6, 7, 8, 9], "never one that waits");
        let jobs = store.list(&Query::default()).unwrap();
        assert_eq!(past_of(&jobs, &keep(Some(8), 5), now, &|_| false), both);
    }

    #[test]
    fn a_job_whose_file_lies_in_the_folder_is_remembered() {
        let (store, now) = ten_days();
        let needed = |job: &Job| job.id.0 % 2 == 1;
        let past = past(&store, &keep(Some(5), 3), now, &needed).unwrap();
        assert_eq!(ids(&past), [vec![2, 4], vec![6, 8]]);
    }

    #[test]
    fn f15_a_clock_that_was_set_back_forgets_nothing_for_its_age() {
        let (store, _) = ten_days();
        assert!(past(&store, &keep(Some(0), 9), Time(0), &|_| false).unwrap().is_empty());
    }
}
