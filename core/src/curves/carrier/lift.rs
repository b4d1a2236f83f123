//! Curves in space from curves of parameters: exact on planes and along the parameters of other surfaces, fitted elsewhere.

use super::{Carrier, turned};
use crate::curves::curve::{Arc, CurveError, Shape, fit, widen};
use crate::curves::vector::{Affine, Point, add, distance, scale};

/// Places of a curve of parameters where it is seen whether it leaves its surface.
const SAMPLES: u32 = 64;

/// Curves in space one behind the other, and how far off those are that are fitted.
#[derive(Clone, Debug)]
pub(crate) struct Lifted {
    /// Their shapes; none of what is a point in space.
    pub(crate) shapes: Vec<Shape>,
    /// The largest distance, if anything is fitted.
    pub(crate) off: Option<f64>,
}

impl Carrier {
    /// The curve in space of one in the space of parameters, whose `x` and `y` are `u` and `v`. What is not longer than
    /// `tolerance` is a point: of a side of the surface that shrinks.
    ///
    /// # Errors
    /// [`CurveError`] of numbers that overflow.
    pub(crate) fn lift(&self, shape: &Shape, tolerance: f64) -> Result<Lifted, CurveError> {
        let mut lifted = Lifted { shapes: Vec::new(), off: None };
        match (self, shape) {
            // Any curve has an exact image under an affine map.
            (Self::Plane(axes), Shape::Composite(parts)) => {
                lifted.shapes.extend(parts.iter().map(|part| part.clone().transformed(axes)));
            }
            (Self::Plane(axes), _) => lifted.shapes.push(shape.clone().transformed(axes)),
            (_, Shape::Composite(parts)) => parts.iter().try_for_each(|part| self.add(part, tolerance, &mut lifted))?,
            (_, Shape::Polyline(points)) => points.windows(2).try_for_each(|pair| match pair {
                &[a, b] => self.add(&Shape::Line([a, b]), tolerance, &mut lifted),
                _ => Ok(()),
            })?,
            _ => self.add(shape, tolerance, &mut lifted)?,
        }
        lifted.shapes.retain(|shape| {
            let [low, high] = shape.bounds();
            distance(low, high) > tolerance
        });
        Ok(lifted)
    }

    /// How far points of a curve of parameters are from its beginning, in space, at most; by 17 of them.
    pub(crate) fn size(&self, shape: &Shape) -> f64 {
        let [low, high] = shape.domain();
        let at = |number: u32| {
            let [u, v, _] = shape.point(low + (high - low) * f64::from(number) / 16.0);
            self.point(u, v)
        };
        let start = at(0);
        (1..=16).map(|number| distance(at(number), start)).fold(0.0, f64::max)
    }

    fn add(&self, shape: &Shape, tolerance: f64, lifted: &mut Lifted) -> Result<(), CurveError> {
        if let Self::Tensor(tensor) = self
            && !tensor.has(reach(shape))
        {
            return Err(CurveError::Domain);
        }
        let straight = straight(shape);
        if let Some(ends) = straight
            && let Some(exact) = self.along(ends)?
        {
            lifted.shapes.push(exact);
            return Ok(());
        }
        let [low, high] = shape.domain();
        let mut cuts = vec![low];
        if let Shape::Conic(spline) | Shape::Spline(spline) = shape {
            cuts.extend(spline.cuts().into_iter().filter(|cut| *cut > low && *cut < high));
        }
        cuts.push(high);
        let at = |t: f64| {
            let [u, v, _] = shape.point(t);
            self.point(u, v)
        };
        let (spline, off) = fit(at, &cuts, tolerance)?;
        lifted.shapes.push(Shape::Spline(spline));
        lifted.off = Some(lifted.off.unwrap_or(0.0).max(off));
        Ok(())
    }

