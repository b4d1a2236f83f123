//! Answers that are lost on the way: what was done, and what was not, cannot be told apart by whoever asked.

use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::net::Shutdown;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, AtomicUsize};
use std::time::Duration;

use super::farm::{files, finish};
use super::*;
use crate::id::Attempt;
use crate::store::Query;

const JOBS: u64 = 60;
/// No run takes as long.
const LONGEST: Duration = Duration::from_secs(120);
/// One message in so many does not arrive, and its connection ends with it.
const EVERY: usize = 31;

/// Hands messages on between clients and the server, and now and then does not.
fn hand_on(mut from: UnixStream, mut to: UnixStream, passed: &AtomicUsize, cut: &AtomicUsize) {
    let mut buffer = vec![0; 1 << 16];
    while let Ok(read @ 1..) = from.read(&mut buffer) {
        // Scattered, so that no call is cut at the same place again and again.
        let number = passed.fetch_add(1, Ordering::Relaxed).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40;
        if number.is_multiple_of(EVERY) {
            cut.fetch_add(1, Ordering::Relaxed);
            break;
        }
        if to.write_all(&buffer[..read]).is_err() {
            break;
        }
    }
    _ = from.shutdown(Shutdown::Both);
    _ = to.shutdown(Shutdown::Both);
}

/// Begins to listen in the folder, in threads that end with the program; how many messages were lost.
fn cutter(folder: &std::path::Path, server: PathBuf) -> Arc<AtomicUsize> {
    const NAME: &str = ".s.PGSQL.5432";
    let listener = UnixListener::bind(folder.join(NAME)).unwrap();
    let (passed, cut) = (Arc::new(AtomicUsize::new(0)), Arc::new(AtomicUsize::new(0)));
    let lost = Arc::clone(&cut);
    std::thread::spawn(move || {
        for client in listener.incoming().flatten() {
            let Ok(there) = UnixStream::connect(server.join(NAME)) else { continue };
            let (client_too, there_too) = (client.try_clone().unwrap(), there.try_clone().unwrap());
            for (from, to) in [(client, there_too), (there, client_too)] {
                let (passed, cut) = (Arc::clone(&passed), Arc::clone(&cut));
                std::thread::spawn(move || hand_on(from, to, &passed, &cut));
            }
        }
    });
    lost
}

#[test]
fn calls_whose_answers_are_lost_are_done_once() {
    let Some(server) = server() else { return };
    let shared = server.schema("one");
    drop(PostgresStore::open(&shared).unwrap());
    let folder = tempfile::tempdir().unwrap();
    let lost = cutter(folder.path(), server.folder().to_owned());
    let [here, there] = [server.folder(), folder.path()].map(|folder| format!("host={}", folder.display()));
    let cut = Shared { url: shared.url.replace(&here, &there), patience: Duration::from_secs(60), ..shared };
    let stores = [PostgresStore::open(&cut).unwrap(), PostgresStore::open(&other(&cut, "two")).unwrap()];
    stores[0].subscribe(&["farm".into()]).unwrap();
    for found in files(JOBS).chunks(7) {
        stores[0].submit(found).unwrap();
    }
    let finished = AtomicU64::new(0);
    let began = Instant::now();
    let work = |store: &PostgresStore| {
        let mut done = BTreeMap::<JobId, u32>::new();
        while finished.load(Ordering::SeqCst) < JOBS {
            assert!(began.elapsed() < LONGEST, "someone else has given up");
            let Some(claim) = store.claim(&Filter::default()).unwrap() else { continue };
            assert_eq!(store.heartbeat(&claim).unwrap(), Lease::Held);
            finish(store, &claim).unwrap();
            *done.entry(claim.id).or_default() += 1;
            finished.fetch_add(1, Ordering::SeqCst);
        }
        done
    };
    let mut done = BTreeMap::<JobId, u32>::new();
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..4).map(|at| &stores[at % 2]).map(|store| scope.spawn(|| work(store))).collect();
        for (id, times) in workers.into_iter().flat_map(|thread| thread.join().unwrap()) {
            *done.entry(id).or_default() += times;
        }
    });
    assert!(lost.load(Ordering::Relaxed) >= 10, "{lost:?} messages were lost");
    assert!(done.len() as u64 == JOBS && done.values().all(|times| *times == 1), "{done:?}");
    let jobs = stores[1].list(&Query::default()).unwrap();
    assert!(jobs.iter().map(|job| job.id.0).eq(1..=JOBS));
    let odd: Vec<_> = jobs.iter().filter(|job| job.kind() != Kind::Done || job.attempts != Attempt(1)).collect();
    assert!(odd.is_empty(), "{odd:?}");
    assert_eq!(stores[0].notices("farm", 1000).unwrap().len() as u64, JOBS);
}
