//! Workers that are killed, that hang, and that crash however often: what it costs the file, and how soon it is over.

use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

use serde_json::Value;
use suture_bench::generate::Case;
use suture_tests::binary::with_crash_points;
use suture_tests::hot::{Hot, mesh};
use suture_tests::served::wait_until;

use crate::{assert_at_rest, kill, was_killed, workers};

/// An end that is in place is in the store by then, however busy the disk is.
const SURELY: Duration = Duration::from_secs(180);

/// The daemon lives, the file goes on at once, and nothing is held against it.
#[test]
fn f03_a_worker_that_is_killed_costs_its_file_nothing() {
    const KILLS: usize = 3;
    let hot = Hot::new(with_crash_points());
    let original = mesh(Case::Clean, 1);
    hot.put("part!slow!.stl", &original);
    let mut daemon = hot.start();
    let mut killed = BTreeSet::new();
    let is_done = || hot.tree("done").contains_key("part!slow!.stl");
    wait_until("the file to be done", || {
        let running = workers(&daemon).into_iter().find(|pid| !killed.contains(pid));
        if let Some(pid) = running.filter(|_| killed.len() < KILLS) {
            killed.insert(pid);
            kill(pid);
        }
        is_done()
    });
    assert!(daemon.try_wait().unwrap().is_none(), "the daemon ended");
    let began = Instant::now();
    loop {
        let jobs = hot.jobs();
        if jobs.iter().all(|job| job["kind"] == "done") {
            break;
        }
        assert!(began.elapsed() < SURELY, "its job does not end: {jobs:?}");
        std::thread::sleep(Duration::from_millis(20));
    }
    assert_eq!((killed.len(), hot.jobs()[0]["attempts"].as_u64()), (KILLS, Some(1 + KILLS as u64)));
    assert_eq!(hot.tree("out")["part!slow!.stl"], original);
    let pid = rustix::process::Pid::from_child(&daemon);
    rustix::process::kill_process(pid, rustix::process::Signal::TERM).unwrap();
    assert_eq!(daemon.wait().unwrap().code(), Some(0));
    assert_at_rest(&hot, "killed workers");
}

/// Another attempt may begin as soon as a job is given back: what is cleared away after that must not touch the inode of the original, whose change
/// would be taken for one of the file.
#[test]
fn f03_an_attempt_has_let_go_of_its_file_when_its_job_is_given_back() {
    let hot = Hot::new(with_crash_points());
    hot.put("part!abort!.stl", &mesh(Case::Clean, 1));
    let status = hot.watch(&["--once"]).env("SUTURE_CRASH_AT", "daemon.given_back:1").status().expect("the daemon starts");
    assert!(was_killed(status), "{status}");
    let names = |folder: &str| hot.tree(folder).into_keys().collect::<Vec<_>>();
    let (left, jobs) = (names(".suture/work"), hot.jobs());
    assert_eq!(std::fs::read_dir(hot.path().join(".suture/work")).unwrap().count(), 1, "the attempt's folder is there still");
    assert!(left.iter().all(|name| !name.ends_with("in.stl")), "{jobs:?}: {left:?}");
    assert_eq!(names("in"), ["part!abort!.stl"]);
}

/// A worker that tries to read a file beside its work, and a program, and aborts if it can.
#[test]
fn a_worker_reaches_nothing_but_its_work() {
    // SAFETY: asked for its version, the call reads no memory (landlock_create_ruleset(2)).
    let version = unsafe { libc::syscall(libc::SYS_landlock_create_ruleset, std::ptr::null::<u8>(), 0_usize, 1_u32) };
    let hot = Hot::new(with_crash_points());
    hot.put("other.txt", b"another customer's");
    hot.put("part!reach!.stl", &mesh(Case::Holes, 1));
    let code = hot.watch(&["--once"]).status().unwrap().code();
    assert_eq!(code, Some(i32::from(version <= 0)), "fences of version {version}");
    assert_eq!(hot.tree("out").contains_key("part!reach!.stl"), version > 0);
}

/// A process: its number, its parent's, its group's.
struct Process {
    pid: u32,
    parent: u32,
    group: u32,
}

