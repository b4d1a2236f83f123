//! All outlines of a network of curves: the faces that its file says, or the loops that its curves form.

use std::collections::BTreeMap;

use super::entry::{FillError, Filled, fill};
use super::nest;
use super::options::{Options, Outline};
use super::sense;
use crate::curves::curve::{Shape, widen};
use crate::curves::loops::{self, Loops};
use crate::curves::vector::{Point, distance, dot};
use crate::curves::{Network, Use};

/// Points at which two curves are compared, but one, and how far they may be apart there, in lengths.
const SAMPLES: u32 = 8;
const NEAR: f64 = 1e-5;

/// The outlines of a network, filled.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct FilledNetwork {
    /// The loops of its curves; of faces that the file says, none are looked for.
    pub loops: Option<Loops>,
    /// What was filled; numbers of curves are those of the network, and go on with those that close gaps.
    pub outlines: Vec<Outline>,
    /// What came of each.
    pub filled: Filled,
}

impl FilledNetwork {
    /// The shapes of all curves by their numbers.
    #[must_use]
    pub fn shapes<'n>(&'n self, network: &'n Network) -> Vec<&'n Shape> {
        let added = self.loops.iter().flat_map(|loops| &loops.added);
        network.curves.iter().chain(added).map(|curve| &curve.shape).collect()
    }
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
        for one in std::iter::once(&mut outline.outer).chain(&mut outline.inner).flatten() {
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

/// Fills the faces that a file says, where it says any and `from_faces` asks for them; else the closed loops of its curves, of which those within others of
/// their plane bound holes. As [`fill`].
///
/// # Errors
/// As [`fill`].
pub fn fill_network(
    network: &Network,
    (from_faces, how): (bool, &loops::Options),
    options: &Options,
) -> Result<FilledNetwork, FillError> {
    options.with_threads(|| all(network, (from_faces, how), options))
}

/// As [`fill_network`], with the threads that there are.
fn all(network: &Network, (from_faces, how): (bool, &loops::Options), options: &Options) -> Result<FilledNetwork, FillError> {
    let faces: Vec<Outline> = network.faces.iter().filter(|face| !face.outer.is_empty()).map(Outline::from).collect();
    if from_faces && !faces.is_empty() {
        let shapes: Vec<&Shape> = network.curves.iter().map(|curve| &curve.shape).collect();
        let mut faces = with_outer_loops_first(&shapes, faces);
        for uses in faces.iter_mut().flat_map(|face| std::iter::once(&mut face.outer).chain(&mut face.inner)) {
            sense::turn(&shapes, uses, NEAR);
        }
        let outlines = with_shared_curves(&shapes, faces, &loops::find(network, how).doubles);
        let filled = fill(&shapes, &outlines, options)?;
        return Ok(FilledNetwork { loops: None, outlines, filled });
    }
    let found = loops::find(network, how);
    let shapes: Vec<&Shape> = network.curves.iter().chain(&found.added).map(|curve| &curve.shape).collect();
    let uses: Vec<_> = found.loops.iter().map(|own| own.uses.clone()).collect();
    let outlines = nest::outlines(&shapes, &uses);
    let filled = fill(&shapes, &outlines, options)?;
    drop(shapes);
    Ok(FilledNetwork { loops: Some(found), outlines, filled })
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
