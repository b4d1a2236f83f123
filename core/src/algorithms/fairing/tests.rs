//! Holes in surfaces of which every point is known.

use glam::{DVec2, DVec3};
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

use super::sheet::edges;
use super::*;
use crate::algorithms::triangulate::{FillSettings, Rim, triangulate};

mod coons;

/// A surface that is known everywhere.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Surface {
    /// Radius 1.
    Sphere,
    /// Radii 1 and 0.4, on its outer side.
    TorusOutside,
    /// And on its inner side.
    TorusInside,
    /// z = (x² − y²)/2.
    Saddle,
    Plane,
    /// Of radius 1 along y.
    Cylinder,
    /// Two planes that meet along y.
    Roof,
}

const SLOPE: f64 = 0.7;

const TUBE: f64 = 0.4;

impl Surface {
    fn size(self) -> f64 {
        if matches!(self, Self::TorusInside | Self::TorusOutside) { TUBE } else { 1.0 }
    }

    /// Where a point of the plane lies; lengths near the origin stay about the same.
    fn at(self, p: DVec2) -> DVec3 {
        match self {
            Self::Sphere => {
                let r = p.length();
                let ring = if r > 0.0 { p * (r.sin() / r) } else { p };
                DVec3::new(ring.x, ring.y, r.cos())
            }
            Self::TorusOutside | Self::TorusInside => {
                let (big, start) =
                    if self == Self::TorusOutside { (1.0 + TUBE, 0.0) } else { (1.0 - TUBE, std::f64::consts::PI) };
                let (u, v) = (p.x / big * if start == 0.0 { 1.0 } else { -1.0 }, p.y / TUBE + start);
                let r = 1.0 + TUBE * v.cos();
                let v_sin = TUBE * v.sin() * if start == 0.0 { 1.0 } else { -1.0 };
                DVec3::new(r * u.cos(), r * u.sin(), v_sin)
            }
            Self::Saddle => DVec3::new(p.x, p.y, 0.5 * (p.x * p.x - p.y * p.y)),
            Self::Plane => DVec3::new(p.x, p.y, 0.0),
            Self::Cylinder => DVec3::new(p.x.sin(), p.y, p.x.cos()),
            Self::Roof => DVec3::new(p.x, p.y, -SLOPE * p.x.abs()),
        }
    }

    /// Signed distance (of the saddle: to first order) and normal.
    fn distance(self, p: DVec3) -> (f64, DVec3) {
        match self {
            Self::Sphere => (p.length() - 1.0, p.normalize()),
            Self::TorusOutside | Self::TorusInside => {
                let ring = DVec3::new(p.x, p.y, 0.0).normalize();
                let off = p - ring;
                (off.length() - TUBE, off.normalize())
            }
            Self::Saddle => {
                let n = DVec3::new(-p.x, p.y, 1.0);
                ((p.z - 0.5 * (p.x * p.x - p.y * p.y)) / n.length(), n.normalize())
            }
            Self::Plane => (p.z, DVec3::Z),
            Self::Cylinder => {
                let r = DVec3::new(p.x, 0.0, p.z);
                (r.length() - 1.0, r.normalize())
            }
            Self::Roof => {
                let n = DVec3::new(SLOPE * p.x.signum(), 0.0, 1.0).normalize();
                (n.dot(p), n)
            }
        }
    }
}

/// A mesh with a hole, its rim's vertices in the direction of the patch.
struct Case {
    surface: Surface,
    positions: Vec<Point>,
    around: Vec<[u32; 3]>,
    rims: Vec<Vec<u32>>,
}

/// Numbers that look random, the same everywhere.
struct Noise(u64);

impl Noise {
    /// Within ±1.
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

impl Case {
    /// A round hole of `radius`, in a mesh of edges of about `edge` that are jittered, its rim sampled `sampling` times as coarsely.
    fn round(surface: Surface, radius: f64, edge: f64, sampling: f64) -> Self {
        Self::rough(surface, radius, edge, sampling, 0.0)
    }

