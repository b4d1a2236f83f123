//! Coordinates of loops on cylinders, cones and tori, with angles that count turns.

use std::f64::consts::TAU;

use crate::curves::export::EdgeUse;
use crate::curves::vector::Point;

use super::super::chart::Turned;
use super::edges::Edges;

/// Samples of a piece of an edge, between which no angle may grow by half a turn.
const SAMPLES: usize = 16;

/// An edge in a loop with its coordinates at samples in the direction of the loop; angles count turns.
pub(super) struct Lifted {
    pub(super) one: EdgeUse,
    pub(super) samples: Vec<(f64, [f64; 2])>,
}

pub(super) fn near(angle: f64, to: f64) -> f64 {
    angle + TAU * ((to - angle) / TAU).round()
}

/// The coordinates of a point nearest to others, and whether its angle says something.
pub(super) fn coordinates(turned: &Turned, point: Point, to: [f64; 2], tolerance: f64) -> ([f64; 2], bool) {
    let [angle, other] = turned.coordinates(point);
    let other = if turned.is_tube() { near(other, to[1]) } else { other };
    if turned.is_apex(point, tolerance) { ([to[0], other], false) } else { ([near(angle, to[0]), other], true) }
}

/// A loop with coordinates, the first ones as near to the given ones as turns allow. It begins behind the apex, if it passes
/// that, where the angle may jump.
pub(super) fn lift(edges: &Edges, turned: &Turned, mut ring: Vec<EdgeUse>, middle: Option<[f64; 2]>) -> Option<Vec<Lifted>> {
    let is_apex = |one: &EdgeUse| {
        let vertex = edges.ends(one).and_then(|[start, _]| edges.vertices.get(start).copied());
        vertex.is_some_and(|vertex| turned.is_apex(vertex, edges.tolerance))
    };
    let first = ring.iter().position(is_apex).unwrap_or(0);
    ring.rotate_left(first);
    let mut last = middle;
    let mut lifted = Vec::with_capacity(ring.len());
    for one in ring {
        let curve = edges.curve(&one)?;
        let mut ts: Vec<f64> = Vec::new();
        for pair in curve.cuts().windows(2) {
            let &[a, b] = pair else { continue };
            ts.extend((0..SAMPLES).map(|number| a + (b - a) * number as f64 / SAMPLES as f64));
        }
        ts.extend(curve.cuts().last());
        if one.is_reversed {
            ts.reverse();
        }
        let at = |t: f64| curve.point_and_derivative(t).0;
        // At the apex, the angle is that of the next sample.
        let start = ts.iter().map(|t| at(*t)).find(|point| !turned.is_apex(*point, edges.tolerance))?;
        let mut now = last.unwrap_or_else(|| turned.coordinates(start));
        now = coordinates(turned, start, now, edges.tolerance).0;
        let mut samples = Vec::with_capacity(ts.len());
        for t in ts {
            now = coordinates(turned, at(t), now, edges.tolerance).0;
            samples.push((t, now));
        }
        last = Some(now);
        lifted.push(Lifted { one, samples });
    }
    Some(lifted)
}

/// What coordinates have grown by around a loop.
pub(super) fn growth(ring: &[Lifted]) -> [f64; 2] {
    let ends = ring.first().and_then(|one| one.samples.first()).zip(ring.last().and_then(|one| one.samples.last()));
    ends.map_or([0.0; 2], |((_, [a, b]), (_, [c, d]))| [c - a, d - b])
}
