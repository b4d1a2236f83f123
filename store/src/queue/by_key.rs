//! Whose job is whose file: the index by what makes a file that file.

use super::Queue;
use crate::id::JobId;
use crate::job::{Job, Source};
use crate::record;
use crate::store::StoreError;
use crate::tables::{Table, Tables};

impl<T: Tables> Queue<T> {
    /// The job that answers for the file with this identity already.
    pub(super) fn answering(&self, key: &[u8]) -> Result<Option<JobId>, StoreError> {
        let Some(bytes) = self.tables.get(Table::ByKey, key)? else { return Ok(None) };
        let id: JobId = record::decode(Table::ByKey, key, &bytes)?;
        Ok(self.job(id)?.filter(Job::answers_for_source).map(|job| job.id))
    }

    /// As [`crate::JobStore::find`].
    pub(super) fn latest_of(&self, source: &Source) -> Result<Option<JobId>, StoreError> {
        let key = identity(source);
        let Some(bytes) = self.tables.get(Table::ByKey, &key)? else { return Ok(None) };
        let id = record::decode(Table::ByKey, &key, &bytes)?;
        Ok(self.job(id)?.map(|job| job.id))
    }
}

/// What makes a dropped file that file. The profile is not part of it: a changed setting does not make a new drop.
pub(super) fn identity(source: &Source) -> Vec<u8> {
    let folder = source.folder.as_bytes();
    let mut key = Vec::with_capacity(40 + folder.len() + source.path.as_bytes().len());
    for number in [source.dev, source.ino, source.size] {
        key.extend_from_slice(&number.to_be_bytes());
    }
    key.extend_from_slice(&source.mtime_ns.to_be_bytes());
    key.extend_from_slice(&(folder.len() as u64).to_be_bytes());
    key.extend_from_slice(folder);
    key.extend_from_slice(source.path.as_bytes());
    key
}
