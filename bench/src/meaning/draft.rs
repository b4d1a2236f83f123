//! A case before it is put in its place.

use std::ops::RangeInclusive;

use super::mesh::Mesh;
use super::random::Chance;

/// A case before it is put in its place.
pub(super) struct Draft {
    pub(super) damaged: Mesh,
    pub(super) intended: Mesh,
    pub(super) tolerance: f64,
    pub(super) bodies: RangeInclusive<u64>,
    /// Triangles with a corner twice are written, too.
    pub(super) keeps_slivers: bool,
}

impl Draft {
    /// Of one body, to be had back almost exactly.
    pub(super) fn of(damaged: Mesh, intended: Mesh) -> Self {
        Self { damaged, intended, tolerance: 0.002, bodies: 1..=1, keeps_slivers: false }
    }

    pub(super) fn within(self, tolerance: f64) -> Self {
        Self { tolerance, ..self }
    }

    pub(super) fn bodies(self, bodies: RangeInclusive<u64>) -> Self {
        Self { bodies, ..self }
    }

    pub(super) fn with_slivers(self) -> Self {
        Self { keeps_slivers: true, ..self }
    }
}

/// Name, what is wrong, whether the file decides, and how it is made.
pub(super) type Entry = (&'static str, &'static str, bool, fn(&mut Chance) -> Draft);
