//! The triangles around each vertex of a chunk, and whether they are one closed coherent fan.
//!
//! Nearly all vertices have at most eight triangles: these have a place of two cache-line halves each, so that no pass is needed to
//! count them first, and a corner is compared with all others at once. What is around the others is laid out one after another.

use std::cmp::Ordering;

use crate::geometry::axis::Axis;
use crate::geometry::exact::Point;
use crate::util::ids::NONE;

/// Most triangles of a short star.
const SHORT: usize = 8;

/// (next, previous) corner of each triangle around a vertex.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Ring {
    next: [u32; SHORT],
    previous: [u32; SHORT],
}

/// A vertex with very many triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hub {
    triangles: u32,
    at: Point,
}

/// Triangles around a hub, at least.
const MANY: u32 = 257;

/// The line through the two of all hubs that have the most triangles, and of equal ones the smallest positions.
pub(crate) fn line_of_hubs(hubs: impl Iterator<Item = Hub>) -> Option<Axis> {
    match largest(hubs.collect())[..] {
        [first, second] => Axis::through([first.at, second.at]),
        _ => None,
    }
}

/// Two at most, the largest first. No two hubs are at one place.
fn largest(mut hubs: Vec<Hub>) -> Vec<Hub> {
    hubs.sort_unstable_by(|a, b| {
        let by_place = a.at.iter().zip(&b.at).map(|(p, q)| p.total_cmp(q)).find(|order| order.is_ne());
        b.triangles.cmp(&a.triangles).then(by_place.unwrap_or(Ordering::Equal))
    });
    hubs.truncate(2);
    hubs
}

/// The stars of the vertices of one chunk. Keeps its memory from chunk to chunk.
#[derive(Default)]
pub(crate) struct Stars {
    /// Triangles around each vertex.
    counts: Vec<u32>,
    /// The ring around each vertex. Entries beyond a vertex's count are left from another chunk.
    rings: Vec<Ring>,
    /// Where a long star begins in `next` and `previous`.
    starts: Vec<u32>,
    next: Vec<u32>,
    previous: Vec<u32>,
    /// Scratch of the test of a long star, by vertex.
    places: Vec<u32>,
}

/// Bytes for each vertex, and for each triangle of long stars, at most.
pub(crate) const BYTES_PER_VERTEX: u64 = (size_of::<Ring>() + 3 * size_of::<u32>()) as u64;
pub(crate) const BYTES_PER_TRIANGLE: u64 = 3 * 2 * size_of::<u32>() as u64;

impl Stars {
    /// Gathers the corners around each of `vertices` vertices, in the order of `triangles`; those that have `NONE` first are left out.
    #[inline(always)]
    pub(crate) fn gather(&mut self, vertices: usize, triangles: &[[u32; 3]]) {
        self.counts.clear();
        self.counts.resize(vertices, 0);
        if self.rings.len() < vertices {
            self.rings.resize(vertices, Ring { next: [NONE; SHORT], previous: [NONE; SHORT] });
        }
        let (counts, rings) = (&mut self.counts[..vertices], &mut self.rings[..vertices]);
        for t in triangles.iter().filter(|t| t[0] != NONE) {
            for k in 0..3 {
                let v = t[k] as usize;
                // A long star goes round and round; it is gathered again below.
                let at = counts[v] as usize % SHORT;
                rings[v].next[at] = t[(k + 1) % 3];
                rings[v].previous[at] = t[(k + 2) % 3];
                counts[v] += 1;
            }
        }
        if self.counts.iter().fold(0, |most, n| most.max(*n)) > SHORT as u32 {
            self.gather_long(triangles);
        }
    }

    fn gather_long(&mut self, triangles: &[[u32; 3]]) {
        self.starts.clear();
        let mut total = 0;
        self.starts.extend(self.counts.iter().map(|n| {
            let start = total;
            total += if *n > SHORT as u32 { *n } else { 0 };
            start
        }));
        self.next.clear();
        self.next.resize(total as usize, 0);
        self.previous.clear();
        self.previous.resize(total as usize, 0);
        self.places.clear();
        self.places.resize(self.counts.len(), 0);
        for t in triangles.iter().filter(|t| t[0] != NONE) {
            for k in 0..3 {
                let v = t[k] as usize;
                if self.counts[v] > SHORT as u32 {
                    let at = (self.starts[v] + self.places[v]) as usize;
                    self.next[at] = t[(k + 1) % 3];
                    self.previous[at] = t[(k + 2) % 3];
                    self.places[v] += 1;
                }
            }
        }
    }

