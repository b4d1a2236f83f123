//! Parameters of each type of entity.

use std::borrow::Cow;
use std::io;

use super::plan::Item;
use super::record::Record;
use crate::curves::curve::Spline;
use crate::curves::export::canonical::{canonical, reversed};
use crate::curves::export::model::{Body, Surface};
use crate::curves::vector::{Affine, Point, cross, distance, dot, norm, sub, unit};

/// Gives the parameters of an entity to a record.
pub(super) fn parameters<F>(body: &Body, item: &Item<'_>, record: &mut Record<F>) -> io::Result<()>
where
    F: FnMut(&str) -> io::Result<()>,
{
    let number = |place: usize| 2 * place + 1;
    match item {
        Item::Surface(face) => match body.faces.get(*face) {
            // The normal points out of the body, as IGES has no flag that would turn it.
            Some(face) if face.is_same_sense => surface(&face.surface, body.tolerance, record),
            Some(face) => surface(&face.surface.transposed(), body.tolerance, record),
            None => Ok(()),
        },
        Item::Curve { edge, is_reversed } => match body.edges.get(*edge) {
            Some(edge) => curve(&directed(&edge.curve, *is_reversed), record),
            None => Ok(()),
        },
        Item::Parametric { curve: parametric, is_reversed, is_exchanged } => {
            let parametric = directed(parametric, *is_reversed);
            if *is_exchanged { curve(&exchanged(&parametric), record) } else { curve(&parametric, record) }
        }
        Item::Bridge([[a, b], [c, d]]) => {
            [126, 1, 1, 1, 0, 1, 0].into_iter().try_for_each(|value| record.integer(value))?;
            record.reals([0.0, 0.0, 1.0, 1.0, 1.0, 1.0, *a, *b, 0.0, *c, *d, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0])
        }
        Item::Composite { parts, .. } => {
            record.integer(102)?;
            record.integer(parts.len())?;
            parts.iter().try_for_each(|part| record.integer(number(*part)))
        }
        Item::OnSurface { surface, parametric, curve } => {
            // How it was made is not told; the curve in space is preferred.
            let values = [142, 0, number(*surface), parametric.map_or(0, number), number(*curve), 2];
            values.into_iter().try_for_each(|value| record.integer(value))
        }
        Item::Trimmed { surface, outer, inner } => {
            let values = [144, number(*surface), usize::from(outer.is_some()), inner.len(), outer.map_or(0, number)];
            values.into_iter().try_for_each(|value| record.integer(value))?;
            inner.iter().try_for_each(|ring| record.integer(number(*ring)))
        }
    }
}

fn directed(curve: &Spline, is_reversed: bool) -> Cow<'_, Spline> {
    let curve = canonical(curve);
    if is_reversed { Cow::Owned(reversed(&curve).into_owned()) } else { curve }
}

fn exchanged(curve: &Spline) -> Spline {
    let [x, y, z] = [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
    curve.clone().transformed(&Affine { rows: [x, y, z], shift: [0.0; 3] })
}

/// 126: highest number of a point, degree, four properties, knots, weights, points, domain, normal of its plane.
fn curve<F: FnMut(&str) -> io::Result<()>>(curve: &Spline, record: &mut Record<F>) -> io::Result<()> {
    let points = curve.points();
    let is_closed = points.first() == points.last();
    let normal = plane(points);
    let properties = [normal.is_some(), is_closed, curve.weights().is_none(), false].map(usize::from);
    [126, points.len().saturating_sub(1), curve.degree()].into_iter().try_for_each(|value| record.integer(value))?;
    properties.into_iter().try_for_each(|value| record.integer(value))?;
    record.reals(curve.knots().iter().copied())?;
    match curve.weights() {
        Some(weights) => record.reals(weights.iter().copied())?,
        None => record.reals(points.iter().map(|_| 1.0))?,
    }
    record.reals(points.iter().flatten().copied())?;
    record.reals(curve.domain())?;
    record.reals(normal.unwrap_or_default())
}

/// The normal of the plane of some points, up to rounding; any that is fit of points on a line.
fn plane(points: &[Point]) -> Option<Point> {
    let origin = *points.first()?;
    let offsets = || points.iter().map(|point| sub(*point, origin));
    let longest = |best: Point, next: Point| if norm(next) > norm(best) { next } else { best };
    let along = offsets().fold([0.0; 3], longest);
    let size = norm(along);
    let across = offsets().map(|offset| cross(along, offset)).fold([0.0; 3], longest);
    let is_line = norm(across) <= 1e-12 * size * size;
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let across = if is_line { axes.map(|axis| cross(along, axis)).into_iter().fold([0.0; 3], longest) } else { across };
    let normal = unit(across)?;
    // A normal that is an axis, to the last bit, is told as that.
    let normal = axes.into_iter().find(|axis| distance(*axis, normal.map(f64::abs)) < 1e-15).unwrap_or(normal);
    offsets().all(|offset| dot(offset, normal).abs() <= 1e-12 * size).then_some(normal)
}

/// 128: highest numbers of points, degrees, five properties, knots, weights, points, domain; the first parameter runs fastest.
fn surface<F: FnMut(&str) -> io::Result<()>>(surface: &Surface, tolerance: f64, record: &mut Record<F>) -> io::Result<()> {
    let columns = surface.points.first().map_or(0, Vec::len);
    let [p, q] = surface.degrees;
    let counts = [surface.points.len(), columns].map(|count| count.saturating_sub(1));
    let [u, v] = surface.is_closed(tolerance);
    let weights = surface.rational();
    [128, counts[0], counts[1], p, q].into_iter().try_for_each(|value| record.integer(value))?;
    let properties = [u, v, weights.is_none(), false, false].map(usize::from);
    properties.into_iter().try_for_each(|value| record.integer(value))?;
    record.reals(surface.knots.iter().flatten().copied())?;
    for column in 0..columns {
        match weights {
            Some(weights) => record.reals(weights.iter().filter_map(|row| row.get(column).copied()))?,
            None => record.reals(surface.points.iter().map(|_| 1.0))?,
        }
    }
    for column in 0..columns {
        record.reals(surface.points.iter().filter_map(|row| row.get(column)).flatten().copied())?;
    }
    record.reals(surface.domain().into_iter().flatten())
}
