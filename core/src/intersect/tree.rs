//! Boxes of triangles in a tree, and all pairs of them that overlap.
//!
//! Triangles are put in the order of a space-filling curve (Morton, "A computer oriented geodetic data base", IBM 1966) and taken
//! eight at a time; eight such groups make a node, and so on: a tree without pointers, in which a box is compared with eight
//! others at once. The tree is walked against itself, so that boxes of groups that are apart are compared once for all their
//! triangles.
//!
//! Boxes overlap when `lo < hi` holds both ways on each axis, strictly: where one ends at the coordinate at which the other begins,
//! that plane separates the triangles, and holds a vertex or an edge of each at most, neither of which counts. A
//! triangle that lies in such a plane itself has an axis of zero extent, and its box is widened there to the neighbouring floats
//! both ways; then it overlaps exactly what it may meet, except that two parallel planes one float apart pass for one
//! ([`Row::same_plane`]).
//!
//! Boxes are cut to the cell widened to the neighbouring floats. Pairs that the cell owns keep an overlap: its lowest corner, or the
//! position that the two share, is in the cell, and as it lies below the upper end of both boxes and not above the cell's,
//! a part of positive extent is left.
//!
//! A vertex with very many triangles would make as many pairs as their square. Triangles of such a **hub** get a tree of
//! their own, whose pairs with itself are left to the caller.

use std::ops::Range;

use glam::Vec4;

use super::stars::Stars;
use super::{Region, State};
use crate::chunk::NONE;

/// Lanes of a node.
pub(super) const WIDTH: usize = 8;

/// A vertex with more triangles is a hub.
const HUB: f32 = 256.0;

/// Enough for 2³² triangles.
const LEVELS: usize = 12;

/// A triangle with its box.
#[derive(Clone, Copy)]
pub(super) struct Row {
    pub(super) lo: [f32; 3],
    pub(super) triangle: u32,
    pub(super) hi: [f32; 3],
    /// Bits 0 to 2: begins below the cell on that axis. Bits 3 to 5: has no extent on that axis. Bit 6: [`Row::OPEN`].
    flags: u32,
}

impl Row {
    const EMPTY: Self = Self { lo: [f32::INFINITY; 3], triangle: NONE, hi: [f32::NEG_INFINITY; 3], flags: 0 };
    const OPEN: u32 = 1 << 6;

    /// Has a vertex at home here whose star is not certified.
    #[inline]
    pub(super) fn is_open(&self) -> bool {
        self.flags & Self::OPEN != 0
    }

    /// Is the lowest corner of the overlap of two boxes in the cell? Both meet it, so neither begins above it.
    #[inline]
    pub(super) fn owns_lowest_corner(&self, other: &Self) -> bool {
        self.flags & other.flags & 7 == 0
    }

    /// Where both are flat on one axis, are they in one plane?
    #[inline]
    pub(super) fn same_plane(&self, other: &Self) -> bool {
        // Both were widened or cut the same way.
        let flat = (self.flags & other.flags) >> 3;
        flat & 7 == 0 || (0..3).all(|k| flat >> k & 1 == 0 || self.lo[k] == other.lo[k])
    }

    #[inline]
    pub(super) fn overlaps(&self, other: &Self) -> bool {
        (0..3).all(|k| (self.lo[k] < other.hi[k]) & (other.lo[k] < self.hi[k]))
    }
}

/// The corners of one box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    lo: [f32; 3],
    hi: [f32; 3],
}

/// Eight boxes; missing ones overlap nothing.
#[derive(Clone, Copy)]
pub(super) struct Node {
    lo: [[f32; WIDTH]; 3],
    hi: [[f32; WIDTH]; 3],
}

/// Lanes as two vectors.
#[inline(always)]
fn halves(lanes: &[f32; WIDTH]) -> [Vec4; 2] {
    let [a, b, c, d, e, f, g, h] = *lanes;
    [Vec4::new(a, b, c, d), Vec4::new(e, f, g, h)]
}

impl Node {
    const EMPTY: Self = Self { lo: [[f32::INFINITY; WIDTH]; 3], hi: [[f32::NEG_INFINITY; WIDTH]; 3] };

