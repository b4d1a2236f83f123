//! Outlines on surfaces that are blended from their curves.

use std::f64::consts::TAU;

use super::chart::{Chart, Form};
use super::coons::Coons;
use super::fit::FitError;
use super::layout::{Corner, Layout, Rim, oriented};
use super::plate::Plate;
use super::revolved;
use super::sides::{self, Side};
use super::space;
use crate::curves::curve::{CurveError, Spline};
use crate::curves::elementary::Frame;
use crate::curves::vector::{Point, add, distance, scale, unit};
use crate::util::each::Each;

/// Cubic curves of a loop in its direction, with their lengths, and the cosines between tangents where each begins.
#[derive(Clone, Debug)]
pub(super) struct Curves {
    pub(super) parts: Vec<(Spline, f64)>,
    pub(super) cosines: Vec<f64>,
}

/// How far sides of a surface of revolution may be from those wanted, in parts of the distance of corners.
const ALIKE: f64 = 0.1;
/// Parameters each way at which a surface is looked at for folds: even cells at least, and values at most.
const LEAST: u32 = 8;
const MOST: usize = 64;

/// A Coons surface of two, three or four corners, and the lengths of its sides.
pub(super) fn coons(curves: &Curves, corners: &[usize]) -> Result<(Coons, Vec<f64>), FitError> {
    let sides = sides::sides(corners, &curves.cosines);
    let count = curves.parts.len();
    let mut joined = Vec::with_capacity(sides.len());
    let mut spans = vec![(0, 0.0, 0.0); count];
    let mut lengths = Vec::with_capacity(sides.len());
    for (number, Side { first, count: long }) in sides.iter().copied().enumerate() {
        let parts: Vec<(Spline, f64)> = (first..first + long).filter_map(|at| curves.parts.get(at % count)).cloned().collect();
        let (spline, ends) = sides::join(&parts)?;
        for (at, pair) in ends.windows(2).enumerate() {
            spans.iter_mut().skip((first + at) % count).take(1).for_each(|span| *span = (number, pair[0], pair[1]));
        }
        lengths.push(parts.iter().map(|(_, length)| length).sum::<f64>());
        joined.push(spline);
    }
    Ok((Coons::new(&met(joined)?, spans)?, lengths))
}

/// The same sides upon a surface of revolution, if there is one that nearly has them.
pub(super) fn based(coons: &Coons) -> Option<Coons> {
    let [a, b, c, d] = coons.corners;
    let size = distance(a, d).max(distance(b, c)).max(distance(a, b));
    coons.clone().on(revolved::revolved(coons, ALIKE * size)?).ok()
}

/// The outline on the chart of a Coons surface.
pub(super) fn laid(coons: Coons, lengths: &[f64], ring: &[Rim]) -> Layout {
    let form = form(lengths, &coons);
    let place = |rim: &Rim| {
        let (side, low, high) = coons.spans.get(rim.part as usize).copied().unwrap_or_default();
        (Corner::Rim(rim.vertex), form.flat(coons.parameters(side, low + (high - low) * rim.share)))
    };
    let rings = vec![ring.iter().map(place).collect()];
    oriented(Chart::Coons(Box::new(coons), form), rings, Vec::new())
}

/// Whether a Coons surface folds, on a grid between the points of its outline, so that what its curves do is not missed: 8 to 64
/// parameters each way.
pub(super) fn is_coons_folded(coons: &Coons, ring: &[Rim]) -> bool {
    let mut cuts = [0, 1].each(|_| (0..=LEAST).map(|at| f64::from(at) / f64::from(LEAST)).collect::<Vec<f64>>());
    for rim in ring {
        let (side, low, high) = coons.spans.get(rim.part as usize).copied().unwrap_or_default();
        let [u, v] = coons.parameters(side, low + (high - low) * rim.share);
        let (axis, t) = if v == 0.0 || v == 1.0 { (0, u) } else { (1, v) };
        cuts.iter_mut().skip(axis).take(1).for_each(|cuts| cuts.push(t));
    }
    let [us, vs] = cuts.map(|mut cuts| {
        cuts.sort_by(f64::total_cmp);
        cuts.dedup();
        let middles: Vec<f64> = cuts.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
        middles.iter().step_by(middles.len().div_ceil(MOST)).copied().collect::<Vec<f64>>()
    });
    coons.is_folded_on(&us, &vs)
}

/// Sides whose ends meet exactly: each corner is where the earlier side ends.
fn met(sides: Vec<Spline>) -> Result<Vec<Spline>, CurveError> {
    let ends: Vec<Point> = sides.iter().filter_map(|side| side.points().last().copied()).collect();
    let before = ends.iter().cycle().skip(ends.len().saturating_sub(1));
    let moved = sides.iter().zip(before).map(|(side, start)| {
        let mut points = side.points().to_vec();
        points.iter_mut().take(1).for_each(|first| *first = *start);
        Spline::new(side.degree(), side.knots().to_vec(), points, None, None)
    });
    moved.collect()
}

