//! Arcs of circles and ellipses.

use std::f64::consts::{FRAC_PI_2, TAU};

use super::error::CurveError;
use crate::curves::vector::{Affine, Point, add, cross, dot, is_finite, norm, scale};

/// An arc `centre + cos t · axes[0] + sin t · axes[1]` for the angles `t` between two.
///
/// The axes are conjugate half diameters: perpendicular at first, oblique perhaps behind a map that shears. So every affine image is exact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arc {
    /// Centre of the whole ellipse.
    pub centre: Point,
    /// From the centre to the points at 0 and at a quarter of a turn.
    pub axes: [Point; 2],
    /// Where it begins and ends, in radians; increasing, a whole turn apart at most.
    pub angles: [f64; 2],
}

/// How much axes may differ in length and from a right angle in a circle.
const ROUND: f64 = 1e-5;

impl Arc {
    /// An arc from one angle on to another (radians); if that is not greater, a turn is added to it.
    ///
    /// # Errors
    /// [`CurveError`] of flat axes, and of numbers that are not finite.
    pub fn new(centre: Point, axes: [Point; 2], [from, to]: [f64; 2]) -> Result<Self, CurveError> {
        if ![centre, axes[0], axes[1], [from, to, 0.0]].into_iter().all(is_finite) {
            return Err(CurveError::NotFinite);
        }
        if norm(cross(axes[0], axes[1])) == 0.0 {
            return Err(CurveError::Degenerate("an arc without radius"));
        }
        let start = from.rem_euclid(TAU);
        let turn = (to - from).rem_euclid(TAU);
        // Less than rounding of the angles is a whole turn: both ends are the same point.
        let turn = if turn <= 1e-12 { TAU } else { turn };
        Ok(Self { centre, axes, angles: [start, start + turn] })
    }

    /// The point at an angle.
    #[must_use]
    pub fn point(&self, t: f64) -> Point {
        let (sin, cos) = t.sin_cos();
        add(self.centre, add(scale(self.axes[0], cos), scale(self.axes[1], sin)))
    }

    /// The derivative by the angle.
    #[must_use]
    pub fn derivative(&self, t: f64) -> Point {
        let (sin, cos) = t.sin_cos();
        add(scale(self.axes[0], -sin), scale(self.axes[1], cos))
    }

    /// Lengths of both half axes as given; the radii, if they are perpendicular.
    #[must_use]
    pub fn radii(&self) -> [f64; 2] {
        self.axes.map(norm)
    }

    /// Whether it is of a circle, up to the rounding of files, 10⁻⁵.
    #[must_use]
    pub fn is_circular(&self) -> bool {
        self.is_round(ROUND)
    }

    /// Whether it is of a circle up to a relative tolerance.
    pub(super) fn is_round(&self, tolerance: f64) -> bool {
        let [a, b] = self.radii();
        (a - b).abs() <= tolerance * a && dot(self.axes[0], self.axes[1]).abs() <= tolerance * a * b
    }

    /// Whether it comes back to where it begins.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.angles[1] - self.angles[0] >= TAU * (1.0 - 1e-12)
    }

    /// The same way in the other direction.
    #[must_use]
    pub fn reversed(self) -> Self {
        let [from, to] = self.angles;
        let [x, y] = self.axes;
        Self { axes: [x, scale(y, -1.0)], angles: [-to, -from], ..self }
    }

    /// Its image.
    #[must_use]
    pub fn transformed(self, map: &Affine) -> Self {
        Self { centre: map.point(self.centre), axes: self.axes.map(|axis| map.vector(axis)), ..self }
    }

    /// The angle whose point is nearest in direction, within a turn from the start. For circles the nearest point; for ellipses exact for points
    /// that lie on them.
    #[must_use]
    pub fn angle(&self, point: Point) -> f64 {
        let [x, y] = self.axes;
        let offset = add(point, scale(self.centre, -1.0));
        // Coordinates in the oblique system of both axes, by Gram's matrix.
        let (xx, xy, yy) = (dot(x, x), dot(x, y), dot(y, y));
        let (px, py) = (dot(offset, x), dot(offset, y));
        let angle = (xx * py - xy * px).atan2(yy * px - xy * py);
        let start = self.angles[0];
        let turned = start + (angle - start).rem_euclid(TAU);
        // A point at the start that rounding puts just before it.
        if start + TAU - turned < 1e-12 { start } else { turned }
    }

    /// Parameters that cut it into pieces of a quarter of a turn at most.
    pub(super) fn quarters(&self) -> Vec<f64> {
        let [from, to] = self.angles;
        let count = ((to - from) / FRAC_PI_2 - 1e-9).ceil().clamp(1.0, 4.0);
        let mut cuts: Vec<f64> = (0..count as u32).map(|at| from + (to - from) * f64::from(at) / count).collect();
        cuts.push(to);
        cuts
    }
}
