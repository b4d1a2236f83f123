//! Samples of a surface, and what is near each of them, in two passes over its records.
//!
//! Nothing of a triangle is kept: around a sample stand the smallest of some numbers, which are the same in any order. So memory is that of the samples,
//! whatever the size of the file.

use std::sync::atomic::AtomicU64;
use std::sync::atomic::Ordering::Relaxed;

use glam::DVec3;

use super::cells::Cells;
use super::sphere::{Around, Places, Sample, Touch};
use crate::contract::progress::Progress;
use crate::contract::settings::Limits;
use crate::detect::bodies::box_around;
use crate::geometry::boxes::BoxTree;
use crate::geometry::distance::place;
use crate::geometry::spread;
use crate::geometry::sums::Bounds;
use crate::io::read_ahead::Guide;
use crate::io::record::{self, Point, Record};
use crate::util::parallel;

/// Records that a thread takes at a time, at least ...
const SMALLEST_BLOCK: usize = 1024;
/// ... so that there are about so many blocks at most, each of which has a list of its own.
const MOST_BLOCKS: usize = 1 << 14;
/// Steps of work, at most; a minimum as large as a large model would take hours. They are counted, and the same in any order.
const MOST_STEPS: u64 = 1 << 25;
/// Steps for a triangle that a sphere is shrunk to, beside one for each that is in a box with a sample.
const STEPS_OF_TOUCH: u64 = 8;

/// The records of a surface, and what may be spent on it.
#[derive(Clone, Copy)]
pub(crate) struct Surface<'a> {
    pub(crate) records: &'a [Record],
    pub(crate) limits: &'a Limits,
    pub(crate) progress: &'a dyn Progress,
}

impl Surface<'_> {
    /// The results of blocks of records, each told the number of its first one, in order.
    fn each_block<R: Send + Default>(&self, work: impl Fn(u32, &[Record]) -> R + Sync) -> Vec<R> {
        let block = self.records.len().div_ceil(MOST_BLOCKS).max(SMALLEST_BLOCK);
        let mut all = Vec::new();
        let mut first = 0;
        for part in Guide::new(self.records.as_flattened(), self.limits).blocks(self.records) {
            all.extend(parallel::map(self.limits.threads, part.len().div_ceil(block), |i| {
                let here = i * block..part.len().min((i + 1) * block);
                if self.progress.cancelled() { R::default() } else { work((first + here.start) as u32, &part[here]) }
            }));
            first += part.len();
        }
        all
    }

    /// Samples, each for so much `area`.
    pub(super) fn samples(&self, area: f64) -> Vec<Sample> {
        let of_blocks = self.each_block(|first, records| {
            let mut samples = Vec::new();
            for (of, record) in (first..).zip(records) {
                let corners = record::corners(record);
                // Most triangles have none.
                samples.extend(spread::points(&corners, of, area).map(|at| Sample { at, inward: inward(&corners), of }));
            }
            samples
        });
        of_blocks.into_iter().flatten().collect()
    }

    /// All that is around each sample, for spheres of a diameter of `most`; `None` if that is too much. `size`: of the surface's box, at most.
    pub(super) fn around(&self, samples: &[Sample], most: f64, size: f64) -> Option<Vec<Around>> {
        let near = Near::of(samples, most, size);
        let steps = AtomicU64::new(0);
        self.each_block(|first, records| {
            if steps.load(Relaxed) <= MOST_STEPS {
                steps.fetch_add(near.visit(first, records), Relaxed);
            }
        });
        (steps.into_inner() <= MOST_STEPS).then(|| near.found.into_iter().map(Found::into_around).collect())
    }
}

/// Into the material behind a triangle.
fn inward(corners: &[Point; 3]) -> DVec3 {
    let [a, b, c] = corners.map(place);
    -(b - a).cross(c - a).normalize_or_zero()
}

/// Samples by place, and what was found of each so far.
struct Near<'s> {
    samples: &'s [Sample],
    most: f64,
    cells: Cells,
    tree: BoxTree,
    found: Vec<Found>,
}

impl<'s> Near<'s> {
    fn of(samples: &'s [Sample], most: f64, size: f64) -> Self {
        let sphere = |sample: &Sample| box_around(sample.middle(most).to_array(), most * (0.5 + 1e-5));
        Self {
            samples,
            most,
            cells: Cells::of(samples.iter().flat_map(|sample| sample.ways(most)), most / 4.0, size),
            tree: BoxTree::new(&samples.iter().map(sphere).collect::<Vec<_>>()),
            found: samples.iter().map(|_| Found::nothing()).collect(),
        }
    }

    /// Holds each triangle against the samples whose ways its box meets; says how many steps that took.
    fn visit(&self, first: u32, records: &[Record]) -> u64 {
        let mut steps = 0;
        for (number, record) in (first..).zip(records) {
            let corners = record::corners(record);
            let triangle @ [a, b, c] = [place(corners[0]), place(corners[1]), place(corners[2])];
            let around: Places = [a.min(b).min(c), a.max(b).max(c)];
            if !self.cells.may_meet(&around) || !record::all_finite(record) {
                continue;
            }
            self.tree.each_meeting(&Bounds::of(&corners), |i| {
                steps += 1;
                let sample = &self.samples[i as usize];
                if sample.of == number || !sample.has_ahead(&triangle, &around, self.most) {
                    return;
                }
                steps += STEPS_OF_TOUCH;
                if let Some(touch) = sample.touch(&triangle, self.most) {
                    self.found[i as usize].add(&touch);
                }
            });
        }
        steps
    }
}

/// The smallest numbers of a sample, by whoever finds them: bits of numbers that are not negative are in their order.
struct Found {
    wall: AtomicU64,
    /// The last bit says that it is not touched apart.
    other: AtomicU64,
    depth: AtomicU64,
}

impl Found {
    fn nothing() -> Self {
        let nothing = || AtomicU64::new(f64::INFINITY.to_bits());
        Self { wall: nothing(), other: nothing(), depth: nothing() }
    }

    fn add(&self, touch: &Touch) {
        let diameter = touch.diameter.to_bits();
        if !touch.is_opposite {
            self.other.fetch_min(diameter & !1 | u64::from(!touch.is_apart), Relaxed);
        } else if touch.is_apart {
            self.wall.fetch_min(diameter, Relaxed);
        }
        if let Some(depth) = touch.depth {
            self.depth.fetch_min(depth.to_bits(), Relaxed);
        }
    }

    fn into_around(self) -> Around {
        let [wall, other, depth] = [self.wall, self.other, self.depth].map(AtomicU64::into_inner);
        Around { wall: f64::from_bits(wall), other: (f64::from_bits(other & !1), other & 1 == 0), depth: f64::from_bits(depth) }
    }
}
