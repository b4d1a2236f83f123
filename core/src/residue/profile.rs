//! The outline of a tool: the signed distance of a point from it.

use crate::curves::vector::{Point, add, dot, scale, sub};
use crate::toolpath::Tool;

/// Millimetres that stand for a tool without an end.
const ENDLESS: f64 = 1e6;
/// Diameters that a leaning tool of unknown length is long.
const LEANING: f64 = 8.0;

/// A convex solid of revolution: all points up to `round` from a core, which is convex too.
#[derive(Clone, Debug)]
pub(crate) struct Profile {
    core: Core,
    /// Radius by which the core grows, in millimetres.
    pub(crate) round: f64,
    /// Distance of the farthest point from the axis.
    pub(crate) radius: f64,
    /// Height of the tool above its tip.
    pub(crate) length: f64,
}

/// The core, by its outline: distance from the axis, and height above the tip.
#[derive(Clone, Debug)]
enum Core {
    /// A cylinder from a height to the tool's end; a line if its radius is 0.
    Cylinder { radius: f64, low: f64 },
    /// Corners from the axis below to the flank's end.
    Corners(Vec<[f64; 2]>),
}

impl Profile {
    /// The outline of a tool; `None` if its measures make no solid. A drill's and a taper's shank begin at the diameter. A tool of
    /// unknown length that leans is [`LEANING`] diameters long: boxes around it have to end.
    pub(crate) fn new(tool: &Tool, is_upright: bool) -> Option<Self> {
        use crate::toolpath::Shape;
        let cutter = tool.cutter();
        let radius = 0.5 * tool.diameter;
        let endless = if is_upright { ENDLESS } else { LEANING * tool.diameter };
        let length = if tool.length.is_finite() && tool.length > 0.0 { tool.length.max(radius) } else { endless };
        let numbers = [cutter.diameter, cutter.corner, cutter.e, cutter.f, cutter.alpha, cutter.beta];
        if !(radius > 0.0 && radius < ENDLESS) || numbers.iter().any(|number| !number.is_finite()) {
            return None;
        }
        let (core, round, radius) = match tool.shape {
            Shape::Flat => (Core::Cylinder { radius, low: 0.0 }, 0.0, radius),
            Shape::Ball => (Core::Cylinder { radius: 0.0, low: radius }, radius, radius),
            Shape::BullNose { corner } => {
                let corner = corner.clamp(0.0, radius);
                (Core::Cylinder { radius: radius - corner, low: corner }, corner, radius)
            }
            Shape::Taper { tip, angle } => {
                let tip = 0.5 * tip.clamp(0.0, tool.diameter);
                let rise = (radius - tip) / angle.clamp(0.1, 89.9).to_radians().tan();
                (Core::Corners(vec![[0.0, 0.0], [tip, 0.0], [radius, rise], [radius, length.max(rise)]]), 0.0, radius)
            }
            Shape::Drill { angle } => {
                let rise = radius / (0.5 * angle.clamp(1.0, 179.9)).to_radians().tan();
                (Core::Corners(vec![[0.0, 0.0], [radius, rise], [radius, length.max(rise)]]), 0.0, radius)
            }
            Shape::General(_) => {
                let beta = cutter.beta.clamp(-89.9, 89.9).to_radians();
                let low = cutter.f - cutter.e * cutter.alpha.clamp(0.0, 89.9).to_radians().tan();
                let length = length.max(cutter.f + 1e-9);
                let end = (cutter.e + (length - cutter.f) * beta.tan()).max(0.0);
                let corners = vec![[0.0, low], [cutter.e.max(0.0), cutter.f], [end, length]];
                (Core::Corners(corners), cutter.corner.max(0.0), cutter.e.max(end) + cutter.corner.max(0.0))
            }
        };
        Some(Self { core, round, radius, length })
    }

    /// Radius of the flat part below, in millimetres; 0 of a ball.
    pub(crate) fn flat(&self) -> f64 {
        self.radius - self.round
    }

