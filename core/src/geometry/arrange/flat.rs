//! Signs in the plane of a triangle, seen along an axis: from differences in floating point where these decide, else from integers.
//!
//! A point is known to 2⁻¹⁰⁰ of its coordinates, in two floating point numbers. So the difference of two is good to 2⁻⁵² of itself,
//! however near they are, and only what is all but on one line or circle needs integers.

use std::cmp::Ordering;

use crate::geometry::arrange::point::{Point, WORDS};
use crate::geometry::arrange::wide::Wide;
use crate::geometry::exact::sign;

const TWICE: usize = 2 * WORDS;
/// 2⁻¹⁰⁰: four of such numbers have no bit below 2⁻⁶¹².
const LEAST: f64 = 1.0 / (1_u128 << 100) as f64;
type Long = Wide<TWICE>;
type Longer = Wide<{ 2 * TWICE }>;

/// A point's two coordinates, rounded, and what is missing in each.
#[derive(Clone, Copy)]
struct Seen {
    x: f64,
    y: f64,
    x_low: f64,
    y_low: f64,
}

/// Points of one plane, as seen along an axis.
pub(crate) struct Flat<'a> {
    points: Vec<&'a Point>,
    seen: Vec<Seen>,
    /// Of each coordinate, at most.
    error: f64,
    /// The axis along which they are seen, and the others.
    pub(crate) axis: usize,
    axes: [usize; 2],
}

impl<'a> Flat<'a> {
    pub(crate) fn new(points: Vec<&'a Point>, axis: usize) -> Self {
        let axes = others(axis);
        let seen: Vec<Seen> = points.iter().map(|p| Seen::of(p, axes)).collect();
        let error = error(&seen);
        Self { points, seen, error, axis, axes }
    }

    pub(crate) fn len(&self) -> usize {
        self.points.len()
    }

    /// The rounded coordinate; rounding keeps order.
    pub(crate) fn at(&self, i: usize) -> [f64; 2] {
        [self.seen[i].x, self.seen[i].y]
    }

    /// By the first coordinate, then the second.
    pub(crate) fn cmp(&self, a: usize, b: usize) -> Ordering {
        let (a, b) = (self.points[a], self.points[b]);
        a.cmp_along(b, self.axes[0]).then_with(|| a.cmp_along(b, self.axes[1]))
    }

    /// +1 if a, b, c turn to the left, 0 if they are on one line.
    #[inline]
    pub(crate) fn turn(&self, a: usize, b: usize, c: usize) -> i8 {
        match self.certain_turn(a, b, c) {
            0 => turn_exactly([self.points[a], self.points[b], self.points[c]], self.axes),
            sign => sign,
        }
    }

    /// Do two segments cross inside of both?
    pub(crate) fn cross(&self, (a, b): (usize, usize), (c, d): (usize, usize)) -> bool {
        self.turn(a, b, c) * self.turn(a, b, d) < 0 && self.turn(c, d, a) * self.turn(c, d, b) < 0
    }

    /// As [`Flat::turn`]; 0 also if in doubt.
    #[inline(always)]
    pub(crate) fn certain_turn(&self, a: usize, b: usize, c: usize) -> i8 {
        certain_turn([&self.seen[a], &self.seen[b], &self.seen[c]], self.error)
    }

    /// +1 if d lies inside of the circle through a, b, c, which turn to the left.
    #[inline]
    pub(crate) fn in_circle(&self, [a, b, c]: [usize; 3], d: usize) -> i8 {
        match self.certain_in_circle([a, b, c], d) {
            0 => in_circle_exactly([self.points[a], self.points[b], self.points[c], self.points[d]], self.axes),
            sign => sign,
        }
    }

    #[inline(always)]
    fn certain_in_circle(&self, [a, b, c]: [usize; 3], d: usize) -> i8 {
        let (a, b, c, d) = (&self.seen[a], &self.seen[b], &self.seen[c], &self.seen[d]);
        let (ux, uy, vx, vy) = (a.right_of(d), a.above(d), b.right_of(d), b.above(d));
        let (wx, wy) = (c.right_of(d), c.above(d));
        let (u, v, w) = (ux * ux + uy * uy, vx * vx + vy * vy, wx * wx + wy * wy);
        let (vw, wv, wu, uw, uv, vu) = (vx * wy, vy * wx, wx * uy, wy * ux, ux * vy, uy * vx);
        let value = u * (vw - wv) + v * (wu - uw) + w * (uv - vu);
        let magnitude = u * (vw.abs() + wv.abs()) + v * (wu.abs() + uw.abs()) + w * (uv.abs() + vu.abs());
        let size = ux.abs().max(uy.abs()).max(vx.abs()).max(vy.abs()).max(wx.abs()).max(wy.abs()).max(self.error);
        // The rounding of some ten operations; and 24 products of four such sizes, each of which may be off by the error.
        let error = magnitude * (1.0 / (1_u64 << 48) as f64) + 256.0 * self.error * size * size * size;
        i8::from(value > error) - i8::from(-value > error)
    }
}

