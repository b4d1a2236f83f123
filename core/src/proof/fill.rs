//! The image of a triangle, by those of its edges: polygons that lie in one face each.

use glam::DVec3;

use crate::geometry::distance::nearest_of_triangle;
use crate::proof::chain::Pair;
use crate::proof::surface::Surface;

/// A polygon of a triangle whose image is the polygon of these spots in a face.
pub(super) struct Piece<'a> {
    pub(super) face: u32,
    pub(super) corners: &'a [Pair],
}

/// Cuts a loop of pairs around a triangle into pieces; false if it does not know how. `visit` may have been told some of them all the same.
pub(super) fn fill(
    surface: &Surface<'_>,
    triangle: &[DVec3; 3],
    rim: &mut Vec<Pair>,
    piece: &mut Vec<Pair>,
    visit: &mut impl FnMut(Piece<'_>),
) -> bool {
    loop {
        let spots: Vec<_> = rim.iter().map(|pair| pair.spot).collect();
        if let Some(face) = surface.common(&spots) {
            visit(Piece { face, corners: rim });
            return true;
        }
        if !cut_one(surface, rim, piece, visit) {
            return around_vertex(surface, triangle, rim, visit);
        }
    }
}

/// Cuts off the longest run of a loop that lies in one face, if it has more than an edge.
fn cut_one(surface: &Surface<'_>, rim: &mut Vec<Pair>, piece: &mut Vec<Pair>, visit: &mut impl FnMut(Piece<'_>)) -> bool {
    let n = rim.len();
    let mut best = (0, 0, 0);
    let twice: Vec<_> = rim.iter().chain(rim.iter()).map(|pair| pair.spot).collect();
    for start in 0..n {
        let mut face = None;
        for step in 1..n {
            match surface.common(&twice[start..=start + step]) {
                Some(common) => face = Some((common, step)),
                None => break,
            }
        }
        if let Some((common, steps)) = face.filter(|(_, steps)| *steps > best.1.max(1)) {
            best = (start, steps, common);
        }
    }
    let (start, steps, face) = best;
    if steps < 2 {
        return false;
    }
    piece.clear();
    piece.extend((0..=steps).map(|step| rim[(start + step) % n]));
    visit(Piece { face, corners: piece });
    rim.rotate_left(start);
    rim.drain(1..steps);
    rim.len() > 2
}

/// A loop that runs around one vertex of the surface: the vertex is the image of the nearest place of the triangle.
fn around_vertex(surface: &Surface<'_>, triangle: &[DVec3; 3], rim: &[Pair], visit: &mut impl FnMut(Piece<'_>)) -> bool {
    let Some(first) = rim.first() else { return false };
    let next = |i: usize| rim[(i + 1) % rim.len()];
    for v in surface.common(&[first.spot, next(0).spot]).map(|face| surface.faces[face as usize]).into_iter().flatten() {
        let Some(spot) = surface.at_vertex(v) else { continue };
        let faces: Option<Vec<u32>> = (0..rim.len()).map(|i| surface.common(&[rim[i].spot, next(i).spot, spot])).collect();
        if let Some(faces) = faces {
            let position = surface.position(&spot);
            let place = nearest_of_triangle(triangle, position);
            let apex = Pair { place, spot, off: place.distance(position) };
            for (i, face) in faces.into_iter().enumerate() {
                visit(Piece { face, corners: &[apex, rim[i], next(i)] });
            }
            return true;
        }
    }
    false
}
