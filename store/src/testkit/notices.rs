//! Those who are to hear of ends of jobs hear of each, whatever becomes of the daemon or of the job.

use crate::id::Seq;
use crate::job::{Ending, Job, Kind};
use crate::store::{Control, JobStore, StoreError};

use super::tools::{ManualClock, Subject, claim_any, finish, submit_one};

/// A file comes and is done.
fn ends(store: &dyn JobStore, name: &str, ending: Ending) -> Result<Job, StoreError> {
    submit_one(store, name, 84)?;
    finish(store, &claim_any(store)?, ending, true)
}

fn told(store: &dyn JobStore, name: &str) -> Result<Vec<Job>, StoreError> {
    let notices = store.notices(name, 100)?;
    assert_eq!(store.backlog(name)?, notices.len() as u64);
    Ok(notices)
}

pub(super) fn ends_are_told_until_they_are_acknowledged(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    let store = subject.store();
    let both = ["farm", "shop"].map(String::from);
    ends(store, "before.stl", Ending::Clean)?;
    store.subscribe(&both)?;
    let first = ends(store, "a.stl", Ending::Repaired)?;
    let second = ends(store, "b.stl", Ending::Unreadable)?;
    submit_one(store, "waits.stl", 84)?;
    for name in &both {
        assert_eq!(told(store, name)?, [first.clone(), second.clone()], "{name}");
    }
    assert_eq!(store.notices("farm", 1)?.first(), Some(&first));
    store.acknowledge("farm", first.seq)?;
    subject.restart();
    let store = subject.store();
    store.subscribe(&both)?;
    assert_eq!(told(store, "farm")?.as_slice(), std::slice::from_ref(&second));
    assert_eq!(told(store, "shop")?, [first.clone(), second.clone()]);
    // What was acknowledged stays so, also when an older word comes late.
    store.acknowledge("farm", second.seq)?;
    store.acknowledge("farm", first.seq)?;
    assert_eq!(told(store, "farm")?, []);
    store.acknowledge("shop", second.seq)?;
    assert_eq!(told(store, "shop")?, []);
    Ok(())
}

/// A retry, and the end of a record, change nothing of what was to be told.
pub(super) fn notices_outlive_what_becomes_of_their_jobs(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    let store = subject.store();
    store.subscribe(&["farm".into()])?;
    let failed = ends(store, "a.stl", Ending::NotGood)?;
    store.control(failed.id, Control::Retry)?;
    let done = finish(store, &claim_any(store)?, Ending::Repaired, true)?;
    assert_eq!((done.id, done.kind()), (failed.id, Kind::Done));
    assert_eq!(store.forget(&[done.id])?, 1);
    subject.restart();
    assert_eq!(told(subject.store(), "farm")?, [failed, done]);
    Ok(())
}

pub(super) fn who_does_not_subscribe_costs_nothing(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    let store = subject.store();
    store.subscribe(&["farm".into(), "shop".into()])?;
    let first = ends(store, "a.stl", Ending::Clean)?;
    // Who has gone is not waited for, and begins anew on coming back.
    store.subscribe(&["farm".into()])?;
    store.acknowledge("shop", Seq(u64::MAX))?;
    store.subscribe(&["farm".into(), "shop".into()])?;
    assert_eq!((told(store, "farm")?, told(store, "shop")?), (vec![first], vec![]));
    store.subscribe(&[])?;
    ends(store, "b.stl", Ending::Clean)?;
    store.subscribe(&["farm".into()])?;
    assert_eq!(told(store, "farm")?, []);
    assert!(matches!(store.subscribe(&["n".repeat(99)]), Err(StoreError::TooLong { .. })));
    assert!(matches!(store.subscribe(&vec![String::new(); 33]), Err(StoreError::TooLong { .. })));
    Ok(())
}
