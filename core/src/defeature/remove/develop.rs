//! Surfaces laid out in the plane.

use super::super::surface::{Surface, meridian, radial};
use super::super::vector::{Point, add, cross, dot, frame, mean, scale, sub, unit};

/// A map of a surface to the plane that turns what is seen counter-clockwise from outside into the same.
pub(super) struct Map {
    surface: Surface,
    is_concave: bool,
    origin: Point,
    axes: [Point; 2],
    kind: MapKind,
}

#[derive(Clone, Copy, PartialEq)]
enum MapKind {
    /// A plane's coordinates.
    Flat,
    /// A cylinder or cone cut open opposite to where the points lie.
    Cut,
    /// A cylinder or cone seen along its axis, the first stretched by exp(height / unit).
    Polar(f64),
    /// A sphere seen from the point opposite to where the points lie.
    Stereographic,
}

impl Map {
    /// A map that suits directed edges (pairs of indices into `points`): cut open if no edge crosses the cut, else polar.
    /// `None` of surfaces that have neither.
    pub(super) fn new(surface: Surface, is_concave: bool, points: &[Point], edges: &[(usize, usize)]) -> Option<Self> {
        let middle = mean(points);
        let (origin, axes) = match surface {
            Surface::Plane { normal, .. } => {
                return Some(Self { surface, is_concave, origin: middle, axes: frame(normal), kind: MapKind::Flat });
            }
            Surface::Cylinder { origin, axis, .. } | Surface::Cone { apex: origin, axis, .. } => {
                let towards = unit(radial(origin, axis, middle)).unwrap_or(frame(axis)[0]);
                (origin, [towards, cross(axis, towards)])
            }
            Surface::Sphere { centre, .. } => {
                let axes = frame(unit(sub(middle, centre))?);
                return Some(Self { surface, is_concave, origin: centre, axes, kind: MapKind::Stereographic });
            }
            Surface::Torus { .. } => return None,
        };
        let mut map = Self { surface, is_concave, origin, axes, kind: MapKind::Cut };
        let angles: Vec<f64> = points.iter().map(|p| map.angle(*p)).collect();
        if edges.iter().any(|(a, b)| (angles[*a] - angles[*b]).abs() > std::f64::consts::PI) {
            let heights = points.iter().map(|p| map.height(*p));
            let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
            let radius = surface.radius().unwrap_or(1.0);
            map.kind = MapKind::Polar(radius.max((high - low) / 6.0));
            if let (Surface::Cylinder { .. }, Some((_, axis))) = (surface, surface.axis()) {
                map.origin = add(origin, scale(axis, (low + high) / 2.0));
            }
        }
        Some(map)
    }

    fn angle(&self, point: Point) -> f64 {
        let d = sub(point, self.origin);
        dot(d, self.axes[1]).atan2(dot(d, self.axes[0]))
    }

    fn height(&self, point: Point) -> f64 {
        self.surface.axis().map_or(0.0, |(_, axis)| dot(sub(point, self.origin), axis))
    }

    /// Whether the map shows the whole turn around an axis.
    pub(super) fn is_polar(&self) -> bool {
        matches!(self.kind, MapKind::Polar(_))
    }

    /// Whether the surface is a plane.
    pub(super) fn is_flat(&self) -> bool {
        self.kind == MapKind::Flat
    }

    /// The image of a point.
    pub(super) fn image(&self, point: Point) -> [f64; 2] {
        let [u, v] = match (self.kind, self.surface) {
            (MapKind::Flat, _) => {
                let d = sub(point, self.origin);
                [dot(d, self.axes[0]), dot(d, self.axes[1])]
            }
            (MapKind::Cut, Surface::Cylinder { radius, .. }) => [radius * self.angle(point), self.height(point)],
            (MapKind::Polar(unit), Surface::Cylinder { .. }) => {
                let (far, angle) = (unit * (self.height(point) / unit).exp(), self.angle(point));
                [far * angle.cos(), -far * angle.sin()]
            }
            (kind, Surface::Cone { apex, axis, angle }) => {
                let [h, r] = meridian(apex, axis, point);
                let far = h.hypot(r);
                let turn = self.angle(point) * if kind == MapKind::Cut { angle.sin() } else { 1.0 };
                [far * turn.cos(), -far * turn.sin()]
            }
            (_, Surface::Sphere { radius, .. }) => {
                let d = sub(point, self.origin);
                let far = 2.0 * radius / (radius + dot(d, cross(self.axes[0], self.axes[1]))).max(1e-300);
                [far * dot(d, self.axes[0]), far * dot(d, self.axes[1])]
            }
            _ => [0.0; 2],
        };
        if self.is_concave { [-u, v] } else { [u, v] }
    }

    /// The point of the surface whose image this is, for spheres and maps that are cut open.
    pub(super) fn point(&self, [u, v]: [f64; 2]) -> Option<Point> {
        let u = if self.is_concave { -u } else { u };
        if let Surface::Sphere { radius, .. } = self.surface {
            let [s, t] = [u, v].map(|x| x / (2.0 * radius));
            let by = radius / (1.0 + s * s + t * t);
            let across = add(scale(self.axes[0], 2.0 * s * by), scale(self.axes[1], 2.0 * t * by));
            let up = scale(cross(self.axes[0], self.axes[1]), by * (1.0 - s * s - t * t));
            return Some(add(self.origin, add(across, up)));
        }
        let ((turn, h, r), (_, axis)) = match (self.kind, self.surface) {
            (MapKind::Cut, Surface::Cylinder { radius, .. }) => ((u / radius, v, radius), self.surface.axis()?),
            (MapKind::Cut, Surface::Cone { angle, .. }) => {
                let far = u.hypot(v);
                (((-v).atan2(u) / angle.sin(), far * angle.cos(), far * angle.sin()), self.surface.axis()?)
            }
            _ => return None,
        };
        let away = add(scale(self.axes[0], r * turn.cos()), scale(self.axes[1], r * turn.sin()));
        Some(add(add(self.origin, scale(axis, h)), away))
    }
}
