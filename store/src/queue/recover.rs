//! The death of a daemon: what it had under claim is taken back, and what is known of its end is held against the file, or is not.

use std::collections::BTreeMap;

use super::{Head, Queue, index};
use crate::id::{Epoch, JobId, Time, Token};
use crate::job::{Event, Job, Kind, State, Testimony};
use crate::store::{Claim, Recovered, StoreError};
use crate::tables::Tables;

impl<T: Tables> Queue<T> {
    /// As [`crate::JobStore::recover`].
    pub(super) fn take_back_all(&self, testimony: &dyn Fn(&Job) -> Testimony) -> Result<Vec<Recovered>, StoreError> {
        self.tables.sound()?;
        let now = self.clock.now();
        // The witness may look at files and call back: not under the lock. No one else can touch what an earlier epoch holds,
        // but for an operator's cancel, which is why the jobs are read again below.
        let suspects = self.orphans(self.epoch())?;
        let running = |job: &Job| matches!(job.state, State::Running { .. });
        let one_ran = suspects.iter().filter(|job| running(job)).count() == 1;
        // What was being published is company, too, unless the job was claimed to run alone: that a publication is stuck must not
        // save a file that kills the daemon again and again.
        let alone = |job: &Job| one_ran && (suspects.len() == 1 || job.hold().is_some_and(|hold| hold.alone));
        let boot = self.clock.boot();
        let fell = |job: &Job| job.hold().is_some_and(|hold| hold.boot.differs(boot));
        let say = |job: &Job| if fell(job) { Testimony::Machine } else { testimony(job) };
        let said: BTreeMap<JobId, Testimony> = suspects.iter().filter(|job| running(job)).map(|job| (job.id, say(job))).collect();

        let inner = self.lock();
        let mut head = inner.head;
        let orphans = self.orphans(head.epoch)?;
        let mut recovered = Vec::with_capacity(orphans.len());
        for job in &orphans {
            let testimony = said.get(&job.id).copied().unwrap_or(Testimony::None);
            let heir = head.epoch;
            recovered.push(take_back(job, &mut head, heir, (alone(job), testimony), now)?);
        }
        let parked = self.wake_parked(&mut head, now)?;
        if recovered.is_empty() && parked.is_empty() {
            return Ok(recovered);
        }
        // All in one transaction: whether a job was alone can only be told while none of them is taken back yet.
        let mut changes: Vec<_> = orphans.iter().zip(&recovered).map(|(from, to)| (Some(from), &to.job)).collect();
        changes.extend(parked.iter().map(|(from, to)| (Some(from), to)));
        self.commit(inner, head, &changes)?;
        self.settle(head)?;
        Ok(recovered)
    }

    /// Takes one job back whose lease has run out, or whose daemon begins anew, where several daemons share the tables.
    #[cfg(test)]
    pub(crate) fn take_back_one(&self, id: JobId, heir: Epoch, testimony: Testimony) -> Result<Recovered, StoreError> {
        let inner = self.lock();
        let (before, mut head) = (self.known(id)?, inner.head);
        let recovered = take_back(&before, &mut head, heir, (false, testimony), self.clock.now())?;
        self.commit(inner, head, &[(Some(&before), &recovered.job)])?;
        self.settle(head)?;
        Ok(recovered)
    }

    /// Jobs under a claim of an earlier epoch.
    fn orphans(&self, epoch: Epoch) -> Result<Vec<Job>, StoreError> {
        let mut orphans = Vec::new();
        for kind in Kind::ALL.into_iter().filter(|kind| kind.is_held()) {
            for id in index::ids(&self.tables, kind)? {
                let job = self.known(id)?;
                if job.hold().is_some_and(|hold| hold.epoch < epoch) {
                    orphans.push(job);
                }
            }
        }
        orphans.sort_by_key(|job| job.id);
        Ok(orphans)
    }

    /// Parked jobs, before and after their pause was ended: with a new daemon there may be a new world.
    fn wake_parked(&self, head: &mut Head, now: Time) -> Result<Vec<(Job, Job)>, StoreError> {
        let mut woken = Vec::new();
        for id in index::ids(&self.tables, Kind::Parked)? {
            let before = self.known(id)?;
            let mut after = before.after(&Event::Retry, now).map_err(|source| StoreError::Illegal { id, source })?;
            head.seq.0 += 1;
            after.seq = head.seq;
            woken.push((before, after));
        }
        Ok(woken)
    }
}

/// One orphan after the death of its daemon, taken back by the life `heir`; counts on in `head`. Was it alone, and what is known of the end?
fn take_back(
    job: &Job,
    head: &mut Head,
    heir: Epoch,
    (alone, testimony): (bool, Testimony),
    now: Time,
) -> Result<Recovered, StoreError> {
    let illegal = |source| StoreError::Illegal { id: job.id, source };
    let void = job.hold().map(|hold| hold.token).unwrap_or_default();
    head.seq.0 += 1;
    let mut after = match job.state {
        State::Running { .. } => job.after(&Event::Interrupted { alone, testimony }, now).map_err(illegal)?,
        _ => job.clone(),
    };
    let token = Token(head.seq.0);
    let held = after.hold().is_some();
    if held {
        after = after.after(&Event::Reclaim { epoch: heir, token }, now).map_err(illegal)?;
    }
    after.seq = head.seq;
    let claim = held.then(|| Claim { id: job.id, token, job: after.clone() });
    Ok(Recovered { job: after, void, claim })
}
