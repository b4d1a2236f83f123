//! The queue's logic over four ordered tables, shared by every store that is embedded in the daemon.
//!
//! | table    | key                                                                     | value                     |
//! |----------|-------------------------------------------------------------------------|---------------------------|
//! | meta     | `head`; `unfilled` (see `past`); `subscribers` (see [`outbox`])         | [`Head`]; `true`; names and transitions |
//! | meta     | `night`, `away/` and a folder's name (see `marks`)                      | times                     |
//! | jobs     | job number                                                              | the [`Job`]               |
//! | by_state | kind, then what that kind is searched by (see [`index`])                | nothing                   |
//! | outbox   | number of the transition in which a job ended, or of news               | the [`Job`] as it was then; a `Word` |
//!
//! Numbers in keys are big-endian. The job, its index entries and the head change in one transaction of the tables. One lock
//! orders the transitions; becoming durable happens outside of it, so that transitions of several threads share one sync. Which job is
//! claimed next is told by a [`mod@line`] of all that may be, whose result others may have by [`results`], and whose job is whose file by [`files`]: in
//! memory, made anew at each opening.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, MutexGuard};

use serde::{Deserialize, Serialize};

use crate::crash::crash_point;
use crate::id::{Clock, Epoch, JobId, Recipe, Seq, Time, Token};
use crate::job::{Event, Illegal, Job, Kind, Past, Source, State, Step, Testimony};
use crate::news::{News, Notice};
use crate::record;
use crate::share::Shares;
use crate::store::{
    Claim, Control, Filter, JobStore, Lease, Look, Page, Query, Recovered, StoreError, Submission, Submitted, Waiting,
};
use crate::tables::{Put, Table, Tables};

pub(crate) mod check;
mod files;
mod forget;
mod index;
mod line;
mod marks;
pub(crate) mod notices;
mod offered;
mod outbox;
mod page;
pub(crate) mod past;
mod recover;
mod results;
pub(crate) mod submit;
mod transfer;
mod turn;

use files::{Files, Identity};
use line::{Line, Now};
use results::Results;

/// Longest folder or profile name, as it stands in a record.
pub(crate) const MAX_NAME: usize = 64;
const HEAD: &[u8] = b"head";
/// Is there in a store that was begun anew, as long as what earlier ones knew was not read.
const UNFILLED: &[u8] = b"unfilled";

/// What there is one of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Head {
    pub(crate) epoch: Epoch,
    pub(crate) seq: Seq,
    pub(crate) last_job: JobId,
}

struct Inner {
    head: Head,
    counts: BTreeMap<Kind, u64>,
    line: Line,
    results: Results,
    files: Files,
    subscribers: outbox::Subscribers,
}

impl Inner {
    /// A job came, or changed.
    fn learn(&mut self, job: &Job) {
        self.results.add(job);
        self.files.add(job);
    }

    /// A job changes, or goes.
    fn lose(&mut self, job: &Job) {
        self.results.remove(job);
        self.files.remove(job);
    }
}

/// The queue over `T`.
pub(crate) struct Queue<T> {
    tables: T,
    inner: Mutex<Inner>,
    clock: Arc<dyn Clock>,
}

/// The head of `tables`, `None` when they are empty.
pub(crate) fn read_head(tables: &dyn Tables) -> Result<Option<Head>, StoreError> {
    let Some(bytes) = tables.get(Table::Meta, HEAD)? else {
        let mut empty = true;
        tables.scan(Table::Jobs, &[], &[], &mut |_, _| {
            empty = false;
            Ok(false)
        })?;
        return if empty { Ok(None) } else { Err(record::corrupt("meta/head", "it is missing")) };
    };
    record::decode(Table::Meta, HEAD, &bytes).map(Some)
}

/// Every job in `tables`, by number.
pub(crate) fn all_jobs(tables: &dyn Tables) -> Result<Vec<Job>, StoreError> {
    let mut jobs = Vec::new();
    tables.scan(Table::Jobs, &[], &[], &mut |key, value| {
        jobs.push(record::decode(Table::Jobs, key, value)?);
        Ok(true)
    })?;
    Ok(jobs)
}

/// The indexes that are kept in memory, of all jobs. A damaged record offers no result and answers for no file; whoever asks for its job hears of it.
fn told_from_memory(tables: &dyn Tables) -> Result<(Results, Files), StoreError> {
    let (mut results, mut files) = (Results::default(), Files::default());
    tables.scan(Table::Jobs, &[], &[], &mut |key, value| {
        match record::decode(Table::Jobs, key, value) {
            Ok(job) => {
                results.add(&job);
                files.add(&job);
            }
            Err(error) => tracing::warn!(%error, "A job at rest cannot be read."),
        }
        Ok(true)
    })?;
    Ok((results, files))
}

