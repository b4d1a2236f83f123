//! Receipts without a store.

use std::sync::Arc;

use suture_store::{Control, Kind, MemoryStore, State};

use super::evidence::regular;
use super::*;
use crate::config::FolderConfig;

const BYTES: &[u8] = b"as dropped";

struct Hall {
    dir: tempfile::TempDir,
    folder: Arc<Folder>,
}

impl Hall {
    fn new(leave_originals: bool) -> Self {
        let dir = tempfile::tempdir().unwrap();
        let config = FolderConfig { name: "hot".into(), leave_originals, ..FolderConfig::of(dir.path()) };
        let folder = Arc::new(Folder::open(&config, None).unwrap());
        Self { dir, folder }
    }

    fn put(&self, name: &str, bytes: &[u8]) {
        let path = self.dir.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }

    /// A receipt of version 1 as it was before it told of the original.
    fn receipt(&self, beside: &str, job: u64, source: &str, ending: &str, more: &str) {
        let hash = blake3::hash(BYTES).to_hex();
        let text = format!(
            "{{\"receipt_version\":1,\"job\":{job},\"attempt\":2,\"ending\":\"{ending}\",\"source\":\"{source}\",\"profile\":\"default\",\
             \"source_bytes\":{},\"source_blake3\":\"{hash}\"{more}}}",
            BYTES.len()
        );
        self.put(&format!("{beside}{RECEIPT}"), text.as_bytes());
    }

    /// What a new store knows after reading: numbers, states, paths, and where the originals are.
    fn read(&self, store: &MemoryStore) -> Vec<(u64, Kind, String, String)> {
        let unread = Unread::of(store, std::slice::from_ref(&self.folder)).unwrap();
        unread.read(store, &self.folder, &Bus::new(false)).unwrap();
        assert!(!unread.has(&self.folder) && !store.is_unfilled().unwrap());
        let mut jobs = Vec::new();
        each_job(store, &mut |job| {
            let (area, path) = job.original();
            jobs.push((job.id.0, job.kind(), job.source.path.to_string(), format!("{area:?}/{path}")));
        })
        .unwrap();
        jobs
    }
}

fn told(id: u64, kind: Kind, source: &str, original: &str) -> (u64, Kind, String, String) {
    (id, kind, source.into(), original.into())
}

#[test]
fn f06_jobs_come_back_with_their_endings() {
    let hall = Hall::new(false);
    for original in ["done/a.stl", "failed/sub/b~2.stl", "quarantine/c.stl"] {
        hall.put(original, BYTES);
    }
    hall.receipt("out/a.stl", 3, "a.stl", "repaired", ",\"output\":\"a.stl\"");
    hall.receipt("failed/sub/b~2.stl", 9, "sub/b.stl", "not_good", "");
    hall.receipt("quarantine/c.stl", 3, "c.stl", "quarantined", ",\"reason\":\"its worker died\"");
    // Its original was taken away since.
    hall.receipt("out/d.stl", 4, "d.stl", "clean", ",\"output\":\"d.stl\"");
    let store = MemoryStore::default();
    let expected = [
        told(3, Kind::Done, "a.stl", "Done/a.stl"),
        told(4, Kind::Done, "d.stl", "Done/d.stl"),
        told(9, Kind::Failed, "sub/b.stl", "Failed/sub/b~2.stl"),
        told(10, Kind::Quarantined, "c.stl", "Quarantine/c.stl"),
    ];
    assert_eq!(hall.read(&store), expected);
    // It is worked on once more, from where it is.
    let again = store.control(JobId(9), Control::Retry).unwrap();
    assert_eq!((again.kind(), again.original().0, again.attempts.0), (Kind::Queued, Area::Failed, 2));
    // Who reads once more, after a crash, finds nothing new; and a store that was not begun anew reads nothing.
    assert_eq!(fill(&store, &hall.folder, Which::All).unwrap(), 0);
    hall.receipt("out/e.stl", 5, "e.stl", "clean", ",\"output\":\"e.stl\"");
    assert_eq!(hall.read(&store).len(), 4);
}

/// What is damaged, of another version, or was moved elsewhere tells of nothing, and keeps nothing from being read.
#[test]
fn f06_a_receipt_that_says_nothing_is_passed_over() {
    let hall = Hall::new(false);
    hall.put("out/cut.stl.suture.json", b"{\"receipt_version\":1,\"job\":1,\"ending\":\"cl");
    hall.put("out/later.stl.suture.json", b"{\"receipt_version\":2,\"job\":1}");
    hall.put("out/bare.stl.suture.json", b"{\"receipt_version\":1}");
    hall.receipt("failed/a.stl", 1, "a.stl", "clean", ",\"output\":\"a.stl\"");
    hall.receipt("out/moved.stl", 1, "a.stl", "clean", ",\"output\":\"a.stl\"");
    hall.receipt("out/up.stl", 1, "../../up.stl", "clean", ",\"output\":\"up.stl\"");
    hall.receipt("out/long.stl", 1, &"l".repeat(620), "clean", ",\"output\":\"long.stl\"");
    std::os::unix::fs::symlink("cut.stl.suture.json", hall.dir.path().join("out/link.stl.suture.json")).unwrap();
    hall.receipt("out/good.stl", u64::MAX, "good.stl", "clean", ",\"output\":\"good.stl\"");
    assert_eq!(hall.read(&MemoryStore::default()), [told(1, Kind::Done, "good.stl", "Done/good.stl")]);
}

