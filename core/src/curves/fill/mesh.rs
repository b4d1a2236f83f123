//! Triangles of outlines, and how even they are.

use crate::curves::vector::{Point, cross, dot, sub};
use crate::util::each::Each;

/// Triangles of outlines.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Those of curves first.
    pub points: Vec<Point>,
    /// Numbers of points, anticlockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// The number of the outline of each triangle.
    pub face_of: Vec<u32>,
}

/// Twice the ratio of the radii of the inner and the outer circle of each triangle: 1 if its sides are even, 0 if it is flat.
#[must_use]
pub fn quality(mesh: &Mesh) -> Vec<f64> {
    let point = |number: u32| mesh.points.get(number as usize).copied().unwrap_or_default();
    mesh.triangles.iter().map(|&[a, b, c]| of_triangle(point(a), point(b), point(c))).collect()
}

/// Twice the ratio of the radii of the inner and the outer circle: 1 of a triangle with even sides, 0 of a flat one.
pub(super) fn of_triangle(a: Point, b: Point, c: Point) -> f64 {
    let [u, v, w] = [sub(c, b), sub(a, c), sub(b, a)];
    let [x, y, z] = [u, v, w].each(|side| dot(side, side).sqrt());
    let normal = cross(w, v);
    let product = x * y * z * (x + y + z);
    if product > 0.0 { 4.0 * dot(normal, normal) / product } else { 0.0 }
}