    /// Whether it is a ball.
    pub(crate) fn is_ball(&self) -> bool {
        matches!(self.core, Core::Cylinder { radius, .. } if radius == 0.0)
    }

    /// The point of the axis that a path of contact turns about: the centre of a ball, the middle of the corner's circle of others.
    pub(crate) fn centre(&self) -> f64 {
        match self.core {
            Core::Cylinder { low, .. } => low,
            Core::Corners(_) => 0.0,
        }
    }

    /// Signed distance of a point, given from the tip, and its gradient, of length 1. Negative within. The axis has length 1.
    /// O(corners).
    pub(crate) fn distance(&self, from_tip: Point, axis: Point) -> (f64, Point) {
        let height = dot(from_tip, axis);
        let out = sub(from_tip, scale(axis, height));
        let far = dot(out, out).sqrt();
        let (distance, [radial, axial]) = self.outline(far, height);
        let out = if far > 0.0 { scale(out, radial / far) } else { [0.0; 3] };
        (distance - self.round, add(out, scale(axis, axial)))
    }

    /// Signed distance alone.
    pub(crate) fn depth(&self, from_tip: Point, axis: Point) -> f64 {
        let height = dot(from_tip, axis);
        let far = (dot(from_tip, from_tip) - height * height).max(0.0).sqrt();
        self.outline(far, height).0 - self.round
    }

    /// A lower bound of the signed distance over places whose least distance from the axis, and least depth below the tip, are
    /// known. The bound holds for an upright tool.
    pub(crate) fn bound(&self, far: f64, below_tip: f64) -> f64 {
        let (flat, low) = match &self.core {
            Core::Cylinder { radius, low } => (*radius, *low),
            Core::Corners(corners) => (self.flat(), corners.first().map_or(0.0, |corner| corner[1])),
        };
        let (out, below) = (far - flat, below_tip + low);
        let bound = if out > 0.0 && below > 0.0 { (out * out + below * below).sqrt() } else { out.max(below) };
        bound - self.round
    }

    /// The point of the tool that lies farthest in a direction, from its centre; upward directions count as level ones.
    pub(crate) fn support(&self, direction: Point, axis: Point) -> Point {
        let rise = dot(direction, axis);
        let level = sub(direction, scale(axis, rise));
        let far = dot(level, level).sqrt();
        let out = if far > 1e-12 { scale(level, 1.0 / far) } else { [0.0; 3] };
        match &self.core {
            Core::Cylinder { radius, .. } => add(scale(out, *radius), scale(direction, self.round)),
            Core::Corners(corners) => {
                let reach = |corner: &[f64; 2]| corner[0] * far + corner[1] * rise.min(0.0);
                let farthest = corners.iter().max_by(|a, b| reach(a).total_cmp(&reach(b))).copied().unwrap_or_default();
                add(add(scale(out, farthest[0]), scale(axis, farthest[1])), scale(direction, self.round))
            }
        }
    }

    /// Signed distance from the core in the half plane of the axis, and its gradient.
    fn outline(&self, far: f64, height: f64) -> (f64, [f64; 2]) {
        match &self.core {
            Core::Cylinder { radius, low } => {
                let (out, below, above) = (far - radius, low - height, height - self.length);
                let (along, sign) = if below > above { (below, -1.0) } else { (above, 1.0) };
                if out > 0.0 && along > 0.0 {
                    let distance = (out * out + along * along).sqrt();
                    (distance, [out / distance, sign * along / distance])
                } else if out > along {
                    (out, [1.0, 0.0])
                } else {
                    (along, [0.0, sign])
                }
            }
            Core::Corners(corners) => of_corners(corners, far, height),
        }
    }
}

