//! Quotients of long integers in floating point: rounded to the nearest, and what is missing then.

use crate::geometry::arrange::wide::{View, WORDS, Wide};

type Int = Wide<WORDS>;

/// A quotient in floating point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rounded {
    /// The nearest f64, of two the even one.
    pub(crate) high: f64,
    /// What is missing, by 2⁻¹⁰⁰ of the quotient.
    pub(crate) low: f64,
    /// Nothing is missing.
    pub(crate) exact: bool,
}

/// x / w, where w is positive.
pub(crate) fn quotient(x: View<'_>, w: View<'_>) -> Rounded {
    if x.words.is_empty() {
        return Rounded { high: 0.0, low: 0.0, exact: true };
    }
    let power = x.bits() - w.bits();
    let (high, low) = divided(leading(x.words), leading(w.words));
    // Rounded eight times by 2⁻¹⁰⁴ or less.
    let error = high * (1.0 / (1_u128 << 101) as f64);
    let sure = low.abs() + error;
    // Where the rest may be nothing, or a half, it is looked at.
    if low.abs() <= error || high + sure != high || high - sure != high {
        return exactly(x, w);
    }
    let signed = if x.negative { -1.0 } else { 1.0 };
    Rounded { high: scaled(signed * high, power), low: scaled(signed * low, power), exact: false }
}

/// A magnitude as f64s from 1 to 2, and the rest: good to 2⁻¹⁰⁵.
fn leading(words: &[u64]) -> [f64; 2] {
    let word = |k: usize| words.len().checked_sub(k).map_or(0, |at| words[at]);
    let (first, second, third) = (word(1), word(2), word(3));
    let by = first.leading_zeros();
    let (first, second) = match by {
        0 => (first, second),
        _ => (first << by | second >> (64 - by), second << by | third >> (64 - by)),
    };
    let rest = (first & 0x7ff) as f64 + second as f64 * (0.5 / (1_u64 << 63) as f64);
    let unit = 1.0 / (1_u64 << 63) as f64;
    sum((first & !0x7ff) as f64 * unit, rest * unit)
}

/// The sum, and what is lost; the first is larger (Dekker's fast two-sum).
fn sum(a: f64, b: f64) -> [f64; 2] {
    let sum = a + b;
    [sum, b - (sum - a)]
}

/// The product, and what is lost (Veltkamp's splitting and Dekker's product).
fn product(a: f64, b: f64) -> [f64; 2] {
    let split = |x: f64| {
        let far = x * 134_217_729.0;
        let top = far - (far - x);
        (top, x - top)
    };
    let ((a_top, a_rest), (b_top, b_rest)) = (split(a), split(b));
    let product = a * b;
    [product, ((a_top * b_top - product) + a_top * b_rest + a_rest * b_top) + a_rest * b_rest]
}

/// a − q · b, which is small against a.
fn less([high, low]: [f64; 2], q: f64, b: [f64; 2]) -> [f64; 2] {
    let ([top, lost], [rest, lost_of_rest]) = (product(q, b[0]), product(q, b[1]));
    // The first difference is exact, since both are near to each other.
    let difference = high - top;
    let [first, second] = two_sum(difference, low - lost);
    let missing = ((low - (low - lost)) - lost) - lost_of_rest;
    let [first, third] = two_sum(first, -rest);
    sum(first, second + third + missing)
}

/// The sum, and what is lost (Knuth's two-sum).
fn two_sum(a: f64, b: f64) -> [f64; 2] {
    let sum = a + b;
    let seen = sum - a;
    [sum, (a - (sum - seen)) + (b - seen)]
}

/// A quotient in three steps, of which two are left.
fn divided(x: [f64; 2], w: [f64; 2]) -> (f64, f64) {
    let first = x[0] / w[0];
    let rest = less(x, first, w);
    let second = rest[0] / w[0];
    let rest = less(rest, second, w);
    let third = rest[0] / w[0];
    let [high, low] = sum(first, second);
    let [high, lower] = sum(high, low + third);
    (high, lower)
}

/// The same by integers.
#[cold]
fn exactly(x: View<'_>, w: View<'_>) -> Rounded {
    let (x, w) = (Int::of_words(x.words, x.negative), &Int::of_words(w.words, false));
    let mut rest = Rest { numerator: x, scale: 0 };
    let first = rest.step(w);
    let second = rest.step(w);
    let high = first + second;
    let low = second - (high - first);
    if rest.numerator.sign() == 0 {
        return Rounded { high, low, exact: low == 0.0 };
    }
    // No zero: else nothing would be left.
    let towards = if low > 0.0 { high.next_up() } else { high.next_down() };
    let to_half = 0.5 * (towards - high).abs() - low.abs();
    let third = rest.step(w);
    let beyond = if low > 0.0 { third } else { -third };
    let past = to_half < beyond || to_half == beyond && rest.numerator.sign() == if low > 0.0 { 1 } else { -1 };
    let (high, low) = if past { (towards, low - (towards - high) + third) } else { (high, low + third) };
    Rounded { high, low, exact: false }
}

