//! Farms of many seeds, and stores that are made worse to see that it is noticed.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;

use super::ground::{Flaw, Ground, InMemory};
use super::stage::{BEGIN, Scale, Stage};
use crate::job::{Area, Job, State};
use crate::store::Query;
use crate::testkit::ManualClock;

/// Once nothing goes wrong any more, all comes to rest within so long, in ms: some of the longest pauses.
const PATIENCE: u64 = 12 * 3_600_000;
/// In CI.
const SMALL: Scale = Scale { jobs: 600, hosts: 4, slots: 4, trouble: 30 };

/// All there is to say of a run.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Told {
    pub digest: u64,
    pub claims: u64,
    pub fenced: u64,
    /// In ms of the farm's clock.
    pub time: u64,
}

impl Stage {
    fn play(&mut self) {
        let mut calm_at = None;
        loop {
            self.go_on();
            if self.submitted == self.scale.jobs && calm_at.is_none() {
                self.is_calm = true;
                calm_at = Some(self.now());
            }
            let is_quiet = self.oracle.live == 0 && self.found.is_empty() && self.oracle.all_told();
            if let Some(calm_at) = calm_at {
                if is_quiet && self.hosts.iter().all(|host| host.slots.iter().all(Option::is_none)) {
                    return;
                }
                assert!(self.now() < calm_at + PATIENCE, "it does not come to rest: {} jobs are live", self.oracle.live);
            }
        }
    }

    /// All is in its place, once.
    fn audit(&self) {
        let mut jobs = Vec::new();
        let seat = self.hosts.iter().find_map(|host| host.seat.as_ref()).unwrap();
        seat.store(&mut |store| jobs = store.list(&Query::default()).unwrap());
        assert_eq!(jobs.len() as u64, self.scale.jobs, "each file has one job");
        jobs.iter().for_each(|job| self.audit_one(job));
    }

    fn audit_one(&self, job: &Job) {
        let id = job.id;
        assert!(job.kind().is_at_rest() && self.oracle.jobs[&id] == job.kind(), "{job:?}");
        let of_intents = self.oracle.intended.get(&id);
        let results: Vec<_> = self.files.of(id).collect();
        assert!(results.iter().all(|(_, hash)| of_intents.is_some_and(|known| known.contains(*hash))), "{results:?} of {job:?}");
        let good: Vec<_> = results.iter().filter(|(good, _)| *good).map(|(_, hash)| **hash).collect();
        match &job.state {
            State::Ended { publication } => {
                let area = publication.ending.area();
                let expected: Vec<_> = publication.output_hash.into_iter().filter(|_| area == Area::Done).collect();
                assert_eq!(good, expected, "{job:?}");
                assert!(publication.output_hash.is_none_or(|hash| self.files.has(id, area, hash)), "{job:?}");
                assert!(publication.original.is_none() || self.files.original(id) == area, "{job:?}");
            }
            _ => {
                assert!(good.is_empty(), "{job:?} has {good:?}");
                assert_ne!(self.files.original(id), Area::Done, "{job:?}");
            }
        }
    }
}

/// A farm on tables in memory.
fn in_memory(flaw: Flaw) -> impl FnOnce(&Arc<ManualClock>) -> (Box<dyn Ground>, bool) {
    move |clock| (Box::new(InMemory::new(clock, flaw)), true)
}

/// Runs a farm; tells its seed and its last steps if something is wrong.
pub(super) fn run(seed: u64, scale: Scale, flaw: Flaw, make: impl FnOnce(&Arc<ManualClock>) -> (Box<dyn Ground>, bool)) -> Told {
    let mut stage = Stage::new(seed, scale, flaw, make);
    let ran = catch_unwind(AssertUnwindSafe(|| {
        stage.play();
        stage.audit();
    }));
    if let Err(cause) = ran {
        eprintln!("{}seed {seed}, {scale:?}", stage.told());
        resume_unwind(cause);
    }
    Told { digest: stage.digest(), claims: stage.oracle.claims, fenced: stage.oracle.fenced, time: stage.now() - BEGIN }
}

#[test]
fn farms_of_many_seeds() {
    let (mut claims, mut fenced) = (0, 0);
    for seed in 0..12 {
        let told = run(seed, SMALL, Flaw::None, in_memory(Flaw::None));
        (claims, fenced) = (claims + told.claims, fenced + told.fenced);
    }
    // All that is to be survived has happened.
    assert!(claims > 12 * SMALL.jobs && fenced > 50, "{claims} claims, {fenced} fenced");
}

/// Without it no failure could be looked at again.
#[test]
fn a_seed_is_one_run() {
    let again = |seed| run(seed, SMALL, Flaw::None, in_memory(Flaw::None));
    assert_eq!(again(3), again(3));
    assert_ne!(again(3).digest, again(4).digest);
}

/// Each wrong in its own way: one of a few seeds sees it.
#[test]
fn a_store_that_breaks_its_word_is_found_out() {
    for (flaw, words) in [
        (Flaw::Unfenced, "fenced"),
        (Flaw::Hasty, "while"),
        (Flaw::Deaf, "told again"),
        (Flaw::Unfair, "turns"),
        (Flaw::Boundless, "no room"),
        (Flaw::Forgetful, "each file has one job"),
        (Flaw::Silent, "nobody is told"),
    ] {
        let found_out = |seed| {
            let ran = catch_unwind(AssertUnwindSafe(|| run(seed, SMALL, flaw, in_memory(flaw))));
            let cause = ran.err()?;
            Some(cause.downcast_ref::<String>().cloned().unwrap_or_default())
        };
        let cause = (0..4).find_map(found_out).unwrap_or_else(|| panic!("{flaw:?} was not noticed"));
        assert!(cause.contains(words), "{flaw:?}: {cause}");
    }
}

#[test]
#[ignore = "for a seed at hand: SUTURE_SEED=n, or n-m"]
fn a_farm_of_choice() {
    let seeds = std::env::var("SUTURE_SEED").expect("SUTURE_SEED names a seed");
    let (first, last) = seeds.split_once('-').unwrap_or((&seeds, &seeds));
    for seed in first.parse().unwrap()..=last.parse().unwrap() {
        let told = run(seed, SMALL, Flaw::None, in_memory(Flaw::None));
        eprintln!("seed {seed} is well: {told:?}");
    }
}

/// From 16 to 256 workers on 4 to 16 hosts.
#[test]
#[ignore = "minutes; SUTURE_FARM_JOBS=n for another number of jobs"]
fn a_million_jobs() {
    let jobs = std::env::var("SUTURE_FARM_JOBS").map_or(1_000_000, |jobs| jobs.parse().expect("SUTURE_FARM_JOBS is a number"));
    const EACH: u64 = 20_000;
    let (mut claims, mut fenced, mut time) = (0, 0, 0);
    let began = std::time::Instant::now();
    for seed in 0..u64::div_ceil(jobs, EACH) {
        let (hosts, slots) = [(4, 4), (8, 8), (16, 8), (16, 16)][(seed % 4) as usize];
        let scale = Scale { jobs: EACH.min(jobs - seed * EACH), hosts, slots, trouble: [2, 10, 30, 60][(seed / 4 % 4) as usize] };
        let told = run(1000 + seed, scale, Flaw::None, in_memory(Flaw::None));
        (claims, fenced, time) = (claims + told.claims, fenced + told.fenced, time + told.time);
        eprintln!("{scale:?}: {told:?}, {} s so far", began.elapsed().as_secs());
    }
    eprintln!("{jobs} jobs, {claims} claims, {fenced} fenced calls, {} hours of the farms", time / 3_600_000);
}
