//! All that must be so, kept apart from the store: it sees what truly happened to each call, also where the caller does not.

use std::collections::{BTreeMap, BTreeSet};

use super::ground::LEASE;
use crate::id::{Hash, JobId, Seq, Token};
use crate::job::{AGEING_MS, BACKOFF_CAP_MS, Job, Kind, State};
use crate::share::{Share, Shares};
use crate::store::{Claim, Filter};

/// Who holds a job, as far as the store has said.
#[derive(Clone, Copy, Debug)]
struct Holder {
    token: Token,
    until: u64,
}

/// A job that may be claimed, or rests.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Ready {
    folder: String,
    alone: bool,
    base: u8,
    since: u64,
    rests: Option<u64>,
}

/// Turns that folders had while the same ones went on to wait for theirs.
#[derive(Default)]
struct Span {
    folders: BTreeSet<String>,
    turns: BTreeMap<String, f64>,
}

#[derive(Default)]
pub(super) struct Oracle {
    shares: Shares,
    pub(super) jobs: BTreeMap<JobId, Kind>,
    holders: BTreeMap<JobId, Holder>,
    /// In work, of each folder.
    held: BTreeMap<String, BTreeSet<JobId>>,
    tokens: BTreeSet<Token>,
    /// Results that the store took an intent of, of each job.
    pub(super) intended: BTreeMap<JobId, BTreeSet<Hash>>,
    ready: BTreeMap<JobId, Ready>,
    by_age: BTreeMap<(bool, u8, String), BTreeSet<(u64, JobId)>>,
    resting: BTreeSet<(u64, JobId)>,
    parked: BTreeMap<JobId, u64>,
    span: Span,
    /// Transitions in which a job ended.
    pub(super) ends: BTreeMap<Seq, JobId>,
    told: BTreeSet<Seq>,
    heard: Seq,
    pub(super) claims: u64,
    pub(super) fenced: u64,
    pub(super) live: u64,
}

impl Oracle {
    pub(super) fn new(shares: &Shares) -> Self {
        Self { shares: shares.clone(), ..Self::default() }
    }

    fn share(&self, folder: &str) -> Share {
        self.shares.get(folder).copied().unwrap_or_default()
    }

    /// A job as it is now.
    pub(super) fn learn(&mut self, job: &Job) {
        let before = self.jobs.insert(job.id, job.kind());
        self.live += u64::from(job.kind().is_live());
        self.live -= u64::from(before.is_some_and(Kind::is_live));
        self.forget_line(job.id);
        let of_folder = self.held.entry(job.source.folder.clone()).or_default();
        if job.hold().is_some() {
            of_folder.insert(job.id)
        } else {
            of_folder.remove(&job.id)
        };
        if job.hold().is_none() {
            self.holders.remove(&job.id);
        }
        match job.kind() {
            Kind::Parked => drop(self.parked.insert(job.id, job.pause().unwrap_or_default().0)),
            kind if kind.is_queued() => {
                let base = u8::try_from(i64::from(job.priority)).unwrap();
                let (folder, alone) = (job.source.folder.clone(), job.must_run_alone());
                let ready = Ready { folder, alone, base, since: job.waits_since().0, rests: job.pause().map(|then| then.0) };
                self.enter_line(job.id, ready);
            }
            _ => {}
        }
        if matches!(job.state, State::Ended { .. }) && before.is_none_or(Kind::is_live) {
            assert!(self.ends.insert(job.seq, job.id).is_none(), "transition {:?} ended two jobs", job.seq);
        }
    }

    fn enter_line(&mut self, id: JobId, ready: Ready) {
        match ready.rests {
            Some(then) => drop(self.resting.insert((then, id))),
            None => {
                let key = (ready.alone, ready.base, ready.folder.clone());
                self.by_age.entry(key).or_default().insert((ready.since, id));
            }
        }
        self.ready.insert(id, ready);
    }

    fn forget_line(&mut self, id: JobId) {
        self.parked.remove(&id);
        let Some(ready) = self.ready.remove(&id) else { return };
        match ready.rests {
            Some(then) => drop(self.resting.remove(&(then, id))),
            None => {
                let key = (ready.alone, ready.base, ready.folder);
                let of_key = self.by_age.get_mut(&key).unwrap();
                of_key.remove(&(ready.since, id));
                if of_key.is_empty() {
                    self.by_age.remove(&key);
                }
            }
        }
    }

    /// Jobs whose pause is over are ready.
    fn wake(&mut self, now: u64) {
        while let Some((then, id)) = self.resting.first().copied().filter(|(then, _)| *then <= now) {
            self.resting.remove(&(then, id));
            let ready = Ready { rests: None, ..self.ready[&id].clone() };
            self.enter_line(id, ready);
        }
        assert!(self.resting.last().is_none_or(|(then, _)| *then <= now + BACKOFF_CAP_MS), "no pause is as long");
    }

    /// The highest priority that waits, as it counts after its wait, and the folders that have such a job and room for it.
    fn best(&self, alone: bool, now: u64) -> Option<(u64, BTreeSet<String>)> {
        let mut best: Option<(u64, BTreeSet<String>)> = None;
        for ((is_alone, base, folder), jobs) in &self.by_age {
            let most = self.share(folder).most_running;
            let held = self.held.get(folder).map_or(0, BTreeSet::len);
            if *is_alone != alone || most.is_some_and(|most| held >= most.get() as usize) {
                continue;
            }
            let since = jobs.first().unwrap().0;
            let rank = (u64::from(*base) + now.saturating_sub(since) / AGEING_MS).min(9);
            match &mut best {
                Some((highest, folders)) if *highest == rank => _ = folders.insert(folder.clone()),
                Some((highest, _)) if *highest > rank => {}
                _ => best = Some((rank, [folder.clone()].into())),
            }
        }
        best
    }

