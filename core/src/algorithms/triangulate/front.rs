//! Ear clipping in space: the front advances over one vertex at a time, the best first, until what is left is small enough for
//! the minimum-weight triangulation.
//!
//! An ear is clipped when it is convex as seen along the surface around (the mesh's triangles beyond the rim, the ears already
//! clipped), holds no other vertex of the front, and crosses neither front, ears nor the mesh's triangles along the rim. In the
//! box tree for these questions a vertex stands for the front edge that starts there, and for its ear once it is clipped. About O(n log n) for loops that do not crowd.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::DVec3;

use super::boxes::{Box3, Boxes, around, join};
use super::clear::Clearance;
use super::minweight::{self, Choice, Weight};
use super::patch::Unfillable;
use super::planar::directed_area;
use super::rim::Rim;
use crate::geometry::exact::{Point, at};
use crate::geometry::tri_tri::{Triangle, segment_pierces, triangles_cross};

/// The ear that comes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    /// That with the shortest chord: the front shrinks evenly.
    Chord,
    /// That with the smallest angle.
    Angle,
}

/// The front stops at this many vertices and leaves them to the minimum-weight triangulation.
const REST: usize = 100;

/// Ears looked at for each vertex, before the front gives up. A loop that goes well needs about four.
const WORK: usize = 32;

/// How much a bend of 1 − cos = 1 against the triangles beside an ear puts it back.
const BEND_WEIGHT: f64 = 4.0;

struct Front<'a> {
    rim: &'a Rim<'a>,
    order: Order,
    positions: Vec<DVec3>,
    prev: Vec<u32>,
    next: Vec<u32>,
    /// The ear clipped at a vertex; `None` while it is on the front.
    ear: Vec<Option<[u32; 3]>>,
    /// For the front edge that starts at a vertex: unit normal of the triangle beyond it (zero: unknown) and that triangle's
    /// third corner, where the edge is no rim edge.
    beyond: Vec<(DVec3, Option<u32>)>,
    /// Normal where nothing is known about the triangles around.
    overall: DVec3,
    /// For each vertex: its front edge or its ear, and the mesh's triangle beyond its rim edge.
    boxes: Boxes,
    /// Number of vertices on the front.
    left: usize,
    /// Changes whenever a vertex's ear does; an older entry of the heap is void.
    version: Vec<u32>,
    heap: BinaryHeap<Reverse<(u64, u32, u32)>>,
    /// Take any ear that crosses nothing.
    relaxed: bool,
}

/// Closes the loop; what the front leaves, up to `max_rest` vertices, goes to the minimum-weight triangulation.
pub(super) fn triangulate(rim: &Rim<'_>, order: Order, max_rest: usize) -> Result<Vec<[u32; 3]>, Unfillable> {
    let mut front = Front::new(rim, order);
    front.advance(if rim.len() > REST { REST.min(max_rest).max(3) } else { 3 });
    if front.left > max_rest.max(3) {
        return Err(Unfillable::TooLarge);
    }
    // With more room the minimum-weight triangulation might have done it alone.
    let mut triangles = front.rest().map_err(|_| Unfillable::TooLarge)?;
    triangles.extend(front.ear.iter().flatten());
    Ok(triangles)
}

impl<'a> Front<'a> {
    fn new(rim: &'a Rim<'a>, order: Order) -> Self {
        let n = rim.len();
        let mut front = Self {
            rim,
            order,
            positions: rim.points.iter().map(at).collect(),
            prev: (0..n).map(|v| ((v + n - 1) % n) as u32).collect(),
            next: (0..n).map(|v| ((v + 1) % n) as u32).collect(),
            ear: vec![None; n],
            beyond: (0..n).map(|v| (rim.normal_beyond(v), None)).collect(),
            overall: directed_area(rim.points).normalize_or_zero(),
            boxes: Boxes::new(std::iter::empty()),
            left: n,
            version: vec![0; n],
            heap: BinaryHeap::new(),
            relaxed: false,
        };
        front.boxes = Boxes::new((0..n).map(|v| front.leaf_box(v)));
        front
    }

    fn leaf_box(&self, v: usize) -> Box3 {
        let edge = around(&[self.rim.points[v], self.rim.points[self.next[v] as usize]]);
        let held = self.ear[v].map_or(edge, |ear| around(&self.rim.corners(ear)));
        self.rim.neighbour(v).map_or(held, |t| join(&held, &around(&t)))
    }

    /// Clips ears until `target` vertices are left, or none can be clipped.
    fn advance(&mut self, target: usize) {
        // Ears looked at; a bound by count, so that it depends on the loop alone.
        let mut budget = WORK * self.rim.len();
        let mut progress = true;
        while self.left > target && (progress || !self.relaxed) {
            // What was in an ear's way may be gone by now; if no ear could be clipped, be less choosy for a while.
            self.relaxed = !progress;
            progress = false;
            self.heap.clear();
            for v in 0..self.rim.len() {
                self.push(v as u32);
            }
            budget = budget.saturating_sub(self.left);
            let enough = if self.relaxed { (self.left - self.left.div_ceil(8)).max(target) } else { target };
            while self.left > enough
                && let Some(Reverse((_, v, version))) = self.heap.pop()
            {
                if version != self.version[v as usize] || self.ear[v as usize].is_some() {
                    continue;
                }
                if budget == 0 {
                    return;
                }
                budget -= 1;
                if self.may_clip(v) {
                    self.clip(v);
                    progress = true;
                }
            }
        }
    }

