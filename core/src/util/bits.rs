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

/// All numbers below `end`.
pub(crate) fn all(end: usize) -> Vec<u64> {
    let mut bits = vec![!0; end.div_ceil(64)];
    if let Some(last) = bits.last_mut().filter(|_| !end.is_multiple_of(64)) {
        *last >>= 64 - end % 64;
    }
    bits
}

/// These numbers, all of them below `end`.
pub(crate) fn of(end: usize, numbers: impl Iterator<Item = u32>) -> Vec<u64> {
    let mut bits = vec![0; end.div_ceil(64)];
    numbers.for_each(|number| put(&mut bits, number as usize));
    bits
}

/// Takes a number out of the set.
pub(crate) fn take(bits: &mut [u64], number: usize) {
    if let Some(word) = bits.get_mut(number / 64) {
        *word &= !(1 << (number % 64));
    }
}

/// The first bit that is set from `at` on, or past the end.
pub(crate) fn next_one(bits: &[u64], at: usize) -> usize {
    next(bits, at, |word| word).unwrap_or(usize::MAX)
}

/// The first bit that is not set from `at` on, or past the end of all words.
pub(crate) fn next_zero(bits: &[u64], at: usize) -> usize {
    next(bits, at, |word| !word).unwrap_or(at.max(bits.len() * 64))
}

/// The first bit from `at` on that is set in the `view` of its word.
#[inline]
fn next(bits: &[u64], at: usize, view: impl Fn(u64) -> u64) -> Option<usize> {
    let mut word = at / 64;
    let mut mask = !0u64 << (at % 64);
    while word < bits.len() {
        let found = view(bits[word]) & mask;
        if found != 0 {
            return Some(word * 64 + found.trailing_zeros() as usize);
        }
        word += 1;
        mask = !0;
    }
    None
}

/// All bits that are set.
pub(crate) fn ones(bits: &[u64]) -> impl Iterator<Item = u32> + '_ {
    let next = |at: usize| Some(next_one(bits, at)).filter(|one| *one != usize::MAX);
    std::iter::successors(next(0), move |one| next(one + 1)).map(|one| one as u32)
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
        assert_eq!(ones(&bits).collect::<Vec<_>>(), [0, 63, 64, 129]);
        assert_eq!(of(130, ones(&bits)), bits);
    }

    #[test]
    fn all_are_there_until_they_are_taken() {
        for end in [0, 1, 63, 64, 65] {
            let mut bits = all(end);
            assert_eq!(ones(&bits).collect::<Vec<_>>(), (0..end as u32).collect::<Vec<_>>());
            // Beyond the end no bit of the last word is set.
            assert!((0..end).all(|at| next_zero(&bits, at) == end), "{end}");
            if end > 1 {
                take(&mut bits, end - 2);
                assert_eq!([0, end - 1].map(|at| next_zero(&bits, at)), [end - 2, end]);
            }
            (0..end + 9).for_each(|number| take(&mut bits, number));
            assert_eq!(count(&bits), 0);
        }
    }
}
