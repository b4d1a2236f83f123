//! Numbers in no order that anybody could have meant, the same for everybody.

use std::hash::{BuildHasherDefault, Hasher};

/// A share of one, from 0 up to but not including 1, by a number: the finalizer of SplitMix64 (Steele, Lea and Flood 2014).
pub(crate) fn share(number: u64) -> f64 {
    let x = number.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((x ^ (x >> 31)) >> 40) as f64 / (1u64 << 24) as f64
}

/// For tables of numbers that nobody chooses to collide: a few multiplications spread them. Tables that use it are asked, and never gone through.
pub(crate) type Hashing = BuildHasherDefault<Scatter>;

#[derive(Default)]
pub(crate) struct Scatter(u64);

impl Hasher for Scatter {
    fn finish(&self) -> u64 {
        self.0 ^ self.0 >> 29
    }

    fn write(&mut self, bytes: &[u8]) {
        for chunk in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            self.write_u64(u64::from_le_bytes(word));
        }
    }

    fn write_u64(&mut self, word: u64) {
        let mixed = (self.0 ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        self.0 = mixed ^ mixed >> 32;
    }
}

#[cfg(test)]
mod tests {
    use super::share;

    /// Of a thousand numbers in a row, each tenth gets about a tenth, and neighbours have nothing to do with each other.
    #[test]
    fn numbers_in_a_row_are_scattered_evenly() {
        let mut tenths = [0; 10];
        (0..1000).for_each(|n| tenths[(share(n) * 10.0) as usize] += 1);
        assert!(tenths.iter().all(|count| (70..130).contains(count)), "{tenths:?}");
        let rises = (0..1000).filter(|n| share(n + 1) > share(*n)).count();
        assert!((450..550).contains(&rises), "{rises}");
    }
}
