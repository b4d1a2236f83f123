//! Whose job is whose file. In memory, made anew at each opening, for the reason of [`super::results`]: what makes a file that file is in no order.

use std::cmp::Reverse;
use std::collections::BTreeSet;
use std::hash::{BuildHasher, RandomState};

use crate::id::JobId;
use crate::job::{Job, Source};
use crate::path::RelPath;

/// The identity of a dropped file. The profile is not part of it: a changed setting does not make a new drop.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct Identity<'a> {
    dev: u64,
    ino: u64,
    size: u64,
    mtime_ns: i64,
    folder: &'a str,
    path: &'a RelPath,
}

impl<'a> From<&'a Source> for Identity<'a> {
    fn from(source: &'a Source) -> Self {
        let Source { folder, path, dev, ino, size, mtime_ns, profile: _ } = source;
        Self { dev: *dev, ino: *ino, size: *size, mtime_ns: *mtime_ns, folder, path }
    }
}

/// The jobs of each file, the latest first, by a hash of its identity: 16 bytes a job, and the job itself says whether it is the file's. The hash is
/// keyed anew at each opening, so that no one can name files whose hashes meet.
#[derive(Default)]
pub(super) struct Files {
    hasher: RandomState,
    jobs: BTreeSet<(u64, Reverse<JobId>)>,
}

impl Files {
    /// A job came, or changed.
    pub(super) fn add(&mut self, job: &Job) {
        self.jobs.extend(self.entry(job));
    }

    /// A job changes, or goes.
    pub(super) fn remove(&mut self, job: &Job) {
        if let Some(entry) = self.entry(job) {
            self.jobs.remove(&entry);
        }
    }

    /// A job that came back from an earlier store, and whose file is gone since, has no inode: it is no file's.
    fn entry(&self, job: &Job) -> Option<(u64, Reverse<JobId>)> {
        let is_known = job.source.ino != 0;
        is_known.then(|| (self.hasher.hash_one(Identity::from(&job.source)), Reverse(job.id)))
    }

    /// Numbers of jobs that may be the file's, the latest first.
    pub(super) fn candidates(&self, file: &Identity<'_>) -> Vec<JobId> {
        let hash = self.hasher.hash_one(file);
        let range = (hash, Reverse(JobId(u64::MAX)))..=(hash, Reverse(JobId(0)));
        self.jobs.range(range).map(|(_, id)| id.0).collect()
    }
}
