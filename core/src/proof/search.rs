//! Bounds of the distance of single triangles from a mesh, by parts of halves.
//!
//! The distance from a triangle is a convex function, so that no place of another triangle is farther from it than the farthest corner is.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::collections::binary_heap::PeekMut;

use glam::DVec3;
use rayon::prelude::*;

use crate::geometry::boxes::BoxTree;
use crate::geometry::distance::{place, square_distance};
use crate::geometry::exact::Point;
use crate::geometry::sums::Bounds;
use crate::proof::pairing::Pairing;
use crate::proof::surface::{Spot, Surface};

/// How many parts of a triangle are cut into four, at most.
const CUTS: usize = 1 << 10;

/// The bound of all triangles is not much better than that of a place of one of them: no search goes on for less.
const SLACK: f64 = 1.02;

/// A part of a triangle, and the bound of its places.
struct Part {
    bound: f64,
    corners: [DVec3; 3],
}

/// By their bounds.
impl Ord for Part {
    fn cmp(&self, other: &Self) -> Ordering {
        self.bound.total_cmp(&other.bound)
    }
}

impl PartialOrd for Part {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Part {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Part {}

/// Triangles to be near to.
struct Field {
    triangles: Vec<[DVec3; 3]>,
    tree: BoxTree,
}

impl Field {
    fn new(triangles: &[[Point; 3]]) -> Self {
        let boxes: Vec<Bounds> = triangles.iter().map(|t| Bounds::of(t)).collect();
        Self { triangles: triangles.iter().map(|t| t.map(place)).collect(), tree: BoxTree::new(&boxes) }
    }

    /// A bound of the distance of a triangle's places, no better than `aim` if it is below, and not much better than the distance of its farthest place.
    /// The part with the largest bound is cut first, so that what is near is not looked at for long.
    fn bound(&self, t: &[DVec3; 3], mut aim: f64) -> f64 {
        let part = |corners: [DVec3; 3]| Part { bound: self.of_one(&corners, aim), corners };
        let mut parts = BinaryHeap::from([part(*t)]);
        for _ in 0..CUTS {
            let Some(Part { bound, corners }) = parts.peek_mut().filter(|part| part.bound > aim).map(PeekMut::pop) else { break };
            let [a, b, c] = corners;
            aim = aim.max(SLACK * self.of_one(&[(a + b + c) / 3.0], aim));
            let [ab, bc, ca] = [0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)];
            let part = |corners: [DVec3; 3]| Part { bound: self.of_one(&corners, aim).min(bound), corners };
            parts.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]].map(part));
        }
        parts.peek().map_or(0.0, |part| part.bound)
    }

    /// The least of the distances from single triangles: of each, that of the farthest of some places.
    fn of_one(&self, places: &[DVec3], aim: f64) -> f64 {
        let Some(first) = places.first() else { return 0.0 };
        let size = places.iter().flat_map(|p| p.to_array()).fold(1e-30, |m: f64, x| m.max(x.abs()));
        let mut reach = aim.max(size * 1e-7);
        while !self.triangles.is_empty() {
            // Near to its first corner, as what it is near to is near to each corner.
            let [lo, hi] = [*first - reach, *first + reach].map(|q| q.to_array().map(|x| x as f32));
            let (mut least, mut count) = (f64::INFINITY, 0);
            self.tree.each_meeting(&Bounds::of(&[lo, hi]), |i| {
                count += 1;
                let mut farthest = 0.0_f64;
                for p in places {
                    farthest = farthest.max(square_distance(*p, self.triangles[i as usize]));
                    if farthest >= least {
                        return;
                    }
                }
                least = farthest;
            });
            let least = least.sqrt();
            if least <= reach || count == self.triangles.len() {
                return least;
            }
            reach *= 4.0;
        }
        f64::INFINITY
    }
}

/// Bounds of the distances of triangles from others, of which some are known to be near; no better than `aim` if they are below, and no better
/// than the distance of the farthest corner if that is not beyond `most`.
fn bounds(wanted: &[[DVec3; 3]], near: &[[Point; 3]], all: &[[u32; 3]], points: &[Point], (aim, most): (f64, f64)) -> Vec<f64> {
    let near = Field::new(near);
    let mut bounds: Vec<f64> = wanted.par_iter().with_max_len(16).map(|t| near.of_one(t, aim)).collect();
    let left: Vec<usize> = (0..wanted.len()).filter(|i| bounds[*i] > aim).collect();
    // No triangle beyond its bound can better it.
    let around = |i: &usize| {
        let [lo, hi] =
            [-1.0, 1.0].map(|sign| wanted[*i].map(|p| (p + sign * bounds[*i] * (1.0 + 1e-6)).to_array().map(|x| x as f32)));
        Bounds::of(&[lo, hi].concat())
    };
    let boxes: Vec<Bounds> = left.iter().filter(|i| bounds[**i].is_finite()).map(around).collect();
    let has_none = boxes.len() < left.len();
    let tree = BoxTree::new(&boxes);
    let corners = |face: &[u32; 3]| face.map(|v| points[v as usize]);
    let is_wanted = |t: &[Point; 3]| {
        let mut is_met = has_none;
        tree.each_meeting(&Bounds::of(t), |_| is_met = true);
        is_met
    };
    let field: Vec<[Point; 3]> = all.par_iter().with_min_len(1 << 10).map(corners).filter(is_wanted).collect();
    let field = Field::new(&field);
    let farthest_place = |i: &usize| wanted[*i].iter().map(|p| field.of_one(&[*p], aim)).fold(0.0, f64::max);
    let farthest = left.par_iter().with_max_len(16).map(farthest_place).reduce(|| 0.0, f64::max);
    let aim = aim.max((farthest * SLACK).min(most));
    let better: Vec<f64> = left.par_iter().with_max_len(16).map(|i| field.bound(&wanted[*i], aim)).collect();
    left.iter().zip(better).for_each(|(i, better)| bounds[*i] = bounds[*i].min(better));
    bounds
}

