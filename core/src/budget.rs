//! Memory that grows with the input, counted as it is made. Too much of it is a refusal with numbers, never another result.

use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::{Error, Result};

/// What memory is taken for.
#[derive(Clone, Copy)]
pub(crate) enum Purpose {
    /// Lists, spools and the tables that chunks are solved in.
    Tables,
    /// Triangles at defects.
    Defects,
    /// Pieces of sound surface, and the seams where chunks meet.
    Surface,
}

/// The budget of one stage.
#[derive(Debug)]
pub(crate) struct Budget {
    limit: u64,
    taken: [AtomicU64; 3],
}

impl Budget {
    pub(crate) fn new(limit: u64) -> Self {
        Self { limit, taken: Default::default() }
    }

    /// Notes that so many `bytes` were taken; whether they were there is asked later.
    pub(crate) fn take(&self, purpose: Purpose, bytes: u64) {
        self.taken[purpose as usize].fetch_add(bytes, Ordering::Relaxed);
    }

    fn total(&self) -> u64 {
        self.taken.iter().fold(0, |sum, bytes| sum.saturating_add(bytes.load(Ordering::Relaxed)))
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
        let [tables, defects, surface] = [0, 1, 2].map(|i| mebibytes(self.taken[i].load(Ordering::Relaxed)));
        Err(Error::Refused {
            path: path.into(),
            reason: format!(
                "{}, which needs at least {} MiB of memory ({tables} for tables, {defects} for defects, {surface} for pieces of surface and seams)",
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

    #[test]
    fn a_refusal_says_what_it_was_for() {
        let budget = Budget::new(10 << 20);
        budget.take(Purpose::Tables, 10 << 20);
        budget.check(Path::new("part.stl"), || unreachable!()).unwrap();
        budget.take(Purpose::Surface, 1);
        let error = budget.check(Path::new("part.stl"), || "a lot of it".into()).unwrap_err();
        let line = "part.stl: refused: a lot of it, which needs at least 11 MiB of memory (10 for tables, 0 for defects, \
            1 for pieces of surface and seams); the budget is 10 MiB: raise --memory";
        assert_eq!(error.to_string(), line);
    }
}
