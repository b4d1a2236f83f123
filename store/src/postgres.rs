//! The shared store, on PostgreSQL: many daemons, on one machine or on many, work on one queue.
//!
//! | what                | how                                                                                                       |
//! |---------------------|-----------------------------------------------------------------------------------------------------------|
//! | a claim             | one call (`sql/claim.sql`), rows that others are about to take skipped                                    |
//! | a step              | the row is read, judged by the state machine, and set if it is still the one that was read                |
//! | who may step        | the holder of the row's token; a new claim, and the end of the holder's life, takes it from him           |
//! | time                | the database's clock; what a machine says of itself is only which start of it this is                     |
//! | leases              | end by that clock, begin anew with each step, heartbeat, and by a task of the store's own while it lives  |
//! | a daemon's life     | a row of `lives`: a daemon of the same name that begins ends those before; it says what the daemon is     |
//! | who tells of ends   | daemons that serve the same folders together are one teller: of those that live, the first that began     |
//! | numbers             | of transitions: a sequence, with gaps; of jobs: the head's row, without                                   |
//!
//! **Errors.** While the database is away, calls wait for it and are made again, up to the store's patience; each sees for itself whether it was done
//! before. A call that gave up says [`StoreError::Backend`]; only [`JobStore::restore`] and [`JobStore::recover`] do so at once, when a connection
//! ends in the middle. Of a submission that had to be made again, the files may be said to be known already, and of news, that they are no news: they
//! were taken in by the first try. Nothing that was acknowledged is lost, as far as the database keeps its word; one that runs without `fsync` is
//! refused.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicI64, AtomicU32, Ordering};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use sqlx::postgres::PgConnection;
use tokio::runtime::Runtime;

use crate::host::{Host, Station};
#[cfg(any(test, feature = "testkit"))]
use crate::id::Clock;
use crate::id::{Epoch, JobId, Recipe, Seq, Time};
use crate::job::{Event, Illegal, Job, Kind, Past, Source, Step, Testimony, one_line};
use crate::news::{News, Notice};
use crate::patience::{brief, is_brief};
use crate::queue::fits;
use crate::queue::notices::can_be_subscribers;
use crate::queue::past::can_be_recorded;
use crate::queue::submit::{CHUNK, can_be_taken};
use crate::share::Shares;
use crate::store::{
    Claim, Control, Filter, JobStore, Lease, Look, Page, Query, Recovered, StoreError, Submission, Submitted, Waiting,
};
use crate::transfer::{Holdings, SharedStore, Transfer};

mod claim;
mod database;
mod hosts;
mod leases;
mod look;
mod marks;
mod migrate;
mod news;
mod notices;
mod open;
mod outage;
mod outbox;
mod recover;
mod row;
mod step;
mod submit;
#[cfg(test)]
mod tests;
mod together;
mod transfer;
mod turns;
mod write;

use claim::{Ask, Claiming, Life};
use database::{Again, Database, Failure, wait};
use leases::Claims;
use open::As;
pub use open::{Shared, role};
use step::{Stepping, Tried, Way};
use together::Together;
use turns::Folders;
use write::By;

/// So many statements of claims and of steps are under way at a time; what comes meanwhile goes with the next.
const CLAIMS_AT_ONCE: usize = 4;
const STEPS_AT_ONCE: usize = 12;

/// The shared [`JobStore`].
pub struct PostgresStore {
    runtime: Option<Arc<Runtime>>,
    /// Ends the thread that keeps the leases, which drops the runtime: whoever drops the store may be part of another one.
    end: Sender<Arc<Runtime>>,
    database: Arc<Database>,
    life: Life,
    claims: Arc<Claims>,
    claiming: Claiming,
    stepping: Stepping,
    shut: Mutex<Vec<String>>,
    shares: Mutex<Shares>,
    /// Of the words that wake idle daemons.
    channel: String,
    /// Names claims among all of this life.
    calls: AtomicI64,
    /// When leases of others were looked at last. Only how often depends on it.
    looked: Mutex<Option<Instant>>,
}

impl PostgresStore {
    /// Opens the shared store, or makes it, and begins a new life of the daemon. What its earlier lives left running is found by
    /// [`JobStore::recover`].
    ///
    /// # Errors
    /// [`StoreError::Newer`] and [`StoreError::Unusable`] when the schema is another program's, or the database does not keep what it acknowledges;
    /// [`StoreError::Backend`] when it cannot be reached.
    pub fn open(shared: &Shared) -> Result<Self, StoreError> {
        open::begin(shared, As::Daemon, None).map(Self::over)
    }

