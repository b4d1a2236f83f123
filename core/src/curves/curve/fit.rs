//! Cubic B-splines of curves that are known by their points alone.
//!
//! Each interval is a cubic that has points and derivatives of the curve at both ends (TNB section 9.5.2's interpolation, with
//! derivatives by differences of fourth order); one that is too far off is halved. The error falls with the fourth power of the
//! interval.

use super::error::CurveError;
use super::spline::Spline;
use crate::curves::vector::{Point, add, distance, is_finite, scale};

/// Intervals, at most.
const MOST: usize = 1 << 13;
/// Halvings of an interval, at most.
const DEEPEST: u32 = 24;
/// Differences are taken over so many parts of an interval.
const PARTS: f64 = 64.0;

/// A cubic on an interval: both ends, its points and how often it was halved.
struct Piece {
    ends: [f64; 2],
    bezier: [Point; 4],
    depth: u32,
    off: f64,
}

/// A cubic B-spline with the same parameter, and how far it is off at most, measured at seven places of each interval. The curve
/// is continuous from the first to the last of the cuts; between two of them it is smooth. O(intervals); there are no more than
/// 8192, so `tolerance` may not be reached.
///
/// # Errors
/// [`CurveError`] of less than two cuts, and of points that are not finite.
pub(crate) fn fit(at: impl Fn(f64) -> Point, cuts: &[f64], tolerance: f64) -> Result<(Spline, f64), CurveError> {
    let mut stack: Vec<Piece> = cuts.windows(2).rev().filter_map(|pair| piece(&at, pair.first(), pair.last(), 0)).collect();
    if stack.is_empty() {
        return Err(CurveError::Domain);
    }
    let mut room = MOST.saturating_sub(stack.len());
    let mut done: Vec<Piece> = Vec::new();
    while let Some(next) = stack.pop() {
        let [low, high] = next.ends;
        let middle = 0.5 * (low + high);
        // Half of the tolerance is for the joints, where derivatives of both sides are made one.
        if next.off <= 0.5 * tolerance || next.depth >= DEEPEST || room == 0 {
            done.push(next);
            continue;
        }
        room -= 1;
        stack.extend(piece(&at, Some(&middle), Some(&high), next.depth + 1));
        stack.extend(piece(&at, Some(&low), Some(&middle), next.depth + 1));
    }
    join(&at, cuts, done)
}

fn piece(at: &impl Fn(f64) -> Point, low: Option<&f64>, high: Option<&f64>, depth: u32) -> Option<Piece> {
    let (&low, &high) = low.zip(high)?;
    if low >= high {
        return None;
    }
    let third = (high - low) / 3.0;
    let (start, end) = (at(low), at(high));
    let inner = [add(start, scale(slope(at, low, high), third)), add(end, scale(slope(at, high, low), -third))];
    let bezier = [start, inner[0], inner[1], end];
    Some(Piece { ends: [low, high], bezier, depth, off: off(at, [low, high], &bezier) })
}

/// The derivative at `from`, by points towards `to`.
fn slope(at: &impl Fn(f64) -> Point, from: f64, to: f64) -> Point {
    let step = (to - from) / PARTS;
    let weights = [-25.0, 48.0, -36.0, 16.0, -3.0];
    let terms = weights.into_iter().enumerate().map(|(number, weight)| scale(at(from + step * number as f64), weight));
    scale(terms.fold([0.0; 3], add), 1.0 / (12.0 * step))
}

fn off(at: &impl Fn(f64) -> Point, [low, high]: [f64; 2], bezier: &[Point; 4]) -> f64 {
    let far = |number: u32| {
        let share = f64::from(number) / 8.0;
        distance(at(low + (high - low) * share), cubic(bezier, share))
    };
    (1..8).map(far).fold(0.0, f64::max)
}

fn cubic([a, b, c, d]: &[Point; 4], t: f64) -> Point {
    let s = 1.0 - t;
    let weights = [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t];
    [a, b, c, d].into_iter().zip(weights).map(|(point, weight)| scale(*point, weight)).fold([0.0; 3], add)
}

/// All pieces as one: smooth where one was halved, and free to have a corner at a cut.
fn join(at: &impl Fn(f64) -> Point, cuts: &[f64], mut pieces: Vec<Piece>) -> Result<(Spline, f64), CurveError> {
    let is_cut = |t: f64| cuts.binary_search_by(|cut| cut.total_cmp(&t)).is_ok();
    for number in 1..pieces.len() {
        let Some([left, right]) = pieces.get_mut(number - 1..=number) else { continue };
        let ([from, joint], [_, to]) = (left.ends, right.ends);
        if !is_cut(joint) {
            let [left_slope, right_slope] = [slope(at, joint, from), slope(at, joint, to)];
            let middle = scale(add(left_slope, right_slope), 0.5);
            left.bezier[2] = add(left.bezier[3], scale(middle, (from - joint) / 3.0));
            right.bezier[1] = add(right.bezier[0], scale(middle, (to - joint) / 3.0));
        }
    }
    let worst = pieces.iter().map(|piece| off(at, piece.ends, &piece.bezier)).fold(0.0, f64::max);
    let start = pieces.first().map_or(0.0, |piece| piece.ends[0]);
    let (mut knots, mut points) = (vec![start; 4], Vec::new());
    points.extend(pieces.first().map(|piece| piece.bezier[0]));
    for (number, piece) in pieces.iter().enumerate() {
        let [_, inner @ .., end] = piece.bezier;
        points.extend(inner);
        let is_last = number + 1 == pieces.len();
        let is_corner = is_last || is_cut(piece.ends[1]);
        // The joint of two that are smooth there lies between its neighbours, and needs no point of its own.
        if is_corner {
            points.push(end);
        }
        knots.extend(std::iter::repeat_n(piece.ends[1], if is_last { 4 } else { 2 + usize::from(is_corner) }));
    }
    if !points.iter().copied().all(is_finite) {
        return Err(CurveError::NotFinite);
    }
    Spline::new(3, knots, points, None, None).map(|spline| (spline, worst))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A helix, and the absolute value, which has a corner at a cut.
    #[test]
    fn curves_are_fitted_up_to_a_tolerance() {
        let helix = |t: f64| [t.cos(), t.sin(), 0.3 * t];
        let (spline, off) = fit(helix, &[0.0, 7.0], 1e-9).unwrap();
        assert!(off <= 1e-9 && spline.points().len() < 1100, "{off} {}", spline.points().len());
        for number in 0..=1000 {
            let t = 0.007 * f64::from(number);
            assert!(distance(spline.point_and_derivative(t).0, helix(t)) <= 1.1e-9);
        }
        let corner = |t: f64| [t, t.abs(), 0.0];
        let (spline, off) = fit(corner, &[-1.0, 0.0, 2.0], 1e-12).unwrap();
        assert!(off < 1e-14 && spline.points().len() == 7);
        assert!(fit(|_| [f64::NAN; 3], &[0.0, 1.0], 1e-3).is_err());
    }
}
