//! Points where planes meet, exactly: over one denominator, made from corners and never from other such points, so that their numbers
//! stay short (Attene, "Indirect predicates for geometric constructions", Computer-Aided Design 126, 2020).

use std::cmp::Ordering;

use crate::geometry::arrange::quotient::{Rounded, quotient, scaled};
use crate::geometry::arrange::wide::{View, WORDS, Wide, product};

/// Bits of a coordinate, at most.
pub(crate) const BITS: u32 = 100;

/// Words of products of two numbers of a point.
const TWICE: usize = 2 * WORDS;

pub(crate) type Int = Wide<WORDS>;

/// A corner, in units in which all corners are whole.
pub(crate) type Corner = [i128; 3];

/// A point as three numerators and a positive denominator, and what is known of it in floating point.
#[derive(Clone, Debug)]
pub(crate) struct Point {
    /// Words of all four, one after the other.
    words: Words,
    ends: [u8; 4],
    negative: [bool; 3],
    /// The coordinates rounded to the nearest f64.
    pub(crate) high: [f64; 3],
    /// What is missing, nearly: by 2⁻¹⁰⁰ of the coordinate.
    pub(crate) low: [f64; 3],
    /// Nothing is missing.
    pub(crate) exact: bool,
}

/// Words in place, as those of most points are, or elsewhere.
#[derive(Clone, Debug)]
enum Words {
    Few([u64; FEW]),
    Many(Box<[u64]>),
}

const FEW: usize = 8;

impl Words {
    fn of(words: &[u64]) -> Self {
        if words.len() > FEW {
            return Self::Many(words.into());
        }
        let mut few = [0; FEW];
        few[..words.len()].copy_from_slice(words);
        Self::Few(few)
    }

    #[inline]
    fn all(&self) -> &[u64] {
        match self {
            Self::Few(few) => few,
            Self::Many(many) => many,
        }
    }
}

impl Point {
    pub(crate) fn corner(p: &Corner) -> Self {
        Self::of(*p, 1, 0, p.map(Some))
    }

    /// Over a denominator that is not zero.
    pub(crate) fn new(x: &[Int; 3], w: &Int) -> Self {
        // In units that are small for one corner's sake most numbers end in many zeros.
        let power = [&x[0], &x[1], &x[2], w].map(Int::zeros).into_iter().min().unwrap_or(0);
        let (x, w) = if power > 0 { (&x.each_ref().map(|x| x.without(power)), &w.without(power)) } else { (x, w) };
        let all = [&x[0], &x[1], &x[2], w];
        let mut words = [0; 4 * WORDS];
        let mut len = 0;
        let ends = all.map(|part| {
            let part = part.words();
            words[len..len + part.len()].copy_from_slice(part);
            len += part.len();
            len as u8
        });
        Self::rounded(&words[..len], ends, x.each_ref().map(|x| x.sign() * w.sign() < 0), [None; 3])
    }

    /// Short numerators, in units of two to a power, over a positive denominator; and coordinates that are known to be whole, in the same units.
    pub(crate) fn of(x: [i128; 3], w: u128, power: u32, known: [Option<i128>; 3]) -> Self {
        let whole = |k: usize| known[k].and_then(|x| whole(x, power));
        let rounded = [whole(0), whole(1), whole(2)];
        let negative = [x[0] < 0, x[1] < 0, x[2] < 0];
        let x = [x[0].unsigned_abs(), x[1].unsigned_abs(), x[2].unsigned_abs()];
        let common = (x[0] | x[1] | x[2]).trailing_zeros().saturating_add(power).min(w.trailing_zeros());
        let (w, less) = (w >> common, common.saturating_sub(power));
        let power = power.saturating_sub(common);
        let mut words = [0; 3 * LONGEST + 2];
        let (mut len, mut ends) = (0, [0; 4]);
        for (k, (x, power)) in
            [(x[0] >> less, power), (x[1] >> less, power), (x[2] >> less, power), (w, 0)].into_iter().enumerate()
        {
            len += write(&mut words[len..], x, power);
            ends[k] = len as u8;
        }
        Self::rounded(&words[..len], ends, negative, rounded)
    }

