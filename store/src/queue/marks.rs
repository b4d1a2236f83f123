//! Marks of what was told last of the service itself, so that nothing is told twice, also not by another life of the daemon. Each folder that is away has
//! an entry of its own in the table `meta`, and the end of the last night has one; the entry and the word of it for subscribers are one transaction.

use std::collections::BTreeMap;
use std::sync::MutexGuard;

use super::{Inner, Queue, fits, head_put, outbox};
use crate::crash::crash_point;
use crate::id::Time;
use crate::job::one_line;
use crate::news::{News, Word};
use crate::record;
use crate::store::StoreError;
use crate::tables::{Put, Table, Tables};

pub(super) const NIGHT: &[u8] = b"night";
const AWAY: &[u8] = b"away/";

/// The key of a folder that is away.
pub(super) fn away(folder: &str) -> Vec<u8> {
    [AWAY, folder.as_bytes()].concat()
}

/// Folders that are away, and since when that was told.
pub(super) fn away_folders(tables: &dyn Tables) -> Result<BTreeMap<String, Time>, StoreError> {
    let mut folders = BTreeMap::new();
    // `0` comes after `/`.
    tables.scan(Table::Meta, AWAY, b"away0", &mut |key, value| {
        let folder = key.strip_prefix(AWAY).unwrap_or_default();
        folders.insert(String::from_utf8_lossy(folder).into_owned(), record::decode(Table::Meta, key, value)?);
        Ok(true)
    })?;
    Ok(folders)
}

impl<T: Tables> Queue<T> {
    /// As [`crate::JobStore::tell`].
    pub(super) fn tell_of(&self, news: &News) -> Result<bool, StoreError> {
        self.tables.sound()?;
        let (inner, now) = (self.lock(), self.clock.now());
        let (key, mark) = match news {
            News::FolderAway { folder, .. } => (away(folder), Some(now)),
            News::FolderBack { folder } => (away(folder), None),
            News::Night { until, .. } => (NIGHT.to_vec(), Some(*until)),
        };
        let told = self.mark(&key)?;
        let is_known = match news {
            News::FolderAway { .. } => told.is_some(),
            News::FolderBack { .. } => told.is_none(),
            News::Night { until, .. } => told.is_some_and(|told| told >= *until),
        };
        if is_known {
            return Ok(false);
        }
        let mut news = news.clone();
        if let News::FolderAway { folder, reason } = &mut news {
            fits("the folder's name", folder)?;
            *reason = one_line(reason);
        }
        self.set_mark(inner, key, mark, Some(news)).map(|()| true)
    }

    /// As [`crate::JobStore::last_night`].
    pub(super) fn night_mark(&self) -> Result<Option<Time>, StoreError> {
        self.mark(NIGHT)
    }

    /// As [`crate::JobStore::begin_night`].
    pub(super) fn set_night_mark(&self, at: Time) -> Result<(), StoreError> {
        self.tables.sound()?;
        self.set_mark(self.lock(), NIGHT.to_vec(), Some(at), None)
    }

    fn mark(&self, key: &[u8]) -> Result<Option<Time>, StoreError> {
        self.tables.get(Table::Meta, key)?.map(|bytes| record::decode(Table::Meta, key, &bytes)).transpose()
    }

    fn set_mark(
        &self,
        mut inner: MutexGuard<'_, Inner>,
        key: Vec<u8>,
        mark: Option<Time>,
        news: Option<News>,
    ) -> Result<(), StoreError> {
        let mut head = inner.head;
        head.seq.0 += 1;
        let value = mark.map(|mark| record::encode(Table::Meta, &key, &mark)).transpose()?;
        let mut puts = vec![Put { table: Table::Meta, key, value }, head_put(&head)?];
        let word = news.map(|news| Word { seq: head.seq, at: self.clock.now(), news });
        puts.extend(word.map(|word| outbox::word(&inner.subscribers, &word)).transpose()?.flatten());
        self.tables.write(puts, head.seq)?;
        inner.head = head;
        drop(inner);
        crash_point("store.commit.written");
        self.settle(head)
    }
}
