//! Points and vectors of space, in mm.

pub(crate) use crate::curves::vector::{Point, add, between, cross, dot, plain_norm as norm, plain_unit as unit, scale, sub};

/// Distance of two points. (Of lengths of parts a plain root is enough; `hypot` takes half of the time of all fits.)
pub(crate) fn distance(a: Point, b: Point) -> f64 {
    norm(sub(a, b))
}

/// `a + b · factor`.
pub(crate) fn along(a: Point, b: Point, factor: f64) -> Point {
    add(a, scale(b, factor))
}

/// Two unit vectors that make a right-handed frame with the unit vector `axis`.
pub(crate) fn frame(axis: Point) -> [Point; 2] {
    let [x, y, z] = axis.map(f64::abs);
    let helper = if x <= y && x <= z {
        [1.0, 0.0, 0.0]
    } else if y <= z {
        [0.0, 1.0, 0.0]
    } else {
        [0.0, 0.0, 1.0]
    };
    let u = unit(cross(axis, helper)).unwrap_or([1.0, 0.0, 0.0]);
    [u, cross(axis, u)]
}

/// Mean of points, in their order; the origin of none.
pub(crate) fn mean(points: &[Point]) -> Point {
    let sum = points.iter().fold([0.0; 3], |sum, point| add(sum, *point));
    scale(sum, 1.0 / points.len().max(1) as f64)
}

/// Six times the signed volume of the tetrahedron of a triangle and the origin.
pub(crate) fn six_volumes([a, b, c]: [Point; 3]) -> f64 {
    dot(a, cross(b, c))
}
