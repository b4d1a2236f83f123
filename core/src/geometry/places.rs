//! Places that are looked for along a file: many boxes in all, few of them near any stretch of it.

use crate::geometry::boxes::BoxTree;
use crate::geometry::grid::Grid;
use crate::geometry::sums::Bounds;

/// Boxes that are looked for.
pub(crate) struct Places {
    tree: BoxTree,
    grid: Grid,
    /// Around all of them.
    all: Bounds,
}

/// Nodes of 16 boxes that are held against every triangle of a stretch, at most; where there are more, the tree is asked.
const MOST: usize = 8;

/// The boxes that may meet a stretch: all of them, before any stretch is entered.
#[derive(Default)]
pub(crate) struct Stretch {
    nodes: Vec<u32>,
    is_short: bool,
}

impl Places {
    /// O(n log n).
    pub(crate) fn of(boxes: &[Bounds]) -> Self {
        let mut grid = Grid::default();
        grid.mark(boxes.iter().copied());
        let mut all = Bounds::EMPTY;
        boxes.iter().for_each(|b| all.add(b));
        Self { tree: BoxTree::new(boxes), grid, all }
    }

    /// Where these triangles are looked at, if any box may meet their box.
    pub(crate) fn within(&self, bounds: &Bounds) -> Option<Stretch> {
        bounds.overlap(&self.all).map(|_| Stretch::default())
    }

    /// Enters a stretch with this box: only triangles in it may be asked for until the next. May any box meet it?
    pub(crate) fn enter(&self, stretch: &mut Stretch, bounds: &Bounds) -> bool {
        if !self.grid.may_meet(bounds) {
            return false;
        }
        stretch.nodes.clear();
        stretch.is_short = self.tree.leaves_meeting(bounds, MOST, &mut stretch.nodes);
        !stretch.nodes.is_empty()
    }

    /// Visits the numbers of the boxes that meet `wanted`, which lies in the stretch, in an order that is not to be relied on.
    #[inline(always)]
    pub(crate) fn each_meeting(&self, stretch: &Stretch, wanted: &Bounds, visit: impl FnMut(u32)) {
        if stretch.is_short {
            self.tree.each_of_leaves(&stretch.nodes, wanted, visit);
        } else if self.grid.may_meet(wanted) {
            self.tree.each_meeting(wanted, visit);
        }
    }

    /// Does any box meet `wanted`, which lies in the stretch?
    #[inline(always)]
    pub(crate) fn meet(&self, stretch: &Stretch, wanted: &Bounds) -> bool {
        let mut meets = false;
        self.each_meeting(stretch, wanted, |_| meets = true);
        meets
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// The same boxes are found with a stretch and without, few or many.
        #[test]
        fn a_stretch_hides_nothing(
            boxes in prop::collection::vec((prop::array::uniform3(-40i16..40), prop::array::uniform3(0u8..6)), 0..400),
            asked in prop::collection::vec((prop::array::uniform3(-40i16..40), prop::array::uniform3(0u8..6)), 1..12),
            size in 0u8..40,
        ) {
            let bounds = |(lo, size): &([i16; 3], [u8; 3])| {
                let lo = lo.map(f32::from);
                Bounds { lo, hi: std::array::from_fn(|k| lo[k] + f32::from(size[k])) }
            };
            let boxes: Vec<Bounds> = boxes.iter().map(bounds).collect();
            let places = Places::of(&boxes);
            let mut stretch = Stretch::default();
            for (lo, inner) in &asked {
                let whole = bounds(&(*lo, [size; 3]));
                let inner = bounds(&(*lo, inner.map(|x| x.min(size))));
                let want: Vec<u32> = (0..).zip(&boxes).filter(|(_, b)| b.overlap(&inner).is_some()).map(|(i, _)| i).collect();
                if places.enter(&mut stretch, &whole) {
                    let mut got = Vec::new();
                    places.each_meeting(&stretch, &inner, |i| got.push(i));
                    got.sort_unstable();
                    prop_assert_eq!(&got, &want);
                    prop_assert_eq!(places.meet(&Stretch::default(), &inner), !want.is_empty());
                } else {
                    prop_assert!(want.is_empty());
                }
            }
        }
    }
}
