//! Whether a body is one, before anything of it is written.

use super::error::BodyError;
use super::model::{Body, EdgeUse, Surface};
use crate::curves::curve::HIGHEST_DEGREE;
use crate::curves::vector::{distance, is_finite};

/// Checks that all numbers go together. O(control points).
pub(super) fn check(body: &Body) -> Result<(), BodyError> {
    let is_length = |length: f64| length > 0.0 && length.is_finite();
    if body.faces.is_empty() {
        return Err(BodyError::Empty);
    }
    if !is_length(body.unit.millimetres) || !is_length(body.tolerance) {
        return Err(BodyError::Measure);
    }
    if let Some(vertex) = body.vertices.iter().position(|vertex| !is_finite(*vertex)) {
        return Err(BodyError::Vertex(vertex));
    }
    for (number, edge) in body.edges.iter().enumerate() {
        let problem = |problem| BodyError::Edge { edge: number, problem };
        for (end, t) in edge.ends.into_iter().zip(edge.curve.domain()) {
            let vertex = body.vertices.get(end).ok_or(problem("its end is no vertex"))?;
            let (point, _) = edge.curve.point_and_derivative(t);
            // A curve of overflown numbers has no distance, either.
            let off = distance(point, *vertex);
            if off.is_nan() || off > body.tolerance {
                return Err(problem("its curve does not end at its vertex"));
            }
        }
    }
    for (number, face) in body.faces.iter().enumerate() {
        surface(&face.surface).map_err(|problem| BodyError::Surface { face: number, problem })?;
        for (ring, uses) in std::iter::once(&face.outer).chain(&face.inner).enumerate() {
            let is_missing = ring > 0 && uses.is_empty();
            let found = if is_missing { Err("a hole without edges") } else { closed(body, uses) };
            found.map_err(|problem| BodyError::Loop { face: number, ring, problem })?;
        }
    }
    Ok(())
}

/// Whether each edge of a loop ends where the next one begins.
fn closed(body: &Body, uses: &[EdgeUse]) -> Result<(), &'static str> {
    let ends = |one: &EdgeUse| {
        let [start, end] = body.edges.get(one.edge)?.ends;
        Some(if one.is_reversed { [end, start] } else { [start, end] })
    };
    for (one, next) in uses.iter().zip(uses.iter().cycle().skip(1)) {
        let [[_, end], [start, _]] = [ends(one), ends(next)].map(|ends| ends.unwrap_or([usize::MAX; 2]));
        if end == usize::MAX || start == usize::MAX {
            return Err("an edge is not there");
        }
        if end != start {
            return Err("an edge does not begin where the one before it ends");
        }
        if one.pcurve.as_ref().is_some_and(|pcurve| pcurve.points().iter().any(|[.., z]| *z != 0.0)) {
            return Err("a curve of parameters leaves their plane");
        }
    }
    Ok(())
}

fn surface(surface: &Surface) -> Result<(), &'static str> {
    let rows = surface.points.len();
    let columns = surface.points.first().map_or(0, Vec::len);
    if surface.points.iter().any(|row| row.len() != columns) {
        return Err("rows of control points differ in length");
    }
    for ((degree, knots), count) in surface.degrees.into_iter().zip(&surface.knots).zip([rows, columns]) {
        direction(degree, knots, count)?;
    }
    if !surface.points.iter().flatten().copied().all(is_finite) {
        return Err("a control point is not finite");
    }
    if let Some(weights) = &surface.weights {
        let is_same_shape = weights.len() == rows && weights.iter().all(|row| row.len() == columns);
        if !is_same_shape || !weights.iter().flatten().all(|weight| *weight > 0.0 && weight.is_finite()) {
            return Err("weights are not one above 0 for each control point");
        }
    }
    Ok(())
}

fn direction(degree: usize, knots: &[f64], count: usize) -> Result<(), &'static str> {
    if degree == 0 || degree > HIGHEST_DEGREE {
        return Err("a degree is 0 or above 63");
    }
    if count <= degree || knots.len() != count + degree + 1 {
        return Err("knots are not as many as points, the degree and one");
    }
    if !knots.iter().all(|knot| knot.is_finite()) || !knots.is_sorted() {
        return Err("knots are not finite or decrease");
    }
    let end = |at: usize| knots.get(at).copied().unwrap_or_default();
    let (low, high) = (end(degree), end(count));
    if low >= high {
        return Err("the domain is empty");
    }
    // A knot repeated more often tears the surface.
    let is_torn = knots.windows(degree + 1).any(|run| {
        let (first, last) = (run.first().copied().unwrap_or(low), run.last().copied().unwrap_or(high));
        first == last && first > low && last < high
    });
    if is_torn { Err("an inner knot is repeated more often than the degree") } else { Ok(()) }
}
