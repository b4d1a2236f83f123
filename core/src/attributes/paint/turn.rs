//! The same paint on the same triangle, whose corners are counted in another order.
//!
//! Nodes of one and of three cuts have mirror images of their kind. Nodes of two cuts have none: they leave a trapezium, which is always cut along the same
//! diagonal. But two cuts are the same as one, and one more of the child opposite; mirrored, they are that, and that becomes them.

use super::split::Way;
use super::tree::{Paint, Split};

/// Corner by corner, which one it was.
pub(super) type Order = [usize; 3];

const AS_IT_IS: Order = [0, 1, 2];
const REVERSED: Order = [2, 1, 0];
const FIRST_TWO_SWAPPED: Order = [1, 0, 2];

/// All orders.
pub(super) const ORDERS: [Order; 6] = [AS_IT_IS, [1, 2, 0], [2, 0, 1], [0, 2, 1], REVERSED, FIRST_TWO_SWAPPED];

impl Paint {
    /// The same paint, second and third corner swapped. Twice gives the same paint again; the same tree, too, unless a node of one cut has
    /// a second child that is cut through the same middle. (That can be written as a node of two cuts as well.)
    ///
    /// O(n).
    pub(crate) fn mirrored(&self) -> Paint {
        self.turned([0, 2, 1])
    }

    /// The same paint, with `by` as the number of the corner that is now the first one. (Any number is taken modulo 3.)
    ///
    /// O(n).
    #[cfg(test)]
    pub(crate) fn rotated(&self, by: usize) -> Paint {
        self.turned([by % 3, (by + 1) % 3, (by + 2) % 3])
    }

    /// The same paint with the corners in this order. O(n).
    pub(super) fn turned(&self, order: Order) -> Paint {
        match self {
            Paint::Split(split) if order != AS_IT_IS => split.turned(order),
            _ => self.clone(),
        }
    }
}

impl Split {
    fn turned(&self, order: Order) -> Paint {
        match self.way {
            Way::Three => self.three_turned(order),
            way if order[1] == (order[0] + 1) % 3 => Paint::split(way, self.now(order, 0), self.children.clone()),
            Way::One => self.one_mirrored(order),
            Way::Two => self.two_mirrored(order),
        }
    }

    /// The number that corner A, B or C of this split (0 to 2) has in the other order.
    fn now(&self, order: Order, corner: u8) -> u8 {
        let was = usize::from(self.first + corner) % 3;
        order.iter().position(|old| *old == was).unwrap_or(0) as u8
    }

    fn child(&self, number: usize, order: Order) -> Paint {
        self.children.get(number).map_or(Paint::Uniform(0), |child| child.turned(order))
    }

    /// Children A B M and M C A of A B C are M B A and A C M of A C B. If the first is itself cut through M, at L in AB, all are children
    /// of two cuts of B A C: B L M, L A M and A C M.
    fn one_mirrored(&self, order: Order) -> Paint {
        let opposite = self.child(1, REVERSED);
        match self.children.first() {
            Some(Paint::Split(cut)) if cut.way == Way::One && cut.first == 2 => {
                let children = vec![cut.child(1, FIRST_TWO_SWAPPED), cut.child(0, REVERSED), opposite];
                Paint::split(Way::Two, self.now(order, 1), children)
            }
            _ => Paint::split(Way::One, self.now(order, 0), vec![opposite, self.child(0, REVERSED)]),
        }
    }

    /// Children A M N, M B N and B C N of A B C: B A C is cut through B, and its first child B A N through N.
    fn two_mirrored(&self, order: Order) -> Paint {
        let near = Paint::split(Way::One, 2, vec![self.child(1, REVERSED), self.child(0, FIRST_TWO_SWAPPED)]);
        Paint::split(Way::One, self.now(order, 1), vec![near, self.child(2, REVERSED)])
    }

    /// Each child is the one with the same three points. (The special corner becomes 0, as slicers want it.)
    fn three_turned(&self, order: Order) -> Paint {
        let counted = order.map(|was| (was + 3 - usize::from(self.first)) % 3);
        let was = |point: usize| match point {
            0..3 => counted[point],
            // Middles have the numbers of their sides plus 3, and a side is known by the corner opposite.
            _ => 3 + (counted[(point - 3 + 2) % 3] + 1) % 3,
        };
        let children = Way::Three.points().iter().map(|child| {
            let points = child.map(was);
            let orders = Way::Three
                .points()
                .iter()
                .enumerate()
                .map(|(number, old)| (number, points.map(|point| old.iter().position(|other| *other == point))));
            let found = orders.into_iter().find_map(|(number, order)| match order {
                [Some(a), Some(b), Some(c)] => Some((number, [a, b, c])),
                _ => None,
            });
            found.map_or(Paint::Uniform(0), |(number, order)| self.child(number, order))
        });
        Paint::split(Way::Three, 0, children.collect())
    }
}
