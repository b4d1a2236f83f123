//! Arcs as rational curves of degree 2, and the parameter of an angle.
//!
//! Based on: TNB section 7.3 (arcs of up to a quarter of a turn, tangents meet at the middle control point).

use std::f64::consts::{FRAC_PI_2, TAU};

/// An arc between two angles in pieces that are all the same; each has the parameter from one whole number to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sweep {
    low: f64,
    step: f64,
    count: usize,
}

impl Sweep {
    /// The arc between two angles, at most a turn.
    pub(super) fn new([low, high]: [f64; 2]) -> Option<Self> {
        let whole = high - low;
        let count = (whole / FRAC_PI_2 - 1e-9).ceil().max(1.0);
        (whole > 0.0 && whole <= TAU + 1e-9).then_some(Self { low, step: whole / count, count: count as usize })
    }

    /// Control points: angle, how far out, weight.
    pub(super) fn points(&self) -> Vec<[f64; 3]> {
        let cos = (0.5 * self.step).cos();
        let point = |number: usize| {
            let angle = self.low + 0.5 * self.step * number as f64;
            if number.is_multiple_of(2) { [angle, 1.0, 1.0] } else { [angle, 1.0 / cos, cos] }
        };
        (0..=2 * self.count).map(point).collect()
    }

    pub(super) fn knots(&self) -> Vec<f64> {
        let inner = (0..=self.count).flat_map(|knot| [knot as f64; 2]);
        std::iter::once(0.0).chain(inner).chain([self.count as f64]).collect()
    }

    /// The parameter of an angle. Within a piece, the tangent of half the angle from its middle is linear in the parameter.
    pub(super) fn parameter(&self, angle: f64) -> f64 {
        let piece = ((angle - self.low) / self.step).floor().clamp(0.0, self.count.saturating_sub(1) as f64);
        let from_middle = angle - self.low - (piece + 0.5) * self.step;
        let share = 0.5 * (1.0 + (0.5 * from_middle).tan() / (0.25 * self.step).tan());
        piece + if share.abs() < 1e-13 { 0.0 } else { share }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curves::curve::Spline;

    /// The point of the parameter of an angle is at that angle, on the circle.
    #[test]
    fn parameters_belong_to_angles() {
        for [low, high] in [[0.3, 1.0], [-2.0, 4.0], [1.0, 1.0 + TAU]] {
            let sweep = Sweep::new([low, high]).unwrap();
            let (points, weights): (Vec<[f64; 3]>, Vec<f64>) = (
                sweep.points().iter().map(|[angle, far, _]| [far * angle.cos(), far * angle.sin(), 0.0]).collect(),
                sweep.points().iter().map(|[.., weight]| *weight).collect(),
            );
            let spline = Spline::new(2, sweep.knots(), points, Some(weights), None).unwrap();
            for share in [0.0, 0.1, 0.37, 0.5, 0.99, 1.0] {
                let angle = low + (high - low) * share;
                let [x, y, _] = spline.point_and_derivative(sweep.parameter(angle)).0;
                assert!((x - angle.cos()).hypot(y - angle.sin()) < 1e-13, "{angle}");
            }
        }
        assert!(Sweep::new([0.0, 7.0]).is_none());
    }
}
