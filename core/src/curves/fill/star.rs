//! Whether a closed polyline can be seen whole from a point: no two edges of it in one direction.
//!
//! Then, and only then, the triangles of its edges and the point do not cross: seen from there, the polyline is one on a sphere,
//! and rays of different directions meet in the point alone.

use robust::{Coord3D, orient3d};

use super::fan::angle;
use crate::curves::vector::{Point, distance, dot, sub, unit};

/// A point of the polyline nearer to the centre than this share of the farthest one is there itself.
const NEAR: f64 = 1e-9;
/// Edges are seen under angles smaller than this, radians: half a turn but for what rounding does.
const WIDEST: f64 = std::f64::consts::PI - 1e-6;
/// Pairs of edges that are compared, at most, for each edge.
const PAIRS: usize = 256;

/// Whether no two edges of a closed polyline cross or touch as seen from a point. The signs are exact. O(n log n) where few edges
/// are beside each other along some axis; `false` if it needs more than 256 comparisons for each.
pub(super) fn is_star(ring: &[Point], centre: Point) -> bool {
    let far = ring.iter().map(|point| distance(*point, centre)).fold(0.0, f64::max);
    let directions: Vec<Point> = ring.iter().filter_map(|point| unit(sub(*point, centre))).collect();
    if ring.len() < 3 || directions.len() != ring.len() || ring.iter().any(|point| distance(*point, centre) <= NEAR * far) {
        return false;
    }
    let count = ring.len();
    let star = Star { ring, directions, centre };
    if (0..count).any(|at| !star.goes_on(at)) {
        return false;
    }
    let Some(axis) = (0..3).min_by(|a, b| star.shadow(*a).total_cmp(&star.shadow(*b))) else { return false };
    let mut spans: Vec<(f64, f64, usize)> = (0..count).map(|edge| star.span(edge, axis)).collect();
    spans.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
    let mut left = PAIRS.saturating_mul(count);
    for (at, (_, high, edge)) in spans.iter().enumerate() {
        for (_, _, other) in spans.iter().skip(at + 1).take_while(|(low, ..)| low <= high) {
            let Some(rest) = left.checked_sub(1) else { return false };
            left = rest;
            let is_beside = (edge + 1) % count == *other || (other + 1) % count == *edge;
            if !is_beside && star.cross(*edge, *other) {
                return false;
            }
        }
    }
    true
}

struct Star<'a> {
    ring: &'a [Point],
    directions: Vec<Point>,
    centre: Point,
}

impl Star<'_> {
    fn point(&self, number: usize) -> Point {
        self.ring.get(number % self.ring.len()).copied().unwrap_or(self.centre)
    }

    fn direction(&self, number: usize) -> Point {
        self.directions.get(number % self.ring.len()).copied().unwrap_or_default()
    }

    /// Whether the edge from a point is no half turn, and the next one does not go back along it.
    fn goes_on(&self, at: usize) -> bool {
        let [a, b, c] = [at, at + 1, at + 2].map(|number| self.point(number));
        let turn = angle(self.centre, a, b);
        if !(turn > 0.0 && turn < WIDEST) {
            return false;
        }
        let is_back = self.side([at, at + 1], at + 2) == 0.0 && {
            let (first, second) = (angle(self.centre, a, b), angle(self.centre, a, c));
            // On the same great circle, the second edge goes on only where it leads farther.
            second < first + angle(self.centre, b, c) - NEAR && second < std::f64::consts::PI - NEAR
        };
        !is_back
    }

    /// On which side of the plane of an edge and the centre a point is; exact.
    fn side(&self, [a, b]: [usize; 2], c: usize) -> f64 {
        let [o, a, b, c] = [self.centre, self.point(a), self.point(b), self.point(c)].map(|[x, y, z]| Coord3D { x, y, z });
        orient3d(o, a, b, c)
    }

    /// Whether two edges without a common point cross or touch.
    fn cross(&self, first: usize, second: usize) -> bool {
        let (a, c) = ([first, first + 1], [second, second + 1]);
        let signs = [-self.side(a, second), self.side(a, second + 1), -self.side(c, first + 1), self.side(c, first)];
        if signs.iter().all(|sign| *sign == 0.0) {
            // On one great circle: an end of one lies within the other.
            let within = |[p, q]: [usize; 2], r: usize| {
                let [p, q, r] = [p, q, r].map(|number| self.direction(number));
                dot(p, r) >= dot(p, q) - NEAR && dot(q, r) >= dot(p, q) - NEAR
            };
            return a.iter().any(|end| within(c, *end)) || c.iter().any(|end| within(a, *end));
        }
        signs.iter().all(|sign| *sign >= 0.0) || signs.iter().all(|sign| *sign <= 0.0)
    }

    /// The extent of an edge along an axis, as an arc of the sphere.
    fn span(&self, edge: usize, axis: usize) -> (f64, f64, usize) {
        let (a, b) = (self.direction(edge), self.direction(edge + 1));
        let (p, q) = (a.get(axis).copied().unwrap_or_default(), b.get(axis).copied().unwrap_or_default());
        // An arc leaves the box of its ends by no more than its height over their chord.
        let chord = distance(a, b);
        let bulge = 1.0 - (1.0 - 0.25 * chord * chord).max(0.0).sqrt();
        (p.min(q) - bulge, p.max(q) + bulge, edge)
    }

    /// The sum of extents along an axis.
    fn shadow(&self, axis: usize) -> f64 {
        (0..self.ring.len()).map(|edge| self.span(edge, axis)).map(|(low, high, _)| high - low).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn ring(count: u32, point: impl Fn(f64) -> Point) -> Vec<Point> {
        (0..count).map(|at| point(TAU * f64::from(at) / f64::from(count))).collect()
    }

    #[test]
    fn polylines_are_seen_whole_or_not() {
        // Seen from its middle, the seam of a tennis ball is simple, though no plane shows it so.
        let seam = |t: f64| [t.cos() + 0.4 * (3.0 * t).cos(), t.sin() - 0.4 * (3.0 * t).sin(), 1.2 * (2.0 * t).sin()];
        assert!(is_star(&ring(200, seam), [0.0; 3]) && !is_star(&ring(200, seam), [9.0, 0.1, 0.2]));
        // A flat ring around the centre, one that does not contain it, and an eight.
        let flat = |t: f64| [t.cos(), t.sin(), 0.0];
        assert!(is_star(&ring(50, flat), [0.2, 0.1, 0.0]) && !is_star(&ring(50, flat), [3.0, 0.0, 0.0]));
        assert!(!is_star(&ring(64, |t| [t.cos(), (2.0 * t).sin(), 1.0]), [0.01, 0.0, 0.0]));
        // Twice around, at two heights; and a point in the centre.
        assert!(!is_star(&ring(40, |t| [(2.0 * t).cos(), (2.0 * t).sin(), 0.5 * t.cos()]), [0.0; 3]));
        assert!(!is_star(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [0.0; 3]));
        // Back along itself.
        assert!(!is_star(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.5, 0.0], [0.0, 0.0, 1.0]], [0.0; 3]));
    }
}
