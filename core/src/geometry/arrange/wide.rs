//! Integers of up to `N` words on the stack. What they cost depends on how long they are, not on how long they could be.

use std::cmp::Ordering;

/// Words of what a point is made of: seven times the bits of a coordinate, and a few.
pub(crate) const WORDS: usize = 12;

/// A sign and a magnitude that lie elsewhere: least word first, and the last one is not zero.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View<'a> {
    pub(crate) words: &'a [u64],
    pub(crate) negative: bool,
}

impl View<'_> {
    /// Position of the leading bit plus one; 0 for zero.
    pub(crate) fn bits(&self) -> i32 {
        self.words.last().map_or(0, |top| 64 * self.words.len() as i32 - top.leading_zeros() as i32)
    }
}

/// The product of two.
#[inline]
pub(crate) fn product<const M: usize>(a: View<'_>, b: View<'_>) -> Wide<M> {
    let mut words = [0; M];
    for (i, x) in a.words.iter().enumerate() {
        // What is in units too small for it ends in zeros.
        if *x == 0 {
            continue;
        }
        let mut carry = 0;
        for (y, word) in b.words.iter().zip(&mut words[i..]) {
            let sum = u128::from(*x) * u128::from(*y) + u128::from(*word) + u128::from(carry);
            (*word, carry) = (sum as u64, (sum >> 64) as u64);
        }
        if carry != 0 {
            words[i + b.words.len()] = carry;
        }
    }
    Wide::trimmed(words, a.words.len() + b.words.len(), a.negative != b.negative)
}

/// A sign and a magnitude, least word first. Words from `len` on are zero. What does not fit panics: the callers know the sizes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wide<const N: usize> {
    words: [u64; N],
    len: usize,
    negative: bool,
}

impl<const N: usize> Wide<N> {
    pub(crate) const ZERO: Self = Self { words: [0; N], len: 0, negative: false };

    pub(crate) fn of(value: i128) -> Self {
        let magnitude = value.unsigned_abs();
        Self::of_words(&[magnitude as u64, (magnitude >> 64) as u64], value < 0)
    }

    pub(crate) fn of_words(from: &[u64], negative: bool) -> Self {
        let len = from.iter().rposition(|w| *w != 0).map_or(0, |last| last + 1);
        let mut words = [0; N];
        words[..len].copy_from_slice(&from[..len]);
        Self { words, len, negative: negative && len > 0 }
    }

    pub(crate) fn words(&self) -> &[u64] {
        &self.words[..self.len]
    }

    pub(crate) fn sign(&self) -> i8 {
        if self.len == 0 { 0 } else { 1 - 2 * i8::from(self.negative) }
    }

    pub(crate) fn negated(mut self) -> Self {
        self.negative = !self.negative && self.len > 0;
        self
    }

    /// Position of the leading bit plus one; 0 for zero.
    pub(crate) fn bits(&self) -> i32 {
        self.words().last().map_or(0, |top| 64 * self.len as i32 - top.leading_zeros() as i32)
    }

