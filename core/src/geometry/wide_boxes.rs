//! Boxes in a tree of wide nodes: sixteen are held against another one in a few steps.

use glam::Vec4;

use crate::geometry::sums::Bounds;
use crate::util::each::Each;
use crate::util::steps;

/// Boxes of a node.
const WIDTH: usize = 16;

/// Sixteen boxes. A missing one meets nothing that is finite; whoever goes on below a lane asks first whether its box is there.
struct Node {
    lo: [[Vec4; WIDTH / 4]; 3],
    hi: [[Vec4; WIDTH / 4]; 3],
}

/// A box for each lane.
struct Wanted {
    lo: [Vec4; 3],
    hi: [Vec4; 3],
}

impl Wanted {
    #[inline(always)]
    fn of(bounds: &Bounds) -> Self {
        Self { lo: bounds.lo.each(Vec4::splat), hi: bounds.hi.each(Vec4::splat) }
    }
}

/// Boxes in an order in which those near each other stand together.
pub(super) struct WideTree {
    /// Their numbers.
    order: Vec<u32>,
    /// Nodes over the boxes, nodes over these, and so on up to one. What node i is over begins at 16 i.
    levels: Vec<Vec<Node>>,
}

impl Node {
    fn of(boxes: &[Bounds]) -> Self {
        let end = |k: usize, end: fn(&Bounds) -> [f32; 3], none: f32| {
            let lane = |l: usize| boxes.get(l).map_or(none, |b| end(b)[k]);
            std::array::from_fn(|q| Vec4::from_array(std::array::from_fn(|l| lane(4 * q + l))))
        };
        Self {
            lo: std::array::from_fn(|k| end(k, |b| b.lo, f32::INFINITY)),
            hi: std::array::from_fn(|k| end(k, |b| b.hi, f32::NEG_INFINITY)),
        }
    }

    /// Which meet a box, a bit each.
    #[inline(always)]
    fn meeting(&self, wanted: &Wanted) -> u32 {
        let mut lanes = 0;
        for q in 0..WIDTH / 4 {
            let along = |k: usize| self.lo[k][q].cmple(wanted.hi[k]) & self.hi[k][q].cmpge(wanted.lo[k]);
            lanes |= (along(0) & along(1) & along(2)).bitmask() << (4 * q);
        }
        lanes
    }

    /// Which hold a box, a bit each.
    #[inline(always)]
    fn around(&self, inner: &Wanted) -> u32 {
        let mut lanes = 0;
        for q in 0..WIDTH / 4 {
            let along = |k: usize| self.lo[k][q].cmple(inner.lo[k]) & self.hi[k][q].cmpge(inner.hi[k]);
            lanes |= (along(0) & along(1) & along(2)).bitmask() << (4 * q);
        }
        lanes
    }

    fn bounds(&self, lane: usize) -> Bounds {
        let end = |of: &[[Vec4; WIDTH / 4]; 3]| std::array::from_fn(|k| of[k][lane / 4][lane % 4]);
        Bounds { lo: end(&self.lo), hi: end(&self.hi) }
    }
}

impl WideTree {
    pub(super) fn new(order: Vec<u32>, boxes: &[Bounds]) -> Self {
        let mut below: Vec<Bounds> = order.iter().map(|i| boxes[*i as usize]).collect();
        let mut levels = Vec::new();
        while !below.is_empty() {
            levels.push(below.chunks(WIDTH).map(Node::of).collect());
            let whole = |boxes: &[Bounds]| {
                let mut whole = Bounds::EMPTY;
                boxes.iter().for_each(|b| whole.add(b));
                whole
            };
            below = if below.len() <= WIDTH { Vec::new() } else { below.chunks(WIDTH).map(whole).collect() };
        }
        Self { order, levels }
    }

    /// Visits the numbers of all boxes that meet `wanted`, in an order that is not to be relied on.
    pub(super) fn each_meeting(&self, wanted: &Bounds, mut visit: impl FnMut(u32)) {
        let wanted = Wanted::of(wanted);
        self.any(&|node| node.meeting(&wanted), &mut |number| {
            visit(number);
            false
        });
    }

    /// As [`Self::each_meeting`], without the parts of the tree whose boxes do not `pass`.
    pub(super) fn each_that(&self, wanted: &Bounds, passes: impl Fn(&Bounds) -> bool, visit: &mut impl FnMut(u32)) {
        let wanted = Wanted::of(wanted);
        let lanes = |node: &Node| {
            steps::count(1);
            let meeting = node.meeting(&wanted);
            (0..WIDTH).filter(|l| meeting >> l & 1 == 1 && !passes(&node.bounds(*l))).fold(meeting, |lanes, l| lanes & !(1 << l))
        };
        self.any(&lanes, &mut |number| {
            visit(number);
            false
        });
    }

