//! Integers of up to `N` words on the stack. What they cost depends on how long they are, not on how long they could be.

use std::cmp::Ordering;

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

    pub(crate) fn times<const A: usize, const M: usize>(&self, other: &Wide<A>) -> Wide<M> {
        let mut words = [0; M];
        for (i, a) in self.words().iter().enumerate() {
            let mut carry = 0;
            for (j, b) in other.words().iter().enumerate() {
                let sum = u128::from(*a) * u128::from(*b) + u128::from(words[i + j]) + u128::from(carry);
                (words[i + j], carry) = (sum as u64, (sum >> 64) as u64);
            }
            if carry != 0 {
                words[i + other.len] = carry;
            }
        }
        Wide::trimmed(words, self.len + other.len, self.negative != other.negative)
    }

    fn trimmed(words: [u64; N], most: usize, negative: bool) -> Self {
        let mut len = most.min(N);
        while len > 0 && words[len - 1] == 0 {
            len -= 1;
        }
        Self { words, len, negative: negative && len > 0 }
    }

    pub(crate) fn plus(&self, other: &Self) -> Self {
        if self.negative == other.negative {
            return self.grown(other);
        }
        match self.magnitude_cmp(other) {
            Ordering::Less => other.shrunk(self),
            Ordering::Equal => Self::ZERO,
            Ordering::Greater => self.shrunk(other),
        }
    }

    pub(crate) fn minus(&self, other: &Self) -> Self {
        self.plus(&other.negated())
    }

    fn grown(&self, other: &Self) -> Self {
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
        Self::trimmed(words, longer + 1, self.negative || other.negative)
    }

    /// Of magnitudes; this one's is larger.
    fn shrunk(&self, other: &Self) -> Self {
        let mut words = self.words;
        let mut borrow = false;
        for (word, less) in words[..self.len].iter_mut().zip(&other.words[..self.len]) {
            let (rest, first) = word.overflowing_sub(*less);
            let (rest, second) = rest.overflowing_sub(u64::from(borrow));
            (*word, borrow) = (rest, first | second);
        }
        Self::trimmed(words, self.len, self.negative)
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
