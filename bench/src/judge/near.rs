//! Distance from points to a mesh, and whether rays meet it, by a tree of boxes.

use super::judgement::Triangle;
use crate::space::{Vector, cross, dot, length, minus, wide};

/// Triangles in an order in which every range of them is halved by a box.
pub struct Near {
    triangles: Vec<[Vector; 3]>,
    /// Box of each range, as of a heap: halves of range n are 2n + 1 and 2n + 2.
    boxes: Vec<[Vector; 2]>,
}

/// Triangles of a leaf.
const LEAF: usize = 8;

impl Near {
    /// O(n log² n).
    pub fn new(triangles: &[Triangle]) -> Self {
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
    pub fn distance(&self, p: Vector) -> f64 {
        self.distance_above(p, 0.0)
    }

    /// The distance, if it is more than `floor`, else any number up to that: what is near enough is not looked for to the end.
    pub fn distance_above(&self, p: Vector, floor: f64) -> f64 {
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

    /// Does a ray meet a triangle farther than `least` along it (in lengths of `to`)?
    pub fn is_met(&self, from: Vector, to: Vector, least: f64) -> bool {
        let ray = Ray { from, to, per: to.map(|x| 1.0 / x), least };
        !self.triangles.is_empty() && self.meets(&ray, 0, 0, self.triangles.len())
    }

    fn meets(&self, ray: &Ray, node: usize, low: usize, high: usize) -> bool {
        if !ray.passes(self.boxes[node]) {
            return false;
        }
        if high - low <= LEAF {
            return self.triangles[low..high].iter().any(|t| along(ray.from, ray.to, *t).is_some_and(|far| far > ray.least));
        }
        let middle = (low + high) / 2;
        self.meets(ray, 2 * node + 1, low, middle) || self.meets(ray, 2 * node + 2, middle, high)
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

/// A ray that is looked for in boxes.
struct Ray {
    from: Vector,
    to: Vector,
    /// One over each coordinate of `to`.
    per: Vector,
    least: f64,
}

impl Ray {
    /// Does it pass a box? Where it runs within the plane of a side, those two sides do not decide.
    fn passes(&self, [lo, hi]: [Vector; 2]) -> bool {
        let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
        for k in 0..3 {
            let (a, b) = ((lo[k] - self.from[k]) * self.per[k], (hi[k] - self.from[k]) * self.per[k]);
            if !a.is_nan() && !b.is_nan() {
                (enter, leave) = (enter.max(a.min(b)), leave.min(a.max(b)));
            }
        }
        enter <= leave
    }
}

/// How far along a ray is a triangle, if the ray meets it?
fn along(from: Vector, to: Vector, [a, b, c]: [Vector; 3]) -> Option<f64> {
    let (u, v, w) = (minus(b, a), minus(c, a), minus(from, a));
    let across = cross(to, v);
    let scale = dot(u, across);
    if scale == 0.0 {
        return None;
    }
    let (s, other) = (dot(w, across) / scale, cross(w, u));
    let t = dot(to, other) / scale;
    (s >= 0.0 && t >= 0.0 && s + t <= 1.0).then(|| dot(v, other) / scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    const T: Triangle = [[0.0; 3], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];

    #[test]
    fn to_the_inside_an_edge_a_corner_and_a_triangle_without_area() {
        let tree = Near::new(&[T]);
        for (p, far) in
            [([1.0, 1.0, 2.0], 2.0), ([2.0, -3.0, 0.0], 3.0), ([-3.0, -4.0, 0.0], 5.0), ([4.0, 4.0, 0.0], 8.0_f64.sqrt())]
        {
            assert!((tree.distance(p) - far).abs() < 1e-12, "{p:?}");
        }
        assert_eq!(Near::new(&[[[1.0, 0.0, 0.0]; 3]]).distance([1.0, 3.0, 4.0]), 5.0);
        assert_eq!(Near::new(&[]).distance([0.0; 3]), f64::INFINITY);
    }

    #[test]
    fn the_tree_finds_what_looking_at_all_finds() {
        let many: Vec<Triangle> =
            (0..200u32).map(|i| T.map(|p| std::array::from_fn(|k| p[k] + (i * [7, 13, 29][k] % 101) as f32))).collect();
        let tree = Near::new(&many);
        for i in 0..100 {
            let p = [i * 37 % 103, i * 53 % 107, i * 11 % 109].map(f64::from);
            let all = many.iter().map(|t| to_triangle(p, t.map(wide))).fold(f64::INFINITY, f64::min);
            assert_eq!(tree.distance(p), all);
        }
        for i in 0..100 {
            let (p, to) = ([i * 37 % 103, i * 53 % 107, i * 11 % 109].map(f64::from), [f64::from(i) - 50.0, 31.0, -7.0]);
            let met = many.iter().any(|t| along(p, to, t.map(wide)).is_some_and(|far| far > 0.0));
            assert_eq!(tree.is_met(p, to, 0.0), met);
        }
    }

    #[test]
    fn rays_meet_what_is_before_them_and_farther_than_the_least() {
        let tree = Near::new(&[T]);
        let down = [0.0, 0.0, -1.0];
        assert!(tree.is_met([1.0, 1.0, 2.0], down, 0.0) && tree.is_met([1.0, 1.0, 2.0], down, 1.9));
        assert!(!tree.is_met([1.0, 1.0, 2.0], down, 2.1) && !tree.is_met([1.0, 1.0, -2.0], down, 0.0));
        assert!(!tree.is_met([3.0, 3.0, 2.0], down, 0.0) && !Near::new(&[]).is_met([0.0; 3], down, 0.0));
    }
}