    /// The same with each vertex off by `rough` edges.
    fn rough(surface: Surface, radius: f64, edge: f64, sampling: f64, rough: f64) -> Self {
        let outer = radius + 6.0 * edge;
        let count = ((2.0 * std::f64::consts::PI * radius / (edge * sampling)).round() as usize).max(4);
        // A roof's ridge has vertices of the rim at its ends.
        let (count, turn) = if surface == Surface::Roof { (count.next_multiple_of(4), 0.0) } else { (count, 0.3) };
        let circle: Vec<DVec2> = (0..count)
            .map(|i| {
                let angle = (i as f64 + turn) * 2.0 * std::f64::consts::PI / count as f64;
                DVec2::new(radius * angle.cos(), radius * angle.sin())
            })
            .collect();
        let mut noise = Noise(count as u64);
        let mut plane: Vec<DVec2> = circle.clone();
        let step = edge * 3.0_f64.sqrt() / 2.0;
        let rows = (outer / step).ceil() as i32;
        for j in -rows..=rows {
            for i in -rows * 2..=rows * 2 {
                let p = DVec2::new((f64::from(i) + 0.5 * f64::from(j.rem_euclid(2))) * edge, f64::from(j) * step);
                let mut p = p + DVec2::new(noise.next(), noise.next()) * (0.2 * edge);
                if surface == Surface::Roof && p.x.abs() < 0.6 * edge {
                    // One of each row comes to lie on the ridge.
                    if i != 0 {
                        continue;
                    }
                    p = DVec2::new(0.0, f64::from(j) * step);
                }
                let apart =
                    (0..count).map(|k| segment_distance(p, circle[k], circle[(k + 1) % count])).fold(f64::INFINITY, f64::min);
                if p.length() < outer && !inside(p, &circle) && apart > 0.6 * edge * sampling.clamp(0.7, 1.0) {
                    plane.push(p);
                }
            }
        }
        let mut mesh = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
        let handles: Vec<_> = plane.iter().map(|p| mesh.insert(Point2::new(p.x, p.y)).unwrap()).collect();
        for k in 0..count {
            mesh.add_constraint(handles[k], handles[(k + 1) % count]);
        }
        let around: Vec<[u32; 3]> = mesh
            .inner_faces()
            .map(|face| face.vertices().map(|v| v.index() as u32))
            .filter(|t| {
                let middle = t.iter().map(|&v| plane[v as usize]).sum::<DVec2>() / 3.0;
                !inside(middle, &circle)
            })
            .collect();
        let positions = plane
            .iter()
            .map(|p| surface.at(*p) + DVec3::new(noise.next(), noise.next(), noise.next()) * (rough * edge))
            .map(|p| [p.x as f32, p.y as f32, p.z as f32])
            .collect();
        Self { surface, positions, around, rims: vec![(0..count as u32).collect()] }
    }

    fn coarse(&self) -> Vec<[u32; 3]> {
        let points: Vec<Point> = self.rims[0].iter().map(|&v| self.positions[v as usize]).collect();
        let apexes: Vec<Option<Point>> = (0..points.len())
            .map(|k| {
                let (a, b) = (self.rims[0][k], self.rims[0][(k + 1) % points.len()]);
                let t = self.around.iter().find(|t| edges(**t).contains(&[b, a]))?;
                t.iter().find(|&&v| v != a && v != b).map(|&v| self.positions[v as usize])
            })
            .collect();
        let rim = Rim { points: &points, apexes: &apexes, obstacles: &[], forbidden: &|_, _| false };
        let patch = triangulate(&rim, &FillSettings::default()).unwrap();
        patch.triangles.iter().map(|t| t.map(|v| self.rims[0][v as usize])).collect()
    }

    fn shaped(&self, patch: &[[u32; 3]], settings: &ShapeSettings) -> Result<Shaped, Unshaped> {
        let (positions, around, patch) = self.cut(patch);
        shape(&CoarsePatch { positions: &positions, patch: &patch, around: &around }, settings)
    }

    /// As the caller gives it: three rings. Numbers stay.
    fn cut(&self, patch: &[[u32; 3]]) -> (Vec<Point>, Vec<[u32; 3]>, Vec<[u32; 3]>) {
        let mut near = vec![false; self.positions.len()];
        for &v in self.rims.iter().flatten() {
            near[v as usize] = true;
        }
        let mut around = Vec::new();
        for _ in 0..3 {
            around = self.around.iter().filter(|t| t.iter().any(|&v| near[v as usize])).copied().collect();
            for &v in around.iter().flatten() {
                near[v as usize] = true;
            }
        }
        (self.positions.clone(), around, patch.to_vec())
    }

