//! The daemon killed at every step where a result's name is taken and the folder wants no second one: the file that has the name stays as it is, and the
//! drop ends once, as its folder says.

use std::collections::BTreeMap;
use std::process::Command;

use suture_tests::binary::with_crash_points;
use suture_tests::hot::{Hot, Tree, holes};

use crate::{assert_at_rest, assert_attempts, on_two_threads, state, traced, was_killed};

const THEIRS: &[u8] = b"theirs";

/// A folder's rule for a drop whose result's name is taken, and the end of such a drop.
#[derive(Clone, Copy, Debug)]
struct Rule {
    on_taken: &'static str,
    /// How the daemon and the job end.
    code: i32,
    kind: &'static str,
    ending: &'static str,
    /// Where the original goes.
    original: (&'static str, &'static str),
}

const RULES: [Rule; 2] = [
    Rule { on_taken: "fail", code: 1, kind: "failed", ending: "name_taken", original: ("failed", "part.stl") },
    Rule { on_taken: "skip", code: 0, kind: "done", ending: "skipped", original: ("done", "part~2.stl") },
];

impl Rule {
    fn daemon(self, hot: &Hot) -> Command {
        hot.configured_folder("settle = \"30ms\"", &format!("on_taken = {:?}", self.on_taken))
    }

    /// Runs the daemon, which is to be killed at its `pass`-th crash point.
    fn killed(self, hot: &Hot, pass: u64) -> bool {
        was_killed(self.daemon(hot).env("SUTURE_CRASH_AT", format!("*:{pass}")).status().expect("the daemon starts"))
    }

    /// The state after a run without kills over what `drop` made, and the number of crash points it passes.
    fn reference(self, drop: fn() -> Hot) -> (BTreeMap<&'static str, Tree>, u64) {
        let hot = drop();
        let (status, trace) = traced(&hot, self.daemon(&hot));
        assert!(status.code().is_some_and(|code| code < 2), "{self:?}: {status}");
        (state(&hot), trace.lines().count() as u64)
    }
}

fn theirs(hot: &Hot) {
    std::fs::create_dir_all(hot.path().join("out")).expect("a folder");
    std::fs::write(hot.path().join("out/part.stl"), THEIRS).expect("a file");
}

fn drop_alone() -> Hot {
    let hot = Hot::new(with_crash_points());
    hot.put("part.stl", &holes(1));
    hot
}

fn drop_beside_theirs() -> Hot {
    let hot = drop_alone();
    theirs(&hot);
    hot
}

fn ending(hot: &Hot) -> (String, String) {
    let jobs = hot.jobs();
    assert_eq!(jobs.len(), 1, "{jobs:?}");
    let text = |value: &serde_json::Value| value.as_str().expect("a word").to_owned();
    (text(&jobs[0]["kind"]), text(&jobs[0]["state"]["ended"]["publication"]["ending"]))
}

#[test]
fn f01_killed_at_every_step_beside_a_taken_name() {
    for rule in RULES {
        let (expected, passes) = rule.reference(drop_beside_theirs);
        let (area, name) = rule.original;
        assert_eq!((&expected["out"]["part.stl"][..], &expected[area][name]), (THEIRS, &holes(1)), "{rule:?}");
        let steps: Vec<u64> = (1..=passes).collect();
        on_two_threads(&steps, |&step| {
            let hot = drop_beside_theirs();
            let what = format!("{}: killed at pass {step} of {passes}", rule.on_taken);
            assert!(rule.killed(&hot, step) || step + 8 > passes, "{what}: was not");
            assert_eq!(hot.tree("out")["part.stl"], THEIRS, "{what}");
            let status = rule.daemon(&hot).status().expect("the daemon starts");
            // The job may have ended before the kill.
            assert!(status.code() == Some(rule.code) || status.code() == Some(0), "{what}: the next run: {status}");
            assert_eq!(state(&hot), expected, "{what}");
            assert_eq!(ending(&hot), (rule.kind.into(), rule.ending.into()), "{what}");
            assert_at_rest(&hot, &what);
            assert_attempts(&hot, 1, &what);
        });
    }
}

/// The name is free when the file is dropped, and another's once the daemon is dead: the drop ends as one that was barred from the beginning, unless its own
/// result has the name, whole.
#[test]
fn f01_killed_at_every_step_before_a_name_is_taken() {
    for rule in RULES {
        let (done, passes) = rule.reference(drop_alone);
        let (barred, _) = rule.reference(drop_beside_theirs);
        let steps: Vec<u64> = (1..=passes).collect();
        on_two_threads(&steps, |&step| {
            let hot = drop_alone();
            let what = format!("{}: killed at pass {step} of {passes}", rule.on_taken);
            assert!(rule.killed(&hot, step) || step + 8 > passes, "{what}: was not");
            let is_ours = hot.path().join("out/part.stl").exists();
            if !is_ours {
                theirs(&hot);
            }
            let status = rule.daemon(&hot).status().expect("the daemon starts");
            assert_eq!(status.code(), Some(if is_ours { 0 } else { rule.code }), "{what}: the next run");
            assert_eq!(state(&hot), if is_ours { done.clone() } else { barred.clone() }, "{what}");
            assert_at_rest(&hot, &what);
            assert_attempts(&hot, 1, &what);
        });
    }
}
