//! F2: the process is killed at random, also while it opens; whatever it said to be durable is there afterwards.
//!
//! The test starts its own binary again as the victim, which drains made-up jobs with three threads and prints a line after each
//! call that returned.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::Mutex;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use super::*;
use crate::id::Seq;
use crate::job::{Ending, Kind, Testimony};
use crate::testkit::{dropped, result_of};

const VICTIM: &str = "SUTURE_STORE_TEST_VICTIM";

/// What the victim says: a job's number, the transition, its kind.
fn say(job: &Job) {
    static TURN: Mutex<()> = Mutex::new(());
    let _turn = TURN.lock().unwrap();
    let mut out = std::io::stdout();
    writeln!(out, "\nsaid {} {} {}", job.id, job.seq, job.kind()).unwrap();
    out.flush().unwrap();
}

fn victim(state: &Path) {
    let store = SledStore::open(state).unwrap();
    for one in store.recover(&|_| Testimony::Outlived).unwrap() {
        say(&one.job);
        if let Some(claim) = &one.claim {
            finish(&store, claim, one.job.kind());
        }
    }
    let epoch = store.opening().epoch;
    std::thread::scope(|scope| {
        for thread in 0..3 {
            let store = &store;
            scope.spawn(move || drain(store, &format!("{epoch}-{thread}")));
        }
    });
}

/// Submits, claims and finishes until 40 rounds are done.
fn drain(store: &SledStore, prefix: &str) {
    for round in 0..40 {
        let found: Vec<_> = (0..3).map(|at| dropped(&format!("{prefix}-{round}-{at}.stl"), at).unwrap()).collect();
        for submitted in store.submit(&found).unwrap() {
            say(&store.get(submitted.id).unwrap().unwrap());
        }
        for at in 0..2 {
            let Some(claim) = store.claim(&Filter::default()).unwrap() else { continue };
            say(&claim.job);
            if at == 1 && round % 4 == 0 {
                say(&store.advance(&claim, Step::HandBack).unwrap());
            } else {
                say(&store.advance(&claim, Step::Intend(result_of(&claim.job, Ending::Clean))).unwrap());
                finish(store, &claim, Kind::Publishing);
            }
        }
    }
}

fn finish(store: &SledStore, claim: &Claim, from: Kind) {
    if from == Kind::Publishing {
        say(&store.advance(claim, Step::Placed).unwrap());
    }
    say(&store.advance(claim, Step::Finished).unwrap());
}

fn start(state: &Path) -> Command {
    let mut command = Command::new(std::env::current_exe().unwrap());
    let test = "sled_store::kill_tests::f02_whatever_was_acknowledged_survives_a_kill";
    command.args(["--exact", test, "--nocapture"]).env(VICTIM, state).stdout(Stdio::piped()).stderr(Stdio::null());
    command
}

type Said = BTreeMap<u64, (u64, String)>;

fn ears(child: &mut Child) -> BufReader<ChildStdout> {
    BufReader::new(child.stdout.take().unwrap())
}

/// What the victim says, up to `most` lines or until it ends, as job → (transition, kind).
fn listen(ears: &mut BufReader<ChildStdout>, most: usize, said: &mut Said) -> usize {
    let mut lines = 0;
    let mut line = String::new();
    while lines < most {
        line.clear();
        // The kill may have cut the last line.
        if ears.read_line(&mut line).unwrap() == 0 || !line.ends_with('\n') {
            break;
        }
        let Some(words) = line.trim_end().strip_prefix("said ") else { continue };
        let words: Vec<&str> = words.split(' ').collect();
        let [id, seq, kind] = words[..] else { panic!("{line:?}") };
        lines += 1;
        let (id, seq) = (id.parse().unwrap(), seq.parse().unwrap());
        let known = said.entry(id).or_insert((0, String::new()));
        if seq > known.0 {
            *known = (seq, kind.to_owned());
        }
    }
    lines
}

/// Looks at every record, opens the store and looks for everything that was said.
fn check(state: &Path, said: &Said) {
    assert_eq!(SledStore::verify(state).unwrap().wrong, Vec::<String>::new());
    let store = SledStore::open(state).unwrap();
    assert_eq!(store.opening().set_aside, None, "a kill does not damage the database");
    let jobs: BTreeMap<u64, Job> = store.list(&Query::default()).unwrap().into_iter().map(|job| (job.id.0, job)).collect();
    for (id, (seq, kind)) in said {
        let job = jobs.get(id).unwrap_or_else(|| panic!("job {id}, {kind}, is gone"));
        assert!(job.seq >= Seq(*seq), "job {id} was {kind} at {seq}, but the store knows it at {}", job.seq);
        if job.seq == Seq(*seq) {
            assert_eq!(job.kind().name(), kind, "job {id}");
        }
    }
}

