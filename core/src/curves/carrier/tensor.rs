//! B-spline surfaces.

use crate::curves::curve::{CurveError, HIGHEST_DEGREE, Spline};
use crate::curves::vector::{Affine, Point, add, distance, is_finite, scale, sub};

/// A tensor product B-spline surface, rational or not. It is checked when it is made, as a curve is.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tensor {
    degrees: [usize; 2],
    knots: [Vec<f64>; 2],
    /// Rows along `v`, one behind the other along `u`: points and weights.
    rows: Vec<Vec<(Point, f64)>>,
    /// Whether it comes back to itself along `u` and `v`, so that parameters may go on beyond its domain.
    is_closed: [bool; 2],
}

impl Tensor {
    /// Of rows along `v`; weights of all are 1 if there are none. O(points).
    ///
    /// # Errors
    /// [`CurveError`] of what is no such surface.
    pub(crate) fn new(degrees: [usize; 2], knots: [Vec<f64>; 2], rows: Vec<Vec<(Point, f64)>>) -> Result<Self, CurveError> {
        let columns = rows.first().map_or(0, Vec::len);
        for ((degree, knots), points) in degrees.into_iter().zip(&knots).zip([rows.len(), columns]) {
            if degree == 0 || degree > HIGHEST_DEGREE {
                return Err(CurveError::Degree(degree));
            }
            if points <= degree || knots.len() != points + degree + 1 || rows.iter().any(|row| row.len() != columns) {
                return Err(CurveError::Count { points, knots: knots.len(), degree });
            }
            if !knots.iter().all(|knot| knot.is_finite()) || !knots.is_sorted() || knots.get(degree) >= knots.get(points) {
                return Err(CurveError::Knots);
            }
        }
        if !rows.iter().flatten().all(|(point, _)| is_finite(*point)) {
            return Err(CurveError::NotFinite);
        }
        if !rows.iter().flatten().all(|(_, weight)| *weight > 0.0 && weight.is_finite()) {
            return Err(CurveError::Weights);
        }
        let is_closed = is_closed(&rows);
        Ok(Self { degrees, knots, rows, is_closed })
    }

    /// A parameter in the domain: by whole turns of a surface that comes back to itself, by the nearest one of others.
    fn within(&self, along: usize, t: f64) -> f64 {
        let [u, v] = self.domain();
        let [low, high] = if along == 0 { u } else { v };
        if (low..=high).contains(&t) {
            t
        } else if self.is_closed.get(along) == Some(&true) {
            low + (t - low).rem_euclid(high - low)
        } else {
            t.clamp(low, high)
        }
    }

    /// Whether a box of parameters is within the domain, but for 10⁻⁴ of it and turns of a surface that comes back to itself.
    pub(crate) fn has(&self, [low, high]: [Point; 2]) -> bool {
        let domain = self.domain().into_iter().zip(self.is_closed).zip(low.into_iter().zip(high));
        domain.into_iter().all(|(([from, to], is_closed), (low, high))| {
            let slack = 1e-4 * (to - from);
            is_closed || (low >= from - slack && high <= to + slack)
        })
    }

    /// Lowest and highest parameters along `u` and `v`.
    pub(crate) fn domain(&self) -> [[f64; 2]; 2] {
        let counts = [self.rows.len(), self.rows.first().map_or(0, Vec::len)];
        let end = |knots: &Vec<f64>, at: usize| knots.get(at).copied().unwrap_or_default();
        let [u, v] = [0, 1].map(|along: usize| match (self.knots.get(along), self.degrees.get(along), counts.get(along)) {
            (Some(knots), Some(degree), Some(count)) => [end(knots, *degree), end(knots, *count)],
            _ => [0.0; 2],
        });
        [u, v]
    }

    /// The point of two parameters, which are moved into the domain (TNB A3.5 and A4.3). O(degree²).
    pub(crate) fn point(&self, u: f64, v: f64) -> Point {
        let [first_u, first_v] = [(0, u), (1, v)].map(|(along, t)| self.functions(along, t));
        let (mut sum, mut whole) = ([0.0; 3], 0.0);
        for (row, share) in self.rows.iter().skip(first_u.0).zip(&first_u.1) {
            for ((point, weight), other) in row.iter().skip(first_v.0).zip(&first_v.1) {
                let weight = weight * share * other;
                sum = add(sum, scale(*point, weight));
                whole += weight;
            }
        }
        scale(sum, 1.0 / whole)
    }

