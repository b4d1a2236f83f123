//! Where the eye is, and how places of the model become samples of the picture.

use suture_core::record::{self, Point, Record};

use super::parts::side_by_side;

/// Where the eye is, in degrees: around z from the x axis, and above the horizon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Eye {
    pub around: f64,
    pub above: f64,
}

impl Eye {
    /// From the front, the right and above, as slicers show a plate.
    pub(crate) const USUAL: Self = Self { around: -60.0, above: 30.0 };

    /// On the other side of the model.
    pub(super) fn opposite(self) -> Self {
        Self { around: self.around + 180.0, above: -self.above }
    }

    /// The directions from which changes are looked for: the usual one first, four from above, four from below.
    pub(super) fn all() -> [Self; 8] {
        std::array::from_fn(|i| Self {
            around: Self::USUAL.around + 90.0 * (i % 4) as f64,
            above: if i < 4 { Self::USUAL.above } else { -Self::USUAL.above },
        })
    }
}

/// A box around finite corners; `None` for none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bounds {
    lo: [f64; 3],
    hi: [f64; 3],
}

impl Bounds {
    /// Of all triangles, each corner at the `place` that it has, on so many threads. O(n).
    pub(super) fn of(records: &[Record], threads: usize, place: impl Fn(&Point) -> [f64; 3] + Sync) -> Option<Self> {
        let of_part = |part: &[Record]| {
            let corners = part.iter().filter(|r| record::all_finite(r)).flat_map(record::corners);
            corners.map(|p| place(&p)).map(|p| Self { lo: p, hi: p }).reduce(Self::and)
        };
        side_by_side(records, threads, |_, part| of_part(part)).into_iter().flatten().reduce(Self::and)
    }

    /// Around both.
    pub(super) fn and(self, other: Self) -> Self {
        Self {
            lo: std::array::from_fn(|k| self.lo[k].min(other.lo[k])),
            hi: std::array::from_fn(|k| self.hi[k].max(other.hi[k])),
        }
    }

    /// Its lower and its upper corner.
    pub(super) fn ends(&self) -> [[f64; 3]; 2] {
        [self.lo, self.hi]
    }

    fn corners(&self) -> [[f64; 3]; 8] {
        std::array::from_fn(|i| std::array::from_fn(|k| if i >> k & 1 == 0 { self.lo[k] } else { self.hi[k] }))
    }
}

/// Parallel projection: samples to the right, samples down, and depth away from the eye from 0 to 1.
#[derive(Clone, Debug)]
pub(super) struct Camera {
    axes: [[f64; 3]; 3],
    middle: [f64; 3],
    scale: f64,
    /// Half of the depth of what is seen, in samples.
    reach: f64,
    pub(super) width: usize,
    pub(super) height: usize,
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// To the right, down, and towards the eye.
fn axes_of(eye: Eye) -> [[f64; 3]; 3] {
    let (around, above) = (eye.around.to_radians(), eye.above.to_radians());
    let towards = [above.cos() * around.cos(), above.cos() * around.sin(), above.sin()];
    let right = [-around.sin(), around.cos(), 0.0];
    [right, cross(right, towards), towards]
}

fn unit(a: [f64; 3]) -> [f64; 3] {
    let length = dot(a, a).sqrt();
    if length > 0.0 { a.map(|x| x / length) } else { a }
}

/// Share of the picture that the model takes.
const FILLS: f64 = 0.94;

impl Camera {
    /// One that sees all of the box, in a picture of so many samples. O(1).
    pub(super) fn new(eye: Eye, bounds: &Bounds, width: usize, height: usize) -> Self {
        let axes = axes_of(eye);
        let corners = bounds.corners().map(|p| axes.map(|axis| dot(axis, p)));
        let seen = corners.into_iter().map(|p| Bounds { lo: p, hi: p }).reduce(Bounds::and);
        Self::seeing(axes, &seen.unwrap_or(*bounds), width, height)
    }

    /// One that sees all of these meshes, as large as can be. O(triangles).
    pub(super) fn fitted(eye: Eye, meshes: &[&[Record]], threads: usize, width: usize, height: usize) -> Option<Self> {
        let axes = axes_of(eye);
        let along = |p: &Point| axes.map(|axis| dot(axis, p.map(f64::from)));
        let seen = meshes.iter().filter_map(|mesh| Bounds::of(mesh, threads, along)).reduce(Bounds::and)?;
        Some(Self::seeing(axes, &seen, width, height))
    }

    /// `seen`: a box along the axes.
    fn seeing(axes: [[f64; 3]; 3], seen: &Bounds, width: usize, height: usize) -> Self {
        let size: [f64; 3] = std::array::from_fn(|k| seen.hi[k] - seen.lo[k]);
        let at: [f64; 3] = std::array::from_fn(|k| (seen.lo[k] + seen.hi[k]) / 2.0);
        let middle = std::array::from_fn(|k| (0..3).map(|i| axes[i][k] * at[i]).sum());
        let scale = FILLS * (width as f64 / size[0].max(1e-30)).min(height as f64 / size[1].max(1e-30));
        // Numbers that overflow are no picture, and no panic.
        let scale = if scale.is_finite() { scale } else { 0.0 };
        Self { axes, middle, scale, reach: (0.5 * size[2] * scale * 1.001).max(1e-9), width, height }
    }

    /// Where a place of the model is seen.
    pub(super) fn place(&self, p: Point) -> [f64; 3] {
        let q = std::array::from_fn(|k| f64::from(p[k]) - self.middle[k]);
        let [x, y, z] = self.axes.map(|axis| dot(axis, q) * self.scale);
        [x + self.width as f64 / 2.0, y + self.height as f64 / 2.0, 0.5 - 0.5 * z / self.reach]
    }

    /// How bright a triangle is, from 0 to 1, and whether its outside is seen. Light comes over the left shoulder of the eye.
    pub(super) fn shade(&self, corners: [Point; 3]) -> (f64, bool) {
        let [a, b, c] = corners.map(|p| p.map(f64::from));
        let minus = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|k| a[k] - b[k]);
        let normal = unit(cross(minus(b, a), minus(c, a)));
        let light = unit(std::array::from_fn(|k| 0.9 * self.axes[2][k] - 0.35 * self.axes[0][k] - 0.45 * self.axes[1][k]));
        let is_outside = dot(normal, self.axes[2]) >= 0.0;
        let lit = dot(normal, light) * if is_outside { 1.0 } else { -1.0 };
        (lit.max(0.0), is_outside)
    }

    /// So much of depth are so many samples.
    pub(super) fn depth_of(&self, samples: f64) -> f64 {
        0.5 * samples / self.reach
    }
}
