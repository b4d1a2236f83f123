//! A curve as the surfaces beside it need it: its shape recognised, and its points for the mesh, the same for both.

use std::sync::OnceLock;

use super::fit::{self, FitError};
use super::pieces::Pieces;
use super::space;
use crate::curves::curve::{Shape, Spline};
use crate::curves::elementary::Frame;
use crate::curves::vector::{Point, cross, distance, dot, norm, sub, unit};
use crate::util::each::Each;

/// What a curve is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    /// With its direction.
    Straight(Point),
    /// Of a circle.
    Round {
        centre: Point,
        axis: Point,
        radius: f64,
    },
    Other,
}

/// Larger tolerances that are tried where a curve cannot be fitted as well as asked for, at most.
const RETRIES: u32 = 6;
/// Points that tell what a curve is.
const PROBES: u32 = 16;

#[derive(Debug)]
pub(super) struct Strand<'a> {
    pub(super) shape: &'a Shape,
    pub(super) kind: Kind,
    pub(super) length: f64,
    /// Points at even parameters from its beginning to its end; three of a straight curve.
    pub(super) probes: Vec<Point>,
    pieces: Pieces,
    fitted: OnceLock<Result<(Spline, f64), FitError>>,
}

impl<'a> Strand<'a> {
    pub(super) fn new(shape: &'a Shape) -> Self {
        let pieces = Pieces::new(shape);
        let length = pieces.length();
        let count = PROBES * u32::try_from(pieces.0.len()).unwrap_or(u32::MAX).clamp(1, 64);
        let all: Vec<Point> =
            (0..=count).map(|at| shape.point(pieces.parameter(shape, f64::from(at) / f64::from(count)))).collect();
        let kind = kind(shape, &all, 1e-6 * length);
        let ends = |all: &[Point]| [all.first(), all.get(all.len() / 3), all.last()].into_iter().flatten().copied().collect();
        let probes = if matches!(kind, Kind::Straight(_)) { ends(&all) } else { all };
        Self { shape, kind, length, probes, pieces, fitted: OnceLock::new() }
    }

    /// The cubic B-spline, fitted when it is first asked for; its distance exceeds the tolerance where the curve does not allow
    /// that.
    pub(super) fn fitted(&self, tolerance: Option<f64>) -> &Result<(Spline, f64), FitError> {
        self.fitted.get_or_init(|| {
            let mut wanted = tolerance.unwrap_or(5e-7 * self.length);
            let mut fitted = fit::fitted(self.shape, &self.pieces, wanted);
            for _ in 0..RETRIES {
                match fitted {
                    // The best that there is, with what it reaches; the next piece may be worse.
                    Err(FitError::Tolerance { reached, .. }) if reached <= 1e-3 * self.length => wanted = reached.max(wanted),
                    _ => break,
                }
                fitted = fit::fitted(self.shape, &self.pieces, wanted);
            }
            fitted
        })
    }

    /// The B-spline, if it was asked for.
    pub(super) fn into_fitted(self) -> Option<Spline> {
        self.fitted.into_inner()?.ok().map(|(spline, _)| spline)
    }

    pub(super) fn point(&self, t: f64) -> Point {
        self.shape.point(self.pieces.parameter(self.shape, t))
    }

    /// Directions at the beginning and at the end: of the derivative, or where there is none, to a point nearby.
    pub(super) fn tangents(&self) -> [Point; 2] {
        let [low, high] = self.shape.domain();
        let near = [(0.0, 1e-4), (1.0 - 1e-4, 1.0)];
        let mut tangents = [low, high].each(|t| unit(self.shape.derivative(t)));
        for (tangent, (from, to)) in tangents.iter_mut().zip(near) {
            *tangent = tangent.or_else(|| unit(sub(self.point(to), self.point(from))));
        }
        tangents.map(Option::unwrap_or_default)
    }

    /// Parameters of the points of the mesh, 0 and 1 among them: corners, and between them points so near that neither the
    /// distance of an edge to the curve nor the turn along it is more than allowed, at densities that change as the curvature
    /// does.
    pub(super) fn samples(&self, limits: &Limits) -> Vec<f64> {
        let mut samples = Vec::new();
        let corners = self.pieces.corners();
        for pair in corners.windows(2) {
            if let &[a, b] = pair {
                samples.extend(self.between([a, b], limits));
            }
        }
        samples.push(1.0);
        let least = if matches!(self.kind, Kind::Straight(_)) { limits.least.min(2) } else { limits.least };
        if samples.len() > least {
            return samples;
        }
        (0..=least).map(|number| number as f64 / least as f64).collect()
    }

