//! Stores that several daemons share, with lives, leases and a clock that is set: here the embedded queue over tables in memory.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::id::{Clock, Epoch, JobId, Token};
use crate::job::{Illegal, Job, Step, Testimony};
use crate::memory::Memory;
use crate::queue::Queue;
use crate::store::{Claim, Filter, JobStore, Lease, Recovered, StoreError};
use crate::testkit::ManualClock;

/// A lease, in ms.
pub(super) const LEASE: u64 = 60_000;

/// A store that is made worse, to see that it is noticed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Flaw {
    None,
    /// Steps are taken from whoever held the job once.
    Unfenced,
    /// Leases end when half of them is over.
    Hasty,
    /// Of what was told nothing is noted.
    Deaf,
    /// Weights of folders are not heard of.
    Unfair,
    /// Nor how many of a folder's jobs may be in work.
    Boundless,
    /// A submission is acknowledged, and now and then forgotten.
    Forgetful,
    /// That a lease has run out is told to nobody who asks whether there is something to claim.
    Silent,
}

/// A store that several daemons share.
pub(super) trait Ground {
    /// A life of the daemon of that name begins, and ends those before.
    fn begin(&self, daemon: &str) -> Arc<dyn Seat>;
    /// The database goes down, and comes up again.
    fn restart(&self);
}

/// A daemon's life on the store.
pub(super) trait Seat {
    /// All that is the same for every life.
    fn store(&self, call: &mut dyn FnMut(&dyn JobStore));
    /// Is a claim worth the asking? A daemon with nothing else to do asks this first.
    fn has(&self, want: &Filter) -> Result<bool, StoreError>;
    fn claim(&self, want: &Filter) -> Result<Option<Claim>, StoreError>;
    fn heartbeat(&self, claim: &Claim) -> Result<Lease, StoreError>;
    fn advance(&self, claim: &Claim, step: Step) -> Result<Job, StoreError>;
    fn recover(&self) -> Result<Vec<Recovered>, StoreError>;
}

/// Lives and leases, beside the tables: PostgreSQL has them in columns.
#[derive(Default)]
struct Beside {
    last: u64,
    /// Whose each life is or was.
    daemons: BTreeMap<Epoch, String>,
    /// The present life of each daemon.
    lives: BTreeMap<String, Epoch>,
    held: BTreeMap<JobId, Held>,
    looked: u64,
}

#[derive(Clone, Copy)]
struct Held {
    epoch: Epoch,
    token: Token,
    until: u64,
}

struct Inner {
    queue: Mutex<Option<Queue<Memory>>>,
    beside: Mutex<Beside>,
    clock: Arc<ManualClock>,
    flaw: Flaw,
}

impl Inner {
    fn queue<T>(&self, call: impl FnOnce(&Queue<Memory>) -> T) -> T {
        let queue = self.queue.lock().unwrap_or_else(PoisonError::into_inner);
        call(queue.as_ref().unwrap())
    }

    fn beside(&self) -> MutexGuard<'_, Beside> {
        self.beside.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn now(&self) -> u64 {
        self.clock.now().0
    }

    /// The end of a lease that begins now.
    fn lease_end(&self) -> u64 {
        self.now() + if self.flaw == Flaw::Hasty { LEASE / 2 } else { LEASE }
    }

    /// Notes who holds the job after a transition.
    fn note(&self, job: &Job) {
        let until = self.lease_end();
        let mut beside = self.beside();
        match job.hold() {
            Some(hold) => drop(beside.held.insert(job.id, Held { epoch: hold.epoch, token: hold.token, until })),
            None => drop(beside.held.remove(&job.id)),
        }
    }

    /// Takes back what leases have run out of; the first that comes with something to be done.
    fn take_back(&self, heir: Epoch) -> Result<Option<Claim>, StoreError> {
        let now = self.now();
        let over: Vec<_> = self.beside().held.iter().filter(|(_, held)| held.until <= now).map(|(id, _)| *id).collect();
        for id in over {
            let recovered = self.queue(|queue| queue.take_back_one(id, heir, Testimony::None))?;
            self.note(&recovered.job);
            if recovered.claim.is_some() {
                return Ok(recovered.claim);
            }
        }
        Ok(None)
    }
}

/// Several daemons on tables in memory.
pub(super) struct InMemory(Arc<Inner>);

impl InMemory {
    pub(super) fn new(clock: &Arc<ManualClock>, flaw: Flaw) -> Self {
        let queue = Queue::open(Memory::default(), Arc::clone(clock) as Arc<dyn Clock>).unwrap();
        let (queue, clock) = (Mutex::new(Some(queue)), Arc::clone(clock));
        Self(Arc::new(Inner { queue, beside: Mutex::default(), clock, flaw }))
    }
}