/// Signed distance from the solid that a convex outline bounds, closed at its upper end, and its gradient.
fn of_corners(corners: &[[f64; 2]], far: f64, height: f64) -> (f64, [f64; 2]) {
    let last = corners.last().copied().unwrap_or_default();
    let top = [last, [0.0, last[1]]];
    let mut nearest = (f64::INFINITY, [0.0, 0.0]);
    let mut inner = (f64::NEG_INFINITY, [0.0, 1.0]);
    for side in corners.windows(2).chain(std::iter::once(&top[..])) {
        let &[[a, b], [c, d]] = side else { continue };
        let (along, up) = (c - a, d - b);
        let length = along.hypot(up);
        if length == 0.0 {
            continue;
        }
        // The outer normal lies to the right of a walk from the axis outwards and up.
        let normal = [up / length, -along / length];
        let level = (far - a) * normal[0] + (height - b) * normal[1];
        if level > inner.0 {
            inner = (level, normal);
        }
        let at = (((far - a) * along + (height - b) * up) / (length * length)).clamp(0.0, 1.0);
        let away = [far - a - at * along, height - b - at * up];
        let distance = away[0].hypot(away[1]);
        if distance < nearest.0 {
            let direction = if distance > 1e-12 { away.map(|part| part / distance) } else { normal };
            nearest = (distance, direction);
        }
    }
    if inner.0 <= 0.0 { inner } else { nearest }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curves::vector::norm;
    use crate::toolpath::{Cutter, Shape};

    const UP: Point = [0.0, 0.0, 1.0];

    fn of(shape: Shape) -> Profile {
        Profile::new(&Tool::new(1, shape, 6.0), true).expect("a tool")
    }

    /// Points whose distances are known by hand: below, beside, at the corner, within.
    #[test]
    fn distances_by_hand() {
        let near = |profile: &Profile, point: Point, expected: f64| {
            let distance = profile.distance(point, UP).0;
            assert!((distance - expected).abs() < 1e-9, "{profile:?} {point:?} {distance}");
            assert!((profile.depth(point, UP) - distance).abs() < 1e-9);
        };
        near(&of(Shape::Ball), [0.0, 0.0, -1.0], 1.0);
        near(&of(Shape::Ball), [3.0, 4.0, 3.0], 2.0);
        near(&of(Shape::Ball), [0.0, 0.0, 3.0], -3.0);
        near(&of(Shape::Flat), [6.0, 0.0, -4.0], 5.0);
        near(&of(Shape::Flat), [2.5, 0.0, 1.0], -0.5);
        near(&of(Shape::BullNose { corner: 1.0 }), [5.0, 0.0, -3.0], 4.0);
        near(&of(Shape::Taper { tip: 2.0, angle: 45.0 }), [3.0, 0.0, 0.0], 2f64.sqrt());
        near(&of(Shape::Drill { angle: 90.0 }), [2.0, 0.0, 0.0], 2f64.sqrt());
        near(&of(Shape::Drill { angle: 90.0 }), [0.0, 0.0, 1.0], -(0.5f64.sqrt()));
    }

    proptest::proptest! {
        /// The distance is as steep as its gradient says, in its direction, for each form and a leaning axis.
        #[test]
        fn gradients_are_of_the_distance(form in 0..6usize, x in -5.0..5.0f64, y in -5.0..5.0f64, z in -5.0..9.0f64) {
            let disc = Cutter { diameter: 6.0, corner: 0.5, e: 2.0, f: 1.0, alpha: 20.0, beta: 10.0, height: 20.0 };
            let shapes = [Shape::Ball, Shape::Flat, Shape::BullNose { corner: 1.0 }, Shape::Taper { tip: 1.0, angle: 30.0 },
                Shape::Drill { angle: 118.0 }, Shape::General(disc)];
            let profile = of(shapes[form]);
            let axis = [0.6, 0.0, 0.8];
            let (distance, gradient) = profile.distance([x, y, z], axis);
            let step = 1e-6;
            let ahead = profile.distance(add([x, y, z], scale(gradient, step)), axis).0;
            proptest::prop_assert!(distance < 0.0 || (norm(gradient) - 1.0).abs() < 1e-9);
            // Where the gradient jumps within the step, the distance grows more slowly, but never faster.
            proptest::prop_assert!(ahead - distance <= step * (1.0 + 1e-3));
            proptest::prop_assert!(distance < 1e-3 || ahead - distance > step * 0.9);
        }
    }
}