/// What is left of a quotient: the numerator, in units of two to the scale.
struct Rest {
    numerator: Int,
    scale: i32,
}

impl Rest {
    /// Takes away as much of the quotient as a f64 holds.
    fn step(&mut self, w: &Int) -> f64 {
        if self.numerator.sign() == 0 {
            return 0.0;
        }
        let ((x, x_power), (w_rounded, w_power)) = (self.numerator.rounded(), w.rounded());
        let quotient = x / w_rounded;
        let (magnitude, exponent) = parts(quotient);
        let whole = Int::of(i128::from(magnitude) * if quotient < 0.0 { -1 } else { 1 });
        let power = exponent + x_power - w_power;
        if power < 0 {
            self.numerator = self.numerator.shifted(power.unsigned_abs());
            self.numerator = self.numerator.minus(&whole.times(w));
        } else {
            self.numerator = self.numerator.minus(&whole.shifted(power.unsigned_abs()).times(w));
        }
        let taken = scaled(quotient, x_power - w_power + self.scale);
        self.scale += power.min(0);
        taken
    }
}

/// The magnitude as a whole number of 53 bits times a power of two; not for zero, nor for what is too small for all its bits. (No f32 is.)
pub(crate) fn parts(x: f64) -> (u64, i32) {
    let bits = x.abs().to_bits();
    ((bits & ((1 << 52) - 1)) | (1 << 52), (bits >> 52) as i32 - 1075)
}

/// x · 2^power.
pub(crate) fn scaled(x: f64, power: i32) -> f64 {
    let half = power / 2;
    let two_to = |e: i32| f64::from_bits(((1023 + e.clamp(-1022, 1023)) as u64) << 52);
    x * two_to(half) * two_to(power - half)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Against divisions that f64 rounds itself.
        #[test]
        fn quotients_are_rounded_as_ieee_754_says(x in -(1_i64 << 53)..1 << 53, w in 1_i64..1 << 53, by in 0_u32..300) {
            let Rounded { high, low, exact } = quotient(Int::of(x.into()).shifted(by).view(), Int::of(w.into()).view());
            prop_assert_eq!(high, scaled(x as f64 / w as f64, by as i32));
            prop_assert!(low.abs() <= high.abs() * f64::EPSILON / 2.0);
            prop_assert!(!exact || low == 0.0);
        }

        /// Of what has many more bits, and of what is next to a f64 or a half.
        #[test]
        fn quotients_in_floating_point_are_those_by_integers(x: u128, more: u128, w in 1_u128.., even: u128, part in 0_u32..128, near in -3_i128..4) {
            let long = |high: u128, low: u128| {
                let words = [low as u64, (low >> 64) as u64, high as u64, (high >> 64) as u64];
                Wide::<WORDS>::of_words(&words, false)
            };
            let w = long(even >> part, w);
            let factor = Int::of((x >> 64) as i128);
            let close: Int = factor.times::<WORDS, WORDS>(&w).shifted(70).plus(&Int::of(near));
            for x in [long(x, more), long(0, x >> part), close] {
                let (ours, theirs) = (quotient(x.view(), w.view()), exactly(x.view(), w.view()));
                prop_assert_eq!((ours.high, ours.exact), (theirs.high, theirs.exact));
                prop_assert!((ours.low - theirs.low).abs() <= ours.high.abs() / (1_u128 << 100) as f64);
            }
        }
    }

    #[test]
    fn halves_are_rounded_to_even_and_a_little_more_is_not() {
        let odd = (1_i128 << 53) + 1;
        let quotient = |x: Int, w: Int| quotient(x.view(), w.view()).high;
        assert_eq!(quotient(Int::of(odd), Int::of(1)), (1_u64 << 53) as f64);
        assert_eq!(quotient(Int::of(odd + 2), Int::of(1)), ((1_u64 << 53) + 4) as f64);
        // Two to the −200 more or less than half.
        let (one, far) = (Int::of(1), Int::of(odd).shifted(200));
        assert_eq!(quotient(far.plus(&one), one.shifted(200)), ((1_u64 << 53) + 2) as f64);
        assert_eq!(quotient(far.minus(&one), one.shifted(200)), (1_u64 << 53) as f64);
        assert_eq!(quotient(far.plus(&one).negated(), one.shifted(200)), -(((1_u64 << 53) + 2) as f64));
    }
}
