//! Triangles that are not even because their outline is divided too coarsely for them, and where to divide it.
//!
//! Based on: J. Ruppert, *A Delaunay refinement algorithm for quality 2-dimensional mesh generation*, Journal of Algorithms 18 (1995): an
//! edge of the outline that is in the way of a triangle's new corner is halved, and edges of a sharp corner stay alike, else each would
//! make the other one shorter without end. Outlines share their edges here: all that are in the way are halved at once, for all
//! outlines of a curve.

use super::layout::{Corner, Rim, Wish};
use super::lifted::Lifted;
use super::mesh::of_triangle;
use super::options::Outline;
use crate::curves::vector::{dot, plain_distance, sub};
use crate::util::each::Each;

/// Twice the ratio of radii below which a triangle is poor.
const LEAST: f64 = 0.4;
/// Cosines of 15° and of 50°: corners of an outline that are sharper than the first spoil their triangles by themselves, and corners sharper
/// than the second have edges that are alike.
const SHARP: [f64; 2] = [0.965_925_826, 0.642_787_61];

/// First edges of a sharp corner may differ by this factor.
const ALIKE: f64 = 1.2;

/// A place where a curve is to be divided: its number, and the share of its length.
pub(super) type Split = (usize, f64);

/// Angles at the points of rings.
#[derive(Debug)]
pub(super) struct Angles<'a> {
    rings: &'a [Vec<(Corner, [f64; 2])>],
    /// By the numbers of places: cosines of angles within, −1 where the ring goes straight on, or within is more than half a turn.
    cosines: Vec<f64>,
}

impl<'a> Angles<'a> {
    /// Of rings whose places are the first ones of triangles. O(places).
    pub(super) fn new(rings: &'a [Vec<(Corner, [f64; 2])>], lifted: &Lifted<'_>) -> Self {
        let mut cosines = Vec::new();
        let mut first = 0;
        for ring in rings {
            let count = ring.len();
            for at in 0..count {
                let numbers = [at + count - 1, at, at + 1].each(|at| (first + at % count) as u32);
                let [before, own, next] = numbers.each(|number| lifted.point(number));
                let product = plain_distance(before, own) * plain_distance(own, next);
                // At the end of a cut or a seam, the surface is whole.
                let corner = |at: usize| ring.get(at % count).map(|(corner, _)| *corner);
                let is_end = corner(at + count - 1) == corner(at + 1);
                let is_wide = is_end || lifted.area(numbers) <= 0.0 || product <= 0.0;
                cosines.push(if is_wide { -1.0 } else { dot(sub(before, own), sub(next, own)) / product });
            }
            first += count;
        }
        Self { rings, cosines }
    }

    fn cosine(&self, number: u32) -> f64 {
        self.cosines.get(number as usize).copied().unwrap_or(-1.0)
    }

    /// How many triangles are poor: at corners below 15°, and elsewhere. O(triangles).
    pub(super) fn count(&self, lifted: &Lifted<'_>) -> [usize; 2] {
        let mut counts = [0; 2];
        for triangle in &lifted.flat.triangles {
            let [a, b, c] = triangle.each(|number| lifted.point(number));
            if of_triangle(a, b, c) < LEAST {
                let is_sharp = triangle.iter().any(|number| self.cosine(*number) > SHARP[0]);
                counts[usize::from(!is_sharp)] += 1;
            }
        }
        counts
    }

    /// Where to divide edges, given by their places in the direction of their ring: in the middle; those of a corner below 50° both, at the same
    /// distance from it, and those of one below 15° where that makes them alike. O(edges · rings).
    pub(super) fn wishes(&self, edges: &[[u32; 2]], lifted: &Lifted<'_>) -> Vec<Wish> {
        let mut wishes = Vec::new();
        for [from, to] in edges {
            let (low, high) = (self.cosine(*from), self.cosine(*to));
            let mut first = 0;
            let Some(ring) = self.rings.iter().find(|ring| {
                let is_own = (*from as usize) < first + ring.len();
                first += if is_own { 0 } else { ring.len() };
                is_own
            }) else {
                continue;
            };
            let (count, at) = (ring.len(), *from as usize - first);
            let corner = |at: usize| ring.get(at % count).map(|(corner, _)| *corner);
            let length = |at: usize| {
                let [a, b] = [at, at + 1].each(|at| lifted.point((first + at % count) as u32));
                plain_distance(a, b)
            };
            let mut add = |at: usize, share: f64| {
                if let (Some(a), Some(b)) = (corner(at), corner(at + 1)) {
                    wishes.push(([a, b], share));
                }
            };
            if low.max(high) <= SHARP[1] {
                add(at, 0.5);
                continue;
            }
            // The edges before and behind the corner, and how far from it they are to be divided.
            let (before, behind) = if low >= high { (at + count - 1, at) } else { (at, at + 1) };
            let shorter = length(before).min(length(behind));
            let far = if low.max(high) > SHARP[0] { shorter } else { 0.5 * shorter };
            if far < length(before) / ALIKE {
                add(before, 1.0 - far / length(before));
            }
            if far < length(behind) / ALIKE {
                add(behind, far / length(behind));
            }
        }
        wishes
    }
}

