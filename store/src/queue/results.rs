//! Good results by what they were made of: how a job finds one that it can have a copy of (`offered`). In memory, made anew at each opening: such keys are in no
//! order, and on disk every entry would come to a page of its own. That took more room than the jobs themselves (measured).

use std::cmp::Reverse;
use std::collections::BTreeSet;

use crate::id::{JobId, Recipe};
use crate::job::Job;
use crate::store::MOST_RESULTS;

/// Size of the source, recipe and job of each good result, the latest first.
#[derive(Default)]
pub(super) struct Results(BTreeSet<(u64, Recipe, Reverse<JobId>)>);

impl Results {
    /// A job came, or changed.
    pub(super) fn add(&mut self, job: &Job) {
        self.0.extend(job.offers().map(|recipe| (job.source.size, recipe, Reverse(job.id))));
    }

    /// A job changes, or goes.
    pub(super) fn remove(&mut self, job: &Job) {
        if let Some(recipe) = job.offers() {
            self.0.remove(&(job.source.size, recipe, Reverse(job.id)));
        }
    }

    /// The latest jobs of this size and recipe, the latest first; without a recipe, one of this size.
    pub(super) fn latest(&self, size: u64, recipe: Option<Recipe>) -> Vec<JobId> {
        let (from, to) = recipe.map_or((Recipe(0), Recipe(u64::MAX)), |recipe| (recipe, recipe));
        let range = (size, from, Reverse(JobId(u64::MAX)))..=(size, to, Reverse(JobId(0)));
        let most = if recipe.is_some() { MOST_RESULTS } else { 1 };
        self.0.range(range).take(most).map(|(_, _, id)| id.0).collect()
    }
}
