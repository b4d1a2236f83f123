//! Milling tools that end flat, in a ball, or with a rounded corner (bull nose).

use crate::space::{Vector, plus, times};

/// An upright tool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cutter {
    /// Half of the diameter, in millimetres.
    pub radius: f64,
    /// Radius of the corner in millimetres: 0 for a flat end, the tool's radius for a ball.
    pub corner: f64,
}

impl Cutter {
    /// The tool in the words of `suture residue --tool`, as number 1 of the program: `1=ball,d=6`, `1=flat,d=6`, `1=bull,d=6,r=1`.
    pub fn words(&self) -> String {
        let diameter = 2.0 * self.radius;
        if self.corner <= 0.0 {
            format!("1=flat,d={diameter}")
        } else if self.corner < self.radius {
            format!("1=bull,d={diameter},r={}", self.corner)
        } else {
            format!("1=ball,d={diameter}")
        }
    }

    /// Signed distance of a point from the tool whose tip is the origin, negative inside.
    pub(super) fn distance(&self, p: Vector) -> f64 {
        let out = p[0].hypot(p[1]) - (self.radius - self.corner);
        let below = self.corner - p[2];
        if out > 0.0 && below > 0.0 { out.hypot(below) - self.corner } else { out.max(below) - self.corner }
    }

    /// The direction in which [`Cutter::distance`] grows most.
    pub(super) fn gradient(&self, p: Vector) -> Vector {
        let far = p[0].hypot(p[1]);
        let (out, below) = (far - (self.radius - self.corner), self.corner - p[2]);
        let [radial, axial] = match (out > 0.0 && below > 0.0, out > below) {
            (true, _) => [out / out.hypot(below), -below / out.hypot(below)],
            (false, true) => [1.0, 0.0],
            (false, false) => [0.0, -1.0],
        };
        if far > 0.0 { [radial * p[0] / far, radial * p[1] / far, axial] } else { [0.0, 0.0, axial] }
    }

    /// The height of the tool's lower side over its tip, so far from the axis; infinite beyond the tool.
    pub(super) fn rise(&self, far: f64) -> f64 {
        let out = (far - (self.radius - self.corner)).max(0.0);
        if out <= self.corner { self.corner - (self.corner * self.corner - out * out).sqrt() } else { f64::INFINITY }
    }

    /// The tip of the tool that touches a surface at a point with this unit normal.
    pub(super) fn tip(&self, (point, normal): (Vector, Vector)) -> Vector {
        let level = normal[0].hypot(normal[1]);
        let shift = if level > 1e-9 { (self.radius - self.corner) / level } else { 0.0 };
        let centre = plus(point, times(normal, self.corner));
        [centre[0] + shift * normal[0], centre[1] + shift * normal[1], centre[2] - self.corner]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::minus;

    #[test]
    fn words_name_form_and_diameter() {
        let words = [(3.0, 3.0), (3.0, 0.0), (3.0, 1.0), (1.25, 0.4)].map(|(radius, corner)| Cutter { radius, corner }.words());
        assert_eq!(words, ["1=ball,d=6", "1=flat,d=6", "1=bull,d=6,r=1", "1=bull,d=2.5,r=0.4"]);
    }

    #[test]
    fn distances_are_those_of_the_figure() {
        // A radius of 3 with a corner of 1: the tip's disc ends 2 away from the axis, and the corner's circle has its centre at (2, 1).
        let bull = Cutter { radius: 3.0, corner: 1.0 };
        for (p, distance) in [
            ([0.0, 0.0, -1.0], 1.0),
            ([1.9, 0.0, 0.5], -0.5),
            ([0.0, 5.0, 9.0], 2.0),
            ([5.0, 0.0, -3.0], 4.0),
            ([2.6, 0.0, 0.2], 0.0),
        ] {
            assert!((bull.distance(p) - distance).abs() < 1e-12, "{p:?}");
        }
    }

    #[test]
    fn gradients_are_those_of_the_distance() {
        for (radius, corner) in [(3.0, 3.0), (3.0, 0.0), (3.0, 1.0)] {
            let cutter = Cutter { radius, corner };
            for p in [[0.5, 0.2, -1.0], [2.6, 1.9, 0.3], [2.4, 2.2, 2.9], [-1.0, 2.0, 0.1], [-4.0, 1.0, 5.0]] {
                for (axis, slope) in cutter.gradient(p).into_iter().enumerate() {
                    let aside = |by: f64| cutter.distance(std::array::from_fn(|n| p[n] + if n == axis { by } else { 0.0 }));
                    assert!((aside(1e-6) - aside(-1e-6) - 2e-6 * slope).abs() < 1e-11, "{cutter:?} {p:?}");
                }
            }
        }
    }

    #[test]
    fn the_lower_side_is_where_the_distance_is_nothing() {
        for (radius, corner) in [(3.0, 3.0), (3.0, 0.0), (3.0, 1.0)] {
            let cutter = Cutter { radius, corner };
            for far in [0.0, 1.0, 1.9, 2.5, 2.99] {
                assert!(cutter.distance([far, 0.0, cutter.rise(far)]).abs() < 1e-12, "{cutter:?} {far}");
            }
            assert_eq!(cutter.rise(3.01), f64::INFINITY);
        }
    }

    #[test]
    fn the_tip_puts_the_tool_on_the_point() {
        for (radius, corner) in [(3.0, 3.0), (3.0, 0.0), (3.0, 1.0)] {
            let cutter = Cutter { radius, corner };
            let (point, normal) = ([4.0, 5.0, 6.0], [0.48, -0.64, 0.6]);
            let tip = cutter.tip((point, normal));
            assert!(cutter.distance(minus(point, tip)).abs() < 1e-12, "{cutter:?}");
            let under = plus(point, times(normal, -0.01));
            assert!(cutter.distance(minus(under, tip)) > 0.005, "{cutter:?} cuts under the surface");
        }
    }
}
