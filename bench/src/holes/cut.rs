//! Closed meshes of known surfaces with one round hole.
//!
//! Vertices lie on the surface exactly, in f32. Around the hole edges are of one length, vertices jittered; farther away they grow.
//! The mesh is made in the plane by a constrained Delaunay triangulation and carried onto the surface; a sphere ends in a fan at the
//! far pole, a torus closes on itself, a saddle is the top of a block.

use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation};

use super::surface::Surface;
use crate::mesh::{Point, Triangle};

/// A hole to be cut.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Hole {
    /// Its radius as a share of the surface's radius of curvature.
    pub(crate) share: f64,
    /// Length of the rim's edges, in edges around it.
    pub(crate) sampling: f64,
}

impl Hole {
    /// Each share with each sampling.
    pub(crate) fn all() -> impl Iterator<Item = Self> {
        [0.05, 0.1, 0.2, 0.4].into_iter().flat_map(|share| [0.5, 1.0, 4.0].map(|sampling| Self { share, sampling }))
    }

    fn radius(self, surface: Surface) -> f64 {
        self.share * surface.radius()
    }

    /// Length of the edges around it: four to a radius at least.
    pub(crate) fn edge(self, surface: Surface) -> f64 {
        (0.05 * surface.radius()).min(self.radius(surface) / 4.0)
    }

    /// How far the middle of an edge of the mesh around lies off the surface.
    pub(crate) fn chord_error(self, surface: Surface) -> f64 {
        let edge = self.edge(surface);
        edge * edge / 8.0 / surface.radius()
    }
}

type Place = [f64; 2];

/// A bowl of two skins, radii 1 and 0.85, whose rim is missing: two loops of unlike density that bound one wall.
pub(crate) fn bowl() -> Vec<Triangle> {
    let mut triangles = Vec::new();
    for (radius, around, inside) in [(1.0, 96, false), (0.85, 72, true)] {
        let rows = around / 4;
        let at = |row: usize, i: usize| -> Point {
            let (down, turn) = (row as f64 / rows as f64 * 0.5, (i % around) as f64 / around as f64 * 2.0);
            let [(sin, cos), (y, x)] = [down, turn].map(|halves| (halves * std::f64::consts::PI).sin_cos());
            [radius * sin * x, radius * sin * y, -radius * cos].map(|x| x as f32)
        };
        for (row, i) in (0..rows).flat_map(|row| (0..around).map(move |i| (row, i))) {
            let (a, b, c, d) = (at(row, i), at(row, i + 1), at(row + 1, i + 1), at(row + 1, i));
            // The first row is a fan around the lowest point.
            let quad = [[a, d, c], [a, c, b]].into_iter().take(if row == 0 { 1 } else { 2 });
            triangles.extend(quad.map(|[a, b, c]| if inside { [a, b, c] } else { [a, c, b] }));
        }
    }
    triangles
}

/// Numbers that look random, the same everywhere (Knuth's linear congruence, upper bits).
struct Noise(u64);

