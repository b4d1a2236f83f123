//! The positions that faces refer to, wherever they lie.

use super::spool::{Items, POSITION_BYTES};
use crate::io::record::Point;

/// Positions at equal steps in bytes: in a spool of them, or in the file itself.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vertices<'a> {
    bytes: &'a [u8],
    stride: usize,
    count: usize,
}

impl<'a> Vertices<'a> {
    /// Those of a spool.
    pub(crate) fn spooled(positions: &'a [[u8; POSITION_BYTES]]) -> Self {
        Self { bytes: positions.as_flattened(), stride: POSITION_BYTES, count: positions.len() }
    }

    /// Those in a file: each stands at the beginning of `stride` bytes, as three little-endian `f32`.
    fn in_place(bytes: &'a [u8], stride: usize, count: usize) -> Self {
        Self { bytes, stride, count }
    }

    /// So many.
    pub(crate) fn len(&self) -> usize {
        self.count
    }

    /// The position of this index, if there is one.
    #[inline]
    pub(crate) fn get(&self, index: u64) -> Option<Point> {
        let index = usize::try_from(index).ok().filter(|index| *index < self.count)?;
        let from = index * self.stride;
        let [a, b, c, d, e, f, g, h, i, j, k, l] = *self.bytes.get(from..)?.first_chunk::<12>()?;
        Some([f32::from_le_bytes([a, b, c, d]), f32::from_le_bytes([e, f, g, h]), f32::from_le_bytes([i, j, k, l])])
    }
}

/// Where the positions of a file lie.
#[derive(Debug)]
pub(crate) enum Positions {
    /// In the file: so many, the first from this byte on, each at the beginning of `stride` bytes.
    InPlace {
        from: usize,
        stride: usize,
        count: usize,
    },
    Spooled(Items<POSITION_BYTES>),
}

impl Positions {
    /// Those of a file of these bytes.
    pub(crate) fn vertices<'v>(&'v self, bytes: &'v [u8]) -> Vertices<'v> {
        match self {
            Self::InPlace { from, stride, count } => Vertices::in_place(bytes.get(*from..).unwrap_or_default(), *stride, *count),
            Self::Spooled(items) => Vertices::spooled(items.all()),
        }
    }
}

/// A position as a spool holds it.
#[inline]
pub(super) fn packed(point: Point) -> [u8; POSITION_BYTES] {
    let mut bytes = [0; POSITION_BYTES];
    let (words, _) = bytes.as_chunks_mut::<4>();
    for (word, value) in words.iter_mut().zip(point) {
        *word = value.to_le_bytes();
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_come_back_from_either_place() {
        let points = [[1.0, -0.0, f32::MAX], [f32::MIN_POSITIVE, 2.5, -3.0]];
        let packed = points.map(packed);
        let spooled = Vertices::spooled(&packed);
        // With a byte of colour behind each.
        let wide: Vec<u8> = packed.iter().flat_map(|position| position.iter().copied().chain([7])).collect();
        let in_place = Vertices::in_place(&wide, 13, 2);
        for vertices in [spooled, in_place] {
            assert_eq!((vertices.len(), vertices.get(0), vertices.get(1)), (2, Some(points[0]), Some(points[1])));
            assert_eq!([2, u64::MAX].map(|index| vertices.get(index)), [None; 2]);
        }
        assert_eq!(Vertices::in_place(&wide[..20], 13, 2).get(1), None, "a file that ends early");
    }
}
