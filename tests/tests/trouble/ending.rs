//! The daemon ends when it is told to, whatever became of its folder and of whoever is connected to it.

use std::io::Write;
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

use crate::stage::{Daemon, Stage, holes, row};

/// Longest time from SIGTERM to the end of a daemon without running jobs, in seconds.
const SOON: u64 = 3;

fn assert_ends(stage: &Stage, mut daemon: Daemon, trouble: &str) {
    let start = Instant::now();
    daemon.signal(libc::SIGTERM);
    let status = daemon.ended_within(SOON).unwrap_or_else(|| panic!("{trouble}: it lives on\n{}", stage.log()));
    stage.assert_no_process();
    assert_eq!(status.code(), Some(0), "{trouble}: {}", stage.log());
    row("SIGTERM", trouble, &format!("code 0 after {:.1} s", start.elapsed().as_secs_f64()));
}

fn served() -> Stage {
    let stage = Stage::new();
    stage.put("part.stl", &holes(600, 1));
    stage
}

#[test]
fn f27_without_its_socket() {
    let stage = served();
    let mut daemon = stage.serve();
    stage.wait_done(30, &mut daemon);
    std::fs::remove_file(stage.hot(".suture/control.sock")).unwrap();
    assert_ends(&stage, daemon, "control socket removed");
    stage.assert_done();
}

#[test]
fn f27_with_its_folder_renamed() {
    let stage = served();
    let mut daemon = stage.serve();
    stage.wait_done(30, &mut daemon);
    std::fs::rename(stage.at("hot"), stage.at("moved")).unwrap();
    assert_ends(&stage, daemon, "hot folder renamed");
    std::fs::rename(stage.at("moved"), stage.at("hot")).unwrap();
    stage.assert_done();
}

#[test]
fn f27_with_a_silent_client_that_holds_no_one_up() {
    let stage = served();
    let mut daemon = stage.serve();
    stage.wait_done(30, &mut daemon);
    let socket = stage.hot(".suture/control.sock");
    let silent = UnixStream::connect(&socket).unwrap();
    let mut half = UnixStream::connect(&socket).unwrap();
    half.write_all(b"\"li").unwrap();
    let start = Instant::now();
    assert_eq!(stage.kind("part.stl"), "done");
    let listed = start.elapsed();
    assert!(listed < Duration::from_secs(5), "a silent client waits for 10 s; this one did as well: {listed:?}");
    row(
        "SIGTERM",
        "a client that says nothing, one that says half, `jobs list`",
        &format!("answered after {:.1} s", listed.as_secs_f64()),
    );
    assert_ends(&stage, daemon, "both still connected");
    drop((silent, half));
}

/// Whoever asks a daemon that is stopped is told so.
#[test]
fn a_stopped_daemon_is_said_not_to_answer() {
    let stage = served();
    let mut daemon = stage.serve();
    stage.wait_done(30, &mut daemon);
    daemon.signal(libc::SIGSTOP);
    let (start, hot) = (Instant::now(), stage.at("hot"));
    let listed = stage.run(["jobs", "list", "--dir", hot.to_str().unwrap()]);
    let (took, said) = (start.elapsed(), String::from_utf8_lossy(&listed.stderr).trim().to_owned());
    assert_eq!(listed.status.code(), Some(75), "{said}");
    assert!(said.contains("does not answer") && took < Duration::from_secs(12), "{took:?}: {said}");
    daemon.signal(libc::SIGCONT);
    daemon.stop();
    row("SIGSTOP", "`jobs list` while the daemon is stopped", &format!("{said:?} after {:.1} s, code 75", took.as_secs_f64()));
}
