//! Signs in the plane of a triangle, seen along an axis: from differences in floating point where these decide, else from integers.
//!
//! A point is known to 2⁻¹⁰⁰ of its coordinates, in two floating point numbers. So the difference of two is good to 2⁻⁵² of itself,
//! however near they are, and only what is all but on one line or circle needs integers.

use std::cmp::Ordering;

use crate::geometry::arrange::point::{Point, WORDS};
use crate::geometry::arrange::wide::Wide;

const TWICE: usize = 2 * WORDS;
type Long = Wide<TWICE>;
type Longer = Wide<{ 2 * TWICE }>;

/// Points of one plane, as seen along an axis.
pub(crate) struct Flat<'a> {
    points: Vec<&'a Point>,
    seen: Vec<[[f64; 2]; 2]>,
    /// Of each coordinate, at most.
    error: f64,
    axes: [usize; 2],
}

impl<'a> Flat<'a> {
    pub(crate) fn new(points: Vec<&'a Point>, axis: usize) -> Self {
        let axes = [(axis + 1) % 3, (axis + 2) % 3];
        let seen: Vec<[[f64; 2]; 2]> = points.iter().map(|p| [axes.map(|k| p.high[k]), axes.map(|k| p.low[k])]).collect();
        let largest = seen.iter().flat_map(|p| p[0]).fold(0.0_f64, |m, x| m.max(x.abs()));
        // 2⁻⁹⁸, for a difference.
        Self { points, seen, error: largest * (1.0 / (1_u128 << 98) as f64), axes }
    }

    pub(crate) fn len(&self) -> usize {
        self.points.len()
    }

    /// The rounded coordinate; rounding keeps order.
    pub(crate) fn at(&self, i: usize) -> [f64; 2] {
        self.seen[i][0]
    }

    /// By the first coordinate, then the second.
    pub(crate) fn cmp(&self, a: usize, b: usize) -> Ordering {
        let (a, b) = (self.points[a], self.points[b]);
        a.cmp_along(b, self.axes[0]).then_with(|| a.cmp_along(b, self.axes[1]))
    }

    /// One point less another, each coordinate good to 2⁻⁵² of it and the error.
    #[inline]
    fn less(&self, a: usize, b: usize) -> [f64; 2] {
        let (a, b) = (&self.seen[a], &self.seen[b]);
        [0, 1].map(|k| {
            // What the difference loses (Knuth's two-sum).
            let (x, y) = (a[0][k], b[0][k]);
            let difference = x - y;
            let seen = x - difference;
            let lost = (x - (difference + seen)) + (seen - y);
            difference + (lost + (a[1][k] - b[1][k]))
        })
    }

    /// +1 if a, b, c turn to the left, 0 if they are on one line.
    #[inline]
    pub(crate) fn turn(&self, a: usize, b: usize, c: usize) -> i8 {
        let ([ux, uy], [vx, vy]) = (self.less(b, a), self.less(c, a));
        let (p, q) = (ux * vy, uy * vx);
        let lengths = ux.abs() + uy.abs() + vx.abs() + vy.abs() + self.error;
        let error = (p.abs() + q.abs()) * (1.0 / (1_u64 << 49) as f64) + 2.0 * self.error * lengths;
        if (p - q).abs() > error {
            if p > q { 1 } else { -1 }
        } else {
            turn_exactly([a, b, c].map(|i| self.points[i]), self.axes)
        }
    }

    /// +1 if d lies inside of the circle through a, b, c, which turn to the left.
    #[inline]
    pub(crate) fn in_circle(&self, [a, b, c]: [usize; 3], d: usize) -> i8 {
        let rows = [a, b, c].map(|i| self.less(i, d));
        let lift = rows.map(|[x, y]| x * x + y * y);
        let size = rows.as_flattened().iter().fold(self.error, |m, x| m.max(x.abs()));
        let (mut value, mut magnitude) = (0.0, 0.0);
        for k in 0..3 {
            let ([vx, vy], [wx, wy]) = (rows[(k + 1) % 3], rows[(k + 2) % 3]);
            let (p, q) = (vx * wy, vy * wx);
            value += lift[k] * (p - q);
            magnitude += lift[k] * (p.abs() + q.abs());
        }
        // The rounding of some ten operations; and 24 products of four such sizes, each of which may be off by the error.
        let error = magnitude * (1.0 / (1_u64 << 48) as f64) + 256.0 * self.error * size * size * size;
        if value.abs() > error {
            return if value > 0.0 { 1 } else { -1 };
        }
        in_circle_exactly([a, b, c, d].map(|i| self.points[i]), self.axes)
    }
}

/// How three points turn, seen along an axis.
pub(crate) fn turn(points: [&Point; 3], axis: usize) -> i8 {
    Flat::new(points.to_vec(), axis).turn(0, 1, 2)
}

/// A coordinate's difference, times both denominators.
fn less(a: &Point, b: &Point, k: usize) -> Long {
    let (p, q): (Long, Long) = (a.part(k).times(&b.part(3)), b.part(k).times(&a.part(3)));
    p.minus(&q)
}

#[cold]
fn turn_exactly([a, b, c]: [&Point; 3], axes: [usize; 2]) -> i8 {
    let ([ux, uy], [vx, vy]) = (axes.map(|k| less(b, a, k)), axes.map(|k| less(c, a, k)));
    let (p, q): (Longer, Longer) = (ux.times(&vy), uy.times(&vx));
    p.minus(&q).sign()
}

#[cold]
fn in_circle_exactly([a, b, c, d]: [&Point; 4], axes: [usize; 2]) -> i8 {
    let rows = [a, b, c].map(|p| {
        let scale: Long = p.part(3).times(&d.part(3));
        let [x, y] = axes.map(|k| less(p, d, k));
        let (xx, yy): (Longer, Longer) = (x.times(&x), y.times(&y));
        let (x, y): (Longer, Longer) = (x.times(&scale), y.times(&scale));
        (x, y, xx.plus(&yy))
    });
    let mut sum = Wide::<{ 6 * TWICE }>::ZERO;
    for k in 0..3 {
        let (v, w) = (&rows[(k + 1) % 3], &rows[(k + 2) % 3]);
        let (p, q): (Wide<{ 4 * TWICE }>, Wide<{ 4 * TWICE }>) = (v.0.times(&w.1), v.1.times(&w.0));
        sum = sum.plus(&rows[k].2.times(&p.minus(&q)));
    }
    sum.sign()
}
