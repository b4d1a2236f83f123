//! Surfaces that CAD works with, recognised by outlines alone.
//!
//! Axes are those of the outline's circles, or the directions of its straight lines; with an axis, a surface of revolution is a
//! curve of distances and heights, on which all points of the outline have to be.

use super::space;
use super::strand::Kind;
use crate::curves::elementary::{Elementary, Frame, round};
use crate::curves::vector::{Point, cross, distance, norm, sub, unit};

/// Axes that are looked at, at most.
const AXES: usize = 12;
/// Points, about, by which a surface is refused before it is fitted to all of them.
const FEW: usize = 1024;

/// The plane of an outline, if all its points are on it.
pub(super) fn plane(probes: &[Point], tolerance: f64) -> Option<Elementary> {
    let (middle, normal) = space::plane(probes)?;
    let carrier = Elementary::Plane(Frame::around(middle, normal));
    probes.iter().all(|point| carrier.distance(*point) <= tolerance).then_some(carrier)
}

/// Surfaces that all points of an outline are on, in the order of preference: cylinder, cone, sphere, torus. O(points · axes).
pub(super) fn recognise(kinds: &[Kind], probes: &[Point], tolerance: f64) -> Vec<Elementary> {
    let axes = axes(kinds, probes, tolerance);
    let few: Vec<Point> = probes.iter().step_by(probes.len().div_ceil(FEW).max(1)).copied().collect();
    // A surface within the tolerance of `n` points has a sum of squared distances of no more than n · tolerance², and the one of least
    // squares has no larger one; so no point is farther from that than tolerance · √n. Spheres and tori are fitted by the algebraic
    // distance, of which this is true but for terms of the second order.
    let most = tolerance * (few.len() as f64).sqrt();
    let fitted = |fit: &dyn Fn(&[Point]) -> Option<Elementary>| -> Option<Elementary> {
        let rough = fit(&few)?;
        (few.len() == probes.len())
            .then_some(rough)
            .or_else(|| few.iter().all(|point| rough.distance(*point) <= most).then(|| fit(probes))?)
    };
    let mut found: Vec<Elementary> = Vec::new();
    found.extend(axes.iter().filter_map(|axis| fitted(&|points| cylinder(axis, points))));
    found.extend(parallel(kinds, probes, tolerance));
    found.extend(axes.iter().filter_map(|axis| fitted(&|points| cone(axis, points))));
    found.extend(fitted(&sphere));
    found.extend(axes.iter().filter_map(|axis| fitted(&|points| torus(axis, points))));
    found.retain(|carrier| probes.iter().all(|point| carrier.distance(*point) <= tolerance));
    found
}

/// How far other curves of an outline may be from a surface that its circles and straight lines fix, in sizes: CAD programs write curves in
/// which surfaces meet as splines that are near them, to some 10⁻⁴.
pub(super) const NEAR: f64 = 2e-4;

/// Surfaces that circles and straight lines of an outline fix, and to which its other curves are near, the nearest first. `exact` are
/// points of the first, `kinds` are theirs, and `probes` are points of all curves. O(points · axes).
pub(super) fn implied(kinds: &[Kind], exact: &[Point], probes: &[Point], tolerance: f64) -> Vec<Elementary> {
    let size = space::size(probes);
    // Circles in one plane fix nothing.
    if exact.len() == probes.len() || space::size(exact) < 0.1 * size || plane(exact, 0.01 * size).is_some() {
        return Vec::new();
    }
    let near = recognise(kinds, exact, tolerance).into_iter().map(|carrier| (farthest(&carrier, probes), carrier));
    let mut near: Vec<(f64, Elementary)> = near.filter(|(far, _)| *far <= NEAR * size).collect();
    near.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    near.into_iter().map(|(_, carrier)| carrier).collect()
}

/// The largest distance of points.
pub(super) fn farthest(carrier: &Elementary, probes: &[Point]) -> f64 {
    probes.iter().fold(0.0_f64, |most, point| most.max(carrier.distance(*point)))
}

