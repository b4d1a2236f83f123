//! Which triangles a mesh has, to the bit: so that a picture can show those of another mesh that are new, or gone.
//!
//! A Bloom filter (Bloom, "Space/time trade-offs in hash coding with allowable errors", CACM 13(7), 1970) of 16 bits a triangle and four
//! hashes: one triangle in 400 that is new passes for a known one, none that is known for a new one.

use std::sync::atomic::{AtomicU64, Ordering};

use suture_core::record::{self, Record};

use super::mix::mix;
use super::parts::side_by_side;

const BITS_EACH: usize = 16;
const HASHES: u64 = 4;

/// The triangles of a mesh.
#[derive(Debug)]
pub(super) struct Known {
    words: Vec<AtomicU64>,
}

/// Of the corners; normal and attribute do not count.
fn hash(record: &Record) -> u64 {
    mix(record::corners(record).into_iter().flatten().map(f32::to_bits))
}

impl Known {
    /// Of all triangles, on so many threads; `None` where that would take more than so many bytes. O(n).
    pub(super) fn of(records: &[Record], threads: usize, most: u64) -> Option<Self> {
        let words = (records.len() * BITS_EACH).div_ceil(64).max(1);
        if 8 * words as u64 > most {
            return None;
        }
        let known = Self { words: (0..words).map(|_| AtomicU64::new(0)).collect() };
        side_by_side(records, threads, |_, part| {
            for record in part {
                for (word, bit) in known.places(record) {
                    word.fetch_or(bit, Ordering::Relaxed);
                }
            }
        });
        Some(known)
    }

    fn places(&self, record: &Record) -> impl Iterator<Item = (&AtomicU64, u64)> {
        let first = hash(record);
        let step = first.rotate_left(21) | 1;
        (0..HASHES).map(move |k| {
            let at = first.wrapping_add(k.wrapping_mul(step));
            // The upper half chooses the word, evenly (Lemire's reduction).
            let word = ((at >> 32) * self.words.len() as u64) >> 32;
            (&self.words[word as usize], 1 << (at & 63))
        })
    }

    /// Is it one of them? Of others, one in 400 passes.
    pub(super) fn has(&self, record: &Record) -> bool {
        self.places(record).all(|(word, bit)| word.load(Ordering::Relaxed) & bit != 0)
    }
}

#[cfg(test)]
mod tests {
    use suture_core::record::encode;

    use super::*;

    #[test]
    fn all_are_known_and_few_others() {
        let record = |i: u32| encode([[i as f32, 0.0, 0.5], [1.0, i as f32, 0.0], [0.0, 0.25, 1.0]], 0);
        let records: Vec<Record> = (0..20_000).map(record).collect();
        let known = Known::of(&records, 3, 1 << 20).unwrap();
        assert!(records.iter().all(|r| known.has(r)));
        let mut other = records[7];
        (other[0], other[48]) = (9, 9);
        assert!(known.has(&other), "normal and attribute do not count");
        let passed = (20_000..60_000).filter(|i| known.has(&record(*i))).count();
        assert!(passed < 40_000 / 200, "{passed}");
        assert!(Known::of(&records, 1, 1000).is_none());
    }
}
