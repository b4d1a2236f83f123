//! Lifts tools off the surface that is meant.
//!
//! A tool with a flat end that touches a hollow at its corner may cut below the surface with another part. Programs avoid this: the tool
//! goes up along its axis until no part of it is below the surface (B. K. Choi, R. B. Jerard, *Sculptured Surface Machining*, 1998,
//! chapter 9, on interference).

use super::cutter::Cutter;
use super::surface::Surface;
use crate::space::{Vector, length, minus, plus, times};

/// Directions from the axis in which the search for the deepest place begins.
const DIRECTIONS: usize = 16;

/// Places in each of them.
const PLACES: usize = 8;

/// The search for the deepest place ends at steps of this part of the tool's radius.
const FINE: f64 = 1e-7;

/// A tool that is deeper than this, in millimetres, cuts; less is rounding.
const DEEP: f64 = 1e-9;

/// The way of a tip over a surface: no move is longer than `most`, and each place is raised until no part of the tool is below the surface.
/// Places where none is stay as they are.
pub(super) fn lifted(cutter: Cutter, surface: Surface, tips: &[Vector], most: f64) -> Vec<Vector> {
    let raised = |tip: Vector| {
        let depth = depth(cutter, surface, tip);
        if depth > DEEP { [tip[0], tip[1], tip[2] + depth] } else { tip }
    };
    let mut way: Vec<Vector> = tips.first().copied().into_iter().collect();
    for [from, to] in tips.array_windows() {
        let count = (length(minus(*to, *from)) / most).ceil().max(1.0);
        let between = (1..count as usize).map(|k| plus(times(*from, 1.0 - k as f64 / count), times(*to, k as f64 / count)));
        way.extend(between.chain([*to]));
    }
    way.into_iter().map(raised).collect()
}

/// How far the surface stands above the tool's lower side, at most; negative if the tool is in the air, and of planes and cones, which have
/// no hollow.
pub(super) fn depth(cutter: Cutter, surface: Surface, tip: Vector) -> f64 {
    let below = |x: f64, y: f64| match surface.above(tip[0] + x, tip[1] + y) {
        Some(z) if x.hypot(y) <= cutter.radius => z - tip[2] - cutter.rise(x.hypot(y)),
        _ => f64::NEG_INFINITY,
    };
    let start = |n: usize| {
        let (sin, cos) = (std::f64::consts::TAU * n as f64 / DIRECTIONS as f64).sin_cos();
        let places = (0..=PLACES).map(|k| cutter.radius * k as f64 / PLACES as f64).map(|far| [far * cos, far * sin]);
        places.max_by(|a, b| below(a[0], a[1]).total_cmp(&below(b[0], b[1]))).unwrap_or_default()
    };
    (0..DIRECTIONS).map(|n| climb(&below, start(n), cutter.radius)).fold(f64::NEG_INFINITY, f64::max)
}

/// The greatest value about a place: goes aside as long as that is higher, then with half the step (R. Hooke, T. A. Jeeves, *"Direct
/// search" solution of numerical and statistical problems*, 1961).
fn climb(value: &impl Fn(f64, f64) -> f64, [mut x, mut y]: [f64; 2], radius: f64) -> f64 {
    let mut best = value(x, y);
    let mut step = radius / PLACES as f64;
    while step > FINE * radius {
        let aside = [[x + step, y], [x - step, y], [x, y + step], [x, y - step]];
        let [a, b] = aside.into_iter().fold([x, y], |[a, b], [c, d]| if value(c, d) > value(a, b) { [c, d] } else { [a, b] });
        let next = value(a, b);
        if next > best {
            (x, y, best) = (a, b, next);
        } else {
            step *= 0.5;
        }
    }
    best
}