    /// The lanes whose boxes overlap this one.
    #[inline(always)]
    fn overlapping(&self, lo: &[f32; 3], hi: &[f32; 3]) -> u32 {
        let mut found = [!0_u32; 2];
        for k in 0..3 {
            let (begins, ends) = (halves(&self.lo[k]), halves(&self.hi[k]));
            for half in 0..2 {
                let both = begins[half].cmplt(Vec4::splat(hi[k])) & ends[half].cmpgt(Vec4::splat(lo[k]));
                found[half] &= both.bitmask();
            }
        }
        found[0] | found[1] << 4
    }

    #[inline(always)]
    fn lane(&self, i: usize) -> Bounds {
        let (lo, hi) = (&self.lo, &self.hi);
        Bounds { lo: [lo[0][i], lo[1][i], lo[2][i]], hi: [hi[0][i], hi[1][i], hi[2][i]] }
    }

    fn set(&mut self, i: usize, bounds: &Bounds) {
        for k in 0..3 {
            self.lo[k][i] = bounds.lo[k];
            self.hi[k][i] = bounds.hi[k];
        }
    }

    /// The box of all lanes.
    fn bounds(&self) -> Bounds {
        let (mut lo, mut hi) = ([0.0; 3], [0.0; 3]);
        for k in 0..3 {
            let (begins, ends) = (halves(&self.lo[k]), halves(&self.hi[k]));
            lo[k] = begins[0].min(begins[1]).min_element();
            hi[k] = ends[0].max(ends[1]).max_element();
        }
        Bounds { lo, hi }
    }
}

/// The vertices of the eight triangles of a leaf, as floats that are equal when the vertices are.
#[derive(Clone, Copy)]
struct Corners([[f32; WIDTH]; 3]);

/// A normal float for each vertex below 2³¹ − 2²⁴; 0 stands for none.
#[inline]
fn vertex_float(vertex: u32) -> f32 {
    f32::from_bits(vertex.wrapping_add(0x0080_0000))
}

impl Corners {
    /// The lanes of `other` that have a vertex of lane `i`.
    #[inline(always)]
    fn sharing(&self, i: usize, other: &Self) -> u32 {
        let mut found = [glam::BVec4A::default(); 2];
        for mine in &self.0 {
            let mine = Vec4::splat(mine[i]);
            for theirs in &other.0 {
                let theirs = halves(theirs);
                for half in 0..2 {
                    found[half] |= mine.cmpeq(theirs[half]);
                }
            }
        }
        found[0].bitmask() | found[1].bitmask() << 4
    }
}

/// A tree, the rows in it, and what its triangles have in common.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    /// Where each level starts: level 0 among the leaves, the others among the nodes.
    starts: [u32; LEVELS],
    height: usize,
    bounds: Bounds,
    pub(super) rows: Range<usize>,
    /// The hub that all its triangles have, or [`NONE`].
    pub(super) hub: u32,
}

/// The trees of a region; memory is kept from one to the next.
#[derive(Default)]
pub(super) struct Forest {
    /// Before sorting.
    unsorted: Vec<Row>,
    /// Place on the curve above the place in `unsorted`.
    keys: Vec<u64>,
    swap: Vec<u64>,
    /// Tree of each row of `unsorted`, where there are hubs.
    groups: Vec<u32>,
    /// Each tree's are followed by empty ones, to a multiple of [`WIDTH`].
    pub(super) rows: Vec<Row>,
    leaves: Vec<Node>,
    corners: Vec<Corners>,
    nodes: Vec<Node>,
    /// Of the ordinary triangles, then of each hub.
    pub(super) trees: Vec<Tree>,
}

impl Forest {
    /// Arranges the triangles that meet the cell. O(triangles).
    pub(super) fn build(&mut self, region: &Region<'_>, stars: &Stars, states: &[State]) {
        self.collect(region, states);
        self.sort();
        let hubs = self.group_by_hub(region, stars, states);
        self.rows.clear();
        self.leaves.clear();
        self.corners.clear();
        self.nodes.clear();
        self.trees.clear();
        let mut rest = 0..self.keys.len();
        for (group, hub) in hubs.iter().enumerate() {
            let of_group = |key: &u64| self.groups[*key as u32 as usize] == group as u32;
            let count =
                if hubs.len() == 1 { rest.len() } else { self.keys[rest.clone()].iter().take_while(|k| of_group(k)).count() };
            if count > 0 {
                self.plant(region, rest.start..rest.start + count, *hub);
            }
            rest.start += count;
        }
    }

