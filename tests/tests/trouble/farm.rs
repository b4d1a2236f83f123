//! A farm in which machines are cut off, held up, killed and stopped for longer than a lease; its database dies, and its disk is full. Or the way to its object
//! store fails. Each file has one result all the same, that of one machine.

use std::io::ErrorKind;
use std::time::{Duration, Instant};

use rustix::process::Signal;
use suture_tests::proxy::Mood;
use suture_tests::served::wait_until;

use crate::farm_members::{Farm, Kind, Member, is_over};
use crate::stage::row;
use crate::world::{fill_bytes, is_root};

/// Machines fail from then on, as soon as someone works.
const BEGIN: u64 = 1;
/// Until they are well again: longer than a lease, which is a minute.
const ROUND: u64 = BEGIN + 75;
/// Then all is well for so long.
const CALM: u64 = 15;
/// A packet of a machine that is held up takes so long, both ways.
const DELAY: Duration = Duration::from_secs(2);

/// What happens to a worker's machine for a round.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fate {
    Cut,
    Late,
    Killed,
    Stopped,
}

const FATES: [Fate; 4] = [Fate::Cut, Fate::Late, Fate::Killed, Fate::Stopped];

/// Files, and rounds at least.
fn scale() -> (u64, u64) {
    if std::env::var_os("SUTURE_EXHAUSTIVE").is_some() { (2000, 4) } else { (160, 2) }
}

fn befall(member: &mut Member, fate: Fate) {
    match fate {
        Fate::Cut => member.host.cut(true),
        Fate::Late => member.host.delay(DELAY),
        Fate::Killed => member.kill(),
        Fate::Stopped => member.signal(Signal::STOP),
    }
}

fn relieve(member: &mut Member, fate: Fate) {
    match fate {
        Fate::Cut => member.host.cut(false),
        Fate::Late => member.host.delay(Duration::ZERO),
        Fate::Killed => member.start(),
        Fate::Stopped => member.signal(Signal::CONT),
    }
}

/// The moments of a round, in seconds from its beginning.
struct Round<'a, 'b> {
    farm: &'a Farm,
    intake: &'b mut Member<'a>,
    workers: &'b mut [Member<'a>],
    number: u64,
    files: std::ops::Range<u64>,
}

impl Round<'_, '_> {
    fn fate(&self, worker: usize) -> Fate {
        FATES[(worker + self.number as usize) % FATES.len()]
    }

    fn each(&mut self, of: impl Fn(Fate) -> bool, what: fn(&mut Member, Fate)) {
        for worker in 0..self.workers.len() {
            let fate = self.fate(worker);
            if of(fate) {
                what(&mut self.workers[worker], fate);
            }
        }
    }

    fn run(&mut self) {
        let filler = self.farm.place.at("disk/filler");
        let half = self.files.start.midpoint(self.files.end);
        let (begun, is_even) = (Instant::now(), self.number.is_multiple_of(2));
        for second in 0..ROUND + CALM {
            match (second, is_even) {
                (0, _) => self.farm.drop_files(self.files.start..half),
                (BEGIN, _) => {
                    wait_until("someone works", || self.farm.jobs().iter().any(|job| job["kind"] == "running"));
                    self.each(|_| true, befall);
                }
                (13, true) => self.farm.server.kill(),
                (13, false) => fill_bytes(&filler),
                (14, _) => self.farm.drop_files(half..self.files.end),
                (20, true) => self.farm.database.inside(|| self.farm.server.run()),
                (23, _) => self.each(|fate| fate == Fate::Killed, relieve),
                (25, true) => self.intake.host.cut(true),
                (38, false) => {
                    // The log of the database lies there, too, so that it may say nothing of it.
                    let beside = std::fs::write(self.farm.place.at("disk/more"), [0; 1 << 16]).map_err(|error| error.kind());
                    assert_eq!(beside, Err(ErrorKind::StorageFull), "the disk was never full");
                    std::fs::remove_file(self.farm.place.at("disk/more")).expect("it can go");
                    std::fs::remove_file(&filler).expect("there is room again");
                    self.farm.database.inside(|| self.farm.server.run_anew());
                }
                (45, true) => self.intake.host.cut(false),
                (45, false) => self.intake.kill(),
                (55, false) => self.intake.start(),
                (ROUND, _) => self.each(|fate| fate != Fate::Killed, relieve),
                _ => {}
            }
            self.workers.iter_mut().for_each(Member::tend);
            self.intake.tend();
            std::thread::sleep((begun + Duration::from_secs(second + 1)).saturating_duration_since(Instant::now()));
        }
    }
}

