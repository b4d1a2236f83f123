//! Pages of jobs for people, the latest first, at a cost that does not grow with the store.

use super::{Queue, index};
use crate::id::JobId;
use crate::job::Job;
use crate::record;
use crate::store::{Look, PAGE_READS, Page, StoreError};
use crate::tables::{Table, Tables};

impl<T: Tables> Queue<T> {
    /// As [`crate::JobStore::page`].
    pub(super) fn latest(&self, look: &Look) -> Result<Page, StoreError> {
        let before = look.before.unwrap_or(JobId(u64::MAX));
        let mut page = Page::default();
        if look.limit == 0 {
            return Ok(page);
        }
        let is_of = |job: &Job| look.folder.as_ref().is_none_or(|folder| *folder == job.source.folder);
        let mut read = 0;
        // Whether the search goes on after this one.
        let mut see = |id: JobId, job: Option<Job>| {
            read += 1;
            page.jobs.extend(job.filter(is_of));
            let more = page.jobs.len() < look.limit && read < PAGE_READS;
            page.next = (!more).then_some(id);
            more
        };
        if look.kinds.is_empty() {
            self.tables.scan_back(Table::Jobs, &[], &before.0.to_be_bytes(), &mut |key, value| {
                let job: Job = record::decode(Table::Jobs, key, value)?;
                Ok(see(job.id, Some(job)))
            })?;
            return Ok(page);
        }
        let most = if look.folder.is_some() { PAGE_READS } else { look.limit.min(PAGE_READS) };
        let mut ids = Vec::new();
        for kind in &look.kinds {
            ids.extend(index::latest(&self.tables, *kind, before, most)?);
        }
        ids.sort_unstable_by(|a, b| b.cmp(a));
        ids.dedup();
        // Not all that lies before those is known.
        let is_cut = ids.len() >= most;
        ids.truncate(most);
        let last = ids.last().copied();
        for id in ids {
            // A job may have moved on, or be forgotten, since the index was read.
            if !see(id, self.job(id)?.filter(|job| look.kinds.contains(&job.kind()))) {
                return Ok(page);
            }
        }
        page.next = last.filter(|_| is_cut);
        Ok(page)
    }
}
