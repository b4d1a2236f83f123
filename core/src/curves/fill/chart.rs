//! Flat maps of surfaces, in which meshes are made: as true to angles as the surface allows.

use std::f64::consts::TAU;

use super::coons::Coons;
use super::fan::Fan;
use super::plate::Plate;
use crate::curves::curve::Spline;
use crate::curves::elementary::Elementary;
use crate::curves::elementary::Frame;
use crate::curves::vector::{Point, add, between, dot, norm, plain_norm, scale};
use crate::util::each::Each;

/// A flat map of a surface.
#[derive(Clone, Debug)]
pub(super) enum Chart {
    Plane(Frame),
    /// Seen from the point opposite to the z-axis: true to angles.
    Sphere(Frame, f64),
    /// Unrolled.
    Turned(Turned),
    /// Parameters times lengths; of three sides a triangle, of two a lens.
    Coons(Box<Coons>, Form),
    /// Heights over a plane, which rings of points have given.
    Heights(Frame, Option<Box<Plate>>),
    /// A disc of a radius: around it a closed curve, in its middle a point, straight between.
    Disc(Box<Spline>, Point, f64),
    /// A part of a cone over a polyline, unrolled.
    Fan(Box<Fan>),
}

/// Cylinder, cone and torus: an angle and another coordinate, in which a turn counts as often as it is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Turned {
    Cylinder(Frame, f64),
    /// With the half angle at the apex; the x-axis is in the middle of what is unrolled.
    Cone(Frame, f64),
    Torus(Frame, f64, f64),
}

/// How the square of parameters lies in the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Form {
    /// Widths at both ends of one parameter, the height between, how much the far end is moved, and whether that parameter is u.
    Trapezoid { widths: [f64; 2], height: f64, shear: f64, is_turned: bool },
    /// Length, and width in the middle.
    Lens([f64; 2]),
}

impl Form {
    /// The place of parameters.
    pub(super) fn flat(self, [u, v]: [f64; 2]) -> [f64; 2] {
        match self {
            Self::Trapezoid { widths: [a, b], height, shear, is_turned } => {
                // Turned by a quarter, so that the orientation stays.
                let [u, v] = if is_turned { [v, 1.0 - u] } else { [u, v] };
                [shear * v + (u - 0.5) * (a + (b - a) * v), height * v]
            }
            Self::Lens([x, y]) => [u * x, (v - 0.5) * 4.0 * u * (1.0 - u) * y],
        }
    }

    /// Parameters of a place.
    pub(super) fn parameters(self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [u, v] = match self {
            Self::Trapezoid { widths: [a, b], height, shear, is_turned } => {
                let v = y / height;
                let u = 0.5 + (x - shear * v) / (a + (b - a) * v);
                if is_turned { [1.0 - v, u] } else { [u, v] }
            }
            Self::Lens([a, b]) => {
                let u = x / a;
                [u, 0.5 + y / (4.0 * u * (1.0 - u) * b)]
            }
        };
        [u, v].each(|t| if t.is_finite() { t.clamp(0.0, 1.0) } else { 0.5 })
    }
}

impl Turned {
    pub(super) fn frame(&self) -> &Frame {
        match self {
            Self::Cylinder(frame, _) | Self::Cone(frame, _) | Self::Torus(frame, ..) => frame,
        }
    }

    /// The angle around the axis, and: height; distance from the apex; angle in the tube.
    pub(super) fn coordinates(&self, point: Point) -> [f64; 2] {
        let [x, y, z] = self.frame().inside(point);
        let other = match self {
            Self::Cylinder(..) => z,
            Self::Cone(..) => x.hypot(y).hypot(z),
            Self::Torus(_, major, _) => z.atan2(x.hypot(y) - major),
        };
        [y.atan2(x), other]
    }

    /// Whether the other coordinate is an angle.
    pub(super) fn is_tube(&self) -> bool {
        matches!(self, Self::Torus(..))
    }

    /// Whether the angle says nothing at a point: at the apex.
    pub(super) fn is_apex(&self, point: Point, tolerance: f64) -> bool {
        matches!(self, Self::Cone(frame, _) if norm(frame.inside(point)) <= tolerance)
    }

    pub(super) fn flat(&self, [angle, other]: [f64; 2]) -> [f64; 2] {
        match *self {
            Self::Cylinder(_, radius) => [angle * radius, other],
            Self::Cone(_, half) => {
                let (sin, cos) = (angle * half.sin()).sin_cos();
                [other * cos, other * sin]
            }
            Self::Torus(_, major, minor) => [angle * major, conformal(major, minor, other)],
        }
    }

