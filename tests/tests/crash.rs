//! The daemon killed at every step of its protocol, at pairs of steps, and at random: whatever happens, each dropped file ends in
//! exactly one place with exactly one result, the same as without the kill, and no file is blamed.
//!
//! `SUTURE_EXHAUSTIVE=1` tries every pair of steps and the full number of random kills.

#[path = "crash/approved.rs"]
mod approved;
#[path = "crash/carried.rs"]
mod carried;
#[path = "crash/deaths.rs"]
mod deaths;
#[path = "crash/lost.rs"]
mod lost;
#[path = "crash/sampled.rs"]
mod sampled;
#[path = "crash/share.rs"]
mod share;
#[path = "crash/shared.rs"]
mod shared;
#[path = "crash/taken.rs"]
mod taken;
#[path = "crash/told.rs"]
mod told;

use std::collections::BTreeMap;
use std::os::unix::process::ExitStatusExt;
use std::process::{Child, Command, ExitStatus};
use std::time::{Duration, Instant};

use serde_json::Value;
use suture_bench::generate::Case;
use suture_tests::Place;
use suture_tests::binary::with_crash_points;
use suture_tests::hot::{Hot, Tree, mesh};

const PARTS: [&str; 4] = ["out", "done", "failed", "quarantine"];

fn exhaustive() -> bool {
    std::env::var_os("SUTURE_EXHAUSTIVE").is_some()
}

/// Everything that is to be the same with and without kills: names of all files, and the meshes' bytes. Reports and receipts
/// tell of times and attempts.
fn state(hot: &Hot) -> BTreeMap<&'static str, Tree> {
    let mut parts: BTreeMap<_, _> = PARTS.iter().chain(&["in"]).map(|part| (*part, hot.tree(part))).collect();
    for (name, bytes) in parts.values_mut().flatten() {
        if name.ends_with(".json") {
            serde_json::from_slice::<Value>(bytes).unwrap_or_else(|e| panic!("{name} is not whole: {e}"));
            bytes.clear();
        }
    }
    parts
}

/// Nothing is left over, nothing is open, and no file is blamed.
fn assert_at_rest(hot: &Hot, what: &str) {
    assert_eq!(hot.tree(".suture/work"), Tree::new(), "{what}: left-overs");
    for job in hot.jobs() {
        let kind = job["kind"].as_str().expect("a kind");
        assert!(matches!(kind, "done" | "carried" | "failed" | "needs_review"), "{what}: {job}");
        assert_eq!(job["blame"]["charges"], 0, "{what}: {job}");
    }
}

/// No file was taken into work more often than the kills explain.
fn assert_attempts(hot: &Hot, kills: u64, what: &str) {
    for job in hot.jobs() {
        assert!(job["attempts"].as_u64().is_some_and(|attempts| attempts <= 1 + kills), "{what}: {job}");
    }
}

/// One file that is repaired, in a sub-folder; one that cannot be read.
fn drop_two(hot: &Hot) {
    hot.put("scan/holes.stl", &mesh(Case::Holes, 1));
    hot.put("picture.stl", b"\x89PNG\r\n\x1a\nendsolid");
}

fn drop_one(hot: &Hot) {
    hot.put("part.stl", &mesh(Case::Clean, 1));
}

/// Runs the daemon over the folder; how it ends, and the crash points it passes, a line each.
fn traced(hot: &Hot, mut daemon: Command) -> (ExitStatus, String) {
    let trace = hot.path().join("trace");
    let status = daemon.env("SUTURE_CRASH_TRACE", &trace).status().expect("the daemon starts");
    let passed = std::fs::read_to_string(&trace).expect("a trace");
    std::fs::remove_file(trace).expect("it can go");
    (status, passed)
}

/// The state after a run without kills, and the number of crash points it passes.
fn reference(put: fn(&Hot)) -> (BTreeMap<&'static str, Tree>, u64) {
    let hot = Hot::new(with_crash_points());
    put(&hot);
    let (status, trace) = traced(&hot, hot.watch(&["--once"]));
    assert!(status.code().is_some_and(|code| code < 2), "{status}");
    for point in
        ["submitted", "claimed", "linked", "worked", "result_durable", "intent_durable", "report_placed", "done", "swept"]
    {
        assert!(trace.contains(&format!("daemon.{point}\n")), "no run passes {point}");
    }
    assert_at_rest(&hot, "reference");
    (state(&hot), trace.lines().count() as u64)
}

