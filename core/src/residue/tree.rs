//! A hierarchy of boxes over the pieces of a path, in flat arrays.
//!
//! Neighbours along the path are neighbours in space: leaves are runs of pieces in the path's order. The runs are sorted along a
//! Morton curve, and each level above joins four boxes.

use crate::curves::vector::{Point, add};
use rayon::prelude::*;

/// Pieces of a leaf, at most.
const RUN: usize = 8;
/// Boxes that a box of the next level joins.
const JOINED: usize = 4;

/// The places that a piece of a path reaches.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reach {
    /// Of the tool's tip.
    pub(crate) ends: [Point; 2],
    /// The way from the tip along the whole axis, of a tool that leans.
    pub(crate) shank: Option<Point>,
}

/// A box of places, its corners rounded outwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    pub(crate) low: [f32; 3],
    pub(crate) high: [f32; 3],
}

impl Bounds {
    const NONE: Self = Self { low: [f32::INFINITY; 3], high: [f32::NEG_INFINITY; 3] };

    fn take(&mut self, point: Point) {
        for ((low, high), x) in self.low.iter_mut().zip(&mut self.high).zip(point) {
            let near = x as f32;
            *low = low.min(if f64::from(near) > x { near.next_down() } else { near });
            *high = high.max(if f64::from(near) < x { near.next_up() } else { near });
        }
    }

    fn join(mut self, other: &Self) -> Self {
        for axis in 0..3 {
            self.low[axis] = self.low[axis].min(other.low[axis]);
            self.high[axis] = self.high[axis].max(other.high[axis]);
        }
        self
    }

    /// How far a point is from the box along each axis; 0 within.
    pub(crate) fn away(&self, point: Point) -> Point {
        let mut away = [0.0; 3];
        for axis in 0..3 {
            let (low, high) = (f64::from(self.low[axis]), f64::from(self.high[axis]));
            away[axis] = (low - point[axis]).max(point[axis] - high).max(0.0);
        }
        away
    }

    fn middle(&self) -> Point {
        [0, 1, 2].map(|axis: usize| 0.5 * (f64::from(self.low[axis]) + f64::from(self.high[axis])))
    }

    /// Whether a plane through a point may cross the box.
    pub(crate) fn meets_plane(&self, point: Point, normal: Point) -> bool {
        let middle = self.middle();
        let (mut level, mut reach) = (0.0, 0.0);
        for axis in 0..3 {
            level += (middle[axis] - point[axis]) * normal[axis];
            reach += (f64::from(self.high[axis]) - middle[axis]) * normal[axis].abs();
        }
        level.abs() <= reach * (1.0 + 1e-9) + 1e-9
    }
}

/// A run of pieces.
#[derive(Clone, Copy, Debug)]
struct Run {
    first: u32,
    count: u32,
}

/// The hierarchy. About 4 bytes a piece.
#[derive(Default)]
pub(crate) struct Tree {
    runs: Vec<Run>,
    /// Boxes from the runs upwards; the last level has one box.
    levels: Vec<Vec<Bounds>>,
}

impl Tree {
    /// Builds it in parallel over the pieces with numbers below `pieces`; the order of runs is that of their keys and numbers, whatever the threads. O(n log n).
    pub(crate) fn new(pieces: usize, reach: &(impl Fn(u32) -> Option<Reach> + Sync)) -> Self {
        let mut runs = runs(reach, pieces);
        let mut leaves: Vec<Bounds> = runs.par_iter().map(|run| bounds(reach, *run)).collect();
        let all = leaves.iter().fold(Bounds::NONE, Bounds::join);
        let mut order: Vec<(u64, u32)> =
            leaves.par_iter().enumerate().map(|(number, bounds)| (key(bounds.middle(), &all), number as u32)).collect();
        order.par_sort_unstable();
        let sorted = |number: &(u64, u32)| number.1 as usize;
        runs = order.iter().filter_map(|number| runs.get(sorted(number)).copied()).collect();
        leaves = order.iter().filter_map(|number| leaves.get(sorted(number)).copied()).collect();
        let mut levels = vec![leaves];
        while let Some(last) = levels.last().filter(|level| level.len() > 1) {
            levels.push(last.par_chunks(JOINED).map(|few| few.iter().fold(Bounds::NONE, Bounds::join)).collect());
        }
        Self { runs, levels }
    }