    /// Opens a store that is there, to look at it, or to say what is to become of jobs: no life of a daemon begins or ends, and nothing can be
    /// claimed. `shared.daemon` says whose marks and claims it takes over ([`Transfer::take_over`]).
    ///
    /// # Errors
    /// As [`PostgresStore::open`]; [`StoreError::Unusable`] as well when there is no store.
    pub fn visit(shared: &Shared) -> Result<Self, StoreError> {
        open::begin(shared, As::Visitor, None).map(Self::over)
    }

    /// The same under a clock that the caller sets, for tests: no machine's clock is asked.
    ///
    /// # Errors
    /// As [`PostgresStore::open`].
    #[cfg(any(test, feature = "testkit"))]
    pub fn open_at(shared: &Shared, clock: Arc<dyn Clock>) -> Result<Self, StoreError> {
        open::begin(shared, As::Daemon, Some(clock)).map(Self::over)
    }

    fn over(open::Begun { runtime, end, database, life, claims, channel }: open::Begun) -> Self {
        let (claiming, stepping, calls) = (Together::new(CLAIMS_AT_ONCE), Together::new(STEPS_AT_ONCE), AtomicI64::new(1));
        let (shut, shares, looked) = (Mutex::default(), Mutex::default(), Mutex::default());
        Self { runtime: Some(runtime), end, database, life, claims, claiming, stepping, shut, shares, channel, calls, looked }
    }

    /// Makes the store, or brings it up to date, and begins nothing: for the owner of its schema.
    ///
    /// # Errors
    /// As [`PostgresStore::open`].
    pub fn make(shared: &Shared) -> Result<(), StoreError> {
        open::begin(shared, As::Owner, None).map(Self::over).map(drop)
    }

    /// Ends as a kill would: its life is not noted as over.
    #[cfg(test)]
    fn end_without_a_word(mut self) {
        self.life.epoch = Epoch(0);
    }

    fn call<T: Send>(
        &self,
        again: Again,
        call: impl AsyncFn(&mut PgConnection) -> Result<T, Failure> + Sync,
    ) -> Result<T, StoreError> {
        let Some(runtime) = &self.runtime else { return Err(StoreError::Poisoned { reason: "the store was closed".into() }) };
        let is_brief = is_brief();
        wait(runtime, async || self.database.call(again, is_brief, &call).await)
    }

    fn ask<T: Send>(&self, call: impl AsyncFn(&mut PgConnection) -> Result<T, Failure> + Sync) -> Result<T, StoreError> {
        self.call(Again::Yes, call)
    }

    fn way<'a>(&'a self, tried: &'a Mutex<Tried>) -> Way<'a> {
        Way { stepping: &self.stepping, clock: &*self.life.machine, tried }
    }

    fn served(&self) -> Option<&[String]> {
        self.life.folders.as_deref()
    }

