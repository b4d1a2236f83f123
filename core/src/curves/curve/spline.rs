//! B-splines, rational or not.

use super::error::{CurveError, HIGHEST_DEGREE};
use super::length;
use crate::curves::vector::{Affine, Point, is_finite, scale, sub};
use crate::util::each::Each;

/// A point times its weight, and the weight.
pub(super) type Weighted = [f64; 4];

/// A B-spline curve of a degree, with all its knots (repeated ones as often as they count), control points, and weights if it is rational.
///
/// It is checked when it is made: knots are as many as points, the degree and one together, and never decrease; weights are above 0; the
/// domain is not empty and lies within the knots that count. Knots need not be clamped.
#[derive(Clone, Debug, PartialEq)]
pub struct Spline {
    degree: usize,
    knots: Vec<f64>,
    points: Vec<Point>,
    weights: Option<Vec<f64>>,
    domain: [f64; 2],
}

impl Spline {
    /// A B-spline on a domain, or on all that its knots allow. Weights that are all the same are dropped. O(points).
    ///
    /// # Errors
    /// [`CurveError`] of what is not one.
    pub fn new(
        degree: usize,
        knots: Vec<f64>,
        points: Vec<Point>,
        weights: Option<Vec<f64>>,
        domain: Option<[f64; 2]>,
    ) -> Result<Self, CurveError> {
        if degree == 0 || degree > HIGHEST_DEGREE {
            return Err(CurveError::Degree(degree));
        }
        if points.len() <= degree || knots.len() != points.len() + degree + 1 {
            return Err(CurveError::Count { points: points.len(), knots: knots.len(), degree });
        }
        if !points.iter().copied().all(is_finite) || !knots.iter().all(|knot| knot.is_finite()) {
            return Err(CurveError::NotFinite);
        }
        if !knots.is_sorted() {
            return Err(CurveError::Knots);
        }
        let weights = match weights {
            Some(weights) if weights.len() != points.len() || !weights.iter().all(|w| *w > 0.0 && w.is_finite()) => {
                return Err(CurveError::Weights);
            }
            Some(weights) if weights.windows(2).all(|pair| pair.first() == pair.last()) => None,
            weights => weights,
        };
        let whole = [at(&knots, degree), at(&knots, points.len())];
        let domain = checked(domain.unwrap_or(whole), whole)?;
        Ok(Self { degree, knots, points, weights, domain })
    }

    /// Degree of its polynomials.
    #[must_use]
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// All knots.
    #[must_use]
    pub fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// Control points.
    #[must_use]
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// Weights of the control points; `None` if they are all 1.
    #[must_use]
    pub fn weights(&self) -> Option<&[f64]> {
        self.weights.as_deref()
    }

    /// Lowest and highest parameter.
    #[must_use]
    pub fn domain(&self) -> [f64; 2] {
        self.domain
    }

    /// The same curve between two parameters; its knots stay.
    ///
    /// # Errors
    /// [`CurveError::Domain`] if they are not within its domain or in the wrong order.
    pub fn on(self, domain: [f64; 2]) -> Result<Self, CurveError> {
        let domain = checked(domain, self.domain)?;
        Ok(Self { domain, ..self })
    }

    /// The number of the knot where the span of a parameter begins (TNB A2.1), which is never empty.
    fn span(&self, t: f64) -> usize {
        let last = self.points.len();
        let inner = self.knots.get(self.degree..=last).unwrap_or_default();
        let mut span = self.degree + inner.partition_point(|knot| *knot <= t).saturating_sub(1);
        // At the end of the domain, the last span before it that is not empty.
        let end = if t >= at(&self.knots, last) { t } else { f64::INFINITY };
        while span > self.degree
            && (span >= last || at(&self.knots, span) >= end || at(&self.knots, span) >= at(&self.knots, span + 1))
        {
            span -= 1;
        }
        span
    }

    fn weighted(&self, number: usize) -> Weighted {
        let weight = self.weights.as_ref().and_then(|weights| weights.get(number)).copied().unwrap_or(1.0);
        let [x, y, z] = self.points.get(number).copied().unwrap_or_default();
        [x * weight, y * weight, z * weight, weight]
    }

    /// Control points of a span, the knots around it, and as many steps of de Boor's scheme as asked for. Step `r` is done for the parameter
    /// `arguments(r)`: all the same gives points of the curve, others the blossom (Ramshaw 1987), from which knots are inserted.
    fn scheme(&self, span: usize, steps: usize, arguments: impl Fn(usize) -> f64) -> [Weighted; HIGHEST_DEGREE + 1] {
        let mut row = [[0.0; 4]; HIGHEST_DEGREE + 1];
        let first = span - self.degree.min(span);
        for (number, entry) in row.iter_mut().take(self.degree + 1).enumerate() {
            *entry = self.weighted(first + number);
        }
        for step in 1..=steps.min(self.degree) {
            let t = arguments(step);
            for place in 0..=self.degree - step {
                let low = at(&self.knots, first + step + place);
                let high = at(&self.knots, first + self.degree + 1 + place);
                let share = (t - low) / (high - low);
                if let Some([left, right]) = row.get_mut(place..place + 2) {
                    for (left, right) in left.iter_mut().zip(right) {
                        *left = (1.0 - share) * *left + share * *right;
                    }
                }
            }
        }
        row
    }

    /// The blossom of a span.
    fn blossom(&self, span: usize, arguments: impl Fn(usize) -> f64) -> Weighted {
        let [value, ..] = self.scheme(span, self.degree, arguments);
        value
    }

