//! A look at every record of a store: is each whole, of a version that is known, under its own key; does the index by state say the same as the
//! jobs; and is the head behind none of them? Nothing is changed.

use std::collections::{BTreeMap, BTreeSet};

use serde::de::{DeserializeOwned, IgnoredAny};

use super::{HEAD, Head, index, outbox};
use crate::id::{JobId, Seq};
use crate::job::{Job, Kind};
use crate::record;
use crate::store::StoreError;
use crate::tables::{Table, Tables};

/// The findings of a look at every record.
#[derive(Debug, Default)]
pub(crate) struct Checked {
    pub(crate) jobs: u64,
    pub(crate) records: u64,
    /// One line for each thing that is not as it must be.
    pub(crate) wrong: Vec<String>,
}

/// Looks at every record.
///
/// # Errors
/// Where the tables cannot be read, or hold a record of a newer version. A damaged record is a finding, not an error.
pub(crate) fn check(tables: &dyn Tables) -> Result<Checked, StoreError> {
    let mut looking = Looking::default();
    looking.meta(tables)?;
    looking.jobs(tables)?;
    looking.by_state(tables)?;
    looking.outbox(tables)?;
    Ok(looking.checked)
}

#[derive(Default)]
struct Looking {
    checked: Checked,
    /// `None`: there is none that can be read.
    head: Option<Head>,
    /// Entries that the index by state must have, one a job.
    indexed: BTreeMap<Vec<u8>, (JobId, Kind)>,
    /// Jobs whose records cannot be read, so that nothing is known of their entries.
    unread: BTreeSet<JobId>,
}

impl Looking {
    fn wrong(&mut self, line: String) {
        self.checked.wrong.push(line);
    }

