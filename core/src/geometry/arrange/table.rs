//! Every point of an arrangement once.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use crate::geometry::arrange::point::Point;

/// Points by what they are rounded to. Only asked, never listed.
#[derive(Default)]
pub(crate) struct Table {
    pub(crate) points: Vec<Point>,
    /// The latest point that is rounded so; then the one before, by point.
    latest: HashMap<[u64; 3], u32, BuildHasherDefault<Mix>>,
    before: Vec<u32>,
}

impl Table {
    /// The number of a point.
    pub(crate) fn intern(&mut self, point: Point) -> u32 {
        let next = self.points.len() as u32;
        let latest = self.latest.entry(point.high.map(f64::to_bits)).or_insert(next);
        let mut same = *latest;
        while same != next {
            if self.points[same as usize].is(&point) {
                return same;
            }
            same = self.before[same as usize];
        }
        // The list ends where a number says its own.
        self.before.push(if *latest == next { next } else { *latest });
        *latest = next;
        self.points.push(point);
        next
    }
}

/// Keys are the bits of coordinates: nobody chooses them to collide, and a few multiplications spread them.
#[derive(Default)]
pub(crate) struct Mix(u64);

impl Hasher for Mix {
    fn finish(&self) -> u64 {
        self.0 ^ self.0 >> 29
    }

    fn write(&mut self, bytes: &[u8]) {
        for chunk in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            self.write_u64(u64::from_le_bytes(word));
        }
    }

    fn write_u64(&mut self, word: u64) {
        let mixed = (self.0 ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        self.0 = mixed ^ mixed >> 32;
    }
}
