//! Frames, planes and circles through points.

use super::linear::eigen;
use crate::curves::curve::widen;
use crate::curves::vector::{Point, add, cross, distance, dot, norm, scale, sub, unit};
use crate::util::linear::solve;

pub(super) fn mean(points: &[Point]) -> Point {
    scale(points.iter().fold([0.0; 3], |sum, point| add(sum, *point)), 1.0 / points.len().max(1) as f64)
}

/// The plane of least squares: its middle and normal; `None` of points on a line.
pub(super) fn plane(points: &[Point]) -> Option<(Point, Point)> {
    let middle = mean(points);
    let mut matrix = [[0.0; 3]; 3];
    for offset in points.iter().map(|point| sub(*point, middle)) {
        for (row, x) in matrix.iter_mut().zip(offset) {
            row.iter_mut().zip(offset).for_each(|(entry, y)| *entry += x * y);
        }
    }
    let [_, (second, _), (largest, along)] = eigen(matrix);
    let [(_, normal), ..] = eigen(matrix);
    (second > 1e-18 * largest && largest > 0.0)
        .then(|| (middle, unit(sub(normal, scale(along, dot(normal, along)))).unwrap_or(normal)))
}

/// The circle of least squares of the algebraic distance (I. Kåsa 1976) in a plane: centre and radius.
pub(super) fn circle(points: &[[f64; 2]]) -> Option<([f64; 2], f64)> {
    let count = points.len().max(1) as f64;
    let [a, b] = points.iter().fold([0.0; 2], |[a, b], [x, y]| [a + x / count, b + y / count]);
    let size = points.iter().fold(0.0_f64, |most, [x, y]| most.max((x - a).abs()).max((y - b).abs()));
    let mut matrix = [[0.0; 3]; 3];
    let mut right = [0.0; 3];
    for [x, y] in points.iter().map(|[x, y]| [(x - a) / size, (y - b) / size]) {
        let row = [x, y, 1.0];
        for ((entries, sum), x) in matrix.iter_mut().zip(&mut right).zip(row) {
            entries.iter_mut().zip(row).for_each(|(entry, y)| *entry += x * y);
            *sum += x * (row[0] * row[0] + row[1] * row[1]);
        }
    }
    let [p, q, r] = solve(matrix, right)?;
    let radius = (r + 0.25 * (p * p + q * q)).sqrt();
    radius.is_finite().then_some(([a + 0.5 * p * size, b + 0.5 * q * size], radius * size))
}

/// The sphere of least squares of the algebraic distance: centre and radius; `None` of points in a plane.
pub(super) fn sphere(points: &[Point]) -> Option<(Point, f64)> {
    let middle = mean(points);
    let size = points.iter().fold(0.0_f64, |most, point| most.max(norm(sub(*point, middle))));
    let mut matrix = [[0.0; 4]; 4];
    let mut right = [0.0; 4];
    for [x, y, z] in points.iter().map(|point| scale(sub(*point, middle), 1.0 / size)) {
        let row = [x, y, z, 1.0];
        for ((entries, sum), value) in matrix.iter_mut().zip(&mut right).zip(row) {
            entries.iter_mut().zip(row).for_each(|(entry, other)| *entry += value * other);
            *sum += value * (x * x + y * y + z * z);
        }
    }
    let [p, q, r, s] = solve(matrix, right)?;
    let radius = (s + 0.25 * (p * p + q * q + r * r)).sqrt();
    radius.is_finite().then(|| (add(middle, scale([p, q, r], 0.5 * size)), radius * size))
}

/// Twice the area vector of a closed polygon (Newell's normal).
pub(super) fn area(ring: &[Point]) -> Point {
    let Some(&first) = ring.first() else { return [0.0; 3] };
    let mut sum = [0.0; 3];
    for pair in ring.windows(2) {
        if let &[a, b] = pair {
            sum = add(sum, cross(sub(a, first), sub(b, first)));
        }
    }
    sum
}

/// Whether any of these normals points away from their mean; normals of no length are left out.
pub(super) fn turns_away(normals: &[Point]) -> bool {
    let mean = mean(normals);
    let largest = normals.iter().fold(0.0_f64, |most, one| most.max(norm(*one)));
    norm(mean) <= 1e-9 * largest
        || !largest.is_finite()
        || normals.iter().any(|one| norm(*one) > 1e-9 * largest && dot(*one, mean) <= 0.0)
}

/// The diagonal of a box around points.
pub(super) fn size(points: &[Point]) -> f64 {
    let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    points.iter().for_each(|point| widen(&mut bounds, *point));
    let diagonal = distance(bounds[0], bounds[1]);
    if diagonal.is_finite() { diagonal } else { 0.0 }
}
