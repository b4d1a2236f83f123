//! The triangles of one cell, in flat arrays, with the corners at each vertex in a ring of links: 24 bytes a triangle, nothing to allocate.
//!
//! Corner 3f + k is corner k of face f. All corners at one vertex are linked in a circle, in no order. Two circles become one by an exchange of two links.

use glam::DVec3;

use crate::geometry::distance;
use crate::geometry::exact::Point;
use crate::simplify::quadric::Quadric;
use crate::util::ids::NONE;
use crate::util::prefetch::prefetch;

pub(super) use crate::algorithms::fans::MOST;

/// The freedom of a vertex; a higher number is less of it.
pub(super) const FREE: u8 = 0;
/// It lies on a crease, and stays on it.
pub(super) const CREASE: u8 = 1;
/// It lies on the rim of a surface, and stays on it.
pub(super) const RIM: u8 = 2;
/// It stays as it is.
pub(super) const FIXED: u8 = 3;

/// The triangles around a vertex.
#[derive(Clone)]
pub(super) struct Star {
    pub(super) len: usize,
    /// Their corners at the vertex.
    pub(super) corners: [u32; MOST],
    /// Their other vertices, in the triangle's sense.
    pub(super) ring: [[u32; 2]; MOST],
}

impl Default for Star {
    fn default() -> Self {
        Self { len: 0, corners: [NONE; MOST], ring: [[NONE; 2]; MOST] }
    }
}

impl Star {
    /// Each triangle: its corner and its other vertices.
    #[inline]
    pub(super) fn iter(&self) -> impl Iterator<Item = (u32, [u32; 2])> + '_ {
        self.corners.iter().copied().zip(self.ring.iter().copied()).take(self.len)
    }

    /// Those without a vertex.
    #[inline]
    pub(super) fn without(&self, gone: u32) -> impl Iterator<Item = (u32, [u32; 2])> + '_ {
        self.iter().filter(move |(_, ring)| !ring.contains(&gone))
    }
}

/// Triangles by their corners, with what is known of each vertex.
#[derive(Clone, Default)]
pub(super) struct Patch {
    pub(super) points: Vec<Point>,
    pub(super) quadrics: Vec<Quadric>,
    pub(super) kinds: Vec<u8>,
    /// By which of the limits a vertex is judged; a higher one is stricter.
    pub(super) strict: Vec<u8>,
    /// The vertex at each corner, [`NONE`] at those of triangles that are gone.
    pub(super) corners: Vec<u32>,
    /// The vertex that a vertex has become, itself while it is there.
    pub(super) became: Vec<u32>,
    next: Vec<u32>,
    first: Vec<u32>,
    /// How many triangles each vertex has.
    counts: Vec<u32>,
    /// For each vertex, the square of the least height of the triangles that were there at first, around it and all that have become it.
    lows: Vec<f32>,
    /// Positions are multiplied by this power of two, so that nothing is rounded.
    unit: f64,
    /// Triangles that are there.
    pub(super) live: usize,
}

#[inline]
fn others(corner: u32) -> [u32; 2] {
    match corner % 3 {
        0 => [corner + 1, corner + 2],
        1 => [corner + 1, corner - 1],
        _ => [corner - 2, corner - 1],
    }
}

/// The square of the longest side.
#[inline]
pub(super) fn longest([a, b, c]: [DVec3; 3]) -> f64 {
    (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared())
}

impl Patch {
    /// Of triangles by numbers of vertices, each of which has a point, a quadric, a kind and a limit. Lengths are multiplied by `unit`, a power of two.
    pub(super) fn new(
        points: Vec<Point>,
        quadrics: Vec<Quadric>,
        [kinds, strict]: [Vec<u8>; 2],
        corners: Vec<u32>,
        unit: f64,
    ) -> Self {
        let count = points.len();
        let mut next = vec![NONE; corners.len()];
        let mut first = vec![NONE; count];
        let mut counts = vec![0; count];
        for (corner, v) in corners.iter().enumerate() {
            counts[*v as usize] += 1;
            let at = &mut first[*v as usize];
            if *at == NONE {
                (*at, next[corner]) = (corner as u32, corner as u32);
            } else {
                next[corner] = std::mem::replace(&mut next[*at as usize], corner as u32);
            }
        }
        let live = corners.len() / 3;
        let became = (0..count as u32).collect();
        let mut patch =
            Self { points, quadrics, kinds, strict, corners, became, next, first, counts, lows: Vec::new(), unit, live };
        patch.lows = patch.lowest();
        patch
    }