    /// The rows of all triangles that are no line and meet the cell.
    #[inline(never)]
    fn collect(&mut self, region: &Region<'_>, states: &[State]) {
        let (cell_lo, cell_hi) = region.cell.ends();
        let four = |p: [f32; 3]| Vec4::new(p[0], p[1], p[2], 0.0);
        let (cut_lo, cut_hi) = (four(cell_lo.map(f32::next_down)), four(cell_hi.map(f32::next_up)));
        let (cell_lo, cell_hi) = (four(cell_lo), four(cell_hi));
        self.unsorted.clear();
        self.unsorted.reserve(region.triangles.len());
        for (i, t) in region.solid_triangles() {
            let [a, b, c] = region.corners(t);
            let (a, b, c) = (four(a), four(b), four(c));
            let (mut lo, mut hi) = (a.min(b).min(c), a.max(b).max(c));
            if !(lo.cmple(cell_hi) & hi.cmpge(cell_lo)).all() {
                continue;
            }
            let flat = lo.cmpeq(hi).bitmask() & 7;
            let mut flags = (lo.cmplt(cell_lo).bitmask() & 7) | flat << 3;
            for k in bits(flat) {
                (lo[k], hi[k]) = (lo[k].next_down(), hi[k].next_up());
            }
            (lo, hi) = (lo.max(cut_lo), hi.min(cut_hi));
            if t.iter().any(|v| states[*v as usize] == State::Open) {
                flags |= Row::OPEN;
            }
            self.unsorted.push(Row { lo: lo.truncate().into(), triangle: i, hi: hi.truncate().into(), flags });
        }
    }

