//! Boxes of triangles in a tree.
//!
//! Triangles are put in the order of a space-filling curve (Morton, "A computer oriented geodetic data base", IBM 1966) and taken
//! sixteen at a time; sixteen such groups make a node, and so on: a tree without pointers, in which a box is compared with sixteen
//! others at once ([`super::lanes`]).
//!
//! Boxes overlap when `lo < hi` holds both ways on each axis, strictly: where one ends at the coordinate at which the other begins,
//! that plane separates the triangles, and holds a vertex or an edge of each at most, neither of which counts. A
//! triangle that lies in such a plane itself has an axis of zero extent, and its box is widened there to the neighbouring floats
//! both ways; then it overlaps exactly what it may meet, except that two parallel planes one float apart pass for one
//! (`Row::same_plane`).
//!
//! Boxes are cut to the cell widened to the neighbouring floats. Pairs that the cell owns keep an overlap: its lowest corner, or the
//! position that the two share, is in the cell, and as it lies below the upper end of both boxes and not above the cell's,
//! a part of positive extent is left.
//!
//! Where boxes select badly, bodies overlap only if their [`super::slabs`] do, too.
//!
//! A vertex with very many triangles would make as many pairs as their square. Triangles of such a **hub** get a tree of
//! their own, whose pairs with itself are left to the caller.

use std::ops::Range;

use super::copies::Copies;
use super::curve::Curve;
use super::lanes::bits;
use super::lanes::{Boxes, Corners, Triangles, WIDTH, max, min};
use super::slabs::{Slabs, slabs};
use super::stars::Stars;
use super::view::{Batch, CellView, State};
use crate::geometry::axis::Axis;
use crate::stream::plan::HomeBox;
use crate::util::ids::NONE;

/// Enough for 2³² triangles, and the crown.
const LEVELS: usize = 10;

/// In a row's flags, by axis: begins below the cell.
const BELOW: u8 = 1;
/// Has no extent.
const FLAT: u8 = 1 << 3;
/// Has a vertex at home here whose star is not certified.
const OPEN: u8 = 1 << 6;

/// Up to sixteen triangles. A **row** is a place in a leaf: sixteen times the leaf's number, and the lane.
#[derive(Clone, Copy)]
pub(super) struct Leaf {
    pub(super) boxes: Boxes,
    pub(super) corners: Corners,
    triangles: [u32; WIDTH],
    /// [`BELOW`] and [`FLAT`], shifted by the axis, and [`OPEN`].
    flags: [u8; WIDTH],
}

impl Leaf {
    const EMPTY: Self = Self { boxes: Boxes::EMPTY, corners: Corners::NONE, triangles: [NONE; WIDTH], flags: [0; WIDTH] };