    /// For each vertex, the square of the least height of the triangles around it. O(n).
    fn lowest(&self) -> Vec<f32> {
        let mut lows = vec![f32::INFINITY; self.points.len()];
        for face in self.corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]]) {
            let [a, b, c] = face.map(|v| self.place_of(v));
            let square = ((b - a).cross(c - a).length_squared() / longest([a, b, c])) as f32;
            for v in face {
                // The least height of a triangle without extent is no number, and is none here.
                lows[v as usize] = lows[v as usize].min(square);
            }
        }
        lows
    }

    /// The square of the least height of the triangles around two vertices, and all that have become them, as they were at first.
    #[inline]
    pub(super) fn low(&self, ends: [u32; 2]) -> f64 {
        let [a, b] = ends.map(|v| self.lows[v as usize]);
        a.min(b).into()
    }

    /// A position in the unit of lengths.
    #[inline]
    pub(super) fn place(&self, point: &Point) -> DVec3 {
        distance::place(*point) * self.unit
    }

    /// The position of a vertex in the unit of lengths.
    #[inline]
    pub(super) fn place_of(&self, v: u32) -> DVec3 {
        self.place(&self.points[v as usize])
    }

    /// The position nearest to a place in the unit of lengths.
    #[inline]
    pub(super) fn point(&self, place: DVec3) -> Point {
        (place / self.unit).to_array().map(|x| x as f32 + 0.0)
    }

    /// Has the processor bring near what is known of a vertex.
    #[inline]
    pub(super) fn ask_for_vertex(&self, v: u32) {
        let v = v as usize;
        prefetch(&self.first, v);
        prefetch(&self.points, v);
        prefetch(&self.quadrics, v);
    }

    /// Has it bring near the quadric of a vertex alone.
    #[inline]
    pub(super) fn ask_for_quadric(&self, v: u32) {
        prefetch(&self.quadrics, v as usize);
    }

    /// Has it bring near where the triangles around a vertex begin, which must be near itself.
    #[inline]
    pub(super) fn ask_for_star(&self, v: u32) {
        let first = self.first[v as usize] as usize;
        prefetch(&self.corners, first);
        prefetch(&self.next, first);
    }

    /// The triangles around a vertex; false if they are none, or too many.
    #[inline]
    pub(super) fn star(&self, v: u32, star: &mut Star) -> bool {
        star.len = 0;
        let first = self.first[v as usize];
        if first == NONE || self.count(v) > MOST {
            return false;
        }
        let mut corner = first;
        loop {
            if star.len == MOST {
                return false;
            }
            star.corners[star.len] = corner;
            star.ring[star.len] = others(corner).map(|c| self.corners[c as usize]);
            star.len += 1;
            corner = self.next[corner as usize];
            if corner == first {
                return true;
            }
        }
    }

    /// The vertices of a triangle, by any of its corners.
    #[inline]
    pub(super) fn face(&self, face: usize) -> [u32; 3] {
        [self.corners[3 * face], self.corners[3 * face + 1], self.corners[3 * face + 2]]
    }

    /// Lets a vertex have these corners, and no other ones.
    #[inline]
    fn link(&mut self, v: u32, corners: impl Iterator<Item = u32>) {
        let (mut first, mut last) = (NONE, NONE);
        for corner in corners {
            if first == NONE {
                first = corner;
            } else {
                self.next[last as usize] = corner;
            }
            last = corner;
        }
        if first != NONE {
            self.next[last as usize] = first;
        }
        self.first[v as usize] = first;
    }

    /// Lets `u` become `v`, whose stars these are; the two triangles of both are gone.
    pub(super) fn merge(&mut self, [u, v]: [u32; 2], of_u: &Star, of_v: &Star) {
        for (corner, ring) in of_u.iter().filter(|(_, ring)| ring.contains(&v)) {
            let wing = if ring[0] == v { ring[1] } else { ring[0] };
            for c in others(corner) {
                self.corners[c as usize] = NONE;
            }
            self.corners[corner as usize] = NONE;
            self.counts[wing as usize] -= 1;
            self.live -= 1;
            // A vertex with more triangles has no star, so that its dead corners may stay linked. To unlink each at once would go through all corners each time.
            if self.count(wing) <= MOST {
                self.unlink(wing);
            }
        }
        for (corner, _) in of_u.without(v) {
            self.corners[corner as usize] = v;
        }
        self.link(v, of_u.without(v).chain(of_v.without(u)).map(|(corner, _)| corner));
        self.first[u as usize] = NONE;
        let gone = of_u.iter().filter(|(_, ring)| ring.contains(&v)).count();
        self.counts[v as usize] = (of_u.len + of_v.len - 2 * gone) as u32;
        self.became[u as usize] = v;
        self.lows[v as usize] = self.lows[v as usize].min(self.lows[u as usize]);
        self.strict[v as usize] = self.strict[v as usize].max(self.strict[u as usize]);
    }

    /// Lets go of the corners at a vertex that belong to triangles that are gone.
    #[inline]
    fn unlink(&mut self, v: u32) {
        let first = self.first[v as usize];
        let (mut corner, mut kept_first, mut kept_last) = (first, NONE, NONE);
        loop {
            let next = self.next[corner as usize];
            if self.corners[corner as usize] != NONE {
                if kept_first == NONE {
                    kept_first = corner;
                } else {
                    self.next[kept_last as usize] = corner;
                }
                kept_last = corner;
            }
            if next == first {
                break;
            }
            corner = next;
        }
        if kept_last != NONE {
            self.next[kept_last as usize] = kept_first;
        }
        self.first[v as usize] = kept_first;
    }

    /// How many triangles a vertex has.
    #[inline]
    pub(super) fn count(&self, v: u32) -> usize {
        self.counts[v as usize] as usize
    }

    /// Is it there?
    #[inline]
    pub(super) fn is_there(&self, v: u32) -> bool {
        self.first[v as usize] != NONE
    }

    /// The triangles that are there.
    pub(super) fn faces(&self) -> impl Iterator<Item = (usize, [u32; 3])> + '_ {
        self.corners.chunks_exact(3).enumerate().filter(|(_, c)| c[0] != NONE).map(|(f, c)| (f, [c[0], c[1], c[2]]))
    }

    pub(super) fn triangle(&self, face: [u32; 3]) -> [Point; 3] {
        face.map(|v| self.points[v as usize])
    }
}
