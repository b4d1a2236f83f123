//! Edges of only one triangle, which a picture draws as lines.

use suture_core::record::{self, Point, Record};

use super::mix::mix;
use super::parts::side_by_side;

/// Lines beyond these would only hide the picture.
const MOST: usize = 200_000;

fn key(p: Point) -> [u32; 3] {
    // −0.0 is 0.0.
    p.map(|x| (x + 0.0).to_bits())
}

fn hash([a, b]: [Point; 2]) -> u64 {
    let (a, b) = (key(a), key(b));
    mix(a.min(b).into_iter().chain(a.max(b)))
}

fn edges_of(record: &Record) -> impl Iterator<Item = [Point; 2]> {
    let c = record::corners(record);
    let finite = record::all_finite(record);
    (0..3).map(move |k| [c[k], c[(k + 1) % 3]]).filter(move |[a, b]| finite && key(*a) != key(*b))
}

/// The edges of only one triangle, in the order of the file, the first [`MOST`]; none where finding them would take more than so many bytes.
/// Told by hashes of 64 bits: of 10⁸ edges, one in about 10³ files is missed. O(n log n).
pub(super) fn boundary(records: &[Record], threads: usize, most: u64) -> Vec<[Point; 2]> {
    if 60 * records.len() as u64 > most {
        return Vec::new();
    }
    let parts = side_by_side(records, threads, |_, part| {
        let mut hashes: Vec<u64> = part.iter().flat_map(edges_of).map(hash).collect();
        hashes.sort_unstable();
        hashes
    });
    let mut all = parts.concat();
    // Sorted runs are merged.
    all.sort();
    let single: Vec<u64> = all.chunk_by(|a, b| a == b).filter(|same| same.len() == 1).map(|same| same[0]).collect();
    drop(all);
    if single.is_empty() {
        return Vec::new();
    }
    records.iter().flat_map(edges_of).filter(|edge| single.binary_search(&hash(*edge)).is_ok()).take(MOST).collect()
}
