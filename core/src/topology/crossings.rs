//! Self-intersections of a whole file: what the chunks found, added up so that it does not show how the file was cut.
//!
//! Every pair is found by one chunk only, so pairs are simply counted. A triangle may be in pairs of several chunks: one whose corners
//! are all at home in one chunk lies in that chunk's cell and is seen by no other, so the chunk counts it; the numbers of the others are
//! merged. So memory grows with the triangles that lie across seams, not with the pairs.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::contract::report::SelfIntersections;
use crate::geometry::tri_tri::Contact;

/// Pairs that are listed: those with the smallest triangle numbers.
pub(crate) const LISTED: usize = 100;

/// Candidate pairs whose contact may be worked out in a file of so many triangles, lest a heap of coincident ones takes forever. A count, so
/// that it depends on the mesh alone. Regular meshes have up to four a triangle, CAD parts with many touching faces ten (measured).
pub(crate) fn most_tested(triangles: u64) -> u64 {
    (1 << 30) + 16 * triangles
}

/// Candidate pairs after which boxes are said to select badly: what was found until then is dropped, and the search begins anew with
/// [slabs](crate::topology::intersect) beside the boxes, which select fewer. So what is found does not depend on this number.
pub(crate) fn many_tested(triangles: u64) -> u64 {
    (1 << 22) + 16 * triangles
}

/// Most pairs of a file that are kept for the second look, of twelve bytes each.
const MOST_KEPT: usize = 1 << 20;

/// A pair of triangles that cross or overlap, by number, the smaller one first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Pair {
    pub(crate) triangles: [u32; 2],
    pub(crate) contact: Contact,
}

/// The crossings of one chunk, or of the whole file.
#[derive(Debug, Default)]
pub(crate) struct Crossings {
    /// Pairs that were tested.
    pub(crate) tested: u64,
    crossing_pairs: u64,
    overlapping_pairs: u64,
    /// Triangles of pairs that only this chunk sees, and the numbers of the others.
    inner: u64,
    across: Vec<u32>,
    /// All pairs, or if they are too many, the smallest and some more.
    pairs: Vec<Pair>,
    /// Larger ones are of no interest.
    most: Option<[u32; 2]>,
}

impl Crossings {
    /// Bytes held, and as many in the merge.
    pub(crate) fn seam_bytes(&self) -> u64 {
        2 * (4 * self.across.capacity() as u64 + (size_of::<Pair>() * self.pairs.capacity()) as u64)
    }

    /// Notes the pairs of one of `some` triangles with one of `others`, or if there are none of these, of each two of the first; both
    /// are places in `numbers`, and ascend there. Constant time once there are many pairs with smaller numbers.
    pub(crate) fn add(&mut self, some: &[u32], others: &[u32], numbers: &[u32], contact: Contact) {
        let [n, m] = [some.len() as u64, others.len() as u64];
        let pairs = if others.is_empty() { n * (n - 1) / 2 } else { n * m };
        match contact {
            Contact::Cross => self.crossing_pairs += pairs,
            Contact::Overlap => self.overlapping_pairs += pairs,
            Contact::Apart | Contact::Touch => return,
        }
        // If there are too many to keep, those to be listed are among the first of each.
        let most = if self.count() > MOST_KEPT as u64 { LISTED + 1 } else { usize::MAX };
        for (k, a) in some.iter().take(most).enumerate() {
            let others = if others.is_empty() { &some[k + 1..] } else { others };
            for (l, b) in others.iter().take(most).enumerate() {
                let [a, b] = [numbers[*a as usize], numbers[*b as usize]];
                let triangles = [a.min(b), a.max(b)];
                if self.most.is_some_and(|most| triangles > most) {
                    if l == 0 {
                        return;
                    }
                    break;
                }
                self.pairs.push(Pair { triangles, contact });
            }
        }
        if self.pairs.len() > 2 * MOST_KEPT {
            self.keep_smallest(LISTED);
            self.most = self.pairs.last().map(|pair| pair.triangles);
        }
    }

    fn keep_smallest(&mut self, most: usize) {
        self.pairs.sort_unstable_by_key(|pair| pair.triangles);
        self.pairs.truncate(most);
    }

    fn count(&self) -> u64 {
        self.crossing_pairs + self.overlapping_pairs
    }

    /// Counts the pairs of a chunk, and lets go of what is neither listed nor kept if all chunks have `found` too many to keep.
    pub(crate) fn keep(&mut self, found: &AtomicU64) {
        if found.fetch_add(self.count(), Ordering::Relaxed) + self.count() > MOST_KEPT as u64 {
            self.keep_smallest(LISTED);
        }
        self.pairs.shrink_to_fit();
    }

    /// Ends a chunk's part: so many pairs were `tested`; of the triangles of its pairs, `inner` are seen by this chunk only, those with
    /// the numbers `across` by others, too.
    pub(crate) fn close(&mut self, tested: u64, inner: u64, across: Vec<u32>) {
        self.tested = tested;
        self.inner = inner;
        self.across = across;
    }

