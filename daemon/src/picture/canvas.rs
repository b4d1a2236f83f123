//! The depth buffer, filled by several threads, and the samples that it becomes.

use std::sync::atomic::{AtomicU64, Ordering};

use suture_core::record::{self, Point, Record};

use super::camera::Camera;
use super::parts::side_by_side;

/// Nothing is there.
const EMPTY: u64 = u64::MAX;
/// Samples that are filled at most; beyond, triangles are left out.
const MOST_FILLED: f64 = if cfg!(test) { 1e8 } else { 3e9 };

/// For each sample, which triangle is nearest: its depth in the upper half, its number in the lower, so that one comparison decides, and no order
/// of threads.
#[derive(Debug)]
pub(super) struct Canvas {
    pub(super) camera: Camera,
    nearest: Vec<AtomicU64>,
}

impl Canvas {
    /// With all triangles in it, on so many threads; the second value: one in so many was drawn, where all would take too long.
    /// O(triangles + samples covered).
    pub(super) fn of(camera: Camera, records: &[Record], threads: usize) -> (Self, usize) {
        let nearest = (0..camera.width * camera.height).map(|_| AtomicU64::new(EMPTY)).collect();
        let canvas = Self { camera, nearest };
        let covered: f64 =
            side_by_side(records, threads, |_, part| part.iter().map(|r| canvas.covers(r)).sum::<f64>()).iter().sum();
        let one_in = if covered > MOST_FILLED { (covered / MOST_FILLED).ceil() as usize } else { 1 };
        side_by_side(records, threads, |first, part| {
            for (i, record) in (first..).zip(part).filter(|(i, _)| i % one_in == 0) {
                if record::all_finite(record) {
                    canvas.fill(record::corners(record).map(|p| canvas.camera.place(p)), i as u32);
                }
            }
        });
        (canvas, one_in)
    }

    /// About how many samples a triangle covers.
    fn covers(&self, record: &Record) -> f64 {
        if !record::all_finite(record) {
            return 0.0;
        }
        let [a, b, c] = record::corners(record).map(|p| self.camera.place(p));
        let area = 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs();
        let rows = a[1].max(b[1]).max(c[1]) - a[1].min(b[1]).min(c[1]);
        (area + rows).min(self.nearest.len() as f64)
    }

    fn fill(&self, corners: [[f64; 3]; 3], triangle: u32) {
        let [a, b, c] = corners;
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        let flat = area == 0.0 || !area.is_finite();
        if flat {
            return;
        }
        // Depth is linear: a[2] + (x − a[0])·dx + (y − a[1])·dy.
        let dx = ((b[2] - a[2]) * (c[1] - a[1]) - (c[2] - a[2]) * (b[1] - a[1])) / area;
        let dy = ((c[2] - a[2]) * (b[0] - a[0]) - (b[2] - a[2]) * (c[0] - a[0])) / area;
        let (near, far) = (a[2].min(b[2]).min(c[2]), a[2].max(b[2]).max(c[2]));
        for y in rows(a[1].min(b[1]).min(c[1]), a[1].max(b[1]).max(c[1]), self.camera.height) {
            let middle = y as f64 + 0.5;
            let Some((from, to)) = span([a, b, c], middle) else { continue };
            for x in rows(from, to, self.camera.width) {
                // Rounding must not carry a steep triangle away.
                let z = (a[2] + (x as f64 + 0.5 - a[0]) * dx + (middle - a[1]) * dy).clamp(near, far);
                let depth = (z.clamp(0.0, 1.0) * f64::from(u32::MAX - 1)) as u64;
                self.nearest[y * self.camera.width + x].fetch_min(depth << 32 | u64::from(triangle), Ordering::Relaxed);
            }
        }
    }

    /// The triangle at a sample, if there is one.
    pub(super) fn at(&self, sample: usize) -> Option<u32> {
        let nearest = self.nearest[sample].load(Ordering::Relaxed);
        (nearest != EMPTY).then_some(nearest as u32)
    }

    /// How deep a sample is, from 0 to 1; beyond where nothing is.
    fn depth(&self, sample: usize) -> f64 {
        (self.nearest[sample].load(Ordering::Relaxed) >> 32) as f64 / f64::from(u32::MAX - 1)
    }

    /// Samples within `radius` of a line that nothing hides; what lies less than `bias` in front of it does not.
    pub(super) fn line(&self, ends: [Point; 2], radius: f64, bias: f64, paint: &mut impl FnMut(usize)) {
        let [a, b] = ends.map(|p| self.camera.place(p));
        let bias = self.camera.depth_of(bias);
        let steps = (b[0] - a[0]).abs().max((b[1] - a[1]).abs()).ceil().clamp(1.0, 1e5) as usize;
        for i in 0..=steps {
            let s = i as f64 / steps as f64;
            let p: [f64; 3] = std::array::from_fn(|k| a[k] + s * (b[k] - a[k]));
            for y in rows(p[1] - radius, p[1] + radius, self.camera.height) {
                for x in rows(p[0] - radius, p[0] + radius, self.camera.width) {
                    let off = (x as f64 + 0.5 - p[0]).hypot(y as f64 + 0.5 - p[1]);
                    let at = y * self.camera.width + x;
                    if off <= radius && p[2] - bias <= self.depth(at) {
                        paint(at);
                    }
                }
            }
        }
    }
}

/// The samples whose middles lie from `lo` to `hi`, of so many.
fn rows(lo: f64, hi: f64, most: usize) -> std::ops::Range<usize> {
    let first = (lo - 0.5).ceil().clamp(0.0, most as f64) as usize;
    let after = ((hi - 0.5).floor() + 1.0).clamp(0.0, most as f64) as usize;
    first..after.max(first)
}

/// From where to where a triangle reaches in a row.
fn span(corners: [[f64; 3]; 3], y: f64) -> Option<(f64, f64)> {
    let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
    for k in 0..3 {
        let (p, q) = (corners[k], corners[(k + 1) % 3]);
        let (lo, hi) = if p[1] <= q[1] { (p, q) } else { (q, p) };
        if lo[1] <= y && y <= hi[1] {
            // Computed alike for both triangles of an edge: no gap between them.
            let x = if hi[1] > lo[1] { lo[0] + (hi[0] - lo[0]) * ((y - lo[1]) / (hi[1] - lo[1])) } else { lo[0] };
            (from, to) = (from.min(x), to.max(x));
            if hi[1] == lo[1] {
                (from, to) = (from.min(hi[0]), to.max(hi[0]));
            }
        }
    }
    (from <= to).then_some((from, to))
}
