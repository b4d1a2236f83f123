//! Good results by what they were made of: how a job finds one that it can have a copy of. The job numbers in the keys count down, so that
//! the latest come first.

use crate::id::{JobId, Recipe};
use crate::job::Job;
use crate::record::corrupt;
use crate::store::{MOST_RESULTS, StoreError};
use crate::tables::{Table, Tables};

/// The entry of a job.
pub(super) fn key(job: &Job, Recipe(recipe): Recipe) -> Vec<u8> {
    [job.source.size, recipe, !job.id.0].iter().flat_map(|number| number.to_be_bytes()).collect()
}

/// The latest jobs that have an entry for this size and recipe, the latest first; without a recipe, one that has an entry for this size.
pub(super) fn latest(tables: &dyn Tables, size: u64, recipe: Option<Recipe>) -> Result<Vec<JobId>, StoreError> {
    let (numbers, most) = ([Some(size), recipe.map(|recipe| recipe.0)], if recipe.is_some() { MOST_RESULTS } else { 1 });
    let from: Vec<u8> = numbers.into_iter().flatten().flat_map(u64::to_be_bytes).collect();
    let mut latest = Vec::new();
    tables.scan(Table::ByRecipe, &from, &[], &mut |key, _| {
        if !key.starts_with(&from) {
            return Ok(false);
        }
        let id = key.get(16..24).and_then(|id| id.try_into().ok()).map(u64::from_be_bytes);
        latest.push(JobId(!id.ok_or_else(|| corrupt("by_recipe", "a key is too short"))?));
        Ok(latest.len() < most)
    })?;
    Ok(latest)
}