    /// Largest distance of the new vertices from the surface, and largest angle between normals at the rim and the surface's, in degrees.
    fn errors(&self, shaped: &Shaped) -> (f64, f64) {
        let position =
            |v: u32| at(self.positions.get(v as usize).unwrap_or_else(|| &shaped.added[v as usize - self.positions.len()]));
        let far = shaped.added.iter().map(|p| self.surface.distance(at(p)).0.abs()).fold(0.0, f64::max);
        let mut normals = vec![DVec3::ZERO; self.positions.len() + shaped.added.len()];
        for t in shaped.triangles.iter().chain(&self.around) {
            for k in 0..3 {
                let [a, b, c] = [t[k], t[(k + 1) % 3], t[(k + 2) % 3]].map(position);
                let (u, v) = ((b - a).normalize(), (c - a).normalize());
                normals[t[k] as usize] += u.cross(v).normalize() * u.dot(v).acos();
            }
        }
        let tilt = |v: u32| {
            let n = self.surface.distance(position(v)).1;
            normals[v as usize].normalize().dot(n).min(1.0).acos().to_degrees()
        };
        (far, self.rims.iter().flatten().map(|&v| tilt(v)).fold(0.0, f64::max))
    }
}

fn segment_distance(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
    p.distance(a + (b - a) * t)
}

fn inside(p: DVec2, polygon: &[DVec2]) -> bool {
    let n = polygon.len();
    (0..n).all(|k| (polygon[(k + 1) % n] - polygon[k]).perp_dot(p - polygon[k]) >= 0.0)
}

const SURFACES: [Surface; 4] = [Surface::Sphere, Surface::TorusOutside, Surface::TorusInside, Surface::Saddle];

/// A cylinder of radius 1 with a ring missing, bridged straight across.
fn bridged(count: usize, gap: f64, edge: f64) -> (Case, Vec<[u32; 3]>) {
    let mut positions = Vec::new();
    let mut noise = Noise(7);
    let mut around = Vec::new();
    let rows = 6;
    let angle = 2.0 * std::f64::consts::PI / count as f64;
    for side in [1.0, -1.0] {
        let base = positions.len() as u32;
        for j in 0..rows {
            for i in 0..count {
                let jitter = if j == 0 { 0.0 } else { 0.1 };
                let u = (i as f64 + 0.5 * f64::from(j % 2) + jitter * noise.next()) * angle;
                let v = side * (0.5 * gap + edge * (f64::from(j) + jitter * noise.next()));
                let p = Surface::Cylinder.at(DVec2::new(u, v));
                positions.push([p.x as f32, p.y as f32, p.z as f32]);
            }
        }
        for j in 0..rows - 1 {
            for i in 0..count as u32 {
                let n = count as u32;
                let (a, b) = (base + j * n + i, base + j * n + (i + 1) % n);
                let (c, d) = (a + n, b + n);
                let two = if j % 2 == 0 { [[a, b, c], [c, b, d]] } else { [[a, b, d], [a, d, c]] };
                around.extend(two.map(|[a, b, c]| if side > 0.0 { [a, b, c] } else { [a, c, b] }));
            }
        }
    }
    let (n, other) = (count as u32, (rows as usize * count) as u32);
    let patch = (0..n)
        .flat_map(|i| {
            let (a, b) = (i, (i + 1) % n);
            [[a, other + a, b], [other + a, other + b, b]]
        })
        .collect();
    let case = Case { surface: Surface::Cylinder, positions, around, rims: vec![(0..n).collect(), (other..other + n).collect()] };
    (case, patch)
}

#[test]
fn two_rims_are_joined_by_what_continues_both() {
    let edge = 2.0 * std::f64::consts::PI / 200.0;
    let (case, patch) = bridged(200, 4.0 * edge, edge);
    let shaped = case.shaped(&patch, &ShapeSettings::default()).unwrap();
    let (far, tilt) = case.errors(&shaped);
    assert!(shaped.added.len() > 300 && far < 0.1 * edge * edge / 8.0 && tilt < 0.5, "{far} {tilt}");
}

#[test]
fn position_tangent_and_curvature_go_on_however_the_rim_is_sampled() {
    for surface in SURFACES {
        for (share, sampling) in [(0.05, 1.0), (0.2, 0.5), (0.2, 4.0), (0.4, 0.5), (0.4, 1.0), (0.4, 4.0)] {
            let radius = share * surface.size();
            let edge = (0.05 * surface.size()).min(radius / 4.0);
            let case = Case::round(surface, radius, edge, sampling);
            let shaped = case.shaped(&case.coarse(), &ShapeSettings::default()).unwrap();
            let (far, tilt) = case.errors(&shaped);
            let chord = edge * edge / 8.0 / surface.size();
            assert!(far < 2.0 * chord && tilt < 2.0, "{surface:?} {share} {sampling}: {far} of {chord}, {tilt}");
        }
    }
}

#[test]
fn the_implicit_surface_goes_on_too() {
    for surface in SURFACES {
        let radius = 0.2 * surface.size();
        let case = Case::round(surface, radius, radius / 4.0, 1.0);
        let settings = ShapeSettings { method: Method::Implicit, ..ShapeSettings::default() };
        let (far, tilt) = case.errors(&case.shaped(&case.coarse(), &settings).unwrap());
        assert!(far < radius * radius / 64.0 / surface.size() && tilt < 2.0, "{surface:?}: {far}, {tilt}");
    }
}

#[test]
fn noise_does_not_grow() {
    for surface in SURFACES {
        let radius = 0.3 * surface.size();
        let case = Case::rough(surface, radius, radius / 6.0, 1.0, 0.02);
        let shaped = case.shaped(&case.coarse(), &ShapeSettings::default()).unwrap();
        let (far, _) = case.errors(&shaped);
        assert!(far < 0.1 * radius / 6.0, "{surface:?}: {far}");
    }
}

#[test]
fn what_is_flat_stays_flat() {
    for sampling in [0.5, 1.0, 4.0] {
        let case = Case::round(Surface::Plane, 1.0, 0.2, sampling);
        let shaped = case.shaped(&case.coarse(), &ShapeSettings::default()).unwrap();
        let (far, tilt) = case.errors(&shaped);
        assert!(far < 1e-6 && tilt < 1e-4 && shaped.added.iter().all(|p| p[0] * p[0] + p[1] * p[1] < 1.0), "{far} {tilt}");
    }
}

#[test]
fn a_ridge_goes_on_through_the_hole() {
    for sampling in [0.5, 1.0, 2.0] {
        let case = Case::round(Surface::Roof, 1.0, 0.2, sampling);
        let shaped = case.shaped(&case.coarse(), &ShapeSettings::default()).unwrap();
        let (far, _) = case.errors(&shaped);
        let on_ridge = shaped.added.iter().filter(|p| p[0].abs() < 1e-6).count();
        assert!(far < 1e-6 && on_ridge > 4, "{sampling}: {far}, {on_ridge}");
    }
}

#[test]
fn two_ridges_go_on_through_one_hole() {
    // A step with rounded corners of no size: flat, down a slope of 60°, flat. The hole lies over both edges.
    let height = |x: i32| {
        if x <= 4 {
            0.0
        } else if x <= 8 {
            -1.75 * (x - 4) as f32
        } else {
            -7.0
        }
    };
    let n = 12;
    let at = |i: i32, j: i32| [i as f32, j as f32, height(i)];
    let positions: Vec<Point> = (0..=n).flat_map(|j| (0..=n).map(move |i| (i, j))).map(|(i, j)| at(i, j)).collect();
    let number = |i: i32, j: i32| (j * (n + 1) + i) as u32;
    let (hole, rest): (Vec<_>, Vec<_>) = (0..n)
        .flat_map(|j| (0..n).map(move |i| (i, j)))
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)];
            [((i, j), [a, b, c]), ((i, j), [a, c, d])]
        })
        .partition(|((i, j), _)| (3..9).contains(i) && (4..8).contains(j));
    let around: Vec<[u32; 3]> = rest.into_iter().map(|(_, t)| t).collect();
    assert_eq!(hole.len(), 48);
    let rim: Vec<u32> = (3..9)
        .map(|i| number(i, 4))
        .chain((4..8).map(|j| number(9, j)))
        .chain((4..=9).rev().map(|i| number(i, 8)))
        .chain((5..=8).rev().map(|j| number(3, j)))
        .collect();
    let points: Vec<Point> = rim.iter().map(|v| positions[*v as usize]).collect();
    let patch =
        triangulate(&Rim { points: &points, apexes: &[], obstacles: &[], forbidden: &|_, _| false }, &FillSettings::default())
            .unwrap();
    let patch: Vec<[u32; 3]> = patch.triangles.iter().map(|t| t.map(|v| rim[v as usize])).collect();
    let region = CoarsePatch { positions: &positions, patch: &patch, around: &around };
    let shaped = shape(&region, &ShapeSettings::default()).unwrap();
    for p in &shaped.added {
        let x = f64::from(p[0]);
        let z = if x <= 4.0 {
            0.0
        } else if x <= 8.0 {
            -1.75 * (x - 4.0)
        } else {
            -7.0
        };
        assert!((f64::from(p[2]) - z).abs() < 1e-5, "{p:?}");
    }
    for ridge in [4.0, 8.0] {
        assert!(shaped.added.iter().filter(|p| (p[0] - ridge).abs() < 1e-5).count() >= 2, "{ridge}");
    }
}

