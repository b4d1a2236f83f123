//! Subscribers and what they have not heard of: see [`super::outbox`] for what is kept.

use std::sync::MutexGuard;

use super::outbox::{SUBSCRIBERS, Subscribers, key};
use super::{Inner, Queue, fits, head_put};
use crate::crash::crash_point;
use crate::id::Seq;
use crate::news::Notice;
use crate::record;
use crate::store::{MOST_SUBSCRIBERS, StoreError};
use crate::tables::{Put, Table, Tables};

/// Entries removed by one transaction of the tables.
const CHUNK: usize = 1000;

/// Do they fit a record?
pub(crate) fn can_be_subscribers(names: &[String]) -> Result<(), StoreError> {
    names.iter().try_for_each(|name| fits("the subscriber's name", name))?;
    if names.len() > MOST_SUBSCRIBERS {
        return Err(StoreError::TooLong { what: format!("the list of {} subscribers", names.len()) });
    }
    Ok(())
}

impl<T: Tables> Queue<T> {
    /// As [`crate::JobStore::subscribe`].
    pub(super) fn set_subscribers(&self, names: &[String]) -> Result<(), StoreError> {
        can_be_subscribers(names)?;
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
    fn note_subscribers(&self, mut inner: MutexGuard<'_, Inner>, new: Subscribers) -> Result<(), StoreError> {
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
    pub(super) fn not_heard(&self, name: &str, most: usize) -> Result<Vec<Notice>, StoreError> {
        let inner = self.lock();
        let (heard, head) = (inner.subscribers.get(name).copied(), inner.head);
        drop(inner);
        let mut notices = Vec::new();
        let Some(heard) = heard.filter(|_| most > 0) else { return Ok(notices) };
        self.tables.scan(Table::Outbox, &key(Seq(heard.0 + 1)), &key(Seq(head.seq.0 + 1)), &mut |key, value| {
            notices.push(record::decode_notice(key, value)?);
            Ok(notices.len() < most)
        })?;
        // A kill of the machine must not take back what someone has been told.
        if !notices.is_empty() {
            self.settle(head)?;
        }
        Ok(notices)
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
