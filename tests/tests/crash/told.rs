//! Whoever is to hear of ends of jobs, and of news, hears of each, wherever the daemon was killed: at least once, and under one id.

use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

use suture_tests::binary::with_crash_points;
use suture_tests::hot::Hot;
use suture_tests::receiver::Receiver;

use crate::{assert_at_rest, drop_two, on_two_threads, traced, was_killed};

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
    let (status, trace) = traced(&hot, daemon(&hot, &receiver));
    assert_eq!(status.code(), Some(1));
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

/// A hot folder, and another one beside it that can be taken away.
struct Two {
    hot: Hot,
    beside: tempfile::TempDir,
    receiver: Receiver,
}

impl Two {
    /// Both have been served once.
    fn served() -> Self {
        let two = Self {
            hot: Hot::new(with_crash_points()),
            beside: tempfile::tempdir().expect("a temporary folder"),
            receiver: Receiver::start(),
        };
        assert!(two.daemon().status().expect("it starts").success());
        two
    }

    fn daemon(&self) -> Command {
        self.hot.configured(&format!(
            "settle = \"30ms\"\nstate = {:?}\n[[webhook]]\nurl = \"http://{}/\"\nevents = [\"folder_away\", \"folder_back\"]\n[[folders]]\npath = {:?}\n",
            self.hot.path().join(".suture/state"),
            self.receiver.address,
            self.beside.path().join("scans")
        ))
    }

    /// The disk of the other folder is not mounted any more: the bare folder under it is there.
    fn take_away(&self) {
        let noted = self.hot.path().join(".suture/folders");
        let text = std::fs::read(&noted).expect("a note of the folders");
        let mut traces: serde_json::Value = serde_json::from_slice(&text).expect("JSON");
        traces["scans"]["mount"] = "/mnt/disk".into();
        std::fs::write(&noted, traces.to_string()).expect("the note can be written");
        std::fs::rename(self.beside.path().join("scans"), self.beside.path().join("disk")).expect("a folder");
        std::fs::create_dir(self.beside.path().join("scans")).expect("a folder");
    }

    fn bring_back(&self) {
        std::fs::remove_dir(self.beside.path().join("scans")).expect("an empty folder");
        std::fs::rename(self.beside.path().join("disk"), self.beside.path().join("scans")).expect("a folder");
    }

    /// Ids by event, as the receiver was told them.
    fn came(&self) -> BTreeMap<String, BTreeSet<String>> {
        let mut all: BTreeMap<_, BTreeSet<_>> = BTreeMap::new();
        for message in self.receiver.came() {
            let event = message.json()["event"].as_str().unwrap_or_default().to_owned();
            all.entry(event).or_default().insert(message.header("suture-delivery").to_owned());
        }
        all
    }

    /// Crash points of a run.
    fn passes(&self) -> u64 {
        let (_, passed) = traced(&self.hot, self.daemon());
        assert!(["daemon.told\n", "daemon.acknowledged\n"].iter().all(|point| passed.matches(point).count() == 1), "{passed}");
        passed.lines().count() as u64
    }
}

/// A folder that goes and comes back is told of, each once and under one id.
#[test]
fn f30_killed_at_every_step_news_are_told_once() {
    let two = Two::served();
    two.take_away();
    let away = two.passes();
    two.bring_back();
    let passes = two.passes().max(away);
    let steps: Vec<u64> = (1..=passes).collect();
    on_two_threads(&steps, |&step| {
        let two = Two::served();
        let mut known = Vec::new();
        for (event, change) in [("folder_away", Two::take_away as fn(&Two)), ("folder_back", Two::bring_back)] {
            change(&two);
            let what = format!("{event}, killed at pass {step} of {passes}");
            let first = two.daemon().env("SUTURE_CRASH_AT", format!("*:{step}")).status().expect("it starts");
            assert!(was_killed(first) || step + 8 > passes, "{what}: was not");
            for _ in 0..2 {
                let status = two.daemon().status().expect("it starts");
                assert!(status.code().is_some_and(|code| code < 2), "{what}: {status}");
            }
            known.push(event.to_owned());
            let came = two.came();
            assert_eq!(came.keys().cloned().collect::<Vec<_>>(), known, "{what}");
            assert!(came.values().all(|ids| ids.len() == 1), "{what}: {came:?}");
        }
    });
}