/// Works through `cases` on two threads, as the machine has little else to do while the daemon syncs.
fn on_two_threads<T: Sync>(cases: &[T], run: impl Fn(&T) + Sync) {
    let next = std::sync::atomic::AtomicUsize::new(0);
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                while let Some(case) = cases.get(next.fetch_add(1, std::sync::atomic::Ordering::Relaxed)) {
                    run(case);
                }
            });
        }
    });
}

fn was_killed(status: ExitStatus) -> bool {
    status.signal() == Some(9)
}

#[test]
fn f01_killed_at_every_step() {
    let (expected, passes) = reference(drop_two);
    let steps: Vec<u64> = (1..=passes).collect();
    on_two_threads(&steps, |&step| {
        let hot = Hot::new(with_crash_points());
        drop_two(&hot);
        killed_at(&hot, (step, passes), &expected);
    });
}

/// Kills the daemon at a pass of so many, and lets the next one finish.
fn killed_at(hot: &Hot, (step, passes): (u64, u64), expected: &BTreeMap<&'static str, Tree>) {
    let what = format!("killed at pass {step} of {passes}");
    let killed = was_killed(hot.once(Some(step)));
    // The order of two jobs is not the same in every run; the last passes may not be reached.
    assert!(killed || step + 8 > passes, "{what}: was not");
    assert!(hot.once(None).code().is_some_and(|code| code < 2), "{what}: the next run fails");
    assert_eq!(state(hot), *expected, "{what}");
    assert_at_rest(hot, &what);
    assert_attempts(hot, 1, &what);
}

/// A folder in which one result is in place, and a file of the same content has been dropped.
fn drop_a_second(hot: &Hot) {
    drop_one(hot);
    assert_eq!(hot.once(None).code(), Some(0), "the first is done");
    hot.put("again/second.stl", &mesh(Case::Clean, 1));
}

/// The result is copied, not computed; wherever the daemon dies, it is there once, and the first one is as it was.
#[test]
fn f01_killed_at_every_step_of_a_copy() {
    let hot = Hot::new(with_crash_points());
    drop_a_second(&hot);
    let (status, trace) = traced(&hot, hot.watch(&["--once"]));
    assert_eq!(status.code(), Some(0));
    assert!(trace.contains("daemon.reused\n") && !trace.contains("daemon.worked\n"), "{trace}");
    let (expected, passes) = (state(&hot), trace.lines().count() as u64);
    assert_eq!(expected["out"]["again/second.stl"], expected["out"]["part.stl"]);
    let steps: Vec<u64> = (1..=passes).collect();
    on_two_threads(&steps, |&step| {
        let hot = Hot::new(with_crash_points());
        drop_a_second(&hot);
        let what = format!("killed at pass {step} of {passes}");
        let killed = was_killed(hot.once(Some(step)));
        assert!(killed || step + 8 > passes, "{what}: was not");
        assert_eq!(hot.once(None).code(), Some(0), "{what}: the next run fails");
        assert_eq!(state(&hot), expected, "{what}");
        assert_at_rest(&hot, &what);
        assert_attempts(&hot, 1, &what);
        let copied = hot.jobs().iter().filter(|job| job["reused"] == 1).count();
        assert_eq!((copied, hot.jobs().len()), (1, 2), "{what}: it was not copied");
    });
}

#[test]
fn f01_killed_at_pairs_of_steps() {
    let (expected, passes) = reference(drop_one);
    let pairs: Vec<(u64, u64)> = (1..=passes)
        .flat_map(|first| (1..=passes).map(move |second| (first, second)))
        .filter(|(first, second)| exhaustive() || (first * 5 + second * 3) % 11 == 0)
        .collect();
    on_two_threads(&pairs, |&pair| {
        let hot = Hot::new(with_crash_points());
        drop_one(&hot);
        killed_twice_at(&hot, pair, &expected);
    });
}

