//! Triangles of a surface with their neighbours: places on a flat map of it, which say what is valid, and points in space, which say what
//! is good.
//!
//! Based on: O. R. Musin, *Properties of the Delaunay triangulation*, SoCG 1997: in a plane, an edge violates Delaunay's condition exactly
//! if its flip makes the sum of the cotangents of all angles smaller. The sum is taken in space here; each flip makes it smaller, so flips
//! come to an end on any surface.

use rayon::prelude::*;

use super::chart::Chart;
use super::triangles::Flat;
use crate::curves::vector::{Point, cross, dot, sub};
use crate::util::each::Each;

/// No triangle: an edge of a ring has this beyond it.
pub(super) const NONE: u32 = u32::MAX;
/// A flip makes the sum of cotangents smaller by at least this share.
const GAIN: f64 = 1e-9;
/// Areas of new triangles on the map, in parts of that of both.
const LEAST: f64 = 1e-9;
/// Triangles that a walk passes, at most.
const STEPS: u32 = 1000;

/// Triangles on a surface. An edge is thrice the number of its triangle and the number of the corner opposite to it.
#[derive(Debug)]
pub(super) struct Lifted<'a> {
    pub(super) flat: Flat,
    /// Of each place.
    pub(super) points: Vec<Point>,
    /// So many places at first are those of rings.
    pub(super) rim: usize,
    /// The map, once points are in space, and whether it is mirrored; before that, points are places.
    chart: Option<(&'a Chart, bool)>,
    /// For each edge of each triangle, the same edge of the triangle beyond.
    beyond: Vec<[u32; 3]>,
}

/// Where a walk ends: in a triangle, or at an edge of a ring.
#[derive(Clone, Copy, Debug)]
pub(super) enum End {
    In(u32),
    At(u32),
}

impl<'a> Lifted<'a> {
    /// Of triangles whose places are those of rings alone; points are places as yet. O(n log n).
    pub(super) fn new(flat: Flat) -> Self {
        let mut halves: Vec<(u32, u32, u32)> = Vec::with_capacity(3 * flat.triangles.len());
        for (number, [a, b, c]) in flat.triangles.iter().enumerate() {
            for (corner, (x, y)) in [(b, c), (c, a), (a, b)].into_iter().enumerate() {
                halves.push((*x.min(y), *x.max(y), 3 * number as u32 + corner as u32));
            }
        }
        halves.sort_unstable();
        let beyond = vec![[NONE; 3]; flat.triangles.len()];
        let points: Vec<Point> = flat.places.iter().map(|[x, y]| [*x, *y, 0.0]).collect();
        let mut lifted = Self { flat, rim: points.len(), points, chart: None, beyond };
        for pair in halves.windows(2) {
            if let &[(a, b, edge), (c, d, other)] = pair
                && (a, b) == (c, d)
            {
                lifted.link(edge, other);
            }
        }
        lifted
    }

    /// Takes all points to the surface; those of rings are given. O(places), in parallel.
    pub(super) fn raise(&mut self, rim: Vec<Point>, chart: &'a Chart, is_mirrored: bool) {
        self.chart = Some((chart, is_mirrored));
        self.points = rim;
        let within = self.flat.places.get(self.rim..).unwrap_or_default();
        let points: Vec<Point> = within.par_iter().map(|place| self.lift(*place)).collect();
        self.points.extend(points);
    }

    /// The point of a place.
    pub(super) fn lift(&self, [x, y]: [f64; 2]) -> Point {
        match self.chart {
            Some((chart, is_mirrored)) => chart.point([if is_mirrored { -x } else { x }, y]),
            None => [x, y, 0.0],
        }
    }

    pub(super) fn point(&self, number: u32) -> Point {
        self.points.get(number as usize).copied().unwrap_or_default()
    }

    pub(super) fn place(&self, number: u32) -> [f64; 2] {
        self.flat.places.get(number as usize).copied().unwrap_or_default()
    }

    pub(super) fn corners(&self, triangle: u32) -> [u32; 3] {
        self.flat.triangles.get(triangle as usize).copied().unwrap_or_default()
    }

    /// The corner opposite to an edge, and both of the edge, anticlockwise.
    pub(super) fn around(&self, edge: u32) -> [u32; 3] {
        let [a, b, c] = self.corners(edge / 3);
        match edge % 3 {
            0 => [a, b, c],
            1 => [b, c, a],
            _ => [c, a, b],
        }
    }

    pub(super) fn beyond(&self, edge: u32) -> u32 {
        self.beyond.get(edge as usize / 3).map_or(NONE, |all| all[edge as usize % 3])
    }

