//! The region of each member of a chunk, run-coded.

use crate::util::ids::NONE;
use crate::util::varint::{put_varint, take_varint};

/// The region of each member in list order.
#[derive(Clone, Debug, Default)]
pub(crate) enum Labels {
    /// All members with a regular corner belong to region 0 of the chunk.
    #[default]
    One,
    /// Run-coded: count, then region + 1 (0: none).
    Runs(Vec<u8>),
}

#[derive(Default)]
pub(crate) struct LabelWriter {
    pub(crate) bytes: Vec<u8>,
    pub(crate) region: u32,
    pub(crate) count: u64,
}

impl LabelWriter {
    #[inline]
    pub(crate) fn push(&mut self, region: u32) {
        if region != self.region {
            self.flush();
            self.region = region;
        }
        self.count += 1;
    }

    pub(crate) fn flush(&mut self) {
        if self.count > 0 {
            put_varint(&mut self.bytes, self.count);
            put_varint(&mut self.bytes, u64::from(self.region.wrapping_add(1)));
        }
        self.count = 0;
    }

    pub(crate) fn finish(mut self) -> Vec<u8> {
        self.flush();
        self.bytes.shrink_to_fit();
        self.bytes
    }
}

impl Labels {
    pub(crate) fn heap_bytes(&self) -> u64 {
        match self {
            Self::One => 0,
            Self::Runs(bytes) => bytes.capacity() as u64,
        }
    }

    /// Tells the region of the member at a place of the list, [`NONE`] where it has none; for [`Labels::One`] always region 0. Places have to be asked
    /// for in ascending order.
    pub(crate) fn by_place(&self) -> impl FnMut(usize) -> u32 + '_ {
        let mut rest: &[u8] = match self {
            Self::One => &[],
            Self::Runs(bytes) => bytes,
        };
        let (mut end, mut region) = if matches!(self, Self::One) { (u64::MAX, 0) } else { (0, NONE) };
        move |place| {
            while end <= place as u64 {
                let run = take_varint(&mut rest).zip(take_varint(&mut rest));
                let Some((count, label)) = run else { return NONE };
                end += count;
                region = (label as u32).wrapping_sub(1);
            }
            region
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Whichever places are passed over.
        #[test]
        fn places_have_the_labels_that_were_written(
            labels in prop::collection::vec(prop_oneof![Just(0u32), Just(1), Just(NONE), any::<u32>()], 1..50),
            repeats in 1usize..5,
            asked in prop::collection::vec(any::<bool>(), 260),
        ) {
            let all: Vec<u32> = labels.iter().flat_map(|l| std::iter::repeat_n(*l, repeats)).collect();
            let mut writer = LabelWriter::default();
            all.iter().for_each(|l| writer.push(*l));
            let written = Labels::Runs(writer.finish());
            let mut region = written.by_place();
            for (place, label) in all.iter().enumerate().filter(|(place, _)| asked[*place]) {
                prop_assert_eq!(region(place), *label);
            }
            prop_assert_eq!(region(all.len()), NONE);
        }
    }
}
