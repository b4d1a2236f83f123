//! Bounds of the distance of single triangles from a mesh, by halves.
//!
//! The distance from a triangle is a convex function, so that no place of another triangle is farther from it than the farthest corner is.

use std::sync::OnceLock;

use glam::DVec3;
use rayon::prelude::*;

use crate::geometry::boxes::BoxTree;
use crate::geometry::distance::{place, square_distance};
use crate::geometry::exact::Point;
use crate::geometry::sums::Bounds;
use crate::proof::pairing::Pairing;
use crate::proof::surface::{Spot, Surface};

/// How often a triangle is cut into four.
const DEPTH: usize = 5;

/// Triangles to be near to.
struct Field {
    triangles: Vec<[DVec3; 3]>,
    tree: BoxTree,
}

impl Field {
    fn new(triangles: Vec<[Point; 3]>) -> Self {
        let boxes: Vec<Bounds> = triangles.iter().map(|t| Bounds::of(t)).collect();
        Self { triangles: triangles.into_iter().map(|t| t.map(place)).collect(), tree: BoxTree::new(&boxes) }
    }

    /// A bound of the distance of a triangle's places, no better than `aim` if it is below.
    fn bound(&self, t: &[DVec3; 3], aim: f64, depth: usize) -> f64 {
        let one = self.of_one(t, aim);
        if one <= aim || depth == 0 {
            return one;
        }
        let [a, b, c] = *t;
        let [ab, bc, ca] = [0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)];
        let parts = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]];
        parts.iter().map(|part| self.bound(part, aim, depth - 1)).fold(0.0, f64::max).min(one)
    }

    /// The least of the distances from single triangles.
    fn of_one(&self, t: &[DVec3; 3], aim: f64) -> f64 {
        let size = t.iter().flat_map(|p| p.to_array()).fold(1e-30, |m: f64, x| m.max(x.abs()));
        let mut reach = aim.max(size * 1e-7);
        let mut found = Vec::new();
        while !self.triangles.is_empty() {
            let around = |p: &DVec3| [(*p - reach), (*p + reach)].map(|q| q.to_array().map(|x| x as f32));
            // Near to its first corner, as what it is near to is near to each corner.
            let [lo, hi] = around(&t[0]);
            self.tree.meeting(&Bounds::of(&[lo, hi]), &mut found);
            let farthest = |i: &u32| t.iter().map(|p| square_distance(*p, self.triangles[*i as usize])).fold(0.0, f64::max);
            let least = found.iter().map(farthest).fold(f64::INFINITY, f64::min).sqrt();
            if least <= reach || found.len() == self.triangles.len() {
                return least;
            }
            reach *= 4.0;
        }
        f64::INFINITY
    }
}

/// A field of what is near, and one of all, which is made when the first one is not enough.
struct Fields {
    near: Field,
    all: OnceLock<Field>,
}

impl Fields {
    fn new(near: Vec<[Point; 3]>) -> Self {
        Self { near: Field::new(near), all: OnceLock::new() }
    }

    fn bound(&self, t: &[DVec3; 3], aim: f64, all: impl FnOnce() -> Vec<[Point; 3]>) -> f64 {
        let near = self.near.bound(t, aim, DEPTH);
        if near <= aim { near } else { near.min(self.all.get_or_init(|| Field::new(all())).bound(t, aim, DEPTH)) }
    }
}

/// Bounds the distance of triangles of the first mesh, and names those beyond the second of `aims`.
pub(super) fn forward(
    surface: &Surface<'_>,
    pairing: &Pairing<'_>,
    images: &[Option<(Spot, f64)>],
    failed: &[u32],
    (aim, most): (f64, f64),
) -> (f64, Vec<u32>) {
    if failed.is_empty() {
        return (0.0, Vec::new());
    }
    let own = failed.iter().flat_map(|f| pairing.faces[*f as usize]);
    let mut is_near = vec![false; surface.faces.len()];
    own.filter_map(|v| images[v as usize]).for_each(|image| is_near[image.0.face as usize] = true);
    let corners = |face: &[u32; 3]| face.map(|v| surface.points[v as usize]);
    let near = around(surface, is_near).into_iter().map(|f| corners(&surface.faces[f as usize])).collect();
    let fields = Fields::new(near);
    let bound = |f: &u32| {
        let t = pairing.faces[*f as usize].map(|v| place(pairing.points[v as usize]));
        fields.bound(&t, aim, || surface.faces.iter().map(corners).collect())
    };
    let bounds: Vec<f64> = failed.par_iter().with_max_len(16).map(bound).collect();
    let far = failed.iter().zip(&bounds).filter(|(_, bound)| **bound > most).map(|(f, _)| *f).collect();
    (bounds.into_iter().fold(0.0, f64::max), far)
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
) -> (f64, Vec<u32>) {
    if bare.is_empty() {
        return (0.0, Vec::new());
    }
    let mut is_bare = vec![false; surface.faces.len()];
    bare.iter().for_each(|f| is_bare[*f as usize] = true);
    let mut is_near = vec![false; surface.faces.len()];
    around(surface, is_bare).into_iter().for_each(|f| is_near[f as usize] = true);
    let lies_on =
        |face: &[u32; 3], set: &[bool]| face.iter().any(|v| images[*v as usize].is_some_and(|image| set[image.0.face as usize]));
    let corners = |face: &[u32; 3]| face.map(|v| pairing.points[v as usize]);
    let fields = Fields::new(pairing.faces.par_iter().filter(|face| lies_on(face, &is_near)).map(corners).collect());
    let bound = |f: &u32| fields.bound(&surface.corners(*f), aim, || pairing.faces.iter().map(corners).collect());
    let bounds: Vec<f64> = bare.par_iter().with_max_len(16).map(bound).collect();
    let mut is_beyond = vec![false; surface.faces.len()];
    bare.iter().zip(&bounds).for_each(|(f, bound)| is_beyond[*f as usize] = *bound > most);
    let all = bounds.iter().copied().fold(0.0, f64::max);
    if all <= most {
        return (all, Vec::new());
    }
    let far = (0..).zip(pairing.faces).filter(|(_, face)| lies_on(face, &is_beyond)).map(|(f, _)| f).collect();
    (all, far)
}
