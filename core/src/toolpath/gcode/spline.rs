//! Splines: `G5`, `G5.1`, `G5.2`, `G6.2`, as lines within a tolerance (LinuxCNC, "G-codes", G5 to G5.3; Piegl, Tiller, "The NURBS
//! Book", algorithm A4.1).

use super::block::Block;
use super::fault::{Fault, refused};
use super::interpreter::Interpreter;
use super::machine::Motion;
use super::memory::Spline;
use crate::toolpath::model::{Kind, Plane};
use crate::toolpath::vector::{Point, add, length, scale, sub};

/// Lines of a span, at most.
const LINES_MOST: usize = 4096;
/// Control points of a curve, at most.
const POINTS_MOST: usize = 100_000;
/// Order of a curve, at most.
const ORDER_MOST: usize = 16;

impl Interpreter<'_> {
    /// `G5`: a cubic of Bézier; `G5.1`: a quadratic one.
    pub(super) fn bezier(&mut self, block: &Block, is_cubic: bool) -> Result<(), Fault> {
        if self.machine.modes.plane != Plane::Xy || block.has_any(b"z") || self.compensation.is_some() {
            return refused("G5 with Z, outside of the plane X Y or with cutter compensation is not done");
        }
        let unit = self.machine.modes.unit;
        let from = self.machine.position;
        let to = self.target(block)?;
        let word = |letter| block.get(letter).map(|value| value * unit);
        let first = match (word(b'i'), word(b'j'), self.spline.last) {
            (None, None, Some(last)) if is_cubic => scale(last, -1.0),
            (None, None, _) => return refused("G5 without I, J"),
            (i, j, _) => [i.unwrap_or(0.0), j.unwrap_or(0.0), 0.0],
        };
        let first = add(from, first);
        let points = if is_cubic {
            let (Some(p), Some(q)) = (word(b'p'), word(b'q')) else { return refused("G5 without P, Q") };
            self.spline.last = Some([p, q, 0.0]);
            vec![from, first, add(to, [p, q, 0.0]), to]
        } else {
            vec![from, first, to]
        };
        self.cut(block);
        let order = points.len();
        let knots: Vec<f64> = std::iter::repeat_n(0.0, order).chain(std::iter::repeat_n(1.0, order)).collect();
        let points: Vec<(Point, f64)> = points.into_iter().map(|point| (point, 1.0)).collect();
        self.flatten(&points, &knots, order)?;
        self.line_to(Kind::Feed, to)
    }

    /// A control point of `G5.2` or `G6.2`.
    pub(super) fn control_point(&mut self, block: &Block, motion: Motion) -> Result<(), Fault> {
        if self.compensation.is_some() || block.has_any(b"z") {
            return refused("a spline (G5.2, G6.2) with Z or with cutter compensation is not done");
        }
        let is_knotted = motion == Motion::Knotted;
        let weight = block.get(if is_knotted { b'r' } else { b'p' }).unwrap_or(1.0);
        if weight <= 0.0 || !weight.is_finite() {
            return refused("a control point without a positive weight");
        }
        let position = self.machine.position;
        if self.spline.points.is_empty() && self.spline.knots.is_empty() {
            let order = block.get(if is_knotted { b'p' } else { b'l' }).unwrap_or(3.0).round();
            if !(2.0..=ORDER_MOST as f64).contains(&order) {
                return refused(format!("a spline of order {order} is not done"));
            }
            self.spline = Spline { order: order as usize, is_knotted, ..Spline::default() };
            if !is_knotted {
                self.spline.points.push((position, weight));
            }
        }
        if self.spline.points.len() >= POINTS_MOST || self.spline.knots.len() >= 2 * POINTS_MOST {
            return refused("a spline of more than 100,000 points is not done");
        }
        self.cut(block);
        if is_knotted {
            let Some(knot) = block.get(b'k') else { return refused("G6.2 without a knot (K)") };
            if self.spline.knots.last().is_some_and(|last| knot < *last) {
                return refused("knots of a spline (K) that go backwards");
            }
            self.spline.knots.push(knot);
        }
        if block.has_any(b"xyz@^") {
            // Increments count from the last control point.
            let last = self.spline.points.last().map_or(position, |(point, _)| *point);
            let before = std::mem::replace(&mut self.machine.position, last);
            let point = self.target(block);
            self.machine.position = before;
            self.spline.points.push((point?, weight));
        }
        Ok(())
    }

    /// The end of a curve.
    pub(super) fn end_spline(&mut self) -> Result<(), Fault> {
        let Spline { points, mut knots, order, is_knotted, .. } = std::mem::take(&mut self.spline);
        let Some((end, _)) = points.last().copied() else { return Ok(()) };
        if points.len() < order {
            return refused(format!("a spline of order {order} with {} control points", points.len()));
        }
        if is_knotted {
            if knots.len() != points.len() + order {
                return refused(format!(
                    "a spline of {} control points and order {order} with {} knots",
                    points.len(),
                    knots.len()
                ));
            }
        } else {
            knots = (0..points.len() + order).map(|knot| knot.clamp(order - 1, points.len()) as f64).collect();
        }
        self.flatten(&points, &knots, order)?;
        let last = if is_knotted { point(&points, &knots, order, points.len() - 1, knots[points.len()]) } else { end };
        self.line_to(Kind::Feed, last)
    }

    /// Lines along a curve, all but the last one.
    fn flatten(&mut self, points: &[(Point, f64)], knots: &[f64], order: usize) -> Result<(), Fault> {
        let tolerance = self.options.tolerance.max(1e-6);
        let start = point(points, knots, order, order - 1, knots[order - 1]);
        if length(sub(start, self.machine.position)) > tolerance {
            self.line_to(Kind::Feed, start)?;
        }
        let spans: Vec<usize> = (order - 1..points.len()).filter(|span| knots[*span] < knots[span + 1]).collect();
        for span in spans {
            let (low, high) = (knots[span], knots[span + 1]);
            let at = |part: f64| point(points, knots, order, span, low + (high - low) * part);
            let lines = lines_of(&at, tolerance);
            for line in 1..=lines {
                let to = at(line as f64 / lines as f64);
                if span + 1 < points.len() || line < lines {
                    self.line_to(Kind::Feed, to)?;
                }
            }
        }
        Ok(())
    }
}

