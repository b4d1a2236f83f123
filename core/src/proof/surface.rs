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

    /// The faces that hold a spot, if they are one, or two at an edge, and the second is [`NONE`] then; none for a vertex, and at an edge of other numbers.
    #[inline]
    pub(super) fn holders(&self, spot: &Spot) -> Option<[u32; 2]> {
        let k = match spot.shares.map(|share| share == 0.0) {
            [false, false, false] => return Some([spot.face, NONE]),
            [true, false, false] => 1,
            [false, true, false] => 2,
            [false, false, true] => 0,
            _ => return None,
        };
        Some([spot.face, self.beyond(spot.face, k)?])
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
        let corners = self.corners(face);
        let shares = shares_of_nearest(&corners, p);
        let [a, b, c] = corners;
        let spot = a * shares[0] + b * shares[1] + c * shares[2];
        (Spot { face, shares }, p.distance_squared(spot))
    }
}

/// The shares of a triangle's corners in the place of it that is nearest to another one: by the region in which that lies, with one division (Ericson,
/// "Real-Time Collision Detection", 2005, section 5.1.5).
#[inline]
fn shares_of_nearest([a, b, c]: &[DVec3; 3], p: DVec3) -> [f64; 3] {
    let (ab, ac) = (*b - *a, *c - *a);
    let [(a_b, a_c), (b_b, b_c), (c_b, c_c)] = [a, b, c].map(|corner| (ab.dot(p - *corner), ac.dot(p - *corner)));
    if a_b <= 0.0 && a_c <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    if b_b >= 0.0 && b_c <= b_b {
        return [0.0, 1.0, 0.0];
    }
    if c_c >= 0.0 && c_b <= c_c {
        return [0.0, 0.0, 1.0];
    }
    let inner = [b_b * c_c - c_b * b_c, c_b * a_c - a_b * c_c, a_b * b_c - b_b * a_c];
    if inner.iter().all(|x| *x > 0.0) {
        let share = (inner[0] + inner[1] + inner[2]).recip();
        return inner.map(|x| x * share);
    }
    let (from_b, from_c) = (b_c - b_b, c_b - c_c);
    let side = if inner[2] <= 0.0 && a_b >= 0.0 && b_b <= 0.0 {
        Some(([0, 1], a_b / (a_b - b_b)))
    } else if inner[1] <= 0.0 && a_c >= 0.0 && c_c <= 0.0 {
        Some(([0, 2], a_c / (a_c - c_c)))
    } else if inner[0] <= 0.0 && from_b >= 0.0 && from_c >= 0.0 {
        Some(([1, 2], from_b / (from_b + from_c)))
    } else {
        None
    };
    // A triangle without an area, or nearly, may have no such region.
    let ([from, to], t) = side.filter(|(_, t)| (0.0..=1.0).contains(t)).unwrap_or_else(|| nearest_side([a, b, c], p));
    let mut shares = [0.0; 3];
    (shares[from], shares[to]) = (1.0 - t, t);
    shares
}

/// The side of a triangle that is nearest to a place, by its corners, and the share of it where that is.
#[cold]
fn nearest_side(corners: [&DVec3; 3], p: DVec3) -> ([usize; 2], f64) {
    let sides = [[0, 1], [1, 2], [2, 0]].map(|side: [usize; 2]| {
        let [u, v] = side.map(|k| *corners[k]);
        let t = share_along(p, u, v);
        (p.distance_squared(u + (v - u) * t), (side, t))
    });
    sides[1..].iter().fold(sides[0], |best, other| if other.0 < best.0 { *other } else { best }).1
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::geometry::distance::nearest_of_triangle;

    proptest! {
        /// Also for triangles that are flat, or a point.
        #[test]
        fn no_place_of_a_triangle_is_nearer(own in prop::array::uniform9(-5i8..6), p in prop::array::uniform3(-9i8..10)) {
            let place = |k: usize| DVec3::from_array([0, 1, 2].map(|l: usize| f64::from(own[3 * k + l])));
            let (triangle, p) = ([place(0), place(1), place(2)], DVec3::from_array(p.map(f64::from)));
            let shares = shares_of_nearest(&triangle, p);
            prop_assert!(shares.iter().all(|share| *share >= 0.0) && (shares.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{shares:?}");
            let spot = triangle[0] * shares[0] + triangle[1] * shares[1] + triangle[2] * shares[2];
            let truth = nearest_of_triangle(&triangle, p).distance(p);
            prop_assert!((spot.distance(p) - truth).abs() < 1e-9, "{} {truth}", spot.distance(p));
        }
    }
}
