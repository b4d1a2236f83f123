//! Curves as cubic B-splines.
//!
//! Based on: TNB section 9.4.1 (least squares, ends interpolated), and paper S2 (knots at 1/4 and 3/4 of spans that are not good
//! enough).

use super::basis;
use super::linear::Band;
use super::pieces::{Piece, Pieces};
use crate::curves::curve::{CurveError, Shape, Spline};
use crate::curves::vector::{Point, add, norm, scale, sub};

/// Rounds of finer knots of a piece, at most.
const ROUNDS: u32 = 24;
/// Spans of a piece, at most.
const MOST: usize = 4096;
/// Samples of a span by which it is fitted, and twice as many by which it is judged.
const EACH: usize = 8;
/// All spans are refined if the mean of their largest errors is above this share of the largest of all, else those alone that are
/// above it.
const EVEN: f64 = 0.3;

/// Why a curve is no cubic B-spline.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// The numbers of the curve are none.
    #[error(transparent)]
    Curve(#[from] CurveError),
    /// It has no length.
    #[error("the curve has no length")]
    Short,
    /// The bounds of rounds and spans were met.
    #[error("the distance of {reached:e} stays above the {wanted:e} asked for")]
    Tolerance {
        /// The distance that was reached.
        reached: f64,
        /// The one asked for.
        wanted: f64,
    },
}

/// A curve as a cubic B-spline, and how its parameter becomes one of the curve.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// Cubic, without weights, clamped, on 0 to 1.
    pub spline: Spline,
    /// No point of either curve is farther from the other one; 0 if it is the same curve.
    pub error: f64,
    /// Length of the curve.
    pub length: f64,
    pieces: Pieces,
}

impl Fitted {
    /// The parameter of the curve itself that belongs to one of the B-spline. O(log spans + degree²).
    #[must_use]
    pub fn parameter(&self, shape: &Shape, t: f64) -> f64 {
        self.pieces.parameter(shape, t)
    }
}

/// A curve as a cubic B-spline: the same curve where it is of degree 3 or less without weights, else fitted by arc length until
/// no point of either is farther than `tolerance` from the other one. The distance is that of points of the same parameter at 16
/// samples for each span, and what it may grow to between them by the speed at which it changes there; it bounds Hausdorff's
/// distance both ways. O(spans · rounds).
///
/// # Errors
/// [`FitError`] of no length, numbers that overflow, and if 24 rounds or 4,096 spans do not suffice.
pub fn fit(shape: &Shape, tolerance: f64) -> Result<Fitted, FitError> {
    let pieces = Pieces::new(shape);
    let (spline, error) = fitted(shape, &pieces, tolerance)?;
    Ok(Fitted { spline, error, length: pieces.length(), pieces })
}

/// The B-spline and the distance.
pub(super) fn fitted(shape: &Shape, pieces: &Pieces, tolerance: f64) -> Result<(Spline, f64), FitError> {
    let mut knots = vec![0.0; 4];
    let mut points: Vec<Point> = Vec::new();
    let mut error = 0.0_f64;
    for piece in &pieces.0 {
        let (inner, part, reached) = if piece.is_cubic { exact(shape, piece)? } else { approximate(shape, piece, tolerance)? };
        error = error.max(reached);
        let [low, high] = piece.share;
        knots.extend(inner.into_iter().map(|knot| low + (high - low) * knot));
        knots.extend([high; 3]);
        // The joint of both pieces is one point.
        points.extend(part.iter().skip(usize::from(!points.is_empty())));
    }
    if points.is_empty() {
        return Err(FitError::Short);
    }
    knots.push(1.0);
    Ok((Spline::new(3, knots, points, None, None)?, error))
}

/// Inner knots and control points on 0 to 1, and the distance.
type Part = (Vec<f64>, Vec<Point>, f64);

