//! Strips of space along the planes of an earlier plan, as cells: in their midst lie the triangles that the earlier pass left as they were, since they go
//! across a plane, and to both sides those at their corners, which change with them.
//!
//! Strips are half-open boxes that have nothing in common: a strip ends at those of planes that part more. All else stays as it is.

use rayon::prelude::*;

use crate::geometry::sums::Bounds;
use crate::io::read_ahead::Guide;
use crate::io::record::{self, Record};
use crate::stream::plan::{Plan, partition};
use crate::util::parallel;

/// Records that a thread looks at together, at least, or that are copied at once.
pub(super) const BLOCK: usize = 1 << 14;

/// So many times as many triangles lie in a strip as go across its plane: these, and those at their corners, with room to spare. A corner stays where it is if
/// one of its triangles lies outside.
const WIDE: usize = 6;

/// So many triangles tell how wide strips are, about.
const SAMPLES: usize = 1 << 19;

/// A half-open box: from the first corner, and before the second one.
type Within = [[f32; 3]; 2];

/// Strips, and the triangles there.
pub(super) struct Strips {
    nodes: Vec<Node>,
    strips: Vec<Strip>,
}

/// A part of space.
#[derive(Clone, Copy)]
enum Node {
    /// Between strips.
    Between,
    Strip(u32),
    /// Parted by a plane: what is before it and what is not, by numbers of nodes.
    Parted {
        axis: usize,
        at: f32,
        parts: [u32; 2],
    },
}

/// A strip, or a piece of it.
pub(super) struct Strip {
    pub(super) within: Within,
    /// Numbers of triangles that reach into it, ascending.
    pub(super) members: Vec<u32>,
    /// How many of them lie within.
    pub(super) own: usize,
}

