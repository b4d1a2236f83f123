//! The angles at which triangles lie around a line.
//!
//! Thin triangles that run from two points to one rim, as those of a double cone, overlap as boxes each with each, along any direction. But around
//! the line through the points each has its own angle. Seen along the line, a triangle whose corners beside it span less than half a turn
//! lies between the angles of these, but for corners on the line, which are the two points. So triangles of which one ends before
//! the other begins have nothing in common but such a corner, if both have it.
//!
//! An angle is told as a number that grows with it, up to 4 for a whole turn and by 2 for a half: y ∕ (|x| + |y|) and what continues it. With ε = 2⁻⁵³ and a
//! frame that is off by some 16ε, x and y are off by less than 32ε|w|₁ for a point w away from the first end, and the number by less than
//! three times that for each |x| + |y|. 2⁻⁴⁰ is taken, thirty times more. Where it might be on the other side of where numbers begin, a triangle has all angles.

use crate::geometry::exact::Point;
use crate::geometry::tri_tri::Triangle;

/// A line through two points.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axis {
    ends: [Point; 2],
    /// Two vectors of length 1 that are upright on the line and on each other.
    frame: [[f64; 3]; 2],
}

/// All angles.
pub(crate) const ALL: [f32; 2] = [-3.0, 3.0];

/// Bound of the error of a number, for points that are as far from the line as from its end.
const ERROR: f64 = 1.0 / (1_u64 << 40) as f64;

/// Larger errors say nothing.
const LARGEST: f64 = 1.0 / 4096.0;

/// Less than half a turn, by more than rounding.
const NEARLY_HALF: f64 = 1.999;

impl Axis {
    /// None through two points that are one.
    pub(crate) fn through(ends: [Point; 2]) -> Option<Self> {
        let along = unit(minus(ends[1], ends[0]))?;
        let k = (0..3).min_by(|i, j| along[*i].abs().total_cmp(&along[*j].abs()))?;
        let right = unit(cross(along, std::array::from_fn(|i| f64::from(u8::from(i == k)))))?;
        Some(Self { ends, frame: [right, cross(along, right)] })
    }

    /// The numbers of the angles between which a triangle lies, rounded outward; [`ALL`] if that is not sure.
    #[inline]
    pub(crate) fn angles(&self, triangle: &Triangle) -> [f32; 2] {
        let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
        for p in triangle.iter().filter(|p| !self.ends.contains(p)) {
            let Some([from, to]) = self.angle(*p) else { return ALL };
            (lo, hi) = (lo.min(from), hi.max(to));
        }
        // Not where there is no corner, either.
        if (0.0..NEARLY_HALF).contains(&(hi - lo)) { [(lo as f32).next_down(), (hi as f32).next_up()] } else { ALL }
    }

    /// Between which numbers the angle of a point is.
    #[inline]
    fn angle(&self, p: Point) -> Option<[f64; 2]> {
        let way = minus(p, self.ends[0]);
        let [x, y] = self.frame.map(|side| dot(way, side));
        let size = x.abs() + y.abs();
        let part = y / size;
        let number = match (x >= 0.0, y >= 0.0) {
            (true, _) => part,
            (false, true) => 2.0 - part,
            (false, false) => -2.0 - part,
        };
        let error = (way[0].abs() + way[1].abs() + way[2].abs()) / size * ERROR;
        (error < LARGEST && number.abs() + error < 2.0).then_some([number - error, number + error])
    }
}

fn minus(a: Point, b: Point) -> [f64; 3] {
    std::array::from_fn(|k| f64::from(a[k]) - f64::from(b[k]))
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn unit(v: [f64; 3]) -> Option<[f64; 3]> {
    let length = dot(v, v).sqrt();
    (length > 0.0).then(|| v.map(|x| x / length))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::geometry::collinear::is_collinear;
    use crate::geometry::tri_tri::{Contact, triangles_cross};

    const TIPS: [Point; 2] = [[0.0, 0.0, 20.0], [0.0, 0.0, -20.0]];

    #[test]
    fn triangles_of_a_double_cone_are_told_apart() {
        let n = 100_000;
        let rim = |k: usize| {
            let angle = (k as f64 + 0.5) / n as f64 * std::f64::consts::TAU;
            [(40.0 * angle.cos()) as f32, (40.0 * angle.sin()) as f32, (k % 3) as f32]
        };
        let axis = Axis::through(TIPS).unwrap();
        let mut angles: Vec<[f32; 2]> = (0..n).map(|k| axis.angles(&[TIPS[k % 2], rim(k), rim((k + 1) % n)])).collect();
        assert_eq!(angles.iter().filter(|angles| **angles == ALL).count(), 1, "one lies across where numbers begin");
        angles.retain(|angles| *angles != ALL);
        angles.sort_by(|a, b| a[0].total_cmp(&b[0]));
        assert!(angles.windows(3).all(|some| some[0][1] < some[2][0]), "but neighbours");
    }

    #[test]
    fn what_goes_around_has_all_angles() {
        let axis = Axis::through(TIPS).unwrap();
        assert_eq!(axis.angles(&[[1.0, 0.0, 0.0], [-1.0, 1.0, 0.0], [-1.0, -1.0, 0.0]]), ALL);
        assert_eq!(axis.angles(&[[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), ALL, "half a turn");
        assert_eq!(axis.angles(&[[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), ALL, "another corner on the line");
        assert_eq!(axis.angles(&[TIPS[0], TIPS[1], TIPS[0]]), ALL);
        assert!(Axis::through([TIPS[0]; 2]).is_none());
    }

    proptest! {
        #[test]
        fn what_is_told_apart_has_nothing_but_ends_in_common(
            ends in prop::array::uniform2(prop::array::uniform3(-3..4_i8)),
            corners in prop::array::uniform6(prop::array::uniform3(-3..4_i8)),
            scale in prop::sample::select(vec![1.0_f32, 0.1, 1e-45, 3e37]),
        ) {
            let point = |p: [i8; 3]| p.map(|x| f32::from(x) * scale);
            let (ends, corners) = (ends.map(point), corners.map(point));
            let [a, b]: [Triangle; 2] = [[corners[0], corners[1], corners[2]], [corners[3], corners[4], corners[5]]];
            let Some(axis) = Axis::through(ends) else { return Ok(()) };
            let [[a_lo, a_hi], [b_lo, b_hi]] = [&a, &b].map(|t| axis.angles(t));
            let solid = [&a, &b].iter().all(|[p, q, r]| !is_collinear(p, q, r));
            if solid && (a_hi < b_lo || b_hi < a_lo) {
                let contact = triangles_cross(&a, &b);
                prop_assert!(!contact.is_crossing(), "{:?} {:?} {:?}", ends, a, b);
                let has_end = |t: &Triangle| t.iter().any(|p| ends.contains(p));
                prop_assert!((has_end(&a) && has_end(&b)) || contact == Contact::Apart);
            }
        }
    }
}
