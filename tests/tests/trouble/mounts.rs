//! Parts of the hot folder are mounts of their own.

use std::fs::{File, Permissions};
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

use crate::stage::{Stage, holes, row};
use crate::world::{Dice, Mount, is_root, processes_of, send};

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
fn killed_while_files_cross() {
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
    let mut dice = Dice(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15));
    let stage = Stage::new();
    let _mounts = PARTS.map(|part| Mount::tmpfs(&stage.at(part), "size=16m", 0));
    drop_three(&stage);
    let mut kills = 0;
    for _ in 0..4 {
        let mut daemon = stage.start(stage.watch(&["--once"]));
        let pause = 40 + dice.below(300);
        std::thread::sleep(Duration::from_millis(pause));
        if daemon.child.try_wait().unwrap().is_some() {
            break;
        }
        kills += 1;
        if dice.below(2) == 0 {
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
