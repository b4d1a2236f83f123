//! The nearest point of a curve.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::shape::Shape;
use super::spline::{Spline, Weighted};
use crate::curves::vector::{Point, add, distance, dot, norm, scale, sub};

/// Halvings of pieces of a curve, at most.
const MOST: usize = 4096;
/// A point that is nearer by less than this share of the distance is not looked for.
const CLOSE: f64 = 1e-9;
/// Halvings of the interval around the best sample.
const STEPS: u32 = 60;

impl Shape {
    /// The parameter of the point that is nearest to a point: of two that are about as near, either.
    #[must_use]
    pub fn nearest(&self, point: Point) -> f64 {
        nearest(self, point)
    }
}

/// The parameter of the nearest point.
fn nearest(shape: &Shape, point: Point) -> f64 {
    match shape {
        &Shape::Line([a, b]) => on_line(a, b, point),
        Shape::Arc(arc) => {
            let [from, to] = arc.angles;
            let angle = arc.angle(point);
            let ends = [from, to].map(|end| distance(arc.point(end), point));
            if angle <= to && distance(arc.point(angle), point) <= ends[0].min(ends[1]) {
                angle
            } else if ends[0] <= ends[1] {
                from
            } else {
                to
            }
        }
        Shape::Conic(spline) | Shape::Spline(spline) => on_spline(spline, point),
        Shape::Polyline(points) => {
            let mut best = (f64::INFINITY, 0.0);
            for (number, pair) in points.windows(2).enumerate() {
                let &[a, b] = pair else { continue };
                let t = number as f64 + on_line(a, b, point);
                let near = distance(shape.point(t), point);
                best = if near < best.0 { (near, t) } else { best };
            }
            best.1
        }
        Shape::Composite(parts) => {
            let mut best = (f64::INFINITY, 0.0);
            for (number, part) in parts.iter().enumerate() {
                let [low, high] = part.domain();
                let t = nearest(part, point);
                let near = distance(part.point(t), point);
                best = if near < best.0 { (near, number as f64 + (t - low) / (high - low)) } else { best };
            }
            best.1
        }
    }
}

fn on_line(a: Point, b: Point, point: Point) -> f64 {
    let along = sub(b, a);
    let share = dot(sub(point, a), along) / dot(along, along);
    if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 }
}

/// A piece of a curve that may have the nearest point; the one with the smallest bound is the greatest.
struct Piece {
    /// No point of it is nearer.
    bound: f64,
    domain: [f64; 2],
    /// Its Bézier points.
    points: Vec<Weighted>,
}

impl Ord for Piece {
    fn cmp(&self, other: &Self) -> Ordering {
        other.bound.total_cmp(&self.bound).then_with(|| other.domain[0].total_cmp(&self.domain[0]))
    }
}

impl PartialOrd for Piece {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Piece {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Piece {}

/// The search for the nearest point of a curve: the piece that may have it is halved, until none may have a nearer one than is known. A curve lies in the
/// convex hull of its Bézier points (TNB, property P4.3), so their distances along any direction bound its own.
struct Search<'s> {
    spline: &'s Spline,
    point: Point,
    /// The least distance so far, the parameter there, and how long the piece was in which it was found.
    best: (f64, f64, f64),
    pieces: BinaryHeap<Piece>,
}

impl Search<'_> {
    fn near(&self, t: f64) -> f64 {
        distance(self.spline.point_and_derivative(t).0, self.point)
    }

    fn look(&mut self, domain: [f64; 2], points: Vec<Weighted>) {
        let [low, high] = domain;
        for t in [low, 0.5 * (low + high), high] {
            let here = self.near(t);
            if here < self.best.0 {
                self.best = (here, t, high - low);
            }
        }
        let bound = bound(&points, self.point);
        if self.may_be_nearer(bound) {
            self.pieces.push(Piece { bound, domain, points });
        }
    }

    fn may_be_nearer(&self, bound: f64) -> bool {
        bound < self.best.0 * (1.0 - CLOSE)
    }

    /// Halves pieces, a bounded number of them.
    fn run(&mut self) {
        for _ in 0..MOST {
            let Some(Piece { bound, domain: [low, high], points }) = self.pieces.pop() else { return };
            let middle = 0.5 * (low + high);
            if !self.may_be_nearer(bound) {
                return;
            }
            if middle > low && middle < high {
                let [first, second] = halves(points);
                self.look([low, middle], first);
                self.look([middle, high], second);
            }
        }
    }

    /// The parameter of the nearest point, refined by the sign of the derivative of the distance, which halves the interval down to rounding.
    fn refined(&self) -> f64 {
        let (_, t, around) = self.best;
        let [first, last] = self.spline.domain();
        let (mut low, mut high) = ((t - around).max(first), (t + around).min(last));
        for _ in 0..STEPS {
            let middle = 0.5 * (low + high);
            let (place, derivative) = self.spline.point_and_derivative(middle);
            if dot(sub(place, self.point), derivative) > 0.0 { high = middle } else { low = middle }
        }
        if self.near(low) < self.near(t) { low } else { t }
    }
}

fn on_spline(spline: &Spline, point: Point) -> f64 {
    let mut search = Search { spline, point, best: (f64::INFINITY, spline.domain()[0], 0.0), pieces: BinaryHeap::new() };
    spline.beziers().into_iter().for_each(|(domain, points)| search.look(domain, points));
    search.run();
    search.refined()
}

/// No point in the convex hull of these is nearer.
fn bound(points: &[Weighted], from: Point) -> f64 {
    let places = || points.iter().map(|&[x, y, z, weight]| sub([x / weight, y / weight, z / weight], from));
    let count = points.len().max(1) as f64;
    let middle = places().fold([0.0; 3], |sum, place| add(sum, scale(place, 1.0 / count)));
    let length = norm(middle);
    if length == 0.0 {
        return 0.0;
    }
    places().map(|place| dot(place, middle) / length).fold(f64::INFINITY, f64::min).max(0.0)
}

/// Both halves of a curve by its Bézier points (TNB A5.8 at the middle; de Casteljau).
fn halves(mut points: Vec<Weighted>) -> [Vec<Weighted>; 2] {
    let (mut first, mut second) = (Vec::with_capacity(points.len()), Vec::with_capacity(points.len()));
    while let (Some(one), Some(other)) = (points.first(), points.last()) {
        first.push(*one);
        second.push(*other);
        let pairs = points.windows(2);
        points = pairs
            .filter_map(|pair| <&[Weighted; 2]>::try_from(pair).ok())
            .map(|[a, b]| [0, 1, 2, 3].map(|k| 0.5 * (a[k] + b[k])))
            .collect();
    }
    second.reverse();
    [first, second]
}
