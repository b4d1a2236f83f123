//! Curves beside other curves.
//!
//! The point of an offset curve is `C(t) + f · V × T(t)`, both vectors of length 1: `V` is normal to the plane of the curve, `T`
//! its tangent (IGES 5.3, type 130; ISO 10303-42, offset_curve_3d). Lines and circles give lines and circles; others are fitted.

use super::arc::Arc;
use super::error::CurveError;
use super::fit::fit;
use super::lengths::Lengths;
use super::shape::Shape;
use super::spline::Spline;
use crate::curves::vector::{Point, add, cross, distance, norm, scale, unit};

/// How far an offset curve is away.
#[derive(Clone, Debug)]
pub(crate) enum Away {
    /// The same everywhere.
    Constant(f64),
    /// `distances[0]` at `at[0]`, `distances[1]` at `at[1]`, linear between and beyond.
    Linear {
        /// Distances.
        distances: [f64; 2],
        /// Parameters or lengths.
        at: [f64; 2],
    },
    /// A coordinate of a curve.
    Coordinate(Shape, usize),
}

/// An offset curve but for the curve that it goes beside.
#[derive(Clone, Debug)]
pub(crate) struct Offset {
    /// Normal of the plane; any length but 0.
    pub(crate) normal: Point,
    /// The distance.
    pub(crate) away: Away,
    /// Whether it depends on the length from the beginning of the curve, not on the parameter.
    pub(crate) by_length: bool,
    /// Parameters between which the curve is wanted; of all of it if not.
    pub(crate) between: Option<[f64; 2]>,
}

/// A smooth part of a curve: the parameter of the whole where it begins, and the length before it.
struct Leaf {
    shape: Shape,
    start: f64,
    before: f64,
}

impl Away {
    fn at(&self, s: f64) -> f64 {
        match self {
            Self::Constant(distance) => *distance,
            Self::Linear { distances: [d, e], at: [a, b] } if a != b => d + (e - d) * (s - a) / (b - a),
            Self::Linear { distances, .. } => distances[0],
            Self::Coordinate(shape, axis) => shape.point(s).get(*axis).copied().unwrap_or_default(),
        }
    }
}

impl Offset {
    /// The curve beside another one; how far off it may be, if it is fitted. `tolerance` is for what is fitted.
    ///
    /// The parameter of curves one behind the other is the sum of their own, from 0 on.
    ///
    /// # Errors
    /// [`CurveError`] of a curve that shrinks to a point, or runs along the normal.
    pub(crate) fn of(&self, shape: &Shape, tolerance: f64) -> Result<(Shape, Option<f64>), CurveError> {
        let normal = unit(self.normal).ok_or(CurveError::Degenerate("an offset without a plane"))?;
        let mut parts = Vec::new();
        let mut worst: Option<f64> = None;
        for leaf in leaves(shape, self.by_length)? {
            let [low, high] = leaf.shape.domain();
            let wanted = self.between.map_or([low, high], |ends| ends.map(|t| (low + (t - leaf.start)).clamp(low, high)));
            if wanted[0] >= wanted[1] {
                continue;
            }
            let lengths = self.by_length.then(|| Lengths::of(&leaf.shape));
            let s = |t: f64| match &lengths {
                Some(lengths) => leaf.before + lengths.at(&leaf.shape, t),
                None => leaf.start + (t - low),
            };
            let away = |t: f64| self.away.at(s(t));
            match self.exact(&leaf.shape, normal, wanted, away)? {
                Some(exact) => parts.push(exact),
                None => {
                    let (spline, off) = fitted(&leaf.shape, normal, wanted, away, tolerance)?;
                    worst = Some(worst.unwrap_or(0.0).max(off));
                    parts.push(Shape::Spline(spline));
                }
            }
        }
        let composite = Shape::composite(parts).map_err(|_| CurveError::Degenerate("an offset of nothing"))?;
        Ok((composite, worst))
    }

