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

use super::flips::Flips;
use super::rim::Rim;
use crate::geometry::exact::{Point, at, orientation_along};

/// A loop's directed area: half of Σ pᵢ × pᵢ₊₁, taken about the first vertex.
pub(crate) fn directed_area(points: &[Point]) -> DVec3 {
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
    let forward = area[axis] > 0.0;
    let turns_right_way = |t: [u32; 3]| {
        let [a, b, c] = rim.corners(t);
        orientation_along(&a, &b, &c, axis) == if forward { 1 } else { -1 }
    };
    let mut mesh = Flips::new(rim, delaunay(rim.points, axis, forward)?);
    if !mesh.triangles().iter().all(|t| turns_right_way(*t)) {
        return None;
    }
    mesh.improve(turns_right_way, |mesh, edge| mesh.around(edge).is_some_and(|a| not_delaunay(rim.points, a.quad)));
    mesh.avoid_forbidden(turns_right_way);
    mesh.is_allowed().then(|| mesh.into_triangles())
}

/// Constrained Delaunay triangulation of the projection along `axis` (seen from its negative end unless `forward`), if that is
/// a simple polygon that turns left.
fn delaunay(points: &[Point], axis: usize, forward: bool) -> Option<Vec<[u32; 3]>> {
    // Any f32 times 2²⁰ is within the range in which spade is exact, and nothing is rounded.
    let scale = f64::from(1 << 20);
    let (u, v) = if forward { ((axis + 1) % 3, (axis + 2) % 3) } else { ((axis + 2) % 3, (axis + 1) % 3) };
    let projected = points.iter().map(|p| Point2::new(f64::from(p[u]) * scale, f64::from(p[v]) * scale)).collect();
    constrained(projected, &[points.len()])
}

/// Constrained Delaunay triangulation of what lies between a loop and others inside it, in the plane that their directed areas face, if they
/// are simple polygons there that have it on their left. `points`: those of one loop after the other; `sizes`: how many each has. The
/// projection is rounded, so that nothing is known of the triangles in space. O(n log n).
pub(super) fn between(points: &[Point], sizes: &[usize]) -> Option<Vec<[u32; 3]>> {
    let mut rest = points;
    let mut area = DVec3::ZERO;
    for size in sizes {
        let (rim, others) = rest.split_at_checked(*size)?;
        area += directed_area(rim);
        rest = others;
    }
    let size = area.length().sqrt();
    if size == 0.0 || !size.is_finite() {
        return None;
    }
    let normal = area.normalize();
    let u = normal.any_orthonormal_vector() / size;
    let v = normal.cross(u);
    let origin = points.first().map(at)?;
    let projected = points.iter().map(|p| at(p) - origin).map(|p| Point2::new(p.dot(u), p.dot(v))).collect();
    constrained(projected, sizes)
}

/// Constrained Delaunay triangulation of what loops have on their left, if they bound one region.
fn constrained(points: Vec<Point2<f64>>, sizes: &[usize]) -> Option<Vec<[u32; 3]>> {
    let n = points.len();
    let mut next: Vec<usize> = (1..=n).collect();
    let mut end = 0;
    for size in sizes {
        end += size;
        next[end - 1] = end - size;
    }
    let mut conflicts = 0;
    let edges = next.iter().enumerate().map(|(i, j)| [i, *j]).collect();
    let cdt = ConstrainedDelaunayTriangulation::<Point2<f64>>::try_bulk_load_cdt(points, edges, |_| conflicts += 1).ok()?;
    if conflicts > 0 || cdt.num_vertices() != n || cdt.num_constraints() != n {
        return None;
    }
    let vertex = FixedVertexHandle::from_index;
    let first = cdt.get_edge_from_neighbors(vertex(0), vertex(1)).filter(|e| e.is_constraint_edge())?;
    let mut seen = vec![false; cdt.num_all_faces()];
    // A loop more takes two triangles more than its vertices.
    let count = n + 2 * sizes.len() - 4;
    let mut triangles = Vec::with_capacity(count);
    let mut stack = vec![first.face().as_inner()?];
    seen[stack[0].index()] = true;
    while let Some(face) = stack.pop() {
        triangles.push(face.vertices().map(|v| v.index() as u32));
        for edge in face.adjacent_edges() {
            if edge.is_constraint_edge() {
                // A rim must have the inside on its left everywhere.
                if next[edge.from().index()] != edge.to().index() {
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
    (triangles.len() == count).then_some(triangles)
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
