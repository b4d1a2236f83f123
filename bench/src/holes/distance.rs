//! Distance from points to a mesh, by a tree of boxes.

use crate::mesh::{Triangle, Vector, dot, length, minus, wide};

/// Triangles in an order in which every range of them is halved by a box.
pub(crate) struct Tree {
    triangles: Vec<[Vector; 3]>,
    /// Box of each range, as of a heap: halves of range n are 2n + 1 and 2n + 2.
    boxes: Vec<[Vector; 2]>,
}

/// Triangles of a leaf.
const LEAF: usize = 8;

impl Tree {
    /// O(n log² n).
    pub(crate) fn new(triangles: &[Triangle]) -> Self {
        let mut tree = Self { triangles: triangles.iter().map(|t| t.map(wide)).collect(), boxes: Vec::new() };
        let count = tree.triangles.len();
        tree.build(0, 0, count);
        tree
    }

    fn build(&mut self, node: usize, from: usize, to: usize) {
        let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in self.triangles[from..to].as_flattened() {
            for k in 0..3 {
                lo[k] = lo[k].min(p[k]);
                hi[k] = hi[k].max(p[k]);
            }
        }
        if self.boxes.len() <= node {
            self.boxes.resize(node + 1, [lo, hi]);
        }
        self.boxes[node] = [lo, hi];
        if to - from > LEAF {
            let axis = (0..3).max_by(|&a, &b| (hi[a] - lo[a]).total_cmp(&(hi[b] - lo[b]))).unwrap_or(0);
            let middle = (from + to) / 2;
            let place = |t: &[Vector; 3]| t[0][axis] + t[1][axis] + t[2][axis];
            self.triangles[from..to].select_nth_unstable_by(middle - from, |a, b| place(a).total_cmp(&place(b)));
            self.build(2 * node + 1, from, middle);
            self.build(2 * node + 2, middle, to);
        }
    }

    /// Infinite from an empty mesh. About O(log n) for a point that is near.
    #[cfg(test)]
    pub(crate) fn distance(&self, p: Vector) -> f64 {
        self.distance_above(p, 0.0)
    }

    /// The distance, if it is more than `floor`, else any number up to that: what is near enough is not looked for to the end.
    fn distance_above(&self, p: Vector, floor: f64) -> f64 {
        let mut best = f64::INFINITY;
        self.nearer(p, floor, 0, 0, self.triangles.len(), &mut best);
        best
    }

    fn nearer(&self, p: Vector, floor: f64, node: usize, from: usize, to: usize, best: &mut f64) {
        if to - from <= LEAF {
            for &t in &self.triangles[from..to] {
                *best = best.min(to_triangle(p, t));
                if *best <= floor {
                    return;
                }
            }
            return;
        }
        let middle = (from + to) / 2;
        let mut halves = [(2 * node + 1, from, middle), (2 * node + 2, middle, to)].map(|half| (self.to_box(p, half.0), half));
        if halves[1].0 < halves[0].0 {
            halves.swap(0, 1);
        }
        for (away, (node, from, to)) in halves {
            if away < *best && *best > floor {
                self.nearer(p, floor, node, from, to, best);
            }
        }
    }

    fn to_box(&self, p: Vector, node: usize) -> f64 {
        let [lo, hi] = self.boxes[node];
        length(std::array::from_fn(|k| (lo[k] - p[k]).max(p[k] - hi[k]).max(0.0)))
    }
}

/// From a point to a triangle: to its plane, if the foot lies inside, else to the nearest edge.
fn to_triangle(p: Vector, [a, b, c]: [Vector; 3]) -> f64 {
    let (u, v, w) = (minus(b, a), minus(c, a), minus(p, a));
    let (uu, uv, vv, wu, wv) = (dot(u, u), dot(u, v), dot(v, v), dot(w, u), dot(w, v));
    let determinant = uu * vv - uv * uv;
    let (s, t) = ((vv * wu - uv * wv) / determinant, (uu * wv - uv * wu) / determinant);
    if s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
        return length(std::array::from_fn(|k| w[k] - s * u[k] - t * v[k]));
    }
    [(a, b), (b, c), (c, a)].into_iter().map(|(a, b)| to_segment(p, a, b)).fold(f64::INFINITY, f64::min)
}

fn to_segment(p: Vector, a: Vector, b: Vector) -> f64 {
    let (u, w) = (minus(b, a), minus(p, a));
    let t = (dot(u, w) / dot(u, u).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    length(std::array::from_fn(|k| w[k] - t * u[k]))
}

/// Largest distance from the corners and middles of a mesh to another mesh; 0 of an empty one.
pub(crate) fn farthest(from: &[Triangle], to: &Tree) -> f64 {
    let middle = |t: &Triangle| std::array::from_fn(|k| t.iter().map(|p| f64::from(p[k])).sum::<f64>() / 3.0);
    let corners = from.as_flattened().iter().map(|&p| wide(p));
    let points: Vec<_> = corners.chain(from.iter().map(middle)).collect();
    // A few from everywhere first: beside what is as far as these, the others need not be looked at closely.
    points.iter().step_by(61).chain(&points).fold(0.0, |far, &p| to.distance_above(p, far).max(far))
}

#[cfg(test)]
mod tests {
    use super::*;

    const T: Triangle = [[0.0; 3], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];

    #[test]
    fn to_the_inside_an_edge_a_corner_and_a_triangle_without_area() {
        let tree = Tree::new(&[T]);
        for (p, far) in
            [([1.0, 1.0, 2.0], 2.0), ([2.0, -3.0, 0.0], 3.0), ([-3.0, -4.0, 0.0], 5.0), ([4.0, 4.0, 0.0], 8.0_f64.sqrt())]
        {
            assert!((tree.distance(p) - far).abs() < 1e-12, "{p:?}");
        }
        assert_eq!(Tree::new(&[[[1.0, 0.0, 0.0]; 3]]).distance([1.0, 3.0, 4.0]), 5.0);
        assert_eq!(Tree::new(&[]).distance([0.0; 3]), f64::INFINITY);
    }

    #[test]
    fn the_tree_finds_what_looking_at_all_finds() {
        let many: Vec<Triangle> =
            (0..200u32).map(|i| T.map(|p| std::array::from_fn(|k| p[k] + (i * [7, 13, 29][k] % 101) as f32))).collect();
        let tree = Tree::new(&many);
        for i in 0..100 {
            let p = [i * 37 % 103, i * 53 % 107, i * 11 % 109].map(f64::from);
            let all = many.iter().map(|t| to_triangle(p, t.map(wide))).fold(f64::INFINITY, f64::min);
            assert_eq!(tree.distance(p), all);
        }
        assert_eq!(farthest(&many, &tree), 0.0);
        assert_eq!(farthest(&[T.map(|[x, y, z]| [x, y, z - 5.0])], &Tree::new(&[T])), 5.0);
    }
}