    fn link(&mut self, edge: u32, other: u32) {
        for (from, to) in [(edge, other), (other, edge)] {
            if let Some(all) = self.beyond.get_mut(from as usize / 3) {
                all[from as usize % 3] = to;
            }
        }
    }

    /// Sets a triangle, or adds one behind all others.
    fn set(&mut self, triangle: u32, corners: [u32; 3]) {
        match self.flat.triangles.get_mut(triangle as usize) {
            Some(old) => *old = corners,
            None => {
                self.flat.triangles.push(corners);
                self.beyond.push([NONE; 3]);
            }
        }
    }

    fn add(&mut self, place: [f64; 2], point: Point) -> u32 {
        self.flat.places.push(place);
        self.points.push(point);
        self.points.len() as u32 - 1
    }

    /// Twice the area of places.
    pub(super) fn area(&self, [a, b, c]: [u32; 3]) -> f64 {
        turn(self.place(a), self.place(b), self.place(c))
    }

    /// The way from a triangle to a place, over any edge that the place is beyond; in Delaunay triangulations it ends (O. Devillers and
    /// others 2002), in others after so many steps, with `None`.
    pub(super) fn walk(&self, mut triangle: u32, place: [f64; 2]) -> Option<End> {
        for _ in 0..STEPS {
            let is_beyond = |edge: &u32| {
                let [_, a, b] = self.around(*edge);
                turn(self.place(a), self.place(b), place) < 0.0
            };
            let Some(edge) = (3 * triangle..3 * triangle + 3).find(is_beyond) else { return Some(End::In(triangle)) };
            let other = self.beyond(edge);
            if other == NONE {
                return Some(End::At(edge));
            }
            triangle = other / 3;
        }
        None
    }

    /// Adds a place within a triangle, or on one of its edges if it is there, and flips edges around it; triangles that are new or changed
    /// are added to a list. Whether it was added: not on an edge of a ring.
    pub(super) fn insert(&mut self, triangle: u32, place: [f64; 2], point: Point, changed: &mut Vec<u32>) -> bool {
        let floor = LEAST * self.area(self.corners(triangle));
        let is_on = |edge: &u32| {
            let [_, a, b] = self.around(*edge);
            turn(self.place(a), self.place(b), place) <= floor
        };
        let outer = match (3 * triangle..3 * triangle + 3).find(is_on) {
            Some(edge) if self.beyond(edge) == NONE => return false,
            Some(edge) => self.split_edge(edge, place, point),
            None => self.split_triangle(triangle, place, point),
        };
        changed.extend(outer.iter().map(|edge| edge / 3));
        self.legalise(outer, changed);
        true
    }

    fn split_triangle(&mut self, triangle: u32, place: [f64; 2], point: Point) -> Vec<u32> {
        let [a, b, c] = self.corners(triangle);
        let [x, y, z] = [0, 1, 2].each(|corner| self.beyond(3 * triangle + corner));
        let p = self.add(place, point);
        let first = self.flat.triangles.len() as u32;
        let all = [triangle, first, first + 1];
        for (number, (corners, outer)) in all.into_iter().zip([([a, b, p], z), ([b, c, p], x), ([c, a, p], y)]) {
            self.set(number, corners);
            self.link_outer(3 * number + 2, outer);
        }
        for (one, next) in [(0, 1), (1, 2), (2, 0)] {
            self.link(3 * all[one], 3 * all[next] + 1);
        }
        all.map(|number| 3 * number + 2).to_vec()
    }

    fn split_edge(&mut self, edge: u32, place: [f64; 2], point: Point) -> Vec<u32> {
        let other = self.beyond(edge);
        let ([p, a, b], [q, ..]) = (self.around(edge), self.around(other));
        let (t, u) = (edge / 3, other / 3);
        let [bp, pa] = [next(edge), next(next(edge))].each(|edge| self.beyond(edge));
        let [aq, qb] = [next(other), next(next(other))].each(|edge| self.beyond(edge));
        let m = self.add(place, point);
        let first = self.flat.triangles.len() as u32;
        let (v, w) = (first, first + 1);
        for (number, corners) in [(t, [p, a, m]), (v, [p, m, b]), (u, [q, b, m]), (w, [q, m, a])] {
            self.set(number, corners);
        }
        for (one, two) in [(3 * t, 3 * w), (3 * t + 1, 3 * v + 2), (3 * v, 3 * u), (3 * u + 1, 3 * w + 2)] {
            self.link(one, two);
        }
        let outer = [(3 * t + 2, pa), (3 * v + 1, bp), (3 * u + 2, qb), (3 * w + 1, aq)];
        outer.into_iter().for_each(|(edge, beyond)| self.link_outer(edge, beyond));
        outer.each(|(edge, _)| edge).to_vec()
    }

