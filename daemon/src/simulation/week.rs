//! A week, with as many jobs as there are: how long it takes, and how much memory and store the daemon needs for it.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use suture_store::testkit::Chance;

use super::matter::{FATES, Fate};
use super::plan::{LEFT, Plan};
use super::stage::{Scale, Stage};
use super::watched;
use crate::config::keep::HISTORY_JOBS;
use crate::glance::size_of;
use crate::world::World;

const SCALE: Scale = Scale { meanwhile: 3000, seconds: 3, watch_order: false, tend: Duration::from_secs(1800) };
/// Some days before summer time ends.
const BEGIN: &str = "2099-10-22T12:00:00";
const NIGHTS: u64 = 7;
/// Drops come in bursts, in the afternoon, which wait for the night, and all through the night.
const BURSTS: [(u64, Duration); 2] = [(8, Duration::from_secs(3600)), (60, Duration::from_secs(600))];
/// What the daemon may need, in bytes.
const MOST_MEMORY: u64 = 200 << 20;
const MOST_STORE: u64 = 64 << 20;

fn plan(_: &mut Chance) -> Plan {
    let (workers, window) = (3, Some("20:00-07:00"));
    Plan { workers, window, priorities: [5, 5], drain: 60, results: 2, history_jobs: HISTORY_JOBS, check_one_in: 100 }
}

/// The most memory that this process ever held, in bytes.
fn peak() -> u64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap();
    line.trim().trim_end_matches(" kB").parse::<u64>().unwrap() << 10
}

impl Stage {
    /// Drops many files at once, most of them nothing special.
    fn burst(&self, count: u64, number: &mut u64) {
        for _ in 0..count {
            *number += 1;
            let name = PathBuf::from(format!("order-{}/part-{number}.stl", *number / 400));
            let (folder, fate, large, again) = self.chance(|chance| {
                let fate = if chance.one_in(40) { chance.pick(&FATES).0 } else { chance.pick(&[Fate::Clean, Fate::Repaired]) };
                (if chance.one_in(50) { LEFT } else { 0 }, fate, chance.one_in(50), chance.one_in(10))
            });
            let earlier = self.oracle.borrow().some_earlier(&mut |len| self.chance(|chance| chance.index(len)));
            let matter = earlier.filter(|_| again).unwrap_or_else(|| self.oracle.borrow_mut().new_matter(fate, large));
            self.drop_file(folder, name, matter);
        }
    }

    /// So long, with what may happen meanwhile.
    fn go_on(&self, time: Duration) {
        let end = self.sky.passed() + time;
        while self.sky.passed() < end {
            if self.chance(|chance| chance.one_in(150)) {
                self.survive(|| self.trouble_of_a_week());
            }
            let open = self.life().context.settings.now().run_window.is_open(&|| self.sky.local());
            self.round(Duration::from_secs(if open { 20 } else { 300 }), 400);
        }
        // Nothing goes on for a whole burst.
        self.survive(|| self.end_trouble());
    }

    fn week(&self, jobs: u64) -> u64 {
        let (mut number, mut store) = (0, 0);
        let bursts: u64 = BURSTS.iter().map(|(bursts, _)| bursts).sum();
        let burst = jobs / (NIGHTS * bursts);
        for night in 0..NIGHTS {
            let began = self.sky.passed();
            for (bursts, time) in BURSTS {
                for _ in 0..bursts {
                    self.burst(burst, &mut number);
                    self.go_on(time);
                }
                store = store.max(size_of(&self.place.state()));
            }
            if night + 1 == NIGHTS {
                self.burst(jobs - number, &mut number);
            }
            self.come_to_rest();
            store = store.max(size_of(&self.place.state()));
            let (spent, peak) = (self.sky.passed() - began, peak() >> 20);
            eprintln!(
                "night {night}: {number} dropped, at rest after {} h, at most {peak} MiB, store {} KiB",
                spent.as_secs() / 3600,
                store >> 10
            );
            while self.sky.passed() - began < Duration::from_secs(24 * 3600) {
                self.round(Duration::from_secs(900), 1);
            }
        }
        store
    }
}

/// A week in minutes. By `SUTURE_WEEK=jobs` another number of jobs.
#[test]
#[ignore = "some minutes: cargo test -p suture --release a_week -- --ignored --nocapture"]
fn a_week_of_a_hundred_thousand_jobs() {
    let jobs = std::env::var("SUTURE_WEEK").map_or(100_000, |text| text.parse().unwrap());
    let stage = Stage::new(jobs, BEGIN, SCALE, plan);
    let began = Instant::now();
    watched(jobs, &stage, |stage| {
        let store = stage.week(jobs);
        let (took, peak) = (began.elapsed().as_secs(), peak());
        eprintln!("{jobs} jobs in {took} s; at most {} MiB, store {} MiB", peak >> 20, store >> 20);
        assert!(peak < MOST_MEMORY && store < MOST_STORE, "{peak} B, {store} B");
    });
}
