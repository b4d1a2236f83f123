//! Sizes of rims.

use super::super::vector::{Point, add, cross, distance, dot, frame, mean, norm, scale, sub, unit};

/// What is measured of a closed polygon.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rim {
    pub(super) centre: Point,
    /// The diameter of the circle through its vertices, if they lie on one evenly enough.
    pub(super) diameter: Option<f64>,
    /// The narrower side of the least box around it.
    pub(super) width: f64,
    pub(super) length: f64,
    /// Four areas by the outline: the width of a square, twice that of a long strip.
    pub(super) hydraulic: f64,
    pub(super) area: f64,
}

/// Measures a polygon, seen along its directed area (Newell). O(n²) at most in the corners of its hull.
pub(super) fn rim(points: &[Point]) -> Rim {
    let centre = mean(points);
    let next = |k: usize| points[(k + 1) % points.len()];
    let area2 = points.iter().enumerate().fold([0.0; 3], |sum, (k, p)| add(sum, cross(sub(*p, centre), sub(next(k), centre))));
    let outline: f64 = points.iter().enumerate().map(|(k, p)| distance(*p, next(k))).sum();
    let normal = unit(area2).unwrap_or([0.0, 0.0, 1.0]);
    let [e, f] = frame(normal);
    let flat: Vec<[f64; 2]> = points.iter().map(|p| sub(*p, centre)).map(|d| [dot(d, e), dot(d, f)]).collect();
    let hull = hull(&flat);
    let (mut width, mut length) = (f64::INFINITY, 0.0);
    for (k, a) in hull.iter().enumerate() {
        let b = hull[(k + 1) % hull.len()];
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let by = dx.hypot(dy).max(1e-300);
        let span = |dx: f64, dy: f64| {
            let reach = hull.iter().map(|p| (p[0] * dx + p[1] * dy) / by);
            let (low, high) = reach.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
            high - low
        };
        let (across, along) = (span(-dy, dx), span(dx, dy));
        if across.min(along) < width {
            (width, length) = (across.min(along), across.max(along));
        }
    }
    let (circle, diameter) = round(&flat, &hull);
    let centre = add(centre, add(scale(e, circle[0]), scale(f, circle[1])));
    Rim { centre, diameter, width, length, hydraulic: 2.0 * norm(area2) / outline.max(1e-300), area: norm(area2) / 2.0 }
}

/// The middle, and the diameter where six vertices at least lie within 3 % of a circle around it, none farther than 62° from
/// the next.
fn round(flat: &[[f64; 2]], hull: &[[f64; 2]]) -> ([f64; 2], Option<f64>) {
    let bounds = |k: usize| {
        let (low, high) = flat.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p[k]), h.max(p[k])));
        (low + high) / 2.0
    };
    let middle = [bounds(0), bounds(1)];
    let far = |p: &[f64; 2]| (p[0] - middle[0]).hypot(p[1] - middle[1]);
    let (low, high) = flat.iter().map(far).fold((f64::INFINITY, 0.0_f64), |(l, h), x| (l.min(x), h.max(x)));
    // A polygon of few corners is not symmetric to its box: 8 % there.
    let slack = if flat.len() < 16 { 0.92 } else { 0.97 };
    if hull.len() < 6 || low < slack * high {
        return (middle, None);
    }
    let mut angles: Vec<f64> = flat.iter().map(|p| (p[1] - middle[1]).atan2(p[0] - middle[0])).collect();
    angles.sort_by(f64::total_cmp);
    let wrap = angles.first().zip(angles.last()).map_or(7.0, |(a, b)| a + std::f64::consts::TAU - b);
    let gap = angles.windows(2).map(|w| w[1] - w[0]).fold(wrap, f64::max);
    (middle, (gap < 1.083).then_some(low + high))
}

/// The convex hull, counter-clockwise (Andrew's monotone chain). O(n log n).
fn hull(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let turn = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let half = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut chain: Vec<[f64; 2]> = Vec::new();
        for point in points {
            while let [.., a, b] = chain[..] {
                if turn(a, b, point) > 0.0 {
                    break;
                }
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut low = half(&mut sorted.iter().copied());
    low.extend(half(&mut sorted.iter().rev().copied()));
    low
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rectangle_has_its_sides_and_a_hexagon_its_diameter() {
        let r = rim(&[[0.0, 0.0, 1.0], [6.0, 0.0, 1.0], [6.0, 2.0, 1.0], [0.0, 2.0, 1.0]]);
        assert!((r.width - 2.0).abs() < 1e-12 && (r.length - 6.0).abs() < 1e-12 && r.diameter.is_none());
        assert!((r.hydraulic - 3.0).abs() < 1e-12);
        let corner = |k: i32| [f64::from(k) * std::f64::consts::FRAC_PI_3].map(|t| [3.0 * t.cos(), 3.0 * t.sin(), 0.0])[0];
        let r = rim(&(0..6).map(corner).collect::<Vec<_>>());
        assert!((r.diameter.unwrap() - 6.0).abs() < 1e-9);
    }
}
