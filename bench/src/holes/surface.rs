//! Surfaces of which every point is known.

use crate::mesh::{Vector, dot, length, minus, unit};

/// A surface, and the place on it where a hole is cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Surface {
    /// Radius 1.
    Sphere,
    /// Radii 1 and 0.4, on the outer side, where both curvatures are positive.
    TorusOutside,
    /// And on the inner side, where they differ in sign.
    TorusInside,
    /// z = (x² − y²)/2.
    Saddle,
}

/// The torus's smaller radius; the larger one is 1.
const TUBE: f64 = 0.4;

impl Surface {
    pub(crate) const ALL: [Self; 4] = [Self::Sphere, Self::TorusOutside, Self::TorusInside, Self::Saddle];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Sphere => "sphere",
            Self::TorusOutside => "torus outside",
            Self::TorusInside => "torus inside",
            Self::Saddle => "saddle",
        }
    }

    /// The smallest radius of curvature where the hole is.
    pub(crate) fn radius(self) -> f64 {
        if matches!(self, Self::TorusInside | Self::TorusOutside) { TUBE } else { 1.0 }
    }

    /// Half the sides of the rectangle of the plane that goes once around the torus.
    pub(super) fn torus_half_sides(self) -> [f64; 2] {
        [std::f64::consts::PI * self.torus_equator(), std::f64::consts::PI * TUBE]
    }

    /// Radius of the circle about the axis on which the hole's middle lies.
    fn torus_equator(self) -> f64 {
        if self == Self::TorusInside { 1.0 - TUBE } else { 1.0 + TUBE }
    }

    /// Where a point of the plane lies, lengths near the origin, the hole's middle, staying as they are. Counterclockwise is seen so from
    /// outside.
    pub(super) fn at(self, [x, y]: [f64; 2]) -> Vector {
        match self {
            Self::Sphere => {
                let r = x.hypot(y);
                let share = if r > 0.0 { r.sin() / r } else { 1.0 };
                [x * share, y * share, r.cos()]
            }
            Self::TorusOutside | Self::TorusInside => {
                let (around, across) = (x / self.torus_equator(), y / TUBE);
                // The inner side is the outer one, half a turn further and seen from the other end.
                let sign = if self == Self::TorusInside { -1.0 } else { 1.0 };
                let r = 1.0 + sign * TUBE * across.cos();
                [r * around.cos(), sign * r * around.sin(), TUBE * across.sin()]
            }
            Self::Saddle => [x, y, 0.5 * (x * x - y * y)],
        }
    }

    /// Distance from the surface, and its normal at the nearest point.
    pub(crate) fn distance(self, p: Vector) -> (f64, Vector) {
        match self {
            Self::Sphere => ((length(p) - 1.0).abs(), unit(p)),
            Self::TorusOutside | Self::TorusInside => {
                let off = minus(p, unit([p[0], p[1], 0.0]));
                ((length(off) - TUBE).abs(), unit(off))
            }
            Self::Saddle => {
                let foot = saddle_foot(p);
                (length(minus(p, foot)), unit([-foot[0], foot[1], 1.0]))
            }
        }
    }
}

/// The saddle's point nearest to one close to it, by Newton's method on the squared distance.
fn saddle_foot(p: Vector) -> Vector {
    let (mut x, mut y) = (p[0], p[1]);
    for _ in 0..20 {
        let above = 0.5 * (x * x - y * y) - p[2];
        let (gx, gy) = (x - p[0] + above * x, y - p[1] - above * y);
        let (xx, xy, yy) = (1.0 + x * x + above, -x * y, 1.0 + y * y - above);
        let determinant = xx * yy - xy * xy;
        x -= (yy * gx - xy * gy) / determinant;
        y -= (xx * gy - xy * gx) / determinant;
    }
    [x, y, 0.5 * (x * x - y * y)]
}

/// Angle between two directions, in degrees.
pub(super) fn degrees(a: Vector, b: Vector) -> f64 {
    dot(a, b).clamp(-1.0, 1.0).acos().to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::cross;

    #[test]
    fn points_are_on_their_surface_and_the_plane_keeps_lengths_and_sides() {
        for surface in Surface::ALL {
            for p in [[0.0, 0.0], [0.1, -0.2], [-0.3, 0.25]] {
                let at = |dx: f64, dy: f64| surface.at([p[0] + dx, p[1] + dy]);
                let (far, normal) = surface.distance(at(0.0, 0.0));
                assert!(far < 1e-14, "{surface:?} {far}");
                let [along, across] = [minus(at(1e-6, 0.0), at(-1e-6, 0.0)), minus(at(0.0, 1e-6), at(0.0, -1e-6))];
                assert!(degrees(unit(cross(along, across)), normal) < 1e-3, "{surface:?} at {p:?}");
                if p == [0.0, 0.0] {
                    assert!((length(along) / 2e-6 - 1.0).abs() < 1e-9 && (length(across) / 2e-6 - 1.0).abs() < 1e-9);
                }
            }
        }
    }

    #[test]
    fn distance_is_along_the_normal() {
        for surface in Surface::ALL {
            let p = surface.at([0.12, 0.07]);
            let normal = surface.distance(p).1;
            let off = std::array::from_fn(|k| p[k] + 0.01 * normal[k]);
            let (far, there) = surface.distance(off);
            assert!((far - 0.01).abs() < 1e-12 && degrees(there, normal) < 1e-5, "{surface:?} {far}");
        }
    }
}
