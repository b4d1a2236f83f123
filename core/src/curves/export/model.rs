//! The model that is written: surfaces, and the loops that trim them.

use std::borrow::Cow;

use crate::curves::Unit;
use crate::curves::curve::Spline;
use crate::curves::vector::{Point, distance};

/// A tensor product B-spline surface, rational or not; the first parameter is `u`.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// Degrees along `u` and `v`.
    pub degrees: [usize; 2],
    /// All knots along `u` and `v`, repeated ones as often as they count.
    pub knots: [Vec<f64>; 2],
    /// Control points: `points[i][j]` belongs to the `i`th knot along `u` and the `j`th along `v`.
    pub points: Vec<Vec<Point>>,
    /// Their weights in the same order; `None` if they are all 1.
    pub weights: Option<Vec<Vec<f64>>>,
}

/// A curve between two vertices.
#[derive(Clone, Debug, PartialEq)]
pub struct Edge {
    /// Its curve, all of it.
    pub curve: Spline,
    /// Vertices at its beginning and its end; the same one for a curve that is closed.
    pub ends: [usize; 2],
}

/// An edge in a loop.
#[derive(Clone, Debug, PartialEq)]
pub struct EdgeUse {
    /// Its number in [`Body::edges`].
    pub edge: usize,
    /// Whether the loop follows it from its end to its beginning.
    pub is_reversed: bool,
    /// The same curve in the space of parameters: `u` and `v` are `x` and `y`, and `z` is 0. It runs with the curve of the edge,
    /// whatever the direction of the loop; best is that both have the same parameter. A seam has one for each side.
    pub pcurve: Option<Spline>,
}

/// A surface and the loops that trim it.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// The surface that is trimmed.
    pub surface: Surface,
    /// Edges around it in their order, anticlockwise as seen from outside of the body; sides of the surface that shrink to a
    /// point have none. Empty of a face that is all of its surface.
    pub outer: Vec<EdgeUse>,
    /// Edges around each of its holes, clockwise.
    pub inner: Vec<Vec<EdgeUse>>,
    /// Whether the normal `∂S/∂u × ∂S/∂v` of the surface points out of the body.
    pub is_same_sense: bool,
}

/// Faces that may share edges.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Points where edges meet.
    pub vertices: Vec<Point>,
    /// Curves where faces meet.
    pub edges: Vec<Edge>,
    /// Trimmed surfaces.
    pub faces: Vec<Face>,
    /// Of all coordinates.
    pub unit: Unit,
    /// The distance up to which points count as the same, in the unit: how far curves may be off their surfaces and vertices.
    pub tolerance: f64,
}

/// Loops of a face, the outer one first, which is empty of a face that is all of its surface.
pub(super) type Rings<'a> = Vec<Cow<'a, [EdgeUse]>>;

/// Words of a file's header; nothing else than given is written, above all no time of day.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Header<'a> {
    /// The name of the part.
    pub name: &'a str,
    /// When it was made, as ISO 8601 has it: `2026-11-28T07:15:00`. Without one, the field is empty.
    pub time: Option<&'a str>,
    /// The program that made it, with its version.
    pub system: &'a str,
}

impl Surface {
    /// Lowest and highest parameters along `u` and `v`.
    #[must_use]
    pub fn domain(&self) -> [[f64; 2]; 2] {
        let [u, v] = [0, 1].map(|at: usize| {
            let knots = self.knots.get(at).map(Vec::as_slice).unwrap_or_default();
            let degree = self.degrees.get(at).copied().unwrap_or_default();
            let end = knots.len().saturating_sub(degree + 1);
            [degree, end].map(|number| knots.get(number).copied().unwrap_or_default())
        });
        [u, v]
    }

    /// The same surface with `u` and `v` exchanged, so its normal points to the other side; exact.
    #[must_use]
    pub fn transposed(&self) -> Self {
        let ([p, q], [u, v]) = (self.degrees, &self.knots);
        Self {
            degrees: [q, p],
            knots: [v.clone(), u.clone()],
            points: transposed(&self.points),
            weights: self.weights.as_ref().map(|weights| transposed(weights)),
        }
    }

    /// Whether both ends along `u`, and those along `v`, are the same curve up to a distance.
    pub(super) fn is_closed(&self, tolerance: f64) -> [bool; 2] {
        let near = |a: &Point, b: &Point| distance(*a, *b) <= tolerance;
        let rows = self.points.first().zip(self.points.last());
        let u = rows.is_some_and(|(first, last)| first.iter().zip(last).all(|(a, b)| near(a, b)));
        let v = self.points.iter().all(|row| row.first().zip(row.last()).is_some_and(|(a, b)| near(a, b)));
        [u, v]
    }

    /// Weights, if they are not all the same.
    pub(super) fn rational(&self) -> Option<&[Vec<f64>]> {
        let weights = self.weights.as_deref()?;
        let first = weights.first()?.first()?;
        (!weights.iter().flatten().all(|weight| weight == first)).then_some(weights)
    }
}

fn transposed<T: Copy>(rows: &[Vec<T>]) -> Vec<Vec<T>> {
    let width = rows.first().map_or(0, Vec::len);
    (0..width).map(|at| rows.iter().filter_map(|row| row.get(at).copied()).collect()).collect()
}