/// Kills the daemon at a pass, the next one at another, and lets the third finish.
fn killed_twice_at(hot: &Hot, (first, second): (u64, u64), expected: &BTreeMap<&'static str, Tree>) {
    let what = format!("killed at pass {first}, then at pass {second}");
    for step in [first, second] {
        // A run that has less to do than that many passes ends by itself.
        hot.once(Some(step));
    }
    assert_eq!(hot.once(None).code(), Some(0), "{what}: the last run fails");
    assert_eq!(state(hot), *expected, "{what}");
    assert_at_rest(hot, &what);
    assert_attempts(hot, 2, &what);
}

/// A small generator of numbers (xorshift), so that a failing run can be repeated from its seed.
struct Dice(u64);

impl Dice {
    fn below(&mut self, bound: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 % bound
    }
}

fn kill(pid: u32) {
    let pid = rustix::process::Pid::from_raw(pid.cast_signed()).expect("a process number");
    // It may have ended by itself.
    let _ = rustix::process::kill_process(pid, rustix::process::Signal::KILL);
}

/// Worker processes of a daemon.
fn workers(daemon: &Child) -> Vec<u32> {
    let tasks = std::fs::read_dir(format!("/proc/{}/task", daemon.id())).into_iter().flatten().flatten();
    tasks
        .filter_map(|task| std::fs::read_to_string(task.path().join("children")).ok())
        .flat_map(|list| list.split_whitespace().filter_map(|pid| pid.parse().ok()).collect::<Vec<u32>>())
        .collect()
}

/// What is killed.
#[derive(Clone, Copy, Debug)]
enum Victim {
    Daemon,
    Worker,
    /// Daemon and workers in the same instant, as a power cut would: no one is left to testify.
    All,
    /// The daemon, some milliseconds after its start.
    Starting,
}

impl Victim {
    /// Kills; returns the daemon that runs afterwards.
    fn kill(self, mut daemon: Child, hot: &Hot, dice: &mut Dice) -> Child {
        let running = workers(&daemon);
        match self {
            Self::Worker => {
                if let Some(pid) = running.get(dice.below(running.len().max(1) as u64) as usize) {
                    kill(*pid);
                }
                return daemon;
            }
            Self::All => running.into_iter().chain([daemon.id()]).for_each(kill),
            Self::Daemon | Self::Starting => kill(daemon.id()),
        }
        daemon.wait().expect("a child can be waited for");
        if matches!(self, Self::Starting) {
            let mut starting = hot.start();
            std::thread::sleep(Duration::from_micros(dice.below(20_000)));
            kill(starting.id());
            starting.wait().expect("a child can be waited for");
        }
        hot.start()
    }
}