/// A cube of 6 x 6 squares a side; `keep` by the middle of each triangle.
fn cube(keep: impl Fn(DVec3) -> bool) -> (Vec<Point>, Vec<[u32; 3]>) {
    let n = 6;
    let mut positions: Vec<Point> = Vec::new();
    let mut triangles = Vec::new();
    for axis in 0..3 {
        for side in [0, n] {
            let mut number = |i: i32, j: i32| {
                let mut p = [0.0; 3];
                (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side as f32, i as f32, j as f32);
                positions.iter().position(|q| *q == p).unwrap_or_else(|| {
                    positions.push(p);
                    positions.len() - 1
                }) as u32
            };
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                let [a, b, c, d] = [number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)];
                for [a, b, c] in [[a, b, c], [a, c, d]] {
                    triangles.push(if side == 0 { [a, c, b] } else { [a, b, c] });
                }
            }
        }
    }
    triangles.retain(|t| keep(t.iter().map(|&v| at(&positions[v as usize])).sum::<DVec3>() / 3.0));
    (positions, triangles)
}

/// A fan over the only border: good enough for what is to be refused.
fn closed_by_fan(triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let all: Vec<[u32; 2]> = triangles.iter().flat_map(|t| edges(*t)).collect();
    let border: Vec<[u32; 2]> = all.iter().filter(|[a, b]| !all.contains(&[*b, *a])).copied().collect();
    let first = border[0][0];
    border.iter().filter(|e| !e.contains(&first)).map(|[a, b]| [first, *b, *a]).collect()
}

