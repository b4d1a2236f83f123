//! Surfaces of an equation: planes, cylinders, cones, spheres and tori (the elementary surfaces of ISO 10303-42).

use crate::curves::vector::{Affine, Point, add, cross, distance, dot, norm, scale, sub, unit};
use crate::util::each::Each;

/// An origin and three axes, each of length 1 and perpendicular to the others, right-handed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// The origin.
    pub origin: Point,
    /// Axes x, y and z.
    pub axes: [Point; 3],
}

impl Frame {
    /// A frame with this direction (of length 1) for its z-axis.
    pub(crate) fn around(origin: Point, z: Point) -> Self {
        let mut least = [0.0; 3];
        let smallest = z.iter().enumerate().min_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).map_or(0, |(at, _)| at);
        least.iter_mut().skip(smallest).take(1).for_each(|x| *x = 1.0);
        let x = unit(cross(least, z)).unwrap_or([1.0, 0.0, 0.0]);
        Self { origin, axes: [x, cross(z, x), z] }
    }

    /// Coordinates in this frame.
    #[must_use]
    pub fn inside(&self, point: Point) -> Point {
        let offset = sub(point, self.origin);
        self.axes.each(|axis| dot(offset, axis))
    }

    /// The point of coordinates in this frame.
    #[must_use]
    pub fn outside(&self, [x, y, z]: Point) -> Point {
        let [a, b, c] = self.axes;
        add(self.origin, add(add(scale(a, x), scale(b, y)), scale(c, z)))
    }
}

/// A surface of an equation, without bounds.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Elementary {
    /// `z = 0` of a frame.
    Plane(Frame),
    /// Around the z-axis of a frame.
    Cylinder {
        /// Its origin is on the axis.
        frame: Frame,
        /// Of the circle.
        radius: f64,
    },
    /// Around the z-axis of a frame, its apex the origin, the surface above it.
    Cone {
        /// The apex and the axis.
        frame: Frame,
        /// Distance from the axis at the height 1.
        slope: f64,
    },
    /// Around a centre, the origin of a frame whose z-axis is the direction of the outline's middle.
    Sphere {
        /// The centre.
        frame: Frame,
        /// Of the sphere.
        radius: f64,
    },
    /// Around the z-axis of a frame, symmetric to its plane.
    Torus {
        /// The centre and the axis.
        frame: Frame,
        /// From the axis to the middle of the tube.
        major: f64,
        /// Of the tube.
        minor: f64,
    },
}

impl Elementary {
    /// The cone with an apex on the axis of a frame, whose distance from the axis grows by so much with the height; it is below the apex if that is negative.
    pub(crate) fn cone(apex: Point, axis: &Frame, growth: f64) -> Self {
        let [x, y, z] = axis.axes;
        // The surface is above the apex of its own frame.
        let axes = if growth > 0.0 { [x, y, z] } else { [x, scale(y, -1.0), scale(z, -1.0)] };
        Self::Cone { frame: Frame { origin: apex, axes }, slope: growth.abs() }
    }

    /// A word for it.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Plane(_) => "plane",
            Self::Cylinder { .. } => "cylinder",
            Self::Cone { .. } => "cone",
            Self::Sphere { .. } => "sphere",
            Self::Torus { .. } => "torus",
        }
    }

    /// How far a point is from it.
    #[must_use]
    pub fn distance(&self, point: Point) -> f64 {
        match self {
            Self::Plane(frame) => frame.inside(point)[2].abs(),
            Self::Cylinder { frame, radius } => (round(frame, point)[0] - radius).abs(),
            Self::Cone { frame, slope } => {
                let [wide, high] = round(frame, point);
                (wide - high * slope).abs() / slope.hypot(1.0)
            }
            Self::Sphere { frame, radius } => (distance(point, frame.origin) - radius).abs(),
            Self::Torus { frame, major, minor } => {
                let [wide, high] = round(frame, point);
                ((wide - major).hypot(high) - minor).abs()
            }
        }
    }
}

impl Elementary {
    /// A vector across it at a point that is on it; `None` where it has none, as at an apex.
    pub(crate) fn normal(&self, point: Point) -> Option<Point> {
        let outside = |frame: &Frame, vector: Point| sub(frame.outside(vector), frame.origin);
        let (Self::Plane(frame)
        | Self::Cylinder { frame, .. }
        | Self::Cone { frame, .. }
        | Self::Sphere { frame, .. }
        | Self::Torus { frame, .. }) = self;
        let [x, y, z] = frame.inside(point);
        let wide = x.hypot(y);
        let vector = match self {
            Self::Plane(_) => [0.0, 0.0, 1.0],
            Self::Cylinder { .. } => [x, y, 0.0],
            Self::Cone { slope, .. } => [x, y, -slope * wide],
            Self::Sphere { .. } => [x, y, z],
            Self::Torus { major, .. } => [x * (1.0 - major / wide), y * (1.0 - major / wide), z],
        };
        unit(outside(frame, vector))
    }
}