/// A cubic B-spline as it is; of lower degrees, Bézier curves between knots, by four points of each.
fn exact(shape: &Shape, piece: &Piece) -> Result<Part, FitError> {
    let [low, high] = piece.domain;
    if let Shape::Spline(spline) | Shape::Conic(spline) = shape
        && spline.degree() == 3
    {
        let clamped = spline.clone().on(piece.domain)?.clamped()?;
        let count = clamped.points().len();
        let inner = clamped.knots().get(4..count).unwrap_or_default();
        return Ok((inner.iter().map(|knot| (knot - low) / (high - low)).collect(), clamped.points().to_vec(), 0.0));
    }
    let mut cuts = super::measure::cuts(shape);
    cuts.retain(|cut| *cut > low && *cut < high);
    let mut inner = Vec::with_capacity(3 * cuts.len());
    let mut points = vec![shape.point(low)];
    let ends: Vec<f64> = std::iter::once(low).chain(cuts).chain([high]).collect();
    for pair in ends.windows(2) {
        let &[a, b] = pair else { continue };
        let [p, q, r, s] = [a, a + (b - a) / 3.0, b - (b - a) / 3.0, b].map(|t| shape.point(t));
        let mix = |[a, b, c, d]: [f64; 4]| scale(add(add(scale(p, a), scale(q, b)), add(scale(r, c), scale(s, d))), 1.0 / 6.0);
        points.extend([mix([-5.0, 18.0, -9.0, 2.0]), mix([2.0, -9.0, 18.0, -5.0]), s]);
        if b < high {
            inner.extend([(b - low) / (high - low); 3]);
        }
    }
    Ok((inner, points, 0.0))
}

fn approximate(shape: &Shape, piece: &Piece, tolerance: f64) -> Result<Part, FitError> {
    let mut cuts = vec![0.0, 1.0];
    let mut best: Option<Part> = None;
    for _ in 0..ROUNDS {
        let knots: Vec<f64> = [0.0; 3].into_iter().chain(cuts.iter().copied()).chain([1.0; 3]).collect();
        let Some(points) = least_squares(shape, piece, &knots, &cuts) else { break };
        let errors = errors(shape, piece, &knots, &points, &cuts);
        let largest = errors.iter().copied().fold(0.0, f64::max);
        let inner = cuts.get(1..cuts.len() - 1).unwrap_or_default().to_vec();
        if best.as_ref().is_none_or(|best| largest < best.2) {
            best = Some((inner, points, largest));
        }
        if largest <= tolerance || cuts.len() > MOST || !largest.is_finite() {
            break;
        }
        cuts = finer(&cuts, &errors, largest);
    }
    match best {
        Some(best) if best.2 <= tolerance => Ok(best),
        Some(best) => Err(FitError::Tolerance { reached: best.2, wanted: tolerance }),
        None => Err(FitError::Short),
    }
}

/// Knots at 1/4 and 3/4 of spans: of all where they are about as bad as each other, else of the worst.
fn finer(cuts: &[f64], errors: &[f64], largest: f64) -> Vec<f64> {
    let mean = errors.iter().sum::<f64>() / errors.len().max(1) as f64;
    let least = if mean >= EVEN * largest { 0.0 } else { EVEN * largest };
    let mut finer = Vec::with_capacity(3 * cuts.len());
    for (pair, error) in cuts.windows(2).zip(errors) {
        let &[a, b] = pair else { continue };
        finer.push(a);
        if *error >= least {
            finer.extend([0.75 * a + 0.25 * b, 0.25 * a + 0.75 * b]);
        }
    }
    finer.extend(cuts.last());
    finer
}

/// Control points of the least sum of squared distances, both ends kept.
fn least_squares(shape: &Shape, piece: &Piece, knots: &[f64], cuts: &[f64]) -> Option<Vec<Point>> {
    let point = |t| shape.point(piece.parameter(shape, t));
    let ends = [point(0.0), point(1.0)];
    let count = knots.len() - 4;
    let mut band = Band::new(count - 2);
    for (number, pair) in cuts.windows(2).enumerate() {
        let &[a, b] = pair else { continue };
        for sample in 0..EACH {
            let t = a + (b - a) * (sample as f64 + 0.5) / EACH as f64;
            let values = basis::values(knots, 3, number + 3, t);
            let values = [values[0], values[1], values[2], values[3]];
            let mut target = point(t);
            if number == 0 {
                target = sub(target, scale(ends[0], values[0]));
            }
            if number + 2 == cuts.len() {
                target = sub(target, scale(ends[1], values[3]));
            }
            band.observe(number as isize - 1, values, target);
        }
    }
    let inner = band.solve()?;
    Some(std::iter::once(ends[0]).chain(inner).chain([ends[1]]).collect())
}

