//! The weights of parts of a triangulation, in rows that are looked through many at a time.

use std::ops::Range;

/// The weight that is minimised first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Weight {
    /// The sharpest bend, then the area.
    Bend,
    /// The area, then the sharpest bend.
    Area,
}

/// Bends, which are whole numbers, and areas of parts; an infinite area: there is no such part.
#[derive(Clone)]
pub(super) struct Weights {
    bends: Vec<f64>,
    areas: Vec<f64>,
}

/// Those of some parts in a row.
#[derive(Clone, Copy)]
pub(super) struct Row<'a> {
    bends: &'a [f64],
    areas: &'a [f64],
}

impl Weights {
    /// No part of `count`.
    pub(super) fn none(count: usize) -> Self {
        Self { bends: vec![f64::from(u32::MAX); count], areas: vec![f64::INFINITY; count] }
    }

    pub(super) fn set(&mut self, at: usize, bend: u32, area: f64) {
        (self.bends[at], self.areas[at]) = (f64::from(bend), area);
    }

    pub(super) fn get(&self, at: usize) -> (u32, f64) {
        (self.bends[at] as u32, self.areas[at])
    }

    pub(super) fn row(&self, at: Range<usize>) -> Row<'_> {
        Row { bends: &self.bends[at.clone()], areas: &self.areas[at] }
    }
}

/// Weights that are looked at together.
const WIDTH: usize = 8;

/// The first place at which the sum of two rows (of the bends the larger, of the areas the sum) is less than these weights, which are of a part or
/// of none, and what it weighs there.
pub(super) fn first_before(rows: [Row<'_>; 2], than: (u32, f64), weight: Weight) -> Option<(usize, u32, f64)> {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512vl") && is_x86_feature_detected!("avx512dq") {
            // SAFETY: the processor has what it is compiled for.
            return unsafe { first_before_avx512(rows, than, weight) };
        }
        if is_x86_feature_detected!("avx2") {
            // SAFETY: as above.
            return unsafe { first_before_avx2(rows, than, weight) };
        }
    }
    search(rows, than, weight)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx512dq")]
fn first_before_avx512(rows: [Row<'_>; 2], than: (u32, f64), weight: Weight) -> Option<(usize, u32, f64)> {
    search(rows, than, weight)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn first_before_avx2(rows: [Row<'_>; 2], than: (u32, f64), weight: Weight) -> Option<(usize, u32, f64)> {
    search(rows, than, weight)
}

#[inline(always)]
fn search([left, right]: [Row<'_>; 2], than: (u32, f64), weight: Weight) -> Option<(usize, u32, f64)> {
    let than = (f64::from(than.0), than.1);
    match weight {
        Weight::Bend => search_by([left, right], |bend, area| (bend < than.0) | ((bend == than.0) & (area < than.1))),
        Weight::Area => search_by([left, right], |bend, area| (area < than.1) | ((area == than.1) & (bend < than.0))),
    }
}

#[inline(always)]
fn search_by([left, right]: [Row<'_>; 2], is_before: impl Fn(f64, f64) -> bool) -> Option<(usize, u32, f64)> {
    let count = left.bends.len();
    let at = |m: usize| {
        let bend = if left.bends[m] > right.bends[m] { left.bends[m] } else { right.bends[m] };
        (bend, left.areas[m] + right.areas[m])
    };
    let one = |m: usize| {
        let (bend, area) = at(m);
        (area != f64::INFINITY && is_before(bend, area)).then_some((m, bend as u32, area))
    };
    let whole = count - count % WIDTH;
    for first in (0..whole).step_by(WIDTH) {
        let eight = |values: &[f64]| -> [f64; WIDTH] { std::array::from_fn(|l| values[first + l]) };
        let (bends, areas) = ([eight(left.bends), eight(right.bends)], [eight(left.areas), eight(right.areas)]);
        let mut any = false;
        for l in 0..WIDTH {
            let bend = if bends[0][l] > bends[1][l] { bends[0][l] } else { bends[1][l] };
            let area = areas[0][l] + areas[1][l];
            any |= (area != f64::INFINITY) & is_before(bend, area);
        }
        if any {
            return (first..first + WIDTH).find_map(one);
        }
    }
    (whole..count).find_map(one)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_is_found_is_the_first(
            parts in prop::collection::vec(prop::array::uniform2((0u32..4, 0u32..5)), 0..40),
            than in (0u32..7, 0u32..9),
            none in any::<bool>(),
        ) {
            let mut weights = [Weights::none(parts.len()), Weights::none(parts.len())];
            // No area at all is less than 4.
            let area = |x: u32| if x == 4 { f64::INFINITY } else { f64::from(x) };
            for (at, two) in parts.iter().enumerate() {
                weights.iter_mut().zip(two).for_each(|(weights, (bend, x))| weights.set(at, *bend, area(*x)));
            }
            let than = if none { (u32::MAX, f64::INFINITY) } else { (than.0, f64::from(than.1)) };
            for weight in [Weight::Bend, Weight::Area] {
                let rows = [weights[0].row(0..parts.len()), weights[1].row(0..parts.len())];
                let want = parts.iter().enumerate().find_map(|(at, [left, right])| {
                    let (bend, area) = (left.0.max(right.0), area(left.1) + area(right.1));
                    let before = match weight {
                        Weight::Bend => (bend, area) < than,
                        Weight::Area => (area, bend) < (than.1, than.0),
                    };
                    (area < f64::INFINITY && before).then_some((at, bend, area))
                });
                prop_assert_eq!(first_before(rows, than, weight), want);
                prop_assert_eq!(search(rows, than, weight), want);
            }
        }
    }
}