    /// The point of an angle and the other coordinate.
    pub(super) fn at(&self, [angle, other]: [f64; 2]) -> Point {
        let [wide, high] = match self {
            Self::Cylinder(_, radius) => [*radius, other],
            Self::Cone(_, half) => [other * half.sin(), other * half.cos()],
            Self::Torus(_, major, minor) => [major + minor * other.cos(), minor * other.sin()],
        };
        self.frame().outside([wide * angle.cos(), wide * angle.sin(), high])
    }

    fn point(&self, [x, y]: [f64; 2]) -> Point {
        match self {
            Self::Cylinder(_, radius) => self.at([x / radius, y]),
            // The x-axis is in the middle of the sector, so that no angle of it is cut.
            Self::Cone(_, half) => self.at([y.atan2(x) / half.sin(), x.hypot(y)]),
            Self::Torus(_, major, minor) => self.at([x / major, opened(*major, *minor, y)]),
        }
    }
}

/// The height in a map of a torus that is true to angles: the integral of `major · minor / (major + minor · cos t)`.
fn conformal(major: f64, minor: f64, angle: f64) -> f64 {
    let root = ((major - minor) * (major + minor)).sqrt();
    let turns = (angle / TAU).round();
    let rest = angle - turns * TAU;
    2.0 * major * minor / root * (((major - minor) / (major + minor)).sqrt() * (0.5 * rest).tan()).atan()
        + turns * TAU * major * minor / root
}

fn opened(major: f64, minor: f64, height: f64) -> f64 {
    let root = ((major - minor) * (major + minor)).sqrt();
    let half = 0.5 * height * root / (major * minor);
    let turns = (half / (0.5 * TAU)).round();
    2.0 * (((major + minor) / (major - minor)).sqrt() * (half - turns * 0.5 * TAU).tan()).atan() + turns * TAU
}

impl Chart {
    /// The chart of a carrier.
    pub(super) fn of(carrier: &Elementary) -> Self {
        match *carrier {
            Elementary::Plane(frame) => Self::Plane(frame),
            Elementary::Sphere { frame, radius } => Self::Sphere(frame, radius),
            Elementary::Cylinder { frame, radius } => Self::Turned(Turned::Cylinder(frame, radius)),
            Elementary::Cone { frame, slope } => Self::Turned(Turned::Cone(frame, slope.atan())),
            Elementary::Torus { frame, major, minor } => Self::Turned(Turned::Torus(frame, major, minor)),
        }
    }

    /// The place of a point; not of surfaces whose points have parameters.
    pub(super) fn flat(&self, point: Point) -> [f64; 2] {
        match self {
            Self::Plane(frame) | Self::Heights(frame, _) => {
                let [x, y, _] = frame.inside(point);
                [x, y]
            }
            Self::Sphere(frame, radius) => {
                let [x, y, z] = frame.inside(point);
                let share = 2.0 * radius / (x.hypot(y).hypot(z) + z).max(1e-9 * radius);
                [x * share, y * share]
            }
            Self::Turned(turned) => turned.flat(turned.coordinates(point)),
            Self::Coons(..) | Self::Disc(..) | Self::Fan(..) => [0.0; 2],
        }
    }

    /// The point of a place.
    pub(super) fn point(&self, place: [f64; 2]) -> Point {
        match self {
            Self::Plane(frame) => frame.outside([place[0], place[1], 0.0]),
            Self::Sphere(frame, radius) => {
                let [x, y] = place.each(|x| 0.5 * x / radius);
                let share = radius / (1.0 + x * x + y * y);
                frame.outside(scale([2.0 * x, 2.0 * y, 1.0 - x * x - y * y], share))
            }
            Self::Turned(turned) => turned.point(place),
            Self::Coons(coons, form) => coons.point_and_derivatives(form.parameters(place)).0,
            Self::Disc(curve, centre, radius) => {
                let [x, y] = place;
                let around = y.atan2(x).rem_euclid(TAU) / TAU;
                between(*centre, curve.point_and_derivative(around).0, x.hypot(y) / radius)
            }
            Self::Fan(fan) => fan.point(place),
            Self::Heights(frame, plate) => {
                frame.outside([place[0], place[1], plate.as_ref().map_or(0.0, |plate| plate.height(place))])
            }
        }
    }

