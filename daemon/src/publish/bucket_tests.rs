//! A result on its way into a bucket, in a store that fails, and with a daemon that dies at each call.

use std::cell::Cell;
use std::sync::Arc;

use object_store::memory::InMemory;
use suture_store::{Claim, Filter, JobStore, Kind, MemoryStore, Priority, RelPath, Seen, Source, Submission, SystemClock, Time};

use super::*;
use crate::bucket::Bucket;
use crate::bucket::tests::{bucket, keys};
use crate::claim::claim;
use crate::config::FolderConfig;
use crate::shelf::Shelf;

const ORIGINAL: &[u8] = b"as dropped, and long enough for two parts";
const CACHE: u64 = 1 << 20;

/// A bucket with one drop, its folder, and the job that has it.
struct Bench {
    dir: tempfile::TempDir,
    inner: Arc<InMemory>,
    store: MemoryStore,
    folder: Folder,
    claim: Claim,
    part: u64,
}

impl Bench {
    /// `part`: what is larger is written in parts.
    fn new(part: u64) -> Self {
        let (dir, inner) = (tempfile::tempdir().unwrap(), Arc::new(InMemory::new()));
        let there = bucket(&inner, 0, 0, None, part);
        there.put_bytes_new(ORIGINAL, "in/part.stl", "customer", &|| Ok(())).unwrap();
        let drop = there.stat("in/part.stl").unwrap().unwrap().version;
        let (dev, ino) = drop.numbers();
        let (folder, path, profile) = ("hot".into(), RelPath::new("part.stl").unwrap(), "default".into());
        let source = Source { folder, path, dev, ino, size: ORIGINAL.len() as u64, mtime_ns: drop.mtime_ns, profile };
        let store = MemoryStore::new(Arc::new(SystemClock));
        store.submit(&[Submission { source, foreign: None, priority: Priority::default(), seen: Seen::Now }]).unwrap();
        let config = FolderConfig { name: "hot".into(), ..FolderConfig::of(&dir.path().join("scratch")) };
        std::fs::create_dir(&config.path).unwrap();
        let folder = Folder::open(&config, None).unwrap();
        let claim = store.claim(&Filter::default()).unwrap().unwrap();
        let mut bench = Self { dir, inner, store, folder, claim, part };
        bench.serve(0, 0, None);
        bench
    }

    /// Its first life ended after so many objects of its result were put.
    fn died_after(objects: usize) -> Self {
        let stopped = (0..40).map(|dies| {
            let mut bench = Self::new(1 << 20);
            bench.serve(1, 0, Some(dies));
            let _ = bench.run();
            bench
        });
        let is_it = |bench: &Self| {
            matches!(bench.job().state, State::Publishing { .. }) && keys(&bench.sound(), "failed").len() == objects
        };
        stopped.into_iter().find(is_it).unwrap()
    }

    /// The work of the attempt is gone, as it is for another machine.
    fn lose_work(&self) {
        let work = self.folder.work_root();
        std::fs::remove_dir_all(&work).and_then(|()| std::fs::create_dir(&work)).unwrap();
    }

    fn sound(&self) -> Bucket {
        bucket(&self.inner, 0, 0, None, self.part)
    }

    /// Another life of the daemon, whose calls fail so.
    fn serve(&mut self, seed: u64, rate: u64, dies: Option<u32>) {
        let bucket = bucket(&self.inner, seed, rate, dies, self.part);
        self.folder.bucket = Some(Shelf::of(bucket, &self.dir.path().join("scratch"), CACHE));
    }

    fn shelf(&self) -> &Shelf {
        self.folder.bucket.as_ref().unwrap()
    }

    fn job(&self) -> Job {
        self.store.get(self.claim.id).unwrap().unwrap()
    }

    /// As far as the job comes in this life.
    fn run(&self) -> Result<Job, PublishError> {
        let (mut job, committed) = (self.job(), Cell::new(false));
        let desk = Desk::new(&self.store, &self.folder, &self.claim, &committed);
        if job.kind() == Kind::Running {
            let work = self.folder.work(self.claim.token);
            let _ = std::fs::remove_dir_all(&work);
            claim(&self.folder, &job, &work, u64::MAX).map_err(|error| PublishError::Folder(format!("{error:?}")))?;
            assert_eq!(std::fs::read(work.join(CLAIMED)).unwrap(), ORIGINAL);
            let reason = "a long reason, so that the report has several parts".into();
            job = desk.intend(&job, &Conclusion::None { ending: Ending::NotGood, reason })?;
        }
        if matches!(job.state, State::Publishing { .. }) {
            job = desk.place_in(self.shelf(), &job)?;
        }
        desk.move_in(self.shelf(), &job)
    }

