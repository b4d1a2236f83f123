//! Clocks that jump, files from the future, and a file of the size of a disk.

use std::fs::File;
use std::process::Command;
use std::time::{Duration, SystemTime};

use suture_bench::generate::{Case, write_file};

use crate::stage::{Stage, holes, row};
use crate::world::is_root;

const YEAR: Duration = Duration::from_secs(365 * 86_400);

/// The wall clock of other processes cannot be moved without moving the machine's; files may come from machines whose clock is wrong.
#[test]
fn f15_files_of_other_times() {
    let stage = Stage::new();
    let now = SystemTime::now();
    let times = [
        ("future.stl", now + YEAR),
        ("epoch.stl", SystemTime::UNIX_EPOCH),
        ("before.stl", SystemTime::UNIX_EPOCH - Duration::from_secs(86_400)),
        ("now.stl", now),
    ];
    for (seed, (name, time)) in (1..).zip(times) {
        stage.put(name, &holes(600, seed));
        File::options().write(true).open(stage.hot("in").join(name)).unwrap().set_modified(time).unwrap();
    }
    let mut daemon = stage.serve();
    stage.wait_done(30, &mut daemon);
    stage.assert_done();
    for (name, time) in times {
        let kept = std::fs::metadata(stage.hot("done").join(name)).unwrap().modified().unwrap();
        assert_eq!(kept, time, "{name}");
    }
    daemon.stop();
    row("clock", "files of next year, 1970 and 1969", "done, times kept");
}

/// Between two lives of the daemon the monotonic clock jumps ten years ahead, and back (another boot of the machine).
#[test]
fn f15_monotonic_clock_jumps_between_lives() {
    if !is_root("clock") {
        return;
    }
    if !Command::new("unshare").args(["--time", "--fork", "true"]).status().is_ok_and(|status| status.success()) {
        row("clock", "monotonic clock", "skipped: no time namespaces here");
        return;
    }
    let stage = Stage::new();
    for (seed, ahead) in [(1, 10 * YEAR.as_secs()), (2, 0), (3, YEAR.as_secs())] {
        stage.put(&format!("{seed}.stl"), &holes(600, seed));
        let plain = stage.watch(&["--once"]);
        let mut shifted = Command::new("unshare");
        shifted.args(["--time", "--fork", "--kill-child", "--monotonic", &ahead.to_string(), "--boottime", &ahead.to_string()]);
        shifted.arg(plain.get_program()).args(plain.get_args()).env("SUTURE_LOG", "info").current_dir(stage.at(""));
        let output = shifted.output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        stage.assert_originals("after the jump");
    }
    stage.assert_done();
    stage.assert_no_process();
    row(
        "clock",
        "monotonic and boot clock +10 years, 0, +1 year between lives",
        "all done (jumps of the wall clock: skipped, no way below libc)",
    );
}

/// 40 million triangles, 2 GB.
#[test]
fn f20_forty_million_triangles() {
    if std::env::var_os("SUTURE_EXHAUSTIVE").is_none() {
        row("huge", "40 M triangles", "skipped: only with SUTURE_EXHAUSTIVE=1");
        return;
    }
    let stage = Stage::new();
    let room = rustix::fs::statvfs(stage.at("").as_path()).unwrap();
    if room.f_bavail * room.f_frsize < 12 << 30 {
        row("huge", "40 M triangles", "skipped: needs 12 GiB of room");
        return;
    }
    let dropped = stage.at("huge.stl");
    write_file(Case::Holes, 40_000_000, 1, &dropped).unwrap();
    let size = std::fs::metadata(&dropped).unwrap().len();
    std::fs::rename(&dropped, stage.hot("in/huge.stl")).unwrap();
    let mut daemon = stage.serve();
    let took = stage.wait("it to end", 3600, || {
        daemon.tend();
        matches!(stage.kind("huge.stl").as_str(), "done" | "failed" | "needs_review" | "quarantined")
    });
    assert_eq!(stage.kind("huge.stl"), "done", "{:?}", stage.job("huge.stl"));
    assert_eq!(std::fs::metadata(stage.hot("done/huge.stl")).unwrap().len(), size);
    daemon.stop();
    row("huge", "40 M triangles, 2 GB", &format!("done after {:.0} s", took.as_secs_f64()));
}
