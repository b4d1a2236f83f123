//! The exact weld: a vertex is a position, −0.0 and 0.0 being one.

use crate::util::ids::NONE;
use glam::Vec4;

use crate::geometry::position::{bits, canonical};
use crate::io::record::Point;

/// Vertices by position, numbered from 0 by first appearance. A hash table of buckets of four positions, each a cache line, all
/// four compared at once: nearly every look-up ends in the first bucket, without a branch that depends on which of the four it is.
#[derive(Default)]
pub(crate) struct Weld {
    buckets: Vec<Bucket>,
    positions: Vec<Point>,
    /// The number of buckets is 2^(64 − this).
    shift: u32,
}

/// Most positions that are looked up at once.
pub(crate) const BATCH: usize = 48;

/// Positions by axis, filled from the front. One whose last place is free ends a search.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct Bucket {
    x: Vec4,
    y: Vec4,
    z: Vec4,
    vertex: [u32; LANES],
}

const LANES: usize = 4;
/// NaN is equal to nothing.
const FREE: Bucket = Bucket { x: Vec4::NAN, y: Vec4::NAN, z: Vec4::NAN, vertex: [NONE; LANES] };

impl Bucket {
    /// Bit k: `p` stands in place k.
    #[inline(always)]
    fn places_of(&self, p: Point) -> u32 {
        let (x, y, z) = (Vec4::splat(p[0]), Vec4::splat(p[1]), Vec4::splat(p[2]));
        (self.x.cmpeq(x) & self.y.cmpeq(y) & self.z.cmpeq(z)).bitmask()
    }

    /// Takes a vertex in where there is room.
    #[inline(always)]
    fn put(&mut self, p: Point, vertex: u32) -> bool {
        // Counted, not looked for: which place it is cannot be foreseen.
        let k = self.vertex.iter().map(|v| usize::from(*v != NONE)).sum::<usize>();
        if k == LANES {
            return false;
        }
        (self.x[k], self.y[k], self.z[k], self.vertex[k]) = (p[0], p[1], p[2], vertex);
        true
    }
}

impl Weld {
    /// Forgets everything and makes room for about `vertices` (it grows when there are more). Keeps its memory.
    pub(crate) fn reset(&mut self, vertices: usize) {
        self.positions.clear();
        self.resize((vertices.max(64) * 3 / 2).next_power_of_two() / LANES);
    }

    /// The vertex at a finite position.
    pub(crate) fn vertex(&mut self, p: Point) -> u32 {
        self.reserve(1);
        let position = canonical(p);
        let bucket = self.bucket_of(position);
        self.probe(position, bucket).unwrap_or_else(|bucket| self.insert(bucket, position))
    }

    /// The vertices at finite positions, at most [`BATCH`] of them, to `vertices`. The table's lines are asked for before they are
    /// looked at, since most of them are in the second-level cache only.
    #[inline(always)]
    pub(crate) fn vertices(&mut self, points: &[Point], vertices: &mut [u32]) {
        self.reserve(points.len());
        let buckets = self.asked_for(points);
        for ((p, bucket), vertex) in points.iter().zip(buckets).zip(vertices) {
            let position = canonical(*p);
            *vertex = match self.probe(position, bucket) {
                Ok(vertex) => vertex,
                Err(bucket) => self.insert(bucket, position),
            };
        }
    }

    /// The buckets where searches for positions begin, at most [`BATCH`] of them; their lines are on the way.
    #[inline(always)]
    fn asked_for(&self, points: &[Point]) -> [usize; BATCH] {
        let mut buckets = [0; BATCH];
        for (p, bucket) in points.iter().zip(&mut buckets) {
            *bucket = self.bucket_of(canonical(*p));
            prefetch(&self.buckets[*bucket]);
        }
        buckets
    }

    /// The vertices at positions, at most [`BATCH`] of them, to `vertices`; [`NONE`] where there is none.
    pub(crate) fn find_all(&self, points: &[Point], vertices: &mut [u32]) {
        let buckets = self.asked_for(points);
        for ((p, bucket), vertex) in points.iter().zip(buckets).zip(vertices) {
            *vertex = self.probe(canonical(*p), bucket).unwrap_or(NONE);
        }
    }

    /// The vertex at a position, if there is one.
    #[inline]
    pub(crate) fn find(&self, p: Point) -> Option<u32> {
        let position = canonical(p);
        self.probe(position, self.bucket_of(position)).ok()
    }

    /// The vertex at a canonical position, or the bucket where it would go. The search begins at the bucket it belongs in.
    #[inline(always)]
    fn probe(&self, position: Point, mut at: usize) -> Result<u32, usize> {
        loop {
            let bucket = &self.buckets[at];
            let places = bucket.places_of(position);
            if places != 0 {
                return Ok(bucket.vertex[places.trailing_zeros() as usize % LANES]);
            }
            if bucket.vertex[LANES - 1] == NONE {
                return Err(at);
            }
            at = (at + 1) & (self.buckets.len() - 1);
        }
    }

