//! Whoever is to hear of ends of jobs hears of each, wherever the daemon was killed: at least once, and under one id.

use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

use suture_tests::binary::with_crash_points;
use suture_tests::hot::Hot;
use suture_tests::receiver::Receiver;

use crate::{assert_at_rest, drop_two, on_two_threads, was_killed};

fn daemon(hot: &Hot, receiver: &Receiver) -> Command {
    let ran = hot.path().join("ran");
    let script = format!("[\"/bin/sh\", \"-c\", \"echo $SUTURE_DELIVERY {{job}} >> {}\"]", ran.display());
    let lines = format!(
        "settle = \"30ms\"\n[on_done]\nwhen = \"always\"\ncommand = {script}\n[[webhook]]\nurl = \"http://{}/\"\n",
        receiver.address
    );
    hot.configured(&lines)
}

/// Ids by job, as the command was told them.
fn ran(hot: &Hot) -> BTreeMap<String, BTreeSet<String>> {
    let mut all: BTreeMap<_, BTreeSet<_>> = BTreeMap::new();
    for line in std::fs::read_to_string(hot.path().join("ran")).unwrap_or_default().lines() {
        let (id, job) = line.split_once(' ').expect("an id and a job");
        all.entry(job.to_owned()).or_default().insert(id.to_owned());
    }
    all
}

fn came(receiver: &Receiver) -> BTreeMap<String, BTreeSet<String>> {
    let mut all: BTreeMap<_, BTreeSet<_>> = BTreeMap::new();
    for message in receiver.came() {
        all.entry(message.json()["job"]["id"].to_string()).or_default().insert(message.header("suture-delivery").to_owned());
    }
    all
}

#[test]
fn f30_killed_at_every_step_each_end_is_told() {
    let hot = Hot::new(with_crash_points());
    let receiver = Receiver::start();
    drop_two(&hot);
    let trace = hot.path().join("trace");
    assert_eq!(daemon(&hot, &receiver).env("SUTURE_CRASH_TRACE", &trace).status().expect("it starts").code(), Some(1));
    let trace = std::fs::read_to_string(trace).expect("a trace");
    assert!(["daemon.told\n", "daemon.acknowledged\n"].iter().all(|point| trace.matches(point).count() == 4), "{trace}");
    assert_eq!((receiver.came().len(), ran(&hot).len()), (2, 2));
    let passes = trace.lines().count() as u64;
    let steps: Vec<u64> = (1..=passes).collect();
    on_two_threads(&steps, |&step| {
        let (hot, receiver) = (Hot::new(with_crash_points()), Receiver::start());
        drop_two(&hot);
        let what = format!("killed at pass {step} of {passes}");
        let first = daemon(&hot, &receiver).env("SUTURE_CRASH_AT", format!("*:{step}")).status().expect("it starts");
        // Threads do not pass as many points in every run.
        assert!(was_killed(first) || step + 24 > passes, "{what}: was not");
        let status = daemon(&hot, &receiver).status().expect("it starts");
        assert!(status.code().is_some_and(|code| code < 2), "{what}: {status}");
        assert_at_rest(&hot, &what);
        let jobs: BTreeSet<String> = hot.jobs().iter().map(|job| job["id"].to_string()).collect();
        for told in [came(&receiver), ran(&hot)] {
            assert_eq!(told.keys().cloned().collect::<BTreeSet<_>>(), jobs, "{what}");
            assert!(told.values().all(|ids| ids.len() == 1), "{what}: {told:?}");
        }
    });
}
