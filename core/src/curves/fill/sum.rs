//! Sums of surfaces.

use super::basis;
use super::spline::SplineSurface;
use crate::curves::curve::CurveError;
use crate::curves::vector::{Point, add};

/// Control points of a sum, at most.
const MOST: usize = 1 << 22;

/// The sum of two surfaces of degree 3 both ways, without weights, on the same domain: exact, with the knots of both. O(control
/// points).
///
/// # Errors
/// [`CurveError::Degenerate`] of more than four million control points.
pub(super) fn sum(one: &SplineSurface, other: &SplineSurface) -> Result<SplineSurface, CurveError> {
    let ([u, v], [p, q]) = (one.knots(), other.knots());
    let knots = [basis::union(u, p), basis::union(v, q)];
    if knots.iter().map(|knots| knots.len().saturating_sub(4)).product::<usize>() > MOST {
        return Err(CurveError::Degenerate("a surface of more than four million points"));
    }
    let (a, b) = (refined(one, &knots), refined(other, &knots));
    let row = |(a, b): (Vec<Point>, Vec<Point>)| a.into_iter().zip(b).map(|(a, b)| add(a, b)).collect();
    SplineSurface::new([3, 3], knots, a.into_iter().zip(b).map(row).collect(), None)
}

/// Control points of the same surface for finer knots.
fn refined(surface: &SplineSurface, [u, v]: &[Vec<f64>; 2]) -> Vec<Vec<Point>> {
    let [p, q] = surface.knots();
    let rows: Vec<Vec<Point>> = surface.points().iter().map(|row| basis::refined(3, q, row, v)).collect();
    let mut points = vec![Vec::with_capacity(v.len()); u.len().saturating_sub(4)];
    for at in 0..rows.first().map_or(0, Vec::len) {
        let column: Vec<Point> = rows.iter().filter_map(|row| row.get(at).copied()).collect();
        points.iter_mut().zip(basis::refined(3, p, &column, u)).for_each(|(row, point)| row.push(point));
    }
    points
}
