//! All that there is in a simulation, what happens next, and what becomes of each call on its way.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use super::files::Files;
use super::ground::{Flaw, Ground, Seat};
use super::host::{Host, Work};
use super::oracle::Oracle;
use crate::id::{Clock, JobId, Time};
use crate::job::{Job, Step};
use crate::share::{Share, Shares, Weight};
use crate::store::{Claim, StoreError};
use crate::testkit::{Chance, ManualClock};

/// So many steps are told of when something is wrong.
const TOLD: usize = 60;
/// When a simulation begins, in ms.
pub(super) const BEGIN: u64 = 1_000_000;

/// How much goes on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    pub jobs: u64,
    pub hosts: usize,
    /// Of each host.
    pub slots: usize,
    /// Of 1,000 calls so many fail, while there is trouble.
    pub trouble: u64,
}

/// Something that happens at a time.
pub(super) enum Act {
    /// A slot of a host goes on, in that life of the host.
    Slot {
        host: usize,
        slot: usize,
        life: u64,
    },
    /// A host comes up.
    Rise(usize),
    /// Files are found.
    Intake,
    Operator,
    Teller,
    /// Something goes wrong.
    Trouble,
    /// A call arrives after its caller has given it up.
    Late(usize, Arc<dyn Seat>, Box<(Claim, Step)>),
}

/// The end of a call.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Fate {
    Good,
    /// It does not arrive.
    Before,
    /// Its answer does not.
    After,
    /// It arrives when no one waits for it any more.
    Late,
}

/// Why a call has no answer.
pub(super) enum Lost {
    /// No one knows whether it was done.
    Unknown,
    Refused(StoreError),
}

pub(super) struct Stage {
    pub clock: Arc<ManualClock>,
    pub ground: Box<dyn Ground>,
    pub scale: Scale,
    pub flaw: Flaw,
    pub chance: Chance,
    pub oracle: Oracle,
    pub files: Files,
    pub hosts: Vec<Host>,
    pub shares: Shares,
    pub submitted: u64,
    /// Files whose submission is not acknowledged yet.
    pub found: VecDeque<u64>,
    /// Jobs of files, whether their finder knows them or not.
    pub taken: BTreeMap<u64, JobId>,
    agenda: BTreeMap<(u64, u64), Act>,
    acts: u64,
    /// Nothing goes wrong any more.
    pub is_calm: bool,
    /// Until then the database is away.
    pub away_until: u64,
    /// Tables in memory: the store forgets turns where it goes down, and knows no sign of life but those of the farm.
    pub is_in_memory: bool,
    log: VecDeque<String>,
    digest: u64,
}

impl Stage {
    pub(super) fn new(
        seed: u64,
        scale: Scale,
        flaw: Flaw,
        make: impl FnOnce(&Arc<ManualClock>) -> (Box<dyn Ground>, bool),
    ) -> Self {
        let clock = Arc::new(ManualClock::new(Time(BEGIN)));
        let (ground, is_in_memory) = make(&clock);
        let share = |weight, most: Option<u32>| Share {
            weight: Weight::try_from(weight).unwrap(),
            most_running: most.map(|most| most.try_into().unwrap()),
        };
        let most = u32::try_from(scale.hosts * scale.slots / 4).unwrap().max(1);
        let shares = [("a", share(10, None)), ("b", share(40, None)), ("c", share(10, Some(most)))];
        let shares: Shares = shares.into_iter().map(|(name, share)| (name.to_owned(), share)).collect();
        let mut stage = Self {
            oracle: Oracle::new(&shares),
            hosts: (0..scale.hosts).map(|at| Host::new(format!("host{at}"), scale.slots)).collect(),
            files: Files::default(),
            chance: Chance::new(seed),
            submitted: 0,
            found: VecDeque::new(),
            taken: BTreeMap::new(),
            agenda: BTreeMap::new(),
            acts: 0,
            is_calm: false,
            away_until: 0,
            log: VecDeque::new(),
            digest: 0xcbf2_9ce4_8422_2325,
            clock,
            ground,
            scale,
            flaw,
            shares,
            is_in_memory,
        };
        (0..scale.hosts).for_each(|host| stage.after(0, Act::Rise(host)));
        [Act::Intake, Act::Operator, Act::Teller, Act::Trouble].into_iter().for_each(|act| stage.after(1000, act));
        stage
    }

    pub(super) fn now(&self) -> u64 {
        self.clock.now().0
    }

    pub(super) fn after(&mut self, ms: u64, act: Act) {
        self.acts += 1;
        self.agenda.insert((self.now() + ms, self.acts), act);
    }

    /// Notes what happens.
    pub(super) fn say(&mut self, what: &dyn Fn() -> String) {
        let line = format!("{:>10} ms  {}", self.now() - BEGIN, what());
        for byte in line.bytes() {
            self.digest = (self.digest ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
        if self.log.len() == TOLD {
            self.log.pop_front();
        }
        self.log.push_back(line);
    }

    /// The last steps, one a line.
    pub(super) fn told(&self) -> String {
        self.log.iter().map(|line| format!("{line}\n")).collect()
    }

    /// Of all steps so far.
    pub(super) fn digest(&self) -> u64 {
        self.digest
    }

    /// The next thing happens.
    pub(super) fn go_on(&mut self) {
        let ((at, _), act) = self.agenda.pop_first().expect("there is always something to do");
        self.clock.pass(at.saturating_sub(self.now()));
        match act {
            Act::Slot { host, slot, life } => {
                let sleeps_until = self.hosts[host].sleeps_until;
                if self.hosts[host].life != life {
                    return;
                }
                if sleeps_until > self.now() {
                    self.after(sleeps_until - self.now(), Act::Slot { host, slot, life });
                } else {
                    self.slot(host, slot);
                }
            }
            Act::Rise(host) => self.rise(host),
            Act::Intake => self.intake(),
            Act::Operator => self.operate(),
            Act::Teller => self.tell(),
            Act::Trouble => self.trouble(),
            Act::Late(host, seat, call) => {
                let (claim, step) = *call;
                let done = seat.advance(&claim, step);
                self.say(&|| format!("what host{host} wanted of job {} arrives late: {}", claim.id, word(&done)));
                self.took(&claim, &done);
            }
        }
    }

    /// The store took, or refused, a step; whether the caller hears of it or not.
    pub(super) fn took(&mut self, claim: &Claim, done: &Result<Job, StoreError>) {
        let now = self.now();
        match done {
            Ok(job) => self.oracle.stepped(claim, job, now),
            Err(StoreError::Illegal { source: crate::job::Illegal::Fenced, .. }) => self.oracle.fenced += 1,
            Err(StoreError::Illegal { .. }) => {}
            Err(error) => panic!("{error}"),
        }
    }

    /// The end of a call of that host.
    pub(super) fn fate(&mut self, host: usize) -> Fate {
        if self.away_until > self.now() || self.hosts[host].cut_until > self.now() {
            return Fate::Before;
        }
        if self.is_calm || self.chance.below(1000) >= self.scale.trouble {
            return Fate::Good;
        }
        self.chance.pick(&[Fate::Before, Fate::After, Fate::Late])
    }

    /// A slot's work, which it has.
    pub(super) fn work(&mut self, host: usize, slot: usize) -> &mut Work {
        self.hosts[host].slots[slot].as_mut().expect("it has work")
    }
}

/// For people.
pub(super) fn word(done: &Result<Job, StoreError>) -> String {
    match done {
        Ok(job) => job.kind().name().to_owned(),
        Err(error) => error.to_string(),
    }
}