    #[inline]
    pub(crate) fn view(&self) -> View<'_> {
        View { words: self.words(), negative: self.negative }
    }

    #[inline]
    pub(crate) fn times<const A: usize, const M: usize>(&self, other: &Wide<A>) -> Wide<M> {
        product(self.view(), other.view())
    }

    fn trimmed(words: [u64; N], most: usize, negative: bool) -> Self {
        let mut len = most.min(N);
        while len > 0 && words[len - 1] == 0 {
            len -= 1;
        }
        Self { words, len, negative: negative && len > 0 }
    }

    #[inline]
    pub(crate) fn plus(&self, other: &Self) -> Self {
        self.with(other, other.negative)
    }

    #[inline]
    pub(crate) fn minus(&self, other: &Self) -> Self {
        self.with(other, !other.negative)
    }

    /// The sum with the magnitude of another one.
    fn with(&self, other: &Self, negative: bool) -> Self {
        if self.negative == negative {
            return self.grown(other, negative);
        }
        match self.magnitude_cmp(other) {
            Ordering::Less => other.shrunk(self, negative),
            Ordering::Equal => Self::ZERO,
            Ordering::Greater => self.shrunk(other, self.negative),
        }
    }

    fn grown(&self, other: &Self, negative: bool) -> Self {
        let mut words = self.words;
        let longer = self.len.max(other.len);
        let mut carry = false;
        for (word, add) in words[..longer].iter_mut().zip(&other.words[..longer]) {
            let (sum, first) = word.overflowing_add(*add);
            let (sum, second) = sum.overflowing_add(u64::from(carry));
            (*word, carry) = (sum, first | second);
        }
        if carry {
            words[longer] = 1;
        }
        Self::trimmed(words, longer + 1, negative)
    }

    /// Of magnitudes; this one's is larger.
    fn shrunk(&self, other: &Self, negative: bool) -> Self {
        let mut words = self.words;
        let mut borrow = false;
        for (word, less) in words[..self.len].iter_mut().zip(&other.words[..self.len]) {
            let (rest, first) = word.overflowing_sub(*less);
            let (rest, second) = rest.overflowing_sub(u64::from(borrow));
            (*word, borrow) = (rest, first | second);
        }
        Self::trimmed(words, self.len, negative)
    }

    fn magnitude_cmp(&self, other: &Self) -> Ordering {
        self.len.cmp(&other.len).then_with(|| self.words().iter().rev().cmp(other.words().iter().rev()))
    }

    pub(crate) fn cmp(&self, other: &Self) -> Ordering {
        match (self.negative, other.negative) {
            (false, false) => self.magnitude_cmp(other),
            (true, true) => other.magnitude_cmp(self),
            (true, false) => Ordering::Less,
            (false, true) => Ordering::Greater,
        }
    }

    pub(crate) fn shifted(&self, by: u32) -> Self {
        let (whole, part) = ((by / 64) as usize, by % 64);
        let mut words = [0; N];
        for (i, word) in self.words().iter().enumerate() {
            words[i + whole] |= word << part;
            let over = if part == 0 { 0 } else { word >> (64 - part) };
            if over != 0 {
                words[i + whole + 1] = over;
            }
        }
        Self::trimmed(words, self.len + whole + 1, self.negative)
    }

    /// Zeros at its end.
    pub(crate) fn zeros(&self) -> u32 {
        let first = self.words().iter().position(|word| *word != 0);
        first.map_or(u32::MAX, |at| 64 * at as u32 + self.words[at].trailing_zeros())
    }

    /// Divided by two to a power, where only zeros are lost.
    pub(crate) fn without(&self, by: u32) -> Self {
        let (whole, part) = ((by / 64) as usize, by % 64);
        let mut words = [0; N];
        let word = |i: usize| self.words().get(i).copied().unwrap_or(0);
        for (i, to) in words.iter_mut().enumerate().take(self.len.saturating_sub(whole)) {
            let over = if part == 0 { 0 } else { word(i + whole + 1) << (64 - part) };
            *to = word(i + whole) >> part | over;
        }
        Self::trimmed(words, self.len.saturating_sub(whole), self.negative)
    }

    /// Nearly f · 2^e: rounded to 53 bits, from 64.
    pub(crate) fn rounded(&self) -> (f64, i32) {
        let bits = self.bits();
        let top = match *self.words() {
            [] => return (0.0, 0),
            [.., low, high] if high.leading_zeros() > 0 => high << high.leading_zeros() | low >> (64 - high.leading_zeros()),
            [.., high] => high << high.leading_zeros(),
        };
        (if self.negative { -(top as f64) } else { top as f64 }, bits - 64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn zeros_at_the_end_come_and_go(x: i128, by in 0_u32..500) {
            let number = Wide::<WORDS>::of(x);
            let more = number.shifted(by);
            let back = more.without(by);
            prop_assert_eq!(back.words(), number.words());
            prop_assert_eq!(more.zeros(), if x == 0 { u32::MAX } else { x.trailing_zeros() + by });
        }
    }
}