    fn between(&self, [a, b]: [f64; 2], limits: &Limits) -> Vec<f64> {
        let is_straight = matches!(self.kind, Kind::Straight(_)) || matches!(self.shape, Shape::Polyline(_));
        let count = if is_straight { 1 } else { STEPS * self.spans([a, b]) };
        let at = |number: usize| a + (b - a) * number as f64 / count as f64;
        let points: Vec<Point> = (0..=count).map(|number| self.point(at(number))).collect();
        let turn = |number: usize| match points.get(number.wrapping_sub(1)..number + 2) {
            Some(&[p, q, r]) => norm(cross(sub(q, p), sub(r, q))).atan2(dot(sub(q, p), sub(r, q))) / (0.5 * distance(p, r)),
            _ => 0.0,
        };
        let mut sums = vec![0.0];
        for number in 0..count {
            let step = points.get(number..number + 2).map_or(0.0, |pair| distance(pair[0], pair[1]));
            let [before, after] = [number, number + 1].each(|number| turn(number.clamp(1, count.max(2) - 1)));
            let bend = before.max(after);
            let sag = if bend > 0.0 { (8.0 * limits.chord / bend).sqrt() } else { f64::INFINITY };
            let longest = limits.size.min(sag).min(limits.angle / bend);
            let dense = if longest > 0.0 { step / longest } else { 0.0 };
            sums.push(sums.last().copied().unwrap_or(0.0) + dense.min(MOST));
        }
        let whole = sums.last().copied().unwrap_or(0.0);
        let edges = (whole - 1e-9).ceil().clamp(1.0, MOST) as usize;
        let place = |edge: usize| {
            let target = whole * edge as f64 / edges as f64;
            let place = sums.partition_point(|sum| *sum <= target).clamp(1, count) - 1;
            let [low, high] = [place, place + 1].each(|number| sums.get(number).copied().unwrap_or(whole));
            let rest = if high > low { (target - low) / (high - low) } else { 0.0 };
            a + (b - a) * (place as f64 + rest) / count as f64
        };
        std::iter::once(a).chain((1..edges).map(place)).collect()
    }

    /// Spans of a B-spline within a part of it, by its share of them.
    fn spans(&self, [a, b]: [f64; 2]) -> usize {
        let all = match self.shape {
            Shape::Spline(spline) | Shape::Conic(spline) => spline.points().len().saturating_sub(spline.degree()),
            _ => 1,
        };
        ((all as f64 * (b - a)).ceil() as usize).clamp(1, 512)
    }
}

/// Steps of a span by which its curvature is measured.
const STEPS: usize = 16;
/// Edges of a smooth piece of a curve, at most.
const MOST: f64 = 65_536.0;

/// How finely a curve is divided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Limits {
    pub(super) chord: f64,
    pub(super) angle: f64,
    pub(super) size: f64,
    /// Edges at least, of straight curves no more than two.
    pub(super) least: usize,
}

fn kind(shape: &Shape, probes: &[Point], tolerance: f64) -> Kind {
    let ends = shape.ends();
    if let Shape::Arc(arc) = shape
        && arc.is_circular()
        && let Some(axis) = unit(cross(arc.axes[0], arc.axes[1]))
    {
        return Kind::Round { centre: arc.centre, axis, radius: arc.radii()[0] };
    }
    if let Some(along) = unit(sub(ends[1], ends[0]))
        && probes.iter().all(|point| norm(cross(sub(*point, ends[0]), along)) <= tolerance)
    {
        return Kind::Straight(along);
    }
    round(probes, tolerance).unwrap_or(Kind::Other)
}

fn round(probes: &[Point], tolerance: f64) -> Option<Kind> {
    let (middle, axis) = space::plane(probes)?;
    let frame = Frame::around(middle, axis);
    let inside: Vec<Point> = probes.iter().map(|point| frame.inside(*point)).collect();
    if inside.iter().any(|[.., z]| z.abs() > tolerance) {
        return None;
    }
    let flat: Vec<[f64; 2]> = inside.iter().map(|[x, y, _]| [*x, *y]).collect();
    let (centre, radius) = space::circle(&flat)?;
    let is_near = flat.iter().all(|[x, y]| ((x - centre[0]).hypot(y - centre[1]) - radius).abs() <= tolerance);
    is_near.then(|| Kind::Round { centre: frame.outside([centre[0], centre[1], 0.0]), axis, radius })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curves::curve::Arc;

    #[test]
    fn a_circle_written_as_a_spline_is_known_and_divided_evenly() {
        let arc = Shape::Arc(Arc::new([1.0, 2.0, 3.0], [[0.0, 2.0, 0.0], [0.0, 0.0, 2.0]], [0.0, 1.0]).unwrap());
        let shape = Shape::Spline(arc.to_spline().unwrap());
        let strand = Strand::new(&shape);
        let Kind::Round { centre, radius, .. } = strand.kind else { panic!("{:?}", strand.kind) };
        assert!(distance(centre, [1.0, 2.0, 3.0]) < 1e-7 && (radius - 2.0).abs() < 1e-7);
        let samples = strand.samples(&Limits { chord: 1.0, angle: 0.1, size: 9.0, least: 1 });
        assert!((11..=12).contains(&samples.len()));
        let steps: Vec<f64> = samples.windows(2).map(|pair| distance(strand.point(pair[0]), strand.point(pair[1]))).collect();
        assert!(steps.iter().all(|step| (step - steps[0]).abs() < 1e-3 && *step <= 0.2), "{steps:?}");
    }
}
