//! A tree of boxes over triangles that answers three questions: how often the surface winds around a point, where a segment crosses
//! it, and how far a point is from it.
//!
//! Generalised winding numbers after Jacobson, Kavan & Sorkine-Hornung, "Robust inside-outside segmentation using generalized winding
//! numbers" (ACM TOG 32(4), 2013), far triangles taken together as in Barill, Dickson, Schmidt, Levin & Jacobson, "Fast winding numbers
//! for soups and clouds" (ACM TOG 37(4), 2018): dipoles and their first derivatives.
//!
//! Most of a surface is closed. Its rims are closed by **caps**, a cone over each, so that the whole winds a whole number of times around a point:
//! as often as a ray leaves it more than it enters, by exact predicates ([`bodies::crossing`]). What the caps wind is taken off again, and is a
//! matter of the rims' edges only, however long the triangles of the surface are. Where rims have many edges, as in a soup, the surface is asked
//! directly.
//!
//! **Deterministic.** The tree's shape depends on the triangles and their order alone, a query meets nodes in the tree's order, and all is done
//! by + − × ÷ √ in f64, which IEEE 754 fixes. Solid angles: [`super::angle`].

mod sides;

use glam::DVec3;

pub(crate) use super::angle::Corners;
use super::angle::{Angle, Angles, Lanes, Moments, WIDTH};
use crate::detect::bodies;
use crate::geometry::distance::{place, square_distance};
use crate::geometry::position::Position;
use crate::geometry::sums::Bounds;
use crate::util::steps;

/// Triangles in a leaf, at most.
const LEAF: usize = 8;

/// Fewer points are asked for one by one.
const WORTHWHILE: usize = 3;

/// Nodes stand in the order of a walk that goes down to the first child before the second.
#[derive(Clone)]
struct Node {
    bounds: Bounds,
    /// The node after everything below this one.
    next: u32,
    /// A leaf's triangles, none for others.
    first: u32,
    count: u32,
}

/// Triangles in a tree of boxes.
pub(crate) struct Tree {
    triangles: Vec<Corners>,
    nodes: Vec<Node>,
    /// For each node, where solid angles are asked for.
    moments: Vec<Moments>,
    /// The caps that close the surface, where rays are asked.
    caps: Option<Box<Self>>,
}

impl Tree {
    /// O(n log n); 36 bytes a triangle, and a node of some 50 for every five or so.
    pub(crate) fn new(triangles: &[Corners]) -> Self {
        let centres: Vec<[f32; 3]> =
            triangles.iter().map(|t| std::array::from_fn(|k| t[0][k] / 3.0 + t[1][k] / 3.0 + t[2][k] / 3.0)).collect();
        let mut order: Vec<u32> = (0..triangles.len() as u32).collect();
        let mut nodes = Vec::with_capacity(triangles.len() / 2 + 1);
        if !order.is_empty() {
            split(triangles, &centres, &mut order, 0, &mut nodes);
        }
        Self { triangles: order.iter().map(|t| triangles[*t as usize]).collect(), nodes, moments: Vec::new(), caps: None }
    }

    /// A tree that knows winding numbers, too.
    pub(crate) fn winding(triangles: &[Corners]) -> Self {
        let mut tree = Self::new(triangles);
        let caps = caps(triangles);
        if caps.len() < triangles.len() / 2 {
            tree.caps = Some(Box::new(Self::new(&caps).with_moments()));
            return tree;
        }
        tree.with_moments()
    }

    fn with_moments(mut self) -> Self {
        self.moments = (0..self.nodes.len()).map(|n| Moments::of(self.below(n))).collect();
        self
    }

    /// All triangles below a node: they stand in the order of the leaves.
    fn below(&self, node: usize) -> &[Corners] {
        let mut left = node;
        while self.nodes[left].count == 0 {
            left += 1;
        }
        let last = &self.nodes[self.nodes[node].next as usize - 1];
        &self.triangles[self.nodes[left].first as usize..(last.first + last.count) as usize]
    }