    /// Lives go by until the job is at its end.
    fn run_to_its_end(&mut self, seed: u64, rate: u64, dies: Option<u32>) {
        for life in 0..80 {
            let (rate, dies) = if life < 50 { (rate, dies.filter(|_| life == 0)) } else { (0, None) };
            self.serve(seed + life, rate, dies);
            match self.run() {
                Ok(job) if job.kind().is_at_rest() => return,
                Ok(_) | Err(PublishError::Folder(_) | PublishError::Io { .. }) => {}
                Err(error) => panic!("{error}"),
            }
            self.claim_again();
        }
        panic!("{seed} {rate} {dies:?} {}: {:?}", self.part, self.job().state);
    }

    fn claim_again(&mut self) {
        // Pauses are for a clock that goes on.
        let _ = self.store.control(self.claim.id, suture_store::Control::Retry);
        if let Some(claim) = self.store.claim(&Filter::default()).unwrap() {
            self.claim = claim;
        }
    }

    fn names(&self) -> [Vec<String>; 4] {
        ["in", "out", "failed", ".suture"].map(|below| keys(&self.sound(), below))
    }

    /// One report, one receipt, the original beside them, whole, and nothing else.
    fn assert_published_once(&self, what: &str) {
        let there = ["part.stl", "part.stl.report.json", "part.stl.suture.json"].map(String::from).to_vec();
        assert_eq!(self.names(), [vec![], vec![], there, vec![]], "{what}");
        let moved = self.sound().stat("failed/part.stl").unwrap().unwrap().version;
        assert_eq!(self.sound().hash("failed/part.stl", &moved).unwrap(), Hash(*blake3::hash(ORIGINAL).as_bytes()), "{what}");
    }
}

fn through(seed: u64, rate: u64, dies: Option<u32>, part: u64) {
    let mut bench = Bench::new(part);
    bench.run_to_its_end(seed, rate, dies);
    bench.assert_published_once(&format!("{seed} {rate} {dies:?} {part}"));
}

/// F1: dead after each call in turn, then run again: one result, and the original is whole.
#[test]
fn a_daemon_dies_at_each_call() {
    for dies in 0..60 {
        through(1, 0, Some(dies), 1 << 20);
        through(1, 0, Some(dies), 32);
    }
}

/// F8: calls fail, have lost answers, are cut, by seed.
#[test]
fn a_store_fails_at_random() {
    for seed in 0..12 {
        through(seed * 100, 20, None, 1 << 20);
        through(seed * 100, 20, None, 32);
    }
}

/// The work folder is gone when its daemon comes back, or another one: what was put goes, and the next attempt has its names.
#[test]
fn what_was_put_before_the_work_was_lost_goes() {
    for objects in 0..=1 {
        let mut bench = Bench::died_after(objects);
        bench.lose_work();
        bench.serve(2, 0, None);
        let _ = bench.run();
        assert!(matches!(bench.job().state, State::Queued { .. }), "{objects}: {:?}", bench.job().state);
        assert_eq!(keys(&bench.sound(), "failed"), [""; 0], "{objects}");
        bench.run_to_its_end(3, 0, None);
        assert_eq!(keys(&bench.sound(), "failed").len(), 3, "{objects}");
        // The note of the lost attempt stays for a day.
        assert_eq!(keys(&bench.sound(), ".suture").len(), 1, "{objects}");
        litter::clear(bench.shelf(), &bench.store, Time(u64::MAX)).unwrap();
        bench.assert_published_once(&objects.to_string());
    }
    let mut whole = Bench::died_after(2);
    whole.lose_work();
    whole.run_to_its_end(2, 0, None);
    assert_eq!(whole.job().attempts.0, 1, "all of it was there");
    whole.assert_published_once("whole");
}

/// A worker that slept through the loss of its claim puts an object late: the intake of a later day removes it, and nobody else's.
#[test]
fn an_object_that_comes_late_goes() {
    let mut bench = Bench::died_after(0);
    let old = bench.job();
    bench.lose_work();
    bench.serve(2, 0, None);
    let _ = bench.run();
    let late = "failed/part.stl.report.json";
    bench.sound().put_bytes_new(&b"late"[..], late, &litter::owner(&old), &|| Ok(())).unwrap();
    bench.run_to_its_end(3, 0, None);
    assert!(bench.sound().stat(late).unwrap().is_some(), "its name was taken");
    litter::clear(bench.shelf(), &bench.store, Time(0)).unwrap();
    let left = ["part~2.stl", "part~2.stl.report.json", "part~2.stl.suture.json"].map(String::from);
    assert_eq!(keys(&bench.sound(), "failed"), left);
}

/// A worker that lost the claim puts nothing, and removes nothing.
#[test]
fn a_stale_worker_touches_nothing() {
    let mut bench = Bench::died_after(1);
    bench.serve(2, 0, None);
    let stale = bench.claim.clone();
    bench.store.advance(&stale, Step::Park { reason: "away".into(), committed: false }).unwrap();
    bench.claim_again();
    assert_ne!(bench.claim.token, stale.token);
    let (before, fresh) = (bench.names(), std::mem::replace(&mut bench.claim, stale));
    for is_lost in [false, true] {
        if is_lost {
            bench.lose_work();
        }
        assert!(matches!(bench.run(), Err(PublishError::Store(_))), "{is_lost}");
        assert_eq!(bench.names(), before, "{is_lost}");
    }
    bench.claim = fresh;
    bench.run_to_its_end(3, 0, None);
}

