//! A repair that is stopped, or whose file changes under it: one line, no output, nothing left behind.

use std::fs::File;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};
use suture_bench::generate::Case;
use suture_tests::Place;

/// `suture repair` of a file large enough to be caught at work, and its worker, which has mapped it.
fn at_work(place: &Place) -> (Child, Pid) {
    place.generate(Case::Mixed, 1_000_000, 1);
    let mut command = place.command();
    command.args(["repair", "mixed.stl", "-o", "out.stl", "--report", "report.json", "--threads", "1"]);
    command.stdout(Stdio::null()).stderr(File::create(place.at("stderr")).unwrap());
    let mut child = command.spawn().unwrap();
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(60) {
        if let Some(worker) = worker_of(child.id(), "mixed.stl") {
            return (child, worker);
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().unwrap();
    panic!("no worker has mapped the file: {}", child.wait().unwrap());
}

/// The child of a process that has mapped a file of this name.
fn worker_of(process: u32, name: &str) -> Option<Pid> {
    let children = std::fs::read_to_string(format!("/proc/{process}/task/{process}/children")).unwrap_or_default();
    let mapped = |child: &&str| std::fs::read_to_string(format!("/proc/{child}/maps")).is_ok_and(|maps| maps.contains(name));
    let worker = children.split_whitespace().find(mapped)?;
    Pid::from_raw(worker.parse().ok()?)
}

/// Waits for the end, which must be code 2 or 130 with one line of these words, and nothing in the folder but the input.
fn assert_ends(place: &Place, mut child: Child, code: i32, words: &str) {
    let status = child.wait().unwrap();
    let said = std::fs::read_to_string(place.at("stderr")).unwrap();
    assert_eq!(status.code(), Some(code), "{said}");
    assert!(said.lines().count() == 1 && said.contains("mixed.stl") && said.contains(words), "{said}");
    assert_eq!(place.names(""), ["mixed.stl", "stderr"], "nothing is left");
}

fn is_there(process: Pid) -> bool {
    Path::new(&format!("/proc/{}", process.as_raw_nonzero())).exists()
}

#[test]
fn by_a_signal() {
    for signal in [Signal::INT, Signal::TERM] {
        let place = Place::new();
        let (child, worker) = at_work(&place);
        kill_process(Pid::from_child(&child), signal).unwrap();
        assert_ends(&place, child, 130, "interrupted");
        assert!(!is_there(worker), "the worker goes, too");
    }
}

#[test]
fn by_the_death_of_the_worker() {
    let place = Place::new();
    let (child, worker) = at_work(&place);
    kill_process(worker, Signal::KILL).unwrap();
    assert_ends(&place, child, 2, "");
}

/// Only the name under which nothing is published may be left by a kill that no one can catch.
#[test]
fn by_a_kill() {
    let place = Place::new();
    let (mut child, worker) = at_work(&place);
    child.kill().unwrap();
    child.wait().unwrap();
    let start = Instant::now();
    while is_there(worker) {
        assert!(start.elapsed() < Duration::from_secs(30), "the worker outlives the command");
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(!place.at("out.stl").exists() && !place.at("report.json").exists());
}

#[test]
fn by_a_cut_in_the_mapped_file() {
    let place = Place::new();
    let (child, _) = at_work(&place);
    File::options().write(true).open(place.at("mixed.stl")).unwrap().set_len(1_000).unwrap();
    assert_ends(&place, child, 2, "changed while it was being worked on");
}

#[test]
fn by_a_change_of_the_file() {
    let place = Place::new();
    let (child, _) = at_work(&place);
    File::options().write(true).open(place.at("mixed.stl")).unwrap().set_modified(std::time::SystemTime::UNIX_EPOCH).unwrap();
    assert_ends(&place, child, 2, "changed while it was being worked on");
}