#[test]
fn f02_whatever_was_acknowledged_survives_a_kill() {
    if let Some(state) = std::env::var_os(VICTIM) {
        return victim(Path::new(&state));
    }
    let state = tempfile::tempdir().unwrap();
    let mut said = Said::new();
    // A small linear congruence: enough to spread the kills, and the seed says which.
    let seed = u64::from(SystemTime::now().duration_since(UNIX_EPOCH).unwrap().subsec_nanos());
    println!("seed {seed}");
    let mut random = seed;
    let (mut lines, mut in_opening) = (0, 0);
    for kill in 0..40 {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let mut child = start(state.path()).spawn().unwrap();
        let mut ears = ears(&mut child);
        // Every third kill comes while the victim works, the others within the first milliseconds, when it opens.
        let working = kill % 3 == 0;
        let mut heard = if working { listen(&mut ears, 1, &mut said) } else { 0 };
        std::thread::sleep(Duration::from_micros((random >> 33) % if working { 100_000 } else { 25_000 }));
        child.kill().unwrap();
        heard += listen(&mut ears, usize::MAX, &mut said);
        child.wait().unwrap();
        lines += heard;
        in_opening += usize::from(heard == 0);
        // Before another life of the victim hides what was lost under new transitions; but not after every kill, since kills that
        // meet what an earlier one left are wanted, too.
        if heard > 0 || kill % 5 == 4 {
            check(state.path(), &said);
        }
    }
    println!("{lines} transitions acknowledged, {in_opening} kills before the first");
    assert!(lines > 0 && in_opening > 0, "the kills missed what they were aimed at");
}

/// A kill while the database is made: nothing was acknowledged, so that a torn one may be set aside, but it must open.
#[test]
fn f02_a_store_that_was_never_finished_opens() {
    let folder = tempfile::tempdir().unwrap();
    for kill in 0..30 {
        let state = folder.path().join(kill.to_string());
        let mut said = Said::new();
        let mut child = start(&state).spawn().unwrap();
        let mut ears = ears(&mut child);
        // From before the folder is there until the store is open, which the victim says.
        while !state.exists() && child.try_wait().unwrap().is_none() {
            std::thread::yield_now();
        }
        std::thread::sleep(Duration::from_micros(kill * 500));
        child.kill().unwrap();
        listen(&mut ears, usize::MAX, &mut said);
        child.wait().unwrap();
        let store = SledStore::open(&state).unwrap();
        let jobs = store.list(&Query::default()).unwrap();
        assert!(jobs.len() >= said.len(), "{} of {} jobs after kill {kill}", jobs.len(), said.len());
        assert!(said.is_empty() || store.opening().set_aside.is_none());
    }
}

/// F1 for the store: every crash point that an ordinary run passes, the first and a later time, on one state after another.
#[cfg(feature = "crash-points")]
#[test]
fn f01_every_crash_point_leaves_a_store_that_opens() {
    let folder = tempfile::tempdir().unwrap();
    let trace = folder.path().join("trace");
    let first = folder.path().join("first");
    let done = start(&first).env("SUTURE_CRASH_TRACE", &trace).stdout(Stdio::null()).status().unwrap();
    assert!(done.success());
    let mut points: BTreeMap<String, u64> = BTreeMap::new();
    for line in std::fs::read_to_string(&trace).unwrap().lines() {
        *points.entry(line.to_owned()).or_default() += 1;
    }
    assert!(points.contains_key("store.open.epoch") && points.contains_key("store.sync.flushed"), "{points:?}");
    let state = folder.path().join("state");
    let mut said = Said::new();
    for (name, passes) in points {
        for pass in [1, 2, 17].into_iter().filter(|pass| *pass <= passes) {
            let mut child = start(&state).env("SUTURE_CRASH_AT", format!("{name}:{pass}")).spawn().unwrap();
            listen(&mut ears(&mut child), usize::MAX, &mut said);
            assert!(!child.wait().unwrap().success(), "{name} was not reached {pass} times");
        }
        check(&state, &said);
    }
}
