//! A host as a daemon is one: slots that claim, work, and do a job's duty, one step after the other; each call may fail on its way.

use std::sync::Arc;

use super::ground::{LEASE, Seat};
use super::stage::{Act, Fate, Lost, Stage, word};
use crate::id::{Hash, JobId, Recipe, Token};
use crate::job::{Area, Death, Duty, Ending, Illegal, Job, Publication, State, Step, Witness};
use crate::store::{Claim, Filter, JobStore, Lease, StoreError};
use crate::testkit::result_of;

pub(super) struct Host {
    pub name: String,
    /// `None`: it is down.
    pub seat: Option<Arc<dyn Seat>>,
    pub slots: Vec<Option<Work>>,
    /// Which life of it this is.
    pub life: u64,
    /// It is stopped until then.
    pub sleeps_until: u64,
    /// The store cannot be reached from it until then.
    pub cut_until: u64,
    /// It takes nothing more until nothing runs, for a job that must run alone.
    pub wants_alone: bool,
}

/// A job in a slot.
pub(super) struct Work {
    pub claim: Claim,
    /// As it was heard of last.
    pub job: Job,
    /// When its worker is done.
    ends: u64,
    /// The step that is to be said; kept until it is known that it was heard.
    step: Option<Step>,
    /// The claim was looked at just before the files are touched.
    looked: bool,
}

impl Host {
    pub(super) fn new(name: String, slots: usize) -> Self {
        let slots = (0..slots).map(|_| None).collect();
        Self { name, seat: None, slots, life: 0, sleeps_until: 0, cut_until: 0, wants_alone: false }
    }

    fn is_idle(&self) -> bool {
        self.slots.iter().all(Option::is_none)
    }

    fn runs_alone(&self) -> bool {
        self.slots.iter().flatten().any(|work| work.job.hold().is_some_and(|hold| hold.alone))
    }
}

/// The result that an attempt makes of a file: each attempt something of its own, so that it can be told whose result lies where.
fn made(id: JobId, token: Token) -> Hash {
    let mut hash = [0; 32];
    hash[..8].copy_from_slice(&id.0.to_be_bytes());
    hash[8..16].copy_from_slice(&token.0.to_be_bytes());
    Hash(hash)
}

fn publication(job: &Job, token: Token, ending: Ending) -> Publication {
    let has_result = !matches!(ending, Ending::Quarantined | Ending::Environment | Ending::Unreadable);
    let hash = has_result.then(|| made(job.id, token));
    Publication { output: job.source.path.clone().into(), output_hash: hash, ..result_of(job, ending) }
}

impl Stage {
    /// The host begins a life, and takes back what its earlier ones left.
    pub(super) fn rise(&mut self, host: usize) {
        let seat = self.ground.begin(&self.hosts[host].name);
        self.say(&|| format!("host{host} begins"));
        self.say_shares(&*seat);
        let one = &mut self.hosts[host];
        one.seat = Some(Arc::clone(&seat));
        one.life += 1;
        one.slots.iter_mut().for_each(|slot| *slot = None);
        let recovered = seat.recover().unwrap();
        let mut free = 0;
        for one in recovered {
            self.oracle.learn(&one.job);
            let Some(claim) = one.claim else { continue };
            let now = self.now();
            self.oracle.gave(host, claim.token, &claim.job, true, now);
            // A job that no slot is free for is nobody's until its lease ends.
            if let Some(slot) = self.hosts[host].slots.get_mut(free) {
                *slot = Some(Work { job: claim.job.clone(), claim, ends: now, step: None, looked: false });
                free += 1;
            }
        }
        let (slots, life) = (self.hosts[host].slots.len(), self.hosts[host].life);
        for slot in 0..slots {
            let pause = self.chance.below(2000);
            self.after(pause, Act::Slot { host, slot, life });
        }
    }

    /// A slot goes on.
    pub(super) fn slot(&mut self, host: usize, slot: usize) {
        let pause = match &self.hosts[host].slots[slot] {
            None => self.take(host, slot),
            Some(_) => self.go_on_with(host, slot),
        };
        if self.hosts[host].seat.is_some() {
            let life = self.hosts[host].life;
            self.after(pause.max(1), Act::Slot { host, slot, life });
        }
    }

