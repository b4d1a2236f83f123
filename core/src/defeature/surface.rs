//! The surfaces of machine parts: plane, cylinder, cone, sphere, torus.

use super::vector::{Point, add, along, cross, dot, frame, norm, scale, sub, unit};

/// A surface that a segment of the mesh lies on. Directions are unit vectors; lengths mm, angles radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Surface {
    /// Points x with `normal · x = offset`; the normal leads out of the part.
    Plane {
        /// Direction.
        normal: Point,
        /// Distance from the origin.
        offset: f64,
    },
    /// Points at `radius` from the axis.
    Cylinder {
        /// A point of the axis.
        origin: Point,
        /// Its direction.
        axis: Point,
        /// Radius.
        radius: f64,
    },
    /// Half a cone: directions from the apex that make `angle` with the axis.
    Cone {
        /// Tip.
        apex: Point,
        /// Direction from the apex into the cone.
        axis: Point,
        /// Half the opening, between 0 and π/2.
        angle: f64,
    },
    /// Points at `radius` from the centre.
    Sphere {
        /// Centre.
        centre: Point,
        /// Radius.
        radius: f64,
    },
    /// Points at `minor` from a circle.
    Torus {
        /// Centre of the circle.
        centre: Point,
        /// Direction of its axis.
        axis: Point,
        /// Radius of the circle.
        major: f64,
        /// Radius around it.
        minor: f64,
    },
}

impl Surface {
    /// The signed distance of a point: to the plane along its normal, for others positive where it leads away from the axis
    /// (the centre, the circle).
    pub(crate) fn distance(&self, point: Point) -> f64 {
        match *self {
            Self::Plane { normal, offset } => dot(normal, point) - offset,
            Self::Cylinder { origin, axis, radius } => norm(cross(sub(point, origin), axis)) - radius,
            Self::Cone { apex, axis, angle } => {
                let [h, r] = meridian(apex, axis, point);
                r * angle.cos() - h * angle.sin()
            }
            Self::Sphere { centre, radius } => norm(sub(point, centre)) - radius,
            Self::Torus { centre, axis, major, minor } => {
                let [h, r] = meridian(centre, axis, point);
                ((r - major) * (r - major) + h * h).sqrt() - minor
            }
        }
    }

    /// The gradient of [`Self::distance`]: a unit vector; 0 where there is none.
    pub(crate) fn gradient(&self, point: Point) -> Point {
        let zero = [0.0; 3];
        match *self {
            Self::Plane { normal, .. } => normal,
            Self::Cylinder { origin, axis, .. } => unit(radial(origin, axis, point)).unwrap_or(zero),
            Self::Cone { apex, axis, angle } => {
                let away = unit(radial(apex, axis, point)).unwrap_or(zero);
                add(scale(away, angle.cos()), scale(axis, -angle.sin()))
            }
            Self::Sphere { centre, .. } => unit(sub(point, centre)).unwrap_or(zero),
            Self::Torus { centre, axis, major, .. } => {
                let away = unit(radial(centre, axis, point)).unwrap_or(zero);
                unit(sub(point, along(centre, away, major))).unwrap_or(zero)
            }
        }
    }

    /// The axis as a point and a direction, where there is one.
    pub(crate) fn axis(&self) -> Option<(Point, Point)> {
        match *self {
            Self::Cylinder { origin: p, axis, .. } | Self::Cone { apex: p, axis, .. } | Self::Torus { centre: p, axis, .. } => {
                Some((p, axis))
            }
            Self::Plane { .. } | Self::Sphere { .. } => None,
        }
    }

    /// The radius of what is round in one way only, and of spheres: of a cylinder, of a torus around its circle.
    pub(crate) fn radius(&self) -> Option<f64> {
        match *self {
            Self::Cylinder { radius, .. } | Self::Sphere { radius, .. } | Self::Torus { minor: radius, .. } => Some(radius),
            Self::Plane { .. } | Self::Cone { .. } => None,
        }
    }

    /// Whether it is a plane.
    pub(crate) fn is_plane(&self) -> bool {
        matches!(self, Self::Plane { .. })
    }

    /// Parameters moved a little, for fits: up to seven of them. The second value is how many count.
    pub(crate) fn moved(&self, d: [f64; 7]) -> (Self, usize) {
        let tilt = |axis: Point, u: f64, v: f64| {
            let [e, f] = frame(axis);
            unit(along(along(axis, e, u), f, v)).unwrap_or(axis)
        };
        match *self {
            Self::Plane { .. } => (*self, 0),
            Self::Cylinder { origin, axis, radius } => {
                let [e, f] = frame(axis);
                let origin = along(along(origin, e, d[0]), f, d[1]);
                (Self::Cylinder { origin, axis: tilt(axis, d[2], d[3]), radius: radius + d[4] }, 5)
            }
            Self::Cone { apex, axis, angle } => {
                let apex = add(apex, [d[0], d[1], d[2]]);
                (Self::Cone { apex, axis: tilt(axis, d[3], d[4]), angle: angle + d[5] }, 6)
            }
            Self::Sphere { centre, radius } => {
                (Self::Sphere { centre: add(centre, [d[0], d[1], d[2]]), radius: radius + d[3] }, 4)
            }
            Self::Torus { centre, axis, major, minor } => {
                let centre = add(centre, [d[0], d[1], d[2]]);
                (Self::Torus { centre, axis: tilt(axis, d[3], d[4]), major: major + d[5], minor: minor + d[6] }, 7)
            }
        }
    }

    /// Whether another surface is the same within `tolerance` over the extent `size`, planes with the same normal.
    pub(crate) fn is_same(&self, other: &Self, near: Point, tolerance: f64, size: f64) -> bool {
        let parallel = |a: Point, b: Point| norm(cross(a, b)) * size <= tolerance;
        let on_axis = |p: Point, (o, d): (Point, Point)| norm(cross(sub(p, o), d)) <= tolerance;
        match (self, other) {
            (Self::Plane { normal: a, .. }, Self::Plane { normal: b, .. }) => {
                dot(*a, *b) > 0.0 && norm(cross(*a, *b)) < 1e-3 && (self.distance(near) - other.distance(near)).abs() <= tolerance
            }
            (Self::Cylinder { origin, axis, radius }, Self::Cylinder { origin: o, axis: a, radius: r }) => {
                let foot = along(*origin, *axis, dot(sub(near, *origin), *axis));
                (radius - r).abs() <= tolerance && norm(cross(*axis, *a)) < 5e-3 && on_axis(foot, (*o, *a))
            }
            (Self::Cone { apex, axis, angle }, Self::Cone { apex: p, axis: a, angle: b }) => {
                parallel(*axis, *a)
                    && dot(*axis, *a) > 0.0
                    && (angle - b).abs() * size <= tolerance
                    && norm(sub(*apex, *p)) <= 4.0 * tolerance
            }
            (Self::Sphere { centre, radius }, Self::Sphere { centre: c, radius: r }) => {
                (radius - r).abs() <= tolerance && norm(sub(*centre, *c)) <= tolerance
            }
            _ => false,
        }
    }
}

/// Height along an axis and distance from it.
pub(crate) fn meridian(origin: Point, axis: Point, point: Point) -> [f64; 2] {
    let d = sub(point, origin);
    [dot(d, axis), norm(cross(d, axis))]
}

/// The part of `point − origin` that is square to the axis.
pub(crate) fn radial(origin: Point, axis: Point, point: Point) -> Point {
    let d = sub(point, origin);
    along(d, axis, -dot(d, axis))
}