/// F2, and F3: small files and some that take a third of a second, while the daemon and its workers are killed again and again: no file is
/// blamed, and none ends twice. `SUTURE_KILLS` sets how many kills there are, `SUTURE_SEED` which.
#[test]
fn f02_killed_at_random() {
    let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse::<u64>().ok());
    let kills = number("SUTURE_KILLS").unwrap_or(if exhaustive() { 10_000 } else { 24 });
    let seed = number("SUTURE_SEED").unwrap_or(0x5EED);
    let mut dice = Dice(seed);
    let hot = Hot::new(with_crash_points());
    let name = |i: u64| if i.is_multiple_of(4) { format!("part{i}!slow!.stl") } else { format!("part{i}.stl") };
    let originals: BTreeMap<String, Vec<u8>> = (0..(kills / 10).max(10)).map(|i| (name(i), mesh(Case::Clean, i))).collect();
    let started = Instant::now();
    let mut waiting = originals.iter();
    let mut daemon = hot.start();
    for kill in 0..kills {
        // Ten kills to a file, so that there is always some work.
        if kill % 10 == 0 {
            waiting.by_ref().take(1).for_each(|(name, bytes)| hot.put(name, bytes));
        }
        std::thread::sleep(Duration::from_millis(dice.below(120)));
        if let Some(status) = daemon.try_wait().unwrap() {
            panic!("seed {seed}, kill {kill}: the daemon ended by itself: {status}");
        }
        let victims = [Victim::Daemon, Victim::Worker, Victim::Worker, Victim::All, Victim::Starting];
        daemon = victims[dice.below(victims.len() as u64) as usize].kill(daemon, &hot, &mut dice);
    }
    waiting.for_each(|(name, bytes)| hot.put(name, bytes));
    let deadline = Instant::now() + Duration::from_secs(300);
    while hot.tree("done").len() < originals.len() {
        assert!(Instant::now() < deadline, "seed {seed}: {} of {} files are done", hot.tree("done").len(), originals.len());
        assert!(hot.tree("quarantine").is_empty(), "seed {seed}: an innocent file");
        std::thread::sleep(Duration::from_secs(1));
        // Files whose worker was killed again and again wait for minutes: an operator does not.
        for job in hot.jobs().iter().filter(|job| job["kind"] == "waiting") {
            hot.ask(&["retry", &job["id"].to_string()]);
        }
    }
    let pid = rustix::process::Pid::from_raw(daemon.id().cast_signed()).unwrap();
    rustix::process::kill_process(pid, rustix::process::Signal::TERM).unwrap();
    assert_eq!(daemon.wait().unwrap().code(), Some(0));
    assert_eq!(hot.tree("done"), originals);
    let out: Tree = hot.tree("out").into_iter().filter(|(name, _)| !name.ends_with(".json")).collect();
    assert_eq!(out, originals, "clean files appear byte for byte, once each");
    assert_eq!(listed_twice(&hot.jobs()), Vec::<String>::new(), "seed {seed}");
    assert_eq!(hot.jobs().len(), originals.len());
    assert!(hot.tree("quarantine").is_empty() && hot.tree("failed").is_empty(), "seed {seed}: an innocent file");
    assert_at_rest(&hot, "random kills");
    println!("seed {seed}: {kills} kills over {} drops in {:.0} s", originals.len(), started.elapsed().as_secs_f64());
}

/// Jobs of files that have more than one, whole.
fn listed_twice(jobs: &[Value]) -> Vec<String> {
    let is_twice = |job: &&Value| jobs.iter().filter(|other| other["source"]["path"] == job["source"]["path"]).count() > 1;
    jobs.iter().filter(is_twice).map(Value::to_string).collect()
}

/// F10, F11 and F12: files that abort their worker, hang in it, eat its memory, try to kill the daemon (which their worker may not), or whose
/// answer kills it: each is quarantined after a few attempts, and the others are repaired.
#[test]
fn f10_killers_are_quarantined_and_the_others_go_on() {
    let hot = Hot::new(with_crash_points());
    let killers = ["a!abort!.stl", "b!hang!.stl", "c!memory!.stl", "d!kill-daemon!.stl", "e!panic!.stl", "f!kill-parent!.stl"];
    let originals: Tree = killers.iter().map(|name| ((*name).to_owned(), mesh(Case::Holes, 1))).collect();
    for (name, bytes) in &originals {
        hot.put(name, bytes);
    }
    hot.put("part.stl", &mesh(Case::Holes, 2));
    let lines = "settle = \"30ms\"\nmemory = \"64MiB\"\ntime_limit = { base = \"1s\", per_gib = \"1s\" }";
    let mut daemon_deaths = 0;
    loop {
        let status = hot.configured(lines).status().unwrap();
        if !was_killed(status) {
            assert_eq!(status.code(), Some(1), "not everything is good");
            break;
        }
        daemon_deaths += 1;
        assert!(daemon_deaths <= 3, "a file may take the daemon with it once in company, and twice alone");
    }
    assert!(daemon_deaths == 3, "it did not try");
    let quarantine: Tree = hot.tree("quarantine").into_iter().filter(|(name, _)| !name.ends_with(".json")).collect();
    assert_eq!(quarantine, originals, "the files themselves are kept");
    assert_eq!(hot.tree("out").keys().collect::<Vec<_>>(), ["part.stl", "part.stl.report.json", "part.stl.suture.json"]);
    for name in killers {
        let report = &hot.tree("quarantine")[&format!("{name}.report.json")];
        let report: Value = serde_json::from_slice(report).unwrap();
        assert_eq!(report["outcome"], "quarantined", "{report}");
        assert!(report["attempts"].as_u64().is_some_and(|attempts| attempts <= 3 + 3), "{report}");
        assert!(name != "d!kill-daemon!.stl" || report["attempts"] == 3, "{report}");
        assert!(report["reason"].as_str().is_some_and(|reason| !reason.is_empty()), "{report}");
    }
}

