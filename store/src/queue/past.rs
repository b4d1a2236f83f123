//! A store that was begun anew, and what earlier ones knew: their jobs come back from what these left on the disk.
//!
//! The entry `unfilled` of the table `meta` is made with the first head, and goes when nothing is left to be read. As long as it is there, a
//! daemon that was interrupted over it reads once more.

use std::collections::BTreeSet;

use super::submit::CHUNK;
use super::{Queue, UNFILLED, fits, head_put};
use crate::id::{JobId, Token};
use crate::job::{Job, Past, one_line};
use crate::path::{MAX_NAMED, MAX_SOURCE, RelPath};
use crate::store::StoreError;
use crate::tables::{Put, Table, Tables};

/// No store comes as far. Numbers come from files that anyone may have written.
pub(crate) const HIGHEST: u64 = 1 << 48;

impl<T: Tables> Queue<T> {
    /// As [`crate::JobStore::is_unfilled`].
    pub(super) fn lacks_past(&self) -> Result<bool, StoreError> {
        Ok(self.tables.get(Table::Meta, UNFILLED)?.is_some())
    }

    /// As [`crate::JobStore::set_filled`].
    pub(super) fn has_past(&self) -> Result<(), StoreError> {
        self.tables.sound()?;
        let mut inner = self.lock();
        if !self.lacks_past()? {
            return Ok(());
        }
        let mut head = inner.head;
        head.seq.0 += 1;
        let gone = Put { table: Table::Meta, key: UNFILLED.to_vec(), value: None };
        self.tables.write(vec![gone, head_put(&head)?], head.seq)?;
        inner.head = head;
        drop(inner);
        self.settle(head)
    }

    /// As [`crate::JobStore::restore`].
    pub(super) fn take_back_past(&self, past: &[Past]) -> Result<Vec<JobId>, StoreError> {
        self.tables.sound()?;
        past.iter().try_for_each(can_be_recorded)?;
        let mut ids = Vec::with_capacity(past.len());
        for chunk in past.chunks(CHUNK) {
            ids.extend(self.restore_chunk(chunk)?);
        }
        Ok(ids)
    }

    fn restore_chunk(&self, past: &[Past]) -> Result<Vec<JobId>, StoreError> {
        let inner = self.lock();
        let mut head = inner.head;
        let (mut jobs, mut taken) = (Vec::<Job>::new(), BTreeSet::new());
        for one in past {
            let is_number = (1..=HIGHEST).contains(&one.id.0);
            let is_free = is_number && !taken.contains(&one.id) && self.job(one.id)?.is_none();
            let id = if is_free { one.id } else { JobId(head.last_job.0 + 1) };
            taken.insert(id);
            head.last_job = head.last_job.max(id);
            let mut job = one.job(id);
            job.work = job.work.filter(|token| token.0 <= HIGHEST);
            // No claim to come may have the work folder of this one.
            let Token(work) = job.work.unwrap_or_default();
            head.seq.0 = head.seq.0.max(work) + 1;
            job.seq = head.seq;
            jobs.push(job);
        }
        let changes: Vec<_> = jobs.iter().map(|job| (None, job)).collect();
        self.commit(inner, head, &changes)?;
        self.settle(head)?;
        Ok(jobs.iter().map(|job| job.id).collect())
    }
}

/// Does it fit a record, with all that may still come of it?
pub(crate) fn can_be_recorded(past: &Past) -> Result<(), StoreError> {
    let p = &past.publication;
    let short = |path: &RelPath, most: usize| match path.to_string().len() <= most {
        true => Ok(()),
        false => Err(StoreError::TooLong { what: format!("the path that begins with {}", path.beginning()) }),
    };
    short(&past.source.path, MAX_SOURCE)?;
    let moved = past.moved_to.as_ref().map(|(_, path)| path);
    [&p.output, &p.original].into_iter().flatten().chain(moved).try_for_each(|path| short(path, MAX_NAMED))?;
    if one_line(&p.reason) != p.reason {
        return Err(StoreError::TooLong { what: "the reason".into() });
    }
    fits("the folder's name", &past.source.folder)?;
    fits("the profile's name", &past.source.profile)
}
