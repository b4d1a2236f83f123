//! Outlines of the faces that a file says.

use std::collections::BTreeMap;

use super::options::Outline;
use super::sense;
use crate::curves::curve::{Arc, Shape, widen};
use crate::curves::elementary::{Elementary, Frame, Told};
use crate::curves::loops;
use crate::curves::vector::{Point, distance, dot};
use crate::curves::{Network, Use};

/// Points at which two curves are compared, but one, and how far they may be apart there, in lengths.
const SAMPLES: u32 = 8;
const NEAR: f64 = 1e-5;

/// The face of an outline, and its file's words of it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Origin {
    /// Its face.
    pub(super) face: usize,
    pub(super) told: Option<Told>,
    /// Whether it bounds a void.
    pub(super) is_void: bool,
}

/// The faces of a file, to be filled.
#[derive(Clone, Debug, Default)]
pub(super) struct Faces {
    pub(super) outlines: Vec<Outline>,
    /// Of each outline.
    pub(super) origins: Vec<Origin>,
    /// Curves behind those of the network.
    pub(super) added: Vec<Shape>,
    /// Faces that no curve bounds, and that are no whole sphere or torus.
    pub(super) bare: Vec<usize>,
}

/// The outlines of the faces of a network, with one curve for those that run along each other. O(uses · log uses).
pub(super) fn outlines(network: &Network, how: &loops::Options, is_told: bool) -> Faces {
    let shapes: Vec<&Shape> = network.curves.iter().map(|curve| &curve.shape).collect();
    let mut all = Faces::default();
    for (number, face) in network.faces.iter().enumerate() {
        let told = face.told.filter(|_| is_told);
        let origin = Origin { face: number, told, is_void: face.is_void };
        let is_bounded = |uses: &[Use]| !uses.is_empty() && !is_seam(uses);
        if is_bounded(&face.outer)
            || (face.inner.is_empty() && !face.outer.is_empty() && told.is_none_or(|told| !told.is_closed()))
        {
            all.push(Outline::from(face), origin);
            continue;
        }
        // All that bounds it are holes: around a sphere or a torus, any of them may come first.
        let mut rings = face.inner.iter().filter(|uses| is_bounded(uses)).cloned();
        match (told, rings.next()) {
            // A cone ends in its apex, and a disc may be told as a hole.
            (_, Some(outer)) => all.push(Outline { outer, inner: rings.collect() }, origin),
            (Some(told), None) if told.is_closed() => all.whole(told, origin, network.curves.len()),
            _ => all.bare.push(number),
        }
    }
    all.outlines = with_outer_loops_first(&shapes, std::mem::take(&mut all.outlines));
    let given = network.curves.len();
    for uses in all.outlines.iter_mut().flat_map(Outline::rings_mut) {
        if uses.iter().all(|one| one.curve < given) {
            sense::turn(&shapes, uses, NEAR);
        }
    }
    all.outlines = with_shared_curves(&shapes, std::mem::take(&mut all.outlines), &loops::find(network, how).doubles);
    all
}

impl Faces {
    fn push(&mut self, outline: Outline, origin: Origin) {
        self.outlines.push(outline);
        self.origins.push(origin);
    }

    /// A whole sphere as two halves with a circle between them, a whole torus as two halves with two; `given` is the number of the network's curves.
    fn whole(&mut self, told: Told, origin: Origin, given: usize) {
        let left = Origin { told: Some(Told { is_left: Some(true), ..told }), ..origin };
        let first = given + self.added.len();
        let use_of = |curve: usize, is_reversed: bool| vec![Use { curve, is_reversed }];
        match told.surface {
            Elementary::Sphere { frame, radius } => {
                self.added.extend(circle(&frame, [0.0; 3], [[radius, 0.0, 0.0], [0.0, radius, 0.0]]));
                for is_reversed in [false, true] {
                    self.push(Outline { outer: use_of(first, is_reversed), inner: Vec::new() }, left);
                }
            }
            Elementary::Torus { frame, major, minor } => {
                for sign in [1.0, -1.0] {
                    let (middle, across) = ([sign * major, 0.0, 0.0], [sign * minor, 0.0, 0.0]);
                    self.added.extend(circle(&frame, middle, [across, [0.0, 0.0, minor]]));
                }
                for (one, other) in [(first, first + 1), (first + 1, first)] {
                    self.push(Outline { outer: use_of(one, true), inner: vec![use_of(other, false)] }, left);
                }
            }
            Elementary::Plane(_) | Elementary::Cylinder { .. } | Elementary::Cone { .. } => {}
        }
    }
}

/// A circle by its centre and half axes in a frame.
fn circle(frame: &Frame, centre: Point, axes: [Point; 2]) -> Option<Shape> {
    let vector = |[a, b, c]: Point| {
        let [x, y, z] = frame.axes;
        [0, 1, 2].map(|at| a * x[at] + b * y[at] + c * z[at])
    };
    Arc::new(frame.outside(centre), axes.map(vector), [0.0, 0.0]).map(Shape::Arc).ok()
}

