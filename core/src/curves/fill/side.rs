//! On which side of its outline a closed surface is meant: spheres and tori have a part on both.

use std::f64::consts::TAU;

use super::chart::{Chart, Turned};
use super::layout::{self, Corner, Layout, Lifted, Rim, area, steps};
use super::space;
use crate::curves::elementary::{Elementary, Frame, Told};
use crate::curves::vector::{Point, add, cross, distance, norm, scale, sub, unit};

/// A sphere is not seen from points nearer to its outline than this, in radii, if there are others.
const CLEAR: f64 = 0.2;
/// Edges of an outline beside which such a point is looked for, at most, and how far from them, in radii.
const SAMPLES: usize = 32;
const STEPS: [f64; 5] = [0.02, 0.06, 0.15, 0.3, 0.6];

/// The surface, of a sphere with its z-axis such that the part that is meant is seen from the opposite point. `None` if that cannot be told. O(points).
pub(super) fn facing(told: Told, rings: &[Vec<Rim>]) -> Option<Elementary> {
    let Elementary::Sphere { frame, radius } = told.surface else { return Some(told.surface) };
    let ring = layout::without_spurs(rings.first()?);
    let normal = unit(turning(frame.origin, &ring));
    let Some(is_left) = told.is_left else {
        let points: Vec<Point> = ring.iter().map(|rim| rim.point).collect();
        let middle = sub(space::mean(&points), frame.origin);
        let towards = if norm(middle) > 1e-6 * radius { unit(middle) } else { normal };
        return Some(Elementary::Sphere { frame: Frame::around(frame.origin, towards?), radius });
    };
    let [x, y, z] = frame.axes;
    let sign = if is_left { 1.0 } else { -1.0 };
    let axes = [x, y, z].into_iter().flat_map(|axis| [axis, scale(axis, -1.0)]);
    let mut best: Option<(f64, Frame)> = None;
    let beside = holes(frame.origin, radius, &ring, is_left);
    for z in normal.map(|normal| scale(normal, sign)).into_iter().chain(axes).chain(beside) {
        let frame = Frame::around(frame.origin, z);
        let chart = Chart::Sphere(frame, radius);
        let places: Vec<(Corner, [f64; 2])> = ring.iter().map(|rim| (Corner::Rim(rim.vertex), chart.flat(rim.point))).collect();
        let from = add(frame.origin, scale(z, -radius));
        let clear = rings.iter().flatten().map(|rim| distance(rim.point, from) / radius).fold(f64::INFINITY, f64::min);
        if (area(&places) > 0.0) == is_left && best.is_none_or(|(other, _)| clear > other) {
            best = Some((clear, frame));
        }
        if best.is_some_and(|(clear, _)| clear > CLEAR) {
            break;
        }
    }
    best.map(|(_, frame)| Elementary::Sphere { frame, radius })
}

/// Directions whose opposite points are on the other side of a ring: near to it, and so within holes of any size.
fn holes(centre: Point, radius: f64, ring: &[Rim], is_left: bool) -> Vec<Point> {
    let sign = if is_left { 1.0 } else { -1.0 };
    let pairs: Vec<(&Rim, &Rim)> = ring.iter().zip(ring.iter().cycle().skip(1)).collect();
    let mut found = Vec::new();
    for (a, b) in pairs.iter().step_by(pairs.len().div_ceil(SAMPLES).max(1)) {
        let out = sub(scale(add(a.point, b.point), 0.5), centre);
        let Some(right) = unit(cross(sub(b.point, a.point), out)) else { continue };
        let places = STEPS.map(|step| unit(add(out, scale(right, step * sign * radius))));
        found.extend(places.into_iter().flatten().map(|place| scale(place, -1.0)));
    }
    found
}

/// Twice the area vector of a ring.
fn turning(centre: Point, ring: &[Rim]) -> Point {
    let pairs = ring.iter().zip(ring.iter().cycle().skip(1));
    pairs.fold([0.0; 3], |sum, (one, next)| add(sum, cross(sub(one.point, centre), sub(next.point, centre))))
}

