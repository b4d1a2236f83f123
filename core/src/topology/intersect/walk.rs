//! All pairs of triangles whose boxes overlap: a tree is walked against itself, so that boxes of groups that are apart are compared once
//! for all their triangles.

use super::lanes::bits;
use super::lanes::{self, Boxes, Lanes, Pairs, WIDTH};
use super::slabs::Slabs;
use super::tree::Forest;
use crate::util::ids::NONE;

/// The work that is done with overlapping boxes.
pub(super) trait Visit {
    /// `row` overlaps the rows from `first` on whose bits are set in `lanes`; those in `sharing` (and maybe others, which do not
    /// overlap) have a vertex in common with it. Returns `false` to end the walk.
    fn visit(&mut self, with: impl Lanes, row: usize, first: usize, lanes: u32, sharing: u32) -> bool;
}

/// A node: number of the tree, level, number within the level.
#[derive(Clone, Copy, PartialEq, Eq)]
struct At {
    tree: u32,
    level: u32,
    index: u32,
}

impl At {
    #[inline(always)]
    fn child(self, i: usize) -> Self {
        Self { level: self.level - 1, index: self.index * WIDTH as u32 + i as u32, ..self }
    }

    /// What it is below, and its lane there.
    #[inline(always)]
    fn parent(self) -> (Self, usize) {
        (Self { level: self.level + 1, index: self.index / WIDTH as u32, ..self }, self.index as usize % WIDTH)
    }
}

/// A walk over a forest; `SLABS`: one that has slabs.
pub(super) struct Walk<'a, V, const SLABS: bool> {
    forest: &'a Forest,
    /// Pairs of nodes whose boxes overlap, or a node and itself, that are yet to be looked into.
    stack: Vec<[At; 2]>,
    /// A leaf, and a row that is to be compared with it.
    rows: Pairs,
    visit: &'a mut V,
}

impl<'a, V: Visit, const SLABS: bool> Walk<'a, V, SLABS> {
    pub(super) fn new(forest: &'a Forest, visit: &'a mut V) -> Self {
        Self { forest, stack: Vec::new(), rows: Pairs::default(), visit }
    }

    /// All overlapping pairs within the tree of ordinary triangles and between trees, but not within that of a hub. `false` when
    /// it was ended.
    pub(super) fn all(&mut self) -> bool {
        #[cfg(target_arch = "x86_64")]
        {
            if let Some(lanes) = lanes::Sixteens::detect() {
                // SAFETY: the processor has what it is compiled for.
                return unsafe { self.all_avx512(lanes) };
            }
            if let Some(lanes) = lanes::Eights::detect() {
                // SAFETY: as above.
                return unsafe { self.all_avx2(lanes) };
            }
        }
        self.all_by(lanes::Fours)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f,avx512bw,bmi1,popcnt")]
    fn all_avx512(&mut self, lanes: lanes::Sixteens) -> bool {
        self.all_by(lanes)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,bmi1")]
    fn all_avx2(&mut self, lanes: lanes::Eights) -> bool {
        self.all_by(lanes)
    }

    #[inline(always)]
    fn all_by(&mut self, lanes: impl Lanes) -> bool {
        let trees = &self.forest.trees;
        for (i, tree) in trees.iter().enumerate() {
            for (j, other) in trees.iter().enumerate().skip(i) {
                let [crown, others] =
                    [(i, tree), (j, other)].map(|(i, tree)| At { tree: i as u32, level: tree.crown as u32, index: 0 });
                let wanted = if i == j { tree.hub == NONE } else { self.overlapping(crown, others, 0, lanes) & 1 != 0 };
                if wanted && !self.below([crown.child(0), others.child(0)], lanes) {
                    return false;
                }
            }
        }
        true
    }

    /// The boxes of what is below a node.
    #[inline(always)]
    fn boxes(&self, at: At) -> &'a Boxes {
        let index = self.forest.trees[at.tree as usize].starts[at.level as usize] as usize + at.index as usize;
        if at.level == 0 { &self.forest.leaves[index].boxes } else { &self.forest.nodes[index] }
    }

    #[inline(always)]
    fn slabs(&self, at: At) -> &'a Slabs {
        let index = self.forest.trees[at.tree as usize].starts[at.level as usize] as usize + at.index as usize;
        if at.level == 0 { &self.forest.leaf_slabs[index] } else { &self.forest.node_slabs[index] }
    }

