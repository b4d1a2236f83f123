//! Boxes of stretches of a file: records that follow each other mostly lie near each other, so that a search for what lies at some places can
//! pass over most of the file without decoding it.

use crate::geometry::sums::Bounds;
use crate::io::record::Record;
use crate::stream::columns::{Columns, Extremes};

/// Records of the shortest stretch.
pub(crate) const SHORTEST: usize = 64;

/// There are at most so many stretches.
const MOST: usize = 1 << 20;

/// The boxes of all stretches of the same length, from the first record on. Without boxes, nothing is known.
#[derive(Debug, Default)]
pub(crate) struct Stretches {
    boxes: Vec<Bounds>,
    /// Records of a stretch; the last one may have fewer.
    length: usize,
}

impl Stretches {
    /// How long stretches of so many records are: a multiple of [`SHORTEST`].
    pub(crate) fn length(records: usize) -> usize {
        records.div_ceil(MOST).max(1).next_multiple_of(SHORTEST)
    }

    /// `boxes`: of all records, by stretches of this length.
    pub(crate) fn new(boxes: Vec<Bounds>, length: usize) -> Self {
        Self { boxes, length }
    }

    /// Bytes that the boxes take on the heap.
    pub(crate) fn heap_bytes(&self) -> usize {
        self.boxes.capacity() * size_of::<Bounds>()
    }

    /// Visits the parts of a run of records that lie in stretches whose box is `near`: the first record and how many. `state` is at hand for both.
    #[inline(always)]
    pub(super) fn each_near<S>(
        &self,
        (first, count): (u32, u32),
        state: &mut S,
        near: &impl Fn(&mut S, &Bounds) -> bool,
        mut visit: impl FnMut(&mut S, u32, u32),
    ) {
        let (mut at, end) = (first as usize, first as usize + count as usize);
        while at < end {
            let stretch = at.checked_div(self.length);
            let Some((bounds, stretch)) = stretch.and_then(|stretch| Some((self.boxes.get(stretch)?, stretch))) else {
                return visit(state, at as u32, (end - at) as u32);
            };
            let next = end.min((stretch + 1) * self.length);
            if near(state, bounds) {
                visit(state, at as u32, (next - at) as u32);
            }
            at = next;
        }
    }
}

/// The box of all records whose corners are numbers; those of others may lie outside.
pub(crate) fn bounds(records: &[Record]) -> Bounds {
    let mut extremes = Extremes::EMPTY;
    records.iter().for_each(|record| extremes.include(&Columns::of(record)));
    let mut bounds = Bounds::EMPTY;
    extremes.add_to(&mut bounds);
    bounds
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::io::record;

    proptest! {
        /// Whatever else stands between them: a corner that is no number hides no other record.
        #[test]
        fn every_finite_record_lies_in_the_box(
            corners in prop::collection::vec(
                prop::array::uniform3(prop::array::uniform3(prop_oneof![20 => -3f32..3.0, 1 => Just(f32::NAN), 1 => Just(f32::INFINITY)])),
                0..200,
            ),
        ) {
            let records: Vec<Record> = corners.iter().map(|c| record::assemble([f32::NAN; 3], *c, u16::MAX)).collect();
            let all = bounds(&records);
            for c in corners.iter().filter(|c| c.iter().flatten().all(|x| x.is_finite())) {
                prop_assert!(all.contains(&Bounds::of(c)));
            }
        }

        /// Parts of a run come in order, each record whose stretch is near once, and no other.
        #[test]
        fn runs_are_cut_at_stretches(near in prop::collection::vec(any::<bool>(), 0..6), first in 0u32..700, count in 0u32..700) {
            let at = |i: usize| Bounds { lo: [i as f32, 0.0, 0.0], hi: [i as f32; 3] };
            let stretches = Stretches::new((0..near.len()).map(at).collect(), 100);
            let mut got = Vec::new();
            let is_near = |_: &mut Vec<u32>, b: &Bounds| near[b.lo[0] as usize];
            stretches.each_near((first, count), &mut got, &is_near, |got, first, count| got.extend(first..first + count));
            let want: Vec<u32> = (first..first + count).filter(|i| near.get(*i as usize / 100) != Some(&false)).collect();
            prop_assert_eq!(got, want);
        }
    }

    #[test]
    fn there_are_never_too_many_stretches() {
        for records in [0, 1, 63, 64, 65, 1 << 20, 1 << 26, (1 << 26) + 1, u32::MAX as usize] {
            let length = Stretches::length(records);
            assert!(records.div_ceil(length) <= MOST && length.is_multiple_of(SHORTEST));
        }
    }
}