    /// Lines with distances that grow evenly, and circles with the same one everywhere.
    fn exact(
        &self,
        shape: &Shape,
        normal: Point,
        wanted: [f64; 2],
        away: impl Fn(f64) -> f64,
    ) -> Result<Option<Shape>, CurveError> {
        let is_constant = matches!(self.away, Away::Constant(_));
        match shape {
            Shape::Line(_) if !matches!(self.away, Away::Coordinate(..)) => {
                let ends = wanted.map(|t| beside(shape, normal, t, away(t)));
                match ends {
                    [Some(a), Some(b)] if a != b => Ok(Some(Shape::Line([a, b]))),
                    _ => Err(CurveError::Degenerate("an offset along its normal")),
                }
            }
            Shape::Arc(arc) if is_constant && is_level(arc, normal) => {
                let radius = arc.radii()[0];
                let towards = crate::curves::vector::dot(cross(arc.axes[0], arc.axes[1]), normal).signum();
                let factor = (radius - towards * away(wanted[0])) / radius;
                if factor.abs() < 1e-12 {
                    return Err(CurveError::Degenerate("an offset circle without radius"));
                }
                Ok(Some(Shape::Arc(Arc { axes: arc.axes.map(|axis| scale(axis, factor)), angles: wanted, ..*arc })))
            }
            _ => Ok(None),
        }
    }
}

/// Whether an arc is of a circle in the plane of a normal.
fn is_level(arc: &Arc, normal: Point) -> bool {
    let own = cross(arc.axes[0], arc.axes[1]);
    arc.is_round(1e-9) && norm(cross(own, normal)) <= 1e-9 * norm(own)
}

/// The point beside a curve; nothing where it has no tangent across the normal.
fn beside(shape: &Shape, normal: Point, t: f64, away: f64) -> Option<Point> {
    let (point, derivative) = shape.point_and_derivative(t);
    Some(add(point, scale(unit(cross(normal, derivative))?, away)))
}

fn fitted(
    shape: &Shape,
    normal: Point,
    [low, high]: [f64; 2],
    away: impl Fn(f64) -> f64,
    tolerance: f64,
) -> Result<(Spline, f64), CurveError> {
    let mut cuts = vec![low];
    if let Shape::Conic(spline) | Shape::Spline(spline) = shape {
        cuts.extend(spline.cuts().into_iter().filter(|cut| *cut > low && *cut < high));
    }
    cuts.push(high);
    // Where the tangent vanishes, points that are no numbers end it.
    fit(|t| beside(shape, normal, t, away(t)).unwrap_or([f64::NAN; 3]), &cuts, tolerance)
}

/// A curve as smooth parts one behind the other. O(its size).
fn leaves(shape: &Shape, by_length: bool) -> Result<Vec<Leaf>, CurveError> {
    let mut parts = Vec::new();
    let start = match shape {
        Shape::Composite(all) => {
            for part in all {
                smooth(part, &mut parts)?;
            }
            0.0
        }
        single => {
            smooth(single, &mut parts)?;
            single.domain()[0]
        }
    };
    let (mut start, mut before) = (start, 0.0);
    let mut leaves = Vec::with_capacity(parts.len());
    for shape in parts {
        let [low, high] = shape.domain();
        let length = if by_length { Lengths::of(&shape).whole() } else { 0.0 };
        leaves.push(Leaf { shape, start, before });
        start += high - low;
        before += length;
    }
    Ok(leaves)
}

fn smooth(shape: &Shape, parts: &mut Vec<Shape>) -> Result<(), CurveError> {
    match shape {
        Shape::Polyline(points) => {
            parts.extend(points.windows(2).filter_map(|pair| if let &[a, b] = pair { Some(Shape::Line([a, b])) } else { None }));
        }
        Shape::Spline(spline) => {
            let [low, high] = spline.domain();
            let mut cuts = vec![low];
            cuts.extend(spline.cuts().into_iter().filter(|cut| *cut > low && *cut < high && has_corner(spline, *cut)));
            cuts.push(high);
            for pair in cuts.windows(2) {
                let &[a, b] = pair else { continue };
                // Clamped, so that the tangent at the end is that of the part.
                parts.push(Shape::Spline(if cuts.len() == 2 { spline.clone() } else { spline.clone().on([a, b])?.clamped()? }));
            }
        }
        other => parts.push(other.clone()),
    }
    Ok(())
}

