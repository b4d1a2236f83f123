//! The shape of a curve, and the questions that can be asked of it.

use super::arc::Arc;
use super::error::CurveError;
use super::length;
use super::spline::Spline;
use crate::curves::vector::{Affine, Point, add, between, distance, is_finite, scale, sub};

/// The shape of a curve.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Shape {
    /// From one point straight to another; parameter 0 to 1.
    Line([Point; 2]),
    /// Of a circle or an ellipse; its parameter is the angle in radians.
    Arc(Arc),
    /// Of a parabola or a hyperbola, as an exact rational B-spline.
    Conic(Spline),
    /// Any B-spline, rational or not.
    Spline(Spline),
    /// Straight from point to point; the parameter of point `i` is `i`.
    Polyline(Vec<Point>),
    /// Curves one behind the other; the parameter of the `i`th is `i` to `i + 1`. Never one within another.
    Composite(Vec<Shape>),
}

impl Shape {
    /// A word for what it is.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Line(_) => "line",
            Self::Arc(arc) if arc.is_circular() => "circle",
            Self::Arc(_) => "ellipse",
            Self::Conic(_) => "conic",
            Self::Spline(_) => "B-spline",
            Self::Polyline(_) => "polyline",
            Self::Composite(_) => "composite",
        }
    }

    /// Curves one behind the other as one; composites among them are taken apart.
    ///
    /// # Errors
    /// [`CurveError::Degenerate`] of none.
    pub fn composite(parts: Vec<Self>) -> Result<Self, CurveError> {
        let mut flat = Vec::with_capacity(parts.len());
        for part in parts {
            match part {
                Self::Composite(inner) => flat.extend(inner),
                other => flat.push(other),
            }
        }
        match flat.len() {
            0 => Err(CurveError::Degenerate("a composite of nothing")),
            1 => flat.pop().ok_or(CurveError::Degenerate("a composite of nothing")),
            _ => Ok(Self::Composite(flat)),
        }
    }

    /// A polyline.
    ///
    /// # Errors
    /// [`CurveError`] of less than two points, and of numbers that are not finite.
    pub fn polyline(points: Vec<Point>) -> Result<Self, CurveError> {
        if !points.iter().copied().all(is_finite) {
            return Err(CurveError::NotFinite);
        }
        match points.as_slice() {
            [] | [_] => Err(CurveError::Degenerate("a polyline of less than two points")),
            &[a, b] => Ok(Self::Line([a, b])),
            _ => Ok(Self::Polyline(points)),
        }
    }

    /// Lowest and highest parameter.
    #[must_use]
    pub fn domain(&self) -> [f64; 2] {
        match self {
            Self::Line(_) => [0.0, 1.0],
            Self::Arc(arc) => arc.angles,
            Self::Conic(spline) | Self::Spline(spline) => spline.domain(),
            Self::Polyline(points) => [0.0, points.len().saturating_sub(1) as f64],
            Self::Composite(parts) => [0.0, parts.len() as f64],
        }
    }

    /// The point at a parameter, which is moved into the domain. O(degree² + log knots).
    #[must_use]
    pub fn point(&self, t: f64) -> Point {
        self.point_and_derivative(t).0
    }

    /// The first derivative by the parameter; from the right where it jumps, but for the end of the domain. O(degree² + log knots).
    #[must_use]
    pub fn derivative(&self, t: f64) -> Point {
        self.point_and_derivative(t).1
    }

    /// Point and first derivative.
    #[must_use]
    pub fn point_and_derivative(&self, t: f64) -> (Point, Point) {
        let [low, high] = self.domain();
        let t = if t >= low { t.min(high) } else { low };
        match self {
            &Self::Line([a, b]) => (between(a, b, t), sub(b, a)),
            Self::Arc(arc) => (arc.point(t), arc.derivative(t)),
            Self::Conic(spline) | Self::Spline(spline) => spline.point_and_derivative(t),
            Self::Polyline(points) => {
                let (at, rest) = piece(t, points.len().saturating_sub(1));
                match points.get(at..at + 2) {
                    Some(&[a, b]) => (between(a, b, rest), sub(b, a)),
                    _ => (points.first().copied().unwrap_or_default(), [0.0; 3]),
                }
            }
            Self::Composite(parts) => {
                let (at, rest) = piece(t, parts.len());
                let Some(part) = parts.get(at) else { return ([0.0; 3], [0.0; 3]) };
                let [low, high] = part.domain();
                let t = if rest >= 1.0 { high } else { low + (high - low) * rest };
                let (point, derivative) = part.point_and_derivative(t);
                (point, scale(derivative, high - low))
            }
        }
    }

    /// Where it begins and ends.
    #[must_use]
    pub fn ends(&self) -> [Point; 2] {
        match self {
            Self::Line(ends) => *ends,
            Self::Composite(parts) => {
                let first = parts.first().map_or([0.0; 3], |part| part.ends()[0]);
                [first, parts.last().map_or(first, |part| part.ends()[1])]
            }
            _ => self.domain().map(|t| self.point(t)),
        }
    }

    /// The same way in the other direction.
    #[must_use]
    pub fn reversed(self) -> Self {
        match self {
            Self::Line([a, b]) => Self::Line([b, a]),
            Self::Arc(arc) => Self::Arc(arc.reversed()),
            Self::Conic(spline) => Self::Conic(spline.reversed()),
            Self::Spline(spline) => Self::Spline(spline.reversed()),
            Self::Polyline(mut points) => {
                points.reverse();
                Self::Polyline(points)
            }
            Self::Composite(parts) => Self::Composite(parts.into_iter().rev().map(Self::reversed).collect()),
        }
    }

    /// Its image under an affine map; exact but for rounding.
    #[must_use]
    pub fn transformed(self, map: &Affine) -> Self {
        if *map == Affine::IDENTITY {
            return self;
        }
        match self {
            Self::Line(ends) => Self::Line(ends.map(|end| map.point(end))),
            Self::Arc(arc) => Self::Arc(arc.transformed(map)),
            Self::Conic(spline) => Self::Conic(spline.transformed(map)),
            Self::Spline(spline) => Self::Spline(spline.transformed(map)),
            Self::Polyline(points) => Self::Polyline(points.into_iter().map(|point| map.point(point)).collect()),
            Self::Composite(parts) => Self::Composite(parts.into_iter().map(|part| part.transformed(map)).collect()),
        }
    }

    /// Its length, up to `tolerance` (in the file's unit) if that is not below what rounding allows. O(spans · degree²) of smooth curves;
    /// at most 512 intervals for each span.
    #[must_use]
    pub fn length(&self, tolerance: f64) -> f64 {
        match self {
            &Self::Line([a, b]) => distance(a, b),
            Self::Polyline(points) => points.windows(2).map(|pair| if let &[a, b] = pair { distance(a, b) } else { 0.0 }).sum(),
            Self::Arc(arc) if arc.is_round(1e-14) => arc.radii()[0] * (arc.angles[1] - arc.angles[0]),
            Self::Arc(arc) => length::length(|t| arc.derivative(t), &arc.quarters(), tolerance),
            Self::Conic(spline) | Self::Spline(spline) => spline.length(tolerance),
            Self::Composite(parts) => parts.iter().map(|part| part.length(tolerance / parts.len() as f64)).sum(),
        }
    }

    /// Numbers that it holds, for bounds of memory.
    #[must_use]
    pub fn size(&self) -> u64 {
        match self {
            Self::Line(_) => 6,
            Self::Arc(_) => 12,
            Self::Conic(spline) | Self::Spline(spline) => 5 * spline.points().len() as u64,
            Self::Polyline(points) => 3 * points.len() as u64,
            Self::Composite(parts) => parts.iter().map(Self::size).sum(),
        }
    }

    /// Corners of a box around it: of control points, so it may be too large.
    #[must_use]
    pub fn bounds(&self) -> [Point; 2] {
        let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        self.extend(&mut bounds);
        bounds
    }

    fn extend(&self, bounds: &mut [Point; 2]) {
        match self {
            Self::Line(ends) => ends.iter().for_each(|&end| widen(bounds, end)),
            Self::Arc(arc) => {
                let reach = add(arc.axes[0].map(f64::abs), arc.axes[1].map(f64::abs));
                widen(bounds, sub(arc.centre, reach));
                widen(bounds, add(arc.centre, reach));
            }
            Self::Conic(spline) | Self::Spline(spline) => spline.points().iter().for_each(|&point| widen(bounds, point)),
            Self::Polyline(points) => points.iter().for_each(|&point| widen(bounds, point)),
            Self::Composite(parts) => parts.iter().for_each(|part| part.extend(bounds)),
        }
    }
}

/// Widens a box so that a point is in it.
pub(crate) fn widen([low, high]: &mut [Point; 2], point: Point) {
    for ((low, high), x) in low.iter_mut().zip(high).zip(point) {
        *low = low.min(x);
        *high = high.max(x);
    }
}

/// Which of so many pieces a parameter falls into, and where there (0 to 1).
fn piece(t: f64, count: usize) -> (usize, f64) {
    // A cast of a float cuts off and saturates, and `t` is not negative.
    let at = (t as usize).min(count.saturating_sub(1));
    (at, t - at as f64)
}