    /// Adds a vertex where [`Self::probe`] said, for which room was made.
    #[inline(always)]
    fn insert(&mut self, bucket: usize, position: Point) -> u32 {
        let vertex = self.positions.len() as u32;
        self.buckets[bucket].put(position, vertex);
        self.positions.push(position);
        vertex
    }

    /// Makes room for so many vertices more. At most two places of three are filled.
    #[inline]
    fn reserve(&mut self, vertices: usize) {
        if (self.positions.len() + vertices) * 3 > self.buckets.len() * LANES * 2 {
            self.grow();
        }
    }

    #[cold]
    fn grow(&mut self) {
        let size = (self.buckets.len() * 2).max(BATCH);
        self.resize(size);
        for (vertex, position) in self.positions.iter().enumerate() {
            let mut at = self.bucket_of(*position);
            while !self.buckets[at].put(*position, vertex as u32) {
                at = (at + 1) & (size - 1);
            }
        }
    }

    /// Makes `size` empty buckets, a power of two.
    fn resize(&mut self, size: usize) {
        self.buckets.clear();
        self.buckets.resize(size, FREE);
        self.shift = 64 - size.trailing_zeros();
    }

    /// Where the search for a canonical position begins.
    #[inline(always)]
    fn bucket_of(&self, p: Point) -> usize {
        let [x, y, z] = bits(p).map(u64::from);
        let h = (x | y << 32).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ z.wrapping_mul(0xC2B2_AE3D_27D4_EB4F);
        let h = (h ^ h >> 32).wrapping_mul(0xD6E8_FEB8_6659_FD93);
        (h >> self.shift) as usize
    }

    /// Positions by vertex number.
    pub(crate) fn positions(&self) -> &[Point] {
        &self.positions
    }

    /// Gives the positions away.
    pub(crate) fn into_positions(self) -> Vec<Point> {
        self.positions
    }
}

/// A set of positions that is asked often and seldom holds what is asked for: a bit for each hash.
#[derive(Default)]
pub(crate) struct Sieve {
    bits: Vec<u64>,
}

impl Sieve {
    /// Holds these positions from now on, and no others. Most that are asked for should not be among the first thousands.
    pub(crate) fn fill(&mut self, positions: impl Iterator<Item = Point>) {
        self.bits.clear();
        self.bits.resize((1 << Self::BITS) / 64, 0);
        positions.map(Self::place).for_each(|(word, bit)| self.bits[word] |= 1 << bit);
    }

    /// False only if none of the corners is held.
    #[inline(always)]
    pub(crate) fn may_hold(&self, corners: &[Point; 3]) -> bool {
        let bit = |p: Point| {
            let (word, bit) = Self::place(p);
            self.bits[word] >> bit
        };
        (bit(corners[0]) | bit(corners[1]) | bit(corners[2])) & 1 == 1
    }

    /// 8 KiB: stays in the nearest cache.
    const BITS: u32 = 16;

    #[inline(always)]
    fn place(p: Point) -> (usize, u32) {
        let [x, y, z] = bits(canonical(p));
        let h = x.wrapping_mul(0x9E37_79B1) ^ y.wrapping_mul(0x85EB_CA77) ^ z.wrapping_mul(0xC2B2_AE3D);
        let h = (h ^ h >> 15).wrapping_mul(0x2C1B_3C6D) >> (32 - Self::BITS);
        (h as usize / 64, h % 64)
    }
}

/// Asks the processor for what will be read soon.
#[inline(always)]
fn prefetch<T>(what: &T) {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: a hint, which reads nothing and cannot fail.
    unsafe {
        std::arch::x86_64::_mm_prefetch::<{ std::arch::x86_64::_MM_HINT_T0 }>(std::ptr::from_ref(what).cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = what;
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// As a map of positions would have it, through growth, full buckets and both zeros.
        #[test]
        fn a_vertex_is_a_position(points in prop::collection::vec(prop::array::uniform3(-4i8..4), 0..700)) {
            let (mut weld, mut known) = (Weld::default(), HashMap::new());
            weld.reset(0);
            for p in &points {
                let next = known.len() as u32;
                let want = *known.entry(*p).or_insert(next);
                let position = p.map(|x| if x == 0 { -0.0 } else { f32::from(x) });
                prop_assert_eq!(weld.find(position), (want != next).then_some(want));
                prop_assert_eq!(weld.vertex(position), want);
                prop_assert_eq!(weld.find(p.map(f32::from)), Some(want));
            }
            let mut sieve = Sieve::default();
            sieve.fill(weld.positions().iter().copied());
            let signed = |p: &[i8; 3]| p.map(|x| if x == 0 { -0.0 } else { f32::from(x) });
            let all_held = points.iter().all(|p| sieve.may_hold(&[[9.0; 3], [9.0; 3], signed(p)]));
            prop_assert!(all_held);
            prop_assert_eq!(weld.positions().len(), known.len());
            prop_assert!(weld.positions().iter().flatten().all(|x| x.to_bits() != (-0f32).to_bits()));
        }
    }
}
