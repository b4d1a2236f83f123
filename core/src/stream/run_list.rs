//! Ascending triangle numbers as runs, in few bytes.

use crate::util::varint::{put_varint, take_varint};

/// Ascending runs of triangle numbers, as variable-length integers: `distance from the end of the previous run << 1 | longer`,
/// followed by `length − 2` when the run is longer than one.
#[derive(Clone, Debug, Default)]
pub(crate) struct RunList {
    bytes: Vec<u8>,
    end: u32,
}

impl RunList {
    /// Appends a run; returns how many bytes that took.
    pub(super) fn push(&mut self, first: u32, count: u32) -> usize {
        let before = self.bytes.len();
        let gap = u64::from(first - self.end) << 1 | u64::from(count > 1);
        put_varint(&mut self.bytes, gap);
        if count > 1 {
            put_varint(&mut self.bytes, u64::from(count - 2));
        }
        self.end = first + count;
        self.bytes.len() - before
    }

    pub(crate) fn runs(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        let (mut rest, mut end) = (self.bytes.as_slice(), 0u32);
        std::iter::from_fn(move || {
            let gap = take_varint(&mut rest)?;
            let count = if gap & 1 == 1 { take_varint(&mut rest)? as u32 + 2 } else { 1 };
            let first = end + (gap >> 1) as u32;
            end = first + count;
            Some((first, count))
        })
    }

    pub(super) fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    /// Gives back what growing left over.
    pub(super) fn shrink(&mut self) {
        self.bytes.shrink_to_fit();
    }

    /// Bytes that it takes on the heap.
    pub(super) fn heap_bytes(&self) -> usize {
        self.bytes.capacity()
    }
}
