//! The numbers of a night: the page and the table that a person asks for count by the same rule as the word that others are sent.

use std::collections::BTreeMap;
use std::ops::RangeBounds;

use serde::Serialize;
use suture_store::{Job, JobStore, Kind, StoreError, Time};

use crate::past::each_job;

/// Jobs that a person must look at.
pub(crate) const NEED_SOMEONE: [Kind; 5] = [Kind::NeedsReview, Kind::Failed, Kind::Quarantined, Kind::Parked, Kind::Noticed];

/// Where a job stands in the account of a night.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    /// It needs a person, however old it is.
    NeedsSomeone,
    /// It is over, and ended in that night.
    Ended,
    /// It waits, or is in work.
    Lives,
}

/// The part of a job in a night of these times; `None`: it ended at another time, and needs no one.
pub(crate) fn part(job: &Job, times: &impl RangeBounds<Time>) -> Option<Part> {
    match job.kind() {
        kind if NEED_SOMEONE.contains(&kind) => Some(Part::NeedsSomeone),
        kind if kind.is_at_rest() => times.contains(&job.changed).then_some(Part::Ended),
        _ => Some(Part::Lives),
    }
}

/// How many jobs of each kind a night counts.
///
/// # Errors
/// When the store failed.
pub(crate) fn count(store: &dyn JobStore, times: &impl RangeBounds<Time>) -> Result<BTreeMap<Kind, u64>, StoreError> {
    let mut counts = BTreeMap::new();
    each_job(store, &mut |job| {
        if part(job, times).is_some() {
            *counts.entry(job.kind()).or_default() += 1;
        }
    })?;
    Ok(counts)
}

/// The counts of a night, as they are sent.
#[derive(Debug, PartialEq, Eq, Serialize)]
pub(crate) struct Numbers {
    need_someone: u64,
    waiting: u64,
    in_work: u64,
    /// Of each kind, by its name.
    jobs: BTreeMap<&'static str, u64>,
}

impl Numbers {
    /// The sums of these counts.
    pub(crate) fn of(counts: &BTreeMap<Kind, u64>) -> Self {
        let sum = |is: fn(Kind) -> bool| counts.iter().filter(|(kind, _)| is(**kind)).map(|(_, count)| count).sum();
        Self {
            need_someone: sum(|kind| NEED_SOMEONE.contains(&kind)),
            waiting: sum(Kind::is_queued),
            in_work: sum(Kind::is_held),
            jobs: Kind::ALL.iter().map(|kind| (kind.name(), counts.get(kind).copied().unwrap_or_default())).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use suture_store::testkit::{ManualClock, dropped, result_of};
    use suture_store::{Ending, Filter, MemoryStore, Step};

    use super::*;

    /// Each job that ended counts in one night, whoever needs someone in each.
    #[test]
    fn what_ended_counts_in_its_night_and_what_needs_someone_in_each() {
        let clock = std::sync::Arc::new(ManualClock::new(Time(1000)));
        let store = MemoryStore::new(std::sync::Arc::<ManualClock>::clone(&clock));
        for (name, at, ending) in
            [("a.stl", 1000, Ending::Clean), ("b.stl", 2000, Ending::Repaired), ("c.stl", 1500, Ending::NotGood)]
        {
            clock.set(Time(at));
            store.submit(&[dropped(name, 84).unwrap()]).unwrap();
            let claim = store.claim(&Filter::default()).unwrap().unwrap();
            store.advance(&claim, Step::Intend(result_of(&claim.job, ending))).unwrap();
            store.advance(&claim, Step::Placed).unwrap();
            store.advance(&claim, Step::Finished).unwrap();
        }
        store.submit(&[dropped("d.stl", 84).unwrap()]).unwrap();
        let counted = |from, to| count(&store, &(Time(from)..Time(to))).unwrap();
        assert_eq!(counted(1000, 2000), [(Kind::Done, 1), (Kind::Failed, 1), (Kind::Queued, 1)].into());
        assert_eq!(counted(2000, 3000), [(Kind::Done, 1), (Kind::Failed, 1), (Kind::Queued, 1)].into());
        assert_eq!(counted(3000, 4000), [(Kind::Failed, 1), (Kind::Queued, 1)].into());
        assert_eq!(count(&store, &(Time(1000)..)).unwrap().get(&Kind::Done), Some(&2));
        let numbers = Numbers::of(&counted(1000, 2000));
        assert_eq!((numbers.need_someone, numbers.waiting, numbers.in_work, numbers.jobs["done"]), (1, 1, 0, 1));
    }
}
