//! Files that are taken in, as many at a time as one transaction of the tables holds.

use std::collections::BTreeMap;

use super::files::Identity;
use super::{Head, Queue, fits};
use crate::id::{JobId, Time};
use crate::job::{Event, Job, Kind};
use crate::path::MAX_SOURCE;
use crate::store::{StoreError, Submission, Submitted};
use crate::tables::Tables;

/// Jobs taken in by one transaction of the tables.
pub(crate) const CHUNK: usize = 1000;

impl<T: Tables> Queue<T> {
    /// As [`crate::JobStore::submit`].
    pub(super) fn take_in(&self, found: &[Submission]) -> Result<Vec<Submitted>, StoreError> {
        self.tables.sound()?;
        can_be_taken(found)?;
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
        let mut jobs: Vec<(Option<Job>, Job)> = Vec::new();
        let mut keys = BTreeMap::new();
        for submission in found {
            let file = Identity::from(&submission.source);
            if let Some(id) = keys.get(&file).copied() {
                answers.push(Submitted { id, new: false, ended: false });
                continue;
            }
            let latest = self.latest_of(&inner, &file)?;
            if let Some(ended) = latest.as_ref().filter(|job| submission.may_be_gone(job)) {
                answers.push(Submitted { id: ended.id, new: false, ended: true });
                continue;
            }
            let known = latest.filter(Job::answers_for_source);
            let (before, mut job) = match (known, &submission.foreign) {
                // Only noticed until now, and wanted since.
                (Some(noticed), None) if noticed.kind() == Kind::Noticed => {
                    let wanted = noticed.after(&Event::Want(submission.priority), now);
                    let job = wanted.map_err(|source| StoreError::Illegal { id: noticed.id, source })?;
                    (Some(noticed), job)
                }
                (Some(known), _) => {
                    answers.push(Submitted { id: known.id, new: false, ended: false });
                    continue;
                }
                (None, _) => {
                    head.last_job.0 += 1;
                    (None, found_now(head.last_job, submission, now))
                }
            };
            head.seq.0 += 1;
            job.seq = head.seq;
            keys.insert(file, job.id);
            answers.push(Submitted { id: job.id, new: true, ended: false });
            jobs.push((before, job));
        }
        if jobs.is_empty() {
            return Ok(None);
        }
        let changes: Vec<_> = jobs.iter().map(|(before, job)| (before.as_ref(), job)).collect();
        self.commit(inner, head, &changes)?;
        Ok(Some(head))
    }
}

/// Does each of them fit a record?
pub(crate) fn can_be_taken(found: &[Submission]) -> Result<(), StoreError> {
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
    Ok(())
}

/// The job of a file that no job answers for.
pub(crate) fn found_now(id: JobId, submission: &Submission, now: Time) -> Job {
    let source = submission.source.clone();
    let job = match &submission.foreign {
        None => Job::queued(id, source, now),
        Some(what) => Job::noticed(id, source, what, now),
    };
    Job { priority: submission.priority, ..job }
}