impl Noise {
    /// Within ±1.
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// Edges of the same length around the hole's.
const EVEN_RINGS: f64 = 8.0;
/// Vertices are off their lattice by this share of an edge at most, in x and in y.
const JITTER: f64 = 0.2;
/// Lowest z of the saddle's block.
const FLOOR: f64 = -1.5;

/// The mesh. O(n²) for a few thousand vertices.
pub(crate) fn mesh(surface: Surface, hole: Hole) -> Vec<Triangle> {
    let rim = circle(hole.radius(surface), hole.edge(surface) * hole.sampling, 0.3);
    let border = border(surface);
    let places = places(surface, hole, &rim, &border);
    let at = |p: Place| surface.at(canonical(surface, p)).map(|x| x as f32);
    let mut triangles: Vec<Triangle> = faces(&places, rim.len(), border.len())
        .into_iter()
        .map(|face| face.map(|v| places[v]))
        .filter(|corners| !within(mean(corners), &rim))
        .map(|corners| corners.map(at))
        .collect();
    for k in 0..border.len() {
        let (a, b) = (at(border[k]), at(border[(k + 1) % border.len()]));
        close(surface, a, b, &mut triangles);
    }
    triangles
}

/// Closes the border's edge from `a` to `b`: with a triangle, or none, or walls.
fn close(surface: Surface, a: Point, b: Point, triangles: &mut Vec<Triangle>) {
    match surface {
        Surface::Sphere => triangles.push([b, a, [0.0, 0.0, -1.0]]),
        Surface::TorusOutside | Surface::TorusInside => {}
        Surface::Saddle => {
            let low = |p: Point| [p[0], p[1], FLOOR as f32];
            triangles.extend([[b, a, low(a)], [b, low(a), low(b)], [low(b), low(a), [0.0, 0.0, FLOOR as f32]]]);
        }
    }
}

/// Both sides of the rectangle that become one line of a torus have one place.
fn canonical(surface: Surface, p: Place) -> Place {
    match surface {
        Surface::Sphere | Surface::Saddle => p,
        Surface::TorusOutside | Surface::TorusInside => {
            let half = surface.torus_half_sides();
            std::array::from_fn(|k| if p[k] == half[k] { -half[k] } else { p[k] })
        }
    }
}

/// The longest edges, far from the hole.
fn longest(surface: Surface) -> f64 {
    0.25 * surface.radius()
}

/// Counterclockwise around the part of the plane that is used.
fn border(surface: Surface) -> Vec<Place> {
    let longest = longest(surface);
    match surface {
        Surface::Sphere => circle(2.6, longest, 0.0),
        Surface::TorusOutside | Surface::TorusInside => rectangle(surface.torus_half_sides(), longest),
        Surface::Saddle => rectangle([1.0, 1.0], longest),
    }
}

/// Begins at `turn` edges from the x axis.
fn circle(radius: f64, edge: f64, turn: f64) -> Vec<Place> {
    let full = 2.0 * std::f64::consts::PI;
    let count = ((full * radius / edge).round() as usize).max(4);
    let angle = |i: usize| (i as f64 + turn) * full / count as f64;
    (0..count).map(|i| [radius * angle(i).cos(), radius * angle(i).sin()]).collect()
}

fn rectangle(half: [f64; 2], edge: f64) -> Vec<Place> {
    let [nx, ny] = half.map(|half| (2.0 * half / edge).ceil() as usize);
    let step = |k: usize, i: usize, n: usize| -half[k] + 2.0 * half[k] * (i as f64 / n as f64);
    let mut places: Vec<Place> = (0..nx).map(|i| [step(0, i, nx), -half[1]]).collect();
    places.extend((0..ny).map(|i| [half[0], step(1, i, ny)]));
    // Back the same steps, so that opposite sides match to the bit.
    places.extend((1..=nx).rev().map(|i| [step(0, i, nx), half[1]]));
    places.extend((1..=ny).rev().map(|i| [-half[0], step(1, i, ny)]));
    places
}

/// The rim, the border, and between them jittered triangular lattices, each of edges twice as long as the one before.
fn places(surface: Surface, hole: Hole, rim: &[Place], border: &[Place]) -> Vec<Place> {
    let (radius, edge) = (hole.radius(surface), hole.edge(surface));
    let mut places = [rim, border].concat();
    let mut noise = Noise(rim.len() as u64);
    let reach = border.iter().map(|p| p[0].hypot(p[1])).fold(0.0, f64::max);
    let (mut from, mut edge_here) = (0.0, edge);
    while from < reach {
        let last = edge_here * 2.0 > longest(surface);
        let rings = if from == 0.0 { radius + EVEN_RINGS * edge } else { from + EVEN_RINGS * edge_here };
        let to = if last { f64::INFINITY } else { rings };
        let others = places.len();
        let step = edge_here * 3.0_f64.sqrt() / 2.0;
        let rows = (to.min(reach) / step).ceil() as i32;
        for j in -rows..=rows {
            for i in -2 * rows..=2 * rows {
                let lattice = [(f64::from(i) + 0.5 * f64::from(j.rem_euclid(2))) * edge_here, f64::from(j) * step];
                let p = lattice.map(|x| x + JITTER * edge_here * noise.next());
                let r = p[0].hypot(p[1]);
                let clear = |polygon: &[Place], least: f64| {
                    let n = polygon.len();
                    (0..n).all(|k| segment_distance(p, polygon[k], polygon[(k + 1) % n]) > least)
                };
                let apart = |q: &Place| (p[0] - q[0]).hypot(p[1] - q[1]) > 0.6 * edge_here;
                if (from..to).contains(&r)
                    && within(p, border)
                    && !within(p, rim)
                    && places[rim.len()..others].iter().all(apart)
                    && clear(rim, 0.6 * edge * hole.sampling.clamp(0.7, 1.0))
                    && clear(border, 0.5 * edge_here)
                {
                    places.push(p);
                }
            }
        }
        (from, edge_here) = (to, edge_here * 2.0);
    }
    places
}

/// A place and its number.
struct Site(Point2<f64>, usize);

impl HasPosition for Site {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.0
    }
}

