//! Distances and nearest points, in f64: they rank and bound, and decide on no validity.

use crate::util::each::Each;
use glam::DVec3;

/// How near vertices are that become one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Tolerance {
    /// Never more than this, in the model's units.
    pub(crate) weld: f64,
    /// Nor than this share of the shortest edge at a vertex.
    pub(crate) edge_share: f64,
}

/// A position in f64.
#[inline]
pub(crate) fn place([x, y, z]: [f32; 3]) -> DVec3 {
    DVec3::new(f64::from(x), f64::from(y), f64::from(z))
}

/// Distance of two positions, in f64.
pub(crate) fn distance(a: [f32; 3], b: [f32; 3]) -> f64 {
    (0..3).map(|k| (f64::from(a[k]) - f64::from(b[k])).powi(2)).sum::<f64>().sqrt()
}

/// Cosine of the angle between two vectors; 0 where one has no length.
pub(crate) fn cosine(a: DVec3, b: DVec3) -> f64 {
    let length = (a.dot(a) * b.dot(b)).sqrt();
    if length > 0.0 { a.dot(b) / length } else { 0.0 }
}

/// Where the point of the segment `a`–`b` that is nearest to `p` lies: 0 at `a`, 1 at `b`. 0 for a segment of no length.
#[inline]
pub(crate) fn share_along(p: DVec3, a: DVec3, b: DVec3) -> f64 {
    let (d, length) = (b - a, (b - a).length_squared());
    if length > 0.0 { ((p - a).dot(d) / length).clamp(0.0, 1.0) } else { 0.0 }
}

/// The point of the segment `a`–`b` that is nearest to `p`.
#[inline]
pub(crate) fn nearest_of_segment(a: DVec3, b: DVec3, p: DVec3) -> DVec3 {
    a + (b - a) * share_along(p, a, b)
}

/// The nearest points of two segments.
#[inline]
pub(crate) fn nearest_of_segments([a, b]: [DVec3; 2], [c, d]: [DVec3; 2]) -> (DVec3, DVec3) {
    let (u, v, w) = (b - a, d - c, a - c);
    let (uu, uv, vv, uw, vw) = (u.dot(u), u.dot(v), v.dot(v), u.dot(w), v.dot(w));
    let det = uu * vv - uv * uv;
    let s = if det > 0.0 { ((uv * vw - vv * uw) / det).clamp(0.0, 1.0) } else { 0.0 };
    let y = nearest_of_segment(c, d, a + u * s);
    let x = nearest_of_segment(a, b, y);
    (x, nearest_of_segment(c, d, x))
}

/// The nearest point of a triangle.
pub(crate) fn nearest_of_triangle(points: &[DVec3; 3], p: DVec3) -> DVec3 {
    let [a, b, c] = *points;
    let n = (b - a).cross(c - a);
    if [(a, b), (b, c), (c, a)].iter().all(|(u, v)| (*v - *u).cross(p - *u).dot(n) > 0.0) {
        return p - n * ((p - a).dot(n) / n.length_squared());
    }
    let sides = [(a, b), (b, c), (c, a)].each(|(u, v)| nearest_of_segment(u, v, p));
    sides[1..].iter().fold(sides[0], |best, q| if q.distance(p) < best.distance(p) { *q } else { best })
}

/// Squared distance of a point from a triangle (Ericson, Real-Time Collision Detection, 2005, 5.1.5: by the regions of its edges and face).
#[inline]
pub(crate) fn square_distance(p: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let to_edge = |a, b| (p - a - (b - a) * share_along(p, a, b)).length_squared();
    let rim = to_edge(a, b).min(to_edge(b, c)).min(to_edge(c, a));
    let normal = (b - a).cross(c - a);
    let is_over = |a: DVec3, b: DVec3| normal.cross(b - a).dot(p - a) >= 0.0;
    if normal.length_squared() > 0.0 && is_over(a, b) && is_over(b, c) && is_over(c, a) {
        let height = normal.dot(p - a);
        return rim.min(height * height / normal.length_squared());
    }
    rim
}

/// The length of a triangle's longest edge.
pub(crate) fn longest_edge(corners: &[[f32; 3]; 3]) -> f64 {
    let [a, b, c] = corners.each(place);
    a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a)).sqrt()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// No point of the triangle is nearer, and one about there is as near.
        #[test]
        fn distance_from_a_triangle_is_that_of_its_nearest_point(c in prop::array::uniform12(-4i8..5)) {
            const STEPS: u32 = 40;
            let v = |i: usize| DVec3::from_array([c[i], c[i + 1], c[i + 2]].map(f64::from));
            let (p, [a, b, c]) = (v(0), [v(3), v(6), v(9)]);
            let found = square_distance(p, [a, b, c]).sqrt();
            let steps = (0..=STEPS).flat_map(|i| (0..=STEPS - i).map(move |j| (i, j)));
            let points = steps.map(|(i, j)| a + ((b - a) * f64::from(i) + (c - a) * f64::from(j)) / f64::from(STEPS));
            let nearest = points.map(|point| point.distance(p)).fold(f64::INFINITY, f64::min);
            let step = ((b - a).length() + (c - a).length()) / f64::from(STEPS);
            prop_assert!(found <= nearest + 1e-9 && nearest <= found + step + 1e-9, "{} for {}", found, nearest);
        }
    }
}
