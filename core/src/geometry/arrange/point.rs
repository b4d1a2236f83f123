//! Points where planes meet, exactly: over one denominator, made from corners and never from other such points, so that their numbers
//! stay short (Attene, "Indirect predicates for geometric constructions", Computer-Aided Design 126, 2020).

use std::cmp::Ordering;

use crate::geometry::arrange::wide::Wide;

/// Words of what a point is made of: seven times the bits of a coordinate, and a few.
pub(crate) const WORDS: usize = 12;

/// Bits of a coordinate, at most.
pub(crate) const BITS: u32 = 100;

/// Words of products of two such.
const TWICE: usize = 2 * WORDS;

type Int = Wide<WORDS>;

/// A corner, in units in which all corners are whole.
pub(crate) type Corner = [i128; 3];

/// A point as three numerators and a positive denominator, and what is known of it in floating point.
#[derive(Clone, Debug)]
pub(crate) struct Point {
    /// Words of all four, one after the other.
    words: Box<[u64]>,
    ends: [u8; 4],
    negative: [bool; 3],
    /// The coordinates rounded to the nearest f64.
    pub(crate) high: [f64; 3],
    /// What is missing, nearly: by 2⁻¹⁰⁰ of the coordinate.
    pub(crate) low: [f64; 3],
    /// Nothing is missing.
    pub(crate) exact: bool,
}

impl Point {
    pub(crate) fn corner(p: &Corner) -> Self {
        let (x, one) = (p.map(Int::of), Int::of(1));
        // A corner's coordinates have 24 bits, and zeros behind them.
        let is_exact = p.iter().all(|x| *x as f64 as i128 == *x);
        let rounded = if is_exact { p.map(|x| (x as f64, 0.0, true)) } else { x.map(|x| quotient(&x, &one)) };
        Self::packed(&x, &one, rounded)
    }

    fn new(x: [Int; 3], w: Int) -> Self {
        let (x, w) = if w.sign() < 0 { (x.map(Int::negated), w.negated()) } else { (x, w) };
        Self::packed(&x, &w, x.map(|x| quotient(&x, &w)))
    }

    /// Numerators over a positive denominator, with their [`quotient`]s.
    fn packed(x: &[Int; 3], w: &Int, rounded: [(f64, f64, bool); 3]) -> Self {
        let all = [&x[0], &x[1], &x[2], w];
        // Of just this length, so that no other box is needed.
        let mut words = Vec::with_capacity(all.iter().map(|part| part.words().len()).sum());
        let ends = all.map(|part| {
            words.extend_from_slice(part.words());
            words.len() as u8
        });
        Self {
            words: words.into_boxed_slice(),
            ends,
            negative: x.each_ref().map(|x| x.sign() < 0),
            high: rounded.map(|r| r.0),
            low: rounded.map(|r| r.1),
            exact: rounded.iter().all(|r| r.2),
        }
    }

    /// A numerator, or the denominator as number 3.
    pub(crate) fn part(&self, k: usize) -> Int {
        let first = if k == 0 { 0 } else { self.ends[k - 1] as usize };
        Int::of_words(&self.words[first..self.ends[k] as usize], k < 3 && self.negative[k])
    }

    /// Compares coordinates. Rounding keeps their order, unless they become the same.
    pub(crate) fn cmp_along(&self, other: &Self, k: usize) -> Ordering {
        let (a, b) = (self.high[k], other.high[k]);
        if a != b {
            return a.total_cmp(&b);
        }
        let product = |p: &Self, q: &Self| -> Wide<TWICE> { p.part(k).times(&q.part(3)) };
        if self.exact && other.exact { Ordering::Equal } else { product(self, other).cmp(&product(other, self)) }
    }

    pub(crate) fn is(&self, other: &Self) -> bool {
        (0..3).all(|k| self.high[k] == other.high[k]) && (0..3).all(|k| self.cmp_along(other, k).is_eq())
    }
}

