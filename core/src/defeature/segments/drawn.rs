//! Which pieces were drawn: more of their vertices lie on a surface than fix it, which is no chance at the precision of f32.

use super::super::mesh::Mesh;
use super::super::surface::Surface;
use super::super::vector::{Point, cross, distance, dot, norm};
use super::segment::Segment;
use rayon::prelude::*;

/// Directions of flat faces that single triangles are compared with.
const MOST_DIRECTIONS: usize = 64;
/// The least precision of a triangle's normal, radians.
const LEAST_PRECISION: f64 = 1e-3;

/// Marks the pieces that were drawn. Three vertices lie on a plane in any mesh, a fourth one does in a part that was drawn, and
/// so does a triangle that is parallel to a larger face of the part. Regions on round surfaces are of more facets than fix them.
/// O(n log n).
pub(super) fn prove(mesh: &Mesh, list: &mut [Segment]) {
    list.iter_mut().for_each(|s| s.is_proven = s.triangles.len() > 1 || !s.surface.is_plane());
    let directions = directions(list);
    let is_parallel = |segment: &Segment| {
        let Some(triangle) = segment.triangles.first() else { return false };
        let corners = mesh.triangles[*triangle as usize].map(|v| mesh.at(v));
        let longest = (0..3).map(|k| distance(corners[k], corners[(k + 1) % 3])).fold(0.0, f64::max);
        let precision = 2.0 * mesh.flatness() * longest / (2.0 * mesh.areas[*triangle as usize]).max(1e-300);
        let normal = mesh.normals[*triangle as usize];
        precision < LEAST_PRECISION && directions.iter().any(|way| norm(cross(*way, normal)) < precision)
    };
    list.par_iter_mut().filter(|s| !s.is_proven).for_each(|s| s.is_proven = is_parallel(s));
}

/// The normals of the largest flat pieces of several triangles, each direction once.
fn directions(list: &[Segment]) -> Vec<Point> {
    let flat = |s: &Segment| match s.surface {
        Surface::Plane { normal, .. } if s.is_proven => Some((s.area, normal)),
        _ => None,
    };
    let mut faces: Vec<(f64, Point)> = list.iter().filter_map(flat).collect();
    faces.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut found: Vec<Point> = Vec::new();
    for (_, normal) in faces.into_iter().take(MOST_DIRECTIONS * 16) {
        if found.len() < MOST_DIRECTIONS && found.iter().all(|known| dot(*known, normal).abs() < 1.0 - 1e-9) {
            found.push(normal);
        }
    }
    found
}
