//! Sets of numbers, a bit each.

use std::sync::atomic::{AtomicU64, Ordering};

/// Is a number in the set? None beyond its end is.
#[inline]
pub(crate) fn holds(bits: &[u64], number: usize) -> bool {
    bits.get(number / 64).is_some_and(|word| word >> (number % 64) & 1 == 1)
}

/// Puts a number into the set, which has room for it.
#[inline]
pub(crate) fn put(bits: &mut [u64], number: usize) {
    bits[number / 64] |= 1 << (number % 64);
}

/// How many numbers are in the set.
pub(crate) fn count(bits: &[u64]) -> u64 {
    bits.iter().map(|word| u64::from(word.count_ones())).sum()
}

/// A set that many threads put numbers into.
pub(crate) struct Shared(Vec<AtomicU64>);

impl Shared {
    /// No numbers, with room for those below `end`.
    pub(crate) fn none(end: usize) -> Self {
        Self(std::iter::repeat_with(AtomicU64::default).take(end.div_ceil(64)).collect())
    }

    pub(crate) fn put(&self, number: u32) {
        self.0[number as usize / 64].fetch_or(1 << (number % 64), Ordering::Relaxed);
    }

    pub(crate) fn into_bits(self) -> Vec<u64> {
        self.0.into_iter().map(AtomicU64::into_inner).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holds_what_was_put_in() {
        let set = Shared::none(130);
        [0, 63, 64, 129].into_iter().for_each(|number| set.put(number));
        let bits = set.into_bits();
        assert_eq!((bits.len(), count(&bits)), (3, 4));
        assert_eq!((0..500).filter(|number| holds(&bits, *number)).collect::<Vec<_>>(), [0, 63, 64, 129]);
    }
}