    /// How often the surface winds around a point: an integer if it is closed and the point not on it. Needs a tree made by
    /// [`Tree::winding`]; O(log n) for most points.
    pub(crate) fn winding_number(&self, point: DVec3) -> f64 {
        match &self.caps {
            Some(caps) => f64::from(self.passages(point) + caps.passages(point)) - caps.solid_angle(point),
            None => self.solid_angle(point),
        }
    }

    /// The same for many points: for each exactly what it is for one. Points that are near each other are asked for together, best in a row.
    pub(crate) fn winding_numbers(&self, points: &[DVec3]) -> Vec<f64> {
        let of_eight = |points: &[DVec3]| {
            if points.len() < WORTHWHILE {
                return points.iter().map(|p| self.winding_number(*p)).collect::<Vec<_>>();
            }
            let passages = |caps: &Self, p: &DVec3| f64::from(self.passages(*p) + caps.passages(*p));
            match &self.caps {
                Some(caps) => points.iter().zip(caps.solid_angles(points)).map(|(p, angle)| passages(caps, p) - angle).collect(),
                None => self.solid_angles(points)[..points.len()].to_vec(),
            }
        };
        points.chunks(WIDTH).flat_map(of_eight).collect()
    }

    /// How often a ray upwards leaves the surface's inside, less how often it enters.
    fn passages(&self, point: DVec3) -> i32 {
        let mut sum = 0;
        let mut n = 0;
        while n < self.nodes.len() {
            let node = &self.nodes[n];
            let [lo, hi] = [node.bounds.lo, node.bounds.hi].map(place);
            if point.x < lo.x || point.x > hi.x || point.y < lo.y || point.y > hi.y || point.z > hi.z {
                n = node.next as usize;
                continue;
            }
            for t in self.leaf(node) {
                sum += bodies::crossing(t, point.to_array());
            }
            n += 1;
        }
        sum
    }

    /// The solid angle of the surface as a share of the sphere's.
    fn solid_angle(&self, point: DVec3) -> f64 {
        let mut far = 0.0;
        let mut near = Angle::default();
        let mut n = 0;
        while n < self.nodes.len() {
            let (node, moments) = (&self.nodes[n], &self.moments[n]);
            let to = moments.centre - point;
            let square = to.length_squared();
            if square > moments.far {
                far += moments.seen_along(to, square);
                n = node.next as usize;
                continue;
            }
            for t in self.leaf(node) {
                near.add(t, point);
            }
            n += 1;
        }
        near.turns() + far / (4.0 * std::f64::consts::PI)
    }

