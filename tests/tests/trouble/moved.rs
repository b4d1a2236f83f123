//! The hot folder is renamed, made anew or removed under the running daemon.

use std::time::Duration;

use crate::stage::{Stage, holes, row};

fn waiting() -> Stage {
    let mut stage = Stage::new();
    stage.lines += "rescan = \"500ms\"\n";
    for seed in 1..=6 {
        stage.put(&format!("{seed}.stl"), &holes(8000, seed));
    }
    stage
}

fn make_anew(stage: &Stage) {
    std::fs::create_dir_all(stage.hot("in")).unwrap();
}

/// Renamed away while files wait, and back.
#[test]
fn f25_renamed_and_back() {
    let stage = waiting();
    let mut daemon = stage.serve();
    std::fs::rename(stage.at("hot"), stage.at("moved")).unwrap();
    std::thread::sleep(Duration::from_millis(1500));
    std::fs::rename(stage.at("moved"), stage.at("hot")).unwrap();
    let took = stage.wait_done(60, &mut daemon);
    stage.assert_done();
    assert_eq!(daemon.restarts, 0, "{}", stage.log());
    daemon.stop();
    row("renamed", "away for 1.5 s while files wait, then back", &format!("done {:.0} s after, once each", took.as_secs_f64()));
}

/// F25, and F17: renamed and made anew. The daemon touches nothing in the new folder, and a second one may serve that. Files in the old one wait.
#[test]
fn f25_renamed_and_made_anew() {
    let stage = waiting();
    let mut first = stage.serve();
    std::fs::rename(stage.at("hot"), stage.at("moved")).unwrap();
    make_anew(&stage);
    let (name, bytes) = ("new.stl", holes(600, 77));
    std::fs::write(stage.hot("in").join(name), &bytes).unwrap();
    std::thread::sleep(Duration::from_millis(2500));
    let touched: Vec<_> = ["out", "done", ".suture"].into_iter().filter(|part| stage.hot(part).exists()).collect();
    assert!(touched.is_empty(), "the first daemon made {touched:?} in a folder that is not its own\n{}", stage.log());
    assert_eq!(std::fs::read(stage.hot("in").join(name)).unwrap(), bytes);
    let named = stage.log().matches("is another folder than at the start").count();
    let mut second = stage.start(stage.watch(&[]));
    stage.wait("the second daemon to do the new file", 30, || stage.hot("done").join(name).exists());
    assert!(stage.hot("out").join(name).exists());
    second.signal(libc::SIGTERM);
    assert_eq!(second.ended_within(20).and_then(|s| s.code()), Some(0), "{}", stage.log());
    first.signal(libc::SIGTERM);
    assert_eq!(first.ended_within(20).and_then(|s| s.code()), Some(0), "{}", stage.log());
    std::fs::rename(stage.at("hot"), stage.at("new")).unwrap();
    std::fs::rename(stage.at("moved"), stage.at("hot")).unwrap();
    let mut third = stage.start(stage.watch(&[]));
    stage.wait_done(60, &mut third);
    stage.assert_done();
    third.stop();
    assert!(named > 0, "{}", stage.log());
    row(
        "renamed",
        "and made anew while files wait; a second daemon on the new one; back",
        "new folder left alone, second daemon served it, old files done once each",
    );
}

/// The whole folder goes while the daemon runs. It ends with 75 and a line, or serves what is made in its place.
#[test]
fn f25_removed_while_running() {
    let mut stage = Stage::new();
    stage.lines += "rescan = \"500ms\"\n";
    stage.put("before.stl", &holes(600, 1));
    let mut daemon = stage.serve();
    stage.wait_done(30, &mut daemon);
    std::fs::remove_dir_all(stage.at("hot")).unwrap();
    let ended = daemon.ended_within(12);
    assert!(ended.is_none_or(|status| status.code() == Some(75)), "{ended:?}\n{}", stage.log());
    make_anew(&stage);
    let bytes = holes(600, 2);
    std::fs::write(stage.hot("in/after.stl"), &bytes).unwrap();
    let took = stage.wait("what is dropped anew to be done", 60, || {
        daemon.tend();
        std::fs::read(stage.hot("done/after.stl")).is_ok_and(|there| there == bytes)
    });
    stage.assert_nothing_partial();
    daemon.stop();
    let code = ended.and_then(|status| status.code());
    row(
        "removed",
        "rm -rf of the hot folder, 12 s later made anew",
        &format!("ended with {code:?}, {} restarts; a new drop done {:.0} s after", daemon.restarts, took.as_secs_f64()),
    );
}

/// Only the private part goes, with the job store and the lock in it, while files wait.
#[test]
fn f06_private_part_removed() {
    let stage = waiting();
    let mut daemon = stage.serve();
    std::thread::sleep(Duration::from_millis(300));
    // Something may be made in it meanwhile.
    while stage.hot(".suture").exists() {
        let _ = std::fs::remove_dir_all(stage.hot(".suture"));
    }
    for _ in 0..80 {
        std::thread::sleep(Duration::from_millis(100));
        daemon.tend();
        stage.assert_originals(".suture was removed");
    }
    let before = daemon.restarts;
    // A job whose result was in there is done again: its original is where it was, or in `done/`.
    let took = stage.wait("no file to wait", 60, || {
        daemon.tend();
        stage.files("in").is_empty()
    });
    stage.wait("the last job to end", 30, || stage.jobs().iter().all(|job| job["kind"] == "done" || job["kind"] == "cancelled"));
    stage.assert_done();
    daemon.stop();
    row(
        "removed",
        "rm -rf .suture while files wait",
        &format!("{before} restarts; all done {:.0} s later, once each", 8.0 + took.as_secs_f64()),
    );
}