    /// Triangles around `v`.
    #[inline]
    pub(crate) fn count(&self, v: usize) -> usize {
        self.counts[v] as usize
    }

    /// The two largest of the hubs that are `wanted`.
    pub(crate) fn hubs(&self, positions: &[Point], wanted: impl Fn(usize) -> bool) -> Vec<Hub> {
        let many = self.counts.iter().zip(positions).enumerate().filter(|(v, (n, _))| **n >= MANY && wanted(*v));
        largest(many.map(|(_, (triangles, at))| Hub { triangles: *triangles, at: *at }).collect())
    }

    /// The next and the previous corner of each triangle around `v`, in the order of the triangles.
    #[inline]
    pub(crate) fn around(&self, v: usize) -> (&[u32], &[u32]) {
        let n = self.count(v);
        if n <= SHORT {
            return (&self.rings[v].next[..n], &self.rings[v].previous[..n]);
        }
        let start = self.starts[v] as usize;
        (&self.next[start..start + n], &self.previous[start..start + n])
    }

    /// Whether the triangles around `v` form a single cycle of at least three in which no corner stands twice: each one's previous
    /// corner is exactly one other's next. `places` is one of the functions that tell where a corner stands in a ring.
    #[inline(always)]
    pub(crate) fn is_closed_fan(&mut self, v: usize, places: impl Fn(&Ring, u32) -> u32) -> bool {
        match self.count(v) {
            0..3 => false,
            n @ 3..=SHORT => short_fan_is_closed(&self.rings[v], n, places),
            n => {
                let start = self.starts[v] as usize;
                long_fan_is_closed(&self.next[start..start + n], &self.previous[start..start + n], &mut self.places)
            }
        }
    }
}

impl Ring {
    /// Bit k: `corner` is the next one of triangle k.
    #[inline(always)]
    pub(crate) fn places(&self, corner: u32) -> u32 {
        (0..SHORT).fold(0, |mask, k| mask | u32::from(self.next[k] == corner) << k)
    }

    /// The same.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    #[inline]
    pub(crate) fn places_avx2(&self, corner: u32) -> u32 {
        use std::arch::x86_64::{
            _mm256_castsi256_ps, _mm256_cmpeq_epi32, _mm256_loadu_si256, _mm256_movemask_ps, _mm256_set1_epi32,
        };
        // SAFETY: it reads the 32 bytes of the array.
        let next = unsafe { _mm256_loadu_si256(self.next.as_ptr().cast()) };
        _mm256_movemask_ps(_mm256_castsi256_ps(_mm256_cmpeq_epi32(next, _mm256_set1_epi32(corner.cast_signed())))).cast_unsigned()
    }
}

/// Goes round: which triangle's next corner is the previous one of this?
#[inline(always)]
fn short_fan_is_closed(ring: &Ring, n: usize, places: impl Fn(&Ring, u32) -> u32) -> bool {
    let all = (1u32 << n) - 1;
    let (mut at, mut seen, mut several, mut equal) = (0, 0, 0, 0);
    for _ in 0..n {
        equal = places(ring, ring.previous[at]) & all;
        several |= equal & equal.wrapping_sub(1);
        seen |= equal;
        // None (a boundary) goes back to 0, and then either not all are seen or the last step is not the one that comes home.
        at = equal.trailing_zeros() as usize % SHORT;
    }
    (seen == all) & (several == 0) & (equal == 1)
}

