//! The nearest point of a curve.

use super::shape::Shape;
use super::spline::Spline;
use crate::curves::vector::{Point, distance, dot, sub};

/// Samples of a curve, at most; long ones get fewer for each span.
const MOST: usize = 4096;
/// Halvings of the interval around the best sample.
const STEPS: u32 = 60;

impl Shape {
    /// The parameter of the point that is nearest to a point: found by samples and refined, so of two that are about as near, either.
    #[must_use]
    pub fn nearest(&self, point: Point) -> f64 {
        nearest(self, point)
    }
}

/// The parameter of the nearest point.
fn nearest(shape: &Shape, point: Point) -> f64 {
    match shape {
        &Shape::Line([a, b]) => on_line(a, b, point),
        Shape::Arc(arc) => {
            let [from, to] = arc.angles;
            let angle = arc.angle(point);
            let ends = [from, to].map(|end| distance(arc.point(end), point));
            if angle <= to && distance(arc.point(angle), point) <= ends[0].min(ends[1]) {
                angle
            } else if ends[0] <= ends[1] {
                from
            } else {
                to
            }
        }
        Shape::Conic(spline) | Shape::Spline(spline) => on_spline(spline, point),
        Shape::Polyline(points) => {
            let mut best = (f64::INFINITY, 0.0);
            for (number, pair) in points.windows(2).enumerate() {
                let &[a, b] = pair else { continue };
                let t = number as f64 + on_line(a, b, point);
                let near = distance(shape.point(t), point);
                best = if near < best.0 { (near, t) } else { best };
            }
            best.1
        }
        Shape::Composite(parts) => {
            let mut best = (f64::INFINITY, 0.0);
            for (number, part) in parts.iter().enumerate() {
                let [low, high] = part.domain();
                let t = nearest(part, point);
                let near = distance(part.point(t), point);
                best = if near < best.0 { (near, number as f64 + (t - low) / (high - low)) } else { best };
            }
            best.1
        }
    }
}

fn on_line(a: Point, b: Point, point: Point) -> f64 {
    let along = sub(b, a);
    let share = dot(sub(point, a), along) / dot(along, along);
    if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 }
}

fn on_spline(spline: &Spline, point: Point) -> f64 {
    let near = |t| distance(spline.point_and_derivative(t).0, point);
    let cuts = spline.cuts();
    let each = (MOST / cuts.len().max(1)).clamp(1, 2 * spline.degree() + 4);
    let stride = cuts.len().div_ceil(MOST);
    let mut samples: Vec<f64> = Vec::new();
    let coarse: Vec<f64> = cuts.iter().copied().step_by(stride).chain(cuts.last().copied()).collect();
    for pair in coarse.windows(2) {
        let &[a, b] = pair else { continue };
        samples.extend((0..each).map(|number| a + (b - a) * number as f64 / each as f64));
    }
    samples.extend(cuts.last());
    let best = samples.iter().map(|&t| near(t)).enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(at, _)| at);
    let sample = |number: usize| samples.get(number.min(samples.len().saturating_sub(1))).copied().unwrap_or_default();
    let (mut low, mut high) = (sample(best.saturating_sub(1)), sample(best + 1));
    // The sign of the derivative of the distance; it halves the interval down to rounding.
    for _ in 0..STEPS {
        let middle = 0.5 * (low + high);
        let (place, derivative) = spline.point_and_derivative(middle);
        if dot(sub(place, point), derivative) > 0.0 { high = middle } else { low = middle }
    }
    [low, sample(best)].into_iter().min_by(|a, b| near(*a).total_cmp(&near(*b))).unwrap_or_default()
}
