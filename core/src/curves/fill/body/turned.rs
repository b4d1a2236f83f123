//! Cylinders, cones and tori as far as their outlines reach, with curves of parameters that are fitted.

use std::f64::consts::TAU;

use crate::curves::curve::{Spline, fit};
use crate::curves::export::{EdgeUse, Surface};
use crate::curves::vector::distance;

use super::super::chart::Turned;
use super::edges::{Edges, straight};
use super::lift::{Lifted, coordinates, lift};
use super::seam;
use super::sweep::Sweep;

/// How coordinates become parameters.
#[derive(Clone, Copy)]
enum Along {
    /// From a lowest to a highest one: 0 to 1.
    Straight([f64; 2]),
    Tube(Sweep),
}

impl Along {
    fn parameter(&self, other: f64) -> f64 {
        match self {
            Self::Straight([low, high]) => (other - low) / (high - low),
            Self::Tube(sweep) => sweep.parameter(other),
        }
    }
}

/// The surface between the angles of its outline, and loops with curves of parameters.
pub(super) fn trimmed(
    edges: &mut Edges,
    turned: &Turned,
    rings: (Vec<Vec<EdgeUse>>, Option<bool>),
) -> Option<(Surface, Vec<Vec<EdgeUse>>)> {
    let rings = seam::joined(edges, turned, rings)?;
    let edges = &*edges;
    let mut lifted = Vec::with_capacity(rings.len());
    let mut middle = None;
    for ring in rings {
        let ring = lift(edges, turned, ring, middle)?;
        middle = middle.or_else(|| range(std::slice::from_ref(&ring)).map(|range| range.map(|[low, high]| 0.5 * (low + high))));
        lifted.push(ring);
    }
    let [angles, others] = range(&lifted)?;
    let around = Sweep::new(widened(angles))?;
    let along = if turned.is_tube() { Along::Tube(Sweep::new(widened(others))?) } else { straight_range(turned, others)? };
    let surface = surface(turned, &around, &along);
    let finish = |lifted: Lifted| finish(edges, turned, (&around, &along), &surface, lifted);
    let rings = lifted.into_iter().map(|ring| ring.into_iter().map(finish).collect()).collect::<Option<_>>()?;
    Some((surface, rings))
}

/// Angles with a part more on both sides, but no more than a turn.
fn widened([low, high]: [f64; 2]) -> [f64; 2] {
    let more = 0.01 * (high - low);
    if high - low + 2.0 * more >= TAU {
        [low, if high - low > TAU - 1e-9 { high } else { low + TAU }]
    } else {
        [low - more, high + more]
    }
}

fn straight_range(turned: &Turned, [low, high]: [f64; 2]) -> Option<Along> {
    let more = 0.01 * (high - low);
    let least = if matches!(turned, Turned::Cone(..)) { 0.0 } else { f64::NEG_INFINITY };
    (high > low).then_some(Along::Straight([(low - more).max(least), high + more]))
}

fn range(rings: &[Vec<Lifted>]) -> Option<[[f64; 2]; 2]> {
    let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for (_, place) in rings.iter().flatten().flat_map(|lifted| &lifted.samples) {
        for ([low, high], x) in range.iter_mut().zip(place) {
            (*low, *high) = (low.min(*x), high.max(*x));
        }
    }
    range.iter().all(|[low, high]| low <= high && (high - low).is_finite()).then_some(range)
}

fn surface(turned: &Turned, around: &Sweep, along: &Along) -> Surface {
    // Distance from the axis, height, weight.
    let profile: Vec<[f64; 3]> = match (turned, along) {
        (Turned::Cylinder(_, radius), Along::Straight(ends)) => ends.map(|z| [*radius, z, 1.0]).to_vec(),
        (Turned::Cone(_, half), Along::Straight(ends)) => ends.map(|far| [far * half.sin(), far * half.cos(), 1.0]).to_vec(),
        (Turned::Torus(_, major, minor), Along::Tube(sweep)) => {
            let point = |[angle, far, weight]: [f64; 3]| [major + minor * far * angle.cos(), minor * far * angle.sin(), weight];
            sweep.points().into_iter().map(point).collect()
        }
        _ => Vec::new(),
    };
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for [angle, far, weight] in around.points() {
        let (sin, cos) = angle.sin_cos();
        let place = |[wide, high, _]: &[f64; 3]| turned.frame().outside([wide * far * cos, wide * far * sin, *high]);
        points.push(profile.iter().map(place).collect());
        weights.push(profile.iter().map(|[.., own]| weight * own).collect());
    }
    let (degree, knots) = match along {
        Along::Straight(_) => (1, vec![0.0, 0.0, 1.0, 1.0]),
        Along::Tube(sweep) => (2, sweep.knots()),
    };
    Surface { degrees: [2, degree], knots: [around.knots(), knots], points, weights: Some(weights) }
}

/// The edge with its curve of parameters: straight where that is near enough, else fitted.
fn finish(
    edges: &Edges,
    turned: &Turned,
    (around, along): (&Sweep, &Along),
    surface: &Surface,
    lifted: Lifted,
) -> Option<EdgeUse> {
    let Lifted { one, mut samples } = lifted;
    let curve = edges.curve(&one)?;
    if one.is_reversed {
        samples.reverse();
    }
    let parameters = |[angle, other]: [f64; 2]| [around.parameter(angle), along.parameter(other)];
    let at = |t: f64| {
        let place = samples.partition_point(|(other, _)| *other < t).min(samples.len().saturating_sub(1));
        let hint = samples.get(place).map(|(_, place)| *place).unwrap_or_default();
        let [u, v] = parameters(coordinates(turned, curve.point_and_derivative(t).0, hint, edges.tolerance).0);
        [u, v, 0.0]
    };
    let ends = [samples.first()?.1, samples.last()?.1].map(parameters);
    let line = straight(curve, ends)?;
    // Pieces of arcs are no longer than a quarter of a turn, and a step of one in parameters no more than a few of those lengths.
    let corner = surface.points.first().and_then(|row| row.first()).copied().unwrap_or_default();
    let speed = 4.0 * surface.points.iter().flatten().fold(0.0_f64, |most, point| most.max(distance(*point, corner)));
    let wanted = (0.1 * edges.tolerance / speed).max(1e-13);
    let is_straight = samples.iter().all(|(t, _)| {
        let ([u, v, _], [x, y, _]) = (at(*t), line.point_and_derivative(*t).0);
        (u - x).hypot(v - y) <= wanted
    });
    let pcurve: Spline = if is_straight { line } else { fit(at, &curve.cuts(), wanted.max(1e-11)).ok()?.0 };
    Some(EdgeUse { pcurve: Some(pcurve), ..one })
}
