//! Planes, spheres, cylinders, cones and tori trimmed by their outlines.

use super::edges::{Edges, turn};
use super::{flat, turned};
use crate::curves::export::{EdgeUse, Face, Surface};

use super::super::chart::Chart;
use crate::curves::elementary::Elementary;

/// A face on the side of its first loop that is told, if any is, whose loops have curves of parameters.
pub(super) fn face(edges: &mut Edges, carrier: &Elementary, (rings, is_left): (Vec<Vec<EdgeUse>>, Option<bool>)) -> Option<Face> {
    match Chart::of(carrier) {
        Chart::Plane(frame) => {
            let (surface, rings) = flat::plane(edges, &frame, rings)?;
            Some(oriented(surface, rings))
        }
        Chart::Sphere(frame, radius) => {
            let (surface, rings) = flat::sphere(edges, &frame, radius, rings)?;
            Some(oriented(surface, rings))
        }
        Chart::Turned(turned) => {
            let (surface, rings) = turned::trimmed(edges, &turned, (rings, is_left))?;
            Some(oriented(surface, rings))
        }
        _ => None,
    }
}

/// The first loop has the direction that is wanted: the surface is to its left as seen from outside, and other loops run the
/// other way.
fn oriented(surface: Surface, mut rings: Vec<Vec<EdgeUse>>) -> Face {
    let alone: Vec<[f64; 2]> = rings.iter().map(|ring| area(ring)).collect();
    let [first, wound] = alone.first().copied().unwrap_or_default();
    let is_wound = wound.abs() > 1e-6;
    for (ring, [own, around]) in rings.iter_mut().zip(&alone).skip(1) {
        let is_same = if around.abs() > 1e-6 { around * wound > 0.0 } else { own * first > 0.0 && !is_wound };
        if is_same {
            turn(ring);
        }
    }
    // Of loops around, no area says anything alone, but their sum.
    let whole: f64 = rings.iter().map(|ring| area(ring)[0]).sum();
    let mut rings = rings.into_iter();
    Face { surface, outer: rings.next().unwrap_or_default(), inner: rings.collect(), is_same_sense: whole > 0.0 }
}

/// The integral `−∮ v du` over a loop, and `∮ du`, which is not 0 of a loop around.
fn area(ring: &[EdgeUse]) -> [f64; 2] {
    let (mut sum, mut along) = (0.0, 0.0);
    for one in ring {
        let Some(pcurve) = &one.pcurve else { continue };
        let [low, high] = pcurve.domain();
        let count = if pcurve.degree() == 1 { pcurve.points().len() - 1 } else { 4 * pcurve.points().len() };
        let sign = if one.is_reversed { -1.0 } else { 1.0 };
        let at = |number: usize| pcurve.point_and_derivative(low + (high - low) * number as f64 / count.max(1) as f64).0;
        let mut before = at(0);
        for number in 1..=count {
            let [u, v, _] = at(number);
            sum -= sign * 0.5 * (v + before[1]) * (u - before[0]);
            along += sign * (u - before[0]);
            before = [u, v, 0.0];
        }
    }
    [sum, along]
}
