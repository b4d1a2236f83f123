//! The farm's days: files are found, operators steer, someone is told, and things go wrong.

use std::sync::Arc;

use super::ground::{Flaw, LEASE, Seat};
use super::stage::{Act, Fate, Stage};
use crate::id::JobId;
use crate::job::{Area, Priority};
use crate::news::Notice;
use crate::share::Weight;
use crate::store::{Control, JobStore, Submission};
use crate::testkit::dropped;

/// The subscriber.
const HEARER: &str = "farm";

/// The file of that number.
fn file(number: u64) -> Submission {
    let mut found = dropped(&format!("{number}.stl"), 84 + number % 1000).unwrap();
    found.source.folder = ["a", "b", "c"][usize::try_from(number % 3).unwrap()].to_owned();
    found.source.ino = number + 1;
    let urgent = [(0..12, 5), (12..14, 9), (14..16, 7), (16..18, 2), (18..20, 0)];
    let (_, priority) = urgent.into_iter().find(|(range, _)| range.contains(&(number / 3 % 20))).unwrap();
    found.priority = Priority::try_from(priority).unwrap();
    found
}

impl Stage {
    /// A host that is up, and can be reached.
    fn someone(&mut self) -> Option<usize> {
        let host = self.chance.index(self.hosts.len());
        let up = self.hosts[host].seat.is_some() && self.hosts[host].sleeps_until <= self.now();
        up.then_some(host)
    }

    /// Calls the store from some host; `None`: no answer came, and whether it was called is unknown.
    fn call<T>(&mut self, call: impl FnOnce(&mut Self, &dyn JobStore) -> T) -> Option<T> {
        let host = self.someone()?;
        let fate = self.fate(host);
        if matches!(fate, Fate::Before | Fate::Late) {
            return None;
        }
        let seat = Arc::clone(self.hosts[host].seat.as_ref()?);
        let (mut call, mut answer) = (Some(call), None);
        seat.store(&mut |store| answer = call.take().map(|call| call(self, store)));
        answer.filter(|_| fate == Fate::Good)
    }

    /// Some files more, and again those of which no one has heard whether they are taken in; by any host, so that two may find the same.
    pub(super) fn intake(&mut self) {
        let slots = (self.scale.hosts * self.scale.slots) as u64;
        let waiting = self.oracle.live < 4 * slots;
        let new = if waiting { self.chance.between(1, 2 * slots).min(self.scale.jobs - self.submitted) } else { 0 };
        self.found.extend(self.submitted..self.submitted + new);
        self.submitted += new;
        // And another that is known already; whatever has left its place is not found.
        let mut numbers: Vec<u64> = self.found.iter().copied().collect();
        if self.submitted > 0 && self.chance.one_in(3) {
            numbers.push(self.chance.below(self.submitted));
        }
        let is_there = |number: &u64| self.taken.get(number).is_none_or(|id| self.files.original(*id) == Area::In);
        numbers.retain(is_there);
        self.found = self.found.iter().copied().filter(is_there).collect();
        let forgets = self.flaw == Flaw::Forgetful && self.chance.one_in(20);
        if forgets {
            self.found.pop_front();
        } else if !numbers.is_empty() {
            let found: Vec<_> = numbers.iter().map(|number| file(*number)).collect();
            let answered = self.call(|stage, store| {
                let answers = store.submit(&found).unwrap();
                for (number, answer) in numbers.iter().zip(answers) {
                    let first = *stage.taken.entry(*number).or_insert(answer.id);
                    assert!(first == answer.id, "file {number} has jobs {first} and {}", answer.id);
                    if answer.new {
                        stage.oracle.learn(&store.get(answer.id).unwrap().unwrap());
                    }
                }
            });
            if answered.is_some() {
                self.found.clear();
            }
        }
        let pause = self.chance.between(200, 4000);
        self.after(pause, Act::Intake);
    }

