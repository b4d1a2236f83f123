//! Self-intersections of a whole file: what the chunks found, added up so that it does not show how the file was cut.
//!
//! Every pair is found by one chunk only, so pairs are simply counted. A triangle may be in pairs of several chunks: one whose corners
//! are all at home in one chunk lies in that chunk's cell and is seen by no other, so the chunk counts it; the numbers of the others are
//! merged. So memory grows with the triangles that lie across seams, not with the pairs.

use crate::fill::cross::Contact;
use crate::report::SelfIntersections;

/// Pairs that are listed: those with the smallest triangle numbers.
pub(crate) const LISTED: usize = 100;

/// Candidate pairs whose contact may be worked out in a file of so many triangles, lest a heap of coincident ones takes forever. A count, so
/// that it depends on the mesh alone. Sound meshes have up to four a triangle, CAD parts with many touching faces ten (measured).
pub(crate) fn most_tested(triangles: u64) -> u64 {
    (1 << 30) + 16 * triangles
}

/// What one chunk, or the whole file, has found.
#[derive(Debug, Default)]
pub(crate) struct Crossings {
    /// Pairs that were tested.
    pub(crate) tested: u64,
    crossing_pairs: u64,
    overlapping_pairs: u64,
    /// Triangles of pairs that only this chunk sees, and the numbers of the others.
    inner: u64,
    across: Vec<u32>,
    /// The smallest pairs, and some more.
    pairs: Vec<[u32; 2]>,
}

impl Crossings {
    /// Bytes held.
    pub(crate) fn heap_bytes(&self) -> u64 {
        4 * self.across.capacity() as u64 + 8 * self.pairs.capacity() as u64
    }

    /// Notes a pair of triangles by number.
    pub(crate) fn add(&mut self, a: u32, b: u32, contact: Contact) {
        match contact {
            Contact::Cross => self.crossing_pairs += 1,
            Contact::Overlap => self.overlapping_pairs += 1,
            Contact::Apart | Contact::Touch => return,
        }
        self.pairs.push([a.min(b), a.max(b)]);
        if self.pairs.len() >= 4 * LISTED {
            self.keep_smallest();
        }
    }

    fn keep_smallest(&mut self) {
        self.pairs.sort_unstable();
        self.pairs.truncate(LISTED);
    }

    /// Ends a chunk's part: so many pairs were `tested`; of the triangles of its pairs, `inner` are seen by this chunk only, those with
    /// the numbers `across` by others, too.
    pub(crate) fn close(&mut self, tested: u64, inner: u64, across: Vec<u32>) {
        self.tested = tested;
        self.keep_smallest();
        self.inner = inner;
        self.across = across;
    }

    /// Adds up the parts of the chunks, which gave up if they tested more than `most` pairs.
    pub(crate) fn sum(parts: impl Iterator<Item = Self>, most: u64) -> SelfIntersections {
        let mut all = Self::default();
        for mut part in parts {
            all.tested += part.tested;
            all.crossing_pairs += part.crossing_pairs;
            all.overlapping_pairs += part.overlapping_pairs;
            all.inner += part.inner;
            all.across.append(&mut part.across);
            all.pairs.append(&mut part.pairs);
            all.keep_smallest();
        }
        if all.tested > most {
            // What was found until then depends on the order of the work.
            return SelfIntersections { given_up: true, ..SelfIntersections::default() };
        }
        all.across.sort_unstable();
        all.across.dedup();
        SelfIntersections {
            triangles: all.inner + all.across.len() as u64,
            crossing_pairs: all.crossing_pairs,
            overlapping_pairs: all.overlapping_pairs,
            listed: all.pairs,
            given_up: false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(tested: u64, pairs: &[[u32; 2]], across: &[u32]) -> Crossings {
        let mut part = Crossings::default();
        pairs.iter().for_each(|[a, b]| part.add(*a, *b, Contact::Cross));
        part.close(tested, 1, across.to_vec());
        part
    }

    #[test]
    fn a_triangle_across_a_seam_counts_once() {
        let sum = Crossings::sum([part(5, &[[9, 2]], &[9]), part(5, &[[9, 4]], &[9])].into_iter(), 10);
        assert_eq!((sum.triangles, sum.crossing_pairs, sum.given_up), (3, 2, false));
        assert_eq!(sum.listed, [[2, 9], [4, 9]], "smaller numbers first");
    }

    #[test]
    fn one_pair_too_many_and_nothing_is_counted() {
        let sum = Crossings::sum([part(5, &[[9, 2]], &[]), part(6, &[], &[])].into_iter(), 10);
        assert_eq!(sum, SelfIntersections { given_up: true, ..SelfIntersections::default() });
        assert!(!sum.is_free());
    }

    #[test]
    fn the_smallest_pairs_are_listed_however_many_there_are() {
        let pairs: Vec<[u32; 2]> = (0..2000).rev().map(|i| [i, i + 5000]).collect();
        let sum = Crossings::sum([part(0, &pairs[..700], &[]), part(0, &pairs[700..], &[])].into_iter(), 1);
        assert_eq!(sum.listed, (0..LISTED as u32).map(|i| [i, i + 5000]).collect::<Vec<_>>());
        assert_eq!(sum.crossing_pairs, 2000);
    }
}
