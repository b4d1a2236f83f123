//! Surfaces by their parameters that have an equation.

use super::Carrier;
use crate::curves::curve::{Arc, Shape};
use crate::curves::elementary::{Elementary, Frame, Told};
use crate::curves::vector::{Affine, Point, cross, distance, dot, norm, sub, unit};

/// Lengths and angles below this, in sizes, are rounding of files.
const NOTHING: f64 = 1e-9;

impl Carrier {
    /// The surface without bounds, whose boundary has it to its left as seen along the surface's normal backwards (`∂u × ∂v`, turned over if
    /// `is_same` is false). `None` of surfaces that are no plane, cylinder, cone, sphere or torus, and of tori that cross themselves. O(1).
    pub(crate) fn told(&self, is_same: bool) -> Option<Told> {
        let surface = match self {
            Self::Plane(axes) => Some(Elementary::Plane(frame(axes)?)),
            Self::Cylinder(axes, radius) => Some(Elementary::Cylinder { frame: frame(axes)?, radius: *radius }),
            Self::Cone(axes, [radius, growth]) => cone(&frame(axes)?, *radius, *growth),
            Self::Sphere(axes, radius) => Some(Elementary::Sphere { frame: frame(axes)?, radius: *radius }),
            Self::Torus(axes, [major, minor]) => {
                (major > minor).then_some(Elementary::Torus { frame: frame(axes)?, major: *major, minor: *minor })
            }
            Self::Turned(axes, shape) => turned(&frame(axes)?, shape),
            Self::Tensor(_) | Self::Drawn(..) | Self::Ruled(_) => None,
        }?;
        let is_outward = dot(self.natural()?, surface.normal(self.point(self.sample()[0], self.sample()[1]))?) > 0.0;
        Some(Told { surface, is_left: Some(is_outward == is_same) })
    }

    /// Parameters of a point that is no pole and no apex.
    fn sample(&self) -> [f64; 2] {
        match self {
            Self::Cone(_, [radius, growth]) => [0.5, if *growth == 0.0 { 0.0 } else { (radius.abs() + 1.0 - radius) / growth }],
            Self::Turned(_, shape) => {
                let [low, high] = shape.domain();
                [0.5, low + 0.437 * (high - low)]
            }
            _ => [0.5, 0.3],
        }
    }

    /// A vector along `∂u × ∂v` at the sample.
    fn natural(&self) -> Option<Point> {
        let [u, v] = self.sample();
        let step = 1e-4 * if let Self::Turned(_, shape) = self { shape.domain()[1] - shape.domain()[0] } else { 1.0 };
        let along = sub(self.point(u + 1e-4, v), self.point(u - 1e-4, v));
        let across = sub(self.point(u, v + step), self.point(u, v - step));
        unit(cross(unit(along)?, unit(across)?))
    }
}

/// Axes at right angles, of length 1.
fn frame(axes: &Affine) -> Option<Frame> {
    let [x, y, z] = axes.columns();
    let is_right = distance(cross(z, x), y) <= NOTHING && (norm(x) - 1.0).abs() <= NOTHING && (norm(z) - 1.0).abs() <= NOTHING;
    is_right.then_some(Frame { origin: axes.shift, axes: [x, y, z] })
}

/// A cone by its radius at the height 0 and how that grows.
fn cone(frame: &Frame, radius: f64, growth: f64) -> Option<Elementary> {
    if growth.abs() <= NOTHING {
        return (radius > 0.0).then_some(Elementary::Cylinder { frame: *frame, radius });
    }
    Some(Elementary::cone(frame.outside([0.0, 0.0, -radius / growth]), frame, growth))
}

