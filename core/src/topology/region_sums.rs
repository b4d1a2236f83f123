//! What is summed over the regions of a chunk.

use crate::geometry::sums::{Bounds, Extent, Measure};
use crate::io::record::Point;
use crate::util::ids::NONE;

/// What is summed over a region: its triangles with three regular corners, until the merge also some whose other corners are not.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RegionSums {
    pub(crate) triangles: u64,
    pub(crate) extent: Extent,
    /// Of its regular vertices.
    pub(crate) bounds: Bounds,
    /// Smallest member with a regular corner in it.
    pub(crate) first: u32,
}

/// Adds triangles up for the region that the last of them belonged to. Those of the largest region are only counted: the sum over all of
/// the chunk is known, and sums are exact, so theirs is what the others leave.
pub(crate) struct Sum<'a> {
    pub(crate) measure: &'a Measure,
    pub(crate) positions: &'a [Point],
    /// [`NONE`] if there is none.
    pub(crate) largest: u32,
    pub(crate) region: u32,
    pub(crate) first: u32,
    pub(crate) triangles: u64,
    pub(crate) of_region: Batch,
    pub(crate) of_none: Batch,
    /// Of what is not the largest region's.
    pub(crate) others: Extent,
}

impl<'a> Sum<'a> {
    pub(crate) fn new(measure: &'a Measure, positions: &'a [Point], largest: u32) -> Self {
        let (of_region, of_none) = (Batch::default(), Batch::default());
        Self {
            measure,
            positions,
            largest,
            region: NONE,
            first: NONE,
            triangles: 0,
            of_region,
            of_none,
            others: Extent::default(),
        }
    }

    #[inline(always)]
    pub(crate) fn add(&mut self, region: u32, triangle: u32, vertices: [u32; 3], regions: &mut [RegionSums]) {
        if self.region != region || self.of_region.is_full() {
            self.flush(regions);
            self.region = region;
        }
        self.first = self.first.min(triangle);
        self.triangles += 1;
        if region != self.largest {
            self.of_region.push(vertices.map(|v| self.positions[v as usize]));
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
    pub(crate) fn flush(&mut self, regions: &mut [RegionSums]) {
        if self.triangles > 0 {
            let extent = self.of_region.take(self.measure);
            self.others += extent;
            let sums = &mut regions[self.region as usize];
            sums.first = sums.first.min(self.first);
            sums.triangles += self.triangles;
            sums.extent += extent;
        }
        (self.first, self.triangles) = (NONE, 0);
    }

    /// The sum over all members being `total`.
    pub(crate) fn finish(mut self, mut total: Extent, regions: &mut [RegionSums]) {
        self.flush(regions);
        self.others += self.of_none.take(self.measure);
        total -= self.others;
        if let Some(largest) = regions.get_mut(self.largest as usize) {
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
