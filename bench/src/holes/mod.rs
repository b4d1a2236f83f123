//! How well holes are closed: surfaces that are known everywhere with a hole cut into them, and what is measured of patches and of
//! repaired files.

mod cut;
mod distance;
mod measure;
mod surface;

use std::path::Path;

use suture_bench::judge::Near;

use crate::mesh::{self, Triangle};

pub(crate) use cut::{Hole, bowl, mesh as with_hole};
pub(crate) use measure::Measured;
pub(crate) use surface::Surface;

/// Measures the patch that a file has more than `before`. `None` when there is no patch, or no readable file.
pub(crate) fn measure_file(surface: Surface, before: &[Triangle], after: &Path) -> Option<Measured> {
    measure::measure(surface, before, &mesh::read(after).ok()?)
}

/// A repair's changes, beside those that it was to make.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Change {
    /// Share of the input's triangles that are in the output with the same bits, in the same direction.
    pub(crate) kept: f64,
    /// Largest distance of the input's corners and middles of triangles from the output, as a share of the input's diagonal: what was
    /// taken away or moved.
    pub(crate) taken: f64,
    /// The same from the output to the input: what was added. That of a patch is a matter of its hole.
    pub(crate) added: f64,
}

/// Compares an output with its input. O(n log n).
pub(crate) fn change(before: &[Triangle], after: &[Triangle]) -> Change {
    let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for p in before.as_flattened() {
        for k in 0..3 {
            lo[k] = lo[k].min(p[k].into());
            hi[k] = hi[k].max(p[k].into());
        }
    }
    let diagonal = mesh::length(mesh::minus(hi, lo)).max(f64::MIN_POSITIVE);
    // What stands in both is nowhere far away.
    let far = |from: &[Triangle], to: &[Triangle]| distance::farthest(&mesh::not_in(from, to), &Near::new(to)) / diagonal;
    let kept = mesh::kept(before, after) as f64 / before.len().max(1) as f64;
    Change { kept, taken: far(before, after), added: far(after, before) }
}
