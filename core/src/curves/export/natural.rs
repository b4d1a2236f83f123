//! The boundary that a surface has by itself, for faces that nothing trims.

use std::borrow::Cow;

use super::error::BodyError;
use super::model::{Body, Edge, EdgeUse, Face, Rings, Surface};
use crate::curves::curve::{CurveError, Spline};
use crate::curves::vector::{Point, distance};

/// A body in which each face has an outer loop.
pub(super) struct Whole<'a> {
    pub(super) vertices: Vec<Point>,
    pub(super) edges: Vec<Cow<'a, Edge>>,
    /// Faces with their loops, the outer one first.
    pub(super) faces: Vec<(&'a Face, Vec<Cow<'a, [EdgeUse]>>)>,
}

impl<'a> Whole<'a> {
    /// Adds the boundaries of surfaces to faces without an outer loop. O(edges + control points of these surfaces).
    pub(super) fn of(body: &'a Body, rings: Vec<Rings<'a>>) -> Result<Self, BodyError> {
        let edges = body.edges.iter().map(Cow::Borrowed).collect();
        let mut whole = Self { vertices: body.vertices.clone(), edges, faces: Vec::with_capacity(body.faces.len()) };
        for (number, (face, mut loops)) in body.faces.iter().zip(rings).enumerate() {
            if let (Some(outer), true) = (loops.first_mut(), face.outer.is_empty()) {
                let added = whole.boundary(face, body.tolerance);
                let added = added.map_err(|_| BodyError::Surface { face: number, problem: "its boundary overflows" })?;
                if added.is_empty() {
                    return Err(BodyError::Surface { face: number, problem: "all of its sides shrink to points" });
                }
                *outer = Cow::Owned(added);
            }
            whole.faces.push((face, loops));
        }
        Ok(whole)
    }

    /// Edges around a surface: sides that shrink to a point have none, and two that are the same curve are a seam.
    fn boundary(&mut self, face: &Face, tolerance: f64) -> Result<Vec<EdgeUse>, CurveError> {
        let surface = &face.surface;
        let lines = side_ends(surface);
        let curves = sides(surface)?;
        let mut corners: Vec<usize> = Vec::new();
        let mut numbers: Vec<Option<usize>> = Vec::with_capacity(4);
        for (at, curve) in curves.iter().enumerate() {
            let twin = at.checked_sub(2).and_then(|twin| Some((curves.get(twin)?, *numbers.get(twin)?)));
            let number = match twin {
                _ if is_point(curve, tolerance) => None,
                Some((twin, Some(number))) if is_same(curve, twin, tolerance) => Some(number),
                _ => Some(self.add(curve, &mut corners, tolerance)),
            };
            numbers.push(number);
        }
        let mut uses = Vec::with_capacity(4);
        for (at, (number, [from, to])) in numbers.into_iter().zip(lines).enumerate() {
            let (Some(edge), Some(curve)) = (number, curves.get(at)) else { continue };
            let [low, high] = curve.domain();
            let ends = [from, to].map(|[u, v]| [u, v, 0.0]);
            let pcurve = Spline::new(1, vec![low, low, high, high], ends.to_vec(), None, None)?;
            uses.push(EdgeUse { edge, is_reversed: at >= 2, pcurve: Some(pcurve) });
        }
        if !face.is_same_sense {
            uses.reverse();
            uses.iter_mut().for_each(|one| one.is_reversed = !one.is_reversed);
        }
        Ok(uses)
    }

    /// Adds an edge; its ends are vertices among the corners of the same surface, new ones where there are none.
    fn add(&mut self, curve: &Spline, corners: &mut Vec<usize>, tolerance: f64) -> usize {
        let ends = curve.domain().map(|t| {
            let (point, _) = curve.point_and_derivative(t);
            let is_there =
                |corner: &usize| self.vertices.get(*corner).is_some_and(|vertex| distance(*vertex, point) <= tolerance);
            let known = corners.iter().copied().find(is_there);
            known.unwrap_or_else(|| {
                self.vertices.push(point);
                corners.push(self.vertices.len() - 1);
                self.vertices.len() - 1
            })
        });
        self.edges.push(Cow::Owned(Edge { curve: curve.clone(), ends }));
        self.edges.len() - 1
    }
}

fn is_point(curve: &Spline, tolerance: f64) -> bool {
    let first = curve.points().first().copied().unwrap_or_default();
    curve.points().iter().all(|point| distance(*point, first) <= tolerance)
}

fn is_same(a: &Spline, b: &Spline, tolerance: f64) -> bool {
    let is_near = a.points().iter().zip(b.points()).all(|(a, b)| distance(*a, *b) <= tolerance);
    let [v, w] = [a, b].map(|curve| curve.weights().unwrap_or_default());
    is_near && v.len() == w.len() && v.iter().zip(w).all(|(v, w)| (v - w).abs() <= 1e-9 * w)
}

/// Curves of the sides: south, east, north and west. A loop follows the last two against their curves.
pub(super) fn sides(surface: &Surface) -> Result<[Spline; 4], CurveError> {
    Ok([side(surface, 1, false)?, side(surface, 0, true)?, side(surface, 1, true)?, side(surface, 0, false)?])
}

/// Parameters of both ends of each side, in the same order.
pub(super) fn side_ends(surface: &Surface) -> [[[f64; 2]; 2]; 4] {
    let [[u0, u1], [v0, v1]] = surface.domain();
    [[[u0, v0], [u1, v0]], [[u1, v0], [u1, v1]], [[u0, v1], [u1, v1]], [[u0, v0], [u0, v1]]]
}

/// The curve along one side: at the beginning or the end of the parameter across it (0 for `u`, 1 for `v`). Exact where knots are
/// clamped.
fn side(surface: &Surface, across: usize, is_end: bool) -> Result<Spline, CurveError> {
    let turned;
    let surface = if across == 0 {
        surface
    } else {
        turned = surface.transposed();
        &turned
    };
    let ([p, q], [u, v]) = (surface.degrees, &surface.knots);
    let row = if is_end { surface.points.len().saturating_sub(1) } else { 0 };
    let ends = if is_end { u.get(u.len().saturating_sub(p + 1)..) } else { u.get(..=p) };
    let is_clamped = ends.is_some_and(|ends| ends.first() == ends.last());
    if is_clamped {
        let points = surface.points.get(row).cloned().unwrap_or_default();
        let weights = surface.weights.as_ref().and_then(|weights| weights.get(row).cloned());
        return Spline::new(q, v.clone(), points, weights, None);
    }
    let (mut points, mut weights) = (Vec::new(), Vec::new());
    for column in 0..surface.points.first().map_or(0, Vec::len) {
        let along = surface.points.iter().filter_map(|row| row.get(column).copied()).collect();
        let weight = surface.weights.as_ref();
        let own: Option<Vec<f64>> = weight.map(|rows| rows.iter().filter_map(|row| row.get(column).copied()).collect());
        // Weights that are all the same are dropped by a curve, but count beside those of other columns.
        let same = own.as_ref().and_then(|own| own.first().copied()).unwrap_or(1.0);
        let clamped = Spline::new(p, u.clone(), along, own, None)?.clamped()?;
        let at = if is_end { clamped.points().len().saturating_sub(1) } else { 0 };
        points.extend(clamped.points().get(at));
        weights.push(clamped.weights().map_or(same, |weights| weights.get(at).copied().unwrap_or(same)));
    }
    Spline::new(q, v.clone(), points, Some(weights), None)
}
