//! No dropped file is ever opened for writing, cut, or given another mode or time, whatever becomes of it.

use std::fs::OpenOptions;
use std::io::Write;
use std::process::Command;

use suture_tests::binary::suture;
use suture_tests::scene::{Scene, six};
use suture_tests::trace::inject::Injector;
use suture_tests::trace::journal::{Act, Journal};
use suture_tests::trace::{Eyes, Next, Role, Stop, run};

use crate::LIMIT;

const NO_FAULT: &str = "no fault";

/// Writes a journal, makes a call fail, and does something whenever a worker is about to make its result.
struct Meddler<'a> {
    journal: Journal,
    fault: Option<Injector>,
    act: &'a mut dyn FnMut(&Stop),
}

impl Eyes for Meddler<'_> {
    fn numbers(&self) -> Vec<i64> {
        self.journal.numbers()
    }

    fn before(&mut self, stop: &Stop) -> Next {
        if stop.role == Role::Worker && stop.kind().is_some_and(|kind| kind.name == "create") {
            (self.act)(stop);
        }
        if let Some(fault) = &mut self.fault
            && let Next::Fail(errno) = fault.before(stop)
        {
            return Next::Fail(errno);
        }
        self.journal.before(stop)
    }

    fn after(&mut self, stop: &Stop) -> Option<libc::user_regs_struct> {
        self.journal.after(stop)
    }
}

/// Runs the command; fails if it touched any file that lies in the folder now, wherever the daemon had put it.
fn assert_untouched(scene: &Scene, command: &Command, fault: Option<&str>, act: &mut dyn FnMut(&Stop)) {
    let what = fault.unwrap_or(NO_FAULT);
    let fault = fault.map(|line| Injector::new(line.parse().expect("a fault")));
    let mut meddler = Meddler { journal: Journal::new(scene.path()), fault, act };
    let originals = ["in", "done", "failed", "quarantine"];
    let ended = run(command, &scene.errors(), LIMIT, &mut meddler).expect("the daemon can be traced");
    // How a run with a fault ends is another test's matter.
    assert!(what != NO_FAULT || ended.status.code().is_some_and(|code| code < 2), "{ended:?}");
    let Journal { acts, inputs, .. } = meddler.journal;
    let wrote = acts.iter().any(|act| matches!(act, Act::OpenedForWriting(_)));
    // A fault may end a run before it has begun.
    assert!(what != NO_FAULT || wrote, "the store at least is written to");
    for act in &acts {
        let (Act::OpenedForWriting(file)
        | Act::MappedForWriting(file)
        | Act::Touched(file)
        | Act::Write { file, .. }
        | Act::Resize { file, .. }) = act
        else {
            continue;
        };
        let touched = inputs.iter().find(|(path, id)| *id == file && originals.iter().any(|area| path.starts_with(area)));
        assert_eq!(touched, None, "{what}: {act:?}");
    }
}

fn kinds(scene: &Scene) -> Vec<String> {
    let jobs = scene.jobs().expect("jobs can be listed");
    jobs.iter().map(|job| job["kind"].as_str().unwrap_or_default().to_owned()).collect()
}

fn with_kind(scene: &Scene, kind: &str) -> Vec<String> {
    let jobs = scene.jobs().expect("jobs can be listed");
    jobs.iter().filter(|job| job["kind"] == kind).map(|job| job["id"].to_string()).collect()
}

/// Clean, repaired, not good and unreadable; then the same names once more; then retried from `failed/`.
#[test]
fn no_input_inode_is_opened_for_writing() {
    let scene = Scene::new(suture(), &six());
    assert_untouched(&scene, &scene.once(), None, &mut |_| {});
    assert!(kinds(&scene).iter().all(|kind| kind == "done" || kind == "failed"), "{:?}", kinds(&scene));
    scene.drop_all(&six());
    assert_untouched(&scene, &scene.once(), None, &mut |_| {});
    let failed = with_kind(&scene, "failed");
    assert_eq!(failed.len(), 4, "two that cannot be good, twice");
    for id in failed {
        assert_untouched(&scene, &scene.jobs_command(&["retry", &id]), None, &mut |_| {});
    }
    assert_untouched(&scene, &scene.once(), None, &mut |_| {});
    assert_eq!(with_kind(&scene, "failed").len(), 4);
}

/// Files that kill every worker.
#[test]
fn no_input_inode_is_opened_for_writing_in_quarantine() {
    let scene = Scene::new(suture(), &six());
    assert_untouched(&scene, &scene.once(), None, &mut |stop| {
        // SAFETY: no pointers; a traced thread.
        unsafe { libc::kill(stop.thread, libc::SIGSEGV) };
    });
    assert!(with_kind(&scene, "quarantined").len() >= 3, "{:?}", kinds(&scene));
}

/// F8: errors on the way of a result into its place, and one of a worker: its job waits, and is cancelled.
#[test]
fn f08_no_input_inode_is_opened_for_writing_after_errors() {
    for call in ["fsync", "create", "open", "rename"] {
        for n in [5, 8, 11, 14, 17, 20] {
            let scene = Scene::new(suture(), &six());
            assert_untouched(&scene, &scene.once(), Some(&format!("daemon {call} {n} EIO once")), &mut |_| {});
        }
    }
    let scene = Scene::new(suture(), &six());
    assert_untouched(&scene, &scene.once(), Some("worker create 1 EIO on"), &mut |_| {});
    let waiting = with_kind(&scene, "waiting");
    assert!(!waiting.is_empty(), "{:?}", kinds(&scene));
    for id in waiting {
        assert_untouched(&scene, &scene.jobs_command(&["cancel", &id]), None, &mut |_| {});
    }
    assert_untouched(&scene, &scene.once(), None, &mut |_| {});
}

/// F22: files that change while they are worked on.
#[test]
fn f22_no_input_inode_is_opened_for_writing_when_it_changes() {
    let scene = Scene::new(suture(), &six());
    let changed = scene.path().join("in/clean.stl");
    let mut times = 0;
    assert_untouched(&scene, &scene.once(), None, &mut |_| {
        times += 1;
        if times <= 2 && changed.exists() {
            let mut file = OpenOptions::new().append(true).open(&changed).expect("the file can be opened");
            file.write_all(&[0; 50]).expect("the file can be written");
        }
    });
    assert!(times > 2);
    assert!(kinds(&scene).iter().any(|kind| kind == "cancelled"), "it was taken back: {:?}", kinds(&scene));
}
