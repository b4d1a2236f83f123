//! Results on their way, and what the lists say.

use std::collections::BTreeSet;

use crate::id::{Attempt, Hash, JobId, Recipe};
use crate::job::{Duty, Ending, Illegal, Kind, Publication, State, Step};
use crate::store::{Filter, JobStore, Lease, MOST_RESULTS, Query, StoreError};

use super::tools::{ManualClock, Subject, claim_any, finish, job, named, no_one_is_innocent, result_of, submit_one};

pub(super) fn a_result_that_cannot_be_placed_is_parked(subject: &mut dyn Subject, clock: &ManualClock) -> Result<(), StoreError> {
    let store = subject.store();
    let (id, other) = (submit_one(store, "part.stl", 84)?, submit_one(store, "other.stl", 84)?);
    let claim = claim_any(store)?;
    let publication = result_of(&claim.job, Ending::Clean);
    store.advance(&claim, Step::Intend(publication))?;
    let park = Step::Park { reason: "permission denied".into(), committed: false };
    let parked = store.advance(&claim, park.clone())?;
    assert_eq!((parked.kind(), parked.note.as_str()), (Kind::Parked, "permission denied"));
    let void = store.advance(&claim, Step::Placed);
    assert!(matches!(void, Err(StoreError::Illegal { source: Illegal::Fenced, .. })), "its claim is void: {void:?}");
    assert_eq!(store.heartbeat(&claim)?, Lease::Lost);
    // Others go on meanwhile; when its pause is over, it is given to whoever asks.
    let between = claim_any(store)?;
    assert_eq!(between.id, other);
    assert_eq!((store.claim(&Filter::default())?, store.has_parked()?), (None, false));
    clock.pass(crate::job::PARK_MS);
    assert_eq!((store.has_parked()?, store.waiting(&Filter::default())?), (true, None));
    let again = store.claim(&Filter { size: (1 << 40, u64::MAX), alone: false })?.ok_or(StoreError::Unknown(id))?;
    assert_eq!((again.id, again.job.duty(), again.job.attempts), (id, Duty::Place, Attempt(1)));
    assert_eq!(again.job.work, Some(claim.token), "the work folder is still that of the worker");
    store.advance(&again, park)?;
    // A new daemon tries at once.
    subject.restart();
    let store = subject.store();
    assert_eq!(store.recover(&no_one_is_innocent)?.len(), 1, "parked jobs are no one's");
    let again = claim_any(store)?;
    assert_eq!(again.id, id);
    store.advance(&again, Step::Placed)?;
    assert_eq!(store.advance(&again, Step::Finished)?.kind(), Kind::Done);
    Ok(())
}

/// Good ones alone, by size and recipe, the latest first; never one that is only on its way.
pub(super) fn good_results_are_found_by_what_made_them(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    let (one, other) = (Recipe(7), Recipe(u64::MAX));
    let end = |store: &dyn JobStore, size, ending, recipe, output_hash: Option<Hash>| {
        let claim = store.claim(&Filter { size: (size, size), alone: false })?.ok_or(StoreError::Unknown(JobId(0)))?;
        let publication = Publication { recipe, output_hash, ..result_of(&claim.job, ending) };
        store.advance(&claim, Step::Intend(publication))?;
        store.advance(&claim, Step::Placed)?;
        assert!(!store.results(size, recipe)?.iter().any(|job| job.id == claim.id), "it has not ended");
        store.advance(&claim, Step::Finished)
    };
    let store = subject.store();
    let hash = Some(Hash([7; 32]));
    let mut made = Vec::new();
    for (size, ending, recipe, output_hash) in [
        (84, Ending::Repaired, Some(one), hash),
        (84, Ending::NeedsReview, Some(one), hash),
        (84, Ending::NotGood, Some(one), hash),
        (84, Ending::Clean, Some(other), hash),
        (84, Ending::Clean, Some(one), None),
        (84, Ending::Clean, None, hash),
        (134, Ending::Clean, Some(one), hash),
        (84, Ending::Clean, Some(one), hash),
    ] {
        made.push(submit_one(store, &format!("{}.stl", made.len()), size)?);
        end(store, size, ending, recipe, output_hash)?;
    }
    subject.restart();
    let store = subject.store();
    let found = |size, recipe| Ok::<_, StoreError>(store.results(size, recipe)?.iter().map(|job| job.id.0).collect::<Vec<_>>());
    assert_eq!((found(84, Some(one))?, found(84, Some(other))?, found(134, Some(one))?), (vec![8, 1], vec![4], vec![7]));
    assert_eq!((found(84, None)?.len(), found(134, None)?, found(85, None)?), (1, vec![7], vec![]));
    assert_eq!((found(84, Some(Recipe(8)))?, found(134, Some(other))?), (vec![], vec![]));
    for more in 0..MOST_RESULTS {
        submit_one(store, &format!("more{more}.stl"), 84)?;
        end(store, 84, Ending::Clean, Some(one), hash)?;
    }
    assert_eq!(found(84, Some(one))?, [16, 15, 14, 13, 12, 11, 10, 9]);
    Ok(())
}