impl<T: Tables> Queue<T> {
    /// Begins a new epoch, durably, after checking every job that is not at rest.
    pub(crate) fn open(tables: T, clock: Arc<dyn Clock>) -> Result<Self, StoreError> {
        let earlier = read_head(&tables)?;
        let unfilled = earlier.is_none().then(unfilled_put).transpose()?;
        let mut head = earlier.unwrap_or_default();
        head.epoch.0 += 1;
        head.seq.0 += 1;
        let (counts, subscribers) = (index::count(&tables)?, outbox::subscribers(&tables)?);
        let (results, files) = told_from_memory(&tables)?;
        let inner = Inner { head, counts, line: Line::default(), results, files, subscribers };
        let queue = Self { tables, inner: Mutex::new(inner), clock };
        let now = queue.now();
        for kind in Kind::ALL.into_iter().filter(|kind| kind.is_live()) {
            for id in index::ids(&queue.tables, kind)? {
                let job = queue.job(id)?.ok_or_else(|| record::corrupt(&format!("job {id}"), "it is missing"))?;
                if job.kind() != kind {
                    return Err(record::corrupt(&format!("job {id}"), "its state and the index disagree"));
                }
                queue.lock().line.update(&job, now);
            }
        }
        crash_point("store.open.checked");
        queue.tables.write(unfilled.into_iter().chain([head_put(&head)?]).collect(), head.seq)?;
        crash_point("store.open.epoch");
        queue.tables.settle((head.epoch, head.seq))?;
        crash_point("store.open.done");
        Ok(queue)
    }

    pub(crate) fn tables(&self) -> &T {
        &self.tables
    }

    pub(crate) fn into_tables(self) -> T {
        self.tables
    }

    pub(crate) fn epoch(&self) -> Epoch {
        self.lock().head.epoch
    }

    /// Where the queue stands: what a later opening must not fall behind, once settled.
    pub(crate) fn reached(&self) -> (Epoch, Seq) {
        let head = self.lock().head;
        (head.epoch, head.seq)
    }

    fn lock(&self) -> MutexGuard<'_, Inner> {
        // The guarded values change only after a write succeeded, by plain assignments: a panic elsewhere leaves them whole.
        self.inner.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    fn now(&self) -> Now {
        Now { wall: self.clock.now(), ticks: self.clock.ticks() }
    }

    fn job(&self, id: JobId) -> Result<Option<Job>, StoreError> {
        let key = id.0.to_be_bytes();
        let bytes = self.tables.get(Table::Jobs, &key)?;
        let job: Option<Job> = bytes.map(|bytes| record::decode(Table::Jobs, &key, &bytes)).transpose()?;
        match &job {
            Some(job) if job.id != id => Err(record::corrupt(&format!("job {id}"), "it is another job's")),
            _ => Ok(job),
        }
    }

    fn known(&self, id: JobId) -> Result<Job, StoreError> {
        self.job(id)?.ok_or(StoreError::Unknown(id))
    }

    /// Writes the changes `from → to`. `head` is the head they leave.
    fn commit(&self, mut inner: MutexGuard<'_, Inner>, head: Head, changes: &[(Option<&Job>, &Job)]) -> Result<(), StoreError> {
        let mut puts = Vec::new();
        let mut counts = inner.counts.clone();
        for (from, to) in changes {
            let old = from.map(index::key);
            let new = index::key(to);
            if let Some(old) = old.filter(|old| *old != new) {
                puts.push(Put { table: Table::ByState, key: old, value: None });
            }
            puts.push(Put { table: Table::ByState, key: new, value: Some(Vec::new()) });
            let key = to.id.0.to_be_bytes().to_vec();
            let value = record::encode_job(&key, to)?;
            puts.push(Put { table: Table::Jobs, key, value: Some(value) });
            puts.extend(outbox::entry(&inner.subscribers, *from, to)?);
            if let Some(from) = from {
                let count = counts.entry(from.kind()).or_default();
                *count = count.saturating_sub(1);
            }
            *counts.entry(to.kind()).or_default() += 1;
        }
        puts.push(head_put(&head)?);
        self.tables.write(puts, head.seq)?;
        (inner.head, inner.counts) = (head, counts);
        let now = self.now();
        for (from, to) in changes {
            inner.line.update(to, now);
            from.iter().for_each(|from| inner.lose(from));
            inner.learn(to);
        }
        drop(inner);
        crash_point("store.commit.written");
        Ok(())
    }

