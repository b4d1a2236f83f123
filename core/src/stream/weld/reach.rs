//! How far what hangs together may reach, and cells to look for it in.

use glam::DVec3;

/// What hangs together is no wider than so many tolerances.
pub(super) const WIDEST: f64 = 4.0;
/// Cells in which vertices are looked for, and into which what is wider is split, in tolerances.
pub(super) const CELL: f64 = 2.0;
/// A cell is so many small ones along each axis.
pub(super) const FINER: f64 = 8.0;
/// More vertices in one small cell are a crowd: those of one vertex of the model are hardly more than a dozen, so that here several lie nearer to each
/// other than their corners came apart.
pub(super) const CROWD: usize = 16;

/// Cells are looked up with so much to spare, in their widths, that rounding misses none.
const SPARE: f64 = 1e-6;

/// Cells of one size.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Cells {
    a_unit: f64,
}

impl Cells {
    /// Cells for this tolerance.
    pub(super) fn new(weld: f64) -> Self {
        Self { a_unit: 1.0 / (CELL * weld) }
    }

    /// Each of these cells is [`FINER`] times as wide as one of those along each axis.
    pub(super) fn finer(self) -> Self {
        Self { a_unit: self.a_unit * FINER }
    }

    /// The cell that a place lies in.
    #[inline]
    pub(super) fn of(self, p: DVec3) -> [i64; 3] {
        [self.along(p.x), self.along(p.y), self.along(p.z)]
    }

    #[inline]
    fn along(self, x: f64) -> i64 {
        let x = x * self.a_unit;
        let towards_zero = x as i64;
        towards_zero - i64::from(towards_zero as f64 > x)
    }

    /// The middle of a cell.
    pub(super) fn middle(self, [x, y, z]: [i64; 3]) -> DVec3 {
        (DVec3::new(x as f64, y as f64, z as f64) + 0.5) / self.a_unit
    }

    /// Visits the cells that come so near to a place along every axis.
    #[inline]
    pub(super) fn near(self, p: DVec3, by: f64, mut visit: impl FnMut([i64; 3])) {
        let by = by + SPARE / self.a_unit;
        let (lo, hi) = (self.of(p - by), self.of(p + by));
        for x in lo[0]..=hi[0] {
            for y in lo[1]..=hi[1] {
                (lo[2]..=hi[2]).for_each(|z| visit([x, y, z]));
            }
        }
    }
}

/// A number for a table of cells.
#[inline]
pub(super) fn hash([x, y, z]: [i64; 3]) -> u32 {
    const FACTORS: [u64; 3] = [0x9E37_79B9_7F4A_7C15, 0xC2B2_AE3D_27D4_EB4F, 0x1656_67B1_9E37_79F9];
    let mixed = (x as u64).wrapping_mul(FACTORS[0]) ^ (y as u64).wrapping_mul(FACTORS[1]).rotate_left(21);
    let mixed = (mixed ^ (z as u64).wrapping_mul(FACTORS[2]).rotate_left(42)).wrapping_mul(FACTORS[0]);
    (mixed >> 32) as u32
}
