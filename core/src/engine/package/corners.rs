//! Triangles by their corners, whatever their order.

use crate::geometry::position;
use crate::io::record::Record;
use crate::util::parallel;

/// Records that a thread takes at once.
const BLOCK: usize = 1 << 12;

/// A hash of triangles by their corners that does not depend on their order: an edit of what another edit made may give other places than the file that was
/// judged. The sum of the hashes of all triangles, word by word (Bellare & Micciancio, "A new paradigm for collision-free hashing: incrementality at reduced
/// cost", 1997). Equal positions have equal bytes in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Triangles {
    sums: [u64; 4],
    pub(super) count: u64,
}

impl Triangles {
    /// O(n), on so many threads.
    pub(super) fn of(records: &[Record], threads: usize) -> Self {
        let blocks: Vec<&[Record]> = records.chunks(BLOCK).collect();
        let sums = parallel::map(threads, blocks.len(), |block| sum(blocks[block]));
        Self { sums: sums.into_iter().fold(Default::default(), plus), count: records.len() as u64 }
    }
}

fn sum(records: &[Record]) -> [u64; 4] {
    let hash = |record: &Record| {
        let bytes = position::corners(record).map(|corner| position::bits(corner).map(u32::to_le_bytes));
        let hash = blake3::hash(bytes.as_flattened().as_flattened());
        let (words, _) = hash.as_bytes().as_chunks::<8>();
        std::array::from_fn(|k| words.get(k).map_or(0, |word| u64::from_le_bytes(*word)))
    };
    records.iter().map(hash).fold(Default::default(), plus)
}

fn plus(a: [u64; 4], b: [u64; 4]) -> [u64; 4] {
    std::array::from_fn(|k| a[k].wrapping_add(b[k]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{cube, records};

    #[test]
    fn the_order_of_triangles_is_nothing_and_that_of_their_corners_is_not() {
        let mut all = cube();
        let before = Triangles::of(&records(&all), 2);
        all.rotate_left(5);
        assert_eq!(Triangles::of(&records(&all), 2), before);
        all[3].swap(0, 1);
        assert_ne!(Triangles::of(&records(&all), 2), before);
        all[3].swap(0, 1);
        all.push(all[3]);
        assert_ne!(Triangles::of(&records(&all), 2), before);
    }
}