    /// What is below `at` and overlaps what lies in one lane of what is below `of`.
    #[inline(always)]
    fn overlapping(&self, at: At, of: At, lane: usize, lanes: impl Lanes) -> u32 {
        let found = lanes.overlapping(self.boxes(at), self.boxes(of), lane);
        if SLABS && found != 0 { found & lanes.overlapping(self.slabs(at), self.slabs(of), lane) } else { found }
    }

    /// Pairs of one triangle of each of two nodes, or of two of one.
    #[inline(always)]
    fn below(&mut self, pair: [At; 2], lanes: impl Lanes) -> bool {
        self.stack.clear();
        self.stack.push(pair);
        while let Some([a, b]) = self.stack.pop() {
            if a.level.max(b.level) == 0 {
                self.leaves(a, b, lanes);
                if self.rows.is_full() && !self.compare(lanes) {
                    return false;
                }
            } else if a == b {
                let boxes = self.boxes(a);
                for i in (0..WIDTH).take_while(|i| boxes.is_set(*i)) {
                    self.stack.push([a.child(i); 2]);
                    let later = self.overlapping(a, a, i, lanes) & (!1 << i);
                    self.stack.extend(bits(later).map(|j| [a.child(i), a.child(j)]));
                }
            } else {
                let (a, b) = if a.level < b.level { (b, a) } else { (a, b) };
                let (others, lane) = b.parent();
                for i in bits(self.overlapping(a, others, lane, lanes)) {
                    if a.level > b.level {
                        self.stack.push([a.child(i), b]);
                    } else {
                        let found = self.overlapping(b, a, i, lanes);
                        self.stack.extend(bits(found).map(|j| [a.child(i), b.child(j)]));
                    }
                }
            }
        }
        self.compare(lanes)
    }

    /// Notes the rows of one leaf that are to be compared with another leaf, or with their own.
    #[inline(always)]
    fn leaves(&mut self, a: At, b: At, lanes: impl Lanes) {
        let number = |at: At| self.forest.trees[at.tree as usize].starts[0] + at.index;
        let (mut one, mut other) = (number(a), number(b));
        let mut rows = !0 >> 16;
        if one != other {
            // One by one those of the leaf of which fewer meet the other's box.
            let ((above_a, a_lane), (above_b, b_lane)) = (a.parent(), b.parent());
            rows = self.overlapping(a, above_b, b_lane, lanes);
            let others = self.overlapping(b, above_a, a_lane, lanes);
            if others.count_ones() < rows.count_ones() {
                (one, other, rows) = (other, one, others);
            }
        }
        lanes.append(&mut self.rows, other, one * WIDTH as u32, rows);
    }

    /// Compares the rows that were noted.
    #[inline(always)]
    fn compare(&mut self, lanes: impl Lanes) -> bool {
        let leaves = &self.forest.leaves[..];
        for [other, row] in self.rows.as_mut_slice().iter().map(|pair| pair.map(|x| x as usize)) {
            let (leaf, i, theirs) = (&leaves[row / WIDTH], row % WIDTH, &leaves[other]);
            // Within a leaf, those that come later.
            let wanted = if other == row / WIDTH { !1 << i } else { !0 };
            let mut found = lanes.overlapping(&theirs.boxes, &leaf.boxes, i) & wanted;
            if SLABS && found != 0 {
                let slabs = &self.forest.leaf_slabs;
                found &= lanes.overlapping(&slabs[other], &slabs[row / WIDTH], i);
            }
            let sharing = lanes.sharing(&theirs.corners, &leaf.corners, i);
            if found != 0 && !self.visit.visit(lanes, row, other * WIDTH, found, sharing) {
                return false;
            }
        }
        self.rows.clear();
        true
    }
}
