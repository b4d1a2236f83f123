//! Several daemons on one queue.

use std::collections::BTreeMap;
use std::time::Duration;

use super::*;
use crate::id::{Attempt, Seq};
use crate::job::{Duty, Ending};
use crate::store::Query;
use crate::testkit::{ManualClock, dropped, result_of};

pub(super) fn files(count: u64) -> Vec<Submission> {
    (0..count).map(|at| dropped(&format!("{at}.stl"), at).unwrap()).collect()
}

/// Takes a claim to its end.
pub(super) fn finish(store: &dyn JobStore, claim: &Claim) -> Result<Job, StoreError> {
    store.advance(claim, Step::Intend(result_of(&claim.job, Ending::Clean)))?;
    store.advance(claim, Step::Placed)?;
    store.advance(claim, Step::Finished)
}

fn is_fenced<T: std::fmt::Debug>(result: &Result<T, StoreError>) -> bool {
    matches!(result, Err(StoreError::Illegal { source: Illegal::Fenced, .. }))
}

/// Works until nothing is left; how often it finished each job.
fn work(store: &dyn JobStore) -> BTreeMap<JobId, u32> {
    let mut done = BTreeMap::new();
    while let Some(claim) = store.claim(&Filter::default()).unwrap() {
        finish(store, &claim).unwrap();
        *done.entry(claim.id).or_default() += 1;
    }
    done
}

#[test]
fn two_stores_and_eight_threads_take_each_job_once_and_tell_each_end_once() {
    let Some(server) = server() else { return };
    let shared = server.schema("one");
    let stores = [PostgresStore::open(&shared).unwrap(), PostgresStore::open(&other(&shared, "two")).unwrap()];
    stores[0].subscribe(&["farm".into()]).unwrap();
    // Both find the same files at the same time.
    let answers = std::thread::scope(|scope| {
        let found: Vec<_> = stores.iter().map(|store| scope.spawn(|| store.submit(&files(200)).unwrap())).collect();
        found.into_iter().flat_map(|thread| thread.join().unwrap()).collect::<Vec<_>>()
    });
    assert_eq!((answers.len(), answers.iter().filter(|answer| answer.new).count()), (400, 200));
    let (mut done, mut heard) = (BTreeMap::<JobId, u32>::new(), Vec::new());
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..8).map(|at| &stores[at % 2]).map(|store| scope.spawn(|| work(store))).collect();
        // Whoever listens meanwhile misses no end, in whatever order they become durable.
        let listener = scope.spawn(|| {
            let (mut heard, mut last, began) = (Vec::new(), Seq(0), Instant::now());
            while heard.len() < 200 {
                assert!(began.elapsed() < Duration::from_secs(120), "an end was missed; {} were told", heard.len());
                for notice in stores[0].notices("farm", 7).unwrap() {
                    let Notice::End(job) = notice else { panic!("no news") };
                    assert!(job.seq > last);
                    last = job.seq;
                    heard.push(job.id);
                }
                stores[0].acknowledge("farm", last).unwrap();
            }
            heard
        });
        for (id, times) in workers.into_iter().flat_map(|thread| thread.join().unwrap()) {
            *done.entry(id).or_default() += times;
        }
        heard = listener.join().unwrap();
    });
    assert!(done.len() == 200 && done.values().all(|times| *times == 1), "{done:?}");
    heard.sort_unstable();
    assert!(heard.iter().map(|id| id.0).eq(1..=200));
    let jobs = stores[0].list(&Query::default()).unwrap();
    assert!(jobs.iter().all(|job| job.kind() == Kind::Done && job.attempts == Attempt(1)));
    assert_eq!(stores[0].backlog("farm").unwrap(), 0);
}