    fn clear(&mut self, i: usize) {
        self.boxes.set(i, [f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        self.corners.clear(i);
        (self.triangles[i], self.flags[i]) = (NONE, 0);
    }

    /// Sets the boxes, widened where they are flat and cut to the cell, and the flags that say so.
    #[inline(always)]
    fn set_boxes(&mut self, triangles: &Triangles, cell: &HomeBox) {
        let (cell_lo, cell_hi) = cell.ends();
        for k in 0..3 {
            let (lows, highs) = (&mut self.boxes.lo[k].0, &mut self.boxes.hi[k].0);
            let mut any_flat = false;
            for i in 0..WIDTH {
                let (lo, hi) = triangles.ends(k, i);
                self.flags[i] |= ((u8::from(lo < cell_lo[k]) * BELOW) | (u8::from(lo == hi) * FLAT)) << k;
                any_flat |= lo == hi;
                (lows[i], highs[i]) = (lo, hi);
            }
            if any_flat {
                for (lo, hi) in lows.iter_mut().zip(highs.iter_mut()).filter(|(lo, hi)| lo == hi) {
                    (*lo, *hi) = (lo.next_down(), hi.next_up());
                }
            }
            let (cut_lo, cut_hi) = (cell_lo[k].next_down(), cell_hi[k].next_up());
            for i in 0..WIDTH {
                (lows[i], highs[i]) = (max(lows[i], cut_lo), min(highs[i], cut_hi));
            }
        }
    }
}

/// A tree, the rows in it, and what its triangles have in common.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    /// Where each level starts: level 0 among the leaves, the others among the nodes. The highest, the **crown**, is one node
    /// whose first lane is the box of all.
    pub(super) starts: [u32; LEVELS],
    pub(super) crown: usize,
    pub(super) rows: Range<usize>,
    /// The hub that all its triangles have, or [`NONE`].
    pub(super) hub: u32,
}

/// The trees of a view; memory is kept from one to the next.
#[derive(Default)]
pub(super) struct Forest {
    /// Place on the curve above the number of the triangle.
    keys: Vec<u64>,
    swap: Vec<u64>,
    /// Tree of each triangle, where there are hubs.
    groups: Vec<u32>,
    /// Those of one tree after those of another, and older ones; a tree's last one may have empty lanes.
    pub(super) leaves: Vec<Leaf>,
    planted: usize,
    pub(super) nodes: Vec<Boxes>,
    /// The slabs of each leaf and of each node, if they were asked for.
    pub(super) leaf_slabs: Vec<Slabs>,
    pub(super) node_slabs: Vec<Slabs>,
    /// Of the ordinary triangles, then of each hub.
    pub(super) trees: Vec<Tree>,
}

/// Bytes of a [`Forest`] for each triangle: two keys, a group, its part of a leaf and of the nodes.
pub(super) const BYTES_PER_TRIANGLE: u64 =
    (16 + 4 + size_of::<Leaf>() / WIDTH + size_of::<Boxes>().div_ceil(WIDTH * (WIDTH - 1))) as u64;

/// And with slabs: a part of a leaf's and of the nodes'.
pub(super) const SLAB_BYTES_PER_TRIANGLE: u64 =
    (size_of::<Slabs>() / WIDTH + size_of::<Slabs>().div_ceil(WIDTH * (WIDTH - 1))) as u64;

impl Forest {
    /// Arranges the triangles that meet the cell, but for all `copies` other than the first. O(triangles).
    #[inline(always)]
    pub(super) fn build(&mut self, view: &CellView<'_>, stars: &Stars, states: &[State], copies: &mut Copies) {
        self.collect(view);
        copies.take_out(view, &mut self.keys);
        let hubs = self.group_by_hub(view, stars, states);
        self.planted = 0;
        self.nodes.clear();
        self.leaf_slabs.clear();
        self.node_slabs.clear();
        self.trees.clear();
        let mut rest = 0..self.keys.len();
        for (group, hub) in hubs.iter().enumerate() {
            let of_group = |key: &u64| self.groups[*key as u32 as usize] == group as u32;
            let count =
                if hubs.len() == 1 { rest.len() } else { self.keys[rest.clone()].iter().take_while(|k| of_group(k)).count() };
            if count > 0 {
                self.plant(view, states, rest.start..rest.start + count, *hub);
            }
            rest.start += count;
        }
    }

    /// The `keys` of all triangles that are no line and meet the cell, in the order of the curve.
    #[inline(always)]
    fn collect(&mut self, view: &CellView<'_>) {
        let curve = Curve::new(view);
        let (mut low, mut high) = ([0_u32; 4096], [0_u32; 4096]);
        self.keys.clear();
        self.keys.reserve(view.triangles.len());
        let (mut batch, mut solid) = (Batch::EMPTY, view.solid_triangles());
        while batch.fill(view, &mut solid) {
            let places = curve.places(&batch.triangles);
            for (triangle, place) in batch.numbers().iter().zip(places).filter(|(_, place)| *place != NONE) {
                low[(place & 4095) as usize] += 1;
                high[(place >> 12) as usize & 4095] += 1;
                self.keys.push(u64::from(place) << 32 | u64::from(*triangle));
            }
        }
        self.swap.clear();
        self.swap.resize(self.keys.len(), 0);
        for (counts, shift) in [(&mut low, 32), (&mut high, 44)] {
            let mut start = 0;
            for count in counts.iter_mut() {
                start += std::mem::replace(count, start);
            }
            for key in &self.keys {
                let place = &mut counts[(key >> shift) as usize & 4095];
                self.swap[*place as usize] = *key;
                *place += 1;
            }
            std::mem::swap(&mut self.keys, &mut self.swap);
        }
    }

