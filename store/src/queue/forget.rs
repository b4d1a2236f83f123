//! The end of a record: jobs at rest leave the store, with all that points to them. Their numbers are never used again.

use super::{Queue, head_put, index};
use crate::crash::crash_point;
use crate::id::JobId;
use crate::store::StoreError;
use crate::tables::{Put, Table, Tables};

/// Jobs removed by one transaction of the tables.
const CHUNK: usize = 1000;

impl<T: Tables> Queue<T> {
    /// As [`crate::JobStore::forget`].
    pub(super) fn drop_records(&self, ids: &[JobId]) -> Result<u64, StoreError> {
        self.tables.sound()?;
        let mut removed = 0;
        for chunk in ids.chunks(CHUNK) {
            removed += self.drop_chunk(chunk)?;
        }
        Ok(removed)
    }

    fn drop_chunk(&self, ids: &[JobId]) -> Result<u64, StoreError> {
        let mut inner = self.lock();
        let (mut head, mut counts) = (inner.head, inner.counts.clone());
        let (mut puts, mut removed) = (Vec::new(), Vec::new());
        let none = |table, key| Put { table, key, value: None };
        for id in ids {
            let Some(job) = self.job(*id)?.filter(|job| job.kind().is_at_rest()) else { continue };
            puts.push(none(Table::ByState, index::key(&job)));
            puts.push(none(Table::Jobs, id.0.to_be_bytes().to_vec()));
            let count = counts.entry(job.kind()).or_default();
            *count = count.saturating_sub(1);
            removed.push(job);
        }
        if removed.is_empty() {
            return Ok(0);
        }
        head.seq.0 += 1;
        puts.push(head_put(&head)?);
        self.tables.write(puts, head.seq)?;
        (inner.head, inner.counts) = (head, counts);
        removed.iter().for_each(|job| inner.lose(job));
        drop(inner);
        crash_point("store.commit.written");
        self.settle(head)?;
        Ok(removed.len() as u64)
    }
}