/// Axes of circles, each once, in the order of the curves.
fn axes(kinds: &[Kind], probes: &[Point], tolerance: f64) -> Vec<Frame> {
    let mut axes: Vec<Frame> = Vec::new();
    let size = probes.first().map_or(0.0, |first| probes.iter().fold(0.0_f64, |most, point| most.max(distance(*first, *point))));
    for kind in kinds {
        let Kind::Round { centre, axis, radius } = *kind else { continue };
        // A circle so large for its outline has no axis to speak of.
        if radius > 1e4 * size {
            continue;
        }
        let same = axes.iter().any(|frame| {
            let [.., z] = frame.axes;
            norm(cross(z, axis)) * size <= 10.0 * tolerance && norm(cross(sub(centre, frame.origin), z)) <= 10.0 * tolerance
        });
        if !same && axes.len() < AXES {
            axes.push(Frame::around(centre, axis));
        }
    }
    axes
}

fn cylinder(axis: &Frame, probes: &[Point]) -> Option<Elementary> {
    let sum: f64 = probes.iter().map(|point| round(axis, *point)[0]).sum();
    let radius = sum / probes.len().max(1) as f64;
    (radius > 0.0).then_some(Elementary::Cylinder { frame: *axis, radius })
}

/// A cylinder along straight lines.
fn parallel(kinds: &[Kind], probes: &[Point], tolerance: f64) -> Option<Elementary> {
    let mut lines = kinds.iter().filter_map(|kind| if let Kind::Straight(along) = kind { Some(*along) } else { None });
    let along = lines.next()?;
    let second = lines.next()?;
    if norm(cross(along, second)) > 1e-4 {
        return None;
    }
    let frame = Frame::around(space::mean(probes), along);
    let flat: Vec<[f64; 2]> = probes.iter().map(|point| frame.inside(*point)).map(|[x, y, _]| [x, y]).collect();
    let (centre, radius) = space::circle(&flat)?;
    let size = flat.iter().fold(0.0_f64, |most, [x, y]| most.max(x.hypot(*y)));
    // Of a flatter arc, the radius would be a guess.
    let is_bent = size * size > 40.0 * tolerance * radius;
    let origin = frame.outside([centre[0], centre[1], 0.0]);
    is_bent.then_some(Elementary::Cylinder { frame: Frame { origin, ..frame }, radius })
}

/// The line of least squares through distances and heights, by its angle.
fn cone(axis: &Frame, probes: &[Point]) -> Option<Elementary> {
    let flat: Vec<[f64; 2]> = probes.iter().map(|point| round(axis, *point)).collect();
    let count = flat.len().max(1) as f64;
    let [a, b] = flat.iter().fold([0.0; 2], |[a, b], [x, y]| [a + x / count, b + y / count]);
    let mut sums = [0.0; 3];
    for [x, y] in flat.iter().map(|[x, y]| [x - a, y - b]) {
        sums.iter_mut().zip([x * x, x * y, y * y]).for_each(|(sum, x)| *sum += x);
    }
    let (sin, cos) = (0.5 * (2.0 * sums[1]).atan2(sums[0] - sums[2])).sin_cos();
    let slope = cos / sin;
    if !slope.is_finite() || slope.abs() < 1e-6 || slope.abs() > 1e6 {
        return None;
    }
    let apex = axis.outside([0.0, 0.0, b - a / slope]);
    Some(Elementary::cone(apex, axis, slope))
}

fn sphere(probes: &[Point]) -> Option<Elementary> {
    let (centre, radius) = space::sphere(probes)?;
    let towards = unit(sub(space::mean(probes), centre))?;
    Some(Elementary::Sphere { frame: Frame::around(centre, towards), radius })
}

fn torus(axis: &Frame, probes: &[Point]) -> Option<Elementary> {
    let flat: Vec<[f64; 2]> = probes.iter().map(|point| round(axis, *point)).collect();
    let ([major, height], minor) = space::circle(&flat)?;
    let origin = axis.outside([0.0, 0.0, height]);
    // Tubes that reach the axis are apples and lemons, which outlines do not tell apart.
    (major > minor).then_some(Elementary::Torus { frame: Frame { origin, ..*axis }, major, minor })
}
