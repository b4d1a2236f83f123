//! The constrained Delaunay triangulation of a loop in its plane.
//!
//! The loop is dropped onto the coordinate plane that its directed area (Newell's normal) faces most, which leaves its f32
//! coordinates as they are: everything about that projection is decided exactly. If it is a simple polygon that turns the right
//! way, and every triangle turns that way too, then the patch is a graph over the coordinate plane: it cannot cross itself,
//! and no triangle is collinear. Edge flips then make it Delaunay as measured in space, not in the slanted projection, and
//! replace forbidden chords where a flip can.

use glam::DVec3;
use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

use super::Rim;
use super::exact::{Point, at, turn};

/// A loop's directed area: half of Σ pᵢ × pᵢ₊₁, taken about the first vertex.
pub(super) fn directed_area(points: &[Point]) -> DVec3 {
    let Some(origin) = points.first().map(at) else { return DVec3::ZERO };
    points.windows(2).map(|w| (at(&w[0]) - origin).cross(at(&w[1]) - origin) * 0.5).sum()
}

/// Root mean square distance from the plane through the centroid with the directed area as normal, as a share of the root of
/// that area; infinite where there is none.
fn deviation(points: &[Point], area: DVec3) -> f64 {
    let size2 = area.length();
    if size2 == 0.0 || !size2.is_finite() {
        return f64::INFINITY;
    }
    let n = points.len() as f64;
    let normal = area / size2;
    let middle = points.iter().map(at).sum::<DVec3>() / n;
    let variance = points.iter().map(|p| (at(p) - middle).dot(normal)).map(|h| h * h).sum::<f64>() / n;
    (variance / size2).sqrt()
}

/// Triangulates a loop that deviates from its plane by no more than `max_deviation` (see
/// [`super::FillSettings::planar_deviation`]) and is a simple polygon there. `None` where it is not, or where a forbidden chord
/// could not be avoided. O(n log n).
pub(super) fn triangulate(rim: &Rim<'_>, max_deviation: f64) -> Option<Vec<[u32; 3]>> {
    let area = directed_area(rim.points);
    if deviation(rim.points, area) > max_deviation {
        return None;
    }
    let axis = (0..3).fold(0, |best, k| if area[k].abs() > area[best].abs() { k } else { best });
    let mut mesh = Flips::new(rim, axis, area[axis] > 0.0, delaunay(rim.points, axis, area[axis] > 0.0)?)?;
    mesh.improve();
    mesh.avoid_forbidden().then_some(mesh.triangles)
}

/// Constrained Delaunay triangulation of the projection along `axis` (seen from its negative end unless `forward`), if that is
/// a simple polygon that turns left.
fn delaunay(points: &[Point], axis: usize, forward: bool) -> Option<Vec<[u32; 3]>> {
    // Any f32 times 2²⁰ is within the range in which spade is exact, and nothing is rounded.
    let scale = f64::from(1 << 20);
    let (u, v) = if forward { ((axis + 1) % 3, (axis + 2) % 3) } else { ((axis + 2) % 3, (axis + 1) % 3) };
    let projected = points.iter().map(|p| Point2::new(f64::from(p[u]) * scale, f64::from(p[v]) * scale)).collect();
    let n = points.len();
    let mut conflicts = 0;
    let edges = (0..n).map(|i| [i, (i + 1) % n]).collect();
    let cdt = ConstrainedDelaunayTriangulation::<Point2<f64>>::try_bulk_load_cdt(projected, edges, |_| conflicts += 1).ok()?;
    if conflicts > 0 || cdt.num_vertices() != n || cdt.num_constraints() != n {
        return None;
    }
    let vertex = FixedVertexHandle::from_index;
    let first = cdt.get_edge_from_neighbors(vertex(0), vertex(1)).filter(|e| e.is_constraint_edge())?;
    let mut seen = vec![false; cdt.num_all_faces()];
    let mut triangles = Vec::with_capacity(n - 2);
    let mut stack = vec![first.face().as_inner()?];
    seen[stack[0].index()] = true;
    while let Some(face) = stack.pop() {
        triangles.push(face.vertices().map(|v| v.index() as u32));
        for edge in face.adjacent_edges() {
            if edge.is_constraint_edge() {
                // The rim must have the inside on its left everywhere.
                if (edge.from().index() + 1) % n != edge.to().index() {
                    return None;
                }
            } else {
                let across = edge.rev().face().as_inner()?;
                if !std::mem::replace(&mut seen[across.index()], true) {
                    stack.push(across);
                }
            }
        }
    }
    (triangles.len() == n - 2).then_some(triangles)
}

const NONE: u32 = u32::MAX;

/// A triangulated polygon whose edges can be flipped.
struct Flips<'a> {
    rim: &'a Rim<'a>,
    axis: usize,
    sense: i8,
    triangles: Vec<[u32; 3]>,
    /// The triangle across the edge from corner k to corner k + 1.
    across: Vec<[u32; 3]>,
}

