//! The daemon killed at every step of publishing what a person approved: the bytes that were judged appear once and whole, and nothing is lost.

use std::collections::BTreeMap;

use suture_tests::binary::with_crash_points;
use suture_tests::hot::{Hot, Tree, doubtful};

use crate::{assert_at_rest, exhaustive, on_two_threads, state, traced, was_killed};

/// A folder in which one file needs review, and a person has approved its best attempt; that.
fn approved() -> (Hot, Vec<u8>) {
    let hot = Hot::new(with_crash_points());
    hot.put("part.stl", &doubtful());
    assert_eq!(hot.once(None).code(), Some(1), "a person must look");
    let best = hot.tree("failed").remove("part.best.stl").expect("a best attempt");
    assert!(hot.ask(&["approve", "1", "--as", "Ada", "--note", "looks right"]));
    (hot, best)
}

/// The state after a run without kills, and the number of crash points it passes.
fn reference() -> (BTreeMap<&'static str, Tree>, u64) {
    let (hot, best) = approved();
    let (status, trace) = traced(&hot, hot.watch(&["--once"]));
    assert_eq!(status.code(), Some(0));
    for point in
        ["approved_copied", "superseded", "result_durable", "intent_durable", "output_placed", "original_durable", "done"]
    {
        assert!(trace.contains(&format!("daemon.{point}\n")), "no run passes {point}");
    }
    assert!(!trace.contains("daemon.worked\n"), "nothing is computed");
    let expected = state(&hot);
    assert_eq!(expected["out"]["part.stl"], best);
    assert_eq!(expected["done"]["part.stl"], doubtful());
    assert!(expected["failed"].is_empty() && expected["in"].is_empty());
    assert_at_rest(&hot, "reference");
    (expected, trace.lines().count() as u64)
}

fn killed_at(steps: &[u64], passes: u64, expected: &BTreeMap<&'static str, Tree>) {
    let (hot, _) = approved();
    let what = format!("killed at passes {steps:?} of {passes}");
    for (number, step) in steps.iter().enumerate() {
        let killed = was_killed(hot.once(Some(*step)));
        assert!(killed || number > 0 || step + 8 > passes, "{what}: was not");
        // Whatever is there is whole: nobody sees a part of it.
        let seen = hot.tree("out").remove("part.stl");
        assert!(seen.is_none_or(|bytes| bytes == expected["out"]["part.stl"]), "{what}");
    }
    assert_eq!(hot.once(None).code(), Some(0), "{what}: the last run fails");
    assert_eq!(&state(&hot), expected, "{what}");
    assert_at_rest(&hot, &what);
    let jobs = hot.jobs();
    assert_eq!((jobs.len(), &jobs[0]["kind"], &jobs[0]["attempts"]), (1, &"done".into(), &1.into()), "{what}");
    let decision = &jobs[0]["state"]["ended"]["publication"]["decision"];
    assert_eq!((&decision["verdict"], &decision["by"]), (&"approved".into(), &"Ada".into()), "{what}");
}

#[test]
fn f01_killed_at_every_step_of_an_approval() {
    let (expected, passes) = reference();
    let steps: Vec<u64> = (1..=passes).collect();
    on_two_threads(&steps, |&step| killed_at(&[step], passes, &expected));
}

#[test]
fn f01_killed_at_pairs_of_steps_of_an_approval() {
    let (expected, passes) = reference();
    let pairs: Vec<[u64; 2]> = (1..=passes)
        .flat_map(|first| (1..=passes).map(move |second| [first, second]))
        .filter(|[first, second]| exhaustive() || (first * 5 + second * 3) % 17 == 0)
        .collect();
    on_two_threads(&pairs, |pair| killed_at(pair, passes, &expected));
}
