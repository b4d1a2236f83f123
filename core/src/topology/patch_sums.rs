//! What is summed over the patches of a chunk.

use crate::geometry::sums::{Bounds, Extent, Measure};
use crate::io::record::Point;
use crate::util::union_find::NONE;

/// What is summed over a patch: its triangles with three regular corners, until the merge also some whose other corners are not.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patch {
    pub(crate) triangles: u64,
    pub(crate) extent: Extent,
    /// Of its regular vertices.
    pub(crate) bounds: Bounds,
    /// Smallest member with a regular corner in it.
    pub(crate) first: u32,
}

/// Adds triangles up for the patch that the last of them belonged to. Those of the largest patch are only counted: the sum over all of
/// the chunk is known, and sums are exact, so theirs is what the others leave.
pub(crate) struct Sum<'a> {
    pub(crate) measure: &'a Measure,
    pub(crate) positions: &'a [Point],
    /// [`NONE`] if there is none.
    pub(crate) largest: u32,
    pub(crate) patch: u32,
    pub(crate) first: u32,
    pub(crate) triangles: u64,
    pub(crate) of_patch: Batch,
    pub(crate) of_none: Batch,
    /// Of what is not the largest patch's.
    pub(crate) others: Extent,
}

impl<'a> Sum<'a> {
    pub(crate) fn new(measure: &'a Measure, positions: &'a [Point], largest: u32) -> Self {
        let (of_patch, of_none) = (Batch::default(), Batch::default());
        Self { measure, positions, largest, patch: NONE, first: NONE, triangles: 0, of_patch, of_none, others: Extent::default() }
    }

    #[inline(always)]
    pub(crate) fn add(&mut self, patch: u32, triangle: u32, vertices: [u32; 3], patches: &mut [Patch]) {
        if self.patch != patch || self.of_patch.is_full() {
            self.flush(patches);
            self.patch = patch;
        }
        self.first = self.first.min(triangle);
        self.triangles += 1;
        if patch != self.largest {
            self.of_patch.push(vertices.map(|v| self.positions[v as usize]));
        }
    }

    /// Leaves a triangle out.
    #[inline(always)]
    pub(crate) fn leave(&mut self, vertices: [u32; 3]) {
        if self.of_none.is_full() {
            self.others += self.of_none.take(self.measure);
        }
        self.of_none.push(vertices.map(|v| self.positions[v as usize]));
    }

    #[inline(always)]
    pub(crate) fn flush(&mut self, patches: &mut [Patch]) {
        if self.triangles > 0 {
            let extent = self.of_patch.take(self.measure);
            self.others += extent;
            let sums = &mut patches[self.patch as usize];
            sums.first = sums.first.min(self.first);
            sums.triangles += self.triangles;
            sums.extent += extent;
        }
        (self.first, self.triangles) = (NONE, 0);
    }

    /// The sum over all members being `total`.
    pub(crate) fn finish(mut self, mut total: Extent, patches: &mut [Patch]) {
        self.flush(patches);
        self.others += self.of_none.take(self.measure);
        total -= self.others;
        if let Some(largest) = patches.get_mut(self.largest as usize) {
            largest.extent = total;
        }
    }
}

/// Some triangles that are summed at once.
pub(crate) struct Batch {
    pub(crate) corners: [[Point; 3]; Self::LEN],
    pub(crate) filled: usize,
}

impl Default for Batch {
    fn default() -> Self {
        Self { corners: [[[0.0; 3]; 3]; Self::LEN], filled: 0 }
    }
}

impl Batch {
    pub(crate) const LEN: usize = 32;

    #[inline(always)]
    pub(crate) fn is_full(&self) -> bool {
        self.filled == Self::LEN
    }

    /// Must not be full.
    #[inline(always)]
    pub(crate) fn push(&mut self, corners: [Point; 3]) {
        self.corners[self.filled] = corners;
        self.filled += 1;
    }

    pub(crate) fn take(&mut self, measure: &Measure) -> Extent {
        measure.sum(&self.corners[..std::mem::take(&mut self.filled)])
    }
}
