//! Which of many boxes meet a box: wide nodes, in the order of bounding volume hierarchies by `obvhs`.

use glam::{DVec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

use crate::geometry::distance::place;
use crate::geometry::sums::Bounds;
use crate::geometry::wide_boxes::WideTree;
use crate::util::{parallel, scatter};

/// A plane that misses a box by less than this share of the coordinates, more than rounding does, is taken to meet it.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// So many boxes are brought into their order at a time, in memory for these alone. A power of the width of a node.
const AT_ONCE: usize = 1 << 12;

/// Many boxes, to be asked which of them meet another one. About 28 bytes a box.
pub(crate) struct BoxTree {
    wide: WideTree,
}

impl BoxTree {
    /// O(n log n).
    pub(crate) fn new(boxes: &[Bounds]) -> Self {
        Self::by(1, boxes)
    }

    /// The same tree, made by so many threads.
    pub(crate) fn by(threads: usize, boxes: &[Bounds]) -> Self {
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        halve(boxes, &mut order);
        let groups: Vec<&[u32]> = order.chunks(AT_ONCE).collect();
        let ordered = parallel::map(threads, groups.len(), |at| {
            let group = groups[at];
            let own: Vec<Bounds> = group.iter().map(|i| boxes[*i as usize]).collect();
            in_order(&hierarchy(&own)).into_iter().map(|place| group[place as usize]).collect::<Vec<u32>>()
        });
        Self { wide: WideTree::new(ordered.concat(), boxes) }
    }

    /// Replaces `found` by the numbers of all boxes that meet `wanted`, ascending: the tree's own order is not to be relied on.
    pub(crate) fn meeting(&self, wanted: &Bounds, found: &mut Vec<u32>) {
        found.clear();
        self.each_meeting(wanted, |i| found.push(i));
        found.sort_unstable();
    }

    /// Visits the numbers of all boxes that meet `wanted`, in an order that is not to be relied on.
    pub(crate) fn each_meeting(&self, wanted: &Bounds, visit: impl FnMut(u32)) {
        self.wide.each_meeting(wanted, visit);
    }

    /// Does any box meet `wanted`?
    pub(crate) fn meets(&self, wanted: &Bounds) -> bool {
        self.wide.any_meeting(wanted, |_| true)
    }

    /// Replaces `found` by the parts of the tree, of a few boxes each, that `wanted` meets, unless they are more than `most`; says whether they are not.
    pub(super) fn leaves_meeting(&self, wanted: &Bounds, most: usize, found: &mut Vec<u32>) -> bool {
        self.wide.leaves_meeting(wanted, most, found)
    }

    /// As [`Self::each_meeting`], in these parts of the tree only.
    #[inline(always)]
    pub(super) fn each_of_leaves(&self, leaves: &[u32], wanted: &Bounds, visit: impl FnMut(u32)) {
        self.wide.each_of_leaves(leaves, wanted, visit);
    }

    /// Visits the numbers of all boxes that meet a triangle, and maybe of some beside it. A long triangle that lies askew meets few of those that its box
    /// meets. The box may lie beside its plane, or beside an edge (three of the planes of Akenine-Möller, "Fast 3D triangle-box overlap testing", JGT 6(1), 2001).
    pub(crate) fn each_along(&self, corners: &[[f32; 3]; 3], mut visit: impl FnMut(u32)) {
        let [a, b, c] = corners.map(place);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let beyond = |from: DVec3, to: DVec3| ((to - from).cross(normal).normalize_or_zero(), from);
        let planes = [(normal, a), (-normal, a), beyond(a, b), beyond(b, c), beyond(c, a)];
        let may_meet = |of: &Bounds| {
            let [lo, hi] = [of.lo, of.hi].map(place);
            planes.iter().all(|(out, at)| {
                // From the middle of the box, and half of its width along `out`; both doubled.
                let away = out.dot((lo - at) + (hi - at));
                let rounding = ROUNDING * out.abs().dot(lo.abs().max(hi.abs()) + at.abs());
                away <= out.abs().dot(hi - lo) + rounding
            })
        };
        self.wide.each_that(&Bounds::of(corners), may_meet, &mut visit);
    }

    /// Is any box `wanted`, of those that may hold `inner`, by number? Parts of the tree that do not hold it are left out, so that among boxes
    /// of one size, of which each meets all others, few are looked at.
    pub(crate) fn any_around(&self, inner: &Bounds, wanted: impl FnMut(u32) -> bool) -> bool {
        self.wide.any_around(inner, wanted)
    }

    /// Does any box but this one meet `wanted`? O(log n) where few do, and where many do.
    pub(crate) fn meets_another(&self, wanted: &Bounds, but: u32) -> bool {
        self.wide.any_meeting(wanted, |i| i != but)
    }
}

/// Brings boxes near each other together in `order`, so many at a time: halves by the middles of the boxes, along the longest side of
/// these, and halves of these.
fn halve(boxes: &[Bounds], order: &mut [u32]) {
    if order.len() <= AT_ONCE {
        return;
    }
    // Twice that.
    let middle = |i: u32, k: usize| f64::from(boxes[i as usize].lo[k]) + f64::from(boxes[i as usize].hi[k]);
    let width = |k: usize| {
        let middles = order.iter().map(|i| middle(*i, k));
        let (lo, hi) = middles.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| (lo.min(x), hi.max(x)));
        hi - lo
    };
    let widths: [f64; 3] = std::array::from_fn(width);
    let axis = (1..3).fold(0, |longest, k| if widths[k] > widths[longest] { k } else { longest });
    // Whole groups below, so that no node is of two.
    let half = (order.len() / 2).next_multiple_of(AT_ONCE).min(order.len() - 1);
    order.select_nth_unstable_by(half, |a, b| middle(*a, axis).total_cmp(&middle(*b, axis)).then(a.cmp(b)));
    let (below, above) = order.split_at_mut(half);
    halve(boxes, below);
    halve(boxes, above);
}

