//! Does a set of triangles cross itself? An own binary box tree over the triangles, walked against itself.

use crate::geometry::tri_tri::{Triangle, boxed_cross};

/// The findings of [`self_crossing`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SelfCrossing {
    /// No two triangles cross or overlap.
    None,
    /// These two do (the first pair in the tree's order).
    Pair(usize, usize),
    /// More pairs of boxes meet than the bound allows to look at.
    Undecided,
}

const LEAF: usize = 4;

struct Node {
    lo: [f32; 3],
    hi: [f32; 3],
    /// Range in the order of triangles.
    start: usize,
    end: usize,
    /// Children, none (0) for a leaf.
    left: usize,
    right: usize,
}

/// A triangle's box, and three times its middle.
struct Leaf {
    lo: [f32; 3],
    hi: [f32; 3],
    middle: [f64; 3],
}

impl Leaf {
    fn of(triangle: &Triangle) -> Self {
        let of = |k: usize| triangle.iter().map(move |p| p[k]);
        Self {
            lo: [0, 1, 2].map(|k| of(k).fold(f32::INFINITY, f32::min)),
            hi: [0, 1, 2].map(|k| of(k).fold(f32::NEG_INFINITY, f32::max)),
            middle: [0, 1, 2].map(|k| of(k).map(f64::from).sum()),
        }
    }

    fn meets(&self, other: &Self) -> bool {
        (0..3).all(|k| self.lo[k] <= other.hi[k] && other.lo[k] <= self.hi[k])
    }
}

fn build(leaves: &[Leaf], order: &mut [u32]) -> Vec<Node> {
    let (start, end) = (0, order.len());
    let mut nodes = vec![Node::over(leaves, order, start, end)];
    let mut next = 0;
    while let Some(node) = nodes.get(next) {
        let (start, end) = (node.start, node.end);
        if end - start > LEAF {
            let extent = |k: usize| f64::from(node.hi[k]) - f64::from(node.lo[k]);
            let axis = if extent(0) >= extent(1) && extent(0) >= extent(2) { 0 } else { 1 + usize::from(extent(2) > extent(1)) };
            let middle = |t: u32| leaves[t as usize].middle[axis];
            let half = (end - start) / 2;
            order[start..end].select_nth_unstable_by(half, |&s, &t| middle(s).total_cmp(&middle(t)).then(s.cmp(&t)));
            for (start, end) in [(start, start + half), (start + half, end)] {
                nodes.push(Node::over(leaves, order, start, end));
            }
            let last = nodes.len() - 1;
            nodes[next].left = last - 1;
            nodes[next].right = last;
        }
        next += 1;
    }
    nodes
}

impl Node {
    fn over(leaves: &[Leaf], order: &[u32], start: usize, end: usize) -> Self {
        let mut node = Self { lo: [f32::INFINITY; 3], hi: [f32::NEG_INFINITY; 3], start, end, left: 0, right: 0 };
        for leaf in order[start..end].iter().map(|t| &leaves[*t as usize]) {
            node.lo = [0, 1, 2].map(|k| node.lo[k].min(leaf.lo[k]));
            node.hi = [0, 1, 2].map(|k| node.hi[k].max(leaf.hi[k]));
        }
        node
    }
}

/// Looks for two triangles that cross or overlap, beyond the corners they share (by position); looks at no more than
/// `max_pairs` pairs. O(n log n) for surfaces without fans of very many triangles.
pub(crate) fn self_crossing(triangles: &[Triangle], max_pairs: u64) -> SelfCrossing {
    crossing_of_first(triangles, triangles.len(), max_pairs)
}

/// The same for the first `own` triangles among themselves and with the others, whatever these do among themselves.
pub(crate) fn crossing_of_first(triangles: &[Triangle], own: usize, max_pairs: u64) -> SelfCrossing {
    let mut order: Vec<u32> = (0..triangles.len() as u32).collect();
    let leaves: Vec<Leaf> = triangles.iter().map(Leaf::of).collect();
    let nodes = build(&leaves, &mut order);
    let mut looked_at = 0_u64;
    let mut stack = vec![(0, 0)];
    while let Some((i, j)) = stack.pop() {
        let (a, b) = (&nodes[i], &nodes[j]);
        if (0..3).any(|k| a.hi[k] < b.lo[k] || b.hi[k] < a.lo[k]) {
            continue;
        }
        if i == j && a.left != 0 {
            stack.extend([(a.left, a.left), (a.left, a.right), (a.right, a.right)]);
        } else if a.left != 0 && (b.left == 0 || a.end - a.start >= b.end - b.start) {
            stack.extend([(a.left, j), (a.right, j)]);
        } else if b.left != 0 {
            stack.extend([(i, b.left), (i, b.right)]);
        } else {
            for (x, &s) in order[a.start..a.end].iter().enumerate() {
                let from = if i == j { a.start + x + 1 } else { b.start };
                for &t in &order[from..b.end] {
                    if s.min(t) as usize >= own {
                        continue;
                    }
                    looked_at += 1;
                    let (s, t) = (s as usize, t as usize);
                    if leaves[s].meets(&leaves[t]) && boxed_cross(&triangles[s], &triangles[t]) {
                        return SelfCrossing::Pair(s.min(t), s.max(t));
                    }
                }
            }
            if looked_at > max_pairs {
                return SelfCrossing::Undecided;
            }
        }
    }
    SelfCrossing::None
}
