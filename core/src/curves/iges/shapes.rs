//! Shapes of curves from the parameters of their entities.

use super::directory::Entry;
use super::parameters::Parameters;
use crate::curves::curve::{Arc, CurveError, Shape, Spline, conic};
use crate::curves::vector::{Point, distance, dot, norm, sub, unit};

/// Whether an entity is a curve on its own, not made of others.
pub(super) fn is_curve(entry: &Entry) -> bool {
    match entry.kind {
        100 | 104 | 112 | 126 => true,
        106 => matches!(entry.form, 1..=3 | 11 | 12 | 13 | 63),
        110 => entry.form == 0,
        _ => false,
    }
}

/// The shape of such an entity, before any matrix; and what is odd about it.
///
/// # Errors
/// Why it is none.
pub(super) fn shape(entry: &Entry, parameters: &Parameters) -> Result<(Shape, Option<String>), String> {
    let whole = |shape: Result<Shape, String>| shape.map(|shape| (shape, None));
    match entry.kind {
        100 => circle(parameters),
        104 => conic_arc(parameters),
        106 => copious(entry, parameters),
        110 => whole(line(parameters)),
        112 => parametric_spline(parameters),
        126 => whole(rational_spline(parameters)),
        kind => Err(format!("type {kind} is no curve")),
    }
}

fn said(error: CurveError) -> String {
    error.to_string()
}

/// 110: both ends.
fn line(parameters: &Parameters) -> Result<Shape, String> {
    Ok(Shape::Line([parameters.point(1)?, parameters.point(4)?]))
}

/// 100: height, centre, start and end, anticlockwise in the plane.
fn circle(parameters: &Parameters) -> Result<(Shape, Option<String>), String> {
    let values: [f64; 7] = parameters.reals(1, 7)?.try_into().map_err(|_| "parameters are missing")?;
    let [z, x, y, start_x, start_y, end_x, end_y] = values;
    let start = [start_x - x, start_y - y];
    let radius = start[0].hypot(start[1]);
    let angles = [start[1].atan2(start[0]), (end_y - y).atan2(end_x - x)];
    let axes = [[radius, 0.0, 0.0], [0.0, radius, 0.0]];
    let same = start_x == end_x && start_y == end_y;
    let angles = if same { [angles[0], angles[0]] } else { angles };
    let arc = Arc::new([x, y, z], axes, angles).map_err(said)?;
    let off = ((end_x - x).hypot(end_y - y) - radius).abs();
    let odd = (off > 1e-4 * radius).then(|| format!("its end is {off:.3e} off its circle"));
    Ok((Shape::Arc(arc), odd))
}

/// 104: six coefficients, height, start and end.
fn conic_arc(parameters: &Parameters) -> Result<(Shape, Option<String>), String> {
    let values: [f64; 11] = parameters.reals(1, 11)?.try_into().map_err(|_| "parameters are missing")?;
    let [a, b, c, d, e, f, z, start_x, start_y, end_x, end_y] = values;
    let ends = [[start_x, start_y], [end_x, end_y]];
    let shape = conic([a, b, c, d, e, f], z, ends).map_err(said)?;
    let told = [[start_x, start_y, z], [end_x, end_y, z]];
    let off = shape.ends().into_iter().zip(told).map(|(real, told)| distance(real, told)).fold(0.0, f64::max);
    let size = shape.bounds().into_iter().map(norm).fold(0.0, f64::max);
    let odd = (off > 1e-4 * size).then(|| format!("its ends are {off:.3e} off its equation"));
    Ok((shape, odd))
}

/// 106: how points are given, how many, at which height, and the points.
fn points(entry: &Entry, parameters: &Parameters) -> Result<Vec<Point>, String> {
    let (each, from) = match parameters.integer(1)? {
        1 => (2, 4),
        2 => (3, 3),
        3 => (6, 3),
        other => return Err(format!("points of the unknown kind {other}")),
    };
    let count = parameters.count(2, from, each)?;
    let z = if each == 2 { parameters.real(3)? } else { 0.0 };
    let mut points = Vec::with_capacity(count + 1);
    for number in 0..count {
        let at = from + each * number;
        let last = if each == 2 { z } else { parameters.real(at + 2)? };
        points.push([parameters.real(at)?, parameters.real(at + 1)?, last]);
    }
    if entry.form == 63 && points.first() != points.last() {
        points.extend(points.first().copied());
    }
    Ok(points)
}

