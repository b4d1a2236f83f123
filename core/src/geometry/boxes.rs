//! Which of many boxes meet a box: a bounding volume hierarchy by `obvhs`.

use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

use crate::geometry::sums::Bounds;

/// Many boxes, to be asked which of them meet another one.
pub(crate) struct BoxTree {
    tree: Bvh2,
}

impl BoxTree {
    /// O(n log n).
    pub(crate) fn new(boxes: &[Bounds]) -> Self {
        let boxes: Vec<Aabb> = boxes.iter().map(aabb).collect();
        let numbers = (0..boxes.len() as u32).collect();
        Self { tree: PlocBuilder::new().build(PlocSearchDistance::Minimum, &boxes, numbers, SortPrecision::U64, 0) }
    }

    /// Replaces `found` by the numbers of all boxes that meet `wanted`, ascending: the tree's own order is not to be relied on.
    pub(crate) fn meeting(&self, wanted: &Bounds, found: &mut Vec<u32>) {
        found.clear();
        self.tree.aabb_traverse(aabb(wanted), |tree, node| {
            let node = &tree.nodes[node as usize];
            let first = node.first_index as usize;
            found.extend(&tree.primitive_indices[first..first + node.prim_count as usize]);
            true
        });
        found.sort_unstable();
    }

    /// Does any box but this one meet `wanted`? O(log n) where few do, and where many do.
    pub(crate) fn meets_another(&self, wanted: &Bounds, but: u32) -> bool {
        let mut meets = false;
        self.tree.aabb_traverse(aabb(wanted), |tree, node| {
            let node = &tree.nodes[node as usize];
            let first = node.first_index as usize;
            meets |= tree.primitive_indices[first..first + node.prim_count as usize].iter().any(|i| *i != but);
            !meets
        });
        meets
    }
}

/// How many pairs of boxes meet; if that is more than `most`, no less than one more. O(n log n), and what meets along x.
pub(crate) fn meetings(mut boxes: Vec<Bounds>, most: u64) -> u64 {
    boxes.sort_unstable_by(|a, b| a.lo[0].total_cmp(&b.lo[0]));
    let mut count = 0;
    for (i, a) in boxes.iter().enumerate() {
        let along_x = boxes[i + 1..].iter().take_while(|b| b.lo[0] <= a.hi[0]);
        count += along_x.filter(|b| (1..3).all(|k| a.lo[k] <= b.hi[k] && b.lo[k] <= a.hi[k])).count() as u64;
        if count > most {
            break;
        }
    }
    count
}

fn aabb(b: &Bounds) -> Aabb {
    Aabb::new(Vec3A::from_array(b.lo), Vec3A::from_array(b.hi))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn finds_what_a_plain_loop_finds(points in prop::collection::vec((prop::array::uniform3(-9i8..9), prop::array::uniform3(0u8..5)), 0..60)) {
            let boxes: Vec<Bounds> = points
                .iter()
                .map(|(lo, size)| Bounds { lo: lo.map(f32::from), hi: std::array::from_fn(|k| f32::from(lo[k]) + f32::from(size[k])) })
                .collect();
            let tree = BoxTree::new(&boxes);
            let mut meeting = 0;
            let mut found = Vec::new();
            for wanted in &boxes {
                tree.meeting(wanted, &mut found);
                let meets = |b: &Bounds| (0..3).all(|k| b.lo[k] <= wanted.hi[k] && b.hi[k] >= wanted.lo[k]);
                let want: Vec<u32> = (0..boxes.len() as u32).filter(|i| meets(&boxes[*i as usize])).collect();
                prop_assert_eq!(&found, &want);
                prop_assert_eq!(tree.meets_another(wanted, want[0]), want.len() > 1);
                meeting += want.len() as u64 - 1;
            }
            prop_assert_eq!(meetings(boxes, u64::MAX), meeting / 2);
        }
    }
}
