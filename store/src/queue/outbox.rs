//! What subscribers have not heard yet: each job as it stood when it came to its end, under the number of that transition. It is written in the
//! transaction in which the job ends, so that neither is there without the other, and it goes when all subscribers have it. Where no one
//! subscribes, nothing is kept.
//!
//! The entry `subscribers` of the table `meta` says who has heard of what. An older program neither reads nor adds to either.

use std::collections::BTreeMap;

use super::{Inner, Queue, fits, head_put};
use crate::crash::crash_point;
use crate::id::Seq;
use crate::job::{Job, State};
use crate::record;
use crate::store::{MOST_SUBSCRIBERS, StoreError};
use crate::tables::{Put, Table, Tables};

const SUBSCRIBERS: &[u8] = b"subscribers";
/// Entries removed by one transaction of the tables.
const CHUNK: usize = 1000;

/// Who subscribes, and the last transition that each has heard of.
pub(super) type Subscribers = BTreeMap<String, Seq>;

/// Those of earlier lives.
pub(super) fn subscribers(tables: &dyn Tables) -> Result<Subscribers, StoreError> {
    let bytes = tables.get(Table::Meta, SUBSCRIBERS)?;
    bytes.map_or_else(|| Ok(Subscribers::new()), |bytes| record::decode(Table::Meta, SUBSCRIBERS, &bytes))
}

fn key(seq: Seq) -> [u8; 8] {
    seq.0.to_be_bytes()
}

/// The entry of this change, if it is a job's end and someone is to hear of it. A job that comes back from an earlier store ended long ago.
pub(super) fn entry(subscribers: &Subscribers, from: Option<&Job>, to: &Job) -> Result<Option<Put>, StoreError> {
    let ends = matches!(to.state, State::Ended { .. }) && from.is_some_and(|from| from.state != to.state);
    if subscribers.is_empty() || !ends {
        return Ok(None);
    }
    let key = key(to.seq);
    let value = record::encode(Table::Outbox, &key, to)?;
    Ok(Some(Put { table: Table::Outbox, key: key.to_vec(), value: Some(value) }))
}

impl<T: Tables> Queue<T> {
    /// As [`crate::JobStore::subscribe`].
    pub(super) fn set_subscribers(&self, names: &[String]) -> Result<(), StoreError> {
        names.iter().try_for_each(|name| fits("the subscriber's name", name))?;
        if names.len() > MOST_SUBSCRIBERS {
            return Err(StoreError::TooLong { what: format!("the list of {} subscribers", names.len()) });
        }
        self.tables.sound()?;
        let inner = self.lock();
        let seq_of = |name: &String| inner.subscribers.get(name).copied().unwrap_or(inner.head.seq);
        let new: Subscribers = names.iter().map(|name| (name.clone(), seq_of(name))).collect();
        if new == inner.subscribers { Ok(()) } else { self.note_subscribers(inner, new) }
    }

    /// As [`crate::JobStore::acknowledge`].
    pub(super) fn has_heard(&self, name: &str, seq: Seq) -> Result<(), StoreError> {
        self.tables.sound()?;
        let inner = self.lock();
        if inner.subscribers.get(name).is_none_or(|heard| *heard >= seq) {
            return Ok(());
        }
        let mut new = inner.subscribers.clone();
        new.insert(name.to_owned(), seq);
        self.note_subscribers(inner, new)
    }

    /// Makes it durable who has heard of what, and removes entries that everyone has.
    fn note_subscribers(&self, mut inner: std::sync::MutexGuard<'_, Inner>, new: Subscribers) -> Result<(), StoreError> {
        let mut head = inner.head;
        head.seq.0 += 1;
        let value = record::encode(Table::Meta, SUBSCRIBERS, &new)?;
        let mut puts = vec![Put { table: Table::Meta, key: SUBSCRIBERS.to_vec(), value: Some(value) }, head_put(&head)?];
        let up_to = new.values().min().copied().unwrap_or(head.seq);
        self.tables.scan(Table::Outbox, &[], &key(Seq(up_to.0.saturating_add(1))), &mut |key, _| {
            puts.push(Put { table: Table::Outbox, key: key.to_vec(), value: None });
            Ok(puts.len() < CHUNK)
        })?;
        self.tables.write(puts, head.seq)?;
        (inner.head, inner.subscribers) = (head, new);
        drop(inner);
        crash_point("store.commit.written");
        self.settle(head)
    }

    /// As [`crate::JobStore::notices`].
    pub(super) fn not_heard(&self, name: &str, most: usize) -> Result<Vec<Job>, StoreError> {
        let inner = self.lock();
        let (heard, head) = (inner.subscribers.get(name).copied(), inner.head);
        drop(inner);
        let mut jobs = Vec::new();
        let Some(heard) = heard.filter(|_| most > 0) else { return Ok(jobs) };
        self.tables.scan(Table::Outbox, &key(Seq(heard.0 + 1)), &key(Seq(head.seq.0 + 1)), &mut |key, value| {
            jobs.push(record::decode(Table::Outbox, key, value)?);
            Ok(jobs.len() < most)
        })?;
        // A kill of the machine must not take back what someone has been told.
        if !jobs.is_empty() {
            self.settle(head)?;
        }
        Ok(jobs)
    }

    /// As [`crate::JobStore::backlog`].
    pub(super) fn count_not_heard(&self, name: &str) -> Result<u64, StoreError> {
        let mut count = 0;
        let Some(heard) = self.lock().subscribers.get(name).copied() else { return Ok(count) };
        self.tables.scan(Table::Outbox, &key(Seq(heard.0 + 1)), &[], &mut |_, _| {
            count += 1;
            Ok(true)
        })?;
        Ok(count)
    }
}