    /// Brings the triangles of each hub together, keeping their order; the hubs of the groups, the first of which has none.
    fn group_by_hub(&mut self, view: &CellView<'_>, stars: &Stars, states: &[State]) -> Vec<u32> {
        let is_hub = |v: u32| stars.is_hub(v as usize) && states[v as usize] != State::Open;
        let mut hubs = vec![NONE];
        hubs.extend((0..view.positions.len() as u32).filter(|v| is_hub(*v)));
        if hubs.len() == 1 {
            return hubs;
        }
        self.groups.clear();
        self.groups.resize(view.triangles.len(), 0);
        let mut starts = vec![0_u32; hubs.len() + 1];
        for triangle in self.keys.iter().map(|key| *key as u32 as usize) {
            // The hub with the smallest number, which is position in `hubs`.
            let group = view.triangles[triangle].iter().filter_map(|v| hubs[1..].binary_search(v).ok()).min();
            let group = group.map_or(0, |g| g + 1);
            self.groups[triangle] = group as u32;
            starts[group + 1] += 1;
        }
        for group in 0..hubs.len() {
            starts[group + 1] += starts[group];
        }
        for key in &self.keys {
            let place = &mut starts[self.groups[*key as u32 as usize] as usize];
            self.swap[*place as usize] = *key;
            *place += 1;
        }
        std::mem::swap(&mut self.keys, &mut self.swap);
        hubs
    }