    pub(super) fn operate(&mut self) {
        if !self.oracle.jobs.is_empty() && !self.is_calm {
            let last = self.oracle.jobs.len() as u64;
            let id = JobId(self.chance.between(last.saturating_sub(300).max(1), last));
            let priority = Priority::try_from(i64::try_from(self.chance.below(10)).unwrap()).unwrap();
            let wish = match self.chance.below(6) {
                0 => Control::Cancel,
                1 | 2 => Control::Retry,
                3 => Control::Hasten,
                _ => Control::Rank(priority),
            };
            self.call(|stage, store| {
                let Ok(job) = store.control(id, wish.clone()) else { return };
                stage.oracle.learn(&job);
                stage.say(&|| format!("{wish:?}: job {id} {}", job.kind().name()));
            });
        }
        let pause = self.chance.between(500, 20_000);
        self.after(pause, Act::Operator);
    }

    /// Someone is told of ends.
    pub(super) fn tell(&mut self) {
        let most = self.chance.between(1, 200) as usize;
        let notices = self.call(|_, store| {
            store.subscribe(&[HEARER.to_owned()]).unwrap();
            store.notices(HEARER, most).unwrap()
        });
        let jobs = notices.into_iter().flatten().map(|notice| match notice {
            Notice::End(job) => *job,
            Notice::Word(word) => panic!("no one has said {word:?}"),
        });
        let jobs: Vec<_> = jobs.collect();
        self.oracle.told(&jobs);
        if let Some(last) = jobs.last().map(|job| job.seq) {
            self.call(|stage, store| {
                if stage.flaw != Flaw::Deaf {
                    store.acknowledge(HEARER, last).unwrap();
                }
                stage.oracle.acknowledged(last);
            });
        }
        let pause = self.chance.between(500, 10_000);
        self.after(pause, Act::Teller);
    }

    /// Something goes wrong.
    pub(super) fn trouble(&mut self) {
        if !self.is_calm {
            let host = self.chance.index(self.hosts.len());
            let now = self.now();
            match self.chance.below(10) {
                0..3 => {
                    let time = self.chance.between(1000, 3 * LEASE);
                    self.hosts[host].sleeps_until = now + time;
                    self.say(&|| format!("host{host} is stopped for {time} ms"));
                }
                3..6 => {
                    let time = self.chance.between(1000, 3 * LEASE);
                    self.hosts[host].cut_until = now + time;
                    self.say(&|| format!("host{host} is cut off for {time} ms"));
                }
                6..9 if self.hosts[host].seat.is_some() => {
                    self.hosts[host].seat = None;
                    self.hosts[host].life += 1;
                    let time = self.chance.between(1000, 4 * LEASE);
                    self.say(&|| format!("host{host} is killed, for {time} ms"));
                    self.after(time, Act::Rise(host));
                }
                9 if self.chance.one_in(4) => {
                    self.say(&|| "the database restarts".into());
                    self.ground.restart();
                    self.again_shares();
                    self.away_until = now + self.chance.between(500, 20_000);
                }
                _ => {}
            }
        }
        let pause = self.chance.between(1000, 60_000);
        self.after(pause, Act::Trouble);
    }

    /// A store that forgets what it was told of shares is told again, by whoever lives; turns begin anew.
    fn again_shares(&mut self) {
        if self.is_in_memory {
            self.oracle.forget_turns();
            if let Some(seat) = self.hosts.iter().find_map(|host| host.seat.clone()) {
                self.say_shares(&*seat);
            }
        }
    }

    /// Tells the store of the folders' shares.
    pub(super) fn say_shares(&self, seat: &dyn Seat) {
        let mut shares = self.shares.clone();
        for share in shares.values_mut() {
            match self.flaw {
                Flaw::Unfair => share.weight = Weight::default(),
                Flaw::Boundless => share.most_running = None,
                _ => {}
            }
        }
        seat.store(&mut |store| store.share(&shares));
    }
}