/// A straight line or a circle in a plane with the axis, turned about it.
fn turned(frame: &Frame, shape: &Shape) -> Option<Elementary> {
    match shape {
        Shape::Line([from, to]) => {
            let ([x, y, low], [u, v, high]) = (*from, *to);
            let (near, far, size) = (x.hypot(y), u.hypot(v), distance(*from, *to));
            // In a plane with the axis, both to the same side of it.
            let is_flat = (x * v - y * u).abs() <= NOTHING * size * (near + far) && x * u + y * v >= 0.0;
            if !is_flat || size == 0.0 {
                return None;
            }
            if (high - low).abs() <= NOTHING * size {
                let origin = frame.outside([0.0, 0.0, low]);
                return Some(Elementary::Plane(Frame { origin, ..*frame }));
            }
            let growth = (far - near) / (high - low);
            cone(frame, near - growth * low, growth)
        }
        Shape::Arc(arc) => circle(frame, arc),
        _ => None,
    }
}

/// A circle in a plane with the axis, turned: a sphere or a torus.
fn circle(frame: &Frame, arc: &Arc) -> Option<Elementary> {
    let ([x, y, z], radius) = (arc.centre, norm(arc.axes[0]));
    let normal = unit(cross(arc.axes[0], arc.axes[1]))?;
    let is_upright = normal[2].abs() <= NOTHING && dot(normal, arc.centre).abs() <= NOTHING * radius;
    if !is_upright || !arc.is_circular() {
        return None;
    }
    let (major, centred) = (x.hypot(y), Frame { origin: frame.outside([0.0, 0.0, z]), ..*frame });
    if major <= NOTHING * radius {
        return Some(Elementary::Sphere { frame: centred, radius });
    }
    (major > radius).then_some(Elementary::Torus { frame: centred, major, minor: radius })
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    /// Points of all surfaces with an equation are on it, told by parameters and as profiles that are turned; the side turns over with the sense.
    #[test]
    fn surfaces_are_those_of_their_points() {
        let axes = Affine::from_axes([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]], [4.0, 5.0, 6.0]);
        let line = |from: Point, to: Point| Carrier::Turned(axes, Shape::Line([from, to]));
        let arc = |centre: Point, angles: [f64; 2]| {
            Carrier::Turned(axes, Shape::Arc(Arc::new(centre, [[1.5, 0.0, 0.0], [0.0, 0.0, 1.5]], angles).unwrap()))
        };
        // Name, and whether the natural normal is that outwards: profiles that run up along the axis have it so, circles from outside up.
        let all = [
            (Carrier::Plane(axes), "plane", true),
            (Carrier::Cylinder(axes, 2.0), "cylinder", true),
            (Carrier::Cone(axes, [2.0, 0.5]), "cone", true),
            (Carrier::Cone(axes, [2.0, -0.5]), "cone", true),
            (Carrier::Sphere(axes, 2.0), "sphere", true),
            (Carrier::Torus(axes, [3.0, 1.0]), "torus", true),
            (line([2.0, 0.0, 0.0], [2.0, 0.0, 3.0]), "cylinder", true),
            (line([2.0, 0.0, 3.0], [2.0, 0.0, 0.0]), "cylinder", false),
            (line([2.0, 0.0, 0.0], [1.0, 0.0, 3.0]), "cone", true),
            (line([2.0, 0.0, 1.0], [1.0, 0.0, 1.0]), "plane", true),
            (arc([0.0, 0.0, 1.0], [0.1, FRAC_PI_2]), "sphere", true),
            (arc([5.0, 0.0, 1.0], [0.0, 6.0]), "torus", true),
        ];
        for (carrier, name, is_outward) in all {
            let told = carrier.told(true).unwrap();
            assert_eq!((told.surface.name(), told.is_left), (name, Some(is_outward)), "{carrier:?}");
            assert_eq!(carrier.told(false).unwrap().is_left, Some(!is_outward));
            let [low, high] = if let Carrier::Turned(_, shape) = &carrier { shape.domain() } else { [0.1, 0.9] };
            for share in [0.2, 0.7] {
                let point = carrier.point(1.0 + share, low + (high - low) * share);
                assert!(told.surface.distance(point) < 1e-12, "{carrier:?}");
            }
        }
        assert!(line([2.0, 0.0, 0.0], [2.0, 1.0, 3.0]).told(true).is_none());
        assert!(Carrier::Torus(axes, [1.0, 2.0]).told(true).is_none());
    }
}
