//! Files that are taken in, as many at a time as one transaction of the tables holds.

use std::collections::BTreeMap;

use super::files::Identity;
use super::{Head, Queue, fits};
use crate::job::Job;
use crate::path::MAX_SOURCE;
use crate::store::{StoreError, Submission, Submitted};
use crate::tables::Tables;

/// Jobs taken in by one transaction of the tables.
pub(super) const CHUNK: usize = 1000;

impl<T: Tables> Queue<T> {
    /// As [`crate::JobStore::submit`].
    pub(super) fn take_in(&self, found: &[Submission]) -> Result<Vec<Submitted>, StoreError> {
        self.tables.sound()?;
        for submission in found {
            let path = &submission.source.path;
            if path.to_string().len() > MAX_SOURCE {
                return Err(StoreError::TooLong {
                    what: format!("the path of {} bytes that begins with {}", path.as_bytes().len(), path.beginning()),
                });
            }
            fits("the folder's name", &submission.source.folder)?;
            fits("the profile's name", &submission.source.profile)?;
        }
        let mut answers = Vec::with_capacity(found.len());
        let mut last = None;
        for chunk in found.chunks(CHUNK) {
            last = self.take_chunk(chunk, &mut answers)?.or(last);
        }
        // What was known already may be another thread's, not yet durable: settle in any case.
        let head = last.unwrap_or_else(|| self.lock().head);
        self.settle(head)?;
        Ok(answers)
    }

    /// Takes in one chunk; answers and head in return.
    fn take_chunk(&self, found: &[Submission], answers: &mut Vec<Submitted>) -> Result<Option<Head>, StoreError> {
        let now = self.clock.now();
        let inner = self.lock();
        let mut head = inner.head;
        let mut jobs: Vec<Job> = Vec::new();
        let mut keys = BTreeMap::new();
        for submission in found {
            let file = Identity::from(&submission.source);
            if let Some(id) = keys.get(&file).copied().map_or_else(|| self.answering(&inner, &file), |id| Ok(Some(id)))? {
                answers.push(Submitted { id, new: false });
                continue;
            }
            head.seq.0 += 1;
            head.last_job.0 += 1;
            let id = head.last_job;
            let source = submission.source.clone();
            let mut job = match &submission.foreign {
                None => Job::queued(id, source, now),
                Some(what) => Job::noticed(id, source, what, now),
            };
            job.priority = submission.priority;
            job.seq = head.seq;
            jobs.push(job);
            keys.insert(file, id);
            answers.push(Submitted { id, new: true });
        }
        if jobs.is_empty() {
            return Ok(None);
        }
        let changes: Vec<_> = jobs.iter().map(|job| (None, job)).collect();
        self.commit(inner, head, &changes)?;
        Ok(Some(head))
    }
}