/// Four workers, each on a machine of its own, as the intake, the database and the object store are.
#[test]
fn machines_fail_and_each_file_has_one_result() {
    if is_root("a farm whose machines fail") {
        machines_fail(Kind::Bucket, "a farm whose machines fail");
    }
}

/// The same with a share: what a machine that is cut off or stopped had in work, another one goes on with, in the same folders.
#[test]
fn machines_fail_beside_a_share_and_each_file_has_one_result() {
    if is_root("a farm beside a share") {
        machines_fail(Kind::Share, "a farm beside a share");
    }
}

fn machines_fail(kind: Kind, name: &str) {
    let Some(farm) = Farm::new(kind) else { return };
    let (files, rounds) = scale();
    let mut intake = farm.member("intake", "intake,control");
    let mut workers: Vec<Member> = (1..=4).map(|n| farm.member(&format!("worker-{n}"), "worker")).collect();
    let (begun, batch) = (Instant::now(), files / rounds);
    for number in 0..rounds {
        let last = if number + 1 == rounds { files } else { (number + 1) * batch };
        let files = number * batch + 1..last + 1;
        Round { farm: &farm, intake: &mut intake, workers: &mut workers, number, files }.run();
        let ended = farm.jobs().iter().filter(|job| is_over(job)).count();
        println!("round {number}: {ended} ended after {:?}", begun.elapsed());
    }
    workers.push(intake);
    farm.wait_for(files, &mut workers);
    let took = begun.elapsed().as_secs();
    farm.assert_as_of_one_machine(files);
    let again = farm.jobs().iter().filter(|job| job["attempts"].as_u64() > Some(1)).count();
    let fenced = workers.iter().map(|worker| worker.said().matches("The job went another way meanwhile.").count()).sum::<usize>();
    assert!(again > 0, "no fault met a job");
    let seen =
        format!("{files} results, once each, in {took} s; {again} jobs were tried again, {fenced} steps of lost claims refused");
    row(name, "cut off, late by 2 s, killed, stopped; database killed, its disk full; intake cut off, killed", &seen);
}

/// Errors before and after the deed, answers cut and slow, listings of before.
#[test]
fn the_object_store_fails_and_each_file_has_one_result() {
    if !is_root("a farm whose object store fails") {
        return;
    }
    let Some(farm) = Farm::new(Kind::BucketBehind(Mood::Failing)) else { return };
    let (files, _) = scale();
    let mut members: Vec<Member> = (1..=4).map(|n| farm.member(&format!("worker-{n}"), "worker")).collect();
    members.push(farm.member("intake", "intake,control"));
    let begun = Instant::now();
    farm.drop_files(1..files / 2 + 1);
    std::thread::sleep(Duration::from_secs(CALM));
    farm.drop_files(files / 2 + 1..files + 1);
    farm.wait_for(files, &mut members);
    let took = begun.elapsed().as_secs();
    farm.assert_as_of_one_machine(files);
    let met = farm.files.way().expect("there is a way").met();
    assert!(met.iter().all(|(_, count)| *count > 0), "{met:?}");
    row("a farm whose object store fails", &format!("{met:?}"), &format!("{files} results, once each, in {took} s"));
}
