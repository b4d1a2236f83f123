//! A surface to be mapped to: its faces around vertices, and places on it that are known by vertices, so that what is common to faces is exactly common.

use glam::DVec3;
use rayon::prelude::*;

use crate::algorithms::fans::corners_by_vertex;
use crate::geometry::distance::{place, share_along};
use crate::geometry::exact::Point;
use crate::util::ids::NONE;

/// Steps from face to face towards the nearest one, at most.
pub(crate) const WALK: usize = 24;

/// A mesh with its faces by vertices.
pub(super) struct Surface<'a> {
    pub(super) points: &'a [Point],
    pub(super) faces: &'a [[u32; 3]],
    starts: Vec<u32>,
    around: Vec<u32>,
    /// The face beyond each edge, from corner k of a face on, [`NONE`] where there is none, or more than one.
    beyond: Vec<[u32; 3]>,
}

/// A place on a face: shares of its corners, none negative; those that are zero are exactly so.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spot {
    pub(super) face: u32,
    pub(super) shares: [f64; 3],
}

impl Spot {
    /// Does it lie on no edge of its face?
    #[inline]
    pub(super) fn is_inner(&self) -> bool {
        self.shares.iter().all(|share| *share > 0.0)
    }
}

impl<'a> Surface<'a> {
    /// O(n), where one end of each edge has a bounded number of faces.
    pub(super) fn new(points: &'a [Point], faces: &'a [[u32; 3]]) -> Self {
        let (starts, mut around) = corners_by_vertex(points.len(), faces);
        around.par_iter_mut().with_min_len(1 << 12).for_each(|corner| *corner /= 3);
        let mut surface = Self { points, faces, starts, around, beyond: Vec::new() };
        let of_face = |f: usize| [0, 1, 2].map(|k| surface.look_beyond(f as u32, k));
        surface.beyond = (0..faces.len()).into_par_iter().with_min_len(1 << 10).map(of_face).collect();
        surface
    }

    /// Looks for the one face beyond the edge from corner `k` of a face on, around the end that has fewer faces.
    fn look_beyond(&self, face: u32, k: usize) -> u32 {
        let ends = [self.faces[face as usize][k], self.faces[face as usize][(k + 1) % 3]];
        let [(near, other), (far, first)] = [(ends[0], ends[1]), (ends[1], ends[0])];
        let (hub, other) = if self.around(near).len() <= self.around(far).len() { (near, other) } else { (far, first) };
        let mut others = self.around(hub).iter().copied().filter(|f| *f != face && self.faces[*f as usize].contains(&other));
        match (others.next(), others.next()) {
            (Some(one), None) => one,
            _ => NONE,
        }
    }

    /// The faces around a vertex, by number.
    #[inline]
    pub(super) fn around(&self, v: u32) -> &[u32] {
        let range = self.starts[v as usize] as usize..self.starts[v as usize + 1] as usize;
        &self.around[range]
    }

    #[inline]
    pub(super) fn corners(&self, face: u32) -> [DVec3; 3] {
        self.faces[face as usize].map(|v| place(self.points[v as usize]))
    }

    #[inline]
    pub(super) fn position(&self, spot: &Spot) -> DVec3 {
        let [a, b, c] = self.corners(spot.face);
        a * spot.shares[0] + b * spot.shares[1] + c * spot.shares[2]
    }

    /// The spot at a vertex.
    pub(super) fn at_vertex(&self, v: u32) -> Option<Spot> {
        let face = *self.around(v).first()?;
        let shares = self.faces[face as usize].map(|w| if w == v { 1.0 } else { 0.0 });
        Some(Spot { face, shares })
    }

    /// The same spot as one of another face, if it lies in it.
    #[inline]
    pub(super) fn within(&self, spot: &Spot, face: u32) -> Option<[f64; 3]> {
        if spot.face == face {
            return Some(spot.shares);
        }
        if spot.is_inner() {
            return None;
        }
        let (from, to) = (self.faces[spot.face as usize], self.faces[face as usize]);
        let mut shares = [0.0; 3];
        for (v, share) in from.iter().zip(spot.shares) {
            if share > 0.0 {
                shares[to.iter().position(|w| w == v)?] = share;
            }
        }
        Some(shares)
    }

    /// A face in which all these spots lie.
    #[inline]
    pub(super) fn common<const N: usize>(&self, spots: [&Spot; N]) -> Option<u32> {
        let first = spots.first()?;
        if spots.iter().all(|spot| spot.face == first.face) {
            return Some(first.face);
        }
        let holds = |face: u32| spots.iter().all(|spot| self.within(spot, face).is_some());
        // Where one lies inside a face, there is no other one; else all are around a vertex of the first.
        if let Some(inner) = spots.iter().find(|spot| spot.is_inner()) {
            return holds(inner.face).then_some(inner.face);
        }
        // Spots on a way are each in the face that the way goes on from: the one in common is that of one of both, nearly always.
        if let Some(one) = spots.iter().find(|spot| holds(spot.face)) {
            return Some(one.face);
        }
        let k = first.shares.iter().position(|s| *s > 0.0)?;
        self.around(self.faces[first.face as usize][k]).iter().copied().find(|face| holds(*face))
    }

    /// The faces in which a spot lies.
    pub(super) fn faces_of(&self, spot: &Spot, found: &mut Vec<u32>) {
        found.clear();
        match spot.shares.iter().position(|s| *s > 0.0) {
            Some(k) if spot.shares.contains(&0.0) => {
                let all = self.around(self.faces[spot.face as usize][k]);
                found.extend(all.iter().copied().filter(|face| self.within(spot, *face).is_some()));
            }
            _ => found.push(spot.face),
        }
    }

    /// The face beyond the edge from corner `k` of a face on, if there is one, and only one.
    #[inline]
    pub(super) fn beyond(&self, face: u32, k: usize) -> Option<u32> {
        let one = self.beyond[face as usize][k];
        (one != NONE).then_some(one)
    }

    /// The spot of a face that is nearest to a place, and the square of its distance.
    #[inline]
    pub(super) fn nearest(&self, face: u32, p: DVec3) -> (Spot, f64) {
        let [a, b, c] = self.corners(face);
        let normal = (b - a).cross(c - a);
        let square = normal.length_squared();
        let inner = [(b, c), (c, a), (a, b)].map(|(u, v)| (v - u).cross(p - u).dot(normal));
        if square > 0.0 && inner.iter().all(|x| *x > 0.0) {
            let sum = inner[0] + inner[1] + inner[2];
            let height = normal.dot(p - a);
            return (Spot { face, shares: inner.map(|x| x / sum) }, height * height / square);
        }
        let mut best = (Spot { face, shares: [1.0, 0.0, 0.0] }, f64::INFINITY);
        for (k, (u, v)) in [(a, b), (b, c), (c, a)].into_iter().enumerate() {
            let t = share_along(p, u, v);
            let distance = (p - u - (v - u) * t).length_squared();
            if distance < best.1 {
                let mut shares = [0.0; 3];
                (shares[k], shares[(k + 1) % 3]) = (1.0 - t, t);
                best = (Spot { face, shares }, distance);
            }
        }
        best
    }
}
