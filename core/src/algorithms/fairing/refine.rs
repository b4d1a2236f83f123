//! New vertices in a patch, as densely as the surface around has them (Liepa, "Filling Holes in Meshes", SGP 2003): each vertex has a
//! scale, the length of edges wanted there; a triangle whose centre is farther from its corners than the scales of these and of the
//! centre itself gets a vertex there, whose scale is the mean of theirs, and edges are flipped to be Delaunay. The rim keeps its
//! vertices.

use glam::DVec3;

use super::sheet::Sheet;

/// Rounds of insertion: each divides lengths by about the root of three.
const ROUNDS: usize = 24;

/// Share of the distance to the centre that the scale is compared with (Liepa's α).
pub(super) const DENSITY: f64 = 1.6;

/// Refines; gives the number of new vertices, no more than `most` (about). O(n log n) in what comes out.
pub(super) fn refine(sheet: &mut Sheet<'_>, most: usize) -> usize {
    let before = sheet.points.len();
    for _ in 0..ROUNDS {
        let there = sheet.points.len();
        for i in 0..sheet.triangles.len() {
            if sheet.points.len() - before < most
                && let Some((centre, scale)) = wanted(sheet, sheet.triangles[i])
            {
                let v = sheet.add_point(centre, scale);
                sheet.split_triangle(i, v);
            }
        }
        if sheet.points.len() == there {
            break;
        }
        sheet.relax();
    }
    sheet.points.len() - before
}

/// The vertex that a triangle is to be divided with, and its scale.
fn wanted(sheet: &Sheet<'_>, t: [u32; 3]) -> Option<(DVec3, f64)> {
    let corners = sheet.corners(t);
    let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
    let scales = t.map(|v| sheet.scale[v as usize]);
    let scale = (scales[0] + scales[1] + scales[2]) / 3.0;
    (0..3).all(|k| DENSITY * corners[k].distance(centre) > scale.max(scales[k])).then_some((centre, scale))
}

/// Is no triangle to be divided?
pub(super) fn is_fine(sheet: &Sheet<'_>) -> bool {
    sheet.triangles.iter().all(|t| wanted(sheet, *t).is_none())
}