/// Whether each curve of a loop is passed in both directions: the seams of a whole surface.
fn is_seam(uses: &[Use]) -> bool {
    let mut sums: BTreeMap<usize, i32> = BTreeMap::new();
    for one in uses {
        *sums.entry(one.curve).or_default() += if one.is_reversed { -1 } else { 1 };
    }
    sums.values().all(|sum| *sum == 0)
}

/// The outlines with one curve for those that run along each other: faces that are trimmed one by one each have their own, and meet along them.
fn with_shared_curves(shapes: &[&Shape], mut outlines: Vec<Outline>, doubles: &[(usize, usize)]) -> Vec<Outline> {
    let stands: BTreeMap<usize, (usize, bool)> = doubles
        .iter()
        .filter_map(|(own, other)| {
            let (a, b) = (*shapes.get(*own)?, *shapes.get(*other)?);
            are_one(a, b).then(|| (*own, (*other, run_against(a, b))))
        })
        .collect();
    for outline in &mut outlines {
        for one in outline.rings_mut().flatten() {
            if let Some((other, is_against)) = stands.get(&one.curve) {
                *one = Use { curve: *other, is_reversed: one.is_reversed != *is_against };
            }
        }
    }
    outlines
}

/// The outlines, each with the loop around all others as its outer one: faces of files call another one so, or do not say which it is. A box around an outer
/// loop in a plane holds the boxes around its holes; where no box holds that of the loop that is called outer, nothing changes.
fn with_outer_loops_first(shapes: &[&Shape], mut outlines: Vec<Outline>) -> Vec<Outline> {
    for outline in outlines.iter_mut().filter(|outline| !outline.inner.is_empty()) {
        let outer = bounds(shapes, &outline.outer);
        let boxes = outline.inner.iter().map(|inner| bounds(shapes, inner)).enumerate();
        let around =
            boxes.filter(|(_, inner)| holds(*inner, outer)).max_by(|(_, a), (_, b)| diagonal(*a).total_cmp(&diagonal(*b)));
        if let Some(inner) = around.and_then(|(number, _)| outline.inner.get_mut(number)) {
            std::mem::swap(&mut outline.outer, inner);
        }
    }
    outlines
}

/// Corners of a box around points of curves.
fn bounds(shapes: &[&Shape], uses: &[Use]) -> [Point; 2] {
    let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for shape in uses.iter().filter_map(|one| shapes.get(one.curve)) {
        let [low, high] = shape.domain();
        let steps = if let Shape::Polyline(points) = shape { points.len() as u32 } else { 8 * SAMPLES };
        (0..=steps).for_each(|k| widen(&mut bounds, shape.point(low + (high - low) * f64::from(k) / f64::from(steps))));
    }
    bounds
}

/// Whether a box is around another one, and clearly larger.
fn holds(outer: [Point; 2], inner: [Point; 2]) -> bool {
    let room = NEAR * diagonal(outer);
    (0..3).all(|axis| outer[0][axis] <= inner[0][axis] + room && outer[1][axis] >= inner[1][axis] - room)
        && diagonal(outer) > diagonal(inner) + room
}

fn diagonal([low, high]: [Point; 2]) -> f64 {
    distance(low, high)
}

/// Whether a curve may stand for another that it runs along: no point of it that is looked at is farther than the surfaces are held to their curves.
fn are_one(a: &Shape, b: &Shape) -> bool {
    let [low, high] = a.domain();
    let points: Vec<Point> = (0..=SAMPLES).map(|k| a.point(low + (high - low) * f64::from(k) / f64::from(SAMPLES))).collect();
    let room = NEAR * points.iter().zip(points.iter().skip(1)).map(|(p, q)| distance(*p, *q)).sum::<f64>();
    points.into_iter().all(|point| distance(point, b.point(b.nearest(point))) <= room)
}

/// Of two curves that run along each other, whether they do so in different directions: told in the middle of the first.
fn run_against(a: &Shape, b: &Shape) -> bool {
    let [low, high] = a.domain();
    let middle = low + 0.5 * (high - low);
    dot(a.derivative(middle), b.derivative(b.nearest(a.point(middle)))) < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(half: f64, first: usize) -> (Vec<Shape>, Vec<Use>) {
        let corners = [[-half, -half], [half, -half], [half, half], [-half, half]].map(|[x, y]| [x, y, 1.0]);
        let lines = (0..4).map(|k| Shape::Line([corners[k], corners[(k + 1) % 4]])).collect();
        (lines, (first..first + 4).map(|curve| Use { curve, is_reversed: false }).collect())
    }

    /// A square within a square, and a file that calls the inner one the outer loop.
    #[test]
    fn the_loop_around_the_others_is_the_outer_one() {
        let ((inner, hole), (outer, around)) = (ring(1.0, 0), ring(2.0, 4));
        let shapes: Vec<&Shape> = inner.iter().chain(&outer).collect();
        let right = Outline { outer: around.clone(), inner: vec![hole.clone()] };
        let swapped = Outline { outer: hole, inner: vec![around] };
        assert_eq!(with_outer_loops_first(&shapes, vec![swapped, right.clone()]), [right.clone(), right]);
    }
}