pub(super) fn results_on_their_way_are_finished(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    let store = subject.store();
    let id = submit_one(store, "part.stl", 84)?;
    let claim = claim_any(store)?;
    let publication = result_of(&claim.job, Ending::Clean);
    store.advance(&claim, Step::Intend(publication.clone()))?;
    let mut void = claim.token;
    for (duty, step) in [(Duty::Place, Step::Placed), (Duty::MoveOriginal, Step::Finished)] {
        subject.restart();
        let store = subject.store();
        let recovered = store.recover(&no_one_is_innocent)?;
        let one = recovered.first().ok_or(StoreError::Unknown(id))?;
        assert_eq!((one.job.duty(), one.void, one.job.attempts), (duty, void, Attempt(1)));
        assert_eq!(one.job.work, Some(claim.token), "the work folder is still that of the worker");
        let claim = one.claim.clone().ok_or(StoreError::Unknown(id))?;
        void = claim.token;
        store.advance(&claim, step)?;
    }
    let done = job(subject.store(), id)?;
    assert_eq!(done.state, State::Ended { publication });
    assert_eq!(done.blame, crate::job::Blame::default());
    // A result that was lost on its way is made again.
    let store = subject.store();
    submit_one(store, "lost.stl", 84)?;
    let claim = claim_any(store)?;
    store.advance(&claim, Step::Intend(result_of(&claim.job, Ending::Clean)))?;
    assert_eq!(store.advance(&claim, Step::Lost)?.kind(), Kind::Waiting);
    Ok(())
}

pub(super) fn lists_and_counts_agree(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    let store = subject.store();
    let found: Result<Vec<_>, _> = (0..2500).map(|at| named(&format!("{at}.stl"), at)).collect();
    assert_eq!(store.submit(&found?)?.len(), 2500);
    for ending in [Ending::Clean, Ending::NeedsReview, Ending::Unreadable, Ending::Repaired] {
        finish(store, &claim_any(store)?, ending, true)?;
    }
    claim_any(store)?;
    subject.restart();
    let store = subject.store();
    let all = store.list(&Query::default())?;
    assert!(all.iter().map(|job| job.id.0).eq(1..=2500));
    for (kind, count) in store.counts()? {
        let listed = store.list(&Query { kinds: vec![kind], ..Query::default() })?;
        assert!(listed.iter().eq(all.iter().filter(|job| job.kind() == kind)), "{kind}");
        assert_eq!(listed.len() as u64, count, "{kind}");
    }
    assert_eq!(store.counts()?.iter().map(|(_, count)| count).sum::<u64>(), 2500);
    let page = store.list(&Query { kinds: vec![Kind::Queued, Kind::Done], after: JobId(2), limit: 3 })?;
    assert!(page.iter().map(|job| job.id.0).eq([4, 6, 7]));
    let page = store.list(&Query { kinds: Vec::new(), after: JobId(2), limit: 3 })?;
    assert!(page.iter().map(|job| job.id.0).eq([3, 4, 5]));
    Ok(())
}

pub(super) fn threads_get_different_jobs(subject: &mut dyn Subject, _: &ManualClock) -> Result<(), StoreError> {
    let store = subject.store();
    let found: Result<Vec<_>, _> = (0..64).map(|at| named(&format!("{at}.stl"), at)).collect();
    store.submit(&found?)?;
    let work = || -> Result<Vec<JobId>, StoreError> {
        let mut done = Vec::new();
        while let Some(claim) = store.claim(&Filter::default())? {
            finish(store, &claim, Ending::Clean, true)?;
            done.push(claim.id);
        }
        Ok(done)
    };
    let results: Vec<Result<Vec<JobId>, StoreError>> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..4).map(|_| scope.spawn(work)).collect();
        threads.into_iter().filter_map(|thread| thread.join().ok()).collect()
    });
    let mut taken = Vec::new();
    for result in results {
        taken.extend(result?);
    }
    assert_eq!(taken.len(), 64);
    assert_eq!(taken.iter().collect::<BTreeSet<_>>().len(), 64, "no job twice");
    let seqs: BTreeSet<_> = store.list(&Query::default())?.iter().map(|job| job.seq).collect();
    assert_eq!(seqs.len(), 64, "every transition has its own number");
    Ok(())
}
