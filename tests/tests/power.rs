//! The power goes at any moment of a run, and of what was not synced any part may be lost: the next start brings every file to the
//! end it would have had, once.
//!
//! `SUTURE_EXHAUSTIVE=1` tries every moment and every kind of loss; else a sample is tried, by the seed `SUTURE_SEED` (always the same one if there is none).
//! `SUTURE_KEPT="db/conf,mkdir"` never loses changes whose lines have such words: what else is there?

#![cfg(all(target_os = "linux", target_arch = "x86_64"))]

#[path = "power/record.rs"]
mod record;
#[path = "power/replay.rs"]
mod replay;

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::time::Instant;

use suture_tests::binary::suture;
use suture_tests::disk::Kind;
use suture_tests::oracle::Expected;
use suture_tests::scene::{Files, six, with_a_double};

use record::Record;
use replay::Replay;

/// Replays of each lane without `SUTURE_EXHAUSTIVE`.
const SAMPLE: usize = 60;

/// One that is clean, its double, one that is repaired, in a sub-folder, and one that cannot be read.
fn four() -> Files {
    let wanted = ["clean.stl", "double.stl", "scan/part.stl", "picture.stl"];
    with_a_double(six()).into_iter().filter(|(name, _)| wanted.iter().any(|wanted| name.as_os_str() == *wanted)).collect()
}

/// The disk keeps its word, and does no more.
#[test]
fn f09_power_may_go_at_any_moment() {
    power_goes(Kind::Strict);
}

/// The disk has a journal, as most have.
#[test]
fn f09_power_may_go_at_any_moment_of_a_journal() {
    power_goes(Kind::Journal);
}

fn power_goes(kind: Kind) {
    let files = four();
    let expected = Expected::of(suture(), &files);
    assert_eq!(expected.good(), 3);
    let seed = seed();
    let lanes = 2;
    let (start, found) = (Instant::now(), Mutex::new(Found::default()));
    std::thread::scope(|scope| {
        for lane in 0..lanes {
            let (expected, files, found) = (&expected, &files, &found);
            // Replays of one lane share the inodes of what was dropped, so they go one after the other.
            scope.spawn(move || run_lane(expected, &Record::of(suture(), files, kind), (lane, lanes), seed, found));
        }
    });
    let found = found.into_inner().expect("no lane panics with the lock");
    eprintln!(
        "{} replays of {} events in {:.0?}, {} not withstood",
        found.replays,
        found.events,
        start.elapsed(),
        found.failures
    );
    for (class, (count, first)) in &found.classes {
        eprintln!("{count:>6} × {class}, e.g. {first}");
    }
    assert_eq!(found.failures, 0, "see the lines above");
}

fn seed() -> u64 {
    let given = std::env::var("SUTURE_SEED").ok().and_then(|seed| seed.parse().ok());
    let seed = given.unwrap_or(20_261_123);
    eprintln!("SUTURE_SEED={seed}");
    seed
}

fn run_lane(expected: &Expected, record: &Record, (lane, lanes): (usize, usize), seed: u64, found: &Mutex<Found>) {
    let mut replay = Replay::new(record, expected, seed.wrapping_add(lane as u64));
    let note = |what: String, complaints: Option<Vec<String>>| {
        if let Some(complaints) = complaints {
            found.lock().expect("no lane panics with the lock").add(&what, record.disk.len(), &complaints);
        }
    };
    if std::env::var_os("SUTURE_EXHAUSTIVE").is_some() {
        for end in (0..=record.disk.len()).skip(lane).step_by(lanes) {
            for lost in replay.losses(end) {
                note(record.describe(end, &lost), replay.try_one(end, &lost));
            }
        }
        return;
    }
    // Many losses lead to one tree, which is tried once.
    for _ in 0..SAMPLE * 10 {
        if replay.tried() >= SAMPLE {
            break;
        }
        let (end, lost) = replay.any();
        note(record.describe(end, &lost), replay.try_one(end, &lost));
    }
}

#[derive(Default)]
struct Found {
    replays: usize,
    events: usize,
    failures: usize,
    /// Of each class of complaint: how many, and the first.
    classes: BTreeMap<String, (usize, String)>,
}

impl Found {
    fn add(&mut self, what: &str, events: usize, complaints: &[String]) {
        self.replays += 1;
        self.events = events;
        if complaints.is_empty() {
            return;
        }
        self.failures += 1;
        let short = |line: &String| line.replace('\n', " | ").chars().take(200).collect::<String>();
        eprintln!("{what}: {}", complaints.iter().map(short).collect::<Vec<_>>().join("; "));
        // One lost change alone tells what was not synced.
        let culprit = what.split_once(" with 1 changes: ").map_or("", |(_, culprit)| culprit);
        for line in complaints {
            let class = format!("{} {culprit}", line.split(':').next().unwrap_or_default());
            self.classes.entry(class).or_insert_with(|| (0, what.to_owned())).0 += 1;
        }
    }
}
