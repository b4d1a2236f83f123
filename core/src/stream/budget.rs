//! Memory that grows with the input, counted as it is made. Too much of it is a refusal with numbers, never another result.

use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::contract::error::{Error, Result};
use crate::util::words::Count;

/// The purpose that memory is taken for.
#[derive(Clone, Copy)]
pub(crate) enum Purpose {
    /// Lists, spools and the tables that chunks are solved in.
    Tables,
    /// Pieces of regular surface.
    Surface,
    /// What chunks know of triangles that others see, too. Given back before the submesh is made.
    Seams,
    /// Triangles at defects, in the submesh.
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

    /// Bytes that may still be taken.
    pub(crate) fn left(&self) -> u64 {
        self.limit.saturating_sub(self.total())
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
        let [tables, surface, seams, defects] =
            [0, 1, 2, 3].map(|i: usize| Count(mebibytes(self.taken[i].load(Ordering::Relaxed))));
        Err(Error::Starved {
            path: path.into(),
            reason: format!(
                "{}, which needs at least {} MiB of memory ({tables} for tables, {surface} for pieces of surface, then {seams} for seams \
                 or {defects} for defects)",
                what(),
                Count(mebibytes(self.total()))
            ),
            advice: format!("the budget is {} MiB: raise --memory", Count(self.limit >> 20)),
        })
    }
}

/// Tables that are counted while they grow, and given back together.
pub(crate) struct Loan<'b> {
    budget: &'b Budget,
    taken: AtomicU64,
}

impl<'b> Loan<'b> {
    pub(crate) fn of(budget: &'b Budget) -> Self {
        Self { budget, taken: AtomicU64::new(0) }
    }

    /// Takes so many `bytes` more; says whether they were there.
    pub(crate) fn take(&self, bytes: u64) -> bool {
        self.taken.fetch_add(bytes, Ordering::Relaxed);
        self.budget.take(Purpose::Tables, bytes);
        !self.budget.is_exceeded()
    }

    /// Refuses the work on `path` if something was taken and the budget is exceeded.
    pub(crate) fn check(&self, path: &Path, what: impl FnOnce() -> String) -> Result<()> {
        if self.taken.load(Ordering::Relaxed) > 0 { self.budget.check(path, what) } else { Ok(()) }
    }
}

impl Drop for Loan<'_> {
    fn drop(&mut self) {
        self.budget.give_back(Purpose::Tables, *self.taken.get_mut());
    }
}

/// Bytes that a submesh of so many triangles and vertices takes, tables of the repairs and the edit included: measured on meshes with defects
/// here and there (1.7 to 4.3 M triangles of 200 M, half as many vertices: 145 bytes a triangle).
pub(crate) fn submesh_bytes(triangles: u64, vertices: u64) -> u64 {
    144 * triangles + 24 * vertices
}

/// Bytes that it takes without its edges and other tables: 100 bytes a triangle of the same meshes.
pub(crate) fn bare_submesh_bytes(triangles: u64, vertices: u64) -> u64 {
    88 * triangles + 24 * vertices
}

/// Bytes that a triangle to be deleted for its coordinates takes: its run in the lists that are found and merged, and its change, in a list
/// that may grow once more.
pub(crate) const BYTES_PER_NONFINITE: u64 = 4 * 8 + 3 * 24;

/// Surface that lies on other surface is looked for up to this number of triangles.
pub(crate) const OVERLAPS_LOOKED_FOR: usize = 1 << 19;

/// Bytes that trees over the edges of one triangle take at most, with what is kept of each of these edges: their vertices are compared, and
/// surface that ends on other surface is looked for, up to a number of triangles. Measured on soups of 0.3 and 1 M triangles without a shared
/// vertex (331 and 93 bytes an edge beside the submesh).
pub(crate) fn boundary_bytes(edges: u64) -> u64 {
    (112 * edges).max(352 * edges.min(3 * OVERLAPS_LOOKED_FOR as u64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contract::error::ErrorClass;

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
