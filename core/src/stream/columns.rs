//! Records against a box, in vectors: the corners are compared as they lie in the file, four floats at a time.

use glam::Vec4;

use crate::geometry::sums::Bounds;
use crate::io::record::{Point, Record};
use crate::stream::plan::HomeBox;

/// The corners of a record, each with something else in a lane: x y z ? for the first two, ? x y z for the last, so that nothing
/// past the record is read.
pub(crate) struct Columns([Vec4; 3]);

impl Columns {
    #[inline(always)]
    pub(crate) fn of(record: &Record) -> Self {
        Self([lanes(record, 12), lanes(record, 24), lanes(record, 32)])
    }
}

/// The four floats at byte `at`, a constant wherever this is called.
#[inline(always)]
fn lanes(record: &Record, at: usize) -> Vec4 {
    let float = |k: usize| f32::from_le_bytes([record[at + k], record[at + k + 1], record[at + k + 2], record[at + k + 3]]);
    Vec4::new(float(0), float(4), float(8), float(12))
}

/// The cell of a chunk, laid out in the same way.
pub(crate) struct CellColumns {
    front: [Vec4; 2],
    back: [Vec4; 2],
}

impl CellColumns {
    pub(crate) fn of(cell: &HomeBox) -> Self {
        let (lo, hi) = cell.ends();
        let ends = |place: fn(Point) -> Vec4| [place(lo), place(hi)];
        Self { front: ends(|[x, y, z]| Vec4::new(x, y, z, 0.0)), back: ends(|[x, y, z]| Vec4::new(0.0, x, y, z)) }
    }

    /// All three corners lie in it. Comparisons written so that NaN is outside.
    #[inline(always)]
    pub(crate) fn holds(&self, Columns([a, b, c]): &Columns) -> bool {
        let inside = |p: &Vec4, [lo, hi]: &[Vec4; 2]| p.cmpge(*lo) & p.cmple(*hi);
        let front = (inside(a, &self.front) & inside(b, &self.front)).bitmask();
        front & 0b0111 == 0b0111 && inside(c, &self.back).bitmask() & 0b1110 == 0b1110
    }
}

/// Smallest and largest coordinates of corners. A record that holds something that is no number may be left out as a whole.
pub(crate) struct Extremes {
    front: [Vec4; 2],
    back: [Vec4; 2],
}

impl Extremes {
    pub(crate) const EMPTY: Self =
        Self { front: [Vec4::INFINITY, Vec4::NEG_INFINITY], back: [Vec4::INFINITY, Vec4::NEG_INFINITY] };

    #[inline(always)]
    pub(crate) fn include(&mut self, Columns([a, b, c]): &Columns) {
        // In this order: of two values, one of which is no number, the instruction takes the second.
        self.front = [a.min(*b).min(self.front[0]), a.max(*b).max(self.front[1])];
        self.back = [c.min(self.back[0]), c.max(self.back[1])];
    }

    pub(crate) fn add_to(&self, bounds: &mut Bounds) {
        let [front, back] = [self.front, self.back].map(|ends| ends.map(|v| v.to_array()));
        let lo = [0, 1, 2].map(|k| front[0][k].min(back[0][k + 1]));
        let hi = [0, 1, 2].map(|k| front[1][k].max(back[1][k + 1]));
        bounds.add(&Bounds { lo, hi });
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::io::record;
    use crate::stream::plan::{ChunkId, Plan};

    proptest! {
        /// As corner by corner, whatever stands in the lanes beside them.
        #[test]
        fn columns_are_the_corners(
            points in prop::collection::vec(
                prop::array::uniform3(prop::array::uniform3(prop_oneof![20 => -3f32..3.0, 1 => Just(f32::NAN), 1 => Just(f32::INFINITY)])),
                1..60,
            ),
            chunk in 1u32..20,
        ) {
            let records: Vec<Record> = points.iter().map(|p| record::assemble([f32::NAN; 3], *p, u16::MAX)).collect();
            let plan = Plan::new(&records, &crate::io::read_ahead::Guide::NONE, chunk);
            for c in 0..plan.chunks() as u32 {
                let home = plan.home_box(ChunkId(c));
                let (cell, mut extremes) = (CellColumns::of(&home), Extremes::EMPTY);
                let (mut want, mut got) = (Bounds::EMPTY, Bounds::EMPTY);
                for (record, corners) in records.iter().zip(&points) {
                    let holds = cell.holds(&Columns::of(record));
                    prop_assert_eq!(holds, corners.iter().all(|p| home.holds(*p)));
                    if holds {
                        extremes.include(&Columns::of(record));
                        want.include(corners);
                    }
                }
                extremes.add_to(&mut got);
                prop_assert_eq!(got, want);
            }
        }
    }
}