    /// Adds up the parts of the chunks, which gave up if they tested more than `most` pairs. With all pairs, sorted, unless they are too
    /// many to keep.
    pub(crate) fn sum(parts: impl Iterator<Item = Self>, most: u64) -> (SelfIntersections, Option<Vec<Pair>>) {
        let mut all = Self::default();
        for mut part in parts {
            all.tested += part.tested;
            all.crossing_pairs += part.crossing_pairs;
            all.overlapping_pairs += part.overlapping_pairs;
            all.inner += part.inner;
            all.across.append(&mut part.across);
            all.pairs.append(&mut part.pairs);
            if all.count() > MOST_KEPT as u64 {
                all.keep_smallest(LISTED);
            }
        }
        if all.tested > most {
            // What was found until then depends on the order of the work.
            return (SelfIntersections { given_up: true, ..SelfIntersections::default() }, None);
        }
        all.across.sort_unstable();
        all.across.dedup();
        let are_kept = all.count() <= MOST_KEPT as u64;
        all.keep_smallest(if are_kept { MOST_KEPT } else { LISTED });
        let summed = SelfIntersections {
            triangles: all.inner + all.across.len() as u64,
            crossing_pairs: all.crossing_pairs,
            overlapping_pairs: all.overlapping_pairs,
            listed: all.pairs.iter().take(LISTED).map(|pair| pair.triangles).collect(),
            given_up: false,
        };
        (summed, are_kept.then_some(all.pairs))
    }

    /// Adds up all pairs of a file.
    pub(crate) fn of_pairs(mut pairs: Vec<Pair>) -> SelfIntersections {
        pairs.sort_unstable_by_key(|pair| pair.triangles);
        let mut triangles: Vec<u32> = pairs.iter().flat_map(|pair| pair.triangles).collect();
        triangles.sort_unstable();
        triangles.dedup();
        let crossing_pairs = pairs.iter().filter(|pair| pair.contact == Contact::Cross).count() as u64;
        SelfIntersections {
            triangles: triangles.len() as u64,
            crossing_pairs,
            overlapping_pairs: pairs.len() as u64 - crossing_pairs,
            listed: pairs.iter().take(LISTED).map(|pair| pair.triangles).collect(),
            given_up: false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(tested: u64, pairs: &[[u32; 2]], across: &[u32]) -> Crossings {
        let mut part = Crossings::default();
        let numbers: Vec<u32> = (0..=MOST_KEPT as u32 + 1).collect();
        pairs.iter().for_each(|[a, b]| part.add(&[*a], &[*b], &numbers, Contact::Cross));
        part.close(tested, 1, across.to_vec());
        part
    }

    #[test]
    fn a_triangle_across_a_seam_counts_once() {
        let (sum, pairs) = Crossings::sum([part(5, &[[9, 2]], &[9]), part(5, &[[9, 4]], &[9])].into_iter(), 10);
        assert_eq!((sum.triangles, sum.crossing_pairs, sum.given_up), (3, 2, false));
        assert_eq!(sum.listed, [[2, 9], [4, 9]], "smaller numbers first");
        assert_eq!(Crossings::of_pairs(pairs.unwrap()), sum);
    }

    #[test]
    fn one_pair_too_many_and_nothing_is_counted() {
        let (sum, pairs) = Crossings::sum([part(5, &[[9, 2]], &[]), part(6, &[], &[])].into_iter(), 10);
        assert_eq!(sum, SelfIntersections { given_up: true, ..SelfIntersections::default() });
        assert!(!sum.is_free() && pairs.is_none());
    }

    #[test]
    fn the_smallest_pairs_are_listed_however_many_there_are() {
        let pairs: Vec<[u32; 2]> = (0..2000).rev().map(|i| [i, i + 5000]).collect();
        let (sum, pairs) = Crossings::sum([part(0, &pairs[..700], &[]), part(0, &pairs[700..], &[])].into_iter(), 1);
        assert_eq!(sum.listed, (0..LISTED as u32).map(|i| [i, i + 5000]).collect::<Vec<_>>());
        assert_eq!((sum.crossing_pairs, pairs.map(|p| p.len())), (2000, Some(2000)));
    }

    #[test]
    fn all_pairs_are_kept_or_none() {
        for (count, kept) in [(MOST_KEPT as u32, true), (MOST_KEPT as u32 + 1, false)] {
            let found = AtomicU64::new(0);
            let parts = [0..count / 2, count / 2..count].map(|numbers| {
                let pairs: Vec<[u32; 2]> = numbers.map(|i| [i, i + 1]).collect();
                let mut part = part(0, &pairs, &[]);
                part.keep(&found);
                part
            });
            let (sum, pairs) = Crossings::sum(parts.into_iter(), 1);
            assert_eq!((sum.crossing_pairs, sum.listed.len(), pairs.is_some()), (u64::from(count), LISTED, kept));
        }
    }

    #[test]
    fn pairs_of_many_copies_are_counted_and_the_smallest_listed() {
        // Even and odd ones.
        let numbers: Vec<u32> = (0..2000).map(|i| 2 * i).chain((0..2000).map(|i| 2 * i + 1)).collect();
        let [one, other]: [Vec<u32>; 2] = [(0..2000).collect(), (2000..4000).collect()];
        let list = |sum: &SelfIntersections| sum.listed.clone();
        let mut part = Crossings::default();
        part.add(&one, &other, &numbers, Contact::Cross);
        let (sum, kept) = Crossings::sum([part].into_iter(), 1);
        assert_eq!((sum.crossing_pairs, kept.is_none()), (4_000_000, true));
        // Those of triangle 0 with the others.
        assert_eq!(list(&sum), (0..LISTED as u32).map(|i| [0, 2 * i + 1]).collect::<Vec<_>>());
        let mut part = Crossings::default();
        part.add(&other, &[], &numbers, Contact::Overlap);
        part.add(&one[..2], &other[..3], &numbers, Contact::Cross);
        let (sum, _) = Crossings::sum([part].into_iter(), 1);
        assert_eq!((sum.overlapping_pairs, sum.crossing_pairs), (2000 * 1999 / 2, 6));
        assert_eq!(list(&sum)[..7], [[0, 1], [0, 3], [0, 5], [1, 2], [1, 3], [1, 5], [1, 7]]);
        assert_eq!(list(&sum).len(), LISTED);
    }
}
