//! A hash of triangles by their corners.

use crate::geometry::position;
use crate::io::record::Record;

/// A hash of corners, in order. Equal positions have equal bytes in it.
#[derive(Default)]
pub(super) struct Corners {
    hasher: blake3::Hasher,
    triangles: u64,
}

impl Corners {
    pub(super) fn add(&mut self, records: &[Record]) {
        let mut bytes = Vec::with_capacity(36 << 10);
        for group in records.chunks(1 << 10) {
            bytes.clear();
            for corner in group.iter().flat_map(position::corners) {
                bytes.extend(position::bits(corner).map(u32::to_le_bytes).as_flattened());
            }
            self.hasher.update(&bytes);
        }
        self.triangles += records.len() as u64;
    }

    pub(super) fn finish(self) -> (blake3::Hash, u64) {
        (self.hasher.finalize(), self.triangles)
    }
}