/// Where to divide curves, for wishes between points of rings that are not cut. O((points + wishes) · log points).
pub(super) fn splits(outline: &Outline, rings: &[Vec<Rim>], wishes: &[Wish]) -> Vec<Split> {
    let loops = outline.rings();
    let mut known: Vec<([u32; 2], f64, Rim, usize)> = Vec::new();
    for (ring, uses) in rings.iter().zip(loops) {
        for (one, next) in ring.iter().zip(ring.iter().cycle().skip(1)) {
            let to = if next.part == one.part && next.share > one.share { next.share } else { 1.0 };
            if let Some(own) = uses.get(one.part as usize) {
                // Shares in the direction of the curve.
                let turned = |share: f64| if own.is_reversed { 1.0 - share } else { share };
                let rim = Rim { share: turned(one.share), ..*one };
                known.push(([one.vertex, next.vertex], turned(to), rim, own.curve));
            }
        }
    }
    known.sort_by_key(|(ends, ..)| *ends);
    let find =
        |ends: [u32; 2]| known.get(known.partition_point(|(other, ..)| *other < ends)).filter(|(other, ..)| *other == ends);
    let split = |(ends, share): &Wish| {
        let [Corner::Rim(a), Corner::Rim(b)] = *ends else { return None };
        let found = find([a, b]).map(|found| (found, *share)).or_else(|| find([b, a]).map(|found| (found, 1.0 - share)));
        found.map(|((_, to, rim, curve), share)| (*curve, rim.share + share * (to - rim.share)))
    };
    wishes.iter().filter_map(split).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::curves::Use;
    use crate::curves::curve::Shape;
    use crate::curves::fill::{Options, fill, quality};

    /// A needle with a corner of 5.7°, whose long side is one of a larger triangle, too. Sides of the needle come near to each other, so they are
    /// divided until all triangles but that of its corner are even, and the larger triangle has all points of the common side.
    #[test]
    fn sides_of_a_needle_are_divided_for_both_outlines() {
        let [o, a, b, c] = [[0.0; 3], [10.0, 0.0, 0.0], [10.0, 1.0, 0.0], [0.0, 9.0, 0.0]];
        let shapes = [[o, a], [a, b], [b, o], [b, c], [c, o]].map(Shape::Line);
        let outline = |uses: &[(usize, bool)]| {
            let outer = uses.iter().map(|&(curve, is_reversed)| Use { curve, is_reversed }).collect();
            Outline { outer, inner: Vec::new() }
        };
        let outlines = [outline(&[(0, false), (1, false), (2, false)]), outline(&[(2, true), (3, false), (4, false)])];
        let shapes: Vec<&Shape> = shapes.iter().collect();
        let filled = fill(&shapes, &outlines, &Options::default()).unwrap();
        let below = quality(&filled.mesh).iter().filter(|quality| **quality < LEAST).count();
        let reports: Vec<[usize; 2]> = filled.reports.iter().map(|report| [report.sharp, report.poor]).collect();
        assert_eq!((below, reports), (1, vec![[1, 0], [0, 0]]));
        let mut edges: BTreeMap<(u32, u32), usize> = BTreeMap::new();
        for [a, b, c] in &filled.mesh.triangles {
            for (a, b) in [(a, b), (b, c), (c, a)] {
                *edges.entry((*a.min(b), *a.max(b))).or_default() += 1;
            }
        }
        let is_common = |number: u32| {
            let [x, y, _] = filled.mesh.points[number as usize];
            (y - 0.1 * x).abs() < 1e-9
        };
        let common: Vec<usize> =
            edges.iter().filter(|((a, b), _)| is_common(*a) && is_common(*b)).map(|(_, count)| *count).collect();
        assert!(common.len() > 11 && common.iter().all(|count| *count == 2), "{common:?}");
    }
}