    /// Point and first derivative (TNB A4.1 and equation 4.8), by de Boor's scheme: its last but one step is the derivative, too. O(degree²).
    #[must_use]
    pub fn point_and_derivative(&self, t: f64) -> (Point, Point) {
        let span = self.span(t);
        let [a, b, ..] = self.scheme(span, self.degree - 1, |_| t);
        let (low, high) = (at(&self.knots, span), at(&self.knots, span + 1));
        let share = (t - low) / (high - low);
        let slope = self.degree as f64 / (high - low);
        let ([ax, ay, az, aw], [bx, by, bz, bw]) = (a, b);
        let weight = (1.0 - share) * aw + share * bw;
        let point = [(ax, bx), (ay, by), (az, bz)].each(|(a, b)| ((1.0 - share) * a + share * b) / weight);
        let change = [bx - ax, by - ay, bz - az].each(|change| change * slope);
        let derivative = scale(sub(change, scale(point, (bw - aw) * slope)), 1.0 / weight);
        (point, derivative)
    }

    /// The same way in the other direction; the parameter `t` becomes `low + high − t`.
    #[must_use]
    pub fn reversed(mut self) -> Self {
        let [low, high] = self.domain;
        self.knots.reverse();
        self.knots.iter_mut().for_each(|knot| *knot = low + (high - *knot));
        self.points.reverse();
        self.weights.iter_mut().for_each(|weights| weights.reverse());
        self
    }

    /// Its image.
    #[must_use]
    pub fn transformed(mut self, map: &Affine) -> Self {
        self.points.iter_mut().for_each(|point| *point = map.point(*point));
        self
    }

    /// Ends of its smooth pieces: of the domain, and the knots between.
    #[must_use]
    pub fn cuts(&self) -> Vec<f64> {
        let [low, high] = self.domain;
        let mut cuts = vec![low];
        cuts.extend(self.knots.iter().copied().filter(|knot| *knot > low && *knot < high));
        cuts.push(high);
        cuts.dedup();
        cuts
    }

    pub(super) fn length(&self, tolerance: f64) -> f64 {
        let cuts = self.cuts();
        // Each piece by its own span, so that a jump at its end does not count.
        length::length(|t| self.point_and_derivative(t).1, &cuts, tolerance)
    }

    /// The same curve with clamped knots on just its domain, by blossoms; exact. O(points · degree²).
    ///
    /// # Errors
    /// [`CurveError`] of numbers that overflow.
    pub fn clamped(&self) -> Result<Self, CurveError> {
        let (p, [low, high]) = (self.degree, self.domain);
        let mut knots = vec![low; p + 1];
        for knot in self.knots.iter().copied().filter(|knot| *knot > low && *knot < high) {
            // A knot of a higher multiplicity would only add points that do nothing.
            if knots.len() <= p + 1 || at(&knots, knots.len() - p - 1) != knot {
                knots.push(knot);
            }
        }
        knots.resize(knots.len() + p + 1, high);
        self.on_knots(knots)
    }

    /// The same curve with a knot more in the middle of each piece, clamped: its control points are nearer to it. O(points · degree²).
    ///
    /// # Errors
    /// [`CurveError`] of numbers that overflow.
    pub(crate) fn halved(&self) -> Result<Self, CurveError> {
        let mut knots = self.clamped()?.knots;
        knots.extend(self.cuts().windows(2).map(|pair| 0.5 * (pair[0] + pair[1])));
        knots.sort_by(f64::total_cmp);
        self.on_knots(knots)
    }

    /// The same curve on clamped knots of its domain, which have all of its own between, by blossoms; exact.
    fn on_knots(&self, knots: Vec<f64>) -> Result<Self, CurveError> {
        let p = self.degree;
        let count = knots.len() - p - 1;
        let mut weighted = Vec::with_capacity(count);
        for number in 0..count {
            let support = (number..=number + p).find(|at_| at(&knots, *at_) < at(&knots, at_ + 1)).unwrap_or(number);
            let span = self.span(0.5 * (at(&knots, support) + at(&knots, support + 1)));
            weighted.push(self.blossom(span, |step| at(&knots, number + step)));
        }
        Self::from_weighted(p, knots, &weighted)
    }

    /// Its pieces between knots as Bézier curves: where each begins and ends, and its points. O(points · degree³).
    pub(super) fn beziers(&self) -> Vec<([f64; 2], Vec<Weighted>)> {
        let cuts = self.cuts();
        let piece = |pair: &[f64]| {
            let &[a, b] = pair else { return None };
            let span = self.span(0.5 * (a + b));
            let point = |number| self.blossom(span, |step| if step <= number { b } else { a });
            Some(([a, b], (0..=self.degree).map(point).collect()))
        };
        cuts.windows(2).filter_map(piece).collect()
    }

    /// A B-spline of points that are multiplied by their weights.
    pub(super) fn from_weighted(degree: usize, knots: Vec<f64>, weighted: &[Weighted]) -> Result<Self, CurveError> {
        let points = weighted.iter().map(|&[x, y, z, w]| [x / w, y / w, z / w]).collect();
        let weights = weighted.iter().map(|&[.., w]| w).collect();
        Self::new(degree, knots, points, Some(weights), None)
    }
}

/// The knot of a number; numbers out of range never come from a spline that was checked.
fn at(knots: &[f64], number: usize) -> f64 {
    knots.get(number).copied().unwrap_or(f64::NAN)
}

/// A domain that is not empty and within another, up to rounding.
fn checked([low, high]: [f64; 2], [lowest, highest]: [f64; 2]) -> Result<[f64; 2], CurveError> {
    if lowest >= highest {
        return Err(CurveError::Knots);
    }
    let slack = 1e-9 * (highest - lowest);
    let is_within = low >= lowest - slack && high <= highest + slack;
    let domain = [low.max(lowest), high.min(highest)];
    if is_within && domain[0] < domain[1] { Ok(domain) } else { Err(CurveError::Domain) }
}
