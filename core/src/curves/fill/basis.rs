//! Basis functions of B-splines, and the insertion of knots.

use crate::curves::curve::HIGHEST_DEGREE;
use crate::curves::vector::{Point, add, scale};

pub(super) fn at(values: &[f64], number: usize) -> f64 {
    values.get(number).or(values.last()).copied().unwrap_or_default()
}

/// The number of the knot where the span of a parameter begins, never an empty one (TNB A2.1); knots are clamped.
pub(super) fn span(knots: &[f64], degree: usize, t: f64) -> usize {
    let last = knots.len().saturating_sub(degree + 1);
    let inner = knots.get(degree..last).unwrap_or_default();
    let mut span = degree + inner.partition_point(|knot| *knot <= t).saturating_sub(1);
    while span > degree && at(knots, span) >= at(knots, span + 1) {
        span -= 1;
    }
    span
}

/// Values of the basis functions of a span that are not 0 (TNB A2.2).
pub(super) type Values = [f64; HIGHEST_DEGREE + 1];

/// Basis functions of a degree at a parameter of a span: the first `degree + 1` entries (TNB A2.2). O(degree²).
pub(super) fn values(knots: &[f64], degree: usize, span: usize, t: f64) -> Values {
    let mut values = [0.0; HIGHEST_DEGREE + 1];
    values[0] = 1.0;
    for order in 1..=degree.min(HIGHEST_DEGREE) {
        let mut saved = 0.0;
        for (number, value) in values.iter_mut().enumerate().take(order) {
            let right = at(knots, span + number + 1) - t;
            let left = t - at(knots, (span + number + 1).saturating_sub(order));
            let share = *value / (right + left);
            *value = saved + right * share;
            saved = left * share;
        }
        values[order] = saved;
    }
    values
}

/// Basis functions and their first two derivatives: a derivative is a difference of functions one degree lower (TNB equation
/// 2.7). O(degree²).
pub(super) fn derivatives(knots: &[f64], degree: usize, span: usize, t: f64) -> [Values; 3] {
    let mut rows = [values(knots, degree, span, t), [0.0; HIGHEST_DEGREE + 1], [0.0; HIGHEST_DEGREE + 1]];
    for (order, row) in rows.iter_mut().enumerate().skip(1) {
        if order > degree {
            break;
        }
        let mut lower = values(knots, degree - order, span, t);
        for raised in degree - order + 1..=degree {
            lower = difference(knots, raised, span, &lower);
        }
        *row = lower;
    }
    rows
}

/// Derivatives of the functions of a degree, from (derivatives of) those one degree lower.
fn difference(knots: &[f64], degree: usize, span: usize, lower: &Values) -> Values {
    let mut row = [0.0; HIGHEST_DEGREE + 1];
    for number in 0..=degree {
        let first = (span + number).saturating_sub(degree);
        let part = |value: f64, from: usize| {
            let width = at(knots, from + degree) - at(knots, from);
            if width > 0.0 { value * degree as f64 / width } else { 0.0 }
        };
        let left = if number > 0 { part(lower[number - 1], first) } else { 0.0 };
        let right = if number < degree { part(lower[number], first + 1) } else { 0.0 };
        row[number] = left - right;
    }
    row
}

/// Both knot vectors as one: each knot as often as where it is more often. Knots that rounding alone tells apart, by 10⁻¹² of the
/// domain, are one.
pub(super) fn union(a: &[f64], b: &[f64]) -> Vec<f64> {
    let slack = 1e-12 * (at(a, a.len()) - at(a, 0));
    let (mut a, mut b) = (a.iter().copied().peekable(), b.iter().copied().peekable());
    let mut knots = Vec::new();
    loop {
        let next = match (a.peek(), b.peek()) {
            (None, None) => return knots,
            (Some(_), None) => a.next(),
            (None, Some(_)) => b.next(),
            (Some(x), Some(y)) if (x - y).abs() <= slack => {
                b.next();
                a.next()
            }
            (Some(x), Some(y)) if x < y => a.next(),
            _ => b.next(),
        };
        knots.extend(next);
    }
}

