//! Filled outlines as a body of trimmed surfaces, for files.
//!
//! Each curve is one edge, which all outlines that have it share. Surfaces are as large as their outlines need; curves of
//! parameters are exact but on cylinders, cones and tori, where they are fitted.

mod edges;
mod flat;
mod lift;
mod seam;
mod sweep;
#[cfg(test)]
mod tests;
mod trim;
mod turned;
mod whole;

use edges::Edges;

use super::entry::Filled;
use super::options::Outline;
use super::report::Surface;
use crate::curves::Unit;
use crate::curves::curve::Shape;
use crate::curves::export::{Body, Face};

/// Filled outlines as trimmed B-spline surfaces, for `curves::export`, and the numbers of the outlines that have no such surface:
/// those whose surface the mesh alone has, whose curves do not meet, and those whose numbers overflow. Arguments as they were
/// given to `fill`, and what it gave.
///
/// Faces look the way that their triangles do, so a closed network is a solid. The tolerance is the largest of gaps, errors and
/// distances between ends of curves and vertices. An outline with a surface for each curve has a face for each. O(control points
/// of curves and surfaces).
#[must_use]
pub fn body(shapes: &[&Shape], outlines: &[Outline], filled: &Filled, unit: &Unit) -> (Body, Vec<usize>) {
    let mut edges = Edges::new(shapes, outlines, filled);
    for (outline, surface) in outlines.iter().zip(&filled.surfaces) {
        if let (Surface::Carrier(carrier), false) = (surface, outline.inner.is_empty()) {
            seam::prepare(&mut edges, carrier, outline);
        }
    }
    let mut left = Vec::new();
    let mut faces = Vec::with_capacity(outlines.len());
    for (number, ((outline, surface), report)) in outlines.iter().zip(&filled.surfaces).zip(&filled.reports).enumerate() {
        // The other way around, the surface is on the other side of its outline.
        let is_left = report.is_left.map(|is_left| is_left != report.is_flipped);
        let found = face(&mut edges, outline, surface, (report.is_flipped, is_left));
        let is_closed = |face: &Face| std::iter::once(&face.outer).chain(&face.inner).all(|ring| edges.is_closed(ring));
        match found.filter(|found| found.iter().all(is_closed)) {
            Some(found) => {
                edges.tolerance = edges.tolerance.max(report.error);
                faces.extend(found);
            }
            None => left.push(number),
        }
    }
    let body = Body { vertices: edges.vertices, edges: edges.edges, faces, unit: unit.clone(), tolerance: 2.0 * edges.tolerance };
    (body, left)
}

fn face(
    edges: &mut Edges,
    outline: &Outline,
    surface: &Surface,
    (is_flipped, is_left): (bool, Option<bool>),
) -> Option<Vec<Face>> {
    let one = match surface {
        Surface::Carrier(carrier) => {
            let rings = edges.rings(outline, is_flipped)?;
            trim::face(edges, carrier, (rings, is_left))
        }
        Surface::Coons(coons) => whole::of_coons(edges, coons, outline, is_flipped),
        Surface::Centre { curve, ends, centre } => whole::of_centre(edges, curve, ends, *centre, outline, is_flipped),
        Surface::Fans { centre, .. } => return whole::of_fans(edges, *centre, outline, is_flipped),
        Surface::Heights(_) | Surface::Fallback(_) => None,
    };
    Some(vec![one?])
}
