//! The volume that a tool sweeps along a pass, as signed distance.

use super::cutter::Cutter;
use crate::space::{Vector, minus, plus, times};

/// The golden section: a search keeps so much of its interval at each step.
const GOLDEN: f64 = 0.618_033_988_75;

/// The way of the tip: straight moves, or an arc about the Z axis.
pub(super) enum Pass {
    Lines(Vec<Vector>),
    Arc { radius: f64, z: f64, angles: [f64; 2] },
}

/// The least distance of a point from a tool on a straight move.
fn over(cutter: Cutter, from: Vector, to: Vector, p: Vector) -> f64 {
    let way = minus(to, from);
    let at = |t: f64| cutter.distance(minus(p, plus(from, times(way, t))));
    if way[2] == 0.0 {
        // The distance grows with that from the axis, which is least beside the point.
        let t = ((p[0] - from[0]) * way[0] + (p[1] - from[1]) * way[1]) / (way[0] * way[0] + way[1] * way[1]);
        return at(t.clamp(0.0, 1.0));
    }
    // The distance is convex along the move.
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..30 {
        let (a, b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
        if at(a) < at(b) { high = b } else { low = a }
    }
    at(0.5 * (low + high)).min(at(0.0)).min(at(1.0))
}

impl Pass {
    /// Signed distance of a point from the swept volume, negative inside; infinite from straight moves that are far from beside it.
    pub(super) fn distance(&self, cutter: Cutter, p: Vector) -> f64 {
        match self {
            Self::Lines(points) => {
                let Some((best, least)) = nearest(points, cutter, p) else { return f64::INFINITY };
                beside(points, best).map(|[from, to]| over(cutter, from, to, p)).fold(least, f64::min)
            }
            Self::Arc { radius, z, angles } => {
                let angle = p[1].atan2(p[0]).clamp(angles[0], angles[1]);
                cutter.distance(minus(p, [radius * angle.cos(), radius * angle.sin(), *z]))
            }
        }
    }

    /// Whether a point is inside the swept volume or on it.
    fn holds(&self, cutter: Cutter, p: Vector) -> bool {
        match self {
            Self::Lines(points) => {
                let Some((best, least)) = nearest(points, cutter, p) else { return false };
                least <= 0.0 || beside(points, best).any(|[from, to]| over(cutter, from, to, p) <= 0.0)
            }
            Self::Arc { .. } => self.distance(cutter, p) <= 0.0,
        }
    }

    /// Where a ray from a point along a unit normal enters the volume, between two heights; the upper one if it does not.
    pub(super) fn entry(&self, cutter: Cutter, (point, normal): (Vector, Vector), range: [f64; 2]) -> f64 {
        let lifted = |height: f64| plus(point, times(normal, height));
        let at = |height: f64| self.distance(cutter, lifted(height));
        let holds = |height: f64| self.holds(cutter, lifted(height));
        let [mut low, mut high] = range;
        if holds(low) {
            return low;
        }
        // The upper end comes down until it is inside.
        for _ in 0..28 {
            if holds(high) {
                break;
            }
            let (a, b) = (high - 0.618 * (high - low), low + 0.618 * (high - low));
            if at(a) < at(b) { high = b } else { low = a }
        }
        if !holds(high) {
            return range[1];
        }
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if holds(middle) { high = middle } else { low = middle }
        }
        high
    }
}

/// The corner of a path at which the tool is nearest to a point, and the distance there. The nearest place of the whole path lies on a
/// move beside it, as the path bends by little.
fn nearest(points: &[Vector], cutter: Cutter, p: Vector) -> Option<(usize, f64)> {
    points
        .iter()
        .enumerate()
        .filter(|(_, tip)| points.len() < 3 || (tip[1] - p[1]).abs() < 0.6 * cutter.radius)
        .map(|(n, tip)| (n, cutter.distance(minus(p, *tip))))
        .min_by(|a, b| a.1.total_cmp(&b.1))
}

/// The moves that begin or end at this corner of a path.
fn beside(points: &[Vector], corner: usize) -> impl Iterator<Item = [Vector; 2]> {
    points.array_windows().copied().skip(corner.saturating_sub(1)).take(if corner == 0 { 1 } else { 2 })
}

#[cfg(test)]
mod tests {
    use super::*;

    const BALL: Cutter = Cutter { radius: 3.0, corner: 3.0 };

    #[test]
    fn a_ball_on_a_line_sweeps_a_cylinder_with_round_ends() {
        // Its axis goes through (0, 0, 3) and (0, 10, 7).
        let pass = Pass::Lines(vec![[0.0, 0.0, 0.0], [0.0, 10.0, 4.0]]);
        let across = 1.0 / 116f64.sqrt();
        for (p, distance) in [
            ([3.5, 5.0, 5.0], 0.5),
            ([0.0, 5.0 + 16.0 * across, 5.0 - 40.0 * across], 1.0),
            ([0.0, -4.0, 3.0], 1.0),
            ([0.0, 5.0, 5.0], -3.0),
        ] {
            assert!((pass.distance(BALL, p) - distance).abs() < 1e-9, "{p:?}: {}", pass.distance(BALL, p));
        }
    }

    #[test]
    fn a_ray_enters_where_the_distance_is_nothing() {
        let pass = Pass::Arc { radius: 20.0, z: 0.0, angles: [0.0, 1.0] };
        // A ball of radius 3 is 3 − √(9 − 1) high at 1 beside its pass.
        let ray = ([21.0 * 0.5f64.cos(), 21.0 * 0.5f64.sin(), 0.0], [0.0, 0.0, 1.0]);
        assert!((pass.entry(BALL, ray, [-0.1, 0.5]) - (3.0 - 8f64.sqrt())).abs() < 1e-9);
        assert_eq!(pass.entry(BALL, ray, [-0.1, 0.1]), 0.1, "it enters higher");
        assert_eq!(pass.entry(BALL, ray, [0.2, 0.5]), 0.2, "it begins inside");
    }
}