/// A quotient rounded to the nearest f64 (ties to even), the rest of it, nearly, and whether there is none.
fn quotient(x: &Int, w: &Int) -> (f64, f64, bool) {
    let mut rest = Rest { numerator: *x, scale: 0 };
    let first = rest.step(w);
    let second = rest.step(w);
    let high = first + second;
    let low = second - (high - first);
    if rest.numerator.sign() == 0 {
        return (high, low, low == 0.0);
    }
    // No zero: else nothing would be left.
    let towards = if low > 0.0 { high.next_up() } else { high.next_down() };
    let to_half = 0.5 * (towards - high).abs() - low.abs();
    let third = rest.step(w);
    let beyond = if low > 0.0 { third } else { -third };
    let past = to_half < beyond || to_half == beyond && rest.numerator.sign() == if low > 0.0 { 1 } else { -1 };
    if past { (towards, low - (towards - high) + third, false) } else { (high, low + third, false) }
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

/// The plane of three corners: n · x = d.
#[derive(Clone, Debug)]
pub(crate) struct Plane {
    pub(crate) normal: [Int; 3],
    pub(crate) offset: Int,
}

fn difference(a: &Corner, b: &Corner) -> [Int; 3] {
    std::array::from_fn(|k| Int::of(a[k] - b[k]))
}

fn minor(a: &Int, b: &Int, c: &Int, d: &Int) -> Int {
    let (p, q): (Int, Int) = (a.times(d), b.times(c));
    p.minus(&q)
}

pub(crate) fn cross(u: &[Int; 3], v: &[Int; 3]) -> [Int; 3] {
    [minor(&u[1], &u[2], &v[1], &v[2]), minor(&u[2], &u[0], &v[2], &v[0]), minor(&u[0], &u[1], &v[0], &v[1])]
}

fn dot<const M: usize>(u: &[Int; 3], v: &[Int; 3]) -> Wide<M> {
    let [a, b, c]: [Wide<M>; 3] = std::array::from_fn(|k| u[k].times(&v[k]));
    a.plus(&b).plus(&c)
}

impl Plane {
    pub(crate) fn of(t: &[Corner; 3]) -> Self {
        Self::with(cross(&difference(&t[1], &t[0]), &difference(&t[2], &t[0])), &t[0])
    }

    /// Through an edge, and along an axis.
    fn upright([a, b]: &[Corner; 2], axis: usize) -> Self {
        let mut up = [0; 3];
        up[axis] = 1;
        Self::with(cross(&difference(b, a), &up.map(Int::of)), a)
    }

    fn with(normal: [Int; 3], through: &Corner) -> Self {
        let offset = dot(&normal, &through.map(Int::of));
        Self { normal, offset }
    }

    /// The side of a point, exactly.
    pub(crate) fn side(&self, p: &Point) -> i8 {
        let x = [p.part(0), p.part(1), p.part(2)];
        let right: Wide<TWICE> = self.offset.times(&p.part(3));
        dot::<TWICE>(&self.normal, &x).minus(&right).sign()
    }
}

/// Where the line through two corners meets a plane; `None` if they are parallel.
pub(crate) fn on_line([a, b]: &[Corner; 2], plane: &Plane) -> Option<Point> {
    let along = difference(b, a);
    let w: Int = dot(&plane.normal, &along);
    if w.sign() == 0 {
        return None;
    }
    let start = a.map(Int::of);
    let far = plane.offset.minus(&dot(&plane.normal, &start));
    let x = std::array::from_fn(|k| {
        let (p, q): (Int, Int) = (start[k].times(&w), along[k].times(&far));
        p.plus(&q)
    });
    Some(Point::new(x, w))
}

/// Where two lines through corners meet that lie in one plane, seen along an axis that is not in it.
pub(crate) fn on_lines(first: &[Corner; 2], second: &[Corner; 2], axis: usize) -> Option<Point> {
    on_line(first, &Plane::upright(second, axis))
}

/// Where three planes meet; `None` if that is no single point.
pub(crate) fn on_planes(a: &Plane, b: &Plane, c: &Plane) -> Option<Point> {
    let parts = [cross(&b.normal, &c.normal), cross(&c.normal, &a.normal), cross(&a.normal, &b.normal)];
    let w: Int = dot(&a.normal, &parts[0]);
    if w.sign() == 0 {
        return None;
    }
    let x = std::array::from_fn(|k| dot(&[a.offset, b.offset, c.offset], &[parts[0][k], parts[1][k], parts[2][k]]));
    Some(Point::new(x, w))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Against divisions that f64 rounds itself.
        #[test]
        fn quotients_are_rounded_as_ieee_754_says(x in -(1_i64 << 53)..1 << 53, w in 1_i64..1 << 53, by in 0_u32..300) {
            let (high, low, exact) = quotient(&Int::of(x.into()).shifted(by), &Int::of(w.into()));
            prop_assert_eq!(high, scaled(x as f64 / w as f64, by as i32));
            prop_assert!(low.abs() <= high.abs() * f64::EPSILON / 2.0);
            prop_assert!(!exact || low == 0.0);
        }
    }

    proptest! {
        /// Corners, and whole numbers that no f64 holds.
        #[test]
        fn a_corner_is_a_point_over_one(x in prop::array::uniform3(prop_oneof![Just(0), -(1_i128 << 40)..1 << 40, -(1_i128 << 99)..1 << 99]), by in 0_u32..60) {
            let x = x.map(|x| x >> by << by);
            let (short, long) = (Point::corner(&x), Point::new(x.map(Int::of), Int::of(1)));
            prop_assert_eq!(format!("{short:?}"), format!("{long:?}"));
        }
    }

    #[test]
    fn halves_are_rounded_to_even_and_a_little_more_is_not() {
        let odd = (1_i128 << 53) + 1;
        let quotient = |x: Int, w: Int| quotient(&x, &w).0;
        assert_eq!(quotient(Int::of(odd), Int::of(1)), (1_u64 << 53) as f64);
        assert_eq!(quotient(Int::of(odd + 2), Int::of(1)), ((1_u64 << 53) + 4) as f64);
        // Two to the −200 more or less than half.
        let (one, far) = (Int::of(1), Int::of(odd).shifted(200));
        assert_eq!(quotient(far.plus(&one), one.shifted(200)), ((1_u64 << 53) + 2) as f64);
        assert_eq!(quotient(far.minus(&one), one.shifted(200)), (1_u64 << 53) as f64);
        assert_eq!(quotient(far.plus(&one).negated(), one.shifted(200)), -(((1_u64 << 53) + 2) as f64));
    }
}
