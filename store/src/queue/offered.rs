//! Jobs whose results others may have a copy of.

use super::Queue;
use crate::id::Recipe;
use crate::job::Job;
use crate::store::StoreError;
use crate::tables::Tables;

impl<T: Tables> Queue<T> {
    /// As [`crate::JobStore::results`].
    pub(super) fn offered(&self, size: u64, recipe: Option<Recipe>) -> Result<Vec<Job>, StoreError> {
        let ids = self.lock().results.latest(size, recipe);
        let mut jobs = Vec::new();
        for id in ids {
            // It may have been forgotten meanwhile.
            let Some(job) = self.job(id)? else { continue };
            if job.source.size == size && job.offers().is_some_and(|offered| recipe.is_none_or(|recipe| recipe == offered)) {
                jobs.push(job);
            }
        }
        Ok(jobs)
    }
}