#[test]
fn a_lid_and_a_corner_are_not_made_round() {
    let (positions, around) = cube(|p| p.z < 6.0);
    let patch = closed_by_fan(&around);
    let region = CoarsePatch { positions: &positions, patch: &patch, around: &around };
    assert_eq!(shape(&region, &ShapeSettings::default()), Err(Unshaped::RimIsEdge));
    let (positions, around) = cube(|p| !(p.x > 4.0 && p.y > 4.0 && p.z > 4.0));
    let patch = closed_by_fan(&around);
    let region = CoarsePatch { positions: &positions, patch: &patch, around: &around };
    let refused = shape(&region, &ShapeSettings::default()).unwrap_err();
    assert!(matches!(refused, Unshaped::Creased | Unshaped::RimIsEdge), "{refused}");
}

#[test]
fn nothing_is_added_to_what_is_fine() {
    for count in 3..5 {
        let edge = 0.1;
        let radius = edge / (2.0 * (std::f64::consts::PI / f64::from(count)).sin());
        let case = Case::round(Surface::Sphere, radius, edge, 2.0 * std::f64::consts::PI * radius / edge / f64::from(count));
        assert_eq!(case.shaped(&case.coarse(), &ShapeSettings::default()), Err(Unshaped::NothingToAdd));
    }
}

#[test]
fn a_bound_makes_the_patch_coarser() {
    let case = Case::round(Surface::Sphere, 0.4, 0.03, 1.0);
    let free = case.shaped(&case.coarse(), &ShapeSettings::default()).unwrap();
    let settings = ShapeSettings { max_vertices: 60, ..ShapeSettings::default() };
    let bounded = case.shaped(&case.coarse(), &settings).unwrap();
    assert!(free.added.len() > 400 && bounded.added.len() <= 60, "{} {}", free.added.len(), bounded.added.len());
    assert!(case.errors(&bounded).0 < 0.01);
}

#[test]
fn without_any_surroundings_the_patch_is_what_it_was_or_a_membrane() {
    let case = Case::round(Surface::Sphere, 0.4, 0.05, 1.0);
    let patch = case.coarse();
    let region = CoarsePatch { positions: &case.positions, patch: &patch, around: &[] };
    if let Ok(shaped) = shape(&region, &ShapeSettings::default()) {
        assert!(shaped.added.iter().all(|p| p[2] > 0.5 && p[2] < 1.1));
    }
}