/// All that run; those that have ended and were not waited for are none.
fn processes() -> Vec<Process> {
    let numbers = std::fs::read_dir("/proc")
        .expect("processes can be listed")
        .flatten()
        .filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    let of = |pid: u32| {
        let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
        let mut words = stat.rsplit_once(')')?.1.split_whitespace();
        let is_there = words.next()? != "Z";
        let (parent, group) = (words.next()?.parse().ok()?, words.next()?.parse().ok()?);
        is_there.then_some(Process { pid, parent, group })
    };
    numbers.filter_map(of).collect()
}

/// A worker that hangs, and a process that it started: both are gone a second after the limit, in each of two attempts. Others go on.
#[test]
fn f11_a_worker_that_hangs_is_ended_in_time_with_all_it_started() {
    const LIMIT: Duration = Duration::from_secs(1);
    let hot = Hot::new(with_crash_points());
    hot.put("a!hang!.stl", &mesh(Case::Holes, 1));
    hot.put("part.stl", &mesh(Case::Holes, 2));
    let lines = "settle = \"30ms\"\nworkers = 2\ntime_limit = { base = \"1s\", per_gib = \"1s\" }";
    let mut daemon = hot.configured(lines).spawn().unwrap();
    // Groups of workers that have started something: when that was seen first, and any of the group last.
    let mut hung: BTreeMap<u32, (Instant, Instant)> = BTreeMap::new();
    let mut status = None;
    wait_until("the daemon to end", || {
        let (all, now) = (processes(), Instant::now());
        let ours: BTreeSet<u32> = all.iter().filter(|process| process.parent == daemon.id()).map(|process| process.pid).collect();
        for process in
            all.iter().filter(|process| ours.contains(&process.parent) || hung.contains_key(&process.group)).collect::<Vec<_>>()
        {
            hung.entry(process.group).or_insert((now, now)).1 = now;
        }
        status = daemon.try_wait().unwrap();
        status.is_some()
    });
    assert_eq!(status.unwrap().code(), Some(1), "not everything is good");
    assert_eq!(hung.len(), 2, "two attempts");
    for (first, last) in hung.values() {
        let lived = last.duration_since(*first);
        assert!(lived > LIMIT / 2 && lived < LIMIT + Duration::from_secs(1), "{lived:?}");
    }
    assert!(processes().iter().all(|process| !hung.contains_key(&process.group)), "something is left");
    assert!(hot.tree("done").contains_key("part.stl") && hot.tree("out").contains_key("part.stl"));
    let report: Value = serde_json::from_slice(&hot.tree("quarantine")["a!hang!.stl.report.json"]).unwrap();
    assert!(report["attempts"] == 2 && report["reason"].as_str().unwrap().contains("time limit"), "{report}");
}

/// The daemon dies after a crash of the worker, before it has noted it or after: the file has three attempts at most over all lives.
#[test]
fn f12_attempts_are_counted_over_restarts() {
    for (point, attempts) in [("daemon.worked:1", 3), ("daemon.swept:1", 2)] {
        let hot = Hot::new(with_crash_points());
        let original = mesh(Case::Holes, 1);
        hot.put("a!abort!.stl", &original);
        // With more workers, the next attempt may begin before the daemon is killed.
        let mut command = hot.watch(&["--once", "--workers", "1"]);
        assert!(was_killed(command.env("SUTURE_CRASH_AT", point).status().unwrap()), "{point}: it was not killed");
        hot.put("part.stl", &mesh(Case::Holes, 2));
        assert_eq!(hot.once(None).code(), Some(1), "{point}");
        assert_eq!(hot.tree("quarantine").get("a!abort!.stl"), Some(&original), "{point}");
        let jobs = hot.jobs();
        let of = |name: &str| jobs.iter().find(|job| job["source"]["path"] == name).unwrap();
        assert_eq!(
            (&of("a!abort!.stl")["kind"], &of("a!abort!.stl")["attempts"]),
            (&"quarantined".into(), &attempts.into()),
            "{point}"
        );
        assert_eq!((&of("part.stl")["kind"], &of("part.stl")["attempts"]), (&"done".into(), &1.into()), "{point}");
    }
}
