//! The image of a triangle, by those of its edges: polygons that lie in one face each.
//!
//! The loop around the triangle is cut at places of it that lie in one face, the longest run of them first, until nothing is left. Where it runs
//! around vertices of the surface, these are joined to the loop by spokes, and each sector is cut by itself.

use glam::DVec3;

use crate::geometry::distance::nearest_of_triangle;
use crate::proof::chain::{self, Lent, Pair};
use crate::proof::surface::{Spot, Surface};
use crate::util::ids::NONE;

/// How many vertices may lie within each other's sectors.
const DEPTH: usize = 4;

/// A polygon of a triangle whose image is the polygon of these spots in a face.
pub(super) struct Piece<'a> {
    pub(super) face: u32,
    pub(super) corners: &'a [Pair],
}

/// The faces that hold two spots, or more of them in a row.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Shared {
    /// One or two, the second one [`NONE`] if there is one; none if both are.
    Faces([u32; 2]),
    /// All spots are this vertex.
    Vertex(u32),
}

impl Shared {
    const NO: Self = Self::Faces([NONE; 2]);

    #[inline]
    fn of(surface: &Surface<'_>, [a, b]: [&Spot; 2]) -> Self {
        let Some(face) = surface.common([a, b]) else { return Self::NO };
        let (Some(a), Some(b)) = (surface.within(a, face), surface.within(b, face)) else { return Self::NO };
        let is_out = [0, 1, 2].map(|k: usize| a[k] == 0.0 && b[k] == 0.0);
        match is_out {
            [false, false, false] => Self::Faces([face, NONE]),
            [true, true, _] => Self::Vertex(surface.faces[face as usize][2]),
            [true, _, true] => Self::Vertex(surface.faces[face as usize][1]),
            [_, true, true] => Self::Vertex(surface.faces[face as usize][0]),
            [true, ..] => Self::Faces([face, surface.beyond(face, 1).unwrap_or(NONE)]),
            [_, true, _] => Self::Faces([face, surface.beyond(face, 2).unwrap_or(NONE)]),
            [.., true] => Self::Faces([face, surface.beyond(face, 0).unwrap_or(NONE)]),
        }
    }

    /// Those of both.
    #[inline]
    fn and(self, surface: &Surface<'_>, other: Self) -> Self {
        match (self, other) {
            (Self::Faces(own), Self::Faces(others)) => kept(own, |face| others.contains(&face)),
            (Self::Faces(own), Self::Vertex(v)) | (Self::Vertex(v), Self::Faces(own)) => {
                kept(own, |face| surface.faces[face as usize].contains(&v))
            }
            (Self::Vertex(v), Self::Vertex(w)) if v == w => self,
            _ => Self::NO,
        }
    }

    /// One of them.
    #[inline]
    fn one(self, surface: &Surface<'_>) -> Option<u32> {
        match self {
            Self::Faces([face, _]) => (face != NONE).then_some(face),
            Self::Vertex(v) => surface.around(v).first().copied(),
        }
    }
}

#[inline]
fn kept([a, b]: [u32; 2], keeps: impl Fn(u32) -> bool) -> Shared {
    let keeps = |face: u32| face != NONE && keeps(face);
    match (keeps(a), keeps(b)) {
        (true, true) => Shared::Faces([a, b]),
        (true, false) => Shared::Faces([a, NONE]),
        (false, true) => Shared::Faces([b, NONE]),
        (false, false) => Shared::NO,
    }
}

/// A triangle that is cut, of which no spoke is to be farther than `aim` if it can be nearer.
#[derive(Clone, Copy)]
pub(super) struct Cut<'c> {
    pub(super) surface: &'c Surface<'c>,
    pub(super) triangle: [DVec3; 3],
    pub(super) aim: f64,
}

/// Lists lent to many calls.
#[derive(Default)]
pub(super) struct Lists {
    /// The loop, which is used up.
    pub(super) rim: Vec<Pair>,
    /// The faces that hold a pair of it and the next one.
    shared: Vec<Shared>,
    piece: Vec<Pair>,
}

