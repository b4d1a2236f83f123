//! Lengths along a curve, looked up.

use super::length::gauss;
use super::shape::Shape;
use crate::curves::vector::norm;

/// Lengths from the beginning of a curve, tabled at parts of its smooth pieces.
#[derive(Clone, Debug)]
pub(super) struct Lengths {
    table: Vec<(f64, f64)>,
}

/// Parts of a piece in a table.
const PARTS: u32 = 16;

impl Lengths {
    /// O(spans · degree²).
    pub(super) fn of(shape: &Shape) -> Self {
        let cuts = match shape {
            Shape::Conic(spline) | Shape::Spline(spline) => spline.cuts(),
            other => other.domain().to_vec(),
        };
        let mut table: Vec<(f64, f64)> = cuts.first().map(|start| (*start, 0.0)).into_iter().collect();
        let mut sum = 0.0;
        for pair in cuts.windows(2) {
            let &[a, b] = pair else { continue };
            for part in 0..PARTS {
                let [low, high] = [part, part + 1].map(|part| a + (b - a) * f64::from(part) / f64::from(PARTS));
                sum += gauss(&|t| norm(shape.derivative(t)), low, high);
                table.push((high, sum));
            }
        }
        Self { table }
    }

    /// The length up to a parameter.
    pub(super) fn at(&self, shape: &Shape, t: f64) -> f64 {
        let at = self.table.partition_point(|(node, _)| *node <= t).saturating_sub(1);
        let (node, sum) = self.table.get(at).copied().unwrap_or_default();
        sum + gauss(&|t| norm(shape.derivative(t)), node, t)
    }

    /// The length of all of it.
    pub(super) fn whole(&self) -> f64 {
        self.table.last().map_or(0.0, |(_, sum)| *sum)
    }
}
