//! The job store, seen by the [`Bus`]: every change that became durable is told there, by whomever it was made. Nothing else is added to it.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Instant;

use suture_store::job::Testimony;
use suture_store::{
    Claim, Control, Filter, Host, Job, JobId, JobStore, Kind, Lease, Look, News, Notice, Page, Past, Query, Recipe, Recovered,
    Seq, Shares, Source, State, Station, Step, StoreError, Submission, Submitted, Time, Waiting,
};

use crate::event::Happening;
use crate::event_bus::Bus;
use crate::event_metrics::{Count, Timing};

/// A store whose changes are told.
pub(crate) struct Heard {
    store: Arc<dyn JobStore>,
    bus: Arc<Bus>,
}

impl Heard {
    pub(crate) fn new(store: Arc<dyn JobStore>, bus: Arc<Bus>) -> Self {
        Self { store, bus }
    }

    /// Counts what goes wrong.
    fn read<T>(&self, result: Result<T, StoreError>) -> Result<T, StoreError> {
        if result.as_ref().is_err_and(|error| !error.is_callers()) {
            self.bus.metrics.add(Count::StoreErrors, &[], 1);
        }
        result
    }

    /// The same of a change, with the time that it took.
    fn write<T>(&self, change: impl FnOnce(&dyn JobStore) -> Result<T, StoreError>) -> Result<T, StoreError> {
        let began = Instant::now();
        let changed = self.read(change(&*self.store))?;
        self.bus.metrics.observe(Timing::StoreFlush, &[], began.elapsed().as_secs_f64());
        Ok(changed)
    }

    fn note(&self, job: &Job) {
        if job.kind() != Kind::Running {
            self.bus.rest(job.id);
        }
        match &job.state {
            State::Publishing { .. } => self.bus.publishing(job.id, true),
            State::Published { .. } => {}
            _ => self.bus.publishing(job.id, false),
        }
    }
}

impl JobStore for Heard {
    fn submit(&self, found: &[Submission]) -> Result<Vec<Submitted>, StoreError> {
        let answers = self.write(|store| store.submit(found))?;
        for (answer, submission) in answers.iter().zip(found).filter(|(answer, _)| answer.new) {
            self.bus.tell(&Happening::Came { id: answer.id, submission });
        }
        Ok(answers)
    }

    fn claim(&self, want: &Filter) -> Result<Option<Claim>, StoreError> {
        let began = Instant::now();
        let claim = self.read(self.store.claim(want))?;
        if let Some(claim) = &claim {
            self.bus.metrics.observe(Timing::StoreFlush, &[], began.elapsed().as_secs_f64());
            self.bus.tell(&Happening::Began { job: &claim.job });
        }
        Ok(claim)
    }

    fn has_parked(&self) -> Result<bool, StoreError> {
        self.read(self.store.has_parked())
    }

    fn waiting(&self, want: &Filter) -> Result<Option<Waiting>, StoreError> {
        self.read(self.store.waiting(want))
    }

    fn shut(&self, folders: &BTreeSet<String>) {
        self.store.shut(folders);
    }

    fn share(&self, shares: &Shares) {
        self.store.share(shares);
    }

    fn heartbeat(&self, claim: &Claim) -> Result<Lease, StoreError> {
        self.read(self.store.heartbeat(claim))
    }

    fn advance(&self, claim: &Claim, step: Step) -> Result<Job, StoreError> {
        let told = step.clone();
        let job = self.write(|store| store.advance(claim, step))?;
        self.note(&job);
        self.bus.tell(&Happening::Moved { job: &job, step: &told });
        Ok(job)
    }

    fn control(&self, id: JobId, wish: Control) -> Result<Job, StoreError> {
        let told = wish.clone();
        let job = self.write(|store| store.control(id, wish))?;
        self.note(&job);
        self.bus.tell(&Happening::Wished { job: &job, wish: &told });
        Ok(job)
    }

    fn recover(&self, testimony: &dyn Fn(&Job) -> Testimony) -> Result<Vec<Recovered>, StoreError> {
        self.write(|store| store.recover(testimony))
    }

    fn is_unfilled(&self) -> Result<bool, StoreError> {
        self.read(self.store.is_unfilled())
    }

    fn restore(&self, past: &[Past]) -> Result<Vec<JobId>, StoreError> {
        self.write(|store| store.restore(past))
    }

    fn set_filled(&self) -> Result<(), StoreError> {
        self.write(|store| store.set_filled())
    }

    fn get(&self, id: JobId) -> Result<Option<Job>, StoreError> {
        self.read(self.store.get(id))
    }

    fn list(&self, query: &Query) -> Result<Vec<Job>, StoreError> {
        self.read(self.store.list(query))
    }

    fn page(&self, look: &Look) -> Result<Page, StoreError> {
        self.read(self.store.page(look))
    }

    fn find(&self, source: &Source) -> Result<Option<JobId>, StoreError> {
        self.read(self.store.find(source))
    }

    fn results(&self, size: u64, recipe: Option<Recipe>) -> Result<Vec<Job>, StoreError> {
        self.read(self.store.results(size, recipe))
    }

    fn check(&self) -> Result<(), StoreError> {
        self.read(self.store.check())
    }

    fn forget(&self, ids: &[JobId]) -> Result<u64, StoreError> {
        let forgotten = self.write(|store| store.forget(ids))?;
        let all = forgotten == ids.len() as u64;
        for id in ids.iter().copied() {
            if all || self.store.get(id)?.is_none() {
                self.bus.tell(&Happening::Forgotten { id });
            }
        }
        Ok(forgotten)
    }

    fn subscribe(&self, names: &[String]) -> Result<(), StoreError> {
        self.read(self.store.subscribe(names))
    }

    fn notices(&self, name: &str, most: usize) -> Result<Vec<Notice>, StoreError> {
        self.read(self.store.notices(name, most))
    }

    fn acknowledge(&self, name: &str, seq: Seq) -> Result<(), StoreError> {
        self.write(|store| store.acknowledge(name, seq))
    }

    fn backlog(&self, name: &str) -> Result<u64, StoreError> {
        self.read(self.store.backlog(name))
    }

    fn tell(&self, news: &News) -> Result<bool, StoreError> {
        self.read(self.store.tell(news))
    }

    fn last_night(&self) -> Result<Option<Time>, StoreError> {
        self.read(self.store.last_night())
    }

    fn begin_night(&self, at: Time) -> Result<(), StoreError> {
        self.read(self.store.begin_night(at))
    }

    fn counts(&self) -> Result<Vec<(Kind, u64)>, StoreError> {
        self.read(self.store.counts())
    }

    fn away(&self) -> Option<Time> {
        self.store.away()
    }

    fn hear(&self, news: Arc<dyn Fn() + Send + Sync>) {
        self.store.hear(news);
    }

    fn hosts(&self) -> Result<Vec<Host>, StoreError> {
        self.read(self.store.hosts())
    }

    fn announce(&self, station: &Station) {
        self.store.announce(station);
    }

    fn drain(&self, name: &str, drains: bool) -> Result<bool, StoreError> {
        self.write(|store| store.drain(name, drains))
    }

    fn is_draining(&self) -> Result<bool, StoreError> {
        self.read(self.store.is_draining())
    }
}
