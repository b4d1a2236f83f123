//! A store that was begun anew, and jobs of an earlier one.

use crate::id::{Attempt, JobId, Time, Token};
use crate::job::{Duty, Ending, Job, Kind, Past, Reached, Step};
use crate::path::RelPath;
use crate::store::{Query, StoreError};

use super::tools::{ManualClock, Subject, claim_any, job, named, no_one_is_innocent, result_of, submit_one};

fn past(name: &str, id: u64, reached: Reached, ending: Ending) -> Result<Past, StoreError> {
    let source = named(name, 84)?.source;
    let publication = result_of(&Job::queued(JobId(id), source.clone(), Time(5)), ending);
    let work = (reached != Reached::Ended).then_some(Token(900_u64.wrapping_add(id)));
    Ok(Past { id: JobId(id), source, moved_to: None, publication, attempts: Attempt(2), work, ended: Time(5), reached })
}

/// Until it is said that nothing is left to be read, whatever lives come and go.
pub(super) fn a_new_store_says_so(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    submit_one(subject.store(), "part.stl", 84)?;
    for _ in 0..2 {
        assert!(subject.store().is_unfilled()?);
        subject.restart();
    }
    for _ in 0..2 {
        subject.store().set_filled()?;
        subject.restart();
        assert!(!subject.store().is_unfilled()?);
    }
    submit_one(subject.store(), "other.stl", 84)?;
    assert_eq!(subject.store().list(&Query::default())?.len(), 2);
    Ok(())
}

/// With their numbers where these are free; what was under way is finished first, under a token of its own.
pub(super) fn jobs_of_an_earlier_store_come_back(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    let one = submit_one(subject.store(), "new.stl", 84)?;
    let past = [
        past("done.stl", 7, Reached::Ended, Ending::Clean)?,
        past("twice.stl", 7, Reached::Ended, Ending::Refused)?,
        past("new.stl", one.0, Reached::Ended, Ending::Quarantined)?,
        past("moved.stl", 5, Reached::Published, Ending::Clean)?,
        past("placed.stl", u64::MAX, Reached::Publishing, Ending::Repaired)?,
    ];
    let ids = subject.store().restore(&past)?;
    assert_eq!(ids.iter().map(|id| id.0).collect::<Vec<_>>(), [7, 8, 9, 5, 10]);
    subject.restart();
    let store = subject.store();
    assert_eq!(store.recover(&no_one_is_innocent)?, [], "they are no one's");
    let kinds: Vec<_> = store.list(&Query::default())?.iter().map(|job| (job.id.0, job.kind())).collect();
    let expected = [Kind::Queued, Kind::Parked, Kind::Done, Kind::Failed, Kind::Quarantined, Kind::Parked];
    assert_eq!(kinds, [1, 5, 7, 8, 9, 10].into_iter().zip(expected).collect::<Vec<_>>());
    for (id, duty) in [(JobId(5), Duty::MoveOriginal), (JobId(10), Duty::Place)] {
        let claim = claim_any(store)?;
        assert_eq!((claim.id, claim.job.duty(), claim.job.attempts), (id, duty, Attempt(2)));
        assert!(claim.job.work.is_some_and(|work| claim.token > work), "a token of the earlier store is given again");
        if duty == Duty::Place {
            store.advance(&claim, Step::Placed)?;
        }
        assert_eq!(store.advance(&claim, Step::Finished)?.kind(), Kind::Done);
    }
    // An original that stands where it was moved to, and is dropped again, is a new drop; one that never left is not.
    assert_eq!(submit_one(store, "done.stl", 84)?, JobId(11));
    let mut stays = past.first().cloned().ok_or(StoreError::Unknown(JobId(7)))?;
    (stays.publication.stays, stays.source.path) = (true, named("stays.stl", 84)?.source.path);
    stays.source.ino = 77;
    let mut dropped = named("stays.stl", 84)?;
    dropped.source.ino = 77;
    let back = store.restore(&[stays.clone()])?;
    assert_eq!(store.submit(&[dropped])?.iter().map(|answer| answer.id).collect::<Vec<_>>(), back);
    // What fits no record is refused as a whole.
    let count = store.list(&Query::default())?.len();
    let long = RelPath::new("p".repeat(620)).map_err(|error| StoreError::TooLong { what: error.to_string() })?;
    let mut odd = stays.clone();
    odd.publication.original = Some(long);
    assert!(matches!(store.restore(&[stays, odd]), Err(StoreError::TooLong { .. })));
    assert_eq!(store.list(&Query::default())?.len(), count);
    assert_eq!(job(store, JobId(5))?.submitted, Time(5));
    Ok(())
}
