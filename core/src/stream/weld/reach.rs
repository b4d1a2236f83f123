//! How far what hangs together may reach, and cells to look for it in.

use glam::DVec3;

/// What hangs together is no wider than so many tolerances.
pub(super) const WIDEST: f64 = 4.0;
/// Cells in which vertices are looked for, in tolerances.
pub(super) const CELL: f64 = 2.0;

/// The cell that a place lies in.
pub(super) fn cell_of(p: DVec3, weld: f64) -> [i64; 3] {
    (p / (CELL * weld)).to_array().map(|x| x.floor() as i64)
}

/// The cells within one tolerance or less of a place.
pub(super) fn cells_near(p: DVec3, by: f64, weld: f64) -> impl Iterator<Item = [i64; 3]> {
    let (lo, hi) = (cell_of(p - by, weld), cell_of(p + by, weld));
    (lo[0]..=hi[0]).flat_map(move |x| (lo[1]..=hi[1]).flat_map(move |y| (lo[2]..=hi[2]).map(move |z| [x, y, z])))
}