    /// The first control point that counts at a parameter, and how much it and the next ones do (TNB A2.1 and A2.2).
    fn functions(&self, along: usize, t: f64) -> (usize, Vec<f64>) {
        let [u, v] = self.domain();
        let [_, high] = if along == 0 { u } else { v };
        let degree = self.degrees.get(along).copied().unwrap_or(1);
        let knots = self.knots.get(along).map(Vec::as_slice).unwrap_or_default();
        let t = self.within(along, t);
        let knot = |at: usize| knots.get(at).copied().unwrap_or(high);
        // At the end of the domain, the last span before it that is not empty.
        let is_before = |knot: &f64| if t < high { *knot <= t } else { *knot < high };
        let inner = knots.get(degree..knots.len().saturating_sub(degree)).unwrap_or_default();
        let span = degree + inner.partition_point(is_before).saturating_sub(1);
        let mut values = vec![0.0; degree + 1];
        values.iter_mut().take(1).for_each(|value| *value = 1.0);
        for step in 1..=degree {
            let mut saved = 0.0;
            for (place, value) in values.iter_mut().enumerate().take(step + 1) {
                let own = *value;
                let (left, right) = (knot(span + place + 1 - step), knot(span + place + 1));
                // The last one of a step has nothing to its right yet.
                let share = if place < step { own / (right - left) } else { 0.0 };
                *value = saved + if place < step { (right - t) * share } else { 0.0 };
                saved = if place < step { (t - left) * share } else { 0.0 };
            }
        }
        (span - degree.min(span), values)
    }

    /// The curve where `u` (`along` is 1) or `v` (0) is the same everywhere; exact. O(points).
    pub(crate) fn line(&self, along: usize, t: f64) -> Result<Spline, CurveError> {
        let (first, shares) = self.functions(1 - along, t);
        let count = if along == 1 { self.rows.first().map_or(0, Vec::len) } else { self.rows.len() };
        let (mut points, mut weights) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for number in 0..count {
            let (mut sum, mut whole) = ([0.0; 3], 0.0);
            for (step, share) in shares.iter().enumerate() {
                let [row, column] = if along == 1 { [first + step, number] } else { [number, first + step] };
                let Some((point, weight)) = self.rows.get(row).and_then(|row| row.get(column)) else { continue };
                sum = add(sum, scale(*point, weight * share));
                whole += weight * share;
            }
            points.push(scale(sum, 1.0 / whole));
            weights.push(whole);
        }
        let degree = self.degrees.get(along).copied().unwrap_or(1);
        Spline::new(degree, self.knots.get(along).cloned().unwrap_or_default(), points, Some(weights), None)
    }

    /// Its system if it is a parallelogram of degree 1 × 1, up to rounding.
    pub(super) fn plane(&self) -> Option<Affine> {
        let [[u0, u1], [v0, v1]] = self.domain();
        let [first, second] = self.rows.as_slice() else { return None };
        let ([(a, w), (b, x)], [(c, y), (d, z)]) = (first.as_slice(), second.as_slice()) else { return None };
        let size = distance(*a, *d).max(distance(*b, *c));
        let is_flat = distance(add(*b, *c), add(*a, *d)) <= 1e-12 * size && [x, y, z].into_iter().all(|other| other == w);
        if !is_flat || self.degrees != [1, 1] {
            return None;
        }
        let (along_u, along_v) = (scale(sub(*c, *a), 1.0 / (u1 - u0)), scale(sub(*b, *a), 1.0 / (v1 - v0)));
        let origin = sub(sub(*a, scale(along_u, u0)), scale(along_v, v0));
        Some(Affine::from_axes([along_u, along_v, [0.0; 3]], origin))
    }
}

/// Whether the first and last points along `u`, and those along `v`, are the same but for rounding.
fn is_closed(rows: &[Vec<(Point, f64)>]) -> [bool; 2] {
    let size = rows
        .iter()
        .flatten()
        .map(|(point, _)| distance(*point, rows.first().and_then(|row| row.first()).map_or(*point, |first| first.0)));
    let slack = 1e-9 * size.fold(0.0, f64::max);
    let near = |a: &(Point, f64), b: &(Point, f64)| distance(a.0, b.0) <= slack;
    let u = rows.first().zip(rows.last()).is_some_and(|(first, last)| first.iter().zip(last).all(|(a, b)| near(a, b)));
    let v = rows.iter().all(|row| row.first().zip(row.last()).is_some_and(|(a, b)| near(a, b)));
    [u, v]
}
