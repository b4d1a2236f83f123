//! Where surfaces meet: points and curves.

use super::super::surface::Surface;
use super::super::vector::{Point, add, between, distance, dot};
use crate::util::linear::solve;

/// Steps to a common point.
const STEPS: usize = 30;
/// Halvings of a curve.
const DEPTH: usize = 7;

/// The point common to surfaces nearest to `start`: Newton's steps of least length (the normal matrix damped by 10⁻⁹, so that
/// surfaces may touch). `None` where they leave more than `tolerance`, or the way is longer than `reach`.
pub(super) fn point(surfaces: &[Surface], start: Point, tolerance: f64, reach: f64) -> Option<Point> {
    let mut at = start;
    for _ in 0..STEPS {
        let (mut matrix, mut right) = ([[0.0; 3]; 3], [0.0; 3]);
        for surface in surfaces {
            let (gradient, value) = (surface.gradient(at), surface.distance(at));
            for i in 0..3 {
                (0..3).for_each(|j| matrix[i][j] += gradient[i] * gradient[j]);
                right[i] -= gradient[i] * value;
            }
        }
        (0..3).for_each(|k| matrix[k][k] += 1e-9);
        let step = solve(matrix, right)?;
        at = add(at, step);
        if dot(step, step) <= (1e-3 * tolerance).powi(2) || distance(at, start) > 4.0 * reach {
            break;
        }
    }
    let error = surfaces.iter().fold(0.0_f64, |most, surface| most.max(surface.distance(at).abs()));
    (error <= tolerance && distance(at, start) <= reach && at.iter().all(|x| x.is_finite())).then_some(at)
}

/// Points between `a` and `b` on the curve in which two surfaces meet, so dense that chords stay within `chord` of it, 127 at
/// most; none where the straight line lies on both within `tolerance`. `None` where they do not meet along the way.
pub(super) fn curve(surfaces: [&Surface; 2], a: Point, b: Point, tolerance: f64, chord: f64) -> Option<Vec<Point>> {
    let mut found = Vec::new();
    halve(surfaces.map(|s| *s), a, b, [tolerance, chord], DEPTH, &mut found)?;
    Some(found)
}

fn halve(surfaces: [Surface; 2], a: Point, b: Point, limits: [f64; 2], depth: usize, found: &mut Vec<Point>) -> Option<()> {
    if surfaces.iter().all(Surface::is_plane) || depth == 0 {
        return Some(());
    }
    let [tolerance, chord] = limits;
    let middle = between(a, b, 0.5);
    let on = point(&surfaces, middle, tolerance, distance(a, b).max(tolerance))?;
    if distance(on, middle) <= chord.max(tolerance) {
        return Some(());
    }
    halve(surfaces, a, on, limits, depth - 1, found)?;
    found.push(on);
    halve(surfaces, on, b, limits, depth - 1, found)
}

/// A point with coordinates that an f32 holds.
pub(super) fn rounded(point: Point) -> Point {
    point.map(|x| f64::from(x as f32))
}