/// Control points of the same curve for finer knots (what TNB A5.4 does): each is the blossom of a span at the knots that belong
/// to it (L. Ramshaw 1987). O(points · degree²).
pub(super) fn refined(degree: usize, knots: &[f64], points: &[Point], finer: &[f64]) -> Vec<Point> {
    let count = finer.len().saturating_sub(degree + 1);
    let mut refined = Vec::with_capacity(count);
    for number in 0..count {
        let support = (number..=number + degree).find(|place| at(finer, *place) < at(finer, place + 1)).unwrap_or(number);
        let span = span(knots, degree, 0.5 * (at(finer, support) + at(finer, support + 1)));
        refined.push(blossom(degree, knots, points, span, finer.get(number + 1..).unwrap_or_default()));
    }
    refined
}

fn blossom(degree: usize, knots: &[f64], points: &[Point], span: usize, arguments: &[f64]) -> Point {
    let first = span.saturating_sub(degree);
    let mut row: Vec<Point> = points.get(first..=span).unwrap_or_default().to_vec();
    for step in 1..=degree {
        let t = at(arguments, step - 1);
        for place in 0..=degree - step {
            let (low, high) = (at(knots, first + step + place), at(knots, first + degree + 1 + place));
            let share = (t - low) / (high - low);
            if let Some([left, right]) = row.get_mut(place..place + 2) {
                *left = add(scale(*left, 1.0 - share), scale(*right, share));
            }
        }
    }
    row.first().copied().unwrap_or_default()
}

/// Means of the inner knots of each function: control points of the parameter itself (Greville's abscissae).
pub(super) fn greville(degree: usize, knots: &[f64]) -> Vec<f64> {
    let count = knots.len().saturating_sub(degree + 1);
    (0..count).map(|number| knots.iter().skip(number + 1).take(degree).sum::<f64>() / degree as f64).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const KNOTS: [f64; 10] = [0.0, 0.0, 0.0, 0.0, 0.3, 0.7, 1.0, 1.0, 1.0, 1.0];

    /// The functions sum to 1, Greville's abscissae give the parameter back, and derivatives agree with differences.
    #[test]
    fn functions_and_derivatives_agree() {
        let means = greville(3, &KNOTS);
        for t in [0.0, 0.1, 0.3, 0.5, 0.95] {
            let place = span(&KNOTS, 3, t);
            let [values, first, second] = derivatives(&KNOTS, 3, place, t);
            let sum = |row: &Values| (0..4).map(|number| row[number] * means[place - 3 + number]).sum::<f64>();
            assert!((values.iter().sum::<f64>() - 1.0).abs() < 1e-14);
            assert!((sum(&values) - t).abs() < 1e-14 && (sum(&first) - 1.0).abs() < 1e-12 && sum(&second).abs() < 1e-10);
            let step = 1e-5;
            let later = derivatives(&KNOTS, 3, place, t + step);
            for number in 0..4 {
                assert!(((later[0][number] - values[number]) / step - first[number]).abs() < 1e-2);
                assert!(((later[1][number] - first[number]) / step - second[number]).abs() < 1e-1);
            }
        }
    }

    #[test]
    fn finer_knots_change_no_point() {
        let points: Vec<Point> = (0..6).map(|x| [f64::from(x), f64::from(x * x % 5), 1.0]).collect();
        let finer = union(&KNOTS, &[0.0, 0.0, 0.0, 0.0, 0.3, 0.3, 0.5, 1.0, 1.0, 1.0, 1.0]);
        assert_eq!(finer, [0.0, 0.0, 0.0, 0.0, 0.3, 0.3, 0.5, 0.7, 1.0, 1.0, 1.0, 1.0]);
        let refined = refined(3, &KNOTS, &points, &finer);
        let value = |knots: &[f64], points: &[Point], t: f64| {
            let place = span(knots, 3, t);
            let values = values(knots, 3, place, t);
            (0..4).fold([0.0; 3], |sum, number| add(sum, scale(points[place - 3 + number], values[number])))
        };
        for t in [0.0, 0.2, 0.3, 0.6, 1.0] {
            let (a, b) = (value(&KNOTS, &points, t), value(&finer, &refined, t));
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-13), "{t}");
        }
    }
}
