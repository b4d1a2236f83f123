//! Records of the past may go.

use crate::id::JobId;
use crate::job::{Ending, Kind};
use crate::store::{Control, JobStore, Query, StoreError};

use super::tools::{ManualClock, Subject, claim_any, finish, named, submit_one};

fn at_rest(store: &dyn JobStore) -> Result<u64, StoreError> {
    Ok(store.counts()?.iter().filter(|(kind, _)| kind.is_at_rest()).map(|(_, count)| count).sum())
}

pub(super) fn what_is_at_rest_can_be_forgotten(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    let store = subject.store();
    let [done, kept, cancelled, waits] = ["a.stl", "b.stl", "c.stl", "d.stl"].map(|name| submit_one(store, name, 84));
    let (done, kept, cancelled, waits) = (done?, kept?, cancelled?, waits?);
    store.control(cancelled, Control::Cancel)?;
    for id in [done, kept] {
        let claim = claim_any(store)?;
        assert_eq!(claim.id, id);
        finish(store, &claim, Ending::Clean, true)?;
    }
    let running = claim_any(store)?;
    assert_eq!((running.id, at_rest(store)?), (waits, 3));
    let later = submit_one(store, "e.stl", 84)?;
    // What is not at rest, or was never there, is passed over.
    assert_eq!(store.forget(&[done, cancelled, waits, later, JobId(99)])?, 2);
    assert_eq!(store.forget(&[done, cancelled])?, 0);
    subject.restart();
    let store = subject.store();
    assert_eq!((store.get(done)?, at_rest(store)?), (None, 1));
    let left: Vec<_> = store.list(&Query::default())?.iter().map(|job| job.id).collect();
    assert_eq!(left, [kept, waits, later]);
    assert_eq!(store.list(&Query { kinds: vec![Kind::Done], ..Query::default() })?.len(), 1);
    // Its file is nobody's now, and a number is never used again.
    let again = store.submit(&[named("c.stl", 84)?])?;
    assert!(again.iter().all(|answer| answer.new && answer.id > later));
    Ok(())
}

/// A file that was put back is a later job's, whose record leads to it still.
pub(super) fn forgetting_one_job_leaves_the_next_of_its_file(
    subject: &mut dyn Subject,
    _: &ManualClock,
) -> Result<(), StoreError> {
    let store = subject.store();
    let first = submit_one(store, "a.stl", 84)?;
    finish(store, &claim_any(store)?, Ending::Clean, true)?;
    let second = submit_one(store, "a.stl", 84)?;
    assert_ne!(first, second);
    assert_eq!(store.forget(&[first])?, 1);
    let answers = store.submit(&[named("a.stl", 84)?])?;
    assert!(answers.iter().all(|answer| !answer.new && answer.id == second));
    Ok(())
}
