//! Triangles that are not even because their outline is divided too coarsely for them, and where to divide it.
//!
//! Based on: J. Ruppert, *A Delaunay refinement algorithm for quality 2-dimensional mesh generation*, Journal of Algorithms 18 (1995): an edge of the
//! outline that is in the way of a triangle's new corner is halved, and edges of a sharp corner stay alike, else each would make the other one shorter
//! without end. Here outlines share their edges: all that are in the way are halved at once, for all outlines of a curve.

use super::layout::{Corner, Rim};
use super::mesh::of_triangle;
use super::options::Outline;
use crate::curves::vector::{Point, distance, dot, sub};

/// Twice the ratio of radii below which a triangle is poor.
pub(super) const LEAST: f64 = 0.4;
/// Cosines of 15° and of 50°: corners of an outline that are sharper than the first spoil their triangles by themselves, and corners sharper
/// than the second have edges that are alike.
const SHARP: [f64; 2] = [0.965_925_826, 0.642_787_61];

/// A place where a curve is to be divided: its number, and the share of its length.
pub(super) type Split = (usize, f64);

/// Cosines of the angles between the edges that meet at each point of rings, −1 where they go straight on. O(points).
pub(super) fn cosines(rings: &[Vec<Rim>]) -> Vec<(u32, f64)> {
    let mut all: Vec<(u32, f64)> = Vec::new();
    for ring in rings {
        all.extend((0..ring.len()).map(|at| (at_ring(ring, at).vertex, cosine(ring, at))));
    }
    all.sort_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));
    all
}

fn at_ring(ring: &[Rim], at: usize) -> Rim {
    ring.get(at % ring.len().max(1)).copied().unwrap_or(Rim { vertex: u32::MAX, point: [0.0; 3], part: 0, share: 0.0 })
}

fn cosine(ring: &[Rim], at: usize) -> f64 {
    let [before, own, next] = [at + ring.len() - 1, at, at + 1].map(|at| at_ring(ring, at).point);
    let product = distance(before, own) * distance(own, next);
    if product > 0.0 { dot(sub(before, own), sub(next, own)) / product } else { -1.0 }
}

/// How many triangles are poor: at corners below 15°, and elsewhere. O(triangles · log points).
pub(super) fn count(
    triangles: &[[u32; 3]],
    corners: &[Corner],
    point: impl Fn(u32) -> Point,
    cosines: &[(u32, f64)],
) -> [usize; 2] {
    let mut counts = [0; 2];
    for triangle in triangles {
        let [a, b, c] = triangle.map(&point);
        if of_triangle(a, b, c) < LEAST {
            let is_sharp = |corner: &u32| match corners.get(*corner as usize) {
                Some(Corner::Rim(vertex)) => {
                    let from = cosines.partition_point(|(number, _)| number < vertex);
                    cosines.get(from).is_some_and(|(number, cosine)| number == vertex && *cosine > SHARP[0])
                }
                _ => false,
            };
            let kind = if triangle.iter().any(is_sharp) { 0 } else { 1 };
            counts[kind] += 1;
        }
    }
    counts
}

/// Where to divide curves so that edges of an outline, given by their ends, are halved; those at corners below 15° are left, and those at other sharp
/// corners are divided with the edge beside them, at the same distance from the corner. O((points + edges) · log points).
pub(super) fn splits(outline: &Outline, rings: &[Vec<Rim>], edges: &[[u32; 2]]) -> Vec<Split> {
    let mut known: Vec<([u32; 2], usize, usize)> = Vec::new();
    for (number, ring) in rings.iter().enumerate() {
        let ends = |at: usize| {
            let (a, b) = (at_ring(ring, at).vertex, at_ring(ring, at + 1).vertex);
            [a.min(b), a.max(b)]
        };
        known.extend((0..ring.len()).map(|at| (ends(at), number, at)));
    }
    known.sort_unstable();
    let mut splits = Vec::new();
    for [a, b] in edges {
        let ends = [*a.min(b), *a.max(b)];
        let from = known.partition_point(|(other, ..)| *other < ends);
        let found = known.get(from).filter(|(other, ..)| *other == ends);
        let Some((ring, at)) = found.and_then(|(_, number, at)| Some((rings.get(*number)?, *at))) else { continue };
        let uses = std::iter::once(&outline.outer).chain(&outline.inner).nth(known.get(from).map_or(0, |(_, number, _)| *number));
        let Some(uses) = uses else { continue };
        let mut add = |at: usize, share: f64| {
            let (one, next) = (at_ring(ring, at), at_ring(ring, at + 1));
            let to = if next.part == one.part && next.share > one.share { next.share } else { 1.0 };
            let place = one.share + share * (to - one.share);
            splits.extend(uses.get(one.part as usize).map(|own| (own.curve, if own.is_reversed { 1.0 - place } else { place })));
        };
        let length = |at: usize| distance(at_ring(ring, at).point, at_ring(ring, at + 1).point);
        let (low, high) = (cosine(ring, at), cosine(ring, at + 1));
        if low.max(high) > SHARP[0] {
            continue;
        }
        let before = at + ring.len() - 1;
        if low.max(high) <= SHARP[1] {
            add(at, 0.5);
        } else if low >= high {
            let far = 0.5 * length(at).min(length(before));
            add(at, far / length(at));
            add(before, 1.0 - far / length(before));
        } else {
            let far = 0.5 * length(at).min(length(at + 1));
            add(at, 1.0 - far / length(at));
            add(at + 1, far / length(at + 1));
        }
    }
    splits
}
