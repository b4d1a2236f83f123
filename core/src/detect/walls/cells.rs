//! Which triangles may meet some of many small boxes: cells by their hash, a bit each.
//!
//! There are cells of several sizes, and a triangle is looked up among those that are no smaller than itself: in at most eight, whatever
//! its size.

use glam::DVec3;

use super::sphere::Places;
use crate::util::bits;

/// Sizes of cells grow by this factor.
const GROWTH: f64 = 4.0;
/// Sizes, at most. A triangle that is larger than the largest may meet anything.
const MOST_SIZES: usize = 24;
/// Bits of the hash: half a mebibyte for all cells, which stays in the cache.
const HASH_BITS: u32 = 22;

/// Cells that some boxes touch.
pub(super) struct Cells {
    /// Cells of each size for a unit of length, the smallest cells first.
    per_unit: Vec<f64>,
    marked: Vec<u64>,
}

impl Cells {
    /// `smallest`: the side of the smallest cells; `largest`: no triangle is larger.
    pub(super) fn of(boxes: impl Iterator<Item = Places>, smallest: f64, largest: f64) -> Self {
        let sides = std::iter::successors(Some(smallest), |side| (*side < largest).then_some(side * GROWTH));
        let per_unit = sides.take(MOST_SIZES).map(f64::recip).collect();
        let mut cells = Self { per_unit, marked: vec![0; 1 << (HASH_BITS - 6)] };
        for of in boxes {
            for size in 0..cells.per_unit.len() {
                let [lo, hi] = cells.ends(&of, size);
                each(lo, hi, size, |cell| {
                    bits::put(&mut cells.marked, cell);
                    false
                });
            }
        }
        cells
    }

    /// False only if a box meets none of those that were marked.
    pub(super) fn may_meet(&self, of: &Places) -> bool {
        let side = (of[1] - of[0]).max_element();
        let Some(size) = self.per_unit.iter().position(|per_unit| side * per_unit <= 1.0) else { return true };
        let [lo, hi] = self.ends(of, size);
        each(lo, hi, size, |cell| bits::holds(&self.marked, cell))
    }

    /// The first and the last cell along each axis. Monotonous, so that boxes that meet share a cell.
    fn ends(&self, of: &Places, size: usize) -> [[i64; 3]; 2] {
        let per_unit = self.per_unit[size];
        let cell = |p: DVec3| [floor(p.x * per_unit), floor(p.y * per_unit), floor(p.z * per_unit)];
        [cell(of[0]), cell(of[1])]
    }
}

/// Visits cells by their hash until `visit` says that it is enough; says whether it did.
#[inline]
fn each([x0, y0, z0]: [i64; 3], [x1, y1, z1]: [i64; 3], size: usize, mut visit: impl FnMut(usize) -> bool) -> bool {
    for z in z0..=z1 {
        for y in y0..=y1 {
            for x in x0..=x1 {
                if visit(hash([x, y, z, size as i64])) {
                    return true;
                }
            }
        }
    }
    false
}

/// The whole number below; without SSE 4.1, the processor has no instruction for it.
#[inline]
fn floor(x: f64) -> i64 {
    let towards_zero = x as i64;
    towards_zero.saturating_sub(i64::from(towards_zero as f64 > x))
}

#[inline]
fn hash([x, y, z, size]: [i64; 4]) -> usize {
    const ODD: [u64; 4] = [0x9e37_79b9_7f4a_7c15, 0xc2b2_ae3d_27d4_eb4f, 0x1656_67b1_9e37_79f9, 0xff51_afd7_ed55_8ccd];
    let term = |x: i64, odd: u64| (x as u64).wrapping_mul(odd);
    let mixed = term(x, ODD[0]).wrapping_add(term(y, ODD[1])).wrapping_add(term(z, ODD[2])).wrapping_add(term(size, ODD[3]));
    let mixed = (mixed ^ mixed >> 29).wrapping_mul(ODD[3]);
    (mixed >> (64 - HASH_BITS)) as usize
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// A box that meets a marked one is never told to be far, whatever the sizes.
        #[test]
        fn what_meets_a_box_may_meet_one(
            lo in prop::array::uniform3(-9.0f64..9.0), size in prop::array::uniform3(0.0f64..1.0),
            other in prop::array::uniform3(-9.0f64..9.0), scale in prop_oneof![Just(1e-3f64), Just(1.0), Just(30.0), Just(1e9)],
        ) {
            let of = |lo: [f64; 3], scale: f64| {
                let lo = DVec3::from_array(lo);
                [lo, lo + DVec3::from_array(size) * scale]
            };
            let (marked, other) = (of(lo, 1.0), of(other, scale));
            let cells = Cells::of([marked].into_iter(), 0.25, 64.0);
            let meets = marked[0].cmple(other[1]).all() && marked[1].cmpge(other[0]).all();
            prop_assert!(cells.may_meet(&other) || !meets);
            prop_assert!(cells.may_meet(&marked));
        }
    }

    #[test]
    fn what_is_far_is_told_to_be_far() {
        let at = |x: f64| [DVec3::splat(x), DVec3::splat(x + 0.1)];
        let cells = Cells::of([at(0.0), at(5.0)].into_iter(), 0.25, 64.0);
        let may_meet = (0..1000).filter(|i| cells.may_meet(&at(f64::from(*i) * 0.5))).count();
        assert!((2..20).contains(&may_meet), "{may_meet}");
    }
}