    /// Builds the tree over some of `keys`, at least one.
    #[inline(always)]
    fn plant(&mut self, view: &CellView<'_>, states: &[State], keys: Range<usize>, hub: u32) {
        let rows = self.planted * WIDTH..self.planted * WIDTH + keys.len();
        let mut starts = [0; LEVELS];
        (starts[0], starts[1]) = (self.planted as u32, self.nodes.len() as u32);
        let leaves = keys.len().div_ceil(WIDTH);
        let first = self.planted;
        self.planted += leaves;
        if self.leaves.len() < self.planted {
            self.leaves.resize(self.planted, Leaf::EMPTY);
        }
        self.nodes.resize(self.nodes.len() + leaves.div_ceil(WIDTH), Boxes::EMPTY);
        let parents = &mut self.nodes[starts[1] as usize..];
        let mut triangles = Triangles::NONE;
        for ((number, leaf), keys) in self.leaves[first..].iter_mut().enumerate().zip(self.keys[keys].chunks(WIDTH)) {
            for (i, key) in keys.iter().enumerate() {
                let triangle = *key as u32;
                let vertices = view.triangles[triangle as usize];
                triangles.set(i, &view.corners(vertices));
                leaf.corners.set(i, vertices);
                leaf.triangles[i] = triangle;
                let open = vertices.map(|v| states[v as usize] == State::Open);
                leaf.flags[i] = u8::from(open[0] | open[1] | open[2]) * OPEN;
            }
            leaf.set_boxes(&triangles, &view.cell);
            for i in keys.len()..WIDTH {
                leaf.clear(i);
            }
            let (lo, hi) = leaf.boxes.bounds();
            parents[number / WIDTH].set(number % WIDTH, lo, hi);
        }
        // Boxes in the level; where there is one only, it is the crown.
        let (mut level, mut boxes) = (1, leaves);
        while boxes > 1 {
            boxes = boxes.div_ceil(WIDTH);
            level += 1;
            let (below, here) = (starts[level - 1] as usize, self.nodes.len());
            starts[level] = here as u32;
            self.nodes.resize(here + boxes.div_ceil(WIDTH), Boxes::EMPTY);
            for i in 0..boxes {
                let (lo, hi) = self.nodes[below + i].bounds();
                self.nodes[here + i / WIDTH].set(i % WIDTH, lo, hi);
            }
        }
        self.trees.push(Tree { starts, crown: level, rows, hub });
    }
}

/// Slabs.
impl Forest {
    /// Adds slabs to all trees, with angles `around` a line. O(triangles).
    #[inline(always)]
    pub(super) fn add_slabs(&mut self, view: &CellView<'_>, around: Option<&Axis>) {
        let mut triangles = Triangles::NONE;
        self.leaf_slabs.reserve_exact(self.planted);
        for leaf in &self.leaves[..self.planted] {
            let count = leaf.triangles.iter().take_while(|t| **t != NONE).count();
            for (i, t) in leaf.triangles[..count].iter().enumerate() {
                triangles.set(i, &view.corners(view.triangles[*t as usize]));
            }
            self.leaf_slabs.push(slabs(&triangles, count, around));
        }
        self.node_slabs.resize(self.nodes.len(), Slabs::EMPTY);
        for tree in &self.trees {
            let mut boxes = tree.rows.len().div_ceil(WIDTH);
            for level in 1..=tree.crown {
                let (below, here) = (tree.starts[level - 1] as usize, tree.starts[level] as usize);
                for i in 0..boxes {
                    let slabs = if level == 1 { &self.leaf_slabs[below + i] } else { &self.node_slabs[below + i] };
                    let (lo, hi) = slabs.bounds();
                    self.node_slabs[here + i / WIDTH].set(i % WIDTH, lo, hi);
                }
                boxes = boxes.div_ceil(WIDTH);
            }
        }
    }

    /// Bodies overlap only if their slabs do.
    pub(super) fn has_slabs(&self) -> bool {
        !self.leaf_slabs.is_empty()
    }
}

/// Questions about rows.
impl Forest {
    #[inline(always)]
    fn lane(&self, row: usize) -> (&Leaf, usize) {
        (&self.leaves[row / WIDTH], row % WIDTH)
    }

    #[inline(always)]
    pub(super) fn triangle(&self, row: usize) -> u32 {
        let (leaf, i) = self.lane(row);
        leaf.triangles[i]
    }

    /// Has it a vertex at home here whose star is not certified?
    #[inline(always)]
    pub(super) fn is_open(&self, row: usize) -> bool {
        let (leaf, i) = self.lane(row);
        leaf.flags[i] & OPEN != 0
    }

    /// Of two rows that overlap: is the lowest corner of the overlap in the cell, and are they, where both are flat on one axis, in
    /// one plane?
    #[inline(always)]
    pub(super) fn owns_pair(&self, row: usize, other: usize) -> bool {
        let ((a, i), (b, j)) = (self.lane(row), self.lane(other));
        let both = a.flags[i] & b.flags[j];
        // Both meet the cell, so neither begins above it. What is flat was widened, or cut, the same way.
        let same_plane = || bits(both >> 3 & 7).all(|k| a.boxes.lo(i)[k] == b.boxes.lo(j)[k]);
        both & 7 == 0 && (both >> 3 & 7 == 0 || same_plane())
    }

    #[inline]
    pub(super) fn overlap(&self, row: usize, other: usize) -> bool {
        let ((a, i), (b, j)) = (self.lane(row), self.lane(other));
        let begins_before = |a: [f32; 3], b: [f32; 3]| (0..3).all(|k| a[k] < b[k]);
        begins_before(a.boxes.lo(i), b.boxes.hi(j)) && begins_before(b.boxes.lo(j), a.boxes.hi(i))
    }
}
