//! Surfaces whose own sides are their outlines.

use std::collections::BTreeMap;

use crate::curves::curve::Spline;
use crate::curves::export::{EdgeUse, Face, Surface};
use crate::curves::vector::Point;

use super::super::coons::Coons;
use super::super::options::Outline;
use super::super::spline::SplineSurface;
use super::edges::{Edges, straight, turn};

/// A Coons surface; sides that are points have no edges.
pub(super) fn of_coons(edges: &Edges, coons: &Coons, outline: &Outline, is_flipped: bool) -> Option<Face> {
    let ends = |at: usize| {
        let (side, low, high) = coons.spans.get(at).copied()?;
        Some([low, high].map(|t| coons.parameters(side, t)))
    };
    let outer = around(edges, outline, is_flipped, ends)?;
    Some(Face { surface: plain(&coons.to_spline().ok()?), outer, inner: Vec::new(), is_same_sense: !is_flipped })
}

/// A cone over a closed curve, with a seam from the beginning of that to the centre.
pub(super) fn of_centre(
    edges: &mut Edges,
    curve: &Spline,
    ends: &[f64],
    centre: Point,
    outline: &Outline,
    is_flipped: bool,
) -> Option<Face> {
    let rows = curve.points().iter().map(|point| vec![centre, *point]).collect();
    let surface = SplineSurface::new([3, 1], [curve.knots().to_vec(), vec![0.0, 0.0, 1.0, 1.0]], rows, None).ok()?;
    let along = |at: usize| Some([[*ends.get(at)?, 1.0], [*ends.get(at + 1)?, 1.0]]);
    let mut outer = around(edges, outline, is_flipped, along)?;
    let [vertex, _] = edges.ends(outer.first()?)?;
    let start = edges.vertices.get(vertex).copied()?;
    let tip = edges.add_vertex(centre);
    let spoke = Spline::new(1, vec![0.0, 0.0, 1.0, 1.0], vec![centre, start], None, None).ok()?;
    // The outline ends where it began, at u = 1, or at u = 0 if it is turned.
    let [out, back] = if is_flipped { [0.0, 1.0] } else { [1.0, 0.0] };
    let pcurve = |u: f64| straight(&spoke, [[u, 0.0], [u, 1.0]]);
    let curves = [pcurve(out), pcurve(back)];
    let edge = edges.add(spoke, [tip, vertex]);
    for (pcurve, is_reversed) in curves.into_iter().zip([true, false]) {
        outer.push(EdgeUse { edge, is_reversed, pcurve });
    }
    Some(Face { surface: plain(&surface), outer, inner: Vec::new(), is_same_sense: is_flipped })
}

/// Cones over the edges of an outline, which share the spokes between them.
pub(super) fn of_fans(edges: &mut Edges, centre: Point, outline: &Outline, is_flipped: bool) -> Option<Vec<Face>> {
    let all: Vec<EdgeUse> = outline.outer.iter().map(|one| edges.uses(one)).collect::<Option<Vec<_>>>()?.concat();
    let tip = edges.add_vertex(centre);
    let mut spokes: BTreeMap<usize, (usize, Spline)> = BTreeMap::new();
    let mut faces = Vec::with_capacity(all.len());
    for part in all {
        let curve = edges.curve(&part)?.clone().clamped().ok()?;
        let [from, to] = edges.ends(&part)?;
        let rows = curve.points().iter().map(|point| vec![centre, *point]).collect();
        let weights = curve.weights().map(|weights| weights.iter().map(|weight| vec![*weight; 2]).collect());
        let knots = [curve.knots().to_vec(), vec![0.0, 0.0, 1.0, 1.0]];
        let surface = SplineSurface::new([curve.degree(), 1], knots, rows, weights).ok()?;
        let [low, high] = curve.domain();
        let [start, end] = if part.is_reversed { [high, low] } else { [low, high] };
        let mut outer = vec![EdgeUse { pcurve: straight(&curve, [[low, 1.0], [high, 1.0]]), ..part.clone() }];
        for (vertex, u, is_reversed) in [(to, end, true), (from, start, false)] {
            let (edge, spoke) = match spokes.get(&vertex) {
                Some(known) => known.clone(),
                None => {
                    let point = edges.vertices.get(vertex).copied()?;
                    let spoke = Spline::new(1, vec![0.0, 0.0, 1.0, 1.0], vec![centre, point], None, None).ok()?;
                    let known = (edges.add(spoke.clone(), [tip, vertex]), spoke);
                    spokes.insert(vertex, known.clone());
                    known
                }
            };
            outer.push(EdgeUse { edge, is_reversed, pcurve: straight(&spoke, [[u, 0.0], [u, 1.0]]) });
        }
        if is_flipped {
            turn(&mut outer);
        }
        // The surface runs with its edge, which may run against the outline.
        faces.push(Face { surface: plain(&surface), outer, inner: Vec::new(), is_same_sense: is_flipped != part.is_reversed });
    }
    Some(faces)
}

/// The loop with straight curves of parameters between those that each curve of the outline has at its ends, in the outline's
/// direction.
fn around(
    edges: &Edges,
    outline: &Outline,
    is_flipped: bool,
    ends: impl Fn(usize) -> Option<[[f64; 2]; 2]>,
) -> Option<Vec<EdgeUse>> {
    let mut outer = Vec::with_capacity(outline.outer.len());
    for (at, one) in outline.outer.iter().enumerate() {
        let [[a, b], [c, d]] = ends(at)?;
        for mut part in edges.uses(one)? {
            let curve = edges.curve(&part)?;
            // Curves have the domain 0 to 1, and parts of them that of their part.
            let place = |t: f64| {
                let share = if one.is_reversed { 1.0 - t } else { t };
                [a + (c - a) * share, b + (d - b) * share]
            };
            part.pcurve = straight(curve, curve.domain().map(place));
            outer.push(part);
        }
    }
    if is_flipped {
        turn(&mut outer);
    }
    Some(outer)
}

fn plain(surface: &SplineSurface) -> Surface {
    Surface {
        degrees: surface.degrees(),
        knots: surface.knots().clone(),
        points: surface.points().to_vec(),
        weights: surface.weights().map(<[Vec<f64>]>::to_vec),
    }
}