    /// Is any box that meets `wanted` asked for, by number?
    pub(super) fn any_meeting(&self, wanted: &Bounds, mut is_asked_for: impl FnMut(u32) -> bool) -> bool {
        let wanted = Wanted::of(wanted);
        self.any(&|node| node.meeting(&wanted), &mut is_asked_for)
    }

    /// Is any box that holds `inner` asked for, by number?
    pub(super) fn any_around(&self, inner: &Bounds, mut is_asked_for: impl FnMut(u32) -> bool) -> bool {
        let inner = Wanted::of(inner);
        let lanes = |node: &Node| {
            steps::count(1);
            node.around(&inner)
        };
        self.any(&lanes, &mut is_asked_for)
    }

    /// Visits the numbers of boxes below the `lanes` of nodes, until it is told to stop; says whether it was.
    #[inline(always)]
    fn any(&self, lanes: &impl Fn(&Node) -> u32, visit: &mut impl FnMut(u32) -> bool) -> bool {
        let Some(top) = self.levels.len().checked_sub(1) else { return false };
        self.descend((top, 0), lanes, 0, &mut |place| self.order.get(place).is_some_and(|number| visit(*number)))
    }

    /// Replaces `found` by the nodes of sixteen boxes whose own box meets `wanted`, unless they are more than `most`; says whether they are not.
    pub(super) fn leaves_meeting(&self, wanted: &Bounds, most: usize, found: &mut Vec<u32>) -> bool {
        found.clear();
        let of = Wanted::of(wanted);
        match self.levels.len() {
            0 => {}
            1 => found.push(0),
            levels => {
                self.descend((levels - 1, 0), &|node| node.meeting(&of), 1, &mut |leaf| {
                    found.push(leaf as u32);
                    found.len() > most
                });
            }
        }
        found.len() <= most
    }

    /// As [`Self::each_meeting`], in these nodes only.
    #[inline(always)]
    pub(super) fn each_of_leaves(&self, leaves: &[u32], wanted: &Bounds, mut visit: impl FnMut(u32)) {
        let wanted = Wanted::of(wanted);
        for leaf in leaves {
            let mut lanes = self.levels[0][*leaf as usize].meeting(&wanted);
            while lanes != 0 {
                if let Some(number) = self.order.get(*leaf as usize * WIDTH + lanes.trailing_zeros() as usize) {
                    visit(*number);
                }
                lanes &= lanes - 1;
            }
        }
    }

    /// As deep as there are levels above `bottom`: visits what lies below the `lanes` of nodes, by place, until it is told to stop; says whether it was.
    fn descend(
        &self,
        (level, node): (usize, usize),
        lanes: &impl Fn(&Node) -> u32,
        bottom: usize,
        visit: &mut impl FnMut(usize) -> bool,
    ) -> bool {
        let there = if level == 0 { self.order.len() } else { self.levels[level - 1].len() };
        let mut left = lanes(&self.levels[level][node]);
        while left != 0 {
            let below = node * WIDTH + left.trailing_zeros() as usize;
            // A missing box meets one that has no end, and is around an empty one.
            if below >= there {
                break;
            }
            left &= left - 1;
            let stops = if level > bottom { self.descend((level - 1, below), lanes, bottom, visit) } else { visit(below) };
            if stops {
                return true;
            }
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Boxes in a row, of which each level of the tree has a node that is not full: a box without an end meets each of them once, and each is around an
    /// empty one.
    #[test]
    fn missing_boxes_are_never_visited() {
        let endless = Bounds { lo: [f32::NEG_INFINITY; 3], hi: [f32::INFINITY; 3] };
        for count in [0, 1, 15, 17, 300, 5000] {
            let boxes: Vec<Bounds> =
                (0..count).map(|i| Bounds { lo: [i as f32, 0.0, 0.0], hi: [i as f32 + 0.5, 1.0, 1.0] }).collect();
            let tree = WideTree::new((0..count).collect(), &boxes);
            let mut met = Vec::new();
            tree.each_meeting(&endless, |number| met.push(number));
            met.sort_unstable();
            assert_eq!(met, (0..count).collect::<Vec<u32>>());
            let mut around = 0;
            tree.any_around(&Bounds::EMPTY, |_| {
                around += 1;
                false
            });
            assert_eq!(around, count);
            let mut leaves = Vec::new();
            assert!(tree.leaves_meeting(&endless, usize::MAX, &mut leaves));
            let mut met = 0;
            tree.each_of_leaves(&leaves, &endless, |_| met += 1);
            assert_eq!(met, count);
        }
    }
}