    /// The record, if it is whole.
    fn read<T>(&mut self, read: Result<T, StoreError>) -> Result<Option<T>, StoreError> {
        self.checked.records += 1;
        match read {
            Ok(value) => Ok(Some(value)),
            Err(StoreError::Corrupt { what, reason }) => {
                self.wrong(format!("{what}: {reason}"));
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }

    fn decode<T: DeserializeOwned>(&mut self, key: &[u8], value: &[u8]) -> Result<Option<T>, StoreError> {
        self.read(record::decode(Table::Meta, key, value))
    }

    fn meta(&mut self, tables: &dyn Tables) -> Result<(), StoreError> {
        tables.scan(Table::Meta, &[], &[], &mut |key, value| {
            match key {
                HEAD => self.head = self.decode(key, value)?,
                outbox::SUBSCRIBERS => _ = self.decode::<outbox::Subscribers>(key, value)?,
                _ => _ = self.decode::<IgnoredAny>(key, value)?,
            }
            Ok(true)
        })?;
        if tables.get(Table::Meta, HEAD)?.is_none() {
            self.wrong("meta/head: it is missing".into());
        }
        Ok(())
    }

    /// A transition that the head knows nothing of.
    fn is_ahead(&self, seq: Seq) -> bool {
        self.head.is_some_and(|head| seq > head.seq)
    }

    fn jobs(&mut self, tables: &dyn Tables) -> Result<(), StoreError> {
        tables.scan(Table::Jobs, &[], &[], &mut |key, value| {
            self.checked.jobs += 1;
            let number = key.try_into().ok().map(|key| JobId(u64::from_be_bytes(key)));
            match (self.read(record::decode::<Job>(Table::Jobs, key, value))?, number) {
                (Some(job), Some(number)) => self.job(&job, number),
                (_, number) => self.unread.extend(number),
            }
            Ok(true)
        })
    }

    fn job(&mut self, job: &Job, number: JobId) {
        if job.id != number {
            self.unread.insert(number);
            return self.wrong(format!("job {number}: it is another job's"));
        }
        if self.is_ahead(job.seq) || self.head.is_some_and(|head| job.id > head.last_job) {
            self.wrong(format!("job {number}: it is ahead of the head, which says what came last"));
        }
        self.indexed.insert(index::key(job), (job.id, job.kind()));
    }

    fn by_state(&mut self, tables: &dyn Tables) -> Result<(), StoreError> {
        tables.scan(Table::ByState, &[], &[], &mut |key, _| {
            self.checked.records += 1;
            if self.indexed.remove(key).is_some() {
                return Ok(true);
            }
            match index::told(key) {
                Some((id, _)) if self.unread.contains(&id) => {}
                Some((id, kind)) => self.wrong(format!("by_state: an entry says that job {id} is {kind}; no record says so")),
                None => self.wrong("by_state: an entry cannot be understood".into()),
            }
            Ok(true)
        })?;
        for (id, kind) in std::mem::take(&mut self.indexed).into_values() {
            self.wrong(format!("by_state: no entry says that job {id} is {kind}, as its record does"));
        }
        Ok(())
    }

    fn outbox(&mut self, tables: &dyn Tables) -> Result<(), StoreError> {
        tables.scan(Table::Outbox, &[], &[], &mut |key, value| {
            if let Some(notice) = self.read(record::decode_notice(key, value))? {
                let seq = notice.seq();
                if outbox::key(seq) != *key || self.is_ahead(seq) {
                    self.wrong(format!("outbox: the entry of change {seq} is out of place"));
                }
            }
            Ok(true)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::{Ending, Step};
    use crate::memory::MemoryStore;
    use crate::store::{Filter, JobStore};
    use crate::tables::Put;
    use crate::testkit::{dropped, result_of};

    /// Three jobs: one waits, one is in work, one has ended, and someone is to hear of that.
    fn store() -> MemoryStore {
        let store = MemoryStore::default();
        store.subscribe(&["farm".into()]).unwrap();
        let found: Vec<_> = (0..3).map(|at| dropped(&format!("{at}.stl"), at).unwrap()).collect();
        store.submit(&found).unwrap();
        let claim = store.claim(&Filter::default()).unwrap().unwrap();
        for step in [Step::Intend(result_of(&claim.job, Ending::Clean)), Step::Placed, Step::Finished] {
            store.advance(&claim, step).unwrap();
        }
        store.claim(&Filter::default()).unwrap().unwrap();
        store
    }

    fn put(store: &MemoryStore, table: Table, key: Vec<u8>, value: Option<Vec<u8>>) {
        store.tables().write(vec![Put { table, key, value }], Seq(0)).unwrap();
    }

    fn wrong(store: &MemoryStore) -> Vec<String> {
        check(store.tables()).unwrap().wrong
    }

    fn number(id: u64) -> Vec<u8> {
        id.to_be_bytes().to_vec()
    }

    #[test]
    fn f05_a_sound_store_has_nothing_wrong() {
        let checked = check(store().tables()).unwrap();
        // The head, subscribers, the mark of a new store; three jobs and their entries; one end to be told.
        assert_eq!((checked.jobs, checked.records, checked.wrong), (3, 10, vec![]));
    }

    #[test]
    fn f05_each_kind_of_damage_is_found_and_named_once() {
        let of = |table, key: &[u8]| store().tables().get(table, key).unwrap().unwrap();
        let flipped = |mut bytes: Vec<u8>| {
            let last = bytes.len() - 2;
            bytes[last] ^= 1;
            Some(bytes)
        };
        let one = Table::Jobs;
        for (table, key, value, line) in [
            (one, number(1), flipped(of(one, &number(1))), "job 1: its checksum is wrong"),
            (one, number(2), Some(of(one, &number(1))), "job 2: its checksum is wrong"),
            (one, number(1), None, "by_state: an entry says that job 1 is done; no record says so"),
            (one, b"odd".to_vec(), Some(of(one, &number(1))), "a job under a key that is no number: its checksum is wrong"),
            (Table::Meta, HEAD.to_vec(), flipped(of(Table::Meta, HEAD)), "meta/head: its checksum is wrong"),
            (Table::Meta, HEAD.to_vec(), None, "meta/head: it is missing"),
            (Table::Meta, b"night".to_vec(), Some(b"SUTR".to_vec()), "meta/night: it is too short"),
            (Table::ByState, vec![9], Some(vec![]), "by_state: an entry cannot be understood"),
        ] {
            let store = store();
            put(&store, table, key, value);
            assert_eq!(wrong(&store), [line]);
        }
    }

    /// Both halves are told of: the entry that is wrong, and the one that is not there.
    #[test]
    fn f05_an_index_that_disagrees_with_a_record_is_found() {
        let store = store();
        let done = [&[9][..], &number(1)].concat();
        put(&store, Table::ByState, done, None);
        assert_eq!(wrong(&store), ["by_state: no entry says that job 1 is done, as its record does"]);
        put(&store, Table::ByState, [&[10][..], &number(1)].concat(), Some(vec![]));
        assert_eq!(wrong(&store)[0], "by_state: an entry says that job 1 is failed; no record says so");
        assert_eq!(wrong(&store).len(), 2);
    }

    #[test]
    fn f05_a_head_that_lies_behind_is_found() {
        let store = store();
        let head = record::encode_head(HEAD, &Head { last_job: JobId(2), seq: Seq(900), ..Head::default() }).unwrap();
        put(&store, Table::Meta, HEAD.to_vec(), Some(head));
        assert_eq!(wrong(&store), ["job 3: it is ahead of the head, which says what came last"]);
        let head = record::encode_head(HEAD, &Head { last_job: JobId(3), ..Head::default() }).unwrap();
        put(&store, Table::Meta, HEAD.to_vec(), Some(head));
        assert!(wrong(&store).len() == 4 && wrong(&store)[3].starts_with("outbox: the entry of change"), "{:?}", wrong(&store));
    }
}
