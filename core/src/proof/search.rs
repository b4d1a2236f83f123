//! Bounds of the distance of single triangles from a mesh, by parts: each is cut along the sides of the mesh's triangle that is nearest to its middle.
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

/// How many parts of a triangle are cut, at most.
const CUTS: usize = 1 << 10;

/// The bound of all triangles is not much better than that of a place of one of them: no search goes on for less.
const SLACK: f64 = 1.02;

/// The places of a wanted triangle that are looked at first are corners of so many parts along each of its sides.
const STEPS: usize = 5;

/// A part that reaches over a plane by less than this share of its height lies on one side of it.
const FLAT: f64 = 1e-9;

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
            let (distance, nearest) = self.nearest(&[(a + b + c) / 3.0], aim);
            aim = aim.max(SLACK * distance);
            let cuts = nearest.map(|i| cut(corners, &self.triangles[i as usize])).unwrap_or_default();
            let part = |corners: [DVec3; 3]| Part { bound: self.of_one(&corners, aim).min(bound), corners };
            if cuts.len() > 1 {
                parts.extend(cuts.into_iter().map(part));
            } else {
                let [ab, bc, ca] = [0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)];
                parts.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]].map(part));
            }
        }
        parts.peek().map_or(0.0, |part| part.bound)
    }

    /// The least of the distances from single triangles: of each, that of the farthest of some places.
    fn of_one(&self, places: &[DVec3], aim: f64) -> f64 {
        self.nearest(places, aim).0
    }

    /// The same, and the first triangle that is as near.
    fn nearest(&self, places: &[DVec3], aim: f64) -> (f64, Option<u32>) {
        let Some(first) = places.first() else { return (0.0, None) };
        let size = places.iter().flat_map(|p| p.to_array()).fold(1e-30, |m: f64, x| m.max(x.abs()));
        let mut reach = aim.max(size * 1e-7);
        while !self.triangles.is_empty() {
            // Near to its first corner, as what it is near to is near to each corner.
            let [lo, hi] = [*first - reach, *first + reach].map(|q| q.to_array().map(|x| x as f32));
            let (mut least, mut nearest, mut count) = (f64::INFINITY, None, 0);
            self.tree.each_meeting(&Bounds::of(&[lo, hi]), |i| {
                count += 1;
                let mut farthest = 0.0_f64;
                for p in places {
                    farthest = farthest.max(square_distance(*p, self.triangles[i as usize]));
                    if farthest > least {
                        return;
                    }
                }
                if farthest < least || nearest.is_none_or(|nearest| i < nearest) {
                    (least, nearest) = (farthest, Some(i));
                }
            });
            let least = least.sqrt();
            if least <= reach || count == self.triangles.len() {
                return (least, nearest);
            }
            reach *= 4.0;
        }
        (f64::INFINITY, None)
    }
}

/// Cuts a triangle by the planes through the sides of another one, across it: what lies over that one, and what lies beyond each side.
fn cut(corners: [DVec3; 3], other: &[DVec3; 3]) -> Vec<[DVec3; 3]> {
    let [p, q, r] = *other;
    let normal = (q - p).cross(r - p);
    let (mut left, mut parts) = (corners.to_vec(), Vec::new());
    for (from, to) in [(p, q), (q, r), (r, p)] {
        let inward = normal.cross(to - from);
        let (inside, outside) = halves(&left, |place| inward.dot(place - from));
        parts.extend(fan(&outside));
        left = inside;
    }
    parts.extend(fan(&left));
    parts
}

/// The two parts of a convex polygon: where a linear function is not negative, and where it is negative; one of them is empty where nothing parts them but
/// rounding.
fn halves(polygon: &[DVec3], of: impl Fn(DVec3) -> f64) -> (Vec<DVec3>, Vec<DVec3>) {
    let mut heights: Vec<f64> = polygon.iter().map(|place| of(*place)).collect();
    let highest = heights.iter().fold(0.0, |m: f64, h| m.max(h.abs()));
    heights.iter_mut().filter(|h| h.abs() <= highest * FLAT).for_each(|h| *h = 0.0);
    if heights.iter().all(|h| *h >= 0.0) {
        return (polygon.to_vec(), Vec::new());
    }
    if heights.iter().all(|h| *h <= 0.0) {
        return (Vec::new(), polygon.to_vec());
    }
    let (mut above, mut below) = (Vec::with_capacity(polygon.len() + 1), Vec::with_capacity(polygon.len() + 1));
    for (i, a) in polygon.iter().enumerate() {
        let next = (i + 1) % polygon.len();
        let (b, at, next) = (polygon[next], heights[i], heights[next]);
        if at >= 0.0 {
            above.push(*a);
        }
        if at <= 0.0 {
            below.push(*a);
        }
        if at * next < 0.0 {
            let cross = a.lerp(b, at / (at - next));
            above.push(cross);
            below.push(cross);
        }
    }
    (above, below)
}