/// The Delaunay triangulation that has the edges of the rim, the first places, and of the border, the next. Places are clear of both,
/// so that nothing is refused.
fn faces(places: &[Place], rim: usize, border: usize) -> Vec<[usize; 3]> {
    let mut triangulation = ConstrainedDelaunayTriangulation::<Site>::new();
    let handles: Vec<_> = places
        .iter()
        .enumerate()
        .filter_map(|(number, &[x, y])| triangulation.insert(Site(Point2::new(x, y), number)).ok())
        .collect();
    let mut ring = |range: std::ops::Range<usize>| {
        for k in range.clone() {
            let next = if k + 1 == range.end { range.start } else { k + 1 };
            triangulation.try_add_constraint(handles[k], handles[next]);
        }
    };
    ring(0..rim);
    ring(rim..rim + border);
    triangulation.inner_faces().map(|face| face.vertices().map(|v| v.data().1)).collect()
}

fn mean(corners: &[Place; 3]) -> Place {
    std::array::from_fn(|k| (corners[0][k] + corners[1][k] + corners[2][k]) / 3.0)
}

fn segment_distance(p: Place, a: Place, b: Place) -> f64 {
    let (ux, uy, vx, vy) = (b[0] - a[0], b[1] - a[1], p[0] - a[0], p[1] - a[1]);
    let t = ((ux * vx + uy * vy) / (ux * ux + uy * uy)).clamp(0.0, 1.0);
    (vx - t * ux).hypot(vy - t * uy)
}

/// Is a place within a convex polygon, or on it?
fn within(p: Place, polygon: &[Place]) -> bool {
    let n = polygon.len();
    (0..n).all(|k| {
        let (a, b) = (polygon[k], polygon[(k + 1) % n]);
        (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) >= 0.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{wide, write};
    use suture_bench::judge;

    #[test]
    fn the_bowl_has_two_skins_and_two_loops() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.stl");
        write(&path, &bowl()).unwrap();
        let found = judge::judge(&path).unwrap();
        let counts = found.counts;
        assert!(found.volume > 0.0);
        assert_eq!((counts.components, counts.boundary_loops, counts.boundary_edges), (2, 2, 96 + 72));
        assert!(counts.manifold() && counts.inconsistent_edges == 0 && counts.degenerate_area == 0);
    }

    #[test]
    fn each_is_one_body_with_one_hole_and_true_around_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.stl");
        for surface in Surface::ALL {
            for hole in Hole::all() {
                let triangles = mesh(surface, hole);
                write(&path, &triangles).unwrap();
                let found = judge::judge(&path).unwrap();
                let counts = found.counts;
                let rim = circle(hole.radius(surface), hole.edge(surface) * hole.sampling, 0.0).len() as u64;
                let sound = (counts.boundary_loops, counts.boundary_edges, counts.components) == (1, rim, 1);
                assert!(sound && counts.manifold() && counts.inconsistent_edges == 0, "{surface:?} {hole:?} {counts:?}");
                assert!(counts.degenerate_area + counts.degenerate_index == 0 && found.volume > 0.0, "{surface:?} {hole:?}");
                let middle = surface.at([0.0, 0.0]);
                for p in triangles.as_flattened().iter().map(|&p| wide(p)) {
                    let near = (0..3).all(|k| (p[k] - middle[k]).abs() < 0.45 * surface.radius());
                    assert!(!near || surface.distance(p).0 < 1e-6, "{surface:?} {hole:?} {p:?}");
                }
            }
        }
    }
}
