//! The faults the store is built against, each by name.

use std::path::Path;
use std::sync::Arc;

use super::files::{self, Mark};
use super::*;
use crate::id::{Epoch, Seq};
use crate::job::{Ending, Publication};
use crate::tables::{Put, Table, Tables};
use crate::testkit::{Subject, conformance, dropped, result_of};

struct OnDisk {
    state: tempfile::TempDir,
    clock: Arc<dyn Clock>,
    store: Option<SledStore>,
}

impl Subject for OnDisk {
    fn store(&self) -> &dyn JobStore {
        self.store.as_ref().unwrap()
    }

    fn restart(&mut self) {
        drop(self.store.take());
        assert_eq!(SledStore::verify(self.state.path()).unwrap().wrong, Vec::<String>::new());
        self.store = Some(SledStore::open_with(self.state.path(), Arc::clone(&self.clock)).unwrap());
    }
}

#[test]
fn conforms() {
    conformance(&|clock| {
        let state = tempfile::tempdir().unwrap();
        let store = Some(SledStore::open_with(state.path(), Arc::clone(&clock)).unwrap());
        Box::new(OnDisk { state, clock, store })
    });
}

fn submit(store: &SledStore, name: &str) -> JobId {
    store.submit(&[dropped(name, 84).unwrap()]).unwrap()[0].id
}

/// F4: a kill while sled wrote its snapshot.
#[test]
fn f04_a_torn_snapshot_does_not_keep_the_store_shut() {
    let state = tempfile::tempdir().unwrap();
    let id = submit(&SledStore::open(state.path()).unwrap(), "part.stl");
    std::fs::write(state.path().join("db/snap.FFFFFFFFFFFFFFF0.generating"), b"torn").unwrap();
    let store = SledStore::open(state.path()).unwrap();
    assert_eq!(store.opening().torn_snapshots, 1);
    assert_eq!(store.opening().set_aside, None);
    assert!(store.get(id).unwrap().is_some());
}

/// F16: two daemons, one state folder.
#[test]
fn f16_a_second_daemon_is_told_who_owns_the_store() {
    let state = tempfile::tempdir().unwrap();
    let first = SledStore::open(state.path()).unwrap();
    let second = SledStore::open(state.path()).err().unwrap();
    assert!(matches!(second, StoreError::Locked { pid: Some(pid), .. } if pid == std::process::id()), "{second:?}");
    assert_eq!(second.exit_code(), 73);
    assert!(second.to_string().contains(&std::process::id().to_string()));
    drop(first);
    assert_eq!(SledStore::open(state.path()).unwrap().opening().epoch, Epoch(2));
}

/// A child of a daemon that died may hold sled's lock for a moment. That is no damage, and passes.
#[test]
fn a_database_that_is_held_is_not_taken_for_damaged() {
    let state = tempfile::tempdir().unwrap();
    let id = submit(&SledStore::open(state.path()).unwrap(), "part.stl");
    let held = File::open(state.path().join("db/db")).unwrap();
    held.lock().unwrap();
    let error = SledStore::open(state.path()).err().unwrap();
    assert!(error.to_string().contains("could not acquire lock"), "{error}");
    assert_eq!(error.exit_code(), 75);
    let store = std::thread::scope(|scope| {
        scope.spawn(|| {
            std::thread::sleep(std::time::Duration::from_millis(100));
            held.unlock().unwrap();
        });
        SledStore::open(state.path()).unwrap()
    });
    assert_eq!(store.opening().set_aside, None);
    assert!(store.get(id).unwrap().is_some());
}

/// F5: a record that the database hands out damaged.
#[test]
fn f05_a_flipped_bit_is_an_error_not_another_value() {
    let state = tempfile::tempdir().unwrap();
    let store = SledStore::open(state.path()).unwrap();
    let id = submit(&store, "part.stl");
    let whole = store.get(id).unwrap().unwrap();
    let key = id.0.to_be_bytes();
    let queue = &store.queue;
    let jobs = queue.tables().raw_jobs();
    let bytes = jobs.get(key).unwrap().unwrap().to_vec();
    for bit in 0..bytes.len() * 8 {
        let mut damaged = bytes.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        jobs.insert(key, damaged).unwrap();
        assert!(matches!(queue.get(id), Err(StoreError::Corrupt { .. })), "bit {bit}");
    }
    jobs.insert(key, &bytes[..5]).unwrap();
    assert!(matches!(queue.get(id), Err(StoreError::Corrupt { .. })));
    jobs.insert(2_u64.to_be_bytes(), bytes.clone()).unwrap();
    assert!(matches!(queue.get(JobId(2)), Err(StoreError::Corrupt { .. })), "under another job's key");
    jobs.insert(key, bytes).unwrap();
    assert_eq!(queue.get(id).unwrap(), Some(whole));
}

