//! Holes in surfaces of which every point is known.

use glam::{DVec2, DVec3};
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

use super::*;
use crate::fill::{FillSettings, Rim, triangulate};

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
}

const TUBE: f64 = 0.4;

impl Surface {
    fn size(self) -> f64 {
        if matches!(self, Self::TorusInside | Self::TorusOutside) { TUBE } else { 1.0 }
    }

    fn name(self) -> String {
        format!("{self:?}").to_lowercase()
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
    fn round(surface: Surface, radius: f64, edge: f64, sampling: f64, outer: f64) -> Self {
        let count = ((2.0 * std::f64::consts::PI * radius / (edge * sampling)).round() as usize).max(4);
        let circle: Vec<DVec2> = (0..count)
            .map(|i| {
                let angle = (i as f64 + 0.3) * 2.0 * std::f64::consts::PI / count as f64;
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
                let p = p + DVec2::new(noise.next(), noise.next()) * (0.2 * edge);
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
        let positions = plane.iter().map(|p| surface.at(*p)).map(|p| [p.x as f32, p.y as f32, p.z as f32]).collect();
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
        shape(&Region { positions: &positions, patch: &patch, around: &around }, settings)
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

fn write_stl(path: &std::path::Path, triangles: impl Iterator<Item = [Point; 3]>) {
    let mut out = vec![0_u8; 80];
    let triangles: Vec<_> = triangles.collect();
    out.extend((triangles.len() as u32).to_le_bytes());
    for t in triangles {
        out.extend([0; 12]);
        out.extend(t.iter().flatten().flat_map(|x| x.to_le_bytes()));
        out.extend([0; 2]);
    }
    std::fs::write(path, out).unwrap();
}

const SURFACES: [Surface; 4] = [Surface::Sphere, Surface::TorusOutside, Surface::TorusInside, Surface::Saddle];

/// Writes the cases as STL and ours beside them, for comparison with other programs: `SHAPE_CASES=folder`.
#[test]
#[ignore = "writes files for a comparison"]
fn write_cases() {
    let folder = std::path::PathBuf::from(std::env::var("SHAPE_CASES").unwrap_or_else(|_| "/tmp/shape_cmp/cases".into()));
    std::fs::create_dir_all(&folder).unwrap();
    println!("surface share sampling rim added far chord2 normal ms");
    for surface in SURFACES {
        for share in [0.05, 0.1, 0.2, 0.4] {
            for sampling in [0.5, 1.0, 4.0] {
                let radius = share * surface.size();
                let edge = (0.05 * surface.size()).min(radius / 4.0);
                let case = Case::round(surface, radius, edge, sampling, radius + 6.0 * edge);
                let name = format!("{}_{share}_{sampling}", surface.name());
                let position = |v: u32| case.positions[v as usize];
                write_stl(&folder.join(format!("{name}.stl")), case.around.iter().map(|t| t.map(position)));
                let patch = case.coarse();
                for method in [Method::Fair] {
                    let settings = ShapeSettings { method, ..ShapeSettings::default() };
                    let start = std::time::Instant::now();
                    let shaped = case.shaped(&patch, &settings);
                    let took = start.elapsed().as_secs_f64() * 1e3;
                    match shaped {
                        Ok(shaped) => {
                            let (far, tilt) = case.errors(&shaped);
                            // Of the middle of an edge, for the largest curvature.
                            let chord = edge * edge / 8.0 / surface.size();
                            println!(
                                "{name} {method:?} rim {} added {} far {far:.2e} 2chord {:.2e} normal {tilt:.2} ms {took:.2}",
                                case.rims[0].len(),
                                shaped.added.len(),
                                2.0 * chord
                            );
                            let all = |v: u32| {
                                *case
                                    .positions
                                    .get(v as usize)
                                    .unwrap_or_else(|| &shaped.added[v as usize - case.positions.len()])
                            };
                            let path = folder.join(format!("{name}.{}.out.stl", format!("{method:?}").to_lowercase()));
                            write_stl(&path, shaped.triangles.iter().chain(&case.around).map(|t| t.map(all)));
                        }
                        Err(error) => println!("{name} {method:?} {error}"),
                    }
                }
            }
        }
    }
}
