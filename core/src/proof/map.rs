//! The map of the triangles of one surface onto the other, block by block.
//!
//! Facts of a block do not depend on other blocks; areas are summed up in whole numbers.

use std::sync::atomic::{AtomicI64, Ordering};

use crate::geometry::distance::place;
use crate::proof::chain::{self, Lent, Pair};
use crate::proof::fill::{Cut, Lists, Piece};
use crate::proof::pairing::Pairing;
use crate::proof::rim::{self, Rims};
use crate::proof::surface::{Spot, Surface};
use crate::proof::ways::Ways;

/// The unit of sums of areas, as a share of a face: whole numbers, whose sum does not depend on their order.
const UNIT: f64 = (1_u64 << 40) as f64;

/// Triangles that a thread takes at once.
pub(super) const BLOCK: usize = 1 << 12;

/// Facts of a block of triangles.
#[derive(Default)]
pub(super) struct Found {
    pub(super) farthest: f64,
    pub(super) failed: Vec<u32>,
    /// Faces in which the rim of failed triangles runs, or what is too far goes.
    pub(super) rims: Vec<u32>,
}

/// Is a sum of areas a degree that is not zero?
pub(super) fn covers(sum: i64) -> bool {
    let degree = sum as f64 / UNIT;
    degree.round() != 0.0 && (degree - degree.round()).abs() < 0.01
}

/// All that a triangle is mapped by.
pub(super) struct Map<'m> {
    pub(super) surface: &'m Surface<'m>,
    pub(super) pairing: &'m Pairing<'m>,
    pub(super) images: &'m [Option<(Spot, f64)>],
    pub(super) rim: &'m Rims,
    pub(super) covered: &'m [AtomicI64],
    pub(super) aim: f64,
    /// The triangles that are asked about, if not all: the others only cover faces.
    pub(super) asked: Option<&'m [bool]>,
}

/// Lists lent to many triangles.
#[derive(Default)]
struct Scratch {
    chain: Lent,
    ways: Ways,
    lists: Lists,
    /// Polygons: their faces, and the ends of their spots in the list.
    pieces: Vec<(u32, usize)>,
    spots: Vec<Spot>,
}