/// F5: the database opens, but an acknowledged transition is not in it.
#[test]
fn f05_a_store_that_went_back_in_time_is_refused() {
    let state = tempfile::tempdir().unwrap();
    submit(&SledStore::open(state.path()).unwrap(), "a.stl");
    let older = state.path().join("older");
    files::copy_dir(&state.path().join("db"), &older, |_| false).unwrap();
    submit(&SledStore::open(state.path()).unwrap(), "b.stl");
    std::fs::remove_dir_all(state.path().join("db")).unwrap();
    std::fs::rename(&older, state.path().join("db")).unwrap();
    let error = SledStore::open(state.path()).err().unwrap();
    assert!(matches!(error, StoreError::RolledBack { found: (Epoch(1), _), reached: (Epoch(2), _), .. }), "{error:?}");
    assert_eq!(error.exit_code(), 75);
    // The same without any database.
    std::fs::remove_dir_all(state.path().join("db")).unwrap();
    let error = SledStore::open(state.path()).err().unwrap();
    assert!(matches!(error, StoreError::RolledBack { found: (Epoch(0), Seq(0)), .. }), "{error:?}");
}

/// A kill while the first database was made: `SEQ` says that nothing was acknowledged, so that beginning anew loses nothing.
#[test]
fn a_database_that_never_was_is_set_aside() {
    let state = tempfile::tempdir().unwrap();
    drop(SledStore::open(state.path()).unwrap());
    files::write_mark(state.path(), Epoch(0), Seq(0)).unwrap();
    std::fs::write(state.path().join("db/snap.FFFFFFFFFFFFFFF0"), b"no snapshot").unwrap();
    let store = SledStore::open(state.path()).unwrap();
    assert_eq!(store.opening().epoch, Epoch(1));
    assert!(store.opening().set_aside.clone().unwrap().join("snap.FFFFFFFFFFFFFFF0").exists());
}

/// A crash between the two renames that put a restored database in the place of a damaged one.
#[test]
fn a_restored_database_is_found_where_the_crash_left_it() {
    let state = tempfile::tempdir().unwrap();
    let id = submit(&SledStore::open(state.path()).unwrap(), "part.stl");
    std::fs::rename(state.path().join("db"), state.path().join("db.trial")).unwrap();
    let store = SledStore::open(state.path()).unwrap();
    assert!(store.get(id).unwrap().is_some());
    drop(store);
    // Earlier, it is only an unfinished copy.
    std::fs::create_dir(state.path().join("db.trial")).unwrap();
    assert!(SledStore::open(state.path()).unwrap().get(id).unwrap().is_some());
    assert!(!state.path().join("db.trial").exists());
}

/// F6: the whole state folder is gone: a new store, without complaint.
#[test]
fn f06_an_empty_folder_is_a_new_store() {
    let state = tempfile::tempdir().unwrap();
    let path = state.path().join("deep/state");
    submit(&SledStore::open(&path).unwrap(), "a.stl");
    std::fs::remove_dir_all(&path).unwrap();
    let store = SledStore::open(&path).unwrap();
    assert_eq!(store.opening().epoch, Epoch(1));
    assert_eq!(submit(&store, "a.stl"), JobId(1));
}

#[test]
fn now_and_then_and_at_shutdown_it_notes_how_far_it_got() {
    let state = tempfile::tempdir().unwrap();
    let store = SledStore::open(state.path()).unwrap();
    assert_eq!(files::read_mark(state.path()).unwrap(), Mark::Reached(Epoch(1), Seq(1)));
    submit(&store, "a.stl");
    assert_eq!(files::read_mark(state.path()).unwrap(), Mark::Reached(Epoch(1), Seq(1)), "only now and then");
    for at in 0..63 {
        submit(&store, &format!("{at}.stl"));
    }
    assert_eq!(files::read_mark(state.path()).unwrap(), Mark::Reached(Epoch(1), Seq(65)), "after 64");
    submit(&store, "b.stl");
    drop(store);
    assert_eq!(files::read_mark(state.path()).unwrap(), Mark::Reached(Epoch(1), Seq(66)));
}

fn snapshots(state: &Path) -> Vec<PathBuf> {
    files::list(&state.join("db")).unwrap().into_iter().filter(|path| files::is_snapshot(path)).collect()
}