/// A turn or nothing, by which a ring on a torus is moved so that the part between it and the one that is cut to it is on the side that is meant. `shift` is
/// what the first ring grows by, the places are the ends of the cut.
pub(super) fn turn_more(turned: &Turned, shift: [f64; 2], [from, to]: [[f64; 2]; 2], is_left: Option<bool>) -> [f64; 2] {
    let (Some(is_left), true) = (is_left, turned.is_tube()) else { return [0.0; 2] };
    let sign = if is_left { 1.0 } else { -1.0 };
    // A quarter of a turn to the left of the direction of the ring.
    let left = [-shift[1] * sign, shift[0] * sign];
    let along = (to[0] - from[0]) * left[0] + (to[1] - from[1]) * left[1];
    if along >= 0.0 { [0.0; 2] } else { left.map(|x| if x.abs() > 1.0 { TAU.copysign(x) } else { 0.0 }) }
}

/// Whether rings that do not run around a torus bound the part around them.
pub(super) fn is_around(rings: &[Lifted], is_left: Option<bool>) -> bool {
    is_left.is_some_and(|is_left| rings.first().is_some_and(|(ring, _)| (area(ring) > 0.0) != is_left))
}

/// All of a torus but the parts within rings: it is cut open along two circles that meet none of them. `None` where there are no such circles.
pub(super) fn around(turned: Turned, mut rings: Vec<Vec<(Corner, [f64; 2])>>) -> Option<Layout> {
    let mut low = [0.0; 2];
    for (axis, low) in low.iter_mut().enumerate() {
        *low = free(&rings, axis)?;
    }
    for ring in &mut rings {
        let least = |axis: usize| ring.iter().map(|(_, place)| place[axis]).fold(f64::INFINITY, f64::min);
        let moved = [0, 1].map(|axis| -TAU * ((least(axis) - low[axis]) / TAU).floor());
        ring.iter_mut().for_each(|(_, place)| *place = [place[0] + moved[0], place[1] + moved[1]]);
    }
    let first = rings.first()?.clone();
    let corners = [low, [low[0] + TAU, low[1]], [low[0] + TAU, low[1] + TAU], [low[0], low[1] + TAU]];
    let counts = [0, 1].map(|axis| steps(&turned, &first, [low, corners[if axis == 0 { 1 } else { 3 }]]).max(8));
    let mut added = vec![turned.at(low)];
    // Points along both circles but their corner, which both have.
    let mut points = |axis: usize| -> Vec<(Corner, f64)> {
        (1..counts[axis])
            .map(|step| {
                let angle = low[axis] + TAU * f64::from(step) / f64::from(counts[axis]);
                added.push(turned.at(if axis == 0 { [angle, low[1]] } else { [low[0], angle] }));
                (Corner::Inner(added.len() as u32 - 1), angle)
            })
            .collect()
    };
    let [wide, high] = [points(0), points(1)];
    let mut ring: Vec<(Corner, [f64; 2])> = vec![(Corner::Inner(0), corners[0])];
    ring.extend(wide.iter().map(|(corner, u)| (*corner, [*u, low[1]])));
    ring.push((Corner::Inner(0), corners[1]));
    ring.extend(high.iter().map(|(corner, v)| (*corner, [low[0] + TAU, *v])));
    ring.push((Corner::Inner(0), corners[2]));
    ring.extend(wide.iter().rev().map(|(corner, u)| (*corner, [*u, low[1] + TAU])));
    ring.push((Corner::Inner(0), corners[3]));
    ring.extend(high.iter().rev().map(|(corner, v)| (*corner, [low[0], *v])));
    let rings = std::iter::once(ring).chain(rings);
    let places = rings.map(|ring| ring.into_iter().map(|(corner, place)| (corner, turned.flat(place))).collect()).collect();
    Some(layout::oriented(Chart::Turned(turned), places, added))
}

/// The middle of the widest range of an angle that no ring has. O(rings²).
fn free(rings: &[Vec<(Corner, [f64; 2])>], axis: usize) -> Option<f64> {
    let mut ranges: Vec<[f64; 2]> = Vec::with_capacity(rings.len());
    for ring in rings {
        let all = ring.iter().map(|(_, place)| place[axis]);
        let [low, high] = all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]);
        let start = low.rem_euclid(TAU);
        ranges.push([start, start + (high - low)]);
    }
    ranges.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut best: Option<(f64, f64)> = None;
    let mut reached = ranges.iter().map(|[_, high]| high - TAU).fold(f64::NEG_INFINITY, f64::max);
    for [low, high] in ranges {
        if low - reached > best.map_or(1e-3, |(width, _)| width) {
            best = Some((low - reached, 0.5 * (low + reached)));
        }
        reached = reached.max(high);
    }
    best.map(|(_, middle)| middle)
}