    /// Are there leases that ended, so that a claim may come with what they leave?
    pub(super) fn expired(&self, now: u64) -> Vec<JobId> {
        self.holders.iter().filter(|(_, holder)| holder.until <= now).map(|(id, _)| *id).collect()
    }

    /// A claim, or none, that was asked for while no lease had ended.
    pub(super) fn claimed_in_order(&mut self, want: &Filter, claim: Option<&Claim>, now: u64) {
        self.wake(now);
        let parked: Vec<JobId> = self.parked.iter().filter(|(_, then)| **then <= now).map(|(id, _)| *id).collect();
        let best = self.best(want.alone, now);
        let Some(claim) = claim else {
            assert!(parked.is_empty(), "{parked:?} are parked, and not given out");
            assert!(best.is_none(), "{best:?} waits, and is not given out to {want:?}");
            return;
        };
        if !parked.is_empty() {
            assert!(parked.contains(&claim.id), "{parked:?} go first, not {}", claim.id);
            return;
        }
        let Some(ready) = self.ready.get(&claim.id) else {
            panic!("job {} is given out while it does not wait: {:?}", claim.id, self.holders.get(&claim.id));
        };
        let Some((rank, folders)) = best else { panic!("job {} is given out of a folder that has no room", claim.id) };
        let own = (u64::from(ready.base) + now.saturating_sub(ready.since) / AGEING_MS).min(9);
        assert_eq!(own, rank, "{} goes before more urgent ones of {folders:?}", claim.id);
        assert!(folders.contains(&ready.folder), "{} is of a folder that has no room", claim.id);
        let folder = ready.folder.clone();
        self.count_turn(folders, folder);
    }

    /// Of folders that go on to wait, none gets ahead of another by more than two turns of each.
    fn count_turn(&mut self, folders: BTreeSet<String>, folder: String) {
        if self.span.folders != folders {
            self.span = Span { turns: folders.iter().map(|folder| (folder.clone(), 0.0)).collect(), folders };
        }
        let weight = |folder: &str| f64::from(u8::from(self.shares.get(folder).copied().unwrap_or_default().weight));
        *self.span.turns.get_mut(&folder).unwrap() += 1.0;
        for (one, turns) in &self.span.turns {
            for (other, others) in &self.span.turns {
                let apart = turns / weight(one) - others / weight(other);
                let bound = 2.0 / weight(one) + 2.0 / weight(other);
                assert!(apart <= bound, "{one} had {turns} turns, {other} {others}, of {:?}", self.span.turns);
            }
        }
    }

    /// Turns begin anew.
    pub(super) fn forget_turns(&mut self) {
        self.span = Span::default();
    }

    /// The host has the claim; `gone`: the life that held the job before is over.
    pub(super) fn gave(&mut self, host: usize, token: Token, job: &Job, gone: bool, now: u64) {
        self.claims += 1;
        assert!(self.tokens.insert(token), "token {token:?} was given out before");
        if let Some(before) = self.holders.get(&job.id).filter(|_| !gone) {
            assert!(before.until <= now, "{} is given to host {host} while {before:?} holds it, at {now}", job.id);
        }
        self.learn(job);
        self.holders.insert(job.id, Holder { token, until: now + LEASE });
    }

    /// The store says that the claim holds.
    pub(super) fn beat(&mut self, claim: &Claim, now: u64) {
        let holder = self.holders.get_mut(&claim.id).filter(|holder| holder.token == claim.token);
        let Some(holder) = holder else { panic!("{:?} of job {} is void, and yet held", claim.token, claim.id) };
        if holder.until < now + LEASE - LEASE / 4 {
            holder.until = now + LEASE;
        }
    }

    /// The store took a step of that claim.
    pub(super) fn stepped(&mut self, claim: &Claim, job: &Job, now: u64) {
        let holder = self.holders.get_mut(&claim.id).filter(|holder| holder.token == claim.token);
        let Some(holder) = holder else { panic!("a fenced step was taken: {:?} of job {}", claim.token, claim.id) };
        holder.until = now + LEASE;
        if let State::Publishing { publication, .. } = &job.state {
            self.intended.entry(job.id).or_default().extend(publication.output_hash);
        }
        self.learn(job);
    }

    /// Entries that were told, the last that was acknowledged before.
    pub(super) fn told(&mut self, jobs: &[Job]) {
        for job in jobs {
            assert!(job.seq > self.heard, "{:?} is told again after it was acknowledged", job.seq);
            assert_eq!(self.ends.get(&job.seq), Some(&job.id), "an end that was none is told");
            self.told.insert(job.seq);
        }
        assert!(jobs.windows(2).all(|two| two[0].seq < two[1].seq), "they are told in their order, each once");
    }

    pub(super) fn acknowledged(&mut self, seq: Seq) {
        self.heard = self.heard.max(seq);
        // No end of before is told any more: then it must have been.
        let untold = self.ends.keys().find(|end| **end <= self.heard && !self.told.contains(end));
        assert!(untold.is_none(), "{untold:?} was never told");
    }

    /// Nothing waits to be told.
    pub(super) fn all_told(&self) -> bool {
        self.ends.keys().all(|end| self.told.contains(end))
    }

    /// Is it held by that token, or by none?
    pub(super) fn holds(&self, id: JobId, token: Option<Token>) -> bool {
        self.holders.get(&id).map(|holder| holder.token) == token
    }
}