/// An original that stays is known by its content where its time says nothing, and by its time where it was not read.
#[test]
fn f06_an_original_that_stays_answers_for_itself() {
    let hall = Hall::new(true);
    for name in ["a.stl", "b.stl", "c.stl", "d.stl"] {
        hall.put(&format!("in/{name}"), if name == "b.stl" { b"AS DROPPED" } else { BYTES });
    }
    let time = |name: &str| regular(&hall.folder.inbox().join(name)).unwrap().unwrap().mtime_ns;
    for (job, name) in [(1, "a.stl"), (2, "b.stl")] {
        hall.receipt(&format!("out/{name}"), job, name, "clean", &format!(",\"output\":\"{name}\""));
    }
    let unread = |name: &str, time: i64| {
        let text = format!(
            "{{\"receipt_version\":1,\"ending\":\"unreadable\",\"source\":\"{name}\",\"source_bytes\":10,\"stays\":true,\"source_mtime_ns\":{time}}}"
        );
        hall.put(&format!("failed/{name}{RECEIPT}"), text.as_bytes());
    };
    unread("c.stl", time("c.stl"));
    unread("d.stl", time("d.stl") + 1);
    let store = MemoryStore::default();
    let jobs = hall.read(&store);
    assert_eq!(jobs.iter().map(|job| job.3.as_str()).collect::<Vec<_>>(), ["In/a.stl", "In/b.stl", "In/c.stl", "In/d.stl"]);
    let known = |name: &str| {
        let mut inode = 0;
        each_job(&store, &mut |job| {
            if job.source.path.as_bytes() == name.as_bytes() {
                inode = job.source.ino;
            }
        })
        .unwrap();
        inode == regular(&hall.folder.inbox().join(name)).unwrap().unwrap().ino
    };
    assert_eq!(["a.stl", "b.stl", "c.stl", "d.stl"].map(known), [true, false, true, false]);
}

/// The result is in its place and the original is not yet: it is moved, and not worked on. If the result is not there, the file is new.
#[test]
fn f06_an_original_that_was_to_be_moved_is_moved() {
    let hall = Hall::new(false);
    let hash = blake3::hash(b"result").to_hex();
    for (job, name) in [(1, "a.stl"), (2, "gone.stl"), (3, "edited.stl"), (4, "changed.stl")] {
        hall.put(&format!("in/{name}"), if job == 4 { b"AS DROPPED" } else { BYTES });
        hall.receipt(&format!("out/{name}"), job, name, "clean", &format!(",\"output\":\"{name}\",\"output_blake3\":\"{hash}\""));
    }
    for (name, bytes) in [("a", "result"), ("edited", "RESULT"), ("changed", "result")] {
        hall.put(&format!("out/{name}.stl"), bytes.as_bytes());
    }
    let store = MemoryStore::default();
    assert_eq!(fill(&store, &hall.folder, Which::AtRest).unwrap(), 3, "what is left to do is the daemon's");
    let kinds: Vec<_> = hall.read(&store).into_iter().map(|job| job.1).collect();
    assert_eq!(kinds, [Kind::Parked, Kind::Done, Kind::Done, Kind::Done]);
    let job = store.get(JobId(1)).unwrap().unwrap();
    assert!(matches!(job.state, State::Published { .. }) && job.moved_to.is_none() && job.source.ino != 0, "{job:?}");
}

/// Numbers that two stores gave: who had one first keeps it, the other gets a new one.
#[test]
fn f06_a_number_is_given_once() {
    let hall = Hall::new(false);
    for (name, job) in [("a", 7), ("b", 7), ("c", 8), ("d", 0)] {
        hall.receipt(&format!("out/{name}.stl"), job, &format!("{name}.stl"), "clean", &format!(",\"output\":\"{name}.stl\""));
    }
    let jobs = hall.read(&MemoryStore::default());
    let of = |number: u64| jobs.iter().find(|job| job.0 == number).map(|job| job.2.as_str());
    assert_eq!((of(8), jobs.len()), (Some("c.stl"), 4));
    assert!(matches!(of(7), Some("a.stl" | "b.stl")) && of(9).is_some() && of(10).is_some(), "{jobs:?}");
}
