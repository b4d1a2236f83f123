//! A coarse grid of bits over some boxes, to tell quickly that another box is far from all of them.

use crate::geometry::sums::Bounds;

/// Cells that some boxes touch.
#[derive(Default)]
pub(crate) struct Grid {
    lo: [f32; 3],
    hi: [f32; 3],
    per_unit: [f32; 3],
    /// A bit a cell along x, a word a row, rows along y and then z.
    rows: Vec<u32>,
}

impl Grid {
    const SIDE: usize = 32;

    /// Marks the cells that these boxes touch, and no others.
    pub(crate) fn mark(&mut self, boxes: impl Iterator<Item = Bounds> + Clone) {
        let mut all = Bounds::EMPTY;
        boxes.clone().for_each(|b| all.add(&b));
        (self.lo, self.hi) = (all.lo, all.hi);
        self.per_unit = std::array::from_fn(|k| {
            let scale = Self::SIDE as f32 / (all.hi[k] - all.lo[k]);
            if scale.is_finite() { scale } else { 0.0 }
        });
        self.rows.clear();
        self.rows.resize(Self::SIDE * Self::SIDE, 0);
        for bounds in boxes {
            let (bits, (y0, y1), (z0, z1)) = self.place(&bounds);
            for z in z0..=z1 {
                self.rows[z * Self::SIDE + y0..=z * Self::SIDE + y1].iter_mut().for_each(|row| *row |= bits);
            }
        }
    }

    /// Bits along x, and ends along y and z. Monotonous in the box, so boxes that meet share a cell.
    #[inline(always)]
    #[expect(clippy::disallowed_methods, reason = "the number of a cell, no position")]
    fn place(&self, bounds: &Bounds) -> (u32, (usize, usize), (usize, usize)) {
        // Rounded to a whole number by the size of what is added; what is not a number becomes 0.
        const WHOLE: f32 = (1 << 23) as f32;
        let at = |x: f32, k: usize| {
            let cell = ((x - self.lo[k]) * self.per_unit[k]).max(0.0).min((Self::SIDE - 1) as f32);
            (cell + WHOLE).to_bits() as usize % Self::SIDE
        };
        let ends = |k: usize| (at(bounds.lo[k], k), at(bounds.hi[k], k));
        let (x0, x1) = ends(0);
        ((u32::MAX << x0) & (u32::MAX >> (31 - x1)), ends(1), ends(2))
    }

    /// False only if the box meets none of those that were marked.
    #[inline(always)]
    pub(crate) fn may_meet(&self, bounds: &Bounds) -> bool {
        // A box beyond all cells would be taken to be in the last ones.
        let along = |k: usize| (bounds.lo[k] <= self.hi[k]) & (bounds.hi[k] >= self.lo[k]);
        if !(along(0) & along(1) & along(2)) {
            return false;
        }
        let (bits, (y0, y1), (z0, z1)) = self.place(bounds);
        if (y1 - y0) | (z1 - z0) <= 1 {
            // Nearly all of them. Up to four rows, without asking how many.
            let row = |y: usize, z: usize| self.rows[z * Self::SIDE + y];
            return (row(y0, z0) | row(y1, z0) | row(y0, z1) | row(y1, z1)) & bits != 0;
        }
        (z0..=z1).any(|z| self.rows[z * Self::SIDE + y0..=z * Self::SIDE + y1].iter().any(|row| row & bits != 0))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// What meets a marked box is never told to be far, wherever and however flat the boxes are.
        #[test]
        fn what_meets_a_box_may_meet_one(
            boxes in prop::collection::vec((prop::array::uniform3(-9i16..9), prop::array::uniform3(0u8..5)), 1..30),
            scale in prop_oneof![Just(1.0f32), Just(1e-30), Just(3e37), Just(0.1)],
            flat in prop::array::uniform3(any::<bool>()),
        ) {
            let bounds = |(lo, size): &([i16; 3], [u8; 3])| {
                let lo: [f32; 3] = std::array::from_fn(|k| if flat[k] { scale } else { f32::from(lo[k]) * scale });
                Bounds { lo, hi: std::array::from_fn(|k| if flat[k] { scale } else { lo[k] + f32::from(size[k]) * scale }) }
            };
            let (marked, others) = boxes.split_at(boxes.len() / 2);
            let mut grid = Grid::default();
            grid.mark(marked.iter().map(bounds));
            for other in others.iter().map(bounds) {
                let meets = |b: Bounds| (0..3).all(|k| b.lo[k] <= other.hi[k] && b.hi[k] >= other.lo[k]);
                prop_assert!(grid.may_meet(&other) || !marked.iter().map(bounds).any(meets));
            }
            prop_assert!(marked.iter().map(bounds).all(|b| grid.may_meet(&b)));
        }
    }

    #[test]
    fn what_is_far_is_told_to_be_far() {
        let at = |x: f32| Bounds { lo: [x; 3], hi: [x + 1.0; 3] };
        let mut grid = Grid::default();
        grid.mark([at(0.0), at(100.0)].into_iter());
        assert_eq!([0.0, 50.0, 100.0].map(|x| grid.may_meet(&at(x))), [true, false, true]);
        grid.mark([at(50.0)].into_iter());
        assert_eq!([0.0, 50.0, 100.0].map(|x| grid.may_meet(&at(x))), [false, true, false]);
    }
}
