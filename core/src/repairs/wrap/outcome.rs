//! What comes of a group of pieces that is no solid.

use crate::algorithms::wrap::tree::Corners;
use crate::contract::report::Wrap;
use crate::geometry::position::Position;

/// All wraps of a file: their triangles, and the pieces that they replace.
#[derive(Default)]
pub(crate) struct Wraps {
    /// Regions that were replaced, and those that would have been but for a reason.
    pub(crate) listed: Vec<Wrap>,
    /// The new triangles.
    pub(crate) triangles: Vec<Corners>,
    pub(crate) regions: u64,
    /// Positions of all vertices of the submesh that are gone, ascending.
    pub(crate) gone: Vec<Position>,
}

/// The wrap of one group, or why there is none.
pub(crate) struct Outcome {
    pub(crate) told: Wrap,
    pub(crate) triangles: Vec<Corners>,
}

impl Outcome {
    pub(crate) fn give_up(&mut self, reason: &str) {
        if self.told.left.is_none() {
            self.told.left = Some(reason.into());
            self.told.added = 0;
            self.triangles = Vec::new();
        }
    }
}
