//! A tree of boxes over a loop's order: neighbours on the loop are neighbours in space, so the order of the loop is a good order
//! for the tree, and what belongs to a vertex can change in O(log n).

use std::ops::ControlFlow;

use glam::Vec4;

use crate::geometry::exact::Point;

/// Lowest and highest coordinates.
pub(super) type Box3 = (Point, Point);

/// The box of nothing.
pub(super) const EMPTY: Box3 = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);

pub(super) fn join(a: &Box3, b: &Box3) -> Box3 {
    ([0, 1, 2].map(|k| a.0[k].min(b.0[k])), [0, 1, 2].map(|k| a.1[k].max(b.1[k])))
}

/// The same, laid out so that two are compared in a few steps.
#[derive(Clone, Copy)]
struct Node {
    lo: Vec4,
    hi: Vec4,
}

impl Node {
    fn of((lo, hi): &Box3) -> Self {
        let four = |[x, y, z]: [f32; 3]| Vec4::new(x, y, z, 0.0);
        Self { lo: four(*lo), hi: four(*hi) }
    }

    fn join(&self, other: &Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    #[inline(always)]
    fn meets(&self, other: &Self) -> bool {
        (self.lo.cmple(other.hi) & other.lo.cmple(self.hi)).all()
    }
}

pub(super) fn around(points: &[Point]) -> Box3 {
    points.iter().fold(EMPTY, |b, p| join(&b, &(*p, *p)))
}

/// A segment tree of boxes.
pub(super) struct Boxes {
    /// Node 1 is the root, nodes 2i and 2i + 1 are the children of i, the leaf of item v is `leaves + v`.
    nodes: Vec<Node>,
    leaves: usize,
}

impl Boxes {
    pub(super) fn new(items: impl ExactSizeIterator<Item = Box3>) -> Self {
        let leaves = items.len().next_power_of_two();
        let mut nodes = vec![Node::of(&EMPTY); 2 * leaves];
        for (leaf, item) in nodes[leaves..].iter_mut().zip(items) {
            *leaf = Node::of(&item);
        }
        for node in (1..leaves).rev() {
            nodes[node] = nodes[2 * node].join(&nodes[2 * node + 1]);
        }
        Self { nodes, leaves }
    }

    pub(super) fn set(&mut self, v: usize, item: Box3) {
        let mut node = self.leaves + v;
        self.nodes[node] = Node::of(&item);
        while node > 1 {
            node /= 2;
            self.nodes[node] = self.nodes[2 * node].join(&self.nodes[2 * node + 1]);
        }
    }

    /// Visits the items whose boxes meet `what`, until told to break.
    pub(super) fn near(&self, what: &Box3, mut visit: impl FnMut(usize) -> ControlFlow<()>) -> ControlFlow<()> {
        let what = Node::of(what);
        // A path down and the siblings beside it: no more than the depth, which is less than 32.
        let mut stack = [0_usize; 34];
        stack[0] = 1;
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let node = stack[height];
            if self.nodes[node].meets(&what) {
                if node >= self.leaves {
                    visit(node - self.leaves)?;
                } else {
                    stack[height] = 2 * node;
                    stack[height + 1] = 2 * node + 1;
                    height += 2;
                }
            }
        }
        ControlFlow::Continue(())
    }

    /// Does `test` hold for an item whose box meets `what`?
    pub(super) fn any_near(&self, what: &Box3, mut test: impl FnMut(usize) -> bool) -> bool {
        self.near(what, |v| if test(v) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }).is_break()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn some_box() -> impl Strategy<Value = Box3> {
        prop::array::uniform2(prop::array::uniform3(-9_i8..10)).prop_map(|p| around(&p.map(|q| q.map(f32::from))))
    }

    proptest! {
        #[test]
        fn what_is_near_is_found_after_changes(
            items in prop::collection::vec(some_box(), 1..40),
            changes in prop::collection::vec((any::<prop::sample::Index>(), some_box()), 0..40),
            what in some_box(),
        ) {
            let mut items = items;
            let mut boxes = Boxes::new(items.iter().copied());
            for (i, item) in changes {
                let i = i.index(items.len());
                items[i] = item;
                boxes.set(i, item);
            }
            let mut found = Vec::new();
            let end = boxes.near(&what, |i| {
                found.push(i);
                ControlFlow::Continue(())
            });
            found.sort_unstable();
            let apart = |b: &Box3| (0..3).any(|k| b.1[k] < what.0[k] || b.0[k] > what.1[k]);
            prop_assert!(end.is_continue());
            prop_assert_eq!(found, (0..items.len()).filter(|&i| !apart(&items[i])).collect::<Vec<_>>());
        }
    }
}
