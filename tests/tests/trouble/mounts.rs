//! Parts of the hot folder are mounts of their own.

use std::fs::{File, Permissions};
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

use suture_store::testkit::Chance;

use crate::stage::{Stage, holes, row};
use crate::world::{Mount, is_root, processes_of, send};

const PARTS: [&str; 3] = ["hot/out", "hot/in/sub", "hot/done"];
/// An hour in the year 2001.
const LONG_AGO: Duration = Duration::from_secs(1_000_000_000);

fn drop_three(stage: &Stage) {
    for (seed, name) in (1..).zip(["a.stl", "sub/b.stl", "sub/c.stl"]) {
        stage.put(name, &holes(600, seed));
        let file = File::open(stage.hot("in").join(name)).unwrap();
        file.set_permissions(Permissions::from_mode(0o640)).unwrap();
        file.set_modified(SystemTime::UNIX_EPOCH + LONG_AGO).unwrap();
    }
}

fn assert_rights(stage: &Stage) {
    for name in ["a.stl", "sub/b.stl", "sub/c.stl"] {
        let original = std::fs::metadata(stage.hot("done").join(name)).unwrap();
        assert_eq!(original.mode() & 0o7777, 0o640, "{name}");
        assert_eq!(original.mtime(), LONG_AGO.as_secs().cast_signed(), "{name}");
        assert_eq!(std::fs::metadata(stage.hot("out").join(name)).unwrap().mode() & 0o7777, 0o640, "{name}");
    }
}

#[test]
fn parts_are_other_file_systems() {
    if !is_root("mounts") {
        return;
    }
    for parts in [&PARTS[..1], &PARTS[1..2], &PARTS[2..], &PARTS] {
        let stage = Stage::new();
        let _mounts: Vec<_> = parts.iter().map(|part| Mount::tmpfs(&stage.at(part), "size=16m", 0)).collect();
        drop_three(&stage);
        let mut daemon = stage.serve();
        let took = stage.wait_done(30, &mut daemon);
        stage.assert_done();
        assert_rights(&stage);
        daemon.stop();
        row(
            "mounts",
            &format!("{parts:?} on tmpfs"),
            &format!("results and originals whole, mode and mtime kept, {:.1} s", took.as_secs_f64()),
        );
    }
}

/// Killed at random moments, with every part on a file system of its own.
#[test]
fn f02_killed_while_files_cross() {
    if !is_root("mounts") {
        return;
    }
    let (next, kills) = (AtomicU64::new(1), AtomicU64::new(0));
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                loop {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if seed > 20 {
                        return;
                    }
                    kills.fetch_add(kill_while_crossing(seed), Ordering::Relaxed);
                }
            });
        }
    });
    row(
        "mounts",
        "out/, in/sub and done/ on tmpfs, SIGKILL at random, 20 seeds",
        &format!("{} kills, nothing doubled or lost", kills.into_inner()),
    );
}

fn kill_while_crossing(seed: u64) -> u64 {
    let mut chance = Chance::new(seed);
    let stage = Stage::new();
    let _mounts = PARTS.map(|part| Mount::tmpfs(&stage.at(part), "size=16m", 0));
    drop_three(&stage);
    let mut kills = 0;
    for _ in 0..4 {
        let mut daemon = stage.start(stage.watch(&["--once"]));
        let pause = 40 + chance.below(300);
        std::thread::sleep(Duration::from_millis(pause));
        if daemon.child.try_wait().unwrap().is_some() {
            break;
        }
        kills += 1;
        if chance.one_in(2) {
            daemon.cut();
        } else {
            daemon.signal(libc::SIGKILL);
            daemon.child.wait().unwrap();
            // Workers end by themselves, or have a moment more.
            stage.wait("its workers to end", 10, || processes_of(stage.binary()).is_empty());
        }
        processes_of(stage.binary()).into_iter().for_each(|pid| send(pid, libc::SIGKILL));
    }
    let mut daemon = stage.start(stage.watch(&[]));
    stage.wait_done(60, &mut daemon);
    stage.assert_done();
    assert_rights(&stage);
    daemon.stop();
    kills
}

/// Locks of hot folders that a process holds.
fn locks_of(pid: u32) -> usize {
    let open = std::fs::read_dir(format!("/proc/{pid}/fd")).unwrap().flatten();
    open.filter_map(|entry| std::fs::read_link(entry.path()).ok()).filter(|path| path.ends_with(".suture/owner")).count()
}

/// The hot folder, with the job store in it, is unmounted while the daemon runs, and mounted again: nothing is made in the bare folder meanwhile.
#[test]
fn f25_unmounted_and_mounted_again() {
    if !is_root("mounts") {
        return;
    }
    let mut stage = Stage::new();
    stage.lines += "rescan = \"500ms\"\n";
    let disk = stage.at("disk");
    std::fs::create_dir_all(disk.join("in")).unwrap();
    let mount = Mount::bind(&disk, &stage.at("hot"));
    stage.put("before.stl", &holes(600, 1));
    let mut daemon = stage.serve();
    stage.wait_done(30, &mut daemon);
    assert_eq!(locks_of(daemon.pid()), 1, "its lock is what keeps a folder from being unmounted while it is served");
    drop(mount);
    let bare = || std::fs::read_dir(stage.at("hot")).unwrap().flatten().map(|entry| entry.file_name()).collect::<Vec<_>>();
    std::fs::write(stage.hot("in/stranger.stl"), holes(600, 3)).unwrap();
    std::thread::sleep(Duration::from_secs(12));
    daemon.tend();
    assert_eq!((bare(), stage.files("in").len()), (vec!["in".into()], 1), "{}", stage.log());
    assert_eq!(locks_of(daemon.pid()), 0, "nothing holds the file system that is gone");
    std::fs::remove_file(stage.hot("in/stranger.stl")).unwrap();
    let _mount = Mount::bind(&disk, &stage.at("hot"));
    stage.put("after.stl", &holes(600, 2));
    let took = stage.wait_done(60, &mut daemon);
    stage.assert_done();
    assert_eq!((daemon.restarts, locks_of(daemon.pid())), (0, 1), "{}", stage.log());
    daemon.stop();
    row(
        "mounts",
        "hot/ unmounted for 12 s, then mounted again",
        &format!("bare folder left alone, served again after {:.1} s", took.as_secs_f64()),
    );
}
