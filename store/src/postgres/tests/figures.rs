//! How many jobs go through the store in a second, and what each costs: measurements, run by hand, as ARCHITECTURE.md says.

use std::sync::atomic::AtomicU64;
use std::time::Duration;

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

/// Time of the processor that a process has used so far, in s.
fn used(pid: u32) -> f64 {
    /// The unit that `/proc` counts in, of a second.
    const PART: f64 = 100.0;
    let Ok(stat) = std::fs::read_to_string(format!("/proc/{pid}/stat")) else { return 0.0 };
    let after_name = stat.rsplit(')').next().unwrap();
    let ticks = after_name.split_whitespace().skip(11).take(2).map(|ticks| ticks.parse::<f64>().unwrap());
    ticks.sum::<f64>() / PART
}

/// The same of all processes of the server.
fn used_by_server(server: &Server) -> f64 {
    let file = std::fs::read_to_string(server.folder().join("data/postmaster.pid")).unwrap();
    let first = file.lines().next().unwrap();
    let of_server = |pid: &u32| {
        let status = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
        status.lines().any(|line| line.strip_prefix("PPid:").is_some_and(|parent| parent.trim() == first))
    };
    let all = std::fs::read_dir("/proc").unwrap().flatten().filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    all.filter(of_server).map(used).sum()
}

/// Each job is one claim and three steps, as a daemon makes them, all durable; by one daemon, and by as many as there are connections. What the processor does for
/// each job does not depend on what else runs on the machine; jobs a second do.
#[test]
#[ignore = "a measurement"]
fn claims_and_completions_per_second() {
    let Some(server) = Server::start() else { return };
    eprintln!("load before: {}", std::fs::read_to_string("/proc/loadavg").unwrap_or_default().trim());
    let runs = [(1, 1, JOBS), (1, 16, JOBS), (1, 64, JOBS), (16, 1, JOBS), (64, 1, JOBS), (1, 16, 100_000)];
    for (daemons, connections, waiting) in runs {
        // As a daemon opens it.
        let (folders, joint) = (Some(vec!["hot".to_owned()]), ["hot".to_owned()].into());
        let shared = Shared { connections, folders, joint, ..server.schema("daemon") };
        let open = |at: u32| PostgresStore::open(&other(&shared, &at.to_string())).unwrap();
        let stores: Vec<_> = (0..daemons).map(open).collect();
        let began = Instant::now();
        stores[0].submit(&files(waiting)).unwrap();
        let taken_in = waiting as f64 / began.elapsed().as_secs_f64();
        let (done, ready, all) = (AtomicU64::new(0), AtomicU64::new(0), u64::from(daemons * connections));
        let (mut before, mut began) = ((0.0, 0.0), Instant::now());
        let work = |store: &PostgresStore| {
            // Each has a connection, and has made its statements known there.
            finish(store, &store.claim(&Filter::default()).unwrap().unwrap()).unwrap();
            ready.fetch_add(1, Ordering::SeqCst);
            while ready.load(Ordering::SeqCst) <= all {
                std::thread::sleep(Duration::from_millis(1));
            }
            while done.fetch_add(1, Ordering::SeqCst) < JOBS - all {
                finish(store, &store.claim(&Filter::default()).unwrap().unwrap()).unwrap();
            }
        };
        std::thread::scope(|scope| {
            let per_store = |store| (0..connections).map(move |_| store);
            stores.iter().flat_map(per_store).for_each(|store| drop(scope.spawn(|| work(store))));
            while ready.load(Ordering::SeqCst) < all {
                std::thread::sleep(Duration::from_millis(1));
            }
            (before, began) = ((used_by_server(&server), used(std::process::id())), Instant::now());
            ready.fetch_add(1, Ordering::SeqCst);
        });
        let (jobs, seconds) = ((JOBS - all) as f64, began.elapsed().as_secs_f64());
        let each = |now: f64, before: f64| (now - before) * 1000.0 / jobs;
        eprintln!(
            "{daemons} daemons with {connections} connections each, {waiting} waiting (taken in: {taken_in:.0} a second): {:.0} jobs a second; \
             the processor, for each job: {:.2} ms in the database, {:.2} ms here",
            jobs / seconds,
            each(used_by_server(&server), before.0),
            each(used(std::process::id()), before.1),
        );
    }
}
