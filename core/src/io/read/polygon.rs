//! A polygon in space, cut into triangles.

use crate::io::record::Point;

/// Calls `take` with the corners of each triangle, as places in `polygon`, in the polygon's direction; n - 2 of them for n corners.
///
/// For now a fan from the first corner.
pub(super) fn cut(polygon: &[Point], mut take: impl FnMut([usize; 3])) {
    for last in 2..polygon.len() {
        take([0, last - 1, last]);
    }
}