/// The same with `places[next corner]` = triangle; what stands there from before is told by looking back. O(triangles).
fn long_fan_is_closed(next: &[u32], previous: &[u32], places: &mut [u32]) -> bool {
    let holder = |places: &[u32], corner: u32| {
        let at = places[corner as usize] as usize;
        (next.get(at) == Some(&corner)).then_some(at)
    };
    for (i, corner) in next.iter().enumerate() {
        if holder(places, *corner).is_some_and(|at| at < i) {
            return false;
        }
        places[*corner as usize] = i as u32;
    }
    let mut at = 0;
    for step in 1..=next.len() {
        match holder(places, previous[at]) {
            Some(successor) => at = successor,
            None => return false,
        }
        if at == 0 {
            return step == next.len();
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (next, previous) corners of `n` triangles around a vertex, numbered from `from`, in an order that is not the cycle's.
    fn fan(n: u32, from: u32) -> Vec<[u32; 2]> {
        (0..n).map(|i| i * 7 % n).map(|i| [from + i, from + (i + 1) % n]).collect()
    }

    /// Whether the star of a vertex with these (next, previous) corners around it is one closed fan.
    fn is_closed_fan(around: &[[u32; 2]]) -> bool {
        let v = 1 + around.iter().flatten().max().unwrap();
        let triangles: Vec<[u32; 3]> = around.iter().map(|[next, previous]| [v, *next, *previous]).collect();
        let mut stars = Stars::default();
        stars.gather(v as usize + 1, &triangles);
        let (next, previous) = stars.around(v as usize);
        assert!(next.iter().zip(previous).map(|(n, p)| [*n, *p]).eq(around.iter().copied()));
        let regular = stars.is_closed_fan(v as usize, Ring::places);
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has AVX2.
            assert_eq!(stars.is_closed_fan(v as usize, |ring, corner| unsafe { ring.places_avx2(corner) }), regular);
        }
        regular
    }

    /// On both sides of the border between the two ways of testing, which is at eight.
    const SIZES: [u32; 4] = [3, 8, 9, 30];

    #[test]
    fn a_closed_fan_is_regular() {
        for n in SIZES {
            assert!(is_closed_fan(&fan(n, 0)), "{n}");
        }
        assert!(!is_closed_fan(&fan(2, 0)), "two triangles back to back enclose nothing");
    }

    #[test]
    fn a_fan_with_one_fault_is_not() {
        for n in SIZES {
            // A gap, wherever it is.
            for i in 0..n as usize {
                let mut missing = fan(n, 0);
                missing.remove(i);
                assert!(!is_closed_fan(&missing), "missing {i} of {n}");
            }
            // An edge of three triangles.
            let mut doubled = fan(n, 0);
            doubled.push(doubled[1]);
            assert!(!is_closed_fan(&doubled), "doubled of {n}");
            // Two edges whose triangles disagree.
            let mut turned = fan(n, 0);
            turned[1].reverse();
            assert!(!is_closed_fan(&turned), "reversed of {n}");
        }
    }

    #[test]
    fn the_two_largest_hubs_are_found() {
        let hub = |triangles: u32, x: f32| Hub { triangles, at: [1.0, x, 0.0] };
        let all = [hub(300, 5.0), hub(400, 2.0), hub(500, 3.0), hub(400, -2.0)];
        assert_eq!(largest(all.to_vec()), [hub(500, 3.0), hub(400, -2.0)]);
        assert!(line_of_hubs(all.into_iter()).is_some() && line_of_hubs(all.into_iter().take(1)).is_none());
        for (n, wanted) in [(256, 0), (257, 1)] {
            let triangles: Vec<[u32; 3]> = fan(n, 1).iter().map(|[next, previous]| [0, *next, *previous]).collect();
            let mut stars = Stars::default();
            stars.gather(n as usize + 2, &triangles);
            let positions: Vec<Point> = (0..n + 2).map(|v| [v as f32, 0.0, 0.0]).collect();
            assert_eq!(stars.hubs(&positions, |_| true).len(), wanted);
            assert_eq!(stars.hubs(&positions, |v| v > 0), []);
        }
    }

    #[test]
    fn two_cycles_through_one_vertex_are_not() {
        // Each triangle has exactly one after it, but it is two fans (a bow-tie): only going round tells.
        for (n, m) in [(3, 3), (4, 4), (3, 6), (15, 15)] {
            let both = [fan(n, 0), fan(m, n)].concat();
            assert!(!is_closed_fan(&both), "{n} and {m}");
        }
        // Both cycles go through corner 0: an edge of four triangles.
        let shared = [fan(5, 0), fan(5, 5).iter().map(|t| t.map(|v| if v == 5 { 0 } else { v })).collect()].concat();
        assert!(!is_closed_fan(&shared));
    }
}
