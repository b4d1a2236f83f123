//! How many jobs go through the store in a second: a measurement, run by hand.

use std::sync::atomic::AtomicU64;

use super::farm::{files, finish};
use super::*;

/// Jobs of each run.
const JOBS: u64 = 3000;

/// One claim, and one look at what waits of each kind, as a daemon asks, with few jobs and with many that wait, in one folder and in several.
#[test]
#[ignore = "a measurement"]
fn a_claim_with_many_that_wait() {
    const ROUNDS: u32 = 200;
    let Some(server) = server() else { return };
    for (waiting, folders) in [(1000, 1), (100_000, 1), (100_000, 10)] {
        let shared = server.schema("daemon");
        let store = PostgresStore::open(&shared).unwrap();
        let mut found = files(waiting);
        for (at, one) in found.iter_mut().enumerate() {
            one.source.folder = format!("f{}", at % folders);
        }
        store.submit(&found).unwrap();
        let time = |what: &str, call: &dyn Fn()| {
            call();
            let began = Instant::now();
            (0..ROUNDS).for_each(|_| call());
            eprintln!(
                "{waiting} waiting in {folders} folders: {what}: {:.2} ms",
                began.elapsed().as_secs_f64() * 1000.0 / f64::from(ROUNDS)
            );
        };
        time("a claim", &|| drop(store.claim(&Filter::default()).unwrap().unwrap()));
        for (what, size, alone) in
            [("small", (0, 1 << 26), false), ("large", (1 << 26, u64::MAX), false), ("alone", (0, u64::MAX), true)]
        {
            time(&format!("what waits, {what}"), &|| _ = store.waiting(&Filter { size, alone }).unwrap());
        }
    }
}

/// Each job is one claim and three steps, as a daemon makes them, all durable.
#[test]
#[ignore = "a measurement"]
fn claims_and_completions_per_second() {
    let Some(server) = server() else { return };
    for (connections, waiting) in [(1, JOBS), (16, JOBS), (64, JOBS), (16, 100_000)] {
        let shared = Shared { connections, ..server.schema("daemon") };
        let store = PostgresStore::open(&shared).unwrap();
        let began = Instant::now();
        store.submit(&files(waiting)).unwrap();
        let took_in = began.elapsed().as_secs_f64();
        let (done, began) = (AtomicU64::new(0), Instant::now());
        std::thread::scope(|scope| {
            for _ in 0..connections {
                scope.spawn(|| {
                    while done.fetch_add(1, Ordering::Relaxed) < JOBS {
                        let claim = store.claim(&Filter::default()).unwrap().unwrap();
                        finish(&store, &claim).unwrap();
                    }
                });
            }
        });
        let seconds = began.elapsed().as_secs_f64();
        eprintln!(
            "{connections} connections, {waiting} waiting (taken in: {:.0} a second): {:.0} jobs a second, {:.0} commits",
            waiting as f64 / took_in,
            JOBS as f64 / seconds,
            4.0 * JOBS as f64 / seconds
        );
    }
}
