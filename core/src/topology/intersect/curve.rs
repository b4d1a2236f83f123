//! A curve through the cell: the order in which triangles are put into a tree.

use super::lanes::{Triangles, WIDTH, max, min};
use super::view::CellView;
use crate::stream::plan::HomeBox;
use crate::util::ids::NONE;

/// Where on the curve a triangle comes. The order changes nothing but the time that the walk takes.
pub(super) struct Curve {
    pub(super) cell: HomeBox,
    pub(super) lo: [f32; 3],
    /// Steps of the curve for a unit of length.
    pub(super) scale: f32,
}

impl Curve {
    /// Through what the view sees of its cell.
    pub(super) fn new(view: &CellView<'_>) -> Self {
        let (mut lo, mut hi) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for p in view.positions {
            for k in 0..3 {
                (lo[k], hi[k]) = (min(lo[k], p[k]), max(hi[k], p[k]));
            }
        }
        let (cell_lo, cell_hi) = view.cell.ends();
        let lo = [0, 1, 2].map(|k| max(lo[k], cell_lo[k]));
        let size = (0..3).map(|k| min(hi[k], cell_hi[k]) - lo[k]).fold(0.0, f32::max);
        Self { cell: view.cell, lo, scale: 256.0 / size }
    }

    /// 24 bits for each triangle, those that are large for the cell apart, since they would widen the boxes of small ones; or
    /// [`NONE`] for those that do not meet the cell.
    #[inline(always)]
    #[expect(clippy::disallowed_methods, reason = "the number of a cell, no position")]
    pub(super) fn places(&self, triangles: &Triangles) -> [u32; WIDTH] {
        let (cell_lo, cell_hi) = self.cell.ends();
        let mut places = [0; WIDTH];
        for (i, place) in places.iter_mut().enumerate() {
            let (mut curve, mut extent, mut meets) = (0, 0.0, true);
            for k in 0..3 {
                let (lo, hi) = triangles.ends(k, i);
                meets &= (lo <= cell_hi[k]) & (hi >= cell_lo[k]);
                let (lo, hi) = (max(lo, cell_lo[k]), min(hi, cell_hi[k]));
                // What is no number becomes zero. The last bits of a float above 2²³ are an integer, in fewer instructions than `as` takes.
                let step = min(max((lo * 0.5 + hi * 0.5 - self.lo[k]) * self.scale, 0.0), 255.0);
                curve |= spread((step + 8_388_608.0).to_bits() & 255) << k;
                extent = max(extent, hi - lo);
            }
            let extent = extent * self.scale;
            let class = u32::from(extent > 8.0) + u32::from(extent > 32.0) + u32::from(extent > 128.0);
            *place = if meets { curve >> 2 | class << 22 } else { NONE };
        }
        places
    }
}

/// Eight bits, two zeros after each.
#[inline(always)]
pub(super) fn spread(x: u32) -> u32 {
    let x = (x | x << 8) & 0x0000_F00F;
    let x = (x | x << 4) & 0x000C_30C3;
    (x | x << 2) & 0x0024_9249
}