    /// Claims a job, if there is one; the pause after it.
    fn take(&mut self, host: usize, slot: usize) -> u64 {
        let one = &self.hosts[host];
        if one.runs_alone() || (one.wants_alone && !one.is_idle()) {
            return 3000;
        }
        let alone = one.is_idle() && (one.wants_alone || self.chance.one_in(4));
        let want = Filter { alone, ..Filter::default() };
        let fate = self.fate(host);
        if fate == Fate::Before {
            return 2000;
        }
        let seat = Arc::clone(self.hosts[host].seat.as_ref().expect("it is up"));
        let now = self.now();
        let expired = self.oracle.expired(now);
        let found = if seat.has(&want).unwrap() {
            seat.claim(&want).unwrap()
        } else {
            // On PostgreSQL a sign of life by the real clock, unknown here, may have lengthened a lease.
            let is_told = expired.is_empty() || !self.is_in_memory;
            assert!(is_told, "{expired:?} are nobody's, and nobody is told");
            None
        };
        if expired.is_empty() {
            self.oracle.claimed_in_order(&want, found.as_ref(), now);
        } else {
            // Of what it was given out is not known, nor whose turn it was.
            self.oracle.forget_turns();
        }
        if let Some(claim) = &found {
            self.oracle.gave(host, claim.token, &claim.job, false, now);
            self.say(&|| format!("host{host} claims job {} ({:?})", claim.id, claim.job.duty()));
        }
        // Jobs that were taken back and queued again are nobody's any more.
        for id in expired {
            self.hear_of(&*seat, id);
        }
        self.hosts[host].wants_alone = false;
        if fate != Fate::Good {
            return 5000;
        }
        let Some(claim) = found else {
            let wants = |store: &dyn JobStore| store.waiting(&Filter { alone: true, ..want }).unwrap().is_some();
            seat.store(&mut |store| self.hosts[host].wants_alone = !alone && wants(store));
            return self.chance.between(1000, 5000);
        };
        let ends = now + self.chance.between(500, 90_000);
        self.hosts[host].slots[slot] = Some(Work { job: claim.job.clone(), claim, ends, step: None, looked: false });
        self.chance.between(1, 300)
    }

    /// The oracle hears how a job is now.
    fn hear_of(&mut self, seat: &dyn Seat, id: JobId) {
        seat.store(&mut |store| {
            let job = store.get(id).unwrap().unwrap();
            if !self.oracle.holds(id, job.hold().map(|hold| hold.token)) {
                self.oracle.learn(&job);
            }
        });
    }

    /// Does a job's duty; the pause after it.
    fn go_on_with(&mut self, host: usize, slot: usize) -> u64 {
        let now = self.now();
        let work = self.work(host, slot);
        if let Some(step) = work.step.clone() {
            return self.send(host, slot, step);
        }
        let (duty, claim, job) = (work.job.duty(), work.claim.clone(), work.job.clone());
        match duty {
            Duty::Run if now < work.ends => {
                let left = work.ends - now;
                match self.beat(host, &claim) {
                    Lease::Held => left.min(LEASE / 4),
                    Lease::Cancel => self.send(host, slot, Step::Cancelled),
                    Lease::Lost => self.drop_work(host, slot),
                }
            }
            Duty::Run => {
                let step = self.outcome(&claim, &job);
                self.send(host, slot, step)
            }
            Duty::Stop => self.send(host, slot, Step::Cancelled),
            Duty::Intend => {
                let State::Concluded { ending, .. } = job.state else { panic!("{:?} has no ending", job.state) };
                self.send(host, slot, Step::Intend(publication(&job, claim.token, ending)))
            }
            Duty::Place | Duty::MoveOriginal if self.chance.one_in(40) => {
                let reason = "its place cannot be reached".to_owned();
                let committed = duty == Duty::MoveOriginal || self.is_in_place(&job);
                self.send(host, slot, Step::Park { reason, committed })
            }
            Duty::Place | Duty::MoveOriginal if !self.work(host, slot).looked => match self.beat(host, &claim) {
                Lease::Lost => self.drop_work(host, slot),
                Lease::Held | Lease::Cancel => {
                    self.work(host, slot).looked = true;
                    self.chance.between(1, 400)
                }
            },
            Duty::Place | Duty::MoveOriginal => {
                self.touch(&job);
                let step = if duty == Duty::Place { Step::Placed } else { Step::Finished };
                self.send(host, slot, step)
            }
            Duty::Queue | Duty::Rest => self.drop_work(host, slot),
        }
    }

    /// Brings a result, or an original, into its place.
    fn touch(&mut self, job: &Job) {
        match &job.state {
            State::Publishing { publication, .. } => {
                if let Some(hash) = publication.output_hash {
                    self.files.put(job.id, publication.ending.area(), hash);
                }
            }
            State::Published { publication, .. } => {
                let from = job.moved_to.as_ref().map_or(Area::In, |(area, _)| *area);
                self.files.move_original(job.id, from, publication.ending.area());
            }
            state => panic!("there is nothing to be put in place: {state:?}"),
        }
    }

