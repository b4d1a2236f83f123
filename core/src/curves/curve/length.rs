//! Length by adaptive quadrature.

use crate::curves::vector::{Point, norm};

/// Nodes above 0 and weights of Gauss and Legendre's rule with 8 points on −1 to 1 (Abramowitz, Stegun, table 25.4).
const RULE: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];
/// Halvings of a span, at most.
const DEEPEST: u32 = 40;
/// Intervals of a span, at most.
const MOST: u32 = 512;

/// The length of a curve whose derivative is smooth between each two parameters.
pub(super) fn length(derivative: impl Fn(f64) -> Point, cuts: &[f64], tolerance: f64) -> f64 {
    let speed = |t| norm(derivative(t));
    let whole: f64 = cuts.windows(2).map(|pair| if let &[a, b] = pair { gauss(&speed, a, b) } else { 0.0 }).sum();
    let spans = cuts.len().saturating_sub(1).max(1) as f64;
    // No better than rounding allows.
    let tolerance = tolerance.max(whole * 1e-14) / spans;
    cuts.windows(2).map(|pair| if let &[a, b] = pair { span(&speed, a, b, tolerance) } else { 0.0 }).sum()
}

fn span(speed: &impl Fn(f64) -> f64, a: f64, b: f64, tolerance: f64) -> f64 {
    let mut stack = vec![(a, b, gauss(speed, a, b), tolerance, 0)];
    let (mut sum, mut count) = (0.0, 0);
    while let Some((a, b, rough, tolerance, depth)) = stack.pop() {
        let middle = 0.5 * (a + b);
        let (left, right) = (gauss(speed, a, middle), gauss(speed, middle, b));
        count += 1;
        let is_good = (left + right - rough).abs() <= tolerance;
        if is_good || depth >= DEEPEST || count >= MOST || !(left + right).is_finite() {
            sum += left + right;
        } else {
            stack.push((middle, b, right, 0.5 * tolerance, depth + 1));
            stack.push((a, middle, left, 0.5 * tolerance, depth + 1));
        }
    }
    sum
}

pub(super) fn gauss(speed: &impl Fn(f64) -> f64, a: f64, b: f64) -> f64 {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    half * RULE.iter().map(|&(node, weight)| weight * (speed(middle - half * node) + speed(middle + half * node))).sum::<f64>()
}
