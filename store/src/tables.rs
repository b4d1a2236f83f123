//! Ordered tables of bytes: what the queue's logic asks of a database.

use crate::id::{Epoch, Seq};
use crate::store::StoreError;

/// One of the four tables. Its number is part of a record's checksum, and stays; 3 was an index of earlier versions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Table {
    Meta = 0,
    Jobs = 1,
    ByState = 2,
    Outbox = 4,
}

/// A change of one entry; without a value the entry goes.
#[derive(Debug)]
pub(crate) struct Put {
    pub(crate) table: Table,
    pub(crate) key: Vec<u8>,
    pub(crate) value: Option<Vec<u8>>,
}

/// Ordered tables. A write is visible at once and durable after [`Tables::settle`].
pub(crate) trait Tables: Send + Sync {
    fn get(&self, table: Table, key: &[u8]) -> Result<Option<Vec<u8>>, StoreError>;
    /// Entries from `from` on, `to` not included (no bound when empty), in order, until `each` says `false`.
    fn scan(&self, table: Table, from: &[u8], to: &[u8], each: Visit<'_>) -> Result<(), StoreError>;
    /// Entries below `to`, down to `from`, in reverse order, until `each` says `false`.
    fn scan_back(&self, table: Table, from: &[u8], to: &[u8], each: Visit<'_>) -> Result<(), StoreError>;
    /// All of `puts`, or none.
    fn write(&self, puts: Vec<Put>, seq: Seq) -> Result<(), StoreError>;
    /// Returns when every write up to `seq` is durable.
    fn settle(&self, at: (Epoch, Seq)) -> Result<(), StoreError>;
    /// Fails when an earlier error left the tables in doubt.
    fn sound(&self) -> Result<(), StoreError>;
}

/// Sees a key and its value; `false` ends the scan.
pub(crate) type Visit<'a> = &'a mut dyn FnMut(&[u8], &[u8]) -> Result<bool, StoreError>;
