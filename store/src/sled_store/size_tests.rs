//! How much room the store takes on its disk. sled keeps several versions of what changes, and cleans up behind that at leisure: only a measurement tells.

use std::path::Path;

use super::*;
use crate::id::Hash;
use crate::job::{Ending, Priority, Publication};
use crate::path::RelPath;
use crate::store::Seen;

/// The store is to stay below 64 MiB with 20,000 jobs that have ended. Here sled has no time to clean up.
const MOST_FOR_A_JOB: u64 = 3200;
const HISTORY: u64 = 3000;
/// Dropped at a time.
const BURST: u64 = 200;

/// Numbers in no order.
fn scattered(number: u64) -> u64 {
    number.wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(29).wrapping_mul(0xBF58_476D_1CE4_E5B9)
}

fn hash(number: u64) -> Hash {
    Hash(std::array::from_fn(|at| scattered(number + at as u64).to_be_bytes()[0]))
}

fn drop_one(number: u64) -> Submission {
    let source = Source {
        folder: "prints".into(),
        path: RelPath::new(format!("order-{}/part-{number}.stl", number / 400)).unwrap(),
        dev: 64_768,
        ino: 13_000_000 + number * 7,
        size: 84 + 50 * (scattered(number) % 100_000),
        mtime_ns: 1_700_000_000_123_456_789 + i64::try_from(number).unwrap() * 1_000_003,
        profile: "default".into(),
    };
    Submission { source, foreign: None, priority: Priority::default(), seen: Seen::Now }
}

/// All that waits is repaired.
fn work(store: &SledStore) {
    while let Some(claim) = store.claim(&Filter::default()).unwrap() {
        let number = claim.id.0;
        let name = Some(claim.job.source.path.clone());
        let publication = Publication {
            ending: Ending::Repaired,
            reason: String::new(),
            output: name.clone(),
            output_hash: Some(hash(2 * number)),
            report_hash: Some(hash(2 * number + 1)),
            recipe: Some(Recipe(scattered(number))),
            reused: None,
            source_ctime_ns: Some(1_700_000_000_123_456_789),
            original: name,
            stays: false,
            decision: None,
        };
        for step in [Step::Intend(publication), Step::Placed, Step::Finished] {
            store.advance(&claim, step).unwrap();
        }
    }
}

fn size(folder: &Path) -> u64 {
    let bytes = |path: PathBuf| if path.is_dir() { size(&path) } else { std::fs::metadata(&path).unwrap().len() };
    files::list(folder).unwrap().into_iter().map(bytes).sum()
}

/// A folder in memory, where there is one: here nothing depends on a disk.
fn folder() -> tempfile::TempDir {
    tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).unwrap()
}

#[test]
fn the_store_stays_small() {
    let state = folder();
    let store = SledStore::open(state.path()).unwrap();
    let mut most = 0;
    for first in (0..2 * HISTORY).step_by(BURST as usize) {
        let found: Vec<_> = (first..first + BURST).map(drop_one).collect();
        store.submit(&found).unwrap();
        work(&store);
        let past: Vec<_> = (first.saturating_sub(HISTORY)..=(first + BURST).saturating_sub(HISTORY)).map(JobId).collect();
        store.forget(&past).unwrap();
        most = most.max(size(state.path()));
    }
    let jobs: u64 = store.counts().unwrap().iter().map(|(_, count)| count).sum();
    assert_eq!(jobs, HISTORY);
    assert!(most < jobs * MOST_FOR_A_JOB, "{} bytes for a job", most / jobs);
}