/// A worker that lost a retry takes what the next one published for what it is to replace: it leaves that alone.
#[test]
fn a_stale_retry_leaves_newer_files() {
    let mut bench = Bench::new(1 << 20);
    bench.run_to_its_end(1, 0, None);
    bench.claim_again();
    let (stale, old) = (bench.claim.clone(), bench.job());
    bench.store.advance(&stale, Step::HandBack).unwrap();
    bench.claim_again();
    assert_ne!(bench.claim.token, stale.token);
    bench.run_to_its_end(2, 0, None);
    let committed = Cell::new(false);
    let desk = Desk::new(&bench.store, &bench.folder, &stale, &committed);
    let late = desk.intend(&old, &Conclusion::None { ending: Ending::NotGood, reason: "late".into() });
    assert!(matches!(late, Err(PublishError::Store(_))), "{late:?}");
    bench.assert_published_once("by the one that holds the job");
}

/// The intake clears away neither what a living attempt has put nor what an ended one has.
#[test]
fn only_litter_is_cleared_away() {
    let mut bench = Bench::died_after(1);
    litter::clear(&Shelf::of(bench.sound(), bench.dir.path(), CACHE), &bench.store, Time(u64::MAX)).unwrap();
    assert_eq!((keys(&bench.sound(), "failed").len(), keys(&bench.sound(), ".suture").len()), (1, 1));
    let note = keys(&bench.sound(), ".suture").remove(0);
    let bytes = {
        let key = format!(".suture/{note}");
        let version = bench.sound().stat(&key).unwrap().unwrap().version;
        bench.sound().bytes(&key, &version).unwrap().unwrap()
    };
    bench.run_to_its_end(2, 0, None);
    // A worker that slept wrote its note once more.
    bench.sound().put_bytes_new(bytes, &format!(".suture/{note}"), "late", &|| Ok(())).unwrap();
    litter::clear(bench.shelf(), &bench.store, Time(0)).unwrap();
    bench.assert_published_once("named by the row");
}

/// An object that took the name of an original before that was removed stays, and the original's copy is whole.
#[test]
fn a_drop_of_the_same_name_is_not_removed() {
    let mut replaced = 0;
    for dies in 0..40 {
        let mut bench = Bench::new(1 << 20);
        bench.serve(1, 0, Some(dies));
        let _ = bench.run();
        let is_published = matches!(bench.job().state, State::Published { .. });
        if !is_published || bench.sound().stat("in/part.stl").unwrap().is_none() {
            continue;
        }
        replaced += 1;
        let sound = bench.sound();
        sound.remove("in/part.stl").unwrap();
        sound.put_bytes_new(&b"another"[..], "in/part.stl", "customer", &|| Ok(())).unwrap();
        bench.run_to_its_end(3, 0, None);
        assert_eq!(keys(&bench.sound(), "in"), ["part.stl"], "{dies}");
        let there = bench.sound().stat("in/part.stl").unwrap().unwrap().version;
        assert_eq!(bench.sound().bytes("in/part.stl", &there).unwrap().unwrap(), b"another");
    }
    assert!(replaced > 2, "only {replaced} daemons died between the result and the original");
}

/// A retry takes the place of what the attempt before left, as in a folder.
#[test]
fn a_retry_leaves_no_older_files() {
    let mut bench = Bench::new(1 << 20);
    bench.run_to_its_end(1, 0, None);
    let before = bench.sound().stat("failed/part.stl.suture.json").unwrap().unwrap();
    bench.claim_again();
    assert_eq!(bench.job().kind(), Kind::Running);
    bench.run_to_its_end(2, 0, None);
    bench.assert_published_once("after a retry");
    assert_ne!(bench.sound().stat("failed/part.stl.suture.json").unwrap().unwrap(), before);
}

/// A stranger's file is never replaced, nor taken for ours, be its bytes the same.
#[test]
fn a_strangers_file_keeps_its_name() {
    for (key, bytes, other) in [
        ("failed/part.stl", ORIGINAL, "part~2.stl"),
        ("failed/part.stl.report.json", &b"theirs"[..], "part~2.stl.report.json"),
        ("failed/part.stl.suture.json", &b"theirs"[..], "part.stl.suture~2.json"),
    ] {
        let mut bench = Bench::died_after(0);
        bench.sound().put_bytes_new(bytes, key, "stranger", &|| Ok(())).unwrap();
        bench.run_to_its_end(2, 0, None);
        let there = bench.sound().stat(key).unwrap().unwrap();
        assert_eq!((there.owner.as_deref(), keys(&bench.sound(), "in").len()), (Some("stranger"), 0), "{key}");
        assert!(keys(&bench.sound(), "failed").contains(&other.into()), "{key}: {:?}", keys(&bench.sound(), "failed"));
    }
}
