//! Surfaces that carry curves: where the point of two parameters is, and curves in space from curves of parameters.

mod equation;
mod lift;
mod tensor;
#[cfg(test)]
mod tests;

pub(crate) use tensor::Tensor;

use crate::curves::curve::Shape;
use crate::curves::vector::{Affine, Point, add, between, scale};

/// A surface by its parameters `u` and `v`; angles are radians.
#[derive(Clone, Debug)]
pub(crate) enum Carrier {
    /// `u` and `v` are the first two coordinates.
    Plane(Affine),
    /// About the third axis: radius; `u` is the angle, `v` the height.
    Cylinder(Affine, f64),
    /// The same with a radius that grows with the height: radius at 0, growth.
    Cone(Affine, [f64; 2]),
    /// Radius; `u` is the longitude, `v` the latitude.
    Sphere(Affine, f64),
    /// Radii of the circle of centres and around it; `u` is the angle about the axis, `v` that around the circle.
    Torus(Affine, [f64; 2]),
    /// A B-spline surface.
    Tensor(Tensor),
    /// A curve that is drawn along a vector: `u` is its parameter.
    Drawn(Shape, Point),
    /// A curve that is turned about the third axis of a system: `u` is the angle, `v` its parameter.
    Turned(Affine, Shape),
    /// Straight from a curve to another one: both parameters from 0 to 1.
    Ruled([Shape; 2]),
}

impl From<Tensor> for Carrier {
    /// A plane, if the surface is a parallelogram: curves on it are exact then.
    fn from(tensor: Tensor) -> Self {
        tensor.plane().map_or(Self::Tensor(tensor), Self::Plane)
    }
}

impl Carrier {
    /// The point of two parameters. O(degree²) of B-splines.
    pub(crate) fn point(&self, u: f64, v: f64) -> Point {
        let about = |radius: f64, height: f64| [radius * u.cos(), radius * u.sin(), height];
        match self {
            Self::Plane(axes) => axes.point([u, v, 0.0]),
            Self::Cylinder(axes, radius) => axes.point(about(*radius, v)),
            Self::Cone(axes, [radius, growth]) => axes.point(about(radius + growth * v, v)),
            Self::Sphere(axes, radius) => axes.point(about(radius * v.cos(), radius * v.sin())),
            Self::Torus(axes, [far, near]) => axes.point(about(far + near * v.cos(), near * v.sin())),
            Self::Tensor(tensor) => tensor.point(u, v),
            Self::Drawn(shape, vector) => add(shape.point(u), scale(*vector, v)),
            Self::Turned(axes, shape) => axes.point(turned(shape.point(v), u)),
            Self::Ruled(shapes) => {
                let [a, b] = shapes.each_ref().map(|shape| {
                    let [low, high] = shape.domain();
                    shape.point(low + (high - low) * u)
                });
                between(a, b, v)
            }
        }
    }
}

/// A point turned about the third axis.
fn turned([x, y, z]: Point, angle: f64) -> Point {
    let (sin, cos) = angle.sin_cos();
    [x * cos - y * sin, x * sin + y * cos, z]
}
