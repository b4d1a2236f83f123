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
//! by + − × ÷ √ in f64, which IEEE 754 fixes. A solid angle is twice the argument of a complex number (van Oosterom & Strackee, IEEE Trans.
//! Biomed. Eng. 30(2), 1983): the numbers of all near triangles are multiplied and the turns of the product counted, so that the angle itself
//! is needed once a query, from a series of our own rather than from the platform's `atan2`.

use glam::DVec3;

use crate::detect::bodies;
use crate::geometry::distance::{place, square_distance};
use crate::geometry::position::Position;
use crate::geometry::sums::Bounds;

/// A triangle by its positions.
pub(crate) type Corners = [[f32; 3]; 3];

/// Triangles in a leaf, at most.
const LEAF: usize = 8;

/// A node is far from a point beyond so many of its radii. The error of a winding number is then below some 10⁻², which matters only where
/// it is near ½: in the air of a hole.
const FAR: f64 = 2.0;

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

/// A node as it is seen from afar.
#[derive(Clone, Default)]
struct Moments {
    centre: DVec3,
    /// Squared distance beyond which this stands for the triangles.
    far: f64,
    /// Sum of the vector areas.
    dipole: DVec3,
    /// Vector areas times the places of their triangles: xx, yy, zz, and the sums of xy and yx, yz and zy, zx and xz.
    spread: [f64; 6],
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
    pub(crate) fn distance(&self, point: DVec3) -> f64 {
        let mut best = f64::INFINITY;
        if !self.nodes.is_empty() {
            self.approach(point, 0, &mut best);
        }
        best.sqrt()
    }

    fn approach(&self, point: DVec3, n: usize, best: &mut f64) {
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
            if square < *best {
                self.approach(point, child, best);
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
        // Whatever order the selection leaves.
        low.sort_unstable();
        high.sort_unstable();
        split(triangles, centres, low, first, nodes);
        split(triangles, centres, high, first + half as u32, nodes);
    }
    nodes[number].next = nodes.len() as u32;
}

impl Moments {
    fn of(triangles: &[Corners]) -> Self {
        let parts = triangles.iter().map(|t| {
            let [a, b, c] = t.map(place);
            ((a + b + c) / 3.0, (b - a).cross(c - a) / 2.0)
        });
        let (mut centre, mut total) = (DVec3::ZERO, 0.0);
        for (at, area) in parts.clone() {
            centre += at * area.length();
            total += area.length();
        }
        let centre = if total > 0.0 { centre / total } else { place(triangles[0][0]) };
        let mut moments = Self { centre, ..Self::default() };
        for (at, area) in parts {
            let by = at - centre;
            moments.dipole += area;
            let terms = [
                area.x * by.x,
                area.y * by.y,
                area.z * by.z,
                area.x * by.y + area.y * by.x,
                area.y * by.z + area.z * by.y,
                area.z * by.x + area.x * by.z,
            ];
            moments.spread.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
        }
        let radius = triangles.iter().flatten().map(|p| (place(*p) - centre).length_squared()).fold(0.0, f64::max);
        moments.far = FAR * FAR * radius;
        moments
    }

    /// The solid angle, seen from where the centre lies in direction `to`.
    fn seen_along(&self, to: DVec3, square: f64) -> f64 {
        let cube = square * square.sqrt();
        let [xx, yy, zz, xy, yz, zx] = self.spread;
        let bent =
            xx * to.x * to.x + yy * to.y * to.y + zz * to.z * to.z + xy * to.x * to.y + yz * to.y * to.z + zx * to.z * to.x;
        (self.dipole.dot(to) + (xx + yy + zz) - 3.0 * bent / square) / cube
    }
}

/// A sum of half solid angles, as the argument of a product of complex numbers and how often that went round.
struct Angle {
    re: f64,
    im: f64,
    rounds: f64,
}

impl Default for Angle {
    fn default() -> Self {
        Self { re: 1.0, im: 0.0, rounds: 0.0 }
    }
}

impl Angle {
    /// Adds a triangle as seen from a point.
    fn add(&mut self, t: &Corners, from: DVec3) {
        let (a, b, c) = (place(t[0]) - from, place(t[1]) - from, place(t[2]) - from);
        let (x, y, z) = (a.length(), b.length(), c.length());
        let (re, mut im) = (x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y, a.dot(b.cross(c)));
        let hardly = 1e-9 * x * y * z;
        if re.abs() + im.abs() < hardly {
            // On an edge: half of what the triangle takes up beside one of its inner points.
            im = hardly * side(t, from);
        } else if re < 0.0 && im.abs() < hardly {
            // Hardly off the triangle: which side it is decides by half a turn, and rays must agree with that.
            im = im.abs().max(1e-9 * hardly) * side(t, from);
        }
        let size = re.abs() + im.abs();
        if size.is_nan() || size <= 0.0 {
            // The point is a corner.
            return;
        }
        let (re, im) = (re / size, im / size);
        let product = (self.re * re - self.im * im, self.re * im + self.im * re);
        if self.im >= 0.0 && im >= 0.0 && product.1 < 0.0 {
            self.rounds += 1.0;
        } else if self.im < 0.0 && im < 0.0 && product.1 >= 0.0 {
            self.rounds -= 1.0;
        }
        let size = product.0.abs() + product.1.abs();
        (self.re, self.im) = (product.0 / size, product.1 / size);
    }

    /// In full turns, a sphere's solid angle being one.
    fn turns(&self) -> f64 {
        self.rounds + argument(self.re, self.im)
    }
}

/// 1 from within, −1 from without; a point in a triangle's plane counts as above it, as it does for a ray upwards.
fn side(t: &Corners, from: DVec3) -> f64 {
    let at = |p: DVec3| robust::Coord3D { x: p.x, y: p.y, z: p.z };
    let [a, b, c] = t.map(place);
    let below = robust::orient3d(at(a), at(b), at(c), at(from));
    if below != 0.0 { below.signum() } else { -(b - a).cross(c - a).z.signum() }
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

/// The argument of a complex number in turns, from −½ to ½; to some 10⁻¹⁰.
fn argument(re: f64, im: f64) -> f64 {
    let (small, large) = if im.abs() > re.abs() { (re.abs(), im.abs()) } else { (im.abs(), re.abs()) };
    let t = small / large;
    // Beyond an eighth of a right angle or so, what is left to a quarter of a half turn.
    let (base, t) = if t > 0.414 { (std::f64::consts::FRAC_PI_4, (t - 1.0) / (t + 1.0)) } else { (0.0, t) };
    let square = t * t;
    let series = (0..12).rev().fold(0.0, |sum, k| {
        let odd = f64::from(2 * k + 1);
        (if k % 2 == 0 { 1.0 } else { -1.0 }) / odd + square * sum
    });
    let mut angle = base + t * series;
    if im.abs() > re.abs() {
        angle = std::f64::consts::FRAC_PI_2 - angle;
    }
    if re < 0.0 {
        angle = std::f64::consts::PI - angle;
    }
    (if im < 0.0 { -angle } else { angle }) / (2.0 * std::f64::consts::PI)
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