impl Strips {
    /// Along the planes of a plan, in pieces of so many triangles. O(n log n) with a small constant, 8 bytes for each triangle of a strip.
    pub(super) fn new((records, guide): (&[Record], &Guide<'_>), plan: &Plan, most: u32, threads: usize) -> Self {
        let step = records.len().div_ceil(SAMPLES).max(1);
        let numbers = guide.ahead((0..records.len()).step_by(step).map(|number| number as u32), |number| Some(*number));
        let mut samples: Vec<Bounds> = numbers.map(|number| Bounds::of(&record::corners(&records[number as usize]))).collect();
        let mut strips = Self { nodes: Vec::new(), strips: Vec::new() };
        let space = [[f32::NEG_INFINITY; 3], [f32::INFINITY; 3]];
        strips.along((plan, 1), &mut samples, space, (most as usize / step).max(1));
        strips.gather((records, guide), threads);
        strips
    }

    pub(super) fn all(&self) -> &[Strip] {
        &self.strips
    }

    pub(super) fn heap_bytes(&self) -> u64 {
        let members: usize = self.strips.iter().map(|strip| strip.members.capacity() * size_of::<u32>()).sum();
        (members + self.nodes.len() * size_of::<Node>() + self.strips.len() * size_of::<Strip>()) as u64
    }

    fn push(&mut self, node: Node) -> u32 {
        self.nodes.push(node);
        self.nodes.len() as u32 - 1
    }

    /// The strips along a plane of the plan and those below it, in a part of space; `samples`: of the triangles that lie in there. Returns its node.
    fn along(&mut self, (plan, number): (&Plan, usize), samples: &mut [Bounds], within: Within, most: usize) -> u32 {
        // The root comes first.
        let node = self.push(Node::Between);
        let Some((axis, at)) = plan.plane(number) else { return node };
        let crossing = samples.iter().filter(|s| s.lo[axis] < at && at <= s.hi[axis]).count();
        let off = |s: &Bounds| (at - s.lo[axis]).max(s.hi[axis] - at);
        let half = match WIDE * crossing {
            0 => None,
            rank if rank < samples.len() => {
                samples.select_nth_unstable_by(rank, |a, b| off(a).total_cmp(&off(b)));
                Some(off(&samples[rank]))
            }
            _ => Some(f32::INFINITY),
        };
        // The plane itself may lie in a strip of one that parts more.
        let inside = |x: f32| x.max(within[0][axis]).min(within[1][axis]);
        let [start, end] = half.map_or([at; 2], |half| [at - half, at + half]).map(inside);
        let (mut before, mut strip, mut behind) = (within, within, within);
        (before[1][axis], strip[0][axis], strip[1][axis], behind[0][axis]) = (start, start, end, end);
        let count = partition(samples, |s| s.hi[axis] < start);
        let (of_before, rest) = samples.split_at_mut(count);
        let count = partition(rest, |s| s.lo[axis] >= start && s.hi[axis] < end);
        let (of_strip, rest) = rest.split_at_mut(count);
        let count = partition(rest, |s| s.lo[axis] >= end);
        let of_behind = &mut rest[..count];
        let behind = self.along((plan, 2 * number + 1), of_behind, behind, most);
        let low = self.along((plan, 2 * number), of_before, before, most);
        let middle = if start < end { self.in_pieces(of_strip, strip, most) } else { self.push(Node::Between) };
        let front = self.push(Node::Parted { axis, at: start, parts: [low, middle] });
        self.nodes[node as usize] = Node::Parted { axis, at: end, parts: [front, behind] };
        node
    }

    /// A strip, in pieces of so many samples.
    fn in_pieces(&mut self, samples: &mut [Bounds], within: Within, most: usize) -> u32 {
        let middle = |s: &Bounds, axis: usize| s.lo[axis] * 0.5 + s.hi[axis] * 0.5;
        if samples.len() > most {
            let mut all = Bounds::EMPTY;
            samples.iter().for_each(|s| all.add(s));
            let width = |axis: usize| f64::from(all.hi[axis]) - f64::from(all.lo[axis]);
            let axis = (1..3).fold(0, |longest, axis| if width(axis) > width(longest) { axis } else { longest });
            let half = samples.len() / 2;
            samples.select_nth_unstable_by(half, |a, b| middle(a, axis).total_cmp(&middle(b, axis)));
            let at = middle(&samples[half], axis);
            let count = partition(samples, |s| middle(s, axis) < at);
            if count > 0 {
                let (mut before, mut behind) = (within, within);
                (before[1][axis], behind[0][axis]) = (at, at);
                let (low, high) = samples.split_at_mut(count);
                let parts = [self.in_pieces(low, before, most), self.in_pieces(high, behind, most)];
                return self.push(Node::Parted { axis, at, parts });
            }
        }
        self.strips.push(Strip { within, members: Vec::new(), own: 0 });
        self.push(Node::Strip(self.strips.len() as u32 - 1))
    }

    /// Finds the triangles of each strip.
    fn gather(&mut self, (records, guide): (&[Record], &Guide<'_>), threads: usize) {
        let _order = guide.in_order(records);
        let of_block = |(block, records): (usize, &[Record])| {
            let mut found = Vec::new();
            for (number, record) in ((block * BLOCK) as u32..).zip(records) {
                let bounds = Bounds::of(&record::corners(record));
                self.visit(&bounds, &mut |strip, is_own| found.push((strip, number, is_own)));
            }
            found
        };
        let found: Vec<Vec<(u32, u32, bool)>> =
            parallel::in_pool(threads, || records.par_chunks(BLOCK).enumerate().map(of_block).collect());
        for (strip, number, is_own) in found.into_iter().flatten() {
            let strip = &mut self.strips[strip as usize];
            strip.members.push(number);
            strip.own += usize::from(is_own);
        }
    }

    /// Visits the strips that a closed box meets, and says whether it lies in there.
    fn visit(&self, bounds: &Bounds, visit: &mut impl FnMut(u32, bool)) {
        self.descend(0, bounds, true, visit);
    }

    fn descend(&self, node: u32, bounds: &Bounds, is_all: bool, visit: &mut impl FnMut(u32, bool)) {
        match self.nodes[node as usize] {
            Node::Between => {}
            Node::Strip(strip) => visit(strip, is_all),
            Node::Parted { axis, at, parts: [before, behind] } => {
                let (is_before, is_behind) = (bounds.lo[axis] < at, bounds.hi[axis] >= at);
                let is_all = is_all && is_before != is_behind;
                if is_before {
                    self.descend(before, bounds, is_all, visit);
                }
                if is_behind {
                    self.descend(behind, bounds, is_all, visit);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A triangle of this box.
    fn triangle([a, b]: [[f32; 3]; 2]) -> Record {
        record::encode([a, b, [a[0], b[1], a[2]]], 0)
    }

    fn holds([lo, hi]: &Within, p: &[f32; 3]) -> bool {
        (0..3).all(|k| lo[k] <= p[k] && p[k] < hi[k])
    }

    proptest! {
        /// Members are those whose box a strip meets, own are those that lie there; no place lies in two strips.
        #[test]
        fn strips_have_their_triangles_and_no_place_in_common(
            boxes in prop::collection::vec(prop::array::uniform2(prop::array::uniform3(-20i8..21)), 20..120),
            size in 4u32..20,
            most in 3u32..40,
        ) {
            let short = |[a, b]: [[i8; 3]; 2]| {
                let a = a.map(f32::from);
                [a, [0, 1, 2].map(|k| a[k] + f32::from(b[k]) / 8.0)]
            };
            let records: Vec<Record> = boxes.into_iter().map(|ends| triangle(short(ends))).collect();
            let plan = Plan::shifted(&records, &Guide::NONE, size, 0.0);
            let strips = Strips::new((&records, &Guide::NONE), &plan, most, 2);
            for strip in strips.all() {
                let [lo, hi] = strip.within;
                let meets = |number: &u32| {
                    let bounds = Bounds::of(&record::corners(&records[*number as usize]));
                    (0..3).all(|k| bounds.lo[k] < hi[k] && lo[k] <= bounds.hi[k])
                };
                let members: Vec<u32> = (0..records.len() as u32).filter(meets).collect();
                prop_assert_eq!(&strip.members, &members);
                let lies_there = |number: &&u32| record::corners(&records[**number as usize]).iter().all(|p| holds(&strip.within, p));
                prop_assert_eq!(strip.own, members.iter().filter(lies_there).count());
            }
            for p in records.iter().flat_map(record::corners) {
                prop_assert!(strips.all().iter().filter(|strip| holds(&strip.within, &p)).count() <= 1);
            }
        }
    }

    /// A row of 1000 triangles: one or two go across the plane in its middle, in the midst of a strip of a few.
    #[test]
    fn a_strip_lies_around_what_goes_across_a_plane() {
        let records: Vec<Record> = (0..1000_u16).map(f32::from).map(|x| triangle([[x, 0.0, 0.0], [x + 1.5, 1.0, 0.0]])).collect();
        let plan = Plan::shifted(&records, &Guide::NONE, 500, 0.0);
        assert_eq!(plan.chunks(), 2);
        let (axis, at) = plan.plane(1).unwrap();
        assert_eq!(axis, 0);
        let strips = Strips::new((&records, &Guide::NONE), &plan, 500, 1);
        let [strip] = strips.all() else { panic!("{} strips", strips.all().len()) };
        let [start, end] = strip.within.map(|p| p[0]);
        assert!(start > at - 12.0 && start < at - 2.0 && end < at + 12.0 && end > at + 2.0, "{start} to {end} around {at}");
        let pieces = Strips::new((&records, &Guide::NONE), &plan, 5, 1);
        assert!(pieces.all().len() > 1 && pieces.all().iter().all(|piece| piece.own <= 5));
    }
}