impl Ground for InMemory {
    fn begin(&self, daemon: &str) -> Arc<dyn Seat> {
        let mut beside = self.0.beside();
        beside.last += 1;
        let epoch = Epoch(beside.last);
        beside.lives.insert(daemon.to_owned(), epoch);
        beside.daemons.insert(epoch, daemon.to_owned());
        let until = self.0.now() + LEASE;
        let Beside { held, daemons, .. } = &mut *beside;
        held.values_mut().filter(|held| daemons[&held.epoch] == daemon).for_each(|held| held.until = until);
        Arc::new(InMemorySeat { inner: Arc::clone(&self.0), daemon: daemon.to_owned(), epoch })
    }

    fn restart(&self) {
        let mut queue = self.0.queue.lock().unwrap();
        let tables = queue.take().unwrap().into_tables();
        *queue = Some(Queue::open(tables, Arc::clone(&self.0.clock) as Arc<dyn Clock>).unwrap());
    }
}

struct InMemorySeat {
    inner: Arc<Inner>,
    daemon: String,
    epoch: Epoch,
}

impl InMemorySeat {
    fn lives(&self) -> bool {
        self.inner.beside().lives.get(&self.daemon) == Some(&self.epoch)
    }

    fn over(&self) -> StoreError {
        StoreError::Poisoned { reason: format!("another daemon has begun under the name {}", self.daemon) }
    }

    /// As the row has it: the holder of the token, as long as his life.
    fn holds(&self, claim: &Claim) -> bool {
        let held = self.inner.beside().held.get(&claim.id).copied();
        self.lives() && held.is_some_and(|held| held.token == claim.token && held.epoch == self.epoch)
    }
}

impl Seat for InMemorySeat {
    fn store(&self, call: &mut dyn FnMut(&dyn JobStore)) {
        self.inner.queue(|queue| call(queue));
    }

    fn has(&self, want: &Filter) -> Result<bool, StoreError> {
        let now = self.inner.now();
        let is_left = self.inner.beside().held.values().any(|held| held.until <= now);
        let waits = self.inner.queue(|queue| Ok::<_, StoreError>(queue.has_parked()? || queue.waiting(want)?.is_some()))?;
        Ok(waits || (is_left && self.inner.flaw != Flaw::Silent))
    }

    fn claim(&self, want: &Filter) -> Result<Option<Claim>, StoreError> {
        if !self.lives() {
            return Err(self.over());
        }
        let now = self.inner.now();
        let is_time = now >= self.inner.beside().looked + LEASE / 4;
        if is_time {
            self.inner.beside().looked = now;
            if let Some(claim) = self.inner.take_back(self.epoch)? {
                return Ok(Some(claim));
            }
        }
        let next = || self.inner.queue(|queue| queue.claim_for(self.epoch, want));
        let found = match next()? {
            None if !is_time => match self.inner.take_back(self.epoch)? {
                None => next()?,
                taken => return Ok(taken),
            },
            found => found,
        };
        found.iter().for_each(|claim| self.inner.note(&claim.job));
        Ok(found)
    }

    fn heartbeat(&self, claim: &Claim) -> Result<Lease, StoreError> {
        if !self.holds(claim) {
            return Ok(Lease::Lost);
        }
        let lease = self.inner.queue(|queue| queue.holds(self.epoch, claim))?;
        let now = self.inner.now();
        let mut beside = self.inner.beside();
        if let Some(held) = beside.held.get_mut(&claim.id).filter(|held| held.until < now + LEASE - LEASE / 4) {
            held.until = self.inner.lease_end();
        }
        Ok(lease)
    }

    fn advance(&self, claim: &Claim, step: Step) -> Result<Job, StoreError> {
        let job = if self.inner.flaw == Flaw::Unfenced {
            let held = self.inner.beside().held.get(&claim.id).copied();
            let held = held.map_or((self.epoch, claim.token), |held| (held.epoch, held.token));
            let claim = Claim { token: held.1, ..claim.clone() };
            self.inner.queue(|queue| queue.advance_for(held.0, &claim, step))?
        } else {
            if !self.lives() {
                return Err(StoreError::Illegal { id: claim.id, source: Illegal::Fenced });
            }
            self.inner.queue(|queue| queue.advance_for(self.epoch, claim, step))?
        };
        self.inner.note(&job);
        Ok(job)
    }

    fn recover(&self) -> Result<Vec<Recovered>, StoreError> {
        let beside = self.inner.beside();
        let of_mine = |held: &Held| held.epoch < self.epoch && beside.daemons[&held.epoch] == self.daemon;
        let mine: Vec<JobId> = beside.held.iter().filter(|(_, held)| of_mine(held)).map(|(id, _)| *id).collect();
        drop(beside);
        let mut all = Vec::new();
        for id in mine {
            let recovered = self.inner.queue(|queue| queue.take_back_one(id, self.epoch, Testimony::Outlived))?;
            self.inner.note(&recovered.job);
            all.push(recovered);
        }
        Ok(all)
    }
}