/// How many lines keep a span within a tolerance: the distance of a chord from its curve falls with the square of their number.
fn lines_of(at: &impl Fn(f64) -> Point, tolerance: f64) -> usize {
    const TRIED: usize = 8;
    let off = |line: usize| {
        let [a, m, b] = [0.0, 0.5, 1.0].map(|part| at((line as f64 + part) / TRIED as f64));
        length(sub(m, scale(add(a, b), 0.5)))
    };
    let worst = (0..TRIED).map(off).fold(0.0, f64::max);
    let lines = TRIED as f64 * (1.25 * worst / tolerance).sqrt();
    // A deviation that is no number gets the fewest lines.
    (lines.ceil() as usize).clamp(2, LINES_MOST).next_multiple_of(2)
}

/// A point of a rational B-spline in a span, by de Boor's algorithm. O(order²).
fn point(points: &[(Point, f64)], knots: &[f64], order: usize, span: usize, at: f64) -> Point {
    let degree = order - 1;
    let mut local = [[0.0; 4]; ORDER_MOST];
    for (local, (point, weight)) in local.iter_mut().zip(&points[span - degree..=span]) {
        *local = [point[0] * weight, point[1] * weight, point[2] * weight, *weight];
    }
    for round in 1..=degree {
        for index in (round..=degree).rev() {
            let left = knots[span - degree + index];
            let right = knots[span + 1 + index - round];
            let part = if right > left { (at - left) / (right - left) } else { 0.0 };
            local[index] = std::array::from_fn(|axis| local[index - 1][axis] * (1.0 - part) + local[index][axis] * part);
        }
    }
    let [x, y, z, weight] = local[degree];
    [x / weight, y / weight, z / weight]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quarter of the unit circle is a rational quadratic with the middle weight √½.
    #[test]
    fn a_rational_curve_is_a_circle() {
        let points = [([1.0, 0.0, 0.0], 1.0), ([1.0, 1.0, 0.0], 0.5f64.sqrt()), ([0.0, 1.0, 0.0], 1.0)];
        let knots = [0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
        for step in 0..=10 {
            let [x, y, _] = point(&points, &knots, 3, 2, f64::from(step) / 10.0);
            assert!((x.hypot(y) - 1.0).abs() < 1e-14);
        }
    }
}
