//! Surfaces fitted to vertices: Gauss–Newton steps from a start.

use super::super::surface::Surface;
use super::super::vector::Point;
use crate::util::linear::solve;

/// Points that a fit looks at, taken evenly from those there are.
const MOST_POINTS: usize = 200;
/// Steps of a fit.
const STEPS: usize = 8;

/// Largest distance of points from a surface.
pub(crate) fn worst(surface: &Surface, points: &[Point]) -> f64 {
    points.iter().fold(0.0, |most, point| most.max(surface.distance(*point).abs()))
}

/// Root mean square distance of points from a surface.
pub(crate) fn rms(surface: &Surface, points: &[Point]) -> f64 {
    let sum: f64 = points.iter().map(|point| surface.distance(*point).powi(2)).sum();
    (sum / points.len().max(1) as f64).sqrt()
}

/// The surface of least squares of distances near `start`: Gauss–Newton with central differences, the normal matrix damped a
/// little because an arc of a few degrees hardly fixes a radius. Returns the start where no step makes it better.
pub(crate) fn refine(start: Surface, points: &[Point], size: f64) -> Surface {
    let stride = points.len().div_ceil(MOST_POINTS).max(1);
    let points: Vec<Point> = points.iter().step_by(stride).copied().collect();
    let (mut best, mut error) = (start, rms(&start, &points));
    let h = 1e-5;
    for _ in 0..STEPS {
        let (_, count) = best.moved([0.0; 7]);
        let (mut matrix, mut right) = ([[0.0; 7]; 7], [0.0; 7]);
        // The surface with each parameter a little more, and a little less.
        let pairs: [[Surface; 2]; 7] = std::array::from_fn(|k| {
            let step = |sign: f64| {
                let mut d = [0.0; 7];
                d[k] = sign * h * if k < count { unit_of(&best, k, size) } else { 0.0 };
                best.moved(d).0
            };
            [step(1.0), step(-1.0)]
        });
        for point in &points {
            let here = best.distance(*point);
            let mut row = [0.0; 7];
            for (entry, [up, down]) in row.iter_mut().zip(&pairs).take(count) {
                *entry = (up.distance(*point) - down.distance(*point)) / (2.0 * h);
            }
            for i in 0..count {
                right[i] -= row[i] * here;
                for j in 0..count {
                    matrix[i][j] += row[i] * row[j];
                }
            }
        }
        let trace: f64 = (0..count).map(|k| matrix[k][k]).sum();
        for (k, row) in matrix.iter_mut().enumerate() {
            row[k] += if k < count { 1e-11 * trace } else { 1.0 };
        }
        let Some(mut step) = solve(matrix, right) else { break };
        (0..7).for_each(|k| step[k] *= unit_of(&best, k, size));
        let next = best.moved(step).0;
        let now = rms(&next, &points);
        if !now.is_finite() || now >= error {
            break;
        }
        let gain = error - now;
        (best, error) = (next, now);
        if gain <= 1e-3 * error {
            break;
        }
    }
    best
}

/// What a parameter is measured in, so that all are of one magnitude: lengths by the extent of the points, angles by themselves.
fn unit_of(surface: &Surface, k: usize, size: f64) -> f64 {
    let is_angle = match surface {
        Surface::Cylinder { .. } => matches!(k, 2 | 3),
        Surface::Cone { .. } => k >= 3,
        Surface::Torus { .. } => matches!(k, 3 | 4),
        Surface::Plane { .. } | Surface::Sphere { .. } => false,
    };
    if is_angle { 1.0 } else { size }
}
