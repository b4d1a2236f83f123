//! The volume that a tool sweeps along a pass, as signed distance.

use super::cutter::Cutter;
use crate::space::{Vector, dot, minus, plus, times};

/// The golden section: a search keeps so much of its interval at each step.
const GOLDEN: f64 = 0.618_033_988_75;

/// The way of the tip: straight moves, or an arc about the Z axis.
pub(super) enum Pass {
    Lines(Vec<Vector>),
    Arc { radius: f64, z: f64, angles: [f64; 2] },
}

/// The least distance of a point from a tool on a straight move, at whose ends it is known; or `most`, if that is less. The distance is
/// convex along the move.
fn over(cutter: Cutter, [from, to]: [Vector; 2], ends: [f64; 2], p: Vector, most: f64) -> f64 {
    let least = most.min(ends[0]).min(ends[1]);
    let way = minus(to, from);
    let at = |t: f64| cutter.distance(minus(p, plus(from, times(way, t))));
    if way[2] == 0.0 {
        // The distance grows with that from the axis, which is least beside the point.
        let t = ((p[0] - from[0]) * way[0] + (p[1] - from[1]) * way[1]) / (way[0] * way[0] + way[1] * way[1]);
        return least.min(at(t.clamp(0.0, 1.0)));
    }
    let [falls, rises] = [from, to].map(|tip| -dot(cutter.gradient(minus(p, tip)), way));
    // Between the ends the distance is less than there only if it falls at first and rises at last, and it is no less than where both
    // tangents meet.
    if falls >= 0.0 || rises <= 0.0 || ends[0] + falls * (ends[1] - ends[0] - rises) / (falls - rises) >= least {
        return least;
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..30 {
        let (a, b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
        if at(a) < at(b) { high = b } else { low = a }
    }
    least.min(at(0.5 * (low + high)))
}

/// The least distance of a point from a tool that goes from place to place; infinite if all places are farther off along Y than the tool
/// reaches. Each move is asked: a tool with a flat end may be as near on several of them.
fn along(points: &[Vector], cutter: Cutter, p: Vector) -> f64 {
    let is_near = |tip: &Vector| points.len() < 3 || (tip[1] - p[1]).abs() < cutter.radius;
    let mut last: Option<(Vector, f64)> = None;
    let mut least = f64::INFINITY;
    for tip in points {
        let here = if is_near(tip) { Some((*tip, cutter.distance(minus(p, *tip)))) } else { None };
        if let Some((_, distance)) = here {
            least = least.min(distance);
        }
        if let (Some((from, before)), Some((to, behind))) = (last, here) {
            least = over(cutter, [from, to], [before, behind], p, least);
        }
        last = here;
    }
    least
}

impl Pass {
    /// Signed distance of a point from the swept volume, negative inside; infinite from moves that are all farther off along Y than the tool reaches.
    pub(super) fn distance(&self, cutter: Cutter, p: Vector) -> f64 {
        match self {
            Self::Lines(points) => along(points, cutter, p),
            Self::Arc { radius, z, angles } => {
                let angle = p[1].atan2(p[0]).clamp(angles[0], angles[1]);
                cutter.distance(minus(p, [radius * angle.cos(), radius * angle.sin(), *z]))
            }
        }
    }

    /// Where a ray from a point along a unit normal enters the volume, between two heights; the upper one if it does not.
    pub(super) fn entry(&self, cutter: Cutter, (point, normal): (Vector, Vector), range: [f64; 2]) -> f64 {
        let lifted = |height: f64| plus(point, times(normal, height));
        let at = |height: f64| self.distance(cutter, lifted(height));
        let holds = |height: f64| self.distance(cutter, lifted(height)) <= 0.0;
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

    #[test]
    fn all_places_under_the_tool_are_asked() {
        // The tip stands 0.1 over the point at first, and touches the floor 1.4 beside it: there the corner's circle is √(0.4² + 0.9²)
        // from the point, which is less than its radius.
        let bull = Cutter { radius: 2.0, corner: 1.0 };
        let pass = Pass::Lines(vec![[0.0, 0.0, 0.1], [0.0, 0.7, 0.1], [0.0, 1.4, 0.0]]);
        assert!(pass.distance(bull, [0.0, 0.0, 0.1]) <= 0.97f64.sqrt() - 1.0 + 1e-12);
    }

    #[test]
    fn distances_are_those_of_many_tools_on_the_way() {
        let way = vec![[0.0, 0.0, 0.0], [0.3, 0.2, 0.05], [0.5, 0.1, 0.02], [0.2, 0.6, -0.1], [0.2, 1.2, -0.1]];
        let pass = Pass::Lines(way.clone());
        for (cutter, n) in [(2.0, 0.0), (2.0, 1.0), (3.0, 3.0)].into_iter().flat_map(|form| (0..200).map(move |n| (form, n))) {
            let cutter = Cutter { radius: cutter.0, corner: cutter.1 };
            let p = [f64::from(n % 10) * 0.3 - 1.3, f64::from(n / 10) * 0.1 - 0.5, f64::from(n % 7) * 0.1 - 0.3];
            let mut least = f64::INFINITY;
            for [from, to] in way.array_windows() {
                let at = |k: i32| plus(*from, times(minus(*to, *from), f64::from(k) / 500.0));
                least = (0..=500).map(|k| cutter.distance(minus(p, at(k)))).fold(least, f64::min);
            }
            let found = pass.distance(cutter, p);
            assert!(found < least + 1e-9 && found > least - 0.002, "{cutter:?} {p:?}: {found}, {least}");
        }
    }
}
