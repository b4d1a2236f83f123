//! The loops around a loop, the nearest first, so that those need not be looked at that cannot be the nearest.
//!
//! How near two loops come is bounded from below by their boxes, and by how far their vertices are from the middle of one of them: loops
//! about one axis lie in each other's boxes. A tree halves the loops by where their middles are and how large they are.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::ops::Range;

use glam::DVec3;

use super::shape::Shape;
use crate::geometry::position::Position;
use crate::geometry::sums::Bounds;
use crate::util::steps;

/// Loops that are not halved any more.
const FEW: usize = 4;
/// Much more than what rounding makes of a bound, as a share of the lengths in it.
const SLACK: f64 = 1e-6;

/// Loops, to be asked which of them are near another one.
pub(super) struct Near {
    /// By place.
    loops: Vec<Extent>,
    /// Places, those of a node next to each other.
    order: Vec<u32>,
    nodes: Vec<Node>,
}

struct Node {
    extent: Extent,
    loops: Range<usize>,
    /// The number of the first of two, which follow each other.
    halves: Option<usize>,
}

/// Where a loop is, or some are.
#[derive(Clone, Copy)]
struct Extent {
    bounds: Bounds,
    /// The box of the middles.
    middles: [DVec3; 2],
    /// Least and largest distance of a vertex from its loop's middle.
    spread: [f64; 2],
}

impl Extent {
    fn of(shape: &Shape) -> Self {
        let away = || shape.points.iter().map(|p| p.distance(shape.centre));
        let spread = [away().fold(f64::INFINITY, f64::min), away().fold(0.0, f64::max)];
        Self { bounds: bounds(shape, 0.0), middles: [shape.centre; 2], spread }
    }

    fn add(&mut self, other: &Self) {
        self.bounds.add(&other.bounds);
        self.middles = [self.middles[0].min(other.middles[0]), self.middles[1].max(other.middles[1])];
        self.spread = [self.spread[0].min(other.spread[0]), self.spread[1].max(other.spread[1])];
    }

    /// No vertex of a loop is nearer to one of `others`.
    fn apart(&self, others: &Self) -> f64 {
        let gap = |k: usize| {
            let [lo, hi, other_lo, other_hi] =
                [self.bounds.lo, self.bounds.hi, others.bounds.lo, others.bounds.hi].map(|p| f64::from(p[k]));
            (other_lo - hi).max(lo - other_hi).max(0.0)
        };
        let boxes = DVec3::new(gap(0), gap(1), gap(2)).length();
        let middle = self.middles[0];
        let aside = (middle - others.middles[0]).abs().max((middle - others.middles[1]).abs()).length();
        let shells = (others.spread[0] - aside - self.spread[1]).max(self.spread[0] - others.spread[1] - aside);
        (boxes.max(shells) - SLACK * (aside + self.spread[1] + others.spread[1])).max(0.0)
    }

    /// Loops are halved by these lengths: their middles along an axis, or how large they are.
    fn along(&self, axis: usize) -> [f64; 2] {
        if axis < 3 { self.middles.map(|p| p[axis]) } else { self.spread }
    }
}