/// On the command line, too, a file that kills its worker costs itself only, wherever it stands among the others.
#[test]
fn f12_killers_cost_themselves_only() {
    let place = Place::new();
    let names: Vec<String> = (0..30u64)
        .map(|k| match k {
            0 | 11 | 29 => format!("{k}!abort!.stl"),
            12 => format!("{k}!panic!.stl"),
            _ => format!("{k}.stl"),
        })
        .collect();
    for (seed, name) in (0..).zip(&names) {
        place.put(name, &mesh(Case::Holes, seed));
    }
    std::fs::create_dir(place.at("out")).expect("a folder for results");
    let mut command = Command::new(with_crash_points());
    command.current_dir(place.at("")).args(["repair", "--threads", "2", "-o", "out"]).args(&names).env("SUTURE_LOG", "off");
    let output = command.output().expect("the binary starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.lines().count() == 4 && said.lines().all(|line| line.contains('!')), "{said}");
    let mut good: Vec<_> = names.into_iter().filter(|name| !name.contains('!')).collect();
    good.sort();
    assert_eq!(place.names("out"), good);
}

/// Killed between any two steps of an original's way to the archive: it is whole in one place or the other, and in the end there once.
#[test]
fn killed_on_the_way_to_the_archive() {
    let keep = "settle = \"30ms\"\n[keep]\noriginals = \"0s\"\narchive = ";
    for point in ["retention.staged", "retention.archived", "retention.aside"] {
        let hot = Hot::new(with_crash_points());
        drop_one(&hot);
        assert!(hot.once(None).success());
        let archive = tempfile::tempdir().expect("a folder");
        std::fs::write(archive.path().join(".suture-archive"), b"").expect("a mark");
        let lines = format!("{keep}{:?}", archive.path());
        let status = hot.configured(&lines).env("SUTURE_CRASH_AT", format!("{point}:1")).status().expect("the daemon starts");
        assert!(was_killed(status), "{point}: {status}");
        let archived = || std::fs::read(archive.path().join(format!("{}/done/part.stl", name_of(&hot)))).ok();
        let whole = mesh(Case::Clean, 1);
        let copies = hot.tree("done").into_values().chain(archived()).filter(|bytes| *bytes == whole).count();
        assert!(copies > 0, "{point}: the original is lost");
        assert!(hot.configured(&lines).status().expect("the daemon starts").success(), "{point}");
        assert!(archived() == Some(whole), "{point}: it is not whole in the archive");
        assert_eq!(hot.tree("done").len(), 0, "{point}: it is here still");
        let left = std::fs::read_dir(archive.path().join(name_of(&hot)).join("done")).expect("a folder").count();
        assert_eq!(left, 1, "{point}: a stage is left");
        assert_at_rest(&hot, point);
    }
}

fn name_of(hot: &Hot) -> String {
    hot.path().file_name().expect("a name").to_string_lossy().into_owned()
}

/// Killed when the report of an earlier attempt has gone, and the new one is not there yet.
#[test]
fn killed_over_a_retry() {
    let hot = Hot::new(with_crash_points());
    hot.put("picture.stl", b"\x89PNG\r\n\x1a\nendsolid");
    assert_eq!(hot.once(None).code(), Some(1));
    let expected = state(&hot);
    assert!(hot.ask(&["retry", "1"]));
    let status = hot.watch(&["--once"]).env("SUTURE_CRASH_AT", "daemon.superseded:1").status().expect("the daemon starts");
    assert!(was_killed(status), "{status}");
    assert_eq!(hot.tree("failed").len(), 1, "the original is there");
    assert!(hot.once(None).code().is_some_and(|code| code < 2));
    assert_eq!(state(&hot), expected);
    assert_at_rest(&hot, "a retry");
}