    /// The curve of a straight one along one of both parameters; nothing if it is not so, or there is no exact one.
    fn along(&self, [from, to]: [[f64; 2]; 2]) -> Result<Option<Shape>, CurveError> {
        let ([u0, v0], [u1, v1]) = (from, to);
        let line = |_: ()| Shape::Line([self.point(u0, v0), self.point(u1, v1)]);
        let round = |axes: &Affine, radius: f64, height: f64| circle(axes, [radius, 0.0, height], [u0, u1]);
        match self {
            Self::Cylinder(..) | Self::Cone(..) | Self::Drawn(..) if u0 == u1 => Ok(Some(line(()))),
            Self::Ruled(..) if u0 == u1 => Ok(Some(line(()))),
            Self::Cylinder(axes, radius) if v0 == v1 => round(axes, *radius, v0),
            Self::Cone(axes, [radius, growth]) if v0 == v1 => round(axes, radius + growth * v0, v0),
            Self::Sphere(axes, radius) if v0 == v1 => round(axes, radius * v0.cos(), radius * v0.sin()),
            Self::Torus(axes, [far, near]) if v0 == v1 => round(axes, far + near * v0.cos(), near * v0.sin()),
            Self::Sphere(axes, radius) if u0 == u1 => meridian(axes, [0.0, *radius], u0, [v0, v1]),
            Self::Torus(axes, [far, near]) if u0 == u1 => meridian(axes, [*far, *near], u0, [v0, v1]),
            Self::Turned(axes, shape) if v0 == v1 => circle(axes, shape.point(v0), [u0, u1]),
            Self::Tensor(tensor) if u0 == u1 || v0 == v1 => {
                let (along, at, ends) = if u0 == u1 { (1, u0, [v0, v1]) } else { (0, v0, [u0, u1]) };
                let whole = Shape::Spline(tensor.line(along, at)?);
                // Across a seam it is no part of this curve.
                part(whole, ends).or_else(|error| if error == CurveError::Domain { Ok(None) } else { Err(error) })
            }
            Self::Drawn(shape, vector) if v0 == v1 => {
                let shift = Affine { shift: scale(*vector, v0), ..Affine::IDENTITY };
                part(shape.clone().transformed(&shift), [u0, u1])
            }
            Self::Turned(axes, shape) if u0 == u1 => {
                let [x, y] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(|axis| turned(axis, u0));
                let turn = Affine::from_axes([x, y, [0.0, 0.0, 1.0]], [0.0; 3]);
                part(shape.clone().transformed(&axes.after(&turn)), [v0, v1])
            }
            _ => Ok(None),
        }
    }
}

/// A box around points of a curve; that of its control points may be far larger.
fn reach(shape: &Shape) -> [Point; 2] {
    let [low, high] = shape.domain();
    let mut reach = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for number in 0..=SAMPLES {
        widen(&mut reach, shape.point(low + (high - low) * f64::from(number) / f64::from(SAMPLES)));
    }
    reach
}

/// Ends of a curve of parameters that is straight, as a line or a B-spline of two points.
fn straight(shape: &Shape) -> Option<[[f64; 2]; 2]> {
    let is_straight = match shape {
        Shape::Line(_) => true,
        Shape::Spline(spline) => {
            let points = spline.points();
            let same = |axis: usize| {
                points
                    .windows(2)
                    .all(|pair| pair.iter().all(|point| point.get(axis) == points.first().and_then(|first| first.get(axis))))
            };
            // With more points it may turn back on its way.
            let is_forth = |axis: usize| {
                points.is_sorted_by_key(|point| point.get(axis).copied())
                    || points.iter().rev().is_sorted_by_key(|point| point.get(axis).copied())
            };
            (same(0) && is_forth(1)) || (same(1) && is_forth(0))
        }
        _ => false,
    };
    is_straight.then(|| shape.ends().map(|[u, v, _]| [u, v]))
}

/// The part of a curve from one parameter to another, whichever is greater.
fn part(shape: Shape, [from, to]: [f64; 2]) -> Result<Option<Shape>, CurveError> {
    if from == to {
        return Ok(None);
    }
    let part = shape.part([from.min(to), from.max(to)])?;
    Ok(Some(if from < to { part } else { part.reversed() }))
}

/// The arc of a point that is turned about the third axis.
fn circle(axes: &Affine, [x, y, z]: Point, [from, to]: [f64; 2]) -> Result<Option<Shape>, CurveError> {
    let first = axes.vector([x, y, 0.0]);
    let second = axes.vector([-y, x, 0.0]);
    swept(axes.point([0.0, 0.0, z]), [first, second], [from, to])
}

/// The arc of a circle about a point at a distance from the third axis, in the plane of a longitude.
fn meridian(axes: &Affine, [far, near]: [f64; 2], longitude: f64, ends: [f64; 2]) -> Result<Option<Shape>, CurveError> {
    let out = axes.vector(turned([1.0, 0.0, 0.0], longitude));
    let up = axes.vector([0.0, 0.0, 1.0]);
    swept(add(axes.shift, scale(out, far)), [scale(out, near), scale(up, near)], ends)
}

/// An arc from one angle to another, whichever is greater; nothing of one that is a point, or that goes round more than once.
fn swept(centre: Point, axes: [Point; 2], [from, to]: [f64; 2]) -> Result<Option<Shape>, CurveError> {
    let turn = (to - from).abs();
    if turn == 0.0 || turn > std::f64::consts::TAU * (1.0 + 1e-9) {
        return Ok(None);
    }
    let arc = Arc { centre, axes, angles: [from.min(to), from.max(to)] };
    Ok(Some(Shape::Arc(if from < to { arc } else { arc.reversed() })))
}
