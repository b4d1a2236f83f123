//! Signs in the plane of a triangle, seen along an axis: from differences in floating point where these decide, else from integers.
//!
//! A point is known to 2⁻¹⁰⁰ of its coordinates, in two floating point numbers. So the difference of two is good to 2⁻⁵² of itself,
//! however near they are, and only what is all but on one line or circle needs integers.

use std::cmp::Ordering;

use crate::geometry::arrange::point::Point;
use crate::geometry::arrange::wide::{WORDS, Wide, product};
use crate::geometry::exact::sign;

const TWICE: usize = 2 * WORDS;
/// Words of the numbers of most points: what is made of them is copied less if it has no room for more.
const SHORT: usize = 2;
const MEDIUM: usize = 5;
/// 2⁻¹⁰⁰: four of such numbers have no bit below 2⁻⁶¹².
const LEAST: f64 = 1.0 / (1_u128 << 100) as f64;

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
    /// The axes that are seen.
    axes: [usize; 2],
    lines: Lines,
}

/// Which points are known to be on one line.
#[derive(Default)]
pub(crate) struct Lines {
    /// By point its lines, ascending, and where each point's begin.
    lines: Vec<u32>,
    starts: Vec<u32>,
}

impl Lines {
    /// From points and the lines that they are on.
    pub(crate) fn of(points: usize, mut on: Vec<(u32, u32)>) -> Self {
        on.sort_unstable();
        on.dedup();
        let mut starts = vec![0; points + 1];
        on.iter().for_each(|(point, _)| starts[*point as usize + 1] += 1);
        (0..points).for_each(|point| starts[point + 1] += starts[point]);
        Self { lines: on.into_iter().map(|(_, line)| line).collect(), starts }
    }

    fn through(&self, point: usize) -> &[u32] {
        &self.lines[self.starts[point] as usize..self.starts[point + 1] as usize]
    }

    fn has(&self, a: usize, b: usize, c: usize) -> bool {
        !self.lines.is_empty() && {
            let (b, c) = (self.through(b), self.through(c));
            self.through(a).iter().any(|line| b.contains(line) && c.contains(line))
        }
    }
}

impl<'a> Flat<'a> {
    pub(crate) fn new(points: Vec<&'a Point>, axis: usize) -> Self {
        let axes = others(axis);
        let seen: Vec<Seen> = points.iter().map(|p| Seen::of(p, axes)).collect();
        let error = error(&seen);
        Self { points, seen, error, axes, lines: Lines::default() }
    }

    /// The same, where some points are known to be on lines.
    pub(crate) fn with(self, lines: Lines) -> Self {
        Self { lines, ..self }
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
            0 if self.lines.has(a, b, c) => 0,
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
pub(crate) fn others(axis: usize) -> [usize; 2] {
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

/// A coordinate's difference, times both denominators.
fn less<const M: usize>(a: &Point, b: &Point, k: usize) -> Wide<M> {
    let (p, q): (Wide<M>, Wide<M>) = (product(a.part(k), b.part(3)), product(b.part(k), a.part(3)));
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
    match [a, b, c].map(Point::longest).into_iter().max() {
        Some(0..=SHORT) => turn_of::<{ 2 * SHORT + 1 }, { 4 * SHORT + 3 }>([a, b, c], axes),
        Some(0..=MEDIUM) => turn_of::<{ 2 * MEDIUM + 1 }, { 4 * MEDIUM + 3 }>([a, b, c], axes),
        _ => turn_of::<TWICE, { 2 * TWICE }>([a, b, c], axes),
    }
}

/// With so many words for products of two numbers of points, and of four.
fn turn_of<const TWO: usize, const FOUR: usize>([a, b, c]: [&Point; 3], axes: [usize; 2]) -> i8 {
    let ([ux, uy], [vx, vy]) = (axes.map(|k| less::<TWO>(b, a, k)), axes.map(|k| less::<TWO>(c, a, k)));
    let (p, q): (Wide<FOUR>, Wide<FOUR>) = (ux.times(&vy), uy.times(&vx));
    p.cmp(&q) as i8
}

#[cold]
fn in_circle_exactly([a, b, c, d]: [&Point; 4], axes: [usize; 2]) -> i8 {
    if let Some([a, b, c, d]) = rounded([a, b, c, d], axes) {
        return sign(robust::incircle(a, b, c, d));
    }
    match [a, b, c, d].map(Point::longest).into_iter().max() {
        Some(0..=SHORT) => {
            circle_of::<{ 2 * SHORT + 1 }, { 4 * SHORT + 3 }, { 8 * SHORT + 7 }, { 12 * SHORT + 11 }>([a, b, c, d], axes)
        }
        Some(0..=MEDIUM) => {
            circle_of::<{ 2 * MEDIUM + 1 }, { 4 * MEDIUM + 3 }, { 8 * MEDIUM + 7 }, { 12 * MEDIUM + 11 }>([a, b, c, d], axes)
        }
        _ => circle_of::<TWICE, { 2 * TWICE }, { 4 * TWICE }, { 6 * TWICE }>([a, b, c, d], axes),
    }
}

/// With so many words for products of two numbers of points, of four, eight and twelve.
fn circle_of<const TWO: usize, const FOUR: usize, const EIGHT: usize, const TWELVE: usize>(
    [a, b, c, d]: [&Point; 4],
    axes: [usize; 2],
) -> i8 {
    let rows = [a, b, c].map(|p| {
        let scale: Wide<TWO> = product(p.part(3), d.part(3));
        let [x, y] = axes.map(|k| less::<TWO>(p, d, k));
        let (xx, yy): (Wide<FOUR>, Wide<FOUR>) = (x.times(&x), y.times(&y));
        let (x, y): (Wide<FOUR>, Wide<FOUR>) = (x.times(&scale), y.times(&scale));
        (x, y, xx.plus(&yy))
    });
    let mut sum = Wide::<TWELVE>::ZERO;
    for k in 0..3 {
        let (v, w) = (&rows[(k + 1) % 3], &rows[(k + 2) % 3]);
        let (p, q): (Wide<EIGHT>, Wide<EIGHT>) = (v.0.times(&w.1), v.1.times(&w.0));
        sum = sum.plus(&rows[k].2.times(&p.minus(&q)));
    }
    sum.sign()
}