impl Near {
    /// O(n log n).
    pub(super) fn new<'s>(shapes: impl Iterator<Item = &'s Shape>) -> Self {
        let loops: Vec<Extent> = shapes.map(Extent::of).collect();
        let mut order: Vec<u32> = (0..loops.len() as u32).collect();
        let node = |places: &[u32], loops_of: Range<usize>| {
            let mut extent = loops[places[0] as usize];
            places.iter().for_each(|i| extent.add(&loops[*i as usize]));
            Node { extent, loops: loops_of, halves: None }
        };
        let mut nodes = Vec::new();
        if !order.is_empty() {
            nodes.push(node(&order, 0..order.len()));
        }
        let mut at = 0;
        while at < nodes.len() {
            let Range { start, end } = nodes[at].loops;
            if end - start > FEW {
                let size = |axis: &usize| nodes[at].extent.along(*axis)[1] - nodes[at].extent.along(*axis)[0];
                let axis = (0..4).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(0);
                let middle = (end - start) / 2;
                let key = |i: &u32| loops[*i as usize].along(axis)[0];
                order[start..end].select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
                nodes[at].halves = Some(nodes.len());
                for half in [start..start + middle, start + middle..end] {
                    nodes.push(node(&order[half.clone()], half));
                }
            }
            at += 1;
        }
        Self { loops, order, nodes }
    }

    /// The `wanted` ones of the other loops whose boxes meet `within`, by place, each with a bound below its distance; by these bounds.
    pub(super) fn around<'a>(
        &'a self,
        of: usize,
        within: Bounds,
        wanted: impl Fn(usize) -> bool + 'a,
    ) -> impl Iterator<Item = (f64, usize)> + 'a {
        let own = &self.loops[of];
        // Bounds are not negative, so that their bits are in their order.
        let mut waiting = BinaryHeap::from([Reverse((0_u64, false, 0))]);
        std::iter::from_fn(move || {
            loop {
                let Reverse((bound, is_loop, number)) = waiting.pop()?;
                steps::count(1);
                if is_loop {
                    return Some((f64::from_bits(bound), number));
                }
                let node = &self.nodes[number];
                let mut put = |extent: &Extent, is_loop: bool, number: usize| {
                    if extent.bounds.overlap(&within).is_some() && (!is_loop || number != of && wanted(number)) {
                        waiting.push(Reverse((own.apart(extent).to_bits(), is_loop, number)));
                    }
                };
                match node.halves {
                    Some(first) => [first, first + 1].into_iter().for_each(|n| put(&self.nodes[n].extent, false, n)),
                    None => {
                        let loops = self.order[node.loops.clone()].iter().map(|i| *i as usize);
                        loops.for_each(|i| put(&self.loops[i], true, i));
                    }
                }
            }
        })
    }
}

/// The box of a loop, wider by `by` on all sides.
pub(super) fn bounds(shape: &Shape, by: f64) -> Bounds {
    let points: Vec<[f32; 3]> = shape.points.iter().map(|p| Position::nearest(*p).coordinates()).collect();
    crate::submesh::near::around(&points, by)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn circle(centre: DVec3, radius: f64) -> Shape {
        let at = |i: u32| {
            let turn = std::f64::consts::TAU * f64::from(i) / 12.0;
            centre + DVec3::new(turn.cos(), turn.sin(), 0.0) * radius
        };
        Shape::of(&(0..12).map(at).collect::<Vec<_>>(), std::iter::empty())
    }

    #[test]
    fn the_nearest_come_first_and_none_is_nearer_than_its_bound() {
        let mut shapes: Vec<Shape> =
            (0..200).map(|i| circle(DVec3::Z * f64::from(i % 3), 1.0 + f64::from(i * 37 % 200))).collect();
        shapes.extend((0..40).map(|i| circle(DVec3::new(f64::from(i % 8) * 30.0, f64::from(i / 8) * 30.0, 0.0), 2.0)));
        let near = Near::new(shapes.iter());
        for (i, shape) in shapes.iter().enumerate() {
            let within = bounds(shape, 3.0 * shape.radius());
            let found: Vec<(f64, usize)> = near.around(i, within, |j| j % 7 != 0).collect();
            assert!(found.is_sorted_by(|a, b| a.0 <= b.0));
            let mut numbers: Vec<usize> = found.iter().map(|f| f.1).collect();
            numbers.sort_unstable();
            let meets = |j: &usize| bounds(&shapes[*j], 0.0).overlap(&within).is_some();
            assert_eq!(numbers, (0..shapes.len()).filter(|j| *j != i && j % 7 != 0 && meets(j)).collect::<Vec<_>>());
            for (bound, j) in found {
                let apart = shape.points.iter().flat_map(|p| shapes[j].points.iter().map(|q| p.distance(*q)));
                assert!(bound <= apart.fold(f64::INFINITY, f64::min));
            }
        }
    }

    #[test]
    fn of_loops_about_one_axis_few_are_looked_at() {
        steps::assert_near_linear(500, |n| {
            let shapes: Vec<Shape> = (0..n).map(|i| circle(DVec3::ZERO, 1.0 + i as f64)).collect();
            let near = Near::new(shapes.iter());
            let nearest = |i: usize| near.around(i, bounds(&shapes[i], 9.0 * n as f64), |_| true).next();
            let (steps, all) = steps::of(|| (0..n).map(nearest).collect::<Vec<_>>());
            assert!(all.iter().enumerate().all(|(i, found)| found.unwrap().1.abs_diff(i) == 1));
            steps
        });
    }
}