    fn push(&mut self, v: u32) {
        let i = v as usize;
        if self.ear[i].is_some() {
            return;
        }
        self.version[i] += 1;
        let (p, n) = (self.prev[i] as usize, self.next[i] as usize);
        let (back, ahead) = (self.positions[p] - self.positions[i], self.positions[n] - self.positions[i]);
        let normal = ahead.cross(back).normalize_or_zero();
        let sides = [self.beyond[p].0, self.beyond[i].0];
        let surface = sides[0] + sides[1];
        let convex = normal.dot(if surface == DVec3::ZERO { self.overall } else { surface }) > 0.0;
        if !convex && !self.relaxed {
            return;
        }
        let bends: f64 = sides.iter().filter(|s| **s != DVec3::ZERO).map(|s| 1.0 - normal.dot(*s)).sum();
        let size = match self.order {
            Order::Chord => (ahead - back).length_squared(),
            Order::Angle => 1.0 - back.dot(ahead) / (back.length() * ahead.length()),
        };
        // Bits of floats that are not negative are in the order of the floats.
        let key = (size * (1.0 + BEND_WEIGHT * bends)).max(0.0);
        self.heap.push(Reverse((key.to_bits(), v, self.version[i])));
    }

    fn ear_at(&self, v: u32) -> [u32; 3] {
        [self.prev[v as usize], v, self.next[v as usize]]
    }

    fn may_clip(&self, v: u32) -> bool {
        let ear = self.ear_at(v);
        if !self.rim.allows(ear[0], ear[2]) || !self.rim.admits(ear) {
            return false;
        }
        let corners = self.rim.corners(ear);
        if self.rim.meets_obstacle(&corners) {
            return false;
        }
        let holder = (!self.relaxed).then(|| Holder::new(ear.map(|c| self.positions[c as usize])));
        !self.boxes.any_near(&around(&corners), |i| {
            let crosses = |t: &Triangle| triangles_cross(&corners, t).is_crossing();
            self.rim.neighbour(i).is_some_and(|t| crosses(&t))
                || match self.ear[i] {
                    Some(other) => crosses(&self.rim.corners(other)),
                    None => {
                        let end = self.next[i] as usize;
                        let inside =
                            |x: usize| !ear.contains(&(x as u32)) && holder.as_ref().is_some_and(|h| h.holds(self.positions[x]));
                        inside(i) || inside(end) || segment_pierces(&self.rim.points[i], &self.rim.points[end], &corners)
                    }
                }
        })
    }

    fn clip(&mut self, v: u32) {
        let ear = self.ear_at(v);
        let [p, c, n] = ear.map(|x| x as usize);
        let normal = (self.positions[n] - self.positions[c]).cross(self.positions[p] - self.positions[c]);
        self.ear[c] = Some(ear);
        self.next[p] = n as u32;
        self.prev[n] = p as u32;
        self.beyond[p] = (normal.normalize_or_zero(), Some(v));
        self.left -= 1;
        for v in [c, p] {
            self.boxes.set(v, self.leaf_box(v));
        }
        self.push(p as u32);
        self.push(n as u32);
    }

    /// Triangulates what is left of the front by minimum weight.
    fn rest(&self) -> Result<Vec<[u32; 3]>, Unfillable> {
        let vertices: Vec<u32> = (0..self.rim.len() as u32).filter(|&v| self.ear[v as usize].is_none()).collect();
        let points: Vec<Point> = vertices.iter().map(|&v| self.rim.points[v as usize]).collect();
        let apex = |&v: &u32| match self.beyond[v as usize].1 {
            Some(third) => Some(self.rim.points[third as usize]),
            None => self.rim.apexes.get(v as usize).copied().flatten(),
        };
        let apexes: Vec<_> = vertices.iter().map(apex).collect();
        let forbidden = |a: u32, b: u32| (self.rim.forbidden)(vertices[a as usize], vertices[b as usize]);
        let rest = Rim { points: &points, apexes: &apexes, obstacles: self.rim.obstacles, forbidden: &forbidden };
        let triangles = minweight::triangulate(&rest, Weight::Bend, Choice::Clear(&mut Clearance::new(&rest)))?;
        Ok(triangles.into_iter().map(|t| t.map(|v| vertices[v as usize])).collect())
    }
}

/// Says whether a point is over or under a triangle, near it.
struct Holder {
    corners: [DVec3; 3],
    normal: DVec3,
    reach: f64,
}

impl Holder {
    fn new(corners: [DVec3; 3]) -> Self {
        let [a, b, c] = corners;
        let longest = (b - a).length().max((c - b).length()).max((a - c).length());
        Self { corners, normal: (b - a).cross(c - a).normalize_or_zero(), reach: 0.5 * longest }
    }

    /// The chord, the third side, counts as inside.
    fn holds(&self, x: DVec3) -> bool {
        let [a, b, c] = self.corners;
        let beside = |p: DVec3, q: DVec3| (q - p).cross(x - p).dot(self.normal);
        beside(a, b) > 0.0 && beside(b, c) > 0.0 && beside(c, a) >= 0.0 && (x - a).dot(self.normal).abs() <= self.reach
    }
}
