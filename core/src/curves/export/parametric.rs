//! Curves of parameters that a body does not have, where they are exact: on planes, and along the sides of a surface.

use std::borrow::Cow;

use super::canonical::canonical;
use super::model::{Body, EdgeUse, Face, Rings, Surface};
use super::natural::{side_ends, sides};
use crate::curves::curve::Spline;
use crate::curves::vector::{Affine, Point, add, cross, distance, sub};

/// Loops of all faces, with the curves of parameters that are found. O(edges used + control points).
pub(super) fn rings(body: &Body) -> Vec<Rings<'_>> {
    body.faces.iter().map(|face| rings_of(body, face)).collect()
}

fn rings_of<'a>(body: &'a Body, face: &'a Face) -> Rings<'a> {
    let all = || std::iter::once(&face.outer).chain(&face.inner);
    if all().flatten().all(|one| one.pcurve.is_some()) {
        return all().map(|ring| Cow::Borrowed(ring.as_slice())).collect();
    }
    let plane = plane(&face.surface, body.tolerance);
    let sides = if plane.is_some() { None } else { sides(&face.surface).ok() };
    let find = |one: &EdgeUse| {
        let curve = canonical(&body.edges.get(one.edge)?.curve);
        match &plane {
            Some(plane) => on_plane(plane, &curve, body.tolerance),
            None => on_side(face, sides.as_ref()?, one, &curve, body.tolerance),
        }
    };
    let complete = |ring: &Vec<EdgeUse>| {
        let uses = ring.iter().map(|one| EdgeUse { pcurve: one.pcurve.clone().or_else(|| find(one)), ..one.clone() });
        Cow::Owned(uses.collect())
    };
    all().map(complete).collect()
}

/// A plane by its parameters, and the map from space back to them.
struct Plane {
    axes: Affine,
    inverse: Affine,
}

/// The plane of a parallelogram of degree 1 × 1.
fn plane(surface: &Surface, tolerance: f64) -> Option<Plane> {
    let [[u0, u1], [v0, v1]] = surface.domain();
    let [first, second] = surface.points.as_slice() else { return None };
    let (&[a, b], &[c, d]) = (first.as_slice(), second.as_slice()) else { return None };
    let is_flat = distance(add(b, c), add(a, d)) <= 1e-6 * tolerance;
    if surface.degrees != [1, 1] || !is_flat || surface.rational().is_some() {
        return None;
    }
    let step = |from: Point, to: Point, length: f64| sub(to, from).map(|x| x / length);
    let (u, v) = (step(a, c, u1 - u0), step(a, b, v1 - v0));
    let linear = Affine::from_axes([u, v, cross(u, v)], [0.0; 3]);
    let axes = Affine { shift: sub(a, linear.vector([u0, v0, 0.0])), ..linear };
    Some(Plane { axes, inverse: axes.inverse()? })
}

/// Any curve in a plane has an exact one there, with the same knots and weights.
fn on_plane(plane: &Plane, curve: &Spline, tolerance: f64) -> Option<Spline> {
    let points: Vec<Point> =
        curve.points().iter().map(|point| plane.inverse.point(*point)).map(|[u, v, _]| [u, v, 0.0]).collect();
    let is_near = points.iter().zip(curve.points()).all(|(flat, point)| distance(plane.axes.point(*flat), *point) <= tolerance);
    let weights = curve.weights().map(<[f64]>::to_vec);
    if is_near { Spline::new(curve.degree(), curve.knots().to_vec(), points, weights, None).ok() } else { None }
}

/// The straight curve of parameters of an edge that is a side. Where two sides are the same curve, a seam, the direction of the
/// loop tells which of them is meant: the surface is to its left.
fn on_side(face: &Face, sides: &[Spline; 4], one: &EdgeUse, curve: &Spline, tolerance: f64) -> Option<Spline> {
    for (at, (side, ends)) in sides.iter().zip(side_ends(&face.surface)).enumerate() {
        for is_turned in [false, true] {
            let runs_along = is_turned == one.is_reversed;
            if runs_along == ((at < 2) == face.is_same_sense) && is_same(side, curve, is_turned, tolerance) {
                let [from, to] = if is_turned { [ends[1], ends[0]] } else { ends };
                let [low, high] = curve.domain();
                let points = [from, to].map(|[u, v]| [u, v, 0.0]).to_vec();
                return Spline::new(1, vec![low, low, high, high], points, None, None).ok();
            }
        }
    }
    None
}

/// Whether a curve is a side with the same parameter but for a factor and a shift, in its direction or against it.
fn is_same(side: &Spline, curve: &Spline, is_turned: bool, tolerance: f64) -> bool {
    let turned = if is_turned { side.clone().reversed() } else { side.clone() };
    let ([a, b], [c, d]) = (turned.domain(), curve.domain());
    let share = |knot: f64, low: f64, high: f64| (knot - low) / (high - low);
    let is_paced = turned.knots().iter().zip(curve.knots()).all(|(k, l)| (share(*k, a, b) - share(*l, c, d)).abs() <= 1e-9);
    let is_near = turned.points().iter().zip(curve.points()).all(|(p, q)| distance(*p, *q) <= tolerance);
    let weight = |spline: &Spline, at: usize| spline.weights().and_then(|weights| weights.get(at)).copied().unwrap_or(1.0);
    let factor = weight(&turned, 0) / weight(curve, 0);
    let is_weighted =
        (0..curve.points().len()).all(|at| (weight(&turned, at) / weight(curve, at) - factor).abs() <= 1e-9 * factor);
    turned.degree() == curve.degree() && turned.points().len() == curve.points().len() && is_paced && is_near && is_weighted
}