/// 106 as a curve. Forms 1 to 3 do not say that points are joined; they are where they lie as those of a path do.
fn copious(entry: &Entry, parameters: &Parameters) -> Result<(Shape, Option<String>), String> {
    let points = points(entry, parameters)?;
    let is_told = entry.form > 10;
    let count = points.len();
    let odd =
        (!is_told).then(|| format!("{count} points, read as a polyline although the file does not say that they are joined"));
    Shape::polyline(points).map(|shape| (shape, odd)).map_err(said)
}

/// Whether an entity is points (106, forms 1 to 3) that are no path.
pub(super) fn is_cloud(entry: &Entry, parameters: &Parameters) -> bool {
    entry.kind == 106 && entry.form < 11 && points(entry, parameters).is_ok_and(|points| !is_path(&points))
}

/// Whether points lie as those of a path: on the way from each to the next, none turns by more than 120°.
fn is_path(points: &[Point]) -> bool {
    let steps: Vec<Point> =
        points.windows(2).filter_map(|pair| if let &[a, b] = pair { unit(sub(b, a)) } else { None }).collect();
    !steps.is_empty() && steps.windows(2).all(|pair| if let &[a, b] = pair { dot(a, b) > -0.5 } else { true })
}

/// 112: cubic polynomials between break points, as Bézier curves one behind the other.
fn parametric_spline(parameters: &Parameters) -> Result<(Shape, Option<String>), String> {
    let announced = parameters.count(4, 5, 13)?;
    if announced == 0 {
        return Err("a spline without segments".into());
    }
    let breaks = parameters.reals(5, announced + 1)?;
    let mut knots = vec![breaks.first().copied().unwrap_or_default(); 4];
    let mut points: Vec<Point> = Vec::with_capacity(3 * announced + 1);
    let mut gap = 0.0_f64;
    for (number, pair) in breaks.windows(2).enumerate() {
        let &[from, to] = pair else { continue };
        let step = to - from;
        let mut piece = [[0.0; 3]; 4];
        for axis in 0..3 {
            let values = parameters.reals(6 + announced + 12 * number + 4 * axis, 4)?;
            let [a, b, c, d] = values.try_into().map_err(|_| "coefficients are missing")?;
            let (b, c, d) = (b * step, c * step * step, d * step * step * step);
            let bezier = [a, a + b / 3.0, a + (2.0 * b + c) / 3.0, a + b + c + d];
            for (point, value) in piece.iter_mut().zip(bezier) {
                point.iter_mut().skip(axis).take(1).for_each(|to| *to = value);
            }
        }
        let [first, rest @ ..] = piece;
        if let Some(end) = points.last_mut() {
            gap = gap.max(distance(*end, first));
            *end = first;
        } else {
            points.push(first);
        }
        points.extend(rest);
        knots.extend([to; 3]);
    }
    knots.extend(breaks.last());
    let spline = Spline::new(3, knots, points, None, None).map_err(said)?;
    let shape = Shape::Spline(spline);
    let [low, high] = shape.bounds();
    let odd = (gap > 1e-6 * distance(low, high)).then(|| format!("its segments are {gap:.3e} apart; they are joined"));
    Ok((shape, odd))
}

/// 126: highest number of a point, degree, four properties, knots, weights, points, domain.
fn rational_spline(parameters: &Parameters) -> Result<Shape, String> {
    let count = parameters.count(1, 7, 5)? + 1;
    let degree = usize::try_from(parameters.integer(2)?).map_err(|_| "a degree below 0")?;
    let knot_count = count.checked_add(degree + 1).ok_or("a degree beyond all numbers")?;
    let weights_at = 7 + knot_count;
    let points_at = weights_at + count;
    let domain_at = points_at + 3 * count;
    let knots = parameters.reals(7, knot_count)?;
    let weights = parameters.reals(weights_at, count)?;
    let mut points = Vec::with_capacity(count);
    for number in 0..count {
        points.push(parameters.point(points_at + 3 * number)?);
    }
    let domain = [parameters.real(domain_at), parameters.real(domain_at + 1)];
    // Without a domain, or with one that is empty, all knots count.
    let domain = match domain {
        [Ok(low), Ok(high)] if low < high => Some([low, high]),
        _ => None,
    };
    let spline = Spline::new(degree, knots.clone(), points.clone(), Some(weights.clone()), domain);
    match spline {
        Err(CurveError::Domain) => Spline::new(degree, knots, points, Some(weights), None).map(Shape::Spline).map_err(said),
        other => other.map(Shape::Spline).map_err(said),
    }
}