/// F5: the snapshot is damaged, the log is whole: everything comes back.
#[test]
fn f05_a_damaged_snapshot_is_made_anew_from_the_log() {
    let state = tempfile::tempdir().unwrap();
    for name in ["a.stl", "b.stl", "c.stl"] {
        // Each opening writes a snapshot of what the one before left.
        submit(&SledStore::open(state.path()).unwrap(), name);
    }
    let snapshots = snapshots(state.path());
    assert!(!snapshots.is_empty());
    for path in &snapshots {
        let mut bytes = std::fs::read(path).unwrap();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 0xff;
        std::fs::write(path, bytes).unwrap();
    }
    let found = SledStore::verify(state.path()).unwrap();
    assert!(
        found.wrong.is_empty() && found.mends.len() == 1 && found.mends[0].contains("made anew from its own log"),
        "{found:?}"
    );
    let store = SledStore::open(state.path()).unwrap();
    let aside = store.opening().set_aside.clone().unwrap();
    assert!(aside.join("db").exists(), "the damaged one is kept");
    assert_eq!(store.list(&Query::default()).unwrap().len(), 3);
    assert_eq!(store.opening().epoch, Epoch(4));
    drop(store);
    assert_eq!(SledStore::open(state.path()).unwrap().opening().set_aside, None);
}

/// F5: the log is cut: what is left is older than what was acknowledged, and is refused, as often as it is asked.
#[test]
fn f05_a_cut_log_is_refused_and_left_as_it_is() {
    let state = tempfile::tempdir().unwrap();
    let store = SledStore::open(state.path()).unwrap();
    let found: Vec<_> = (0..500).map(|at| dropped(&format!("{at}.stl"), at).unwrap()).collect();
    store.submit(&found).unwrap();
    drop(store);
    drop(SledStore::open(state.path()).unwrap());
    let log = state.path().join("db/db");
    let length = std::fs::metadata(&log).unwrap().len();
    File::options().write(true).open(&log).unwrap().set_len(length / 2).unwrap();
    for _ in 0..2 {
        let before = files::list(&state.path().join("db")).unwrap();
        let error = SledStore::open(state.path()).err().unwrap();
        assert!(matches!(error, StoreError::Unusable { .. } | StoreError::RolledBack { .. }), "{error:?}");
        assert_eq!(error.exit_code(), 75);
        assert!(error.to_string().contains("To begin anew"), "{error}");
        assert_eq!(files::list(&state.path().join("db")).unwrap(), before);
    }
}

/// F5: what cannot be trusted is kept, with its mark, and a new store is begun; what is sound, or someone's, stays as it is.
#[test]
fn f05_a_damaged_store_is_set_aside_and_a_sound_one_is_not() {
    let state = tempfile::tempdir().unwrap();
    let store = SledStore::open(state.path()).unwrap();
    submit(&store, "a.stl");
    assert!(matches!(SledStore::set_aside(state.path()), Err(StoreError::Locked { .. })));
    drop(store);
    assert_eq!(SledStore::set_aside(state.path()).unwrap(), None);
    assert_eq!(SledStore::peek(state.path()).unwrap().len(), 1);
    let log = state.path().join("db/db");
    File::options().write(true).open(&log).unwrap().set_len(100).unwrap();
    assert!(SledStore::open(state.path()).is_err());
    let aside = SledStore::set_aside(state.path()).unwrap().unwrap();
    assert!(aside.starts_with(state.path()) && aside.join("db/db").exists() && aside.join("SEQ").exists());
    let store = SledStore::open(state.path()).unwrap();
    assert!(store.is_unfilled().unwrap() && store.list(&Query::default()).unwrap().is_empty());
}

/// Every file of a state folder.
fn everything(state: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut all = Vec::new();
    for path in files::list(state).unwrap() {
        if path.is_dir() {
            all.extend(everything(&path));
        } else {
            let bytes = std::fs::read(&path).unwrap();
            all.push((path, bytes));
        }
    }
    all.sort();
    all
}

