//! Parameters of a curve by its arc length.

use crate::curves::curve::Shape;
use crate::curves::vector::norm;
use crate::util::each::Each;

/// Nodes above 0 and weights of Gauss and Legendre's rule with 6 points on −1 to 1 (Abramowitz, Stegun, table 25.4).
const RULE: [(f64, f64); 3] = [
    (0.238_619_186_083_196_9, 0.467_913_934_572_691),
    (0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
    (0.932_469_514_203_152, 0.171_324_492_379_170_36),
];
/// Intervals of a smooth piece.
const EACH: u32 = 8;
/// Steps of Newton's method.
const STEPS: u32 = 6;

/// Lengths of a curve from its beginning, at parameters in order.
#[derive(Clone, Debug)]
pub(super) struct Measure {
    ends: Vec<f64>,
    sums: Vec<f64>,
}

impl Measure {
    /// Of the part between two parameters. O(spans · degree²).
    pub(super) fn new(shape: &Shape, [low, high]: [f64; 2]) -> Self {
        let (mut ends, mut sums) = (Vec::new(), Vec::new());
        let mut sum = 0.0;
        let mut cuts = cuts(shape);
        cuts.retain(|cut| *cut > low && *cut < high);
        cuts.insert(0, low);
        cuts.push(high);
        let each = if matches!(shape, Shape::Line(_) | Shape::Polyline(_)) { 1 } else { EACH };
        for pair in cuts.windows(2) {
            let &[a, b] = pair else { continue };
            for number in 0..each {
                let [from, to] = [number, number + 1].each(|at| a + (b - a) * f64::from(at) / f64::from(each));
                ends.push(from);
                sums.push(sum);
                sum += length(shape, from, to);
            }
        }
        ends.extend(cuts.last());
        sums.push(sum);
        Self { ends, sums }
    }

    pub(super) fn whole(&self) -> f64 {
        self.sums.last().copied().unwrap_or_default()
    }

    /// The parameter at a share of the length, by Newton's method within its interval. O(log intervals + degree²).
    pub(super) fn parameter(&self, shape: &Shape, share: f64) -> f64 {
        let target = share.clamp(0.0, 1.0) * self.whole();
        let place = self.sums.partition_point(|sum| *sum <= target).clamp(1, self.sums.len().max(2) - 1) - 1;
        let get = |values: &[f64], number: usize| values.get(number).copied().unwrap_or_default();
        let (low, high) = (get(&self.ends, place), get(&self.ends, place + 1));
        let (from, to) = (get(&self.sums, place), get(&self.sums, place + 1));
        let mut t = if to > from { low + (high - low) * (target - from) / (to - from) } else { low };
        if share >= 1.0 || matches!(shape, Shape::Line(_) | Shape::Polyline(_)) {
            return if share >= 1.0 { high } else { t };
        }
        for _ in 0..STEPS {
            let rest = target - from - length(shape, low, t);
            let step = rest / norm(shape.derivative(t));
            if !step.is_finite() || rest.abs() <= 1e-15 * self.whole() {
                break;
            }
            t = (t + step).clamp(low, high);
        }
        t
    }
}

/// Ends of smooth pieces.
pub(super) fn cuts(shape: &Shape) -> Vec<f64> {
    let [low, high] = shape.domain();
    match shape {
        Shape::Conic(spline) | Shape::Spline(spline) => spline.cuts(),
        Shape::Polyline(points) => (0..points.len()).map(|number| number as f64).collect(),
        Shape::Composite(parts) => (0..=parts.len()).map(|number| number as f64).collect(),
        _ => vec![low, high],
    }
}

fn length(shape: &Shape, a: f64, b: f64) -> f64 {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    let speed = |t| norm(shape.derivative(t));
    if matches!(shape, Shape::Line(_) | Shape::Polyline(_)) {
        return (b - a) * speed(middle);
    }
    half * RULE.iter().map(|&(node, weight)| weight * (speed(middle - half * node) + speed(middle + half * node))).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curves::curve::Spline;

    /// A parabola `y = x²` on 0 to 1: its length up to `x` is `(2x·√(1+4x²) + asinh 2x) / 4`.
    #[test]
    fn half_of_the_length_of_a_parabola() {
        let points = vec![[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [1.0, 1.0, 0.0]];
        let shape = Shape::Spline(Spline::new(2, vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0], points, None, None).unwrap());
        let measure = Measure::new(&shape, [0.0, 1.0]);
        let length = |x: f64| (2.0 * x * (1.0 + 4.0 * x * x).sqrt() + (2.0 * x).asinh()) / 4.0;
        assert!((measure.whole() - length(1.0)).abs() < 1e-10);
        let x = measure.parameter(&shape, 0.5);
        assert!((length(x) - 0.5 * length(1.0)).abs() < 1e-10);
    }
}