    /// One event of one job, durable when this returns. `event` learns the head, whose number is that of the transition.
    fn transition(&self, id: JobId, event: impl FnOnce(&Job, &Head) -> Result<Event, Illegal>) -> Result<Job, StoreError> {
        self.tables.sound()?;
        let now = self.clock.now();
        let inner = self.lock();
        let before = self.known(id)?;
        let mut head = inner.head;
        head.seq.0 += 1;
        let after = event(&before, &head).and_then(|event| before.after(&event, now));
        let mut after = after.map_err(|source| StoreError::Illegal { id, source })?;
        after.seq = head.seq;
        self.commit(inner, head, &[(Some(&before), &after)])?;
        self.settle(head)?;
        Ok(after)
    }

    /// As [`JobStore::claim`], for the life of that number.
    pub(crate) fn claim_for(&self, epoch: Epoch, want: &Filter) -> Result<Option<Claim>, StoreError> {
        self.tables.sound()?;
        let mut inner = self.lock();
        let now = self.now();
        let Some(id) = inner.line.first(want, now) else { return Ok(None) };
        let before = self.known(id)?;
        let mut head = inner.head;
        head.seq.0 += 1;
        let token = Token(head.seq.0);
        let event = Event::Claim { epoch, token, boot: self.clock.boot() };
        let mut job = before.after(&event, now.wall).map_err(|source| StoreError::Illegal { id, source })?;
        job.seq = head.seq;
        // Before it is durable: where that fails, the store begins anew, and so do turns.
        inner.line.begin_turn(id);
        self.commit(inner, head, &[(Some(&before), &job)])?;
        self.settle(head)?;
        Ok(Some(Claim { id, token, job }))
    }

    /// As [`JobStore::advance`], by the life of that number.
    pub(crate) fn advance_for(&self, epoch: Epoch, claim: &Claim, step: Step) -> Result<Job, StoreError> {
        self.transition(claim.id, |job, _| match job.hold() {
            Some(hold) if hold.epoch == epoch => Ok(Event::Step { token: claim.token, step }),
            _ => Err(Illegal::Fenced),
        })
    }

    /// As [`JobStore::heartbeat`], of the life of that number.
    pub(crate) fn holds(&self, epoch: Epoch, claim: &Claim) -> Result<Lease, StoreError> {
        let job = self.known(claim.id)?;
        Ok(match (job.hold(), &job.state) {
            (Some(hold), _) if hold.token != claim.token || hold.epoch != epoch => Lease::Lost,
            (Some(_), State::Running { cancel: true, .. }) => Lease::Cancel,
            (Some(_), _) => Lease::Held,
            (None, _) => Lease::Lost,
        })
    }

    fn settle(&self, head: Head) -> Result<(), StoreError> {
        self.tables.settle((head.epoch, head.seq))?;
        crash_point("store.commit.durable");
        Ok(())
    }

    /// The latest job of a file.
    fn latest_of(&self, inner: &Inner, file: &Identity<'_>) -> Result<Option<Job>, StoreError> {
        for id in inner.files.candidates(file) {
            if let Some(job) = self.job(id)?.filter(|job| Identity::from(&job.source) == *file) {
                return Ok(Some(job));
            }
        }
        Ok(None)
    }
}

impl<T: Tables> JobStore for Queue<T> {
    fn submit(&self, found: &[Submission]) -> Result<Vec<Submitted>, StoreError> {
        self.take_in(found)
    }

    fn claim(&self, want: &Filter) -> Result<Option<Claim>, StoreError> {
        self.claim_for(self.epoch(), want)
    }

    fn has_parked(&self) -> Result<bool, StoreError> {
        Ok(self.lock().line.has_parked(self.now()))
    }

    fn waiting(&self, want: &Filter) -> Result<Option<Waiting>, StoreError> {
        Ok(self.lock().line.waiting(want, self.now()))
    }

    fn shut(&self, folders: &BTreeSet<String>) {
        self.lock().line.shut(folders);
    }

    fn share(&self, shares: &Shares) {
        self.lock().line.share(shares);
    }

    fn heartbeat(&self, claim: &Claim) -> Result<Lease, StoreError> {
        self.holds(self.epoch(), claim)
    }