    fn folders_shut(&self) -> Vec<String> {
        self.shut.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn folders(&self) -> Folders {
        Folders::new(self.folders_shut(), &self.shares.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Is it time to look at the leases of others?
    fn is_time_to_look(&self) -> bool {
        let mut looked = self.looked.lock().unwrap_or_else(PoisonError::into_inner);
        let pause = Duration::from_millis(self.life.lease.unsigned_abs() / 4);
        let is_time = looked.is_none_or(|looked| looked.elapsed() >= pause);
        if is_time {
            *looked = Some(Instant::now());
        }
        is_time
    }

    fn take_back(&self) -> Result<Option<Claim>, StoreError> {
        let shut = self.folders_shut();
        let found = self.ask(async |connection| claim::take_back(connection, &self.life, &shut).await)?;
        found.iter().for_each(|claim| self.claims.keep(claim, None));
        Ok(found)
    }

    fn next(&self, want: &Filter) -> Result<Option<Claim>, StoreError> {
        let (ask, tries) = (Ask { want: *want, call: self.calls.fetch_add(1, Ordering::Relaxed) }, AtomicU32::new(0));
        let found = self.ask(async |connection| {
            let again = tries.fetch_add(1, Ordering::Relaxed) > 0;
            claim::claim(connection, &self.life, &self.claiming, ask, || self.folders(), again).await
        })?;
        Ok(found.map(|(claim, seen)| {
            self.claims.keep(&claim, seen);
            claim
        }))
    }
}

impl Drop for PostgresStore {
    fn drop(&mut self) {
        if self.life.epoch != Epoch(0) {
            let ended = brief(|| self.ask(async |connection| leases::end(connection, &self.life).await));
            // Then others take it for dead after a lease.
            ended.unwrap_or_else(|error| tracing::debug!(%error, "The end of this daemon's life could not be noted."));
        }
        let unheard = self.runtime.take().and_then(|runtime| self.end.send(runtime).err());
        if let Some(runtime) = unheard.and_then(|unheard| Arc::into_inner(unheard.0)) {
            runtime.shutdown_background();
        }
    }
}

impl Transfer for PostgresStore {
    fn holdings(&self) -> Result<Holdings, StoreError> {
        self.ask(async |connection| transfer::holdings(connection).await)
    }

    fn take_over(&self, holdings: &Holdings) -> Result<(), StoreError> {
        self.call(Again::No, async |connection| transfer::take_over(connection, &self.life, holdings).await)
    }
}

impl SharedStore for PostgresStore {
    fn verify(&self) -> Result<Vec<String>, StoreError> {
        self.ask(async |connection| transfer::verify(connection).await)
    }
}

impl JobStore for PostgresStore {
    fn submit(&self, found: &[Submission]) -> Result<Vec<Submitted>, StoreError> {
        can_be_taken(found)?;
        let mut answers = Vec::with_capacity(found.len());
        for chunk in found.chunks(CHUNK) {
            answers.extend(self.ask(async |connection| submit::submit(connection, chunk).await)?);
        }
        Ok(answers)
    }

    fn claim(&self, want: &Filter) -> Result<Option<Claim>, StoreError> {
        let has_looked = self.is_time_to_look();
        if has_looked && let Some(claim) = self.take_back()? {
            return Ok(Some(claim));
        }
        let found = self.next(want)?;
        if found.is_some() || has_looked {
            return Ok(found);
        }
        // With nothing else to do, what others have lost is wanted at once.
        match self.take_back()? {
            Some(claim) => Ok(Some(claim)),
            None => self.next(want),
        }
    }

    fn has_parked(&self) -> Result<bool, StoreError> {
        let shut = self.folders_shut();
        self.ask(async |connection| claim::has_parked(connection, &self.life, &shut).await)
    }

    fn waiting(&self, want: &Filter) -> Result<Option<Waiting>, StoreError> {
        let folders = self.folders();
        self.ask(async |connection| claim::waiting(connection, &self.life, want, &folders).await)
    }

    fn shut(&self, folders: &BTreeSet<String>) {
        *self.shut.lock().unwrap_or_else(PoisonError::into_inner) = folders.iter().cloned().collect();
    }

    fn share(&self, shares: &Shares) {
        self.shares.lock().unwrap_or_else(PoisonError::into_inner).clone_from(shares);
    }

    fn heartbeat(&self, claim: &Claim) -> Result<Lease, StoreError> {
        let lease = self.ask(async |connection| claim::heartbeat(connection, &self.life, claim).await)?;
        if lease == Lease::Lost {
            self.claims.end(claim);
        }
        Ok(lease)
    }

    fn advance(&self, claim: &Claim, step: Step) -> Result<Job, StoreError> {
        let by = By::Holder { token: claim.token, lease: self.life.lease };
        let tried = Tried::knowing(self.claims.seen(claim));
        let stepped = self.ask(async |connection| {
            step::transition(connection, claim.id, by, self.way(&tried), |stored| {
                let is_held = stored.token == Some(claim.token) && stored.epoch == Some(self.life.epoch);
                is_held.then(|| Event::Step { token: claim.token, step: step.clone() }).ok_or(Illegal::Fenced)
            })
            .await
        });
        match stepped {
            Ok(seen) => {
                let job = seen.stored.job.clone();
                if job.hold().is_some() {
                    self.claims.go_on(claim, seen)
                } else {
                    self.claims.end(claim)
                }
                Ok(job)
            }
            Err(error) => {
                if matches!(error, StoreError::Illegal { source: Illegal::Fenced, .. }) {
                    self.claims.end(claim);
                }
                Err(error)
            }
        }
    }

    fn control(&self, id: JobId, wish: Control) -> Result<Job, StoreError> {
        let event = Event::from(wish);
        let tried = Tried::knowing(None);
        let way = self.way(&tried);
        let seen = self.ask(async |connection| step::transition(connection, id, By::Operator, way, |_| Ok(event.clone())).await);
        Ok(seen?.stored.job)
    }

    fn recover(&self, testimony: &dyn Fn(&Job) -> Testimony) -> Result<Vec<Recovered>, StoreError> {
        let orphans = self.ask(async |connection| recover::orphans(connection, &self.life).await)?;
        let verdicts = recover::ask(&orphans, &self.life, testimony);
        let recovered = self.call(Again::No, async |connection| recover::take_back(connection, &self.life, &verdicts).await)?;
        recovered.iter().filter_map(|one| one.claim.as_ref()).for_each(|claim| self.claims.keep(claim, None));
        Ok(recovered)
    }

    fn get(&self, id: JobId) -> Result<Option<Job>, StoreError> {
        self.ask(async |connection| look::get(connection, id).await)
    }

    fn list(&self, query: &Query) -> Result<Vec<Job>, StoreError> {
        self.ask(async |connection| look::list(connection, self.served(), query).await)
    }

    fn page(&self, look: &Look) -> Result<Page, StoreError> {
        self.ask(async |connection| look::page(connection, self.served(), look).await)
    }

    fn find(&self, source: &Source) -> Result<Option<JobId>, StoreError> {
        self.ask(async |connection| look::find(connection, source).await)
    }

    fn results(&self, size: u64, recipe: Option<Recipe>) -> Result<Vec<Job>, StoreError> {
        self.ask(async |connection| look::results(connection, self.served(), size, recipe).await)
    }

    fn check(&self) -> Result<(), StoreError> {
        self.ask(async |connection| claim::check(connection, &self.life).await)
    }

    fn forget(&self, ids: &[JobId]) -> Result<u64, StoreError> {
        let chunks = ids.chunks(CHUNK);
        chunks.map(|chunk| self.ask(async |connection| submit::forget(connection, chunk).await)).sum()
    }

    fn is_unfilled(&self) -> Result<bool, StoreError> {
        self.ask(async |connection| marks::is_unfilled(connection, &self.life).await)
    }

    fn restore(&self, past: &[Past]) -> Result<Vec<JobId>, StoreError> {
        past.iter().try_for_each(can_be_recorded)?;
        let mut ids = Vec::with_capacity(past.len());
        for chunk in past.chunks(CHUNK) {
            ids.extend(self.call(Again::No, async |connection| submit::restore(connection, chunk).await)?);
        }
        Ok(ids)
    }

    fn set_filled(&self) -> Result<(), StoreError> {
        self.ask(async |connection| marks::set_filled(connection, &self.life).await)
    }

    fn subscribe(&self, names: &[String]) -> Result<(), StoreError> {
        can_be_subscribers(names)?;
        self.ask(async |connection| notices::subscribe(connection, &self.life, names).await)
    }

    fn notices(&self, name: &str, most: usize) -> Result<Vec<Notice>, StoreError> {
        self.ask(async |connection| notices::notices(connection, &self.life, name, most).await)
    }

    fn acknowledge(&self, name: &str, seq: Seq) -> Result<(), StoreError> {
        self.ask(async |connection| notices::acknowledge(connection, &self.life, name, seq).await)
    }

    fn backlog(&self, name: &str) -> Result<u64, StoreError> {
        self.ask(async |connection| notices::backlog(connection, &self.life, name).await)
    }

    fn tell(&self, news: &News) -> Result<bool, StoreError> {
        let mut news = news.clone();
        if let News::FolderAway { folder, reason } = &mut news {
            fits("the folder's name", folder)?;
            *reason = one_line(reason);
        }
        self.ask(async |connection| marks::tell(connection, &self.life, &news).await)
    }

    fn last_night(&self) -> Result<Option<Time>, StoreError> {
        self.ask(async |connection| marks::last_night(connection, &self.life).await)
    }

    fn begin_night(&self, at: Time) -> Result<(), StoreError> {
        self.ask(async |connection| marks::begin_night(connection, &self.life, at).await)
    }

    fn counts(&self) -> Result<Vec<(Kind, u64)>, StoreError> {
        self.ask(async |connection| look::counts(connection, self.served()).await)
    }

    fn away(&self) -> Option<Time> {
        self.database.outage.since()
    }

    fn hear(&self, news: Arc<dyn Fn() + Send + Sync>) {
        if let Some(runtime) = &self.runtime {
            runtime.spawn(news::listen(self.database.options(), self.channel.clone(), news));
        }
    }

    fn hosts(&self) -> Result<Vec<Host>, StoreError> {
        self.ask(async |connection| hosts::hosts(connection, &self.life).await)
    }

    fn announce(&self, station: &Station) {
        station.clone_into(&mut self.life.station.lock().unwrap_or_else(PoisonError::into_inner));
        let told = brief(|| self.ask(async |connection| hosts::see(connection, &self.life).await));
        if let Err(error) = told {
            tracing::debug!(%error, "What this daemon is will be told with its next sign of life.");
        }
    }

    fn drain(&self, name: &str, drains: bool) -> Result<bool, StoreError> {
        self.ask(async |connection| hosts::drain(connection, name, drains).await)
    }

    fn is_draining(&self) -> Result<bool, StoreError> {
        self.ask(async |connection| hosts::is_draining(connection, &self.life).await)
    }
}
