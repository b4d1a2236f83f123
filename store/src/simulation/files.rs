//! The files, in the one place that all hosts see: originals, and results that are put there once.

use std::collections::{BTreeMap, BTreeSet};

use crate::id::{Hash, JobId};
use crate::job::Area;

#[derive(Default)]
pub(super) struct Files {
    /// Where each original is.
    originals: BTreeMap<JobId, Area>,
    results: BTreeMap<(JobId, bool), BTreeSet<Hash>>,
}

impl Files {
    /// Puts a result, unless it is there; good ones have a name of which there is one.
    pub(super) fn put(&mut self, id: JobId, area: Area, hash: Hash) {
        let is_good = area == Area::Done;
        let there = self.results.entry((id, is_good)).or_default();
        there.insert(hash);
        assert!(!is_good || there.len() == 1, "job {id} has two results: {there:?}");
    }

    /// Moves an original, if it is where it is said to be.
    pub(super) fn move_original(&mut self, id: JobId, from: Area, to: Area) {
        if self.original(id) == from {
            self.originals.insert(id, to);
        }
    }

    pub(super) fn original(&self, id: JobId) -> Area {
        self.originals.get(&id).copied().unwrap_or(Area::In)
    }

    pub(super) fn has(&self, id: JobId, area: Area, hash: Hash) -> bool {
        self.results.get(&(id, area == Area::Done)).is_some_and(|there| there.contains(&hash))
    }

    /// Results of that job, good ones and others.
    pub(super) fn of(&self, id: JobId) -> impl Iterator<Item = (bool, &Hash)> {
        [true, false]
            .into_iter()
            .flat_map(move |good| self.results.get(&(id, good)).into_iter().flatten().map(move |hash| (good, hash)))
    }
}