    fn link_outer(&mut self, edge: u32, beyond: u32) {
        if beyond == NONE {
            if let Some(all) = self.beyond.get_mut(edge as usize / 3) {
                all[edge as usize % 3] = NONE;
            }
        } else {
            self.link(edge, beyond);
        }
    }

    /// Flips edges of a list, and edges around flipped ones, until none makes the sum of cotangents smaller.
    pub(super) fn legalise(&mut self, mut edges: Vec<u32>, changed: &mut Vec<u32>) {
        while let Some(edge) = edges.pop() {
            if self.is_to_flip(edge) {
                let [t, u] = self.flip(edge);
                changed.extend([t, u]);
                edges.extend([3 * t, 3 * t + 2, 3 * u, 3 * u + 2]);
            }
        }
    }

    /// Whether two triangles of an edge face by more than a right angle away from each other in space. O(triangles).
    pub(super) fn is_folded(&self) -> bool {
        (0..3 * self.flat.triangles.len() as u32).any(|edge| {
            let other = self.beyond(edge);
            edge < other && other != NONE && dot(self.normal(edge / 3), self.normal(other / 3)) < 0.0
        })
    }

    fn normal(&self, triangle: u32) -> Point {
        let [a, b, c] = self.corners(triangle).each(|corner| self.point(corner));
        cross(sub(b, a), sub(c, a))
    }

    /// Flips all edges that make the sum of cotangents smaller.
    pub(super) fn legalise_all(&mut self) {
        let all = (0..3 * self.flat.triangles.len() as u32).filter(|edge| *edge < self.beyond(*edge)).collect();
        self.legalise(all, &mut Vec::new());
    }

    fn is_to_flip(&self, edge: u32) -> bool {
        let other = self.beyond(edge);
        if other == NONE {
            return false;
        }
        let ([p, a, b], [q, ..]) = (self.around(edge), self.around(other));
        let pair = |triangles: [[u32; 3]; 2]| {
            let [(x, m), (y, n)] = triangles.each(|[a, b, c]| cotangents(self.point(a), self.point(b), self.point(c)));
            (x + y, dot(m, n))
        };
        let (before, side) = pair([[p, a, b], [q, b, a]]);
        let (after, new_side) = pair([[p, a, q], [q, b, p]]);
        // A quadrilateral that is folded already may stay so.
        if p == q || !(after < before * (1.0 - GAIN) && (new_side > 0.0 || side <= 0.0)) {
            return false;
        }
        let floor = LEAST * (self.area([p, a, b]) + self.area([q, b, a]));
        self.area([p, a, q]) > floor && self.area([q, b, p]) > floor
    }

    /// Flips an edge; both triangles, in which it is opposite to the corner 1.
    fn flip(&mut self, edge: u32) -> [u32; 2] {
        let other = self.beyond(edge);
        let ([p, a, b], [q, ..]) = (self.around(edge), self.around(other));
        let (t, u) = (edge / 3, other / 3);
        let [bp, pa] = [next(edge), next(next(edge))].each(|edge| self.beyond(edge));
        let [aq, qb] = [next(other), next(next(other))].each(|edge| self.beyond(edge));
        self.set(t, [p, a, q]);
        self.set(u, [q, b, p]);
        self.link(3 * t + 1, 3 * u + 1);
        for (edge, beyond) in [(3 * t, aq), (3 * t + 2, pa), (3 * u, bp), (3 * u + 2, qb)] {
            self.link_outer(edge, beyond);
        }
        [t, u]
    }
}

/// The next edge of the same triangle.
fn next(edge: u32) -> u32 {
    if edge % 3 == 2 { edge - 2 } else { edge + 1 }
}

/// The sum of the cotangents of a triangle's angles, but for a factor that all have; its normal.
fn cotangents(a: Point, b: Point, c: Point) -> (f64, Point) {
    let (u, v, w) = (sub(b, a), sub(c, a), sub(c, b));
    let normal = cross(u, v);
    ((dot(u, u) + dot(v, v) + dot(w, w)) / dot(normal, normal).sqrt(), normal)
}

/// Twice the area of places, positive if they are anticlockwise.
fn turn([a, b]: [f64; 2], [c, d]: [f64; 2], [e, f]: [f64; 2]) -> f64 {
    (c - a) * (f - b) - (d - b) * (e - a)
}