/// How parameters lie in the plane, by the lengths of sides: as a trapezoid whose parallel sides are those that differ more.
fn form(lengths: &[f64], coons: &Coons) -> Form {
    match *lengths {
        [a, b, c, d] => {
            let ratio = |x: f64, y: f64| x.max(y) / x.min(y).max(1e-12 * x.max(y));
            if ratio(a, c) >= ratio(b, d) {
                Form::Trapezoid { widths: [a, c], height: 0.5 * (b + d), shear: 0.0, is_turned: false }
            } else {
                // Seen from u = 1, which is the near end then.
                Form::Trapezoid { widths: [b, d], height: 0.5 * (a + c), shear: 0.0, is_turned: true }
            }
        }
        [a, b, c] => {
            // The triangle with these sides; flatter ones are raised.
            let x = 0.5 * (a * a + c * c - b * b) / a;
            let height = (c * c - x * x).max(0.04 * c * c).sqrt();
            Form::Trapezoid { widths: [a, 0.0], height, shear: x - 0.5 * a, is_turned: false }
        }
        _ => {
            let [low, high] = [0.0, 1.0].each(|v| coons.point_and_derivatives([0.5, v]).0);
            let length = 0.5 * lengths.iter().sum::<f64>();
            Form::Lens([length, distance(low, high).max(0.01 * length)])
        }
    }
}

/// Heights over the plane in which the outline has its largest area.
pub(super) fn heights(rings: &[Vec<Rim>]) -> Option<(Layout, Frame)> {
    let points: Vec<Point> = rings.first()?.iter().map(|rim| rim.point).collect();
    let frame = Frame::around(space::mean(&points), unit(space::area(&points))?);
    let chart = Chart::Heights(frame, None);
    let flat = |rim: &Rim| (Corner::Rim(rim.vertex), chart.flat(rim.point));
    let mut layout = oriented(chart.clone(), rings.iter().map(|ring| ring.iter().map(flat).collect()).collect(), Vec::new());
    let height = |rim: &Rim| (chart.flat(rim.point), frame.inside(rim.point)[2]);
    let mut all: Vec<Vec<([f64; 2], f64)>> = rings.iter().map(|ring| ring.iter().map(height).collect()).collect();
    for (ring, laid) in all.iter_mut().zip(&layout.rings) {
        // Holes may have been reversed.
        if ring.first().map(|(at, _)| *at) != laid.first().map(|(_, at)| *at) {
            ring.reverse();
        }
    }
    layout.chart = Chart::Heights(frame, Some(Box::new(Plate::new(all))));
    Some((layout, frame))
}

/// A closed curve, where each curve of the outline begins on it (and the last one ends), and the point that all is straight to.
pub(super) struct Cone {
    pub(super) layout: Layout,
    pub(super) curve: Spline,
    pub(super) ends: Vec<f64>,
    pub(super) centre: Point,
}

/// A surface straight from the outline to a point: the mean of 64 points of one curve, of ends and middles of several.
pub(super) fn centre(curves: &Curves, ring: &[Rim]) -> Result<Cone, FitError> {
    let (curve, ends) = sides::join(&curves.parts)?;
    let samples: Vec<Point> = match curves.parts.as_slice() {
        [(one, _)] => (0..64).map(|at| one.point_and_derivative(f64::from(at) / 64.0).0).collect(),
        parts => parts.iter().flat_map(|(part, _)| [0.0, 0.5].each(|t| part.point_and_derivative(t).0)).collect(),
    };
    let centre = space::mean(&samples);
    let far = samples.iter().map(|point| distance(*point, centre)).sum::<f64>() / samples.len().max(1) as f64;
    let place = |rim: &Rim| {
        let (low, high) = (ends.get(rim.part as usize), ends.get(rim.part as usize + 1));
        let (low, high) = (low.copied().unwrap_or(0.0), high.copied().unwrap_or(1.0));
        let (sin, cos) = ((low + (high - low) * rim.share) * TAU).sin_cos();
        (Corner::Rim(rim.vertex), [far * cos, far * sin])
    };
    let rings = vec![ring.iter().map(place).collect()];
    Ok(Cone { layout: oriented(Chart::Disc(Box::new(curve.clone()), centre, far), rings, Vec::new()), curve, ends, centre })
}

/// Whether a cone over a closed curve folds: where the area of its sectors turns away from their mean.
pub(super) fn is_folded(curve: &Spline, centre: Point) -> bool {
    let count = 8 * curve.points().len().min(512);
    let normal = |at: usize| {
        let (point, derivative) = curve.point_and_derivative((at as f64 + 0.5) / count as f64);
        crate::curves::vector::cross(add(point, scale(centre, -1.0)), derivative)
    };
    space::turns_away(&(0..count).map(normal).collect::<Vec<_>>())
}