/// A daemon that was stopped for longer than its lease, and woken again.
#[test]
fn a_lease_that_ran_out_gives_the_job_to_another_and_fences_the_first() {
    let Some(server) = server() else { return };
    let clock = Arc::new(ManualClock::new(Time(1_000_000)));
    let open = |shared: &Shared| PostgresStore::open_at(shared, Arc::clone(&clock) as Arc<dyn Clock>).unwrap();
    let shared = server.schema("stopped");
    let (stopped, other) = (open(&shared), open(&other(&shared, "other")));
    let lease = u64::try_from(shared.lease.as_millis()).unwrap();
    stopped.submit(&files(2)).unwrap();
    let (running, published) =
        (stopped.claim(&Filter::default()).unwrap().unwrap(), stopped.claim(&Filter::default()).unwrap().unwrap());
    stopped.advance(&published, Step::Intend(result_of(&published.job, Ending::Clean))).unwrap();
    // As long as it gives signs, the jobs are its own.
    clock.pass(lease - 1);
    for claim in [&running, &published] {
        assert_eq!(stopped.heartbeat(claim).unwrap(), Lease::Held);
    }
    clock.pass(lease - 1);
    assert_eq!((other.claim(&Filter::default()).unwrap(), other.has_parked().unwrap()), (None, false));
    assert_eq!(other.recover(&|_| Testimony::InHand).unwrap(), [], "they are another daemon's");
    clock.pass(1);
    // Nothing waits, and yet who asks for a turn has one.
    assert_eq!((other.waiting(&Filter::default()).unwrap(), other.has_parked().unwrap()), (None, true));
    let taken: Vec<_> = std::iter::from_fn(|| other.claim(&Filter::default()).unwrap()).collect();
    assert!(!other.has_parked().unwrap());
    let of = |id| taken.iter().find(|claim| claim.id == id).unwrap();
    let (again, on_its_way) = (of(running.id), of(published.id));
    assert_eq!((taken.len(), again.job.duty(), again.job.attempts), (2, Duty::Run, Attempt(2)));
    assert_eq!((again.job.blame.deaths, again.job.blame.deaths_alone), (1, 0), "as after a death that no one saw");
    assert_eq!((on_its_way.job.duty(), on_its_way.job.attempts), (Duty::Place, Attempt(1)));
    assert!(again.token > published.token && on_its_way.token > published.token);
    // The zombie wakes.
    for (claim, step) in [(&running, Step::Intend(result_of(&running.job, Ending::Clean))), (&published, Step::Placed)] {
        assert!(is_fenced(&stopped.advance(claim, step)));
        assert_eq!(stopped.heartbeat(claim).unwrap(), Lease::Lost);
    }
    finish(&other, again).unwrap();
    other.advance(on_its_way, Step::Placed).unwrap();
    assert_eq!(other.advance(on_its_way, Step::Finished).unwrap().kind(), Kind::Done);
}

/// Whatever its callers are busy with; and by the real clock.
#[test]
fn leases_are_kept_by_the_store_itself() {
    let Some(server) = server() else { return };
    let shared = Shared { lease: Duration::from_millis(800), ..server.schema("busy") };
    let busy = PostgresStore::open(&shared).unwrap();
    let other = PostgresStore::open(&other(&shared, "other")).unwrap();
    busy.submit(&files(1)).unwrap();
    let claim = busy.claim(&Filter::default()).unwrap().unwrap();
    std::thread::sleep(2 * shared.lease);
    assert_eq!(other.claim(&Filter::default()).unwrap(), None);
    drop(busy);
    std::thread::sleep(2 * shared.lease);
    assert_eq!(other.claim(&Filter::default()).unwrap().unwrap().id, claim.id, "it is dead, and the real clock says so");
}

#[test]
fn a_second_daemon_of_one_name_ends_the_first() {
    let Some(server) = server() else { return };
    let shared = server.schema("twin");
    let first = PostgresStore::open(&shared).unwrap();
    first.submit(&files(2)).unwrap();
    let claim = first.claim(&Filter::default()).unwrap().unwrap();
    first.check().unwrap();
    let second = PostgresStore::open(&shared).unwrap();
    assert!(is_fenced(&first.advance(&claim, Step::HandBack)));
    // Not by an operator's word either.
    second.control(claim.id, Control::Cancel).unwrap();
    assert!(is_fenced(&first.advance(&claim, Step::Cancelled)));
    for refused in [first.check(), first.claim(&Filter::default()).map(drop)] {
        let error = refused.unwrap_err();
        assert!(error.to_string().contains("under the name twin"), "{error}");
    }
    let recovered = second.recover(&|_| Testimony::Outlived).unwrap();
    assert_eq!(recovered.iter().map(|one| (one.void, one.job.kind())).collect::<Vec<_>>(), [(claim.token, Kind::Cancelled)]);
    assert!(second.claim(&Filter::default()).unwrap().is_some());
}

/// Calls from a thread that belongs to a runtime neither panic nor stand still; so does the end of the store.
#[test]
fn calls_from_within_a_runtime_are_answered() {
    let Some(server) = server() else { return };
    let shared = server.schema("async");
    let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
    runtime.block_on(async {
        let store = PostgresStore::open(&shared).unwrap();
        assert_eq!(store.submit(&files(3)).unwrap().len(), 3);
    });
}