/// A hierarchy over a few boxes.
fn hierarchy(boxes: &[Bounds]) -> Bvh2 {
    let numbers = (0..boxes.len() as u32).collect();
    PlocBuilder::new().build(PlocSearchDistance::Minimum, &uneven(boxes), numbers, SortPrecision::U64, 0)
}

/// The boxes from leaf to leaf: those of a node stand together.
fn in_order(tree: &Bvh2) -> Vec<u32> {
    let mut order = Vec::with_capacity(tree.primitive_indices.len());
    let mut waiting: Vec<u32> = tree.nodes.first().map(|_| 0).into_iter().collect();
    while let Some(node) = waiting.pop().map(|i| &tree.nodes[i as usize]) {
        let first = node.first_index;
        if node.is_leaf() {
            order.extend(&tree.primitive_indices[first as usize..][..node.prim_count as usize]);
        } else {
            waiting.extend([first, first + 1]);
        }
    }
    order
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

/// The boxes that the tree is built by: in [−1, 1], and each a little larger by its number, in no order.
///
/// The builder compares the areas of neighbours' unions (Benthin et al. 2022, *PLOC++*). Of many that are equal it joins two in each pass, and
/// takes O(n²): boxes at one place, boxes in an even row, and boxes whose areas are infinite or nothing in single precision.
fn uneven(boxes: &[Bounds]) -> Vec<Aabb> {
    let finite = |x: f32| f64::from(x.clamp(f32::MIN, f32::MAX));
    let mut whole = Bounds::EMPTY;
    boxes.iter().for_each(|b| whole.add(b));
    let ends = [whole.lo, whole.hi].map(|p| p.map(finite));
    let half = (0..3).map(|k| 0.5 * (ends[1][k] - ends[0][k])).fold(0.0, f64::max);
    let per_unit = if half > 0.0 { half.recip() } else { 0.0 };
    let scaled = |k: usize, x: f32| (finite(x) - 0.5 * (ends[0][k] + ends[1][k])) * per_unit;
    let grown = |(i, b): (u64, &Bounds)| {
        let lo: [f64; 3] = std::array::from_fn(|k| scaled(k, b.lo[k]));
        let hi: [f64; 3] = std::array::from_fn(|k| {
            let size = scaled(k, b.hi[k]) - lo[k];
            lo[k] + size + (AT_LEAST + size / 64.0) * scatter::share(3 * i + k as u64)
        });
        Aabb::new(Vec3A::from_array(lo.map(|x| x as f32)), Vec3A::from_array(hi.map(|x| x as f32)))
    };
    (0..).zip(boxes).map(grown).collect()
}

/// By how much the smallest boxes grow, at most; single precision tells it from nothing.
const AT_LEAST: f64 = 1.0 / (1 << 18) as f64;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::util::steps;
    use proptest::prelude::*;

    /// Boxes at one place, in an even row, and so large and small that their areas are none in single precision: the tree's depth is a
    /// logarithm only if its builder joins many in each pass.
    #[test]
    fn boxes_that_are_all_alike_do_not_make_a_chain() {
        let row = |step: f32, size: f32| -> Vec<Bounds> {
            (0..20_000).map(|i| Bounds { lo: [i as f32 * step, 0.0, 0.0], hi: [i as f32 * step + size, size, size] }).collect()
        };
        for (step, size) in [(0.0, 1.0), (1.0, 1.0), (1e30, 1e38), (0.0, 0.0), (0.0, 1e-42), (0.0, f32::INFINITY)] {
            let boxes = row(step, size);
            let passes = hierarchy(&boxes).depth(0);
            assert!(passes < 64, "{passes} for boxes of {size} every {step}");
            let mut found = Vec::new();
            BoxTree::new(&boxes).meeting(&boxes[7], &mut found);
            let meeting = |b: &Bounds| (0..3).all(|k| b.lo[k] <= boxes[7].hi[k] && boxes[7].lo[k] <= b.hi[k]);
            assert_eq!(found.len(), boxes.iter().filter(|b| meeting(b)).count());
        }
    }

    proptest! {
        #[test]
        fn finds_what_a_plain_loop_finds(points in prop::collection::vec((prop::array::uniform3(-9i8..9), prop::array::uniform3(0u8..5)), 0..400)) {
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
                // Along a triangle from end to end of the box, whose corners, edges and middle are in some of them.
                let [lo, hi] = [wanted.lo, wanted.hi];
                let corners = [lo, hi, [hi[0], lo[1], lo[2]]];
                found.clear();
                tree.each_along(&corners, |i| found.push(i));
                found.sort_unstable();
                prop_assert!(found.iter().all(|i| want.contains(i)));
                let holds = |b: &Bounds, p: DVec3| place(b.lo).cmple(p).all() && p.cmple(place(b.hi)).all();
                for (u, v) in (0..=8).flat_map(|u| (0..=8 - u).map(move |v| (f64::from(u) / 8.0, f64::from(v) / 8.0))) {
                    let [a, b, c] = corners.map(place);
                    let p = a + (b - a) * u + (c - a) * v;
                    prop_assert!((0..boxes.len()).all(|i| !holds(&boxes[i], p) || found.contains(&(i as u32))));
                }
                prop_assert_eq!(tree.meets_another(wanted, want[0]), want.len() > 1);
                meeting += want.len() as u64 - 1;
            }
            prop_assert_eq!(meetings(boxes, u64::MAX), meeting / 2);
        }
    }

    #[test]
    fn boxes_around_a_box_are_found_without_a_look_at_all_that_meet_it() {
        steps::assert_near_linear(500, |n| {
            let side = (n as f32).sqrt() as i16;
            let at = |i: usize| [i as i16 % side, -(i as i16 % side), i as i16 / side].map(f32::from);
            let around = |i: usize, by: f32| Bounds { lo: at(i).map(|x| x - by), hi: at(i).map(|x| x + by) };
            // Each meets all others, and none holds another one, but for the last.
            let by = f32::from(side) / 2.0;
            let mut boxes: Vec<Bounds> = (0..n).map(|i| around(i, by)).collect();
            boxes.push(around(7, 0.9 * by));
            let tree = BoxTree::new(&boxes);
            let is_held = |i: usize| tree.any_around(&boxes[i], |j| j as usize != i && boxes[j as usize].contains(&boxes[i]));
            let (steps, held) = steps::of(|| (0..boxes.len()).filter(|i| is_held(*i)).collect::<Vec<_>>());
            assert_eq!(held, [n]);
            steps
        });
    }
}