    /// The same for up to eight points, bit by bit; those after the last one mean nothing.
    fn solid_angles(&self, points: &[DVec3]) -> [f64; WIDTH] {
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512vl") && is_x86_feature_detected!("avx512dq")
            {
                // SAFETY: the processor has what it is compiled for.
                return unsafe { self.solid_angles_avx512(points) };
            }
            if is_x86_feature_detected!("avx2") {
                // SAFETY: as above.
                return unsafe { self.solid_angles_avx2(points) };
            }
        }
        self.walk(points)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f,avx512vl,avx512dq")]
    fn solid_angles_avx512(&self, points: &[DVec3]) -> [f64; WIDTH] {
        self.walk(points)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn solid_angles_avx2(&self, points: &[DVec3]) -> [f64; WIDTH] {
        self.walk(points)
    }

    /// Each point takes part at the nodes that [`Tree::solid_angle`] would come to for it.
    #[inline(always)]
    fn walk(&self, points: &[DVec3]) -> [f64; WIDTH] {
        let lanes = Lanes::of(points);
        let mut far = [0.0; WIDTH];
        let mut near = Angles::default();
        // For each point the node at which it goes on.
        let mut from = [u64::MAX; WIDTH];
        from[..points.len()].fill(0);
        let mut n = 0;
        while n < self.nodes.len() {
            let (node, moments) = (&self.nodes[n], &self.moments[n]);
            let takes_part = from.map(|from| from <= n as u64);
            let is_far = moments.add_far(&lanes, takes_part, &mut far);
            let mut is_near = [false; WIDTH];
            for l in 0..WIDTH {
                from[l] = if is_far[l] { u64::from(node.next) } else { from[l] };
                is_near[l] = takes_part[l] & !is_far[l];
            }
            if !is_near.contains(&true) {
                n = node.next as usize;
                continue;
            }
            for t in self.leaf(node) {
                near.add(t, &lanes, is_near);
            }
            n += 1;
        }
        let near = near.turns();
        std::array::from_fn(|l| near[l] + far[l] / (4.0 * std::f64::consts::PI))
    }

    fn leaf(&self, node: &Node) -> &[Corners] {
        &self.triangles[node.first as usize..(node.first + node.count) as usize]
    }

    /// Where a segment leaves the surface's inside, as shares of its length, the one nearest its middle; of those that enter it if none
    /// leaves. `None`: it meets no triangle.
    pub(crate) fn leaves(&self, from: DVec3, to: DVec3) -> Option<f64> {
        let (lo, hi) = (from.min(to), from.max(to));
        let along = to - from;
        let mut best: Option<(bool, f64, f64)> = None;
        let mut n = 0;
        while n < self.nodes.len() {
            let node = &self.nodes[n];
            if (0..3).any(|k| f64::from(node.bounds.lo[k]) > hi[k] || f64::from(node.bounds.hi[k]) < lo[k]) {
                n = node.next as usize;
                continue;
            }
            for t in self.leaf(node) {
                if let Some((at, leaving)) = crossing(t, from, along) {
                    let candidate = (!leaving, (at - 0.5).abs(), at);
                    if best.is_none_or(|b| candidate < b) {
                        best = Some(candidate);
                    }
                }
            }
            n += 1;
        }
        best.map(|b| b.2)
    }

    /// The distance of a point from the nearest triangle; infinite if there is none.
    #[cfg(test)]
    pub(crate) fn distance(&self, point: DVec3) -> f64 {
        self.square_beyond(point, 0.0).sqrt()
    }

    /// Whether a point is no farther than `reach` from a triangle.
    pub(crate) fn is_within(&self, point: DVec3, reach: f64) -> bool {
        self.square_beyond(point, reach * reach) <= reach * reach
    }

    /// The largest of some points' distances; 0 if there are none. Most points need no more than a look at a triangle that is nearer.
    pub(crate) fn farthest(&self, points: impl IntoIterator<Item = DVec3>) -> f64 {
        points.into_iter().fold(0.0, |so_far: f64, p| so_far.max(self.square_beyond(p, so_far))).sqrt()
    }

    /// The square of a point's distance, if that is more than `enough`; else any number from that on up to `enough`.
    fn square_beyond(&self, point: DVec3, enough: f64) -> f64 {
        let mut best = f64::INFINITY;
        if !self.nodes.is_empty() {
            self.approach((point, enough), 0, &mut best);
        }
        best
    }

    fn approach(&self, (point, enough): (DVec3, f64), n: usize, best: &mut f64) {
        steps::count(1);
        let node = &self.nodes[n];
        if node.count > 0 {
            for t in self.leaf(node) {
                *best = best.min(square_distance(point, t.map(place)));
            }
            return;
        }
        let children = [n + 1, self.nodes[n + 1].next as usize];
        let [a, b] = children.map(|c| square_to_box(point, &self.nodes[c].bounds));
        let order = if b < a { [(children[1], b), (children[0], a)] } else { [(children[0], a), (children[1], b)] };
        for (child, square) in order {
            if square < *best && *best > enough {
                self.approach((point, enough), child, best);
            }
        }
    }
}

/// Makes the node over `order`, whose triangles begin at `first`, and all below it.
fn split(triangles: &[Corners], centres: &[[f32; 3]], order: &mut [u32], first: u32, nodes: &mut Vec<Node>) {
    let mut bounds = Bounds::EMPTY;
    let mut spread = Bounds::EMPTY;
    for t in order.iter() {
        bounds.include(&triangles[*t as usize]);
        spread.include(&[centres[*t as usize]]);
    }
    let number = nodes.len();
    nodes.push(Node { bounds, next: 0, first, count: 0 });
    if order.len() <= LEAF {
        // The selections leave them in any order.
        order.sort_unstable();
        nodes[number].count = order.len() as u32;
    } else {
        let width = |k: usize| spread.hi[k] - spread.lo[k];
        let axis = (1..3).fold(0, |best, k| if width(k) > width(best) { k } else { best });
        let half = order.len() / 2;
        order.select_nth_unstable_by(half, |a, b| {
            let [p, q] = [a, b].map(|t| centres[*t as usize][axis]);
            p.total_cmp(&q).then(a.cmp(b))
        });
        let (low, high) = order.split_at_mut(half);
        split(triangles, centres, low, first, nodes);
        split(triangles, centres, high, first + half as u32, nodes);
    }
    nodes[number].next = nodes.len() as u32;
}

/// A triangle over every edge of a surface that is not used equally often both ways, with a corner in the middle of the rim that it belongs to:
/// together with them the surface is closed. O(n log n).
fn caps(triangles: &[Corners]) -> Vec<Corners> {
    let mut uses: Vec<(Position, Position, i32)> = triangles
        .iter()
        .flat_map(|t| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])])
        .map(|(a, b)| (Position::of(a), Position::of(b)))
        .filter(|(a, b)| a != b)
        .map(|(a, b)| if a < b { (a, b, 1) } else { (b, a, -1) })
        .collect();
    uses.sort_unstable();
    // Every rim edge as it must be run through by what closes it.
    let rim: Vec<[Position; 2]> = uses
        .chunk_by(|a, b| (a.0, a.1) == (b.0, b.1))
        .flat_map(|uses| {
            let (low, high, _) = uses[0];
            let lacks = -uses.iter().map(|u| u.2).sum::<i32>();
            let edge = if lacks > 0 { [low, high] } else { [high, low] };
            std::iter::repeat_n(edge, lacks.unsigned_abs() as usize)
        })
        .collect();
    drop(uses);
    let mut vertices: Vec<Position> = rim.as_flattened().to_vec();
    vertices.sort_unstable();
    vertices.dedup();
    let number = |p: &Position| vertices.partition_point(|q| q < p) as u32;
    let mut parents: Vec<u32> = (0..vertices.len() as u32).collect();
    for [a, b] in &rim {
        crate::util::union_find::unite(&mut parents, number(a), number(b));
    }
    let mut middles = vec![(DVec3::ZERO, 0.0); vertices.len()];
    for (v, p) in vertices.iter().enumerate() {
        let middle = &mut middles[crate::util::union_find::find(&mut parents, v as u32) as usize];
        middle.0 += place(p.coordinates());
        middle.1 += 1.0;
    }
    let mut cap = |[a, b]: &[Position; 2]| {
        let (sum, count) = middles[crate::util::union_find::find(&mut parents, number(a)) as usize];
        [a.coordinates(), b.coordinates(), (sum / count).to_array().map(|x| x as f32)]
    };
    rim.iter().map(&mut cap).collect()
}

/// Where a segment crosses a triangle, as a share of its length, and whether it leaves the inside there. Rims count with a little more, lest
/// one slips through between two triangles: nothing but the place of a vertex depends on it.
fn crossing(t: &Corners, from: DVec3, along: DVec3) -> Option<(f64, bool)> {
    const MORE: f64 = 1e-9;
    let [a, b, c] = t.map(place);
    let (u, v) = (b - a, c - a);
    let normal = u.cross(v);
    let steep = normal.dot(along);
    if steep == 0.0 {
        return None;
    }
    let at = normal.dot(a - from) / steep;
    if !(0.0..=1.0).contains(&at) {
        return None;
    }
    let q = from + along * at - a;
    let square = normal.length_squared();
    let (s, r) = (q.cross(v).dot(normal) / square, u.cross(q).dot(normal) / square);
    (s >= -MORE && r >= -MORE && s + r <= 1.0 + MORE).then_some((at, steep > 0.0))
}

fn square_to_box(p: DVec3, b: &Bounds) -> f64 {
    let out = (place(b.lo) - p).max(p - place(b.hi)).max(DVec3::ZERO);
    out.length_squared()
}

#[cfg(test)]
mod tests;
