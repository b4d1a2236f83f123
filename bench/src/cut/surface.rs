//! Intended surfaces, with two parameters: `u` across the passes and `v` along them, both in millimetres.

use crate::space::{Vector, dot, minus, plus, times};

/// The surface that is meant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Surface {
    /// A plane that climbs by so many degrees across the passes: a floor at 0, a wall near 90.
    Plane(f64),
    /// The wall of a conical pocket: its radius at the bottom in millimetres, and its slope in degrees. Passes are arcs.
    Cone(f64, f64),
    /// A pocket of free form: the depth of its waves and their length, both in millimetres.
    Free(f64, f64),
}

/// The place of a surface that is nearest to a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Foot {
    pub(super) u: f64,
    pub(super) v: f64,
    /// Signed distance of the point, positive in the air.
    pub(super) distance: f64,
}

impl Surface {
    /// The point of these parameters, and the unit normal there, towards the air.
    pub(super) fn at(&self, u: f64, v: f64) -> (Vector, Vector) {
        match *self {
            Self::Plane(slope) => {
                let (sin, cos) = slope.to_radians().sin_cos();
                ([u * cos, v, u * sin], [-sin, 0.0, cos])
            }
            Self::Cone(radius, slope) => {
                let (sin, cos) = slope.to_radians().sin_cos();
                let (s, c) = (v / radius).sin_cos();
                let far = radius + u * cos;
                ([far * c, far * s, u * sin], [-sin * c, -sin * s, cos])
            }
            Self::Free(depth, wave) => {
                let k = std::f64::consts::TAU / wave;
                let z = depth * (k * u).sin() * (0.7 * k * v + 0.5).cos();
                let (dx, dy) = (
                    depth * k * (k * u).cos() * (0.7 * k * v + 0.5).cos(),
                    -0.7 * depth * k * (k * u).sin() * (0.7 * k * v + 0.5).sin(),
                );
                let length = (dx * dx + dy * dy + 1.0).sqrt();
                ([u, v, z], [-dx / length, -dy / length, 1.0 / length])
            }
        }
    }

    /// Signed distance of a point, in millimetres, positive in the air. At a free form the point has to be nearer than the surface's
    /// least radius of curvature.
    pub fn distance(&self, p: Vector) -> f64 {
        self.foot(p).distance
    }

    /// The place that is nearest to a point, on the conditions of [`Surface::distance`].
    pub(super) fn foot(&self, p: Vector) -> Foot {
        match *self {
            Self::Plane(slope) => {
                let (sin, cos) = slope.to_radians().sin_cos();
                Foot { u: p[0] * cos + p[2] * sin, v: p[1], distance: p[2] * cos - p[0] * sin }
            }
            Self::Cone(radius, slope) => {
                let (sin, cos) = slope.to_radians().sin_cos();
                let out = p[0].hypot(p[1]) - radius;
                Foot { u: out * cos + p[2] * sin, v: radius * p[1].atan2(p[0]), distance: p[2] * cos - out * sin }
            }
            Self::Free(..) => {
                // Each step goes to the foot on the tangent plane; the error shrinks by distance over radius of curvature.
                let mut foot = Foot { u: p[0], v: p[1], distance: 0.0 };
                for _ in 0..20 {
                    let (on, normal) = self.at(foot.u, foot.v);
                    let away = minus(p, on);
                    foot.distance = dot(away, normal);
                    let aside = minus(away, times(normal, foot.distance));
                    foot.u += aside[0];
                    foot.v += aside[1];
                }
                foot
            }
        }
    }

    /// The height over a place of the level plane; `None` of planes and cones, which may be steep.
    pub(super) fn above(&self, x: f64, y: f64) -> Option<f64> {
        if let Self::Free(..) = self { Some(self.at(x, y).0[2]) } else { None }
    }

    /// The point that stands over these parameters by so much along the normal.
    pub(super) fn lifted(&self, u: f64, v: f64, height: f64) -> Vector {
        let (point, normal) = self.at(u, v);
        plus(point, times(normal, height))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Surface; 5] = [
        Surface::Plane(0.0),
        Surface::Plane(80.0),
        Surface::Cone(20.0, 70.0),
        Surface::Free(1.5, 30.0),
        Surface::Free(10.0, 120.0),
    ];

    #[test]
    fn a_lifted_point_has_its_height_for_distance_and_its_parameters_for_foot() {
        for surface in ALL {
            for (u, v) in [(0.0, 0.0), (3.3, 7.0), (11.0, 24.0), (7.5, 1.25)] {
                for height in [-0.5, 0.0, 0.04, 0.5] {
                    let foot = surface.foot(surface.lifted(u, v, height));
                    let wrong = [foot.distance - height, foot.u - u];
                    assert!(wrong.iter().all(|x| x.abs() < 1e-9), "{surface:?} {u} {v} {height}: {foot:?}");
                    assert!((foot.v - v).abs() < 1e-9, "{surface:?} {u} {v} {height}: {foot:?}");
                }
            }
        }
    }

    #[test]
    fn normals_are_units_at_right_angles_to_the_surface() {
        for surface in ALL {
            let (point, normal) = surface.at(4.0, 9.0);
            assert!((dot(normal, normal) - 1.0).abs() < 1e-12 && normal[2] > 0.0, "{surface:?}");
            for (u, v) in [(1e-5, 0.0), (0.0, 1e-5)] {
                let way = minus(surface.at(4.0 + u, 9.0 + v).0, point);
                assert!(dot(way, normal).abs() < 1e-4 * 1e-5, "{surface:?}");
            }
        }
    }
}
