//! A tree of boxes over triangles: which of them can meet, and which a line along an axis can meet.

use super::judgement::Triangle;

/// Triangles of a leaf.
const LEAF: usize = 4;

/// Numbers of triangles in an order in which every range of them is halved by a box.
pub(super) struct Tree {
    order: Vec<u32>,
    /// Box of each triangle, in that order.
    own: Vec<Box3>,
    /// Box of each range, as of a heap: halves of range n are 2n + 1 and 2n + 2.
    boxes: Vec<Box3>,
}

/// Least and largest corner.
#[derive(Clone, Copy)]
struct Box3([f32; 3], [f32; 3]);

impl Box3 {
    const NONE: Self = Self([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);

    fn with(self, other: Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k].min(other.0[k])), std::array::from_fn(|k| self.1[k].max(other.1[k])))
    }

    fn meets(&self, other: &Self) -> bool {
        (0..3).all(|k| self.0[k] <= other.1[k] && other.0[k] <= self.1[k])
    }

    /// Does a line along `axis` meet it?
    fn meets_line(&self, axis: usize, at: [f32; 3]) -> bool {
        (0..3).all(|k| k == axis || self.0[k] <= at[k] && at[k] <= self.1[k])
    }
}

/// A range of the order, by its place in the heap.
#[derive(Clone, Copy)]
struct Range {
    node: usize,
    from: usize,
    to: usize,
}

impl Range {
    fn is_leaf(self) -> bool {
        self.to - self.from <= LEAF
    }

    fn halves(self) -> [Self; 2] {
        let Self { node, from, to } = self;
        let middle = (from + to) / 2;
        [Self { node: 2 * node + 1, from, to: middle }, Self { node: 2 * node + 2, from: middle, to }]
    }
}

impl Tree {
    /// O(n log² n) time, at most 80 bytes a triangle.
    pub(super) fn new(triangles: &[Triangle]) -> Self {
        let of = |t: &Triangle| t.iter().fold(Box3::NONE, |all, &p| all.with(Box3(p, p)));
        let all: Vec<Box3> = triangles.iter().map(of).collect();
        let mut tree = Self { order: (0..triangles.len() as u32).collect(), own: Vec::new(), boxes: Vec::new() };
        let root = tree.root();
        tree.build(root, &all);
        tree.own = tree.order.iter().map(|&n| all[n as usize]).collect();
        tree
    }

    fn root(&self) -> Range {
        Range { node: 0, from: 0, to: self.order.len() }
    }

    fn build(&mut self, range: Range, all: &[Box3]) {
        let part = &mut self.order[range.from..range.to];
        let Box3(lo, hi) = part.iter().fold(Box3::NONE, |sum, &n| sum.with(all[n as usize]));
        if self.boxes.len() <= range.node {
            self.boxes.resize(range.node + 1, Box3::NONE);
        }
        self.boxes[range.node] = Box3(lo, hi);
        if !range.is_leaf() {
            let axis = (0..3).max_by(|&a, &b| (hi[a] - lo[a]).total_cmp(&(hi[b] - lo[b]))).unwrap_or(0);
            let place = |n: u32| f64::from(all[n as usize].0[axis]) + f64::from(all[n as usize].1[axis]);
            let middle = (range.to - range.from) / 2;
            part.select_nth_unstable_by(middle, |&a, &b| place(a).total_cmp(&place(b)));
            range.halves().into_iter().for_each(|half| self.build(half, all));
        }
    }

    /// Calls `each` with every pair of triangles whose boxes touch, once.
    pub(super) fn pairs(&self, each: &mut impl FnMut(u32, u32)) {
        self.within(self.root(), each);
    }

    fn within(&self, range: Range, each: &mut impl FnMut(u32, u32)) {
        if range.is_leaf() {
            for i in range.from..range.to {
                (i + 1..range.to).for_each(|j| self.pair(i, j, each));
            }
            return;
        }
        let [left, right] = range.halves();
        self.within(left, each);
        self.within(right, each);
        self.between(left, right, each);
    }

    fn between(&self, a: Range, b: Range, each: &mut impl FnMut(u32, u32)) {
        if !self.boxes[a.node].meets(&self.boxes[b.node]) {
            return;
        }
        match (a.is_leaf(), b.is_leaf()) {
            (true, true) => {
                for i in a.from..a.to {
                    (b.from..b.to).for_each(|j| self.pair(i, j, each));
                }
            }
            // The longer one is halved.
            (false, true) => a.halves().into_iter().for_each(|half| self.between(half, b, each)),
            (false, false) if a.to - a.from >= b.to - b.from => {
                a.halves().into_iter().for_each(|half| self.between(half, b, each))
            }
            _ => b.halves().into_iter().for_each(|half| self.between(a, half, each)),
        }
    }

    fn pair(&self, i: usize, j: usize, each: &mut impl FnMut(u32, u32)) {
        if self.own[i].meets(&self.own[j]) {
            each(self.order[i], self.order[j]);
        }
    }

    /// Calls `each` with every triangle whose box is met by the line along `axis` through `at`.
    pub(super) fn on_line(&self, axis: usize, at: [f32; 3], each: &mut impl FnMut(u32)) {
        self.line(self.root(), axis, at, each);
    }

    fn line(&self, range: Range, axis: usize, at: [f32; 3], each: &mut impl FnMut(u32)) {
        if !self.boxes[range.node].meets_line(axis, at) {
            return;
        }
        if range.is_leaf() {
            (range.from..range.to).filter(|&i| self.own[i].meets_line(axis, at)).for_each(|i| each(self.order[i]));
            return;
        }
        range.halves().into_iter().for_each(|half| self.line(half, axis, at, each));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_what_looking_at_all_finds() {
        let triangles: Vec<Triangle> = (0..150u32)
            .map(|i| {
                let at = |k: usize| (i * [7, 13, 29][k] % 31) as f32;
                [[at(0), at(1), at(2)], [at(0) + 3.0, at(1), at(2)], [at(0), at(1) + 3.0, at(2) + 2.0]]
            })
            .collect();
        let tree = Tree::new(&triangles);
        let of = |t: &Triangle| t.iter().fold(Box3::NONE, |all, &p| all.with(Box3(p, p)));
        let mut found = Vec::new();
        tree.pairs(&mut |a, b| found.push((a.min(b), a.max(b))));
        found.sort_unstable();
        let all = |i: u32| (i + 1..150).map(move |j| (i, j));
        let meet = |&(i, j): &(u32, u32)| of(&triangles[i as usize]).meets(&of(&triangles[j as usize]));
        let expected: Vec<_> = (0..150).flat_map(all).filter(meet).collect();
        assert!(expected.len() > 100);
        assert_eq!(found, expected);
        let mut hits = 0;
        for (axis, place) in (0..3).flat_map(|axis| (0..31).map(move |place| (axis, place))) {
            let at = [place, place * 5 % 31, place * 11 % 31].map(|x| x as f32 + 0.5);
            let mut found = Vec::new();
            tree.on_line(axis, at, &mut |n| found.push(n));
            found.sort_unstable();
            let expected: Vec<u32> = (0..150).filter(|&n| of(&triangles[n as usize]).meets_line(axis, at)).collect();
            hits += expected.len();
            assert_eq!(found, expected);
        }
        assert!(hits > 20, "{hits}");
        Tree::new(&[]).pairs(&mut |_, _| panic!("a pair of nothing"));
        Tree::new(&[]).on_line(0, [0.0; 3], &mut |_| panic!("a triangle of nothing"));
    }
}