impl Map<'_> {
    /// Maps a block of triangles.
    pub(super) fn block(&self, block: usize) -> Found {
        let (mut found, mut lent) = (Found::default(), Scratch::default());
        for f in block * BLOCK..self.pairing.faces.len().min((block + 1) * BLOCK) {
            let failed = found.failed.len();
            self.triangle(f, &mut lent, &mut found);
            if self.asked.is_some_and(|asked| !asked[f]) {
                found.failed.truncate(failed);
            }
        }
        found
    }

    /// Maps one triangle.
    #[inline]
    fn triangle(&self, f: usize, lent: &mut Scratch, found: &mut Found) {
        let face = self.pairing.faces[f];
        let [Some(a), Some(b), Some(c)] = face.map(|v| self.images[v as usize]) else {
            found.failed.push(f as u32);
            return;
        };
        let farthest = a.1.max(b.1).max(c.1);
        if let Some(common) = self.surface.common([&a.0, &b.0, &c.0]).filter(|_| self.keeps_rim(face, [a.0, b.0, c.0])) {
            add(self.surface, self.covered, common, &[a.0, b.0, c.0]);
            if farthest > self.aim {
                found.failed.push(f as u32);
                found.rims.push(common);
            } else {
                found.farthest = found.farthest.max(farthest);
            }
        } else if let Some((lone, pairs)) = self.over_edge(face, &[a, b, c]) {
            self.in_two([a, b, c], (lone, pairs), f as u32, found);
        } else {
            self.across(f as u32, (face, &[a, b, c]), lent, found);
        }
    }

    /// Do the sides that are of the rim go onto edges?
    fn keeps_rim(&self, face: [u32; 3], spots: [Spot; 3]) -> bool {
        let goes_inside = |k: usize| {
            let next = (k + 1) % 3;
            self.rim.has(face[k], face[next]) && !rim::on_edge(self.surface, &[spots[k], spots[next]])
        };
        !(0..3).any(goes_inside)
    }

    /// Where a triangle goes into the insides of two neighbouring faces, by one edge as near as is aimed at: its corner in the one, and the pairs on
    /// the sides after and before that corner. The same ones as the search for a way finds; most triangles that go into more than one face are such.
    #[inline]
    fn over_edge(&self, face: [u32; 3], spots: &[(Spot, f64); 3]) -> Option<(usize, [Pair; 2])> {
        let of = |k: usize| spots[k % 3].0.face;
        let lone = (0..3).find(|k| of(k + 1) == of(k + 2))?;
        if !spots.iter().all(|spot| spot.0.is_inner()) || (0..3).any(|k| self.rim.has(face[k], face[(k + 1) % 3])) {
            return None;
        }
        let pair = |k: usize| {
            let k = k % 3;
            Pair { place: place(self.pairing.points[face[k] as usize]), spot: spots[k].0, off: spots[k].1 }
        };
        let side = |k: usize| {
            let (from, to) = if face[k % 3] > face[(k + 1) % 3] { (k + 1, k) } else { (k, k + 1) };
            chain::over(self.surface, [&pair(from), &pair(to)], self.aim)
        };
        Some((lone, [side(lone)?, side(lone + 2)?]))
    }

    /// Maps a triangle that goes over one edge.
    #[inline]
    fn in_two(&self, spots: [(Spot, f64); 3], (lone, [after, before]): (usize, [Pair; 2]), f: u32, found: &mut Found) {
        let [own, next, last] = [lone, lone + 1, lone + 2].map(|k| spots[k % 3]);
        add(self.surface, self.covered, own.0.face, &[own.0, after.spot, before.spot]);
        add(self.surface, self.covered, next.0.face, &[after.spot, next.0, last.0, before.spot]);
        let farthest = [own.1, next.1, last.1, after.off, before.off].into_iter().fold(0.0, f64::max);
        if farthest <= self.aim {
            found.farthest = found.farthest.max(farthest);
        } else {
            found.failed.push(f);
            found.rims.extend([own.0.face, next.0.face]);
        }
    }

    /// Maps a triangle that does not go into one face.
    fn across(&self, f: u32, of: ([u32; 3], &[(Spot, f64); 3]), lent: &mut Scratch, found: &mut Found) {
        let Scratch { pieces, spots, .. } = lent;
        pieces.clear();
        spots.clear();
        let farthest = self.cut(of, lent, found);
        if farthest.is_none() {
            found.failed.push(f);
            self.rims(of, &mut lent.chain, &mut found.rims);
            return;
        }
        let mut start = 0;
        for (face, end) in &lent.pieces {
            add(self.surface, self.covered, *face, &lent.spots[start..*end]);
            start = *end;
        }
        match farthest.filter(|d| *d <= self.aim) {
            Some(d) => found.farthest = found.farthest.max(d),
            None => {
                // It covers what it covers, but from too far.
                found.failed.push(f);
                found.rims.extend(lent.pieces.iter().map(|piece| piece.0));
            }
        }
    }

    /// Appends what is between two ends of a side; false if there is no way. Where the rim goes into faces, these are named.
    fn side(
        &self,
        ([from, to], is_rim): ([&Pair; 2], bool),
        chain: &mut Lent,
        out: &mut Vec<Pair>,
        inside: &mut Vec<u32>,
    ) -> bool {
        if is_rim && rim::between(self.surface, [from, to], out) {
            return true;
        }
        let start = out.len();
        if !chain::between(self.surface, [from, to], self.aim, chain, out) {
            return false;
        }
        if is_rim {
            inside.extend(self.faces_along([from, to], &out[start..]));
        }
        true
    }

    /// The faces from one spot to the next.
    fn faces_along(&self, [from, to]: [&Pair; 2], between: &[Pair]) -> Vec<u32> {
        let mut spots = vec![from.spot];
        spots.extend(between.iter().map(|pair| pair.spot));
        spots.push(to.spot);
        spots.array_windows().filter_map(|[a, b]| self.surface.common([a, b])).collect()
    }

    /// Cuts a triangle that does not go into one face into pieces, in `lent`; returns how far its farthest corner or cut goes, if it can be mapped.
    fn cut(&self, (face, spots): ([u32; 3], &[(Spot, f64); 3]), lent: &mut Scratch, found: &mut Found) -> Option<f64> {
        let Scratch { chain, ways, lists, pieces, spots: all } = lent;
        let rim = &mut lists.rim;
        rim.clear();
        let corners = corners(self.pairing, face, spots);
        for k in 0..3 {
            rim.push(corners[k]);
            let start = rim.len();
            let (side, turned) = side_of(face, k);
            let ends = side.map(|k| face[k]);
            let is_rim = self.rim.has(ends[0], ends[1]);
            if let Some(pairs) = ways.of(ends) {
                rim.extend_from_slice(pairs);
            } else if !self.side((side.map(|k| &corners[k]), is_rim), chain, rim, &mut found.rims) {
                return None;
            } else if !is_rim {
                // Of the rim there is no triangle beyond.
                ways.keep(ends, &rim[start..]);
            }
            if turned {
                rim[start..].reverse();
            }
        }
        let triangle = face.map(|v| place(self.pairing.points[v as usize]));
        let mut farthest = 0.0_f64;
        let cut = Cut { surface: self.surface, triangle, aim: self.aim };
        let is_mapped = cut.fill(lists, chain, &mut |part: Piece<'_>| {
            all.extend(part.corners.iter().map(|pair| pair.spot));
            farthest = part.corners.iter().map(|pair| pair.off).fold(farthest, f64::max);
            pieces.push((part.face, all.len()));
        });
        is_mapped.then_some(farthest)
    }

    /// The faces in which the sides of a triangle run.
    fn rims(&self, (face, spots): ([u32; 3], &[(Spot, f64); 3]), lent: &mut Lent, out: &mut Vec<u32>) {
        let corners = corners(self.pairing, face, spots);
        for k in 0..3 {
            let ends = side_of(face, k).0.map(|k| &corners[k]);
            let mut between = Vec::new();
            // Where there is no way, the triangle beyond fails as well, and no rim runs there.
            if chain::between(self.surface, ends, self.aim, lent, &mut between) {
                out.extend(self.faces_along(ends, &between));
            }
        }
    }
}

