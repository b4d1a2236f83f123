//! Randomness and angles that are the same on every platform: integer hashes, and polynomials instead of the system's
//! mathematical library (whose last digit differs between systems).

/// The output function of SplitMix64 (Steele, Lea, Flood 2014): a bijection that scatters 64 bits.
pub(super) fn scatter(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ (x >> 31)
}

/// A hash of `key` under `seed`.
pub(super) fn hash(seed: u64, key: u64) -> u64 {
    scatter(scatter(seed ^ 0x9E37_79B9_7F4A_7C15).wrapping_add(key.wrapping_mul(0x9E37_79B9_7F4A_7C15)))
}

/// Noise in [−1, 1) that depends on `seed` and `key` alone.
pub(super) fn noise(seed: u64, key: u64) -> f64 {
    (hash(seed, key) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// A stream of random numbers (SplitMix64).
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64, key: u64) -> Self {
        Self(hash(seed, key))
    }

    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        scatter(self.0)
    }

    /// A whole number from `low` to `high`, both included (the bias of the remainder does not matter here).
    pub(crate) fn within(&mut self, low: usize, high: usize) -> usize {
        low + (self.next() % (high - low + 1) as u64) as usize
    }

    /// A number in [0, 1).
    pub(crate) fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Cosine and sine of `part / whole` of a full turn, within 2e-16.
pub(crate) fn turn(part: u64, whole: u64) -> (f64, f64) {
    let part = u128::from(part % whole) * 8;
    let (octant, rest) = (part / u128::from(whole), part % u128::from(whole));
    // Odd octants are measured back from their end, so that the angle is at most an eighth of a turn.
    let back = if octant % 2 == 1 { u128::from(whole) - rest } else { rest };
    let x = back as f64 / whole as f64 * std::f64::consts::FRAC_PI_4;
    let y = x * x;
    let (mut cos, mut sin) = (0.0, 0.0);
    for k in (0..9).rev() {
        let k = f64::from(k);
        cos = 1.0 - cos * y / ((2.0 * k + 1.0) * (2.0 * k + 2.0));
        sin = 1.0 - sin * y / ((2.0 * k + 2.0) * (2.0 * k + 3.0));
    }
    sin *= x;
    match octant {
        0 => (cos, sin),
        1 => (sin, cos),
        2 => (-sin, cos),
        3 => (-cos, sin),
        4 => (-cos, -sin),
        5 => (-sin, -cos),
        6 => (sin, -cos),
        _ => (cos, -sin),
    }
}

/// A permutation of 0..`count`, computed number by number: a four-round Feistel network over the next power of four, walked
/// until it lands inside (Black and Rogaway, "Ciphers with arbitrary finite domains", 2002).
pub(super) struct Permutation {
    seed: u64,
    count: u64,
    half_bits: u32,
}

impl Permutation {
    pub(crate) fn new(seed: u64, count: u64) -> Self {
        let bits = 64 - count.max(2).leading_zeros();
        Self { seed, count, half_bits: bits.div_ceil(2) }
    }

    pub(super) fn at(&self, index: u64) -> u64 {
        let mask = (1u64 << self.half_bits) - 1;
        let mut x = index;
        loop {
            let (mut left, mut right) = (x >> self.half_bits, x & mask);
            for round in 0..4 {
                (left, right) = (right, left ^ (scatter(self.seed ^ (right << 3 | round)) & mask));
            }
            x = left << self.half_bits | right;
            if x < self.count {
                return x;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turn_agrees_with_the_system_in_every_octant() {
        for part in 0..97 {
            let (cos, sin) = turn(part, 97);
            let angle = part as f64 / 97.0 * std::f64::consts::TAU;
            assert!((cos - angle.cos()).abs() < 1e-15 && (sin - angle.sin()).abs() < 1e-15, "{part}: {cos} {sin}");
        }
        assert_eq!(turn(1, 4), (0.0, 1.0));
    }

    #[test]
    fn permutation_meets_every_number_once() {
        for count in [1, 2, 3, 100, 1025] {
            let permutation = Permutation::new(7, count);
            let mut seen: Vec<_> = (0..count).map(|i| permutation.at(i)).collect();
            seen.sort_unstable();
            assert!(seen.into_iter().eq(0..count));
        }
    }
}