/// Whether the tangent jumps at a knot.
fn has_corner(spline: &Spline, knot: f64) -> bool {
    let count = spline.knots().iter().filter(|other| **other == knot).count();
    if count < spline.degree() {
        return false;
    }
    let [low, high] = spline.domain();
    let step = 1e-7 * (high - low);
    let [before, after] = [knot - step, knot + step].map(|t| unit(spline.point_and_derivative(t).1));
    match (before, after) {
        (Some(before), Some(after)) => distance(before, after) > 1e-4,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curves::curve::conic;

    fn offset(away: Away, by_length: bool) -> Offset {
        Offset { normal: [0.0, 0.0, 2.0], away, by_length, between: None }
    }

    /// To the left, as seen against the normal: up from a line to the right, inward from a circle that runs anticlockwise.
    #[test]
    fn lines_and_circles_stay_what_they_are() {
        let line = Shape::Line([[0.0; 3], [4.0, 0.0, 0.0]]);
        let (beside, off) = offset(Away::Constant(1.5), false).of(&line, 1e-9).unwrap();
        assert_eq!((beside, off), (Shape::Line([[0.0, 1.5, 0.0], [4.0, 1.5, 0.0]]), None));
        let linear = Away::Linear { distances: [0.0, 2.0], at: [0.0, 4.0] };
        let (beside, _) = offset(linear, true).of(&line, 1e-9).unwrap();
        assert_eq!(beside.ends(), [[0.0; 3], [4.0, 2.0, 0.0]]);
        let arc = Arc::new([0.0; 3], [[3.0, 0.0, 0.0], [0.0, 3.0, 0.0]], [0.0, 1.0]).unwrap();
        let (beside, off) = offset(Away::Constant(1.0), false).of(&Shape::Arc(arc), 1e-9).unwrap();
        assert!(off.is_none() && (norm(beside.point(0.5)) - 2.0).abs() < 1e-15);
        let flat = offset(Away::Constant(3.0), false).of(&Shape::Arc(arc), 1e-9);
        assert!(flat.is_err());
    }

    /// Distances from an ellipse and a parabola, at points that are nearest; a polyline gives two lines.
    #[test]
    fn others_are_fitted() {
        let ellipse = Shape::Arc(Arc::new([0.0; 3], [[3.0, 0.0, 0.0], [0.0, 2.0, 0.0]], [0.0, 0.0]).unwrap());
        let parabola = conic([1.0, 0.0, 0.0, 0.0, -4.0, 0.0], 0.0, [[-2.0, 1.0], [4.0, 4.0]]).unwrap();
        for base in [ellipse, parabola] {
            let (beside, off) = offset(Away::Constant(-0.5), false).of(&base, 1e-7).unwrap();
            assert!(off.unwrap() <= 1e-7);
            let [low, high] = beside.domain();
            for number in 0..=50 {
                let t = low + (high - low) * f64::from(number) / 50.0;
                // Both have the same parameter.
                assert!((distance(beside.point(t), base.point(t)) - 0.5).abs() < 1e-6);
            }
        }
        let path = Shape::polyline(vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]).unwrap();
        let (beside, _) = offset(Away::Constant(0.1), false).of(&path, 1e-7).unwrap();
        assert_eq!(beside.ends(), [[0.0, 0.1, 0.0], [0.9, 1.0, 0.0]]);
        let part = Offset { between: Some([1.0, 1.5]), ..offset(Away::Constant(0.1), false) };
        assert_eq!(part.of(&path, 1e-7).unwrap().0, Shape::Line([[0.9, 0.0, 0.0], [0.9, 0.5, 0.0]]));
    }

    /// A spiral: the distance from a circle of radius 1 grows with its length.
    #[test]
    fn distances_grow_with_the_length() {
        let circle = Shape::Arc(Arc::new([0.0; 3], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [0.5, 2.5]).unwrap());
        let linear = Away::Linear { distances: [0.0, -1.0], at: [0.0, 1.0] };
        let (spiral, off) = offset(linear, true).of(&circle, 1e-9).unwrap();
        assert!(off.unwrap() <= 1e-9);
        for t in [0.5, 1.0, 2.0, 2.5] {
            assert!((norm(spiral.point(t)) - (1.0 + t - 0.5)).abs() < 1e-8);
        }
        // The height of a line over its parameter is the same function.
        let height = Away::Coordinate(Shape::Line([[0.0; 3], [0.0, 0.0, -1.0]]), 2);
        let line = Shape::Line([[0.0; 3], [1.0, 0.0, 0.0]]);
        let (beside, _) = offset(height, false).of(&line, 1e-9).unwrap();
        assert!(distance(beside.ends()[1], [1.0, -1.0, 0.0]) < 1e-12);
    }
}