    /// The longest edge whose middle is no farther than a distance from the surface, and along which it turns no more than an
    /// angle.
    pub(super) fn longest(&self, chord: f64, angle: f64) -> f64 {
        let bent = |radius: f64| (8.0 * chord * radius).sqrt().min(angle * radius);
        match self {
            Self::Plane(_) | Self::Heights(..) | Self::Disc(..) | Self::Fan(..) => f64::INFINITY,
            Self::Sphere(_, radius) | Self::Turned(Turned::Cylinder(_, radius)) => bent(*radius),
            // Its radius changes: where its outline is decides.
            Self::Turned(Turned::Cone(..)) => f64::INFINITY,
            Self::Turned(Turned::Torus(_, major, minor)) => bent(minor.min(major - minor).max(0.1 * minor)),
            Self::Coons(coons, form) => sagging(coons, *form, chord),
        }
    }
}

/// The edge of a Coons surface that sags by no more than a distance, by how far the middles of its cells are from those of the
/// lines across; no less than 1/64 of the mean side.
fn sagging(coons: &Coons, form: Form, chord: f64) -> f64 {
    const CELLS: u32 = 4;
    let ts: Vec<f64> = (0..=2 * CELLS).map(|i| f64::from(i) / f64::from(2 * CELLS)).collect();
    let rows = coons.grid(&ts, &ts);
    let get = |i: usize, j: usize| rows.get(i).and_then(|row| row.get(j)).map(|(point, _)| *point).unwrap_or_default();
    let mut longest = f64::INFINITY;
    for (i, j) in (0..CELLS as usize).flat_map(|i| (0..CELLS as usize).map(move |j| (2 * i + 1, 2 * j + 1))) {
        let middle = get(i, j);
        let lines = [
            [get(i - 1, j), get(i + 1, j)],
            [get(i, j - 1), get(i, j + 1)],
            [get(i - 1, j - 1), get(i + 1, j + 1)],
            [get(i + 1, j - 1), get(i - 1, j + 1)],
        ];
        for [a, b] in lines {
            let sag = plain_norm(add(scale(add(a, b), 0.5), scale(middle, -1.0)));
            let across = add(b, scale(a, -1.0));
            if sag > 0.0 {
                longest = longest.min((dot(across, across) * chord / sag).sqrt());
            }
        }
    }
    let sum = |[a, b]: [Point; 2]| plain_norm(add(b, scale(a, -1.0)));
    let last = 2 * CELLS as usize;
    let around = [[(0, 0), (last, 0)], [(last, 0), (last, last)], [(last, last), (0, last)], [(0, last), (0, 0)]];
    let mean = around.iter().map(|pair| sum(pair.each(|(i, j)| get(i, j)))).sum::<f64>() / 4.0;
    let longest = longest.max(mean / 64.0);
    if matches!(form, Form::Trapezoid { .. }) { longest } else { 0.7 * longest }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curves::vector::distance;

    /// Charts and their inverses cancel, on and off the middle.
    #[test]
    fn charts_are_inverted() {
        let frame = Frame::around([1.0, 2.0, 3.0], [0.6, 0.0, 0.8]);
        for carrier in [
            Elementary::Plane(frame),
            Elementary::Sphere { frame, radius: 2.0 },
            Elementary::Cylinder { frame, radius: 2.0 },
            Elementary::Cone { frame, slope: 0.7 },
            Elementary::Torus { frame, major: 5.0, minor: 2.0 },
        ] {
            let chart = Chart::of(&carrier);
            for place in [[0.3, 0.4], [1.0, -0.7], [2.0, 1.5]] {
                let point = chart.point(place);
                assert!(carrier.distance(point) < 1e-12, "{carrier:?}");
                let back = chart.flat(point);
                assert!((back[0] - place[0]).hypot(back[1] - place[1]) < 1e-12, "{carrier:?} {back:?} {place:?}");
            }
        }
        for form in [
            Form::Trapezoid { widths: [2.0, 3.0], height: 2.0, shear: 0.4, is_turned: false },
            Form::Trapezoid { widths: [2.0, 0.0], height: 1.0, shear: 0.4, is_turned: true },
            Form::Lens([3.0, 1.0]),
        ] {
            let [u, v] = form.parameters(form.flat([0.3, 0.8]));
            assert!((u - 0.3).hypot(v - 0.8) < 1e-12);
        }
    }

    /// In the map of a torus, a small step around and a small step in the tube have the same scale.
    #[test]
    fn the_map_of_a_torus_keeps_angles() {
        let chart = Chart::of(&Elementary::Torus { frame: Frame::around([0.0; 3], [0.0, 0.0, 1.0]), major: 3.0, minor: 2.5 });
        for place in [[0.0, 0.0], [1.0, 4.0], [2.0, -20.0]] {
            let step = |x: f64, y: f64| distance(chart.point(place), chart.point([place[0] + x, place[1] + y]));
            assert!((step(1e-5, 0.0) / step(0.0, 1e-5) - 1.0).abs() < 1e-4);
        }
    }
}
