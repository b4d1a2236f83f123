//! The region of each member of a chunk, run-coded.

use crate::util::ids::NONE;

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
            crate::util::varint::put_varint(&mut self.bytes, self.count);
            crate::util::varint::put_varint(&mut self.bytes, u64::from(self.region.wrapping_add(1)));
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

    /// The region of each member in list order, [`NONE`] where it has none; for [`Labels::One`] always region 0.
    pub(crate) fn iter(&self) -> impl Iterator<Item = u32> + '_ {
        let mut rest: &[u8] = match self {
            Self::One => &[],
            Self::Runs(bytes) => bytes,
        };
        let (mut left, mut region) = if matches!(self, Self::One) { (u64::MAX, 0) } else { (0, NONE) };
        std::iter::from_fn(move || {
            if left == 0 {
                left = crate::util::varint::take_varint(&mut rest)?;
                region = (crate::util::varint::take_varint(&mut rest)? as u32).wrapping_sub(1);
            }
            left -= 1;
            Some(region)
        })
    }
}