/// F5: what is wrong is said, what mends itself is told apart from it, and nothing is changed. A store is begun anew exactly where something is
/// wrong.
#[test]
fn f05_a_look_at_every_record_says_what_is_wrong_and_changes_nothing() {
    let cut = |state: &Path| File::options().write(true).open(state.join("db/db")).unwrap().set_len(100).unwrap();
    let damage_record = |state: &Path| {
        let store = SledStore::open(state).unwrap();
        let jobs = store.queue.tables().raw_jobs();
        let mut bytes = jobs.get(1_u64.to_be_bytes()).unwrap().unwrap().to_vec();
        bytes[20] ^= 1;
        jobs.insert(1_u64.to_be_bytes(), bytes).unwrap();
    };
    let lose_entry = |state: &Path| {
        let store = SledStore::open(state).unwrap();
        store.control(JobId(1), Control::Cancel).unwrap();
        let key = [&[13][..], &1_u64.to_be_bytes()].concat();
        store.queue.tables().write(vec![Put { table: Table::ByState, key, value: None }], store.queue.reached().1).unwrap();
    };
    type Damage<'a> = &'a dyn Fn(&Path);
    let cases: [(&str, Damage<'_>, &str, &str); 7] = [
        ("none", &|_| {}, "", ""),
        (
            "torn snapshot",
            &|state| std::fs::write(state.join("db/snap.F0.generating"), b"half").unwrap(),
            "half of a snapshot",
            "",
        ),
        ("damaged mark", &|state| std::fs::write(state.join("SEQ"), b"suture").unwrap(), "SEQ", ""),
        ("cut log", &cut, "", "the database went back in time: it ends at epoch 0"),
        ("lost", &|state| std::fs::remove_dir_all(state.join("db")).unwrap(), "", "the database went back in time"),
        ("record", &damage_record, "", "job 1: "),
        ("index", &lose_entry, "", "by_state: no entry says that job 1 is cancelled"),
    ];
    for (what, damage, mends, wrong) in cases {
        let folder = tempfile::tempdir().unwrap();
        let state = folder.path().join("state");
        let store = SledStore::open(&state).unwrap();
        submit(&store, "a.stl");
        submit(&store, "b.stl");
        assert!(matches!(SledStore::verify(&state), Err(StoreError::Locked { pid: Some(_), .. })), "{what}");
        drop(store);
        damage(&state);
        let before = everything(&state);
        let found = SledStore::verify(&state).unwrap();
        assert!(everything(&state) == before, "{what}");
        let fits = |lines: &[String], words: &str| {
            if words.is_empty() { lines.is_empty() } else { lines.len() == 1 && lines[0].contains(words) }
        };
        assert!(fits(&found.mends, mends) && fits(&found.wrong, wrong), "{what}: {found:?}");
        assert!(!wrong.is_empty() || (found.jobs, found.records) == (2, 6), "{what}: {found:?}");
        assert_eq!(SledStore::set_aside(&state).unwrap().is_some(), !wrong.is_empty(), "{what}");
    }
    let empty = tempfile::tempdir().unwrap();
    assert_eq!(SledStore::verify(empty.path()).unwrap().wrong, Vec::<String>::new());
    assert!(files::list(empty.path()).unwrap().is_empty());
}

/// F7, and F8: the first error ends it, whatever it was.
#[test]
fn f07_a_poisoned_store_does_nothing_and_loses_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let state = folder.path().join("state");
    let store = SledStore::open(&state).unwrap();
    let id = submit(&store, "part.stl");
    let claim = store.claim(&Filter::default()).unwrap().unwrap();
    store.queue.tables().poison(StoreError::Poisoned { reason: "no space left".into() });
    let refused = store.advance(&claim, Step::HandBack).unwrap_err();
    assert!(matches!(&refused, StoreError::Poisoned { reason } if reason.contains("no space left")), "{refused:?}");
    assert!(matches!(store.claim(&Filter::default()), Err(StoreError::Poisoned { .. })));
    assert!(store.get(id).unwrap().is_some(), "reading goes on");
    drop(store);
    // Its handles end with this process: another one finds what a copy shows.
    let copy = folder.path().join("copy");
    super::files::copy_dir(&state, &copy, |_| false).unwrap();
    let store = SledStore::open(&copy).unwrap();
    assert_eq!(store.opening().epoch, Epoch(2));
    assert_eq!(store.heartbeat(&claim).unwrap(), Lease::Lost);
    let recovered = store.recover(&|_| Testimony::Outlived).unwrap();
    assert_eq!(recovered[0].void, claim.token);
    assert_eq!(store.claim(&Filter::default()).unwrap().unwrap().id, id);
}

