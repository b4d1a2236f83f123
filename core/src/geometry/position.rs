//! Positions as they are told apart: by their numbers, zero having one sign.
//!
//! A record may hold −0.0, which is equal to 0.0 and has other bits. So a position is looked up, ordered and compared as a [`Position`] only,
//! which has no −0.0, and nothing else asks for the bits of an f32 (clippy forbids it to the rest of the crate). Records that nothing changes keep
//! theirs: they leave as bytes, and never as positions.
//!
//! Hot loops work on lanes and tables of plain coordinates; [`canonical`], [`corners`] and [`bits`] are for them.

use std::cmp::Ordering;
use std::hash::{Hash, Hasher};

use glam::DVec3;

use crate::io::record::{self, Point, Record};

/// Three finite coordinates without −0.0. Equal, ordered and hashed by their bits: two are equal if and only if their numbers are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Position(Point);

impl Position {
    pub(crate) const ORIGIN: Self = Self([0.0; 3]);

    /// The position at these coordinates, which are finite.
    #[inline]
    pub(crate) fn of(p: Point) -> Self {
        debug_assert!(p.iter().all(|x| x.is_finite()), "{p:?} is no position");
        Self(canonical(p))
    }

    /// The nearest position to a place, which is a number: beyond the largest of single precision, a largest one.
    #[expect(clippy::disallowed_methods, reason = "the one place where places are rounded to positions")]
    pub(crate) fn nearest(place: DVec3) -> Self {
        Self::of(place.as_vec3().to_array().map(|x| x.clamp(-f32::MAX, f32::MAX)))
    }

    /// The position at exactly this place, if single precision has it.
    pub(crate) fn exactly(place: [f64; 3]) -> Option<Self> {
        let p = place.map(|x| x as f32);
        (p.map(f64::from) == place && p.iter().all(|x| x.is_finite())).then(|| Self::of(p))
    }

    #[inline]
    pub(crate) fn coordinates(self) -> Point {
        self.0
    }

    #[inline]
    fn bits(self) -> [u32; 3] {
        bits(self.0)
    }
}

impl PartialEq for Position {
    #[inline]
    fn eq(&self, other: &Self) -> bool {
        self.bits() == other.bits()
    }
}

impl Eq for Position {}

impl PartialOrd for Position {
    #[inline]
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Position {
    /// By bits: any order serves that is always the same.
    #[inline]
    fn cmp(&self, other: &Self) -> Ordering {
        self.bits().cmp(&other.bits())
    }
}

impl Hash for Position {
    #[inline]
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.bits().hash(state);
    }
}

/// The same coordinates without −0.0.
#[inline(always)]
pub(crate) fn canonical(p: Point) -> Point {
    [p[0] + 0.0, p[1] + 0.0, p[2] + 0.0]
}

/// The corners of a record without −0.0.
#[inline(always)]
pub(crate) fn corners(record: &Record) -> [Point; 3] {
    record::corners(record).map(canonical)
}

/// The bits of canonical coordinates, for a hash.
#[inline(always)]
#[expect(clippy::disallowed_methods, reason = "the one place where coordinates become bits")]
pub(crate) fn bits(p: Point) -> [u32; 3] {
    [p[0].to_bits(), p[1].to_bits(), p[2].to_bits()]
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use proptest::prelude::*;

    use super::*;

    /// Any finite number, and often one of a few.
    fn coordinate() -> impl Strategy<Value = f32> {
        let any = any::<u32>().prop_map(f32::from_bits).prop_filter("finite", |x| x.is_finite());
        prop_oneof![any, prop::sample::select(vec![-0.0, 0.0, 1.0, -1.0, f32::from_bits(1), -f32::from_bits(1), f32::MAX])]
    }

    proptest! {
        #[test]
        fn positions_are_equal_if_and_only_if_their_numbers_are(
            a in prop::array::uniform3(coordinate()), b in prop::array::uniform3(coordinate()), same in any::<[bool; 3]>(),
        ) {
            // Some coordinates in common, but for the sign of zero.
            let b: Point = std::array::from_fn(|k| if !same[k] { b[k] } else if a[k] == 0.0 { -a[k] } else { a[k] });
            let [p, q] = [a, b].map(Position::of);
            prop_assert_eq!(p == q, a == b);
            prop_assert_eq!(p.cmp(&q) == Ordering::Equal, a == b);
            prop_assert_eq!(p.cmp(&q), q.cmp(&p).reverse());
            prop_assert_eq!(HashSet::from([p, q]).len() == 1, a == b);
            prop_assert_eq!(p.coordinates(), a, "as numbers");
            prop_assert!(p.coordinates().iter().all(|x| *x != 0.0 || x.is_sign_positive()));
            prop_assert_eq!(Position::exactly(a.map(f64::from)), Some(p));
            prop_assert_eq!(Position::nearest(DVec3::from_array(a.map(f64::from))), p);
        }
    }

    #[test]
    fn a_place_between_positions_is_exactly_none() {
        assert_eq!(Position::exactly([0.1, 0.0, 0.0]), None);
        assert_eq!(Position::exactly([1e300, 0.0, 0.0]), None);
        assert_eq!(Position::exactly([f64::INFINITY, 0.0, 0.0]), None);
        assert_eq!(Position::nearest(DVec3::new(0.1, -1e-300, 0.0)).coordinates(), [0.1, 0.0, 0.0]);
    }

    #[test]
    fn the_position_nearest_to_a_place_beyond_single_precision_is_finite() {
        let beyond = DVec3::new(f64::from(f32::MAX) * 1.5, -1e300, f64::INFINITY);
        assert_eq!(Position::nearest(beyond).coordinates(), [f32::MAX, -f32::MAX, f32::MAX]);
    }
}