/// The largest distance of each span, bounded between samples by how fast the distance changes.
fn errors(shape: &Shape, piece: &Piece, knots: &[f64], points: &[Point], cuts: &[f64]) -> Vec<f64> {
    let mut errors = Vec::with_capacity(cuts.len());
    for (number, pair) in cuts.windows(2).enumerate() {
        let &[a, b] = pair else { continue };
        let offset = |sample: usize| {
            let t = a + (b - a) * sample as f64 / (2 * EACH) as f64;
            let values = basis::values(knots, 3, number + 3, t);
            let near = points.iter().skip(number).take(4).zip(values);
            let value = near.fold([0.0; 3], |sum, (point, value)| add(sum, scale(*point, value)));
            sub(value, shape.point(piece.parameter(shape, t)))
        };
        let (mut largest, mut last, mut step) = (0.0_f64, offset(0), 0.0_f64);
        for sample in 1..=2 * EACH {
            let next = offset(sample);
            largest = largest.max(norm(next));
            step = step.max(norm(sub(next, last)));
            last = next;
        }
        errors.push(largest + 0.5 * step);
    }
    errors
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curves::curve::Arc;
    use crate::curves::vector::distance;
    use proptest::prelude::*;

    #[test]
    fn a_circle_is_fitted_below_any_tolerance() {
        let shape = Shape::Arc(Arc::new([1.0, 2.0, 3.0], [[2.0, 0.0, 0.0], [0.0, 2.0, 0.0]], [0.5, 4.0]).unwrap());
        for tolerance in [1e-2, 1e-5, 1e-9] {
            let fitted = fit(&shape, tolerance).unwrap();
            assert!(fitted.error <= tolerance && fitted.error > 0.0);
            for number in 0..1000 {
                let point = fitted.spline.point_and_derivative(f64::from(number) / 999.0).0;
                assert!((distance(point, [1.0, 2.0, 3.0]) - 2.0).abs() <= fitted.error);
            }
        }
        assert!(matches!(fit(&shape, 1e-17), Err(FitError::Tolerance { .. })));
    }

    #[test]
    fn lines_and_polylines_stay_what_they_are() {
        let fitted = fit(&Shape::polyline(vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 3.0, 0.0]]).unwrap(), 0.0).unwrap();
        assert_eq!((fitted.error, fitted.length), (0.0, 4.0));
        assert_eq!(fitted.pieces.corners(), [0.0, 0.25, 1.0]);
        assert!(distance(fitted.spline.point_and_derivative(0.5).0, [1.0, 1.0, 0.0]) < 1e-14);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// Curves of degree 3 and less without weights are exact; others are as near as said.
        #[test]
        fn curves_are_as_near_as_said(degree in 1_usize..6, steps in prop::collection::vec(0.1..1.0_f64, 3),
            points in prop::collection::vec(prop::array::uniform3(-5.0..5.0_f64), 9),
                weights in prop::option::of(prop::collection::vec(0.5..2.0_f64, 9))) {
            let mut knots = vec![0.0; degree + 1];
            let count = degree + 4;
            steps.iter().for_each(|step| knots.push(knots[knots.len() - 1] + step));
            knots.resize(count + degree + 1, knots[knots.len() - 1] + 0.5);
            let weights = weights.map(|weights| weights[..count].to_vec());
            let shape = Shape::Spline(Spline::new(degree, knots, points[..count].to_vec(), weights.clone(), None).unwrap());
            let fitted = fit(&shape, 1e-4).unwrap();
            let is_exact = degree <= 3 && weights.is_none();
            prop_assert_eq!(fitted.error == 0.0, is_exact);
            for number in 0..=300 {
                let t = f64::from(number) / 300.0;
                let (a, b) = (fitted.spline.point_and_derivative(t).0, shape.point(fitted.parameter(&shape, t)));
                prop_assert!(distance(a, b) <= fitted.error + 1e-12 * 5.0, "{} {}", distance(a, b), fitted.error);
            }
        }
    }
}