/// F5: damage anywhere in the files. Either everything is there as it was, or the store says that it cannot be trusted.
#[test]
fn f05_damage_on_disk_is_never_silent() {
    let folder = tempfile::tempdir().unwrap();
    let sound = folder.path().join("sound");
    let store = SledStore::open(&sound).unwrap();
    let found: Vec<_> = (0..100).map(|at| dropped(&format!("{at}.stl"), at).unwrap()).collect();
    store.submit(&found).unwrap();
    let jobs = store.list(&Query::default()).unwrap();
    drop(store);
    drop(SledStore::open(&sound).unwrap());
    let (mut whole, mut refused) = (0, 0);
    for file in files::list(&sound.join("db")).unwrap().into_iter().filter(|path| path.is_file()) {
        let bytes = std::fs::read(&file).unwrap();
        let name = file.file_name().unwrap();
        let step = (bytes.len() / FLIPS).max(1);
        for at in (0..bytes.len()).step_by(step) {
            let state = folder.path().join("state");
            files::copy_dir(&sound, &state, |_| false).unwrap();
            let mut damaged = bytes.clone();
            damaged[at] ^= 0x10;
            std::fs::write(state.join("db").join(name), damaged).unwrap();
            let opened = SledStore::open(&state).and_then(|store| store.list(&Query::default()));
            match opened {
                Ok(found) => {
                    assert_eq!(found, jobs, "{name:?} at {at}");
                    whole += 1;
                }
                Err(error) => {
                    assert_eq!(error.exit_code(), 75, "{name:?} at {at}: {error}");
                    refused += 1;
                }
            }
            std::fs::remove_dir_all(&state).unwrap();
        }
    }
    assert!(whole > 0 && refused > 0, "{whole} came back whole, {refused} were refused");
}

/// Places in each file that are damaged in turn.
const FLIPS: usize = 12;

/// A store is looked at without a right to write, without a new epoch, and not while a daemon owns it.
#[test]
fn a_peek_writes_nothing() {
    let state = tempfile::tempdir().unwrap();
    assert_eq!(SledStore::peek(state.path()).unwrap(), []);
    let store = SledStore::open(state.path()).unwrap();
    store.submit(&[dropped("part.stl", 84).unwrap()]).unwrap();
    store.claim(&Filter::default()).unwrap().unwrap();
    assert!(matches!(SledStore::peek(state.path()), Err(StoreError::Locked { pid: Some(_), .. })));
    let job = store.get(JobId(1)).unwrap().unwrap();
    drop(store);
    let listing = || {
        let mut names: Vec<_> = super::files::list(&state.path().join("db")).unwrap();
        names.sort();
        names.into_iter().map(|path| (std::fs::read(&path).unwrap_or_default(), path)).collect::<Vec<_>>()
    };
    let before = listing();
    assert_eq!(SledStore::peek(state.path()).unwrap(), [job]);
    assert!(listing() == before);
}

/// D5: a store whose folder was removed, or made anew, is not opened again as an empty one.
#[test]
fn f06_a_store_that_was_taken_away_is_not_begun_anew() {
    let dir = tempfile::tempdir().unwrap();
    let state = dir.path().join("state");
    let store = SledStore::open(&state).unwrap();
    store.check().unwrap();
    std::fs::rename(&state, dir.path().join("away")).unwrap();
    assert!(matches!(store.check(), Err(StoreError::Unusable { .. })));
    std::fs::create_dir(&state).unwrap();
    assert!(matches!(store.check(), Err(StoreError::Unusable { .. })), "it is another folder");
    std::fs::remove_dir(&state).unwrap();
    std::fs::rename(dir.path().join("away"), &state).unwrap();
    store.check().unwrap();
}

/// Earlier versions had indexes of results and of files on disk.
#[test]
fn f29_indexes_of_earlier_versions_go_and_all_is_found_without_them() {
    let state = tempfile::tempdir().unwrap();
    let store = SledStore::open(state.path()).unwrap();
    let id = submit(&store, "part.stl");
    let claim = store.claim(&Filter::default()).unwrap().unwrap();
    let publication = Publication { recipe: Some(Recipe(7)), ..result_of(&claim.job, Ending::Repaired) };
    for step in [Step::Intend(publication), Step::Placed, Step::Finished] {
        store.advance(&claim, step).unwrap();
    }
    drop(store);
    let earlier = sled::Config::new().path(state.path().join("db")).segment_size(64 << 10).open().unwrap();
    // Their programs refuse what has lost them.
    let head = earlier.open_tree("meta").unwrap().get(b"head").unwrap().unwrap();
    assert_eq!(head[4..6], [0, 4]);
    for name in ["by_recipe", "by_key"] {
        earlier.open_tree(name).unwrap().insert([0; 24], b"").unwrap();
    }
    drop(earlier);
    for _ in 0..2 {
        let store = SledStore::open(state.path()).unwrap();
        assert!(!store.queue.tables().names().iter().any(|name| name.starts_with("by_") && name != "by_state"));
        let file = store.get(id).unwrap().unwrap().source;
        assert_eq!(store.find(&file).unwrap(), Some(id));
        let found = store.results(84, Some(Recipe(7))).unwrap();
        assert_eq!(found.iter().map(|job| job.id).collect::<Vec<_>>(), [id]);
        assert!(store.results(84, Some(Recipe(8))).unwrap().is_empty());
    }
}