impl Seen {
    fn of(p: &Point, [x, y]: [usize; 2]) -> Self {
        Self { x: p.high[x], y: p.high[y], x_low: p.low[x], y_low: p.low[y] }
    }

    /// Differences, good to 2⁻⁵² of themselves and the error.
    #[inline(always)]
    fn right_of(&self, other: &Self) -> f64 {
        difference(self.x, self.x_low, other.x, other.x_low)
    }

    #[inline(always)]
    fn above(&self, other: &Self) -> f64 {
        difference(self.y, self.y_low, other.y, other.y_low)
    }
}

#[inline(always)]
fn difference(x: f64, x_low: f64, y: f64, y_low: f64) -> f64 {
    // The difference loses something, which is added (Knuth's two-sum).
    let difference = x - y;
    let seen = x - difference;
    let lost = (x - (difference + seen)) + (seen - y);
    difference + (lost + (x_low - y_low))
}

/// The axes that are seen along one.
fn others(axis: usize) -> [usize; 2] {
    [(axis + 1) % 3, (axis + 2) % 3]
}

/// The error of differences of points, at most: 2⁻⁹⁸ of the largest coordinate.
fn error(seen: &[Seen]) -> f64 {
    seen.iter().fold(0.0_f64, |m, p| m.max(p.x.abs()).max(p.y.abs())) * (1.0 / (1_u128 << 98) as f64)
}

/// How three points turn; 0 also if in doubt.
#[inline(always)]
fn certain_turn([a, b, c]: [&Seen; 3], of_difference: f64) -> i8 {
    let (ux, uy, vx, vy) = (b.right_of(a), b.above(a), c.right_of(a), c.above(a));
    let (p, q) = (ux * vy, uy * vx);
    let lengths = ux.abs() + uy.abs() + vx.abs() + vy.abs() + of_difference;
    let error = (p.abs() + q.abs()) * (1.0 / (1_u64 << 49) as f64) + 2.0 * of_difference * lengths;
    i8::from(p - q > error) - i8::from(q - p > error)
}

/// How three points turn, seen along an axis: +1 to the left, 0 if they are on one line.
pub(crate) fn turn(points: [&Point; 3], axis: usize) -> i8 {
    let axes = others(axis);
    let seen = points.map(|p| Seen::of(p, axes));
    match certain_turn(seen.each_ref(), error(&seen)) {
        0 => turn_exactly(points, axes),
        sign => sign,
    }
}

/// A coordinate's difference, times both denominators.
fn less(a: &Point, b: &Point, k: usize) -> Long {
    let (p, q): (Long, Long) = (a.part(k).times(&b.part(3)), b.part(k).times(&a.part(3)));
    p.minus(&q)
}

/// The coordinates of points that are what they are rounded to: predicates on these are cheaper (Shewchuk, "Adaptive precision floating-point arithmetic
/// and fast robust geometric predicates", 1997). None is so near to zero that what is lost of a product of four would be.
fn rounded<const N: usize>(points: [&Point; N], axes: [usize; 2]) -> Option<[robust::Coord<f64>; N]> {
    let [x, y] = axes;
    let is_whole = |x: f64| x == 0.0 || x.abs() > LEAST;
    let is_safe = |p: &&Point| p.exact && is_whole(p.high[x]) && is_whole(p.high[y]);
    points.iter().all(is_safe).then(|| points.map(|p| robust::Coord { x: p.high[x], y: p.high[y] }))
}

#[cold]
fn turn_exactly([a, b, c]: [&Point; 3], axes: [usize; 2]) -> i8 {
    if let Some([a, b, c]) = rounded([a, b, c], axes) {
        return sign(robust::orient2d(a, b, c));
    }
    let ([ux, uy], [vx, vy]) = (axes.map(|k| less(b, a, k)), axes.map(|k| less(c, a, k)));
    let (p, q): (Longer, Longer) = (ux.times(&vy), uy.times(&vx));
    p.minus(&q).sign()
}

#[cold]
fn in_circle_exactly([a, b, c, d]: [&Point; 4], axes: [usize; 2]) -> i8 {
    if let Some([a, b, c, d]) = rounded([a, b, c, d], axes) {
        return sign(robust::incircle(a, b, c, d));
    }
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
