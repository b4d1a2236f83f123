//! Pages of jobs, and the job of a file.

use crate::id::JobId;
use crate::job::{Ending, Kind};
use crate::store::{Control, Filter, JobStore, Look, PAGE_READS, Page, StoreError, Submission};

use super::tools::{ManualClock, Subject, claim_any, finish, named, submit_one};

/// The numbers on each page from the latest job on, to the end.
fn leaf_through(store: &dyn JobStore, look: &Look) -> Result<Vec<Vec<u64>>, StoreError> {
    let (mut pages, mut look) = (Vec::new(), look.clone());
    loop {
        let Page { jobs, next } = store.page(&look)?;
        assert!(jobs.len() <= look.limit);
        pages.push(jobs.iter().map(|job| job.id.0).collect());
        assert!(pages.len() < 100, "it ends");
        match next {
            Some(next) => look.before = Some(next),
            None => return Ok(pages),
        }
    }
}

pub(super) fn pages_are_the_latest_first(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    let store = subject.store();
    // Of several size classes, so that the index is in another order.
    for (i, size) in [84, 1 << 20, 100, 5000, 1 << 30, 84].into_iter().enumerate() {
        submit_one(store, &format!("{i}.stl"), size)?;
    }
    finish(store, &claim_any(store)?, Ending::Clean, true)?;
    store.control(JobId(4), Control::Cancel)?;
    let all = Look { limit: 4, ..Look::default() };
    assert_eq!(leaf_through(store, &all)?, [vec![6, 5, 4, 3], vec![2, 1]]);
    let queued = Look { kinds: vec![Kind::Queued], limit: 2, ..Look::default() };
    assert_eq!(leaf_through(store, &queued)?, [vec![6, 5], vec![3, 2], vec![]]);
    let several = Look { kinds: vec![Kind::Done, Kind::Queued, Kind::Cancelled, Kind::Done], limit: 3, ..Look::default() };
    assert_eq!(leaf_through(store, &several)?.concat(), [6, 5, 4, 3, 2, 1]);
    let none = Look { kinds: vec![Kind::Failed], limit: 3, ..Look::default() };
    assert_eq!(leaf_through(store, &none)?, [Vec::<u64>::new()]);
    assert_eq!(store.page(&Look::default())?, Page::default());
    // A folder of which there are few jobs, among very many: a page may be empty and yet not the last.
    let other = |name: &str| -> Result<Submission, StoreError> {
        let mut other = named(name, 84)?;
        other.source.folder = "other".into();
        Ok(other)
    };
    let many: Vec<_> = (0..PAGE_READS + 5).map(|i| other(&format!("m{i}.stl"))).collect::<Result<_, _>>()?;
    store.submit(&many)?;
    for kinds in [vec![], vec![Kind::Queued]] {
        let hot = Look { folder: Some("hot".into()), kinds, limit: 2, ..Look::default() };
        let first = store.page(&hot)?;
        assert!(first.jobs.is_empty() && first.next == Some(JobId(12)), "{first:?}");
        let found = leaf_through(store, &hot)?.concat();
        assert_eq!(found.first(), Some(&6));
    }
    Ok(())
}

pub(super) fn a_files_latest_job_is_found(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    let store = subject.store();
    let source = named("a.stl", 84)?.source;
    assert_eq!(store.find(&source)?, None);
    let first = submit_one(store, "a.stl", 84)?;
    let claim = store.claim(&Filter::default())?.ok_or(StoreError::Unknown(first))?;
    finish(store, &claim, Ending::Clean, true)?;
    assert_eq!(store.find(&source)?, Some(first), "though it does not answer for it any more");
    let second = submit_one(store, "a.stl", 84)?;
    assert_eq!((store.find(&source)?, first != second), (Some(second), true));
    let mut other = source.clone();
    other.mtime_ns += 1;
    assert_eq!(store.find(&other)?, None);
    store.control(second, Control::Cancel)?;
    store.forget(&[second])?;
    assert_eq!(store.find(&source)?, Some(first), "the latest that is known");
    store.forget(&[first])?;
    assert_eq!(store.find(&source)?, None);
    Ok(())
}