    /// Is the result of a job that is being published there already?
    fn is_in_place(&self, job: &Job) -> bool {
        let State::Publishing { publication, .. } = &job.state else { return false };
        publication.output_hash.is_some_and(|hash| self.files.has(job.id, publication.ending.area(), hash))
    }

    /// The end of an attempt.
    fn outcome(&mut self, claim: &Claim, job: &Job) -> Step {
        let reason = || "by chance".to_owned();
        match self.chance.below(200) {
            0 => Step::Died(Death::Signal(11)),
            1 => Step::Died(Death::Killed(9)),
            2 | 3 => Step::Environment { reason: reason() },
            4 | 5 => Step::Wait { reason: reason() },
            6 if !job.hold().is_some_and(|hold| hold.alone) => Step::NeedsAll,
            7 => Step::HandBack,
            8..14 => Step::Intend(publication(job, claim.token, Ending::NotGood)),
            14..18 => Step::Intend(publication(job, claim.token, Ending::Unreadable)),
            18..24 if job.witness.is_none() => {
                Step::Sampled(Box::new(Witness::new("a host", "1", Recipe(claim.token.0), Hash([1; 32]))))
            }
            18..20 => Step::HandOn,
            _ => Step::Intend(publication(job, claim.token, Ending::Repaired)),
        }
    }

    /// Says that the work goes on; who hears nothing takes it for held.
    fn beat(&mut self, host: usize, claim: &Claim) -> Lease {
        let fate = self.fate(host);
        if matches!(fate, Fate::Before | Fate::Late) {
            return Lease::Held;
        }
        let seat = Arc::clone(self.hosts[host].seat.as_ref().expect("it is up"));
        let (lease, now) = (seat.heartbeat(claim).unwrap(), self.now());
        if lease != Lease::Lost {
            self.oracle.beat(claim, now);
        }
        if fate == Fate::Good { lease } else { Lease::Held }
    }

    fn drop_work(&mut self, host: usize, slot: usize) -> u64 {
        self.hosts[host].slots[slot] = None;
        100
    }

    /// Sends a step on its way; the pause after it.
    fn send(&mut self, host: usize, slot: usize, step: Step) -> u64 {
        let claim = self.work(host, slot).claim.clone();
        self.work(host, slot).step = Some(step.clone());
        match self.advance(host, &claim, step) {
            Ok(job) => {
                let work = self.work(host, slot);
                (work.job, work.step, work.looked) = (job, None, false);
                self.chance.between(1, 300)
            }
            Err(Lost::Refused(StoreError::Illegal { source: Illegal::Fenced, .. })) => self.drop_work(host, slot),
            Err(Lost::Refused(_)) => self.look_again(host, slot),
            // A daemon that does not know how its job is asks, or begins anew.
            Err(Lost::Unknown) if !self.is_calm && self.chance.one_in(50) => {
                self.hosts[host].seat = None;
                self.hosts[host].life += 1;
                self.after(3000, Act::Rise(host));
                0
            }
            Err(Lost::Unknown) => self.look_again(host, slot),
        }
    }

    fn advance(&mut self, host: usize, claim: &Claim, step: Step) -> Result<Job, Lost> {
        let fate = self.fate(host);
        let seat = Arc::clone(self.hosts[host].seat.as_ref().expect("it is up"));
        match fate {
            Fate::Before => return Err(Lost::Unknown),
            Fate::Late => {
                let delay = self.chance.between(1000, 3 * LEASE);
                self.after(delay, Act::Late(host, seat, Box::new((claim.clone(), step))));
                return Err(Lost::Unknown);
            }
            Fate::Good | Fate::After => {}
        }
        let done = seat.advance(claim, step);
        self.say(&|| {
            format!("host{host}: job {} {}{}", claim.id, word(&done), if fate == Fate::After { ", unheard" } else { "" })
        });
        self.took(claim, &done);
        if fate == Fate::After { Err(Lost::Unknown) } else { done.map_err(Lost::Refused) }
    }

    /// How is the job, of which a call has told nothing?
    fn look_again(&mut self, host: usize, slot: usize) -> u64 {
        let fate = self.fate(host);
        if fate != Fate::Good {
            return 3000;
        }
        let seat = Arc::clone(self.hosts[host].seat.as_ref().expect("it is up"));
        let work = self.work(host, slot);
        let mut found = None;
        seat.store(&mut |store| found = store.get(work.claim.id).unwrap());
        let job = found.expect("it was not forgotten");
        if job.hold().is_none_or(|hold| hold.token != work.claim.token) {
            return self.drop_work(host, slot);
        }
        // Where nothing was done, the same is said again.
        if job.seq != work.job.seq {
            (work.job, work.step, work.looked) = (job, None, false);
        }
        1000
    }
}
