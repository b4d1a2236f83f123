//! Every point of an arrangement once.

use std::collections::HashMap;

use crate::geometry::arrange::point::Point;
use crate::util::ids::NONE;
use crate::util::lean;
use crate::util::scatter::Hashing;

/// Points by what they are rounded to. Only asked, never listed.
#[derive(Default)]
pub(crate) struct Table {
    pub(crate) points: Vec<Point>,
    /// The latest point that is rounded so; then, by point, the one before, or [`NONE`].
    latest: HashMap<[u64; 3], u32, Hashing>,
    before: Vec<u32>,
}

impl Table {
    /// The number of a point.
    pub(crate) fn intern(&mut self, point: Point) -> u32 {
        let next = self.points.len() as u32;
        let latest = self.latest.entry(point.high.map(f64::to_bits)).or_insert(NONE);
        let mut same = *latest;
        while same != NONE {
            if self.points[same as usize].is(&point) {
                return same;
            }
            same = self.before[same as usize];
        }
        lean::push(&mut self.before, *latest);
        *latest = next;
        lean::push(&mut self.points, point);
        next
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::arrange::plane::{Plane, on_line};

    /// The line meets planes a third apart and one part in 2⁶⁰ more or less: not one of the points is what it is rounded to.
    #[test]
    fn points_that_round_alike_are_told_apart() {
        let mut table = Table::default();
        let third = |by: i128| {
            let height = (1_i128 << 90) / 3 + by;
            let plane = Plane::of(&[[0, 0, height], [1, 0, height], [0, 1, height]]);
            on_line(&[[5, 5, 0], [5, 5, 1 << 91]], &plane).unwrap()
        };
        for _ in 0..2 {
            assert_eq!([0, 1, 2, 1].map(|by| table.intern(third(by))), [0, 1, 2, 1]);
        }
    }
}