impl Cut<'_> {
    /// Cuts a loop of pairs around the triangle into pieces; false if it does not know how. `visit` may have been told some of them all the same.
    pub(super) fn fill(&self, lists: &mut Lists, chain: &mut Lent, visit: &mut dyn FnMut(Piece<'_>)) -> bool {
        self.sector(lists, chain, DEPTH, visit)
    }

    fn sector(&self, lists: &mut Lists, chain: &mut Lent, depth: usize, visit: &mut dyn FnMut(Piece<'_>)) -> bool {
        let Lists { rim, shared, .. } = lists;
        shared.clear();
        let n = rim.len();
        shared.extend((0..n).map(|i| Shared::of(self.surface, [&rim[i].spot, &rim[(i + 1) % n].spot])));
        loop {
            let Some((start, steps, face)) = self.longest_run(&lists.shared) else {
                return self.around_vertex(lists, visit) || (depth > 0 && self.spokes(lists, chain, depth, visit));
            };
            if steps == lists.rim.len() {
                visit(Piece { face, corners: &lists.rim });
                return true;
            }
            if steps < 2 {
                return self.around_vertex(lists, visit) || (depth > 0 && self.spokes(lists, chain, depth, visit));
            }
            self.cut_run(lists, (start, steps, face), visit);
            if lists.rim.len() < 3 {
                return false;
            }
        }
    }

    /// The first of the longest runs of a loop in one face: its start, its steps, and the face.
    #[inline]
    fn longest_run(&self, shared: &[Shared]) -> Option<(usize, usize, u32)> {
        let n = shared.len();
        let mut best = (0, 0, Shared::NO);
        for start in 0..n {
            let (mut common, mut steps) = (shared[start], 0);
            while common != Shared::NO {
                steps += 1;
                if steps > best.1 {
                    best = (start, steps, common);
                }
                if steps == n {
                    break;
                }
                common = common.and(self.surface, shared[(start + steps) % n]);
            }
        }
        Some((best.0, best.1, best.2.one(self.surface)?))
    }

    /// Cuts off a run.
    fn cut_run(&self, lists: &mut Lists, (start, steps, face): (usize, usize, u32), visit: &mut dyn FnMut(Piece<'_>)) {
        let Lists { rim, shared, piece } = lists;
        let n = rim.len();
        piece.clear();
        piece.extend((0..=steps).map(|step| rim[(start + step) % n]));
        visit(Piece { face, corners: piece });
        // All but the ends of the run go: behind its start, and before its end where it runs beyond the list's.
        let end = n.min(start + steps);
        let beyond = start + steps - end;
        rim.drain(start + 1..end);
        shared.drain(start + 1..end);
        rim.drain(..beyond);
        shared.drain(..beyond);
        let start = start - beyond;
        shared[start] = Shared::of(self.surface, [&rim[start].spot, &rim[(start + 1) % rim.len()].spot]);
    }

    /// A vertex of the surface as the image of the nearest place of the triangle.
    fn apex(&self, v: u32) -> Option<Pair> {
        let spot = self.surface.at_vertex(v)?;
        let position = self.surface.position(&spot);
        let place = nearest_of_triangle(&self.triangle, position);
        Some(Pair { place, spot, off: place.distance(position) })
    }

    /// Fills a loop that runs around one vertex of the surface.
    fn around_vertex(&self, lists: &Lists, visit: &mut dyn FnMut(Piece<'_>)) -> bool {
        let Lists { rim, shared, .. } = lists;
        let Some(face) = shared.first().and_then(|shared| shared.one(self.surface)) else { return false };
        for v in self.surface.faces[face as usize] {
            let face = |i: usize| shared[i].and(self.surface, Shared::Vertex(v)).one(self.surface);
            let Some(apex) = self.apex(v).filter(|_| (0..rim.len()).all(|i| face(i).is_some())) else { continue };
            for i in 0..rim.len() {
                if let Some(face) = face(i) {
                    visit(Piece { face, corners: &[apex, rim[i], rim[(i + 1) % rim.len()]] });
                }
            }
            return true;
        }
        false
    }

    /// Fills a loop around more than one vertex: the one that is nearest to the triangle is joined to each pair of the loop.
    fn spokes(&self, lists: &Lists, chain: &mut Lent, depth: usize, visit: &mut dyn FnMut(Piece<'_>)) -> bool {
        let Lists { rim, shared, .. } = lists;
        let is_on_rim = |v: &u32| {
            rim.iter().any(|pair| self.surface.at_vertex(*v).is_some_and(|spot| is_same(self.surface, &spot, &pair.spot)))
        };
        let faces = shared.iter().filter_map(|shared| shared.one(self.surface));
        let vertices = faces.flat_map(|face| self.surface.faces[face as usize]).filter(|v| !is_on_rim(v));
        let Some(apex) = vertices.filter_map(|v| self.apex(v)).min_by(|a, b| a.off.total_cmp(&b.off)) else { return false };
        let mut spokes = Vec::with_capacity(rim.len());
        for pair in rim {
            let mut spoke = Vec::new();
            if !chain::between(self.surface, [&apex, pair], self.aim, chain, &mut spoke) {
                return false;
            }
            spokes.push(spoke);
        }
        let mut sector = Lists::default();
        (0..rim.len()).all(|i| {
            let next = (i + 1) % rim.len();
            sector.rim.clear();
            sector.rim.push(apex);
            sector.rim.extend(&spokes[i]);
            sector.rim.extend([rim[i], rim[next]]);
            sector.rim.extend(spokes[next].iter().rev());
            self.sector(&mut sector, chain, depth - 1, visit)
        })
    }
}

/// Are two spots one place?
fn is_same(surface: &Surface<'_>, a: &Spot, b: &Spot) -> bool {
    surface.within(a, b.face).is_some_and(|shares| shares == b.shares)
}
