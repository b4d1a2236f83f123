//! A mesh with few triangles that looks like a large one, for a browser that turns it. Corners in one cell of a grid become one, triangles that lose a corner by that
//! go (Rossignac & Borrel, "Multi-resolution 3D approximations for rendering complex scenes", 1993): one pass over the mapped records, and room for what is kept alone. Each
//! cell keeps the first corner in it, so that the same file gives the same mesh. Where too much is kept, the pass ends, and a coarser grid begins anew.
//!
//! Written as numbers of 32 bits, the lowest byte first: [`MAGIC`], vertices, triangles, triangles of the file (low half, high half); then three coordinates a vertex, then
//! three vertices a triangle. A mesh that is small enough is kept whole.

use std::collections::{HashMap, HashSet};

use suture_core::record::{self, Point, Record};

use super::camera::Bounds;

/// How it begins.
const MAGIC: u32 = u32::from_le_bytes(*b"SUT1");
/// Triangles that are kept, at most.
const MOST: usize = 200_000;
/// Cells along the longest side: of the first grid, and of the last, which is taken whatever it gives.
const FINEST: f64 = 256.0;
const COARSEST: f64 = 8.0;

/// A mesh for display.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Coarse {
    vertices: Vec<Point>,
    triangles: Vec<[u32; 3]>,
    /// Triangles of the file.
    of: u64,
}

impl Coarse {
    /// Of all finite triangles; `None` where there is none. O(n) for each grid.
    pub(crate) fn of(records: &[Record], threads: usize) -> Option<Self> {
        Self::within(records, threads, MOST)
    }

    fn within(records: &[Record], threads: usize, most: usize) -> Option<Self> {
        let [lo, hi] = Bounds::of(records, threads, |p| p.map(f64::from))?.ends();
        if records.len() <= most {
            // Both zeros are one place.
            return Self::by(records, most, |p| p.map(|x| (x + 0.0).to_bits())).map_err(|_| ()).ok();
        }
        let longest = (0..3).map(|k| hi[k] - lo[k]).fold(f64::MIN_POSITIVE, f64::max);
        let mut cells = FINEST;
        loop {
            let cell = |p: &Point| std::array::from_fn(|k| ((f64::from(p[k]) - lo[k]) / longest * cells) as u32);
            match Self::by(records, most, cell) {
                Ok(coarse) => return Some(coarse),
                Err(cut) if cells <= COARSEST => return Some(cut),
                Err(_) => cells *= 0.75,
            }
        }
    }

    /// With one vertex for all corners of one key; what was made so far where that are too many triangles.
    fn by(records: &[Record], most: usize, key: impl Fn(&Point) -> [u32; 3]) -> Result<Self, Self> {
        let mut coarse = Self { of: records.len() as u64, ..Self::default() };
        let (mut known, mut seen) = (HashMap::new(), HashSet::new());
        for record in records.iter().filter(|record| record::all_finite(record)) {
            let corners = record::corners(record);
            let keys = [key(&corners[0]), key(&corners[1]), key(&corners[2])];
            if keys[0] == keys[1] || keys[1] == keys[2] || keys[2] == keys[0] {
                continue;
            }
            let triangle: [u32; 3] = std::array::from_fn(|k| {
                *known.entry(keys[k]).or_insert_with(|| {
                    coarse.vertices.push(corners[k]);
                    coarse.vertices.len() as u32 - 1
                })
            });
            // From its smallest vertex on, so that it is the same wherever it begins.
            let first = (0..3).min_by_key(|k| triangle[*k]).unwrap_or(0);
            let turned = std::array::from_fn(|k| triangle[(first + k) % 3]);
            if !seen.insert(turned) {
                continue;
            }
            if coarse.triangles.len() == most {
                return Err(coarse);
            }
            coarse.triangles.push(turned);
        }
        Ok(coarse)
    }

    /// As it is sent.
    pub(crate) fn bytes(&self) -> Vec<u8> {
        let head = [MAGIC, self.vertices.len() as u32, self.triangles.len() as u32, self.of as u32, (self.of >> 32) as u32];
        let places = self.vertices.as_flattened().iter().map(|x| x.to_bits());
        head.into_iter().chain(places).chain(self.triangles.as_flattened().iter().copied()).flat_map(u32::to_le_bytes).collect()
    }
}

#[cfg(test)]
mod tests {
    use suture_core::record::encode;

    use super::*;

    /// A sheet of `n` by `n` squares, bent a little.
    fn sheet(n: usize) -> Vec<Record> {
        let place = |i: usize, k: usize| [i as f32, k as f32, ((i * i + k * k) as f32).sqrt()];
        let square = |i: usize, k: usize| {
            let [a, b, c, d] = [place(i, k), place(i + 1, k), place(i + 1, k + 1), place(i, k + 1)];
            [encode([a, b, c], 0), encode([a, c, d], 0)]
        };
        (0..n).flat_map(|i| (0..n).flat_map(move |k| square(i, k))).collect()
    }

    #[test]
    fn a_small_mesh_is_kept_whole() {
        let mut records = sheet(10);
        let nowhere = encode([[f32::NAN; 3], [0.0; 3], [1.0; 3]], 0);
        records.push(nowhere);
        let coarse = Coarse::of(&records, 2).unwrap();
        assert_eq!((coarse.vertices.len(), coarse.triangles.len(), coarse.of), (121, 200, 201));
        let bytes = coarse.bytes();
        assert_eq!(bytes.len(), 20 + 121 * 12 + 200 * 12);
        let number = |at: usize| u32::from_le_bytes(bytes[4 * at..4 * at + 4].try_into().unwrap());
        assert_eq!((&bytes[..4], number(1), number(2), number(3), number(4)), (&b"SUT1"[..], 121, 200, 201, 0));
        assert_eq!(Coarse::of(&[nowhere], 1), None);
        assert_eq!(Coarse::of(&[], 1), None);
    }

    #[test]
    fn a_large_one_keeps_its_extent_within_the_bound() {
        let records = sheet(100);
        let coarse = Coarse::within(&records, 2, 3000).unwrap();
        assert!((500..=3000).contains(&coarse.triangles.len()), "{}", coarse.triangles.len());
        let far = |k: usize| coarse.vertices.iter().map(|p| p[k]).fold(0.0, f32::max);
        assert!(far(0) > 90.0 && far(1) > 90.0, "{} {}", far(0), far(1));
        assert_eq!(coarse, Coarse::within(&records, 1, 3000).unwrap(), "the same whatever the threads");
        let used = coarse.triangles.as_flattened().iter().max().unwrap();
        assert_eq!(*used as usize + 1, coarse.vertices.len());
    }

    /// Triangles between any cells: even the coarsest grid keeps too many.
    #[test]
    fn a_soup_is_cut_off() {
        let corner = |i: usize| [(i * 7919 % 9973) as f32, (i * 104_729 % 9967) as f32, (i * 1_299_709 % 9949) as f32];
        let records: Vec<_> = (0..20_000).map(|i| encode([corner(3 * i), corner(3 * i + 1), corner(3 * i + 2)], 0)).collect();
        assert_eq!(Coarse::within(&records, 1, 1000).unwrap().triangles.len(), 1000);
    }
}
