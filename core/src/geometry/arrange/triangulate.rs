//! Constrained Delaunay triangulation of a triangle with points in it: all points, then all constraints.

use crate::geometry::arrange::delaunay::Delaunay;
use crate::geometry::arrange::flat::Flat;
use crate::geometry::arrange::recover;

/// The triangles, to the left. The first three points are the corners, all others inside of them or on their sides, all different;
/// no constraint crosses another, or has a point inside. `None` if that does not hold.
pub(crate) fn triangulate(flat: &Flat<'_>, constraints: &[(usize, usize)]) -> Option<Vec<[usize; 3]>> {
    let corners = match flat.turn(0, 1, 2) {
        0 => return None,
        1 => [0, 1, 2],
        _ => [0, 2, 1],
    };
    let mut cdt = Delaunay::new(flat, corners);
    for p in 3..flat.len() {
        let first_new = cdt.triangles.len();
        cdt.insert(p)?;
        cdt.legalize(first_new);
    }
    for (a, b) in constraints {
        let first_new = cdt.triangles.len();
        recover::constrain(&mut cdt, *a, *b)?;
        cdt.legalize(first_new);
    }
    Some(cdt.triangles.iter().filter(|t| t.alive).map(|t| t.v).collect())
}
