//! A direction that sees all triangles of a fan from one side.
//!
//! The directions d with n·d > 0 for all normals n are a convex cone, and have a positive component along the sum of the normals. So they are those over a convex
//! part of a plane upright on the sum. That part is looked for by cutting planes: a polygon that holds it is cut through its centroid by a normal that
//! the centroid does not see, which leaves at most 1 − 1/e of its area (Grünbaum, Pacific J. Math. 10(4), 1960). What
//! is found is only tried, so rounding does no harm.

use super::real::{Real, cross, dot};

/// Rounds, each of which looks at all normals: these find what is 10⁻²³ of the first polygon.
const ROUNDS: usize = 120;

/// How far the first polygon goes: directions up to this slope against the sum.
const WIDE: f64 = 4096.0;

/// A direction along which every one of the unit vectors `normals` has a positive component, if one is found that is not too far from
/// `sum`, a sum of positive multiples of them. O(normals).
pub(super) fn upward(normals: &[[f32; 3]], sum: [f64; 3]) -> Option<[f64; 3]> {
    let up = unit(sum)?;
    let axis = if up[0].size() < 0.5 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let right = unit(cross(up, axis))?;
    let frame = [up, right, cross(up, right)];
    let mut polygon = vec![[-WIDE, -WIDE], [WIDE, -WIDE], [WIDE, WIDE], [-WIDE, WIDE]];
    for _ in 0..ROUNDS {
        let [x, y] = centroid(&polygon)?;
        let along: [f64; 3] = std::array::from_fn(|k| frame[0][k] + x * frame[1][k] + y * frame[2][k]);
        let (mut lowest, mut least) = (f64::INFINITY, [0.0; 3]);
        for normal in normals.iter().map(|n| n.map(f64::from)) {
            let height = dot(normal, along);
            if height < lowest {
                (lowest, least) = (height, normal);
            }
        }
        if lowest > 0.0 {
            return Some(along);
        }
        polygon = cut(&polygon, frame.map(|side| dot(least, side)));
    }
    None
}

/// The vector of length 1, if rounding leaves one.
pub(super) fn unit(v: [f64; 3]) -> Option<[f64; 3]> {
    let length = dot(v, v).sqrt();
    (length > 1e-140 && length < 1e140).then(|| v.map(|x| x / length))
}

/// Of a convex polygon; none if hardly anything is left of it.
fn centroid(polygon: &[[f64; 2]]) -> Option<[f64; 2]> {
    let from = *polygon.first()?;
    let (mut area, mut at) = (0.0, [0.0; 2]);
    for pair in polygon.windows(2) {
        let [p, q] = [pair[0], pair[1]].map(|p| [p[0] - from[0], p[1] - from[1]]);
        let part = p[0] * q[1] - p[1] * q[0];
        area += part;
        at = [0, 1].map(|k| at[k] + part * (p[k] + q[k]) / 3.0);
    }
    (area > 1e-20).then(|| [0, 1].map(|k| from[k] + at[k] / area))
}

/// The part of a polygon where `line[0] + line[1]·x + line[2]·y` is positive.
fn cut(polygon: &[[f64; 2]], line: [f64; 3]) -> Vec<[f64; 2]> {
    let height = |p: [f64; 2]| line[0] + line[1] * p[0] + line[2] * p[1];
    let mut left = Vec::with_capacity(polygon.len() + 1);
    for (i, p) in polygon.iter().enumerate() {
        let q = polygon[(i + 1) % polygon.len()];
        let (at_p, at_q) = (height(*p), height(q));
        if at_p > 0.0 {
            left.push(*p);
        }
        if (at_p > 0.0) != (at_q > 0.0) {
            let share = at_p / (at_p - at_q);
            left.push([0, 1].map(|k| p[k] + share * (q[k] - p[k])));
        }
    }
    left
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Normals within `slope` of being upright on `along`, all around it, more on one side.
    fn normals(along: [f64; 3], slope: f64) -> Vec<[f32; 3]> {
        let right = unit(cross(along, [0.3, -0.2, 0.9])).unwrap();
        let front = cross(along, right);
        let normal = |i: i32| {
            // Twice as many on one side.
            let turn = if i % 3 == 0 { f64::from(i % 100) / 50.0 } else { f64::from(i) };
            unit([0, 1, 2].map(|k| turn.cos() * right[k] + turn.sin() * front[k] + slope * along[k])).unwrap().map(|x| x as f32)
        };
        (0..1000).map(normal).collect()
    }

    #[test]
    fn a_narrow_cone_is_found() {
        let along = unit([0.5, -2.0, 1.0]).unwrap();
        for slope in [1.0, 0.1, 1e-2, 1e-3] {
            let normals = normals(along, slope);
            let sum = normals.iter().fold([0.0; 3], |sum, n| [0, 1, 2].map(|k| sum[k] + f64::from(n[k])));
            let found = upward(&normals, sum).unwrap();
            assert!(normals.iter().all(|n| dot(n.map(f64::from), found) > 0.0));
        }
    }

    #[test]
    fn where_there_is_none_none_is_found() {
        let all = [[1.0, 0.0, 0.0], [-0.5, 0.5, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]];
        assert_eq!(upward(&all, [0.1, 0.2, 1.0]), None);
        assert_eq!(upward(&all, [0.0; 3]), None);
        assert_eq!(upward(&[], [0.0, 0.0, 2.0]).map(|d| d[2] > 0.0), Some(true));
    }
}