impl<'a> Flips<'a> {
    fn new(rim: &'a Rim<'a>, axis: usize, forward: bool, triangles: Vec<[u32; 3]>) -> Option<Self> {
        let mut sides: Vec<(u32, u32, usize, usize)> = Vec::with_capacity(3 * triangles.len());
        for (i, t) in triangles.iter().enumerate() {
            sides.extend((0..3).map(|k| (t[k].min(t[(k + 1) % 3]), t[k].max(t[(k + 1) % 3]), i, k)));
        }
        sides.sort_unstable();
        let mut across = vec![[NONE; 3]; triangles.len()];
        for pair in sides.windows(2) {
            let ((a, b, i, k), (c, d, j, l)) = (pair[0], pair[1]);
            if (a, b) == (c, d) {
                across[i][k] = j as u32;
                across[j][l] = i as u32;
            }
        }
        let mesh = Self { rim, axis, sense: if forward { 1 } else { -1 }, triangles, across };
        mesh.triangles.iter().all(|t| mesh.turns_right_way(*t)).then_some(mesh)
    }

    fn turns_right_way(&self, t: [u32; 3]) -> bool {
        let [a, b, c] = self.rim.corners(t);
        self.sense * turn(&a, &b, &c, self.axis) > 0
    }

    /// The quadrilateral around the edge from corner `k` of triangle `i`: the edge (a, b), then the corners across it on the
    /// side of `i` and on the other.
    fn around(&self, i: usize, k: usize) -> Option<(usize, usize, [u32; 4])> {
        let j = self.across[i][k];
        if j == NONE {
            return None;
        }
        let j = j as usize;
        let l = self.across[j].iter().position(|&x| x as usize == i)?;
        let t = self.triangles[i];
        Some((j, l, [t[k], t[(k + 1) % 3], t[(k + 2) % 3], self.triangles[j][(l + 2) % 3]]))
    }

    /// Replaces the edge from corner `k` of `i` by the other diagonal, if both new triangles turn the right way and the diagonal
    /// is allowed.
    fn flip(&mut self, i: usize, k: usize) -> bool {
        let Some((j, l, [a, b, c, d])) = self.around(i, k) else { return false };
        let (new_i, new_j) = ([c, a, d], [d, b, c]);
        if !self.turns_right_way(new_i) || !self.turns_right_way(new_j) || !self.rim.allows(c, d) {
            return false;
        }
        let (bc, ca) = (self.across[i][(k + 1) % 3], self.across[i][(k + 2) % 3]);
        let (ad, db) = (self.across[j][(l + 1) % 3], self.across[j][(l + 2) % 3]);
        self.triangles[i] = new_i;
        self.triangles[j] = new_j;
        self.across[i] = [ca, ad, j as u32];
        self.across[j] = [db, bc, i as u32];
        self.relink(ad, j, i);
        self.relink(bc, i, j);
        true
    }

    fn relink(&mut self, t: u32, from: usize, to: usize) {
        if let Some(slots) = self.across.get_mut(t as usize) {
            for s in slots.iter_mut().filter(|s| **s as usize == from) {
                *s = to as u32;
            }
        }
    }

    /// Lawson's flips towards the Delaunay triangulation as measured in space, a bounded number of them (what is not planar
    /// need not settle).
    fn improve(&mut self) {
        let mut budget = 16 * self.triangles.len();
        let mut stack: Vec<u32> = (0..self.triangles.len() as u32).rev().collect();
        while let Some(i) = stack.pop().map(|i| i as usize) {
            for k in 0..3 {
                let Some((j, _, quad)) = self.around(i, k) else { continue };
                if budget > 0 && not_delaunay(self.rim.points, quad) && self.flip(i, k) {
                    budget -= 1;
                    stack.extend([i as u32, j as u32]);
                    break;
                }
            }
        }
    }

    /// Flips forbidden chords away; `false` where one remains.
    fn avoid_forbidden(&mut self) -> bool {
        let allowed = |mesh: &Self, i: usize, k: usize| {
            let t = mesh.triangles[i];
            mesh.rim.allows(t[k], t[(k + 1) % 3])
        };
        for i in 0..self.triangles.len() {
            for k in 0..3 {
                if !allowed(self, i, k) {
                    self.flip(i, k);
                }
            }
        }
        (0..self.triangles.len()).all(|i| (0..3).all(|k| allowed(self, i, k)))
    }
}

/// Do the angles opposite the edge (a, b) of the two triangles exceed 180° together, clearly (sin(α + β) < 0)?
fn not_delaunay(points: &[Point], [a, b, c, d]: [u32; 4]) -> bool {
    let [a, b, c, d] = [a, b, c, d].map(|v| at(&points[v as usize]));
    let angle = |apex: DVec3| {
        let (p, q) = (a - apex, b - apex);
        (p.dot(q), p.cross(q).length(), p.length() * q.length())
    };
    let ((cos1, sin1, size1), (cos2, sin2, size2)) = (angle(c), angle(d));
    sin1 * cos2 + cos1 * sin2 < -1e-12 * size1 * size2
}