impl Elementary {
    /// It behind a map that keeps angles; `None` behind any other one. O(1).
    pub(crate) fn transformed(self, map: &Affine) -> Option<Self> {
        let columns = map.columns();
        let size = norm(columns[0]);
        let is_similar = (0..3).all(|at| {
            let [one, next] = [columns[at], columns[(at + 1) % 3]];
            (norm(one) - size).abs() <= SIMILAR * size && dot(one, next).abs() <= SIMILAR * size * size
        });
        if !is_similar || !map.is_finite() || size == 0.0 {
            return None;
        }
        let moved = |frame: Frame| {
            let [x, _, z] = frame.axes.map(|axis| scale(map.vector(axis), 1.0 / size));
            // Right-handed, of a map that mirrors, too.
            Frame { origin: map.point(frame.origin), axes: [x, cross(z, x), z] }
        };
        Some(match self {
            Self::Plane(frame) => Self::Plane(moved(frame)),
            Self::Cylinder { frame, radius } => Self::Cylinder { frame: moved(frame), radius: size * radius },
            Self::Cone { frame, slope } => Self::Cone { frame: moved(frame), slope },
            Self::Sphere { frame, radius } => Self::Sphere { frame: moved(frame), radius: size * radius },
            Self::Torus { frame, major, minor } => Self::Torus { frame: moved(frame), major: size * major, minor: size * minor },
        })
    }
}

/// How much a map may differ from one that keeps angles: rounding of files.
const SIMILAR: f64 = 1e-9;

/// The surface that a file says for a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Told {
    /// The surface, without the bounds of the face.
    pub surface: Elementary,
    /// Whether the boundary of the face has it to its left, as seen from outside (from above, of a plane); `None` where the file does not say it.
    pub is_left: Option<bool>,
}

impl Told {
    /// Whether the surface has no end, so that faces of it may have no boundary, and a boundary has a part of it on both sides.
    pub(crate) fn is_closed(&self) -> bool {
        matches!(self.surface, Elementary::Sphere { .. } | Elementary::Torus { .. })
    }

    /// Whether the file does not say which of both parts of it is the face.
    pub(crate) fn is_ambiguous(&self) -> bool {
        self.is_closed() && self.is_left.is_none()
    }

    /// It behind a map that keeps angles; `None` behind any other one.
    pub(crate) fn transformed(self, map: &Affine) -> Option<Self> {
        let [x, y, z] = map.columns();
        let is_mirrored = dot(cross(x, y), z) < 0.0;
        Some(Self { surface: self.surface.transformed(map)?, is_left: self.is_left.map(|is_left| is_left != is_mirrored) })
    }
}

/// Distance from the axis of a frame, and height.
pub(crate) fn round(frame: &Frame, point: Point) -> [f64; 2] {
    let [x, y, z] = frame.inside(point);
    [x.hypot(y), z]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A point of a torus stays on it, and outside stays outside, behind a map that turns, mirrors and doubles; a map that stretches has no torus.
    #[test]
    fn surfaces_move_with_their_points() {
        let torus = Elementary::Torus { frame: Frame::around([1.0, 2.0, 3.0], [0.0, 0.6, 0.8]), major: 3.0, minor: 1.0 };
        let Elementary::Torus { frame, .. } = torus else { unreachable!() };
        let point = frame.outside([3.0 + 0.6, 0.0, 0.8]);
        let map = Affine::from_axes([[0.0, 2.0, 0.0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0]], [5.0, 6.0, 7.0]);
        let moved = torus.transformed(&map).unwrap();
        assert!(torus.distance(point) < 1e-14 && moved.distance(map.point(point)) < 1e-13);
        let normal = scale(map.vector(torus.normal(point).unwrap()), 0.5);
        assert!(distance(moved.normal(map.point(point)).unwrap(), normal) < 1e-13);
        let told = Told { surface: torus, is_left: Some(true) };
        assert_eq!(told.transformed(&map).and_then(|told| told.is_left), Some(false));
        assert!(torus.transformed(&Affine::from_axes([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 2.0]], [0.0; 3])).is_none());
    }
}
