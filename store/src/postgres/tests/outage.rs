//! A database that goes away in the middle.

use std::collections::BTreeMap;
use std::sync::atomic::AtomicU64;
use std::time::Duration;

use super::farm::{files, finish};
use super::*;
use crate::id::Attempt;
use crate::store::Query;

const JOBS: u64 = 300;
/// No run takes as long.
const LONGEST: Duration = Duration::from_secs(120);

/// Killed thrice while four threads of two daemons work: each job is claimed once, finished once and told once, and whoever asks meanwhile waits.
#[test]
fn a_database_that_is_killed_and_started_again_loses_and_doubles_nothing() {
    let Some(server) = Server::start() else { return };
    let shared = server.schema("one");
    let stores = [PostgresStore::open(&shared).unwrap(), PostgresStore::open(&other(&shared, "two")).unwrap()];
    stores[0].subscribe(&["farm".into()]).unwrap();
    let (submitted, finished) = (AtomicU64::new(0), AtomicU64::new(0));
    let submit = || {
        for found in files(JOBS).chunks(3) {
            stores[0].submit(found).unwrap();
            submitted.fetch_add(found.len() as u64, Ordering::SeqCst);
        }
    };
    let began = Instant::now();
    let work = |store: &PostgresStore| {
        let mut done = BTreeMap::<JobId, u32>::new();
        while finished.load(Ordering::SeqCst) < JOBS {
            assert!(began.elapsed() < LONGEST, "someone else has given up");
            let Some(claim) = store.claim(&Filter::default()).unwrap() else {
                std::thread::sleep(Duration::from_millis(5));
                continue;
            };
            finish(store, &claim).unwrap();
            *done.entry(claim.id).or_default() += 1;
            finished.fetch_add(1, Ordering::SeqCst);
        }
        done
    };
    let mut done = BTreeMap::<JobId, u32>::new();
    std::thread::scope(|scope| {
        scope.spawn(submit);
        let workers: Vec<_> = (0..4).map(|at| &stores[at % 2]).map(|store| scope.spawn(|| work(store))).collect();
        for part in 1..=3 {
            while finished.load(Ordering::SeqCst) < part * JOBS / 4 {
                std::thread::sleep(Duration::from_millis(1));
            }
            server.kill();
            server.run();
        }
        for (id, times) in workers.into_iter().flat_map(|thread| thread.join().unwrap()) {
            *done.entry(id).or_default() += times;
        }
    });
    assert_eq!(submitted.load(Ordering::SeqCst), JOBS);
    assert!(done.len() as u64 == JOBS && done.values().all(|times| *times == 1), "{done:?}");
    let jobs = stores[1].list(&Query::default()).unwrap();
    assert!(jobs.iter().map(|job| job.id.0).eq(1..=JOBS));
    let odd: Vec<_> = jobs.iter().filter(|job| job.kind() != Kind::Done || job.attempts != Attempt(1)).collect();
    assert!(odd.is_empty(), "{odd:?}");
    let mut told: Vec<_> = stores[0].notices("farm", 1000).unwrap().iter().map(|notice| notice.seq()).collect();
    told.dedup();
    assert_eq!(told.len() as u64, JOBS);
}

/// A call that has waited for long enough says so, and the store goes on when the database is back.
#[test]
fn patience_ends_and_the_store_does_not() {
    let Some(server) = Server::start() else { return };
    let shared = Shared { patience: Duration::from_millis(300), ..server.schema("daemon") };
    let store = PostgresStore::open(&shared).unwrap();
    store.submit(&files(1)).unwrap();
    server.kill();
    for result in [store.claim(&Filter::default()).map(drop), store.submit(&files(2)).map(drop), store.counts().map(drop)] {
        let error = result.unwrap_err();
        assert!(matches!(error, StoreError::Away { .. }) && error.exit_code() == 75, "{error:?}");
    }
    server.run();
    let claim = store.claim(&Filter::default()).unwrap().unwrap();
    assert_eq!(finish(&store, &claim).unwrap().kind(), Kind::Done);
}

/// Leases that ran out while the database was away could not be kept by anyone: whoever lives has a lease's time to say so.
#[test]
fn what_ran_out_while_the_database_was_away_is_given_one_more_lease() {
    let Some(server) = Server::start() else { return };
    let shared = Shared { lease: Duration::from_secs(6), ..server.schema("gone") };
    let gone = PostgresStore::open(&shared).unwrap();
    gone.submit(&files(1)).unwrap();
    let claim = gone.claim(&Filter::default()).unwrap().unwrap();
    drop(gone);
    server.kill();
    std::thread::sleep(shared.lease);
    server.run();
    let other = PostgresStore::open(&other(&shared, "other")).unwrap();
    assert_eq!(other.claim(&Filter::default()).unwrap(), None);
    std::thread::sleep(shared.lease);
    assert_eq!(other.claim(&Filter::default()).unwrap().map(|again| again.id), Some(claim.id));
}
