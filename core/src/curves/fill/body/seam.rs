//! Two loops around a surface joined into one, by a seam that runs along it.

use std::f64::consts::TAU;

use crate::curves::curve::{Spline, fit};
use crate::curves::export::EdgeUse;

use super::super::chart::{Chart, Turned};
use super::super::options::Outline;
use super::super::side;
use super::super::triangles::shoelace;
use super::edges::{Edges, turn};
use super::lift::{Lifted, coordinates, growth, lift, near};
use crate::curves::elementary::Elementary;

/// Angles that are nearer than this are the same.
const SAME: f64 = 1e-9;
/// Halvings of a piece of an edge.
const HALVINGS: u32 = 60;

/// The number of the loop that runs around as the first one does, and which coordinate grows there.
fn around(lifted: &[Vec<Lifted>]) -> Option<(usize, usize)> {
    let turns: Vec<[bool; 2]> = lifted.iter().map(|ring| growth(ring).map(|growth| growth.abs() > 1.0)).collect();
    let mut all = (0..turns.len()).filter(|at| turns.get(*at).is_some_and(|turns| turns.contains(&true)));
    match (all.next(), all.next(), all.next()) {
        (Some(0), Some(other), None) => Some((other, usize::from(turns.first()?[1]))),
        _ => None,
    }
}

/// The area within a loop in coordinates, by samples.
fn area(ring: &[Lifted]) -> f64 {
    shoelace(&ring.iter().flat_map(|one| one.samples.iter().map(|(_, place)| *place)).collect::<Vec<_>>())
}

/// Cuts the second loop around a surface where a seam from the beginning of the first one comes to it.
pub(super) fn prepare(edges: &mut Edges, carrier: &Elementary, outline: &Outline) -> Option<()> {
    let Chart::Turned(turned) = Chart::of(carrier) else { return None };
    let rings = edges.rings(outline, false)?;
    let lifted: Vec<Vec<Lifted>> = rings.into_iter().map(|ring| lift(edges, &turned, ring, None)).collect::<Option<_>>()?;
    let (other, axis) = around(&lifted)?;
    let angle = lifted.first()?.first()?.samples.first()?.1[axis];
    for one in lifted.get(other)? {
        for pair in one.samples.windows(2) {
            let &[(s, from), (t, to)] = pair else { continue };
            let wanted = near(angle, 0.5 * (from[axis] + to[axis]));
            let [before, behind] = [from[axis] - wanted, to[axis] - wanted];
            if before.abs() <= SAME || behind.abs() <= SAME {
                // A vertex, or so near to one of the samples that this is as good.
                let (at, [low, high]) = (if before.abs() <= SAME { s } else { t }, edges.curve(&one.one)?.domain());
                return if at > low && at < high { edges.split(one.one.edge, at) } else { Some(()) };
            }
            if (before < 0.0) != (behind < 0.0) {
                let curve = edges.curve(&one.one)?;
                let (mut low, mut high) = (s, t);
                for _ in 0..HALVINGS {
                    let middle = 0.5 * (low + high);
                    let now = coordinates(&turned, curve.point_and_derivative(middle).0, from, edges.tolerance).0[axis] - wanted;
                    *(if (now < 0.0) == (before < 0.0) { &mut low } else { &mut high }) = middle;
                }
                return edges.split(one.one.edge, low);
            }
        }
    }
    None
}

/// Loops, of which two that run around are one. `None` where the surface is all of a torus but what is within loops: it has seams both ways.
pub(super) fn joined(
    edges: &mut Edges,
    turned: &Turned,
    (mut rings, is_left): (Vec<Vec<EdgeUse>>, Option<bool>),
) -> Option<Vec<Vec<EdgeUse>>> {
    let lifted: Vec<Vec<Lifted>> = rings.iter().map(|ring| lift(edges, turned, ring.clone(), None)).collect::<Option<_>>()?;
    let Some((other, axis)) = around(&lifted) else {
        let is_around =
            turned.is_tube() && is_left.is_some_and(|is_left| lifted.first().is_some_and(|ring| (area(ring) > 0.0) != is_left));
        return (!is_around).then_some(rings);
    };
    let growth_of_first = growth(lifted.first()?);
    let [first, second] = [0, other].map(|at| lifted.get(at).map(|ring| growth(ring)[axis]).unwrap_or_default());
    let start = lifted.first()?.first()?.samples.first()?.1;
    let mut inner = rings.remove(other);
    let gap = |angle: f64| ((angle - start[axis]) - TAU * ((angle - start[axis]) / TAU).round()).abs();
    let begins = |one: &Lifted| one.samples.first().map_or(f64::INFINITY, |(_, place)| gap(place[axis]));
    let starts: Vec<f64> = lifted.get(other)?.iter().map(begins).collect();
    let at = (0..starts.len()).min_by(|a, b| starts[*a].total_cmp(&starts[*b]))?;
    if starts.get(at).is_none_or(|gap| *gap > 1e-6) {
        return None;
    }
    inner.rotate_left(at);
    if first * second > 0.0 {
        turn(&mut inner);
    }
    let outer = rings.first_mut()?;
    let [from, _] = edges.ends(outer.first()?)?;
    let [to, _] = edges.ends(inner.first()?)?;
    let [a, b] = [from, to].map(|vertex| edges.vertices.get(vertex).copied().unwrap_or_default());
    let near = coordinates(turned, b, start, edges.tolerance).0;
    let more = side::turn_more(turned, growth_of_first, [start, near], is_left);
    let target = [near[0] + more[0], near[1] + more[1]];
    let curve = match turned {
        Turned::Torus(..) => {
            let place = |t: f64| turned.at([0, 1].map(|axis| start[axis] + (target[axis] - start[axis]) * t));
            fit(place, &[0.0, 1.0], 0.1 * edges.tolerance).ok()?.0
        }
        _ => Spline::new(1, vec![0.0, 0.0, 1.0, 1.0], vec![a, b], None, None).ok()?,
    };
    let edge = edges.add(curve, [from, to]);
    outer.push(EdgeUse { edge, is_reversed: false, pcurve: None });
    outer.extend(inner);
    outer.push(EdgeUse { edge, is_reversed: true, pcurve: None });
    Some(rings)
}
