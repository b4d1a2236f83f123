//! Any curve as one B-spline.

use super::arc::Arc;
use super::error::CurveError;
use super::shape::Shape;
use super::spline::{Spline, Weighted};
use crate::curves::vector::{Point, add, distance, scale};

impl Shape {
    /// The same curve as one B-spline; exact, rational where there are arcs. Its parameter differs. O(points · degree³).
    ///
    /// # Errors
    /// [`CurveError`] of numbers that overflow.
    pub fn to_spline(&self) -> Result<Spline, CurveError> {
        spline(self)
    }
}

/// The same curve as a B-spline with clamped knots.
fn spline(shape: &Shape) -> Result<Spline, CurveError> {
    match shape {
        Shape::Line(ends) => Spline::new(1, vec![0.0, 0.0, 1.0, 1.0], ends.to_vec(), None, None),
        Shape::Arc(arc) => of_arc(arc),
        Shape::Conic(spline) | Shape::Spline(spline) => spline.clamped(),
        Shape::Polyline(points) => {
            let last = points.len().saturating_sub(1) as f64;
            let mut knots = vec![0.0];
            knots.extend((0..points.len()).map(|number| number as f64));
            knots.push(last);
            Spline::new(1, knots, points.clone(), None, None)
        }
        Shape::Composite(parts) => join(parts),
    }
}

/// A rational B-spline of degree 2 with a piece for each quarter of a turn (TNB A7.1), its knots angles.
fn of_arc(arc: &Arc) -> Result<Spline, CurveError> {
    let cuts = arc.quarters();
    let (mut points, mut weights): (Vec<Point>, Vec<f64>) = (Vec::new(), Vec::new());
    let mut knots = Vec::new();
    for (number, pair) in cuts.windows(2).enumerate() {
        let &[a, b] = pair else { continue };
        let (sin, cos) = (0.5 * (a + b)).sin_cos();
        let weight = (0.5 * (b - a)).cos();
        if number == 0 {
            points.push(arc.point(a));
            weights.push(1.0);
            knots.push(a);
        }
        let towards = add(scale(arc.axes[0], cos), scale(arc.axes[1], sin));
        points.push(add(arc.centre, scale(towards, 1.0 / weight)));
        weights.push(weight);
        points.push(arc.point(b));
        weights.push(1.0);
        knots.extend([a, a]);
    }
    let end = arc.angles[1];
    knots.extend([end, end, end]);
    let first = points.first().copied().filter(|_| arc.is_whole());
    if let (Some(first), Some(last)) = (first, points.last_mut()) {
        *last = first;
    }
    Spline::new(2, knots, points, Some(weights), None)
}

/// One B-spline of curves one behind the other: each cut into Bézier curves, these raised to the highest degree (TNB equation 5.36), and
/// joined with knots of that multiplicity. A joint lies in the middle of both ends that meet there.
fn join(parts: &[Shape]) -> Result<Spline, CurveError> {
    let splines = parts.iter().map(spline).collect::<Result<Vec<_>, _>>()?;
    let degree = splines.iter().map(Spline::degree).max().unwrap_or(1);
    let mut knots = vec![0.0; degree + 1];
    let mut points: Vec<Weighted> = Vec::new();
    for (number, spline) in splines.iter().enumerate() {
        let [low, high] = spline.domain();
        for ([_, b], mut piece) in spline.beziers() {
            while piece.len() <= degree {
                piece = raised(&piece);
            }
            append(&mut points, &piece);
            let knot = number as f64 + (b - low) / (high - low);
            knots.extend(std::iter::repeat_n(knot, degree));
        }
    }
    knots.push(splines.len() as f64);
    Spline::from_weighted(degree, knots, &points)
}

fn raised(piece: &[Weighted]) -> Vec<Weighted> {
    let degree = piece.len() as f64;
    let mut raised = Vec::with_capacity(piece.len() + 1);
    raised.extend(piece.first());
    for (number, pair) in piece.windows(2).enumerate() {
        let &[[ax, ay, az, aw], [bx, by, bz, bw]] = pair else { continue };
        let share = (number + 1) as f64 / degree;
        raised.push([(ax, bx), (ay, by), (az, bz), (aw, bw)].map(|(a, b)| share * a + (1.0 - share) * b));
    }
    raised.extend(piece.last());
    raised
}

fn append(points: &mut Vec<Weighted>, piece: &[Weighted]) {
    let (Some(end), Some(&[x, y, z, w])) = (points.last_mut(), piece.first()) else {
        points.extend(piece);
        return;
    };
    let factor = end[3] / w;
    let other = [x, y, z, w].map(|x| x * factor);
    // The same joint from both sides stays what it is, to the last bit.
    if distance([end[0], end[1], end[2]], [other[0], other[1], other[2]]) > 0.0 {
        end.iter_mut().zip(other).for_each(|(end, other)| *end = 0.5 * (*end + other));
    }
    points.extend(piece.iter().skip(1).map(|point| point.map(|x| x * factor)));
}