/// Triangles of a convex polygon; none of less than three corners.
fn fan(polygon: &[DVec3]) -> impl Iterator<Item = [DVec3; 3]> + '_ {
    polygon.array_windows().skip(1).map(|[b, c]| [polygon[0], *b, *c])
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
    let is_wanted = |t: &[Point; 3]| has_none || tree.meets(&Bounds::of(t));
    let field: Vec<[Point; 3]> = all.par_iter().with_min_len(1 << 10).map(corners).filter(is_wanted).collect();
    let field = Field::new(&field);
    // The farther these places are, the fewer parts are cut of all.
    let farthest_place = |i: &usize| places(&wanted[*i]).map(|p| field.of_one(&[p], aim)).fold(0.0, f64::max);
    let farthest = left.par_iter().with_max_len(16).map(farthest_place).reduce(|| 0.0, f64::max);
    let aim = aim.max((farthest * SLACK).min(most));
    let better: Vec<f64> = left.par_iter().with_max_len(16).map(|i| field.bound(&wanted[*i], aim)).collect();
    left.iter().zip(better).for_each(|(i, better)| bounds[*i] = bounds[*i].min(better));
    bounds
}

/// Some places of a triangle, its corners among them.
fn places([a, b, c]: &[DVec3; 3]) -> impl Iterator<Item = DVec3> {
    let [from, along, across] = [*a, (*b - *a) / STEPS as f64, (*c - *a) / STEPS as f64];
    let corners = [*a, *b, *c].into_iter();
    let others = (0..=STEPS).flat_map(move |i| (0..=STEPS - i).map(move |j| from + along * i as f64 + across * j as f64));
    corners.chain(others)
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn area([a, b, c]: &[DVec3; 3]) -> f64 {
        (*b - *a).cross(*c - *a).length() / 2.0
    }

    proptest! {
        /// The parts are the whole: none is lost, none is there twice, and each lies on one side of each plane.
        #[test]
        fn a_triangle_is_cut_without_rest(own in prop::array::uniform9(-5i8..6), other in prop::array::uniform9(-5i8..6)) {
            let triangle = |c: [i8; 9]| [0, 1, 2].map(|k: usize| DVec3::from_array([0, 1, 2].map(|l: usize| f64::from(c[3 * k + l]))));
            let (own, other) = (triangle(own), triangle(other));
            let parts = cut(own, &other);
            prop_assert!((parts.iter().map(area).sum::<f64>() - area(&own)).abs() < 1e-9);
            let normal = (other[1] - other[0]).cross(other[2] - other[0]);
            for part in parts {
                for k in 0..3 {
                    let inward = normal.cross(other[(k + 1) % 3] - other[k]).normalize_or_zero();
                    let heights = part.map(|place| inward.dot(place - other[k]));
                    let is_inside = heights.iter().all(|h| *h > -1e-6);
                    prop_assert!(is_inside || heights.iter().all(|h| *h < 1e-6), "{heights:?}");
                    // Behind one plane, it is not cut by the next ones.
                    if !is_inside {
                        break;
                    }
                }
            }
        }

        /// The bound of a part of a bumpy surface from that surface, by far more places than it looks at: none is farther, and it is not much more than
        /// the farthest of them.
        #[test]
        fn no_place_is_farther_than_the_bound(heights in prop::collection::vec(0i8..5, 25), lift in 0i8..4) {
            let at = |x: usize, y: usize| [x as f32, y as f32, f32::from(heights[5 * y + x]) / 8.0];
            let cells = (0..4).flat_map(|y| (0..4).map(move |x| (x, y)));
            let field: Vec<[Point; 3]> = cells
                .flat_map(|(x, y)| {
                    let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
                    [[a, b, c], [a, c, d]]
                })
                .collect();
            let field = Field::new(&field);
            let z = f64::from(lift) / 8.0;
            let wanted = [DVec3::new(0.5, 0.5, z), DVec3::new(3.5, 1.0, z), DVec3::new(1.0, 3.5, z)];
            let bound = field.bound(&wanted, 1e-3);
            let [a, b, c] = wanted;
            let all = (0..=40).flat_map(|i| (0..=40 - i).map(move |j| a + (b - a) * (f64::from(i) / 40.0) + (c - a) * (f64::from(j) / 40.0)));
            let farthest = all.map(|place| field.of_one(&[place], 1e-3)).fold(0.0, f64::max);
            prop_assert!(farthest <= bound * (1.0 + 1e-12));
            prop_assert!(bound <= (farthest * 1.1).max(2e-3), "{bound} {farthest}");
        }
    }
}