    /// Fills `keys` in the order of the curve.
    #[inline(never)]
    fn sort(&mut self) {
        let at = |row: &Row, k: usize| row.lo[k] * 0.5 + row.hi[k] * 0.5;
        let middle = |row: &Row| [at(row, 0), at(row, 1), at(row, 2)];
        let (mut lo, mut hi) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for row in &self.unsorted {
            let m = middle(row);
            for k in 0..3 {
                lo[k] = lo[k].min(m[k]);
                hi[k] = hi[k].max(m[k]);
            }
        }
        let size = (0..3).map(|k| hi[k] - lo[k]).fold(0.0, f32::max);
        // Conversion to integers saturates, and takes NaN to zero.
        let scale = 256.0 / size;
        let (mut low, mut high) = ([0_u32; 4096], [0_u32; 4096]);
        self.keys.clear();
        self.keys.extend(self.unsorted.iter().enumerate().map(|(i, row)| {
            let m = middle(row);
            let place = |k: usize| spread((((m[k] - lo[k]) * scale) as u32).min(255)) << k;
            let extent = (row.hi[0] - row.lo[0]).max(row.hi[1] - row.lo[1]).max(row.hi[2] - row.lo[2]) * scale;
            let class = u32::from(extent > 8.0) + u32::from(extent > 32.0) + u32::from(extent > 128.0);
            let curve = (place(0) | place(1) | place(2)) >> 2 | class << 22;
            low[(curve & 4095) as usize] += 1;
            high[(curve >> 12) as usize] += 1;
            u64::from(curve) << 32 | i as u64
        }));
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
    fn group_by_hub(&mut self, region: &Region<'_>, stars: &Stars, states: &[State]) -> Vec<u32> {
        let is_hub = |v: u32| stars.degree(v as usize) > HUB && states[v as usize] != State::Open;
        let mut hubs = vec![NONE];
        hubs.extend((0..region.positions.len() as u32).filter(|v| is_hub(*v)));
        if hubs.len() == 1 {
            return hubs;
        }
        self.groups.clear();
        let mut starts = vec![0_u32; hubs.len() + 1];
        for row in &self.unsorted {
            // The hub with the smallest number, which is position in `hubs`.
            let group = region.triangles[row.triangle as usize].iter().filter_map(|v| hubs[1..].binary_search(v).ok()).min();
            let group = group.map_or(0, |g| g + 1);
            self.groups.push(group as u32);
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
    #[inline(never)]
    fn plant(&mut self, region: &Region<'_>, keys: Range<usize>, hub: u32) {
        let first_row = self.rows.len();
        let mut starts = [0; LEVELS];
        starts[0] = self.leaves.len() as u32;
        for eight in self.keys[keys.clone()].chunks(WIDTH) {
            let (mut leaf, mut corners) = (Node::EMPTY, Corners([[0.0; WIDTH]; 3]));
            for (i, key) in eight.iter().enumerate() {
                let row = self.unsorted[*key as u32 as usize];
                for k in 0..3 {
                    leaf.lo[k][i] = row.lo[k];
                    leaf.hi[k][i] = row.hi[k];
                    corners.0[k][i] = vertex_float(region.triangles[row.triangle as usize][k]);
                }
                self.rows.push(row);
            }
            self.leaves.push(leaf);
            self.corners.push(corners);
        }
        self.rows.resize(self.leaves.len() * WIDTH, Row::EMPTY);
        let mut below = starts[0] as usize..self.leaves.len();
        let mut height = 0;
        while below.len() > 1 {
            let start = self.nodes.len();
            for first in below.clone().step_by(WIDTH) {
                let mut node = Node::EMPTY;
                for (i, child) in (first..below.end.min(first + WIDTH)).enumerate() {
                    node.set(i, &if height == 0 { &self.leaves } else { &self.nodes }[child].bounds());
                }
                self.nodes.push(node);
            }
            height += 1;
            starts[height] = start as u32;
            below = start..self.nodes.len();
        }
        let bounds = if height == 0 { &self.leaves } else { &self.nodes }[below.start].bounds();
        self.trees.push(Tree { starts, height, bounds, rows: first_row..first_row + keys.len(), hub });
    }
}

/// Eight bits, two zeros after each.
#[inline]
fn spread(x: u32) -> u32 {
    let x = (x | x << 8) & 0x0000_F00F;
    let x = (x | x << 4) & 0x000C_30C3;
    (x | x << 2) & 0x0024_9249
}

/// What is done with overlapping boxes.
pub(super) trait Visit {
    /// `row` overlaps the rows from `first` on whose bits are set in `lanes`; those in `sharing` (and maybe others, which do not
    /// overlap) have a vertex in common with it. Returns `false` to end the walk.
    fn visit(&mut self, row: usize, first: usize, lanes: u32, sharing: u32) -> bool;
}

/// A walk over a forest.
pub(super) struct Walk<'a, V> {
    forest: &'a Forest,
    visit: &'a mut V,
}

impl<'a, V: Visit> Walk<'a, V> {
    pub(super) fn new(forest: &'a Forest, visit: &'a mut V) -> Self {
        Self { forest, visit }
    }

    /// All overlapping pairs within the tree of ordinary triangles and between trees, but not within that of a hub. `false` when
    /// it was ended.
    pub(super) fn all(&mut self) -> bool {
        let trees = &self.forest.trees;
        for (i, tree) in trees.iter().enumerate() {
            if tree.hub == NONE && !self.own(tree, tree.height, 0) {
                return false;
            }
            for other in &trees[i + 1..] {
                let (a, b) = (tree.bounds, other.bounds);
                let apart = (0..3).any(|k| a.lo[k] >= b.hi[k] || b.lo[k] >= a.hi[k]);
                if !apart && !self.between((tree, tree.height, 0, &a), (other, other.height, 0, &b)) {
                    return false;
                }
            }
        }
        true
    }

    #[inline]
    fn node(&self, tree: &Tree, level: usize, index: usize) -> &'a Node {
        let at = tree.starts[level] as usize + index;
        if level == 0 { &self.forest.leaves[at] } else { &self.forest.nodes[at] }
    }

    /// Pairs within a node.
    fn own(&mut self, tree: &Tree, level: usize, index: usize) -> bool {
        if level == 0 {
            return self.own_leaf(tree.starts[0] as usize + index);
        }
        let node = self.node(tree, level, index);
        for i in 0..WIDTH {
            let mine = node.lane(i);
            if mine.lo[0] > mine.hi[0] {
                break;
            }
            if !self.own(tree, level - 1, index * WIDTH + i) {
                return false;
            }
            let mut lanes = node.overlapping(&mine.lo, &mine.hi) & (!1 << i);
            while lanes != 0 {
                let j = lanes.trailing_zeros() as usize;
                lanes &= lanes - 1;
                let (i, j, theirs) = (i + index * WIDTH, j + index * WIDTH, node.lane(j));
                if !self.between((tree, level - 1, i, &mine), (tree, level - 1, j, &theirs)) {
                    return false;
                }
            }
        }
        true
    }

    fn own_leaf(&mut self, leaf: usize) -> bool {
        let node = &self.forest.leaves[leaf];
        for i in 0..WIDTH - 1 {
            let mine = node.lane(i);
            let lanes = node.overlapping(&mine.lo, &mine.hi) & (!1 << i);
            if lanes != 0 && !self.row(leaf * WIDTH + i, leaf, lanes) {
                return false;
            }
        }
        true
    }

    /// Pairs of one triangle of each of two nodes whose boxes overlap.
    fn between(&mut self, a: Place<'_>, b: Place<'_>) -> bool {
        if a.1 < b.1 {
            return self.between(b, a);
        }
        let (tree, level, index, bounds) = a;
        let (other, other_level, other_index, other_bounds) = b;
        if level == 0 {
            let leaves = (tree.starts[0] as usize + index, other.starts[0] as usize + other_index);
            return self.between_leaves(leaves, bounds, other_bounds);
        }
        let node = self.node(tree, level, index);
        let mut lanes = node.overlapping(&other_bounds.lo, &other_bounds.hi);
        while lanes != 0 {
            let i = lanes.trailing_zeros() as usize;
            lanes &= lanes - 1;
            let mine = node.lane(i);
            let child = (tree, level - 1, index * WIDTH + i, &mine);
            if level > other_level {
                if !self.between(child, b) {
                    return false;
                }
                continue;
            }
            let others = self.node(other, level, other_index);
            let mut lanes = others.overlapping(&mine.lo, &mine.hi);
            while lanes != 0 {
                let j = lanes.trailing_zeros() as usize;
                lanes &= lanes - 1;
                let theirs = others.lane(j);
                if !self.between(child, (other, level - 1, other_index * WIDTH + j, &theirs)) {
                    return false;
                }
            }
        }
        true
    }

    fn between_leaves(&mut self, (mut a, mut b): (usize, usize), bounds: &Bounds, other_bounds: &Bounds) -> bool {
        let (mut node, mut other) = (&self.forest.leaves[a], &self.forest.leaves[b]);
        let mut lanes = node.overlapping(&other_bounds.lo, &other_bounds.hi);
        let others = other.overlapping(&bounds.lo, &bounds.hi);
        // One by one those of the leaf that has fewer.
        if others.count_ones() < lanes.count_ones() {
            (a, b, node, other, lanes) = (b, a, other, node, others);
        }
        while lanes != 0 {
            let i = lanes.trailing_zeros() as usize;
            lanes &= lanes - 1;
            let mine = node.lane(i);
            let found = other.overlapping(&mine.lo, &mine.hi);
            if found != 0 && !self.row(a * WIDTH + i, b, found) {
                return false;
            }
        }
        true
    }

    /// A row and the lanes of a leaf that overlap it.
    #[inline]
    fn row(&mut self, row: usize, leaf: usize, lanes: u32) -> bool {
        let sharing = self.forest.corners[row / WIDTH].sharing(row % WIDTH, &self.forest.corners[leaf]);
        self.visit.visit(row, leaf * WIDTH, lanes, sharing)
    }
}

/// A node: tree, level, number within the level, box.
type Place<'t> = (&'t Tree, usize, usize, &'t Bounds);

/// The numbers of the bits that are set, ascending.
#[inline(always)]
pub(crate) fn bits(mask: impl Into<u64>) -> impl Iterator<Item = usize> {
    let mut mask = mask.into();
    std::iter::from_fn(move || {
        let bit = (mask != 0).then(|| mask.trailing_zeros() as usize);
        mask &= mask.wrapping_sub(1);
        bit
    })
}
