//! Memory that grows with the input, counted as it is made. Too much of it is a refusal with numbers, never another result.

use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::{Error, Result};

/// What memory is taken for.
#[derive(Clone, Copy)]
pub(crate) enum Purpose {
    /// Lists, spools and the tables that chunks are solved in.
    Tables,
    /// Pieces of sound surface.
    Surface,
    /// What chunks know of triangles that others see, too. Given back before the workshop is made.
    Seams,
    /// Triangles at defects, in the workshop.
    Defects,
}

/// The budget of one stage.
#[derive(Debug)]
pub(crate) struct Budget {
    limit: u64,
    taken: [AtomicU64; 4],
}

impl Budget {
    pub(crate) fn new(limit: u64) -> Self {
        Self { limit, taken: Default::default() }
    }

    /// Notes that so many `bytes` were taken; whether they were there is asked later.
    pub(crate) fn take(&self, purpose: Purpose, bytes: u64) {
        self.taken[purpose as usize].fetch_add(bytes, Ordering::Relaxed);
    }

    /// Notes that so many `bytes` of what was taken are free again.
    pub(crate) fn give_back(&self, purpose: Purpose, bytes: u64) {
        self.taken[purpose as usize].fetch_sub(bytes, Ordering::Relaxed);
    }

    /// The most that is held at a time.
    fn total(&self) -> u64 {
        let [tables, surface, seams, defects] = [0, 1, 2, 3].map(|i: usize| self.taken[i].load(Ordering::Relaxed));
        tables.saturating_add(surface).saturating_add(seams.max(defects))
    }

    pub(crate) fn is_exceeded(&self) -> bool {
        self.total() > self.limit
    }

    /// Refuses the work on `path` if the budget is exceeded; `what` says of what there is too much.
    pub(crate) fn check(&self, path: &Path, what: impl FnOnce() -> String) -> Result<()> {
        if !self.is_exceeded() {
            return Ok(());
        }
        let mebibytes = |bytes: u64| bytes.div_ceil(1 << 20);
        let [tables, surface, seams, defects] = [0, 1, 2, 3].map(|i: usize| mebibytes(self.taken[i].load(Ordering::Relaxed)));
        Err(Error::Starved {
            path: path.into(),
            reason: format!(
                "{}, which needs at least {} MiB of memory ({tables} for tables, {surface} for pieces of surface, then {seams} for seams \
                 or {defects} for defects)",
                what(),
                mebibytes(self.total())
            ),
            advice: format!("the budget is {} MiB: raise --memory", self.limit >> 20),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::ErrorClass;

    #[test]
    fn a_refusal_says_what_it_was_for() {
        let budget = Budget::new(10 << 20);
        budget.take(Purpose::Tables, 7 << 20);
        budget.take(Purpose::Seams, 2 << 20);
        budget.take(Purpose::Defects, 3 << 20);
        budget.check(Path::new("part.stl"), || unreachable!()).unwrap();
        budget.take(Purpose::Surface, 1);
        let error = budget.check(Path::new("part.stl"), || "a lot of it".into()).unwrap_err();
        assert_eq!(error.class(), ErrorClass::Starved, "more memory would help");
        let line = "part.stl: refused: a lot of it, which needs at least 11 MiB of memory (7 for tables, 1 for pieces of surface, \
            then 2 for seams or 3 for defects); the budget is 10 MiB: raise --memory";
        assert_eq!(error.to_string(), line);
        budget.give_back(Purpose::Tables, 1);
        budget.check(Path::new("part.stl"), || unreachable!()).unwrap();
    }
}