    fn advance(&self, claim: &Claim, step: Step) -> Result<Job, StoreError> {
        self.advance_for(self.epoch(), claim, step)
    }

    fn control(&self, id: JobId, wish: Control) -> Result<Job, StoreError> {
        self.transition(id, |_, _| Ok(wish.into()))
    }

    fn recover(&self, testimony: &dyn Fn(&Job) -> Testimony) -> Result<Vec<Recovered>, StoreError> {
        self.take_back_all(testimony)
    }

    fn get(&self, id: JobId) -> Result<Option<Job>, StoreError> {
        self.job(id)
    }

    fn list(&self, query: &Query) -> Result<Vec<Job>, StoreError> {
        let limit = if query.limit == 0 { usize::MAX } else { query.limit };
        let mut jobs = Vec::new();
        if query.kinds.is_empty() {
            let from = query.after.0.saturating_add(1).to_be_bytes();
            self.tables.scan(Table::Jobs, &from, &[], &mut |key, value| {
                jobs.push(record::decode(Table::Jobs, key, value)?);
                Ok(jobs.len() < limit)
            })?;
            return Ok(jobs);
        }
        let mut ids = Vec::new();
        for kind in &query.kinds {
            ids.extend(index::ids(&self.tables, *kind)?.into_iter().filter(|id| *id > query.after));
        }
        ids.sort_unstable();
        ids.dedup();
        for id in ids {
            // A job may have moved on since the index was read.
            let job = self.known(id)?;
            if query.kinds.contains(&job.kind()) {
                jobs.push(job);
                if jobs.len() == limit {
                    break;
                }
            }
        }
        Ok(jobs)
    }

    fn page(&self, look: &Look) -> Result<Page, StoreError> {
        self.latest(look)
    }

    fn find(&self, source: &Source) -> Result<Option<JobId>, StoreError> {
        Ok(self.latest_of(&self.lock(), &source.into())?.map(|job| job.id))
    }

    fn results(&self, size: u64, recipe: Option<Recipe>) -> Result<Vec<Job>, StoreError> {
        self.offered(size, recipe)
    }

    fn check(&self) -> Result<(), StoreError> {
        self.tables.sound()
    }

    fn forget(&self, ids: &[JobId]) -> Result<u64, StoreError> {
        self.drop_records(ids)
    }

    fn is_unfilled(&self) -> Result<bool, StoreError> {
        self.lacks_past()
    }

    fn restore(&self, past: &[Past]) -> Result<Vec<JobId>, StoreError> {
        self.take_back_past(past)
    }

    fn set_filled(&self) -> Result<(), StoreError> {
        self.has_past()
    }

    fn subscribe(&self, names: &[String]) -> Result<(), StoreError> {
        self.set_subscribers(names)
    }

    fn notices(&self, name: &str, most: usize) -> Result<Vec<Notice>, StoreError> {
        self.not_heard(name, most)
    }

    fn acknowledge(&self, name: &str, seq: Seq) -> Result<(), StoreError> {
        self.has_heard(name, seq)
    }

    fn backlog(&self, name: &str) -> Result<u64, StoreError> {
        self.count_not_heard(name)
    }

    fn tell(&self, news: &News) -> Result<bool, StoreError> {
        self.tell_of(news)
    }

    fn last_night(&self) -> Result<Option<Time>, StoreError> {
        self.night_mark()
    }

    fn begin_night(&self, at: Time) -> Result<(), StoreError> {
        self.set_night_mark(at)
    }

    fn counts(&self) -> Result<Vec<(Kind, u64)>, StoreError> {
        let inner = self.lock();
        Ok(Kind::ALL.into_iter().map(|kind| (kind, inner.counts.get(&kind).copied().unwrap_or(0))).collect())
    }
}

fn head_put(head: &Head) -> Result<Put, StoreError> {
    Ok(Put { table: Table::Meta, key: HEAD.to_vec(), value: Some(record::encode_head(HEAD, head)?) })
}

fn unfilled_put() -> Result<Put, StoreError> {
    Ok(Put { table: Table::Meta, key: UNFILLED.to_vec(), value: Some(record::encode(Table::Meta, UNFILLED, &true)?) })
}

/// Does a name fit a record?
pub(crate) fn fits(what: &str, name: &str) -> Result<(), StoreError> {
    let length = serde_json::to_string(name).map_or(usize::MAX, |text| text.len());
    if length > MAX_NAME { Err(StoreError::TooLong { what: format!("{what} {name:?}") }) } else { Ok(()) }
}
