//! Tries faults and sums up what came of them.

use std::collections::BTreeMap;
use std::os::unix::process::ExitStatusExt;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use suture_tests::binary::suture;
use suture_tests::oracle::Expected;
use suture_tests::scene::{Files, Scene};
use suture_tests::trace::inject::Injector;
use suture_tests::trace::{Ended, Fault, When, run};

use crate::LIMIT;

/// What came of a fault.
#[derive(Debug)]
pub(crate) struct Tried {
    /// How often it happened: a fault behind the last call never does.
    pub hits: u64,
    pub code: Option<i32>,
    #[expect(dead_code, reason = "shown when one fault is tried")]
    pub errors: String,
    pub took: Duration,
    pub complaints: Vec<String>,
}

/// Runs the daemon over the files with a fault, then without.
pub(crate) fn try_one(expected: &Expected, files: &Files, fault: &Fault) -> Tried {
    let start = Instant::now();
    let scene = Scene::new(suture(), files);
    let mut injector = Injector::new(fault.clone());
    let ended = run(&scene.once(), &scene.errors(), LIMIT, &mut injector).expect("the daemon can be traced");
    let mut complaints = judge_end(&ended, fault);
    if ended.status.code() == Some(0) {
        complaints.push("silent: the run ended with 0, though two files cannot be good".into());
    }
    complaints.extend(expected.judge_now(&scene).into_iter().map(|line| format!("at once: {line}")));
    complaints.extend(scene.come_to_rest().err());
    if fault.when != When::Once {
        // What fails for long may cost a file its tries; an operator then tries again.
        let blamed = expected.ended_otherwise(&scene);
        if !blamed.is_empty() {
            complaints.push(format!("blamed: {} files ended otherwise for a fault of the machine", blamed.len()));
            complaints.extend(scene.retry(&blamed).err());
        }
    }
    complaints.extend(expected.judge(&scene));
    Tried { hits: injector.hits, code: ended.status.code(), errors: ended.errors, took: start.elapsed(), complaints }
}

/// A run ends by itself, by one of the documented codes, and says why if it could not work.
fn judge_end(ended: &Ended, fault: &Fault) -> Vec<String> {
    let mut complaints = Vec::new();
    if let Some(threads) = &ended.stuck {
        return vec![format!("stuck: no end within {} s: {threads}", LIMIT.as_secs())];
    }
    if ended.left > 0 {
        complaints.push(format!("process left: {} outlived the daemon", ended.left));
    }
    let said = ended.errors.trim();
    match ended.status.code() {
        Some(0 | 1) => {}
        Some(2 | 73 | 75) if !said.is_empty() || fault.silences() => {}
        Some(code @ (2 | 73 | 75)) => complaints.push(format!("exit: {code} without a reason")),
        Some(101) => complaints.push(format!("panic: {said}")),
        Some(code) => complaints.push(format!("exit: {code}: {said}")),
        None if ended.status.signal() == Some(libc::SIGABRT) && fault.justifies_abort() => {}
        None => complaints.push(format!("exit: {}: {said}", ended.status)),
    }
    // The standard library itself panics where a new thread gets no memory; sled where the disk or the system fails it, which the store
    // catches and takes for an error.
    let caught = said.contains("/sled-") && ended.status.code().is_some_and(|code| code != 101);
    if said.contains("panicked at") && ended.status.code() != Some(101) && !caught && !fault.justifies_abort() {
        complaints.push(format!("panic: {said}"));
    }
    complaints
}

/// Tries all, some side by side; prints a line for each that is not withstood, and a summary. How many those are.
pub(crate) fn sweep(expected: &Expected, files: &Files, plan: &[Fault]) -> usize {
    let lanes = std::env::var("SUTURE_LANES").ok().and_then(|lanes| lanes.parse().ok()).unwrap_or(2_usize);
    let start = Instant::now();
    let next = AtomicUsize::new(0);
    let seen = Mutex::new(Summary::default());
    std::thread::scope(|scope| {
        for _ in 0..lanes {
            scope.spawn(|| {
                while let Some(fault) = plan.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let tried = try_one(expected, files, fault);
                    seen.lock().expect("no lane panics with the lock").add(fault, &tried);
                }
            });
        }
    });
    let seen = seen.into_inner().expect("no lane panics with the lock");
    seen.print(start.elapsed());
    seen.failures
}

#[derive(Default)]
struct Summary {
    runs: usize,
    reached: usize,
    failures: usize,
    slow: Vec<(Duration, String)>,
    codes: BTreeMap<String, usize>,
    /// Of each class of complaint: how many, and the first.
    classes: BTreeMap<String, (usize, String)>,
}

impl Summary {
    fn add(&mut self, fault: &Fault, tried: &Tried) {
        self.runs += 1;
        self.reached += usize::from(tried.hits > 0);
        *self.codes.entry(tried.code.map_or("signal".into(), |code| code.to_string())).or_default() += 1;
        if tried.took > Duration::from_secs(10) {
            self.slow.push((tried.took, fault.to_string()));
        }
        if tried.complaints.is_empty() {
            return;
        }
        self.failures += 1;
        let shown: Vec<String> =
            tried.complaints.iter().map(|line| line.replace('\n', " | ").chars().take(300).collect()).collect();
        eprintln!("SUTURE_FAULT=\"{fault}\" code {:?}: {}", tried.code, shown.join("; "));
        for line in shown {
            let class = line.splitn(3, ": ").take(if line.starts_with("at once") { 2 } else { 1 }).collect::<Vec<_>>().join(": ");
            let entry = self.classes.entry(class).or_insert_with(|| (0, fault.to_string()));
            entry.0 += 1;
        }
    }

    fn print(&self, took: Duration) {
        eprintln!("{} runs ({} reached their fault) in {:.0?}, {} not withstood", self.runs, self.reached, took, self.failures);
        eprintln!("exit codes: {:?}", self.codes);
        for (class, (count, first)) in &self.classes {
            eprintln!("{count:>6} × {class}, e.g. SUTURE_FAULT=\"{first}\"");
        }
        for (took, line) in &self.slow {
            eprintln!("slow: {took:.1?} {line}");
        }
    }
}
