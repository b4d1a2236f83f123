//! The daemon and its workers with one system call that fails, at every call they make: whatever fails, no original is lost or
//! changed, nothing partial is seen, and once the fault is gone every file ends as it would have without it.
//!
//! * `SUTURE_EXHAUSTIVE=1` tries every fault of the plan; else a sample is tried, by the seed `SUTURE_SEED` (always the same one if there is none).
//! * `SUTURE_FAULT="daemon write 10 ENOSPC once"` tries that one.
//! * `SUTURE_ONLY="daemon write"` keeps the faults of the plan whose line begins so, `SUTURE_LANES` runs so many side by side.

#![cfg(all(target_os = "linux", target_arch = "x86_64"))]

#[path = "fault/inodes.rs"]
mod inodes;
#[path = "fault/plan.rs"]
mod plan;
#[path = "fault/reads.rs"]
mod reads;
#[path = "fault/sweep.rs"]
mod sweep;

use std::time::Duration;

use suture_tests::binary::suture;
use suture_tests::oracle::Expected;
use suture_tests::scene::{Scene, six, with_a_double};
use suture_tests::trace::count::Counter;
use suture_tests::trace::{Fault, run};

/// A run with a fault may pause and try again, and find out that its database hangs (some 15 s), but must end; a loaded machine may take its
/// time.
const LIMIT: Duration = Duration::from_secs(60);

#[test]
fn f08_any_call_may_fail() {
    let files = with_a_double(six());
    let expected = Expected::of(suture(), &files);
    assert_eq!(expected.good(), 5, "clean, its double, repaired, of another profile, of an odd name");
    if let Some(line) = std::env::var_os("SUTURE_FAULT") {
        let fault: Fault = line.to_str().expect("a line").parse().expect("a fault");
        let tried = sweep::try_one(&expected, &files, &fault);
        eprintln!("{tried:#?}");
        assert_eq!(tried.complaints, Vec::<String>::new());
        return;
    }
    let counts = count(&files);
    let plan = plan::choose(plan::all(&counts));
    let failures = sweep::sweep(&expected, &files, &plan);
    assert_eq!(failures, 0, "see the lines above");
}

/// A part of the folder that could not be looked at once counted as a file system that is gone, in this run and, as it was noted so, in
/// each one after it.
#[test]
fn f08_a_look_that_fails_at_the_start_is_no_absence() {
    let files = with_a_double(six());
    let failures = sweep::sweep(&Expected::of(suture(), &files), &files, &plan::first_looks());
    assert_eq!(failures, 0, "see the lines above");
}

/// Calls of an undisturbed run.
fn count(files: &suture_tests::scene::Files) -> plan::Counts {
    let scene = Scene::new(suture(), files);
    let mut counter = Counter::default();
    let ended = run(&scene.once(), &scene.errors(), LIMIT, &mut counter).expect("the daemon can be traced");
    assert_eq!((ended.status.code(), ended.left), (Some(1), 0), "{ended:?}");
    assert!(!counter.counts.is_empty(), "no call was counted");
    let jobs = scene.jobs().expect("jobs can be listed");
    assert!(jobs.iter().any(|job| job["reused"].is_u64()), "nothing was copied: {jobs:?}");
    eprintln!(
        "calls: {}",
        counter.counts.iter().map(|((role, kind), n)| format!("{role} {kind} {n}")).collect::<Vec<_>>().join(", ")
    );
    counter.counts
}