    /// The memory that it takes.
    pub(crate) fn bytes(&self) -> u64 {
        let boxes: usize = self.levels.iter().map(Vec::len).sum();
        (self.runs.len() * size_of::<Run>() + boxes * size_of::<Bounds>()) as u64
    }

    /// Visits pieces in runs whose boxes `bound` lets pass, the least bound first: `bound` is lent the box and the best so far and
    /// says how good the box may be; `visit` is lent a piece and may improve the best.
    pub(crate) fn search(
        &self,
        best: &mut f64,
        stack: &mut Vec<(f64, u32, u32)>,
        bound: impl Fn(&Bounds) -> f64,
        mut visit: impl FnMut(u32, &mut f64),
    ) {
        stack.clear();
        let Some(top) = self.levels.len().checked_sub(1) else { return };
        stack.push((f64::NEG_INFINITY, top as u32, 0));
        while let Some((least, level, place)) = stack.pop() {
            if least >= *best {
                continue;
            }
            let Some(below) = level.checked_sub(1) else {
                let Some(run) = self.runs.get(place as usize) else { continue };
                (run.first..run.first + run.count).for_each(|piece| visit(piece, best));
                continue;
            };
            let Some(boxes) = self.levels.get(below as usize) else { continue };
            let first = place as usize * JOINED;
            let begin = stack.len();
            for (bounds, child) in boxes.iter().skip(first).take(JOINED).zip(first as u32..) {
                let least = bound(bounds);
                if least < *best {
                    stack.push((least, below, child));
                }
            }
            if let Some(few) = stack.get_mut(begin..) {
                few.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(b.2.cmp(&a.2)));
            }
        }
    }
}

/// Runs of pieces that follow each other; numbers that no piece has end a run.
fn runs(reach: &impl Fn(u32) -> Option<Reach>, pieces: usize) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for piece in (0..pieces as u32).filter(|piece| reach(*piece).is_some()) {
        match runs.last_mut() {
            Some(run) if (run.count as usize) < RUN && run.first + run.count == piece => run.count += 1,
            _ => runs.push(Run { first: piece, count: 1 }),
        }
    }
    runs
}

/// A box around the places of the tip; where axes lean, around the whole axis of the tool.
fn bounds(reach: &impl Fn(u32) -> Option<Reach>, run: Run) -> Bounds {
    let mut bounds = Bounds::NONE;
    for one in (run.first..run.first + run.count).filter_map(reach) {
        for tip in one.ends {
            bounds.take(tip);
            if let Some(shank) = one.shank {
                bounds.take(add(tip, shank));
            }
        }
    }
    bounds
}

/// Place on a Morton curve of 21 bits an axis.
fn key(point: Point, all: &Bounds) -> u64 {
    let mut key = 0;
    let size = (0..3).map(|axis| f64::from(all.high[axis]) - f64::from(all.low[axis])).fold(0.0, f64::max);
    for (axis, (x, low)) in point.into_iter().zip(all.low).enumerate() {
        let share = if size > 0.0 { (x - f64::from(low)) / size } else { 0.0 };
        key |= spread((share.clamp(0.0, 1.0) * f64::from((1u32 << 21) - 1)) as u64) << axis;
    }
    key
}

/// Bits of a number, two places free after each.
fn spread(number: u64) -> u64 {
    let mut bits = number & 0x1f_ffff;
    for (shift, mask) in [
        (32, 0x1f_0000_0000_ffff),
        (16, 0x1f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ] {
        bits = (bits | bits << shift) & mask;
    }
    bits
}
