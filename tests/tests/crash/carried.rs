//! The daemon killed at every step over an OBJ and the library that goes along with it: each is in its place in the end, once, byte for byte.

use std::collections::BTreeMap;

use suture_tests::binary::with_crash_points;
use suture_tests::forms::{self, Form};
use suture_tests::hot::{Hot, Tree};
use suture_tests::stl;

use crate::{assert_at_rest, assert_attempts, on_two_threads, state, traced, was_killed};

const LIBRARY: &[u8] = b"newmtl red\nKd 1 0 0\n";

/// What `out/` has of the library's name before.
const THERE: [Option<&[u8]>; 3] = [None, Some(LIBRARY), Some(b"theirs")];

fn dropped(there: Option<&[u8]>) -> Hot {
    let hot = Hot::new(with_crash_points());
    let mesh = forms::write(Form::Obj, &stl::cuboid([0.0; 3], [1.0; 3]));
    hot.put("part.obj", &[b"mtllib part.mtl\n", &mesh[..]].concat());
    hot.put("part.mtl", LIBRARY);
    if let Some(bytes) = there {
        std::fs::create_dir_all(hot.path().join("out")).expect("a folder");
        std::fs::write(hot.path().join("out/part.mtl"), bytes).expect("a file");
    }
    hot
}

/// The state after a run without kills, and the number of crash points it passes.
fn reference(there: Option<&[u8]>) -> (BTreeMap<&'static str, Tree>, u64) {
    let hot = dropped(there);
    let (status, trace) = traced(&hot, hot.watch(&["--once"]));
    assert_eq!(status.code(), Some(0));
    assert!(trace.contains("daemon.carried\n"), "{trace}");
    let state = state(&hot);
    let original = if there == Some(LIBRARY) { "part~2.mtl" } else { "part.mtl" };
    assert_eq!(state["done"][original], LIBRARY);
    let copy = if there == Some(b"theirs") { "part~2.mtl" } else { "part.mtl" };
    assert_eq!(state["out"][copy], LIBRARY);
    assert!(state["in"].is_empty() && state["out"].contains_key("part.obj"));
    (state, trace.lines().count() as u64)
}

#[test]
fn f01_killed_at_every_step_of_a_carried_file() {
    for there in THERE {
        let (expected, passes) = reference(there);
        let steps: Vec<u64> = (1..=passes).collect();
        on_two_threads(&steps, |&step| {
            let hot = dropped(there);
            let what = format!("killed at pass {step} of {passes}, {there:?}");
            assert!(was_killed(hot.once(Some(step))) || step + 8 > passes, "{what}: was not");
            assert_eq!(hot.once(None).code(), Some(0), "{what}: the next run fails");
            assert_eq!(state(&hot), expected, "{what}");
            assert_at_rest(&hot, &what);
            assert_attempts(&hot, 1, &what);
            assert_eq!(hot.jobs().len(), 2, "{what}: {:?}", hot.jobs());
        });
    }
}

/// Receipts tell the next daemon of both. A library whose OBJ is done, and of which nothing tells any more that it was to go along, stays where it was
/// dropped; it is not lost, and goes along when its OBJ comes again.
#[test]
fn f06_killed_at_every_step_of_a_carried_file_and_the_state_is_lost() {
    for there in THERE {
        let (expected, passes) = reference(there);
        let steps: Vec<u64> = (1..=passes).collect();
        on_two_threads(&steps, |&step| {
            let hot = dropped(there);
            let what = format!("killed at pass {step} of {passes}, {there:?}, and the state is lost");
            assert!(was_killed(hot.once(Some(step))) || step + 8 > passes, "{what}: was not");
            let jobs = hot.path().join(".suture/state");
            if jobs.exists() {
                std::fs::remove_dir_all(jobs).expect("the state can be removed");
            }
            assert_eq!(hot.once(None).code(), Some(0), "{what}: the next run fails");
            if hot.path().join("in/part.mtl").exists() {
                assert!(hot.path().join("done/part.obj").exists(), "{what}");
                assert_eq!(hot.tree("in")["part.mtl"], LIBRARY, "{what}");
                return;
            }
            assert_eq!(state(&hot), expected, "{what}");
            assert_at_rest(&hot, &what);
            assert_eq!(hot.jobs().len(), 2, "{what}: {:?}", hot.jobs());
        });
    }
}
