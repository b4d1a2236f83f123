//! The sides and the bottom of a part.

use super::lattice::Lattice;

/// How far the bottom lies under the lowest vertex, in millimetres.
const DEPTH: f32 = 3.0;

/// Lets sides down from the grid's border to one level, and closes the part there.
pub(super) fn close(points: &mut Vec<[f32; 3]>, faces: &mut Vec<[u32; 3]>, lattice: &Lattice) {
    let level = points.iter().map(|p| p[2]).fold(f32::INFINITY, f32::min) - DEPTH;
    let ring = border(lattice);
    let base = points.len() as u32;
    let feet: Vec<[f32; 3]> = ring.iter().map(|top| points[*top as usize]).map(|[x, y, _]| [x, y, level]).collect();
    points.extend(feet);
    for (n, a) in ring.iter().enumerate() {
        let next = (n + 1) % ring.len();
        let (b, c, d) = (ring[next], base + next as u32, base + n as u32);
        faces.extend([[b, *a, d], [b, d, c]]);
    }
    bottom(faces, base, lattice.columns, lattice.rows.len());
}

/// The vertices of the grid's border, counter-clockwise from above.
fn border(lattice: &Lattice) -> Vec<u32> {
    let (columns, rows) = (lattice.columns, lattice.rows.len());
    let first = (0..columns).map(|i| lattice.vertex(i, 0));
    let right = (1..rows).map(|j| lattice.vertex(columns - 1, j));
    let last = (0..columns - 1).rev().map(|i| lattice.vertex(i, rows - 1));
    let left = (1..rows - 1).rev().map(|j| lattice.vertex(0, j));
    first.chain(right).chain(last).chain(left).collect()
}

/// The bottom, whose vertices are those of the border, numbered from `base`. Two long triangles join each row with the next one; a fan
/// leads from the second row to all vertices of the first, and another from the last row but one to those of the last. Fans do not fold as
/// long as the first row and the last are nearly straight, seen from above.
fn bottom(faces: &mut Vec<[u32; 3]>, base: u32, columns: usize, rows: usize) {
    let count = 2 * (columns + rows) - 4;
    let right = |j: usize| base + (columns - 1 + j) as u32;
    let left = |j: usize| base + ((count - j) % count) as u32;
    for j in 1..rows - 2 {
        faces.extend([[left(j), left(j + 1), right(j + 1)], [left(j), right(j + 1), right(j)]]);
    }
    for i in 0..columns - 1 {
        let near = base + i as u32;
        faces.push([near, left(1), near + 1]);
        let far = right(rows - 1) + i as u32;
        faces.push([far, right(rows - 2), far + 1]);
    }
    faces.push([left(1), right(1), right(0)]);
    faces.push([right(rows - 2), left(rows - 2), left(rows - 1)]);
}