/// Adds the signed area of a polygon in a face, as a share of that of the face.
fn add(surface: &Surface<'_>, covered: &[AtomicI64], face: u32, spots: &[Spot]) {
    let mut sum = 0.0;
    let (mut first, mut last): (Option<[f64; 3]>, Option<[f64; 3]>) = (None, None);
    for shares in spots.iter().filter_map(|spot| surface.within(spot, face)) {
        if let Some(before) = last {
            sum += before[1] * shares[2] - before[2] * shares[1];
        } else {
            first = Some(shares);
        }
        last = Some(shares);
    }
    if let (Some(first), Some(last)) = (first, last) {
        sum += last[1] * first[2] - last[2] * first[1];
    }
    covered[face as usize].fetch_add((sum * UNIT) as i64, Ordering::Relaxed);
}

/// The corners of a triangle, and their images. They are of some size: sides name them by their numbers.
#[inline]
fn corners(pairing: &Pairing<'_>, face: [u32; 3], spots: &[(Spot, f64); 3]) -> [Pair; 3] {
    [0, 1, 2].map(|k: usize| Pair { place: place(pairing.points[face[k] as usize]), spot: spots[k].0, off: spots[k].1 })
}

/// The ends of a side of a triangle, with the smaller vertex first, and whether that turns them round.
#[inline]
fn side_of(face: [u32; 3], k: usize) -> ([usize; 2], bool) {
    let next = (k + 1) % 3;
    if face[k] > face[next] { ([next, k], true) } else { ([k, next], false) }
}