    fn rounded(words: &[u64], ends: [u8; 4], negative: [bool; 3], known: [Option<Rounded>; 3]) -> Self {
        let (high, low) = ([0.0; 3], [0.0; 3]);
        let mut point = Self { words: Words::of(words), ends, negative, high, low, exact: true };
        for (k, known) in known.into_iter().enumerate() {
            let Rounded { high, low, exact } = known.unwrap_or_else(|| quotient(point.part(k), point.part(3)));
            (point.high[k], point.low[k]) = (high, low);
            point.exact &= exact;
        }
        point
    }

    /// A numerator, or the denominator as number 3.
    #[inline]
    pub(crate) fn part(&self, k: usize) -> View<'_> {
        let first = if k == 0 { 0 } else { self.ends[k - 1] as usize };
        View { words: &self.words.all()[first..self.ends[k] as usize], negative: k < 3 && self.negative[k] }
    }

    /// Words of the longest of the four.
    pub(crate) fn longest(&self) -> usize {
        (0..4).map(|k| self.part(k).words.len()).max().unwrap_or(0)
    }

    /// Compares coordinates. Rounding keeps their order, unless they become the same.
    #[inline]
    pub(crate) fn cmp_along(&self, other: &Self, k: usize) -> Ordering {
        let (a, b) = (self.high[k], other.high[k]);
        if a != b {
            return a.total_cmp(&b);
        }
        if self.exact && other.exact { Ordering::Equal } else { self.cmp_closely(other, k) }
    }

    /// Of two that are rounded to the same.
    fn cmp_closely(&self, other: &Self, k: usize) -> Ordering {
        let (a, b) = (self.low[k], other.low[k]);
        if (a - b).abs() > self.high[k].abs() * (1.0 / (1_u128 << 98) as f64) {
            return a.total_cmp(&b);
        }
        let product = |p: &Self, q: &Self| -> Wide<TWICE> { product(p.part(k), q.part(3)) };
        product(self, other).cmp(&product(other, self))
    }

    pub(crate) fn is(&self, other: &Self) -> bool {
        (0..3).all(|k| self.high[k] == other.high[k]) && (0..3).all(|k| self.cmp_along(other, k).is_eq())
    }
}

/// Words of a short number in units of two to a power.
const LONGEST: usize = 2 + BITS as usize / 64 + 1;

/// Writes a number times two to a power. Returns how many words it has.
fn write(to: &mut [u64], x: u128, power: u32) -> usize {
    let (whole, part) = ((power / 64) as usize, power % 64);
    let (low, high) = (x << part, if part == 0 { 0 } else { x >> (128 - part) });
    let words = [low as u64, (low >> 64) as u64, high as u64];
    let len = if x == 0 { 0 } else { whole + words.iter().rposition(|word| *word != 0).map_or(0, |last| last + 1) };
    if len > 0 {
        to[whole..len].copy_from_slice(&words[..len - whole]);
    }
    len
}

/// A whole number, in units of two to a power, if it has no more bits than a f64 holds: a corner's coordinates have 24, and zeros behind them.
fn whole(x: i128, power: u32) -> Option<Rounded> {
    let zeros = if x == 0 { 0 } else { x.trailing_zeros() };
    let short = x >> zeros;
    let fits = short.unsigned_abs() < 1 << 53;
    fits.then(|| Rounded { high: scaled(short as i64 as f64, (zeros + power) as i32), low: 0.0, exact: true })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Corners, whole numbers that no f64 holds, and fractions, each in units of its own.
        #[test]
        fn short_numbers_make_the_same_points(x in prop::array::uniform3(prop_oneof![Just(0), -(1_i128 << 40)..1 << 40, -(1_i128 << 99)..1 << 99]), by in 0_u32..60, w in prop_oneof![Just(1), 1_i128..1 << 90]) {
            let corner = x.map(|x| x >> by << by);
            let (short, long) = (Point::corner(&corner), Point::new(&corner.map(Int::of), &Int::of(1)));
            prop_assert_eq!(format!("{short:?}"), format!("{long:?}"));
            let short = Point::of(x, w as u128, by, [None; 3]);
            let long = Point::new(&x.map(|x| Int::of(x).shifted(by).negated()), &Int::of(-w));
            prop_assert_eq!(format!("{short:?}"), format!("{long:?}"));
        }
    }
}