/// Bounds of many triangles.
#[derive(Default)]
pub(super) struct Bounded {
    /// The largest one.
    pub(super) largest: f64,
    /// The largest one of those that are far enough in.
    pub(super) within: f64,
    /// Triangles of the first mesh, and the bounds of what is beyond there.
    pub(super) far: Vec<(u32, f64)>,
    /// Faces of the second mesh that are beyond.
    pub(super) under: Vec<u32>,
}

impl Bounded {
    fn new(bounds: &[f64], most: f64) -> Self {
        let [largest, within] =
            [f64::INFINITY, most].map(|most| bounds.iter().filter(|d| **d <= most).copied().fold(0.0, f64::max));
        Self { largest, within, ..Self::default() }
    }
}

/// Bounds the distance of triangles of the first mesh, and names those beyond the second of `aims`.
pub(super) fn forward(
    surface: &Surface<'_>,
    pairing: &Pairing<'_>,
    images: &[Option<(Spot, f64)>],
    failed: &[u32],
    (aim, most): (f64, f64),
) -> Bounded {
    if failed.is_empty() {
        return Bounded::default();
    }
    let own = failed.iter().flat_map(|f| pairing.faces[*f as usize]);
    let mut is_near = vec![false; surface.faces.len()];
    own.filter_map(|v| images[v as usize]).for_each(|image| is_near[image.0.face as usize] = true);
    let corners = |face: &[u32; 3]| face.map(|v| surface.points[v as usize]);
    let near: Vec<_> = around(surface, is_near).into_iter().map(|f| corners(&surface.faces[f as usize])).collect();
    let triangle = |f: &u32| pairing.faces[*f as usize].map(|v| place(pairing.points[v as usize]));
    let wanted: Vec<_> = failed.iter().map(triangle).collect();
    let bounds = bounds(&wanted, &near, surface.faces, surface.points, (aim, most));
    let far = failed.iter().copied().zip(bounds.iter().copied()).filter(|(_, bound)| *bound > most).collect();
    Bounded { far, ..Bounded::new(&bounds, most) }
}

/// These faces and all around their vertices.
fn around(surface: &Surface<'_>, is_near: Vec<bool>) -> Vec<u32> {
    let own = |f: &u32| is_near[*f as usize];
    let vertices = (0..surface.faces.len() as u32).filter(own).flat_map(|f| surface.faces[f as usize]);
    let mut all: Vec<u32> = vertices.flat_map(|v| surface.around(v).iter().copied()).collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// Bounds the distance of faces of the second mesh, and names the triangles of the first that are near where it is beyond the second of `aims`.
pub(super) fn backward(
    surface: &Surface<'_>,
    pairing: &Pairing<'_>,
    images: &[Option<(Spot, f64)>],
    bare: &[u32],
    (aim, most): (f64, f64),
) -> Bounded {
    if bare.is_empty() {
        return Bounded::default();
    }
    let mut is_bare = vec![false; surface.faces.len()];
    bare.iter().for_each(|f| is_bare[*f as usize] = true);
    let mut is_near = vec![false; surface.faces.len()];
    around(surface, is_bare).into_iter().for_each(|f| is_near[f as usize] = true);
    let lies_on =
        |face: &[u32; 3], set: &[bool]| face.iter().any(|v| images[*v as usize].is_some_and(|image| set[image.0.face as usize]));
    let corners = |face: &[u32; 3]| face.map(|v| pairing.points[v as usize]);
    let near: Vec<_> = pairing.faces.par_iter().filter(|face| lies_on(face, &is_near)).map(corners).collect();
    let wanted: Vec<_> = bare.iter().map(|f| surface.corners(*f)).collect();
    let bounds = bounds(&wanted, &near, pairing.faces, pairing.points, (aim, most));
    let all = Bounded::new(&bounds, most);
    if all.largest <= most {
        return all;
    }
    let under = bare.iter().copied().zip(&bounds).filter(|(_, bound)| **bound > most).map(|(f, _)| f).collect();
    let (mut of_faces, mut of_vertices) = (vec![0.0_f64; surface.faces.len()], vec![0.0_f64; surface.points.len()]);
    for (f, bound) in bare.iter().zip(&bounds).filter(|(_, bound)| **bound > most) {
        of_faces[*f as usize] = *bound;
        for v in surface.faces[*f as usize] {
            of_vertices[v as usize] = bound.max(of_vertices[v as usize]);
        }
    }
    // A vertex lies on such a face, or has become a vertex of one: nothing may lie on the face.
    let of_vertex = |v: u32| {
        let on = images[v as usize].map_or(0.0, |image| of_faces[image.0.face as usize]);
        pairing.became.get(v as usize).and_then(|w| of_vertices.get(*w as usize)).map_or(on, |of| on.max(*of))
    };
    let far = (0..).zip(pairing.faces).map(|(f, face)| (f, face.map(of_vertex).into_iter().fold(0.0, f64::max)));
    Bounded { far: far.filter(|(_, bound)| *bound > most).collect(), under, ..all }
}
