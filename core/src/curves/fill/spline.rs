//! Surfaces of tensor products of B-splines.

use super::basis::{self, Values};
use crate::curves::curve::{CurveError, HIGHEST_DEGREE};
use crate::curves::vector::{Point, add, cross, is_finite, scale, sub, unit};

/// A B-spline surface, rational or not; knots of both directions are clamped.
#[derive(Clone, Debug, PartialEq)]
pub struct SplineSurface {
    degrees: [usize; 2],
    knots: [Vec<f64>; 2],
    points: Vec<Vec<Point>>,
    weights: Option<Vec<Vec<f64>>>,
}

/// A point of a surface and its derivatives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Jet {
    /// The point.
    pub point: Point,
    /// Derivatives by u and by v.
    pub first: [Point; 2],
    /// Derivatives by u twice, u and v, v twice.
    pub second: [Point; 3],
}

impl Jet {
    /// The direction of the normal; `None` where the surface shrinks to a point or a line.
    #[must_use]
    pub fn normal(&self) -> Option<Point> {
        unit(cross(self.first[0], self.first[1]))
    }
}

impl SplineSurface {
    /// A surface of degrees, knots, and rows of control points (a row for each function of u).
    ///
    /// # Errors
    /// [`CurveError`] of what is not one.
    pub fn new(
        degrees: [usize; 2],
        knots: [Vec<f64>; 2],
        points: Vec<Vec<Point>>,
        weights: Option<Vec<Vec<f64>>>,
    ) -> Result<Self, CurveError> {
        let counts = [points.len(), points.first().map_or(0, Vec::len)];
        for ((degree, knots), count) in degrees.into_iter().zip(&knots).zip(counts) {
            if degree == 0 || degree > HIGHEST_DEGREE {
                return Err(CurveError::Degree(degree));
            }
            if count <= degree || knots.len() != count + degree + 1 {
                return Err(CurveError::Count { points: count, knots: knots.len(), degree });
            }
            let is_clamped = knots.get(..=degree).is_some_and(|first| first.iter().all(|knot| *knot == first[0]))
                && knots.get(count..).is_some_and(|last| last.iter().all(|knot| *knot == last[0]));
            if !knots.is_sorted() || !is_clamped || basis::at(knots, 0) >= basis::at(knots, count) {
                return Err(CurveError::Knots);
            }
        }
        if points.iter().any(|row| row.len() != counts[1]) {
            return Err(CurveError::Degenerate("rows of control points that differ in length"));
        }
        if !points.iter().flatten().copied().all(is_finite) {
            return Err(CurveError::NotFinite);
        }
        let is_right = |weights: &Vec<Vec<f64>>| {
            weights.len() == counts[0]
                && weights.iter().all(|row| row.len() == counts[1] && row.iter().all(|w| *w > 0.0 && w.is_finite()))
        };
        if !weights.as_ref().is_none_or(is_right) {
            return Err(CurveError::Weights);
        }
        Ok(Self { degrees, knots, points, weights })
    }

    /// Degrees by u and v.
    #[must_use]
    pub fn degrees(&self) -> [usize; 2] {
        self.degrees
    }

    /// Knots of u and v, repeated ones as often as they count.
    #[must_use]
    pub fn knots(&self) -> &[Vec<f64>; 2] {
        &self.knots
    }

    /// Control points: a row for each function of u.
    #[must_use]
    pub fn points(&self) -> &[Vec<Point>] {
        &self.points
    }

    /// Weights in the same rows; `None` if all are 1.
    #[must_use]
    pub fn weights(&self) -> Option<&[Vec<f64>]> {
        self.weights.as_deref()
    }

    /// Lowest and highest parameters of u and of v.
    #[must_use]
    pub fn domain(&self) -> [[f64; 2]; 2] {
        let [u, v] = &self.knots;
        [u, v].map(|knots| [basis::at(knots, 0), basis::at(knots, knots.len())])
    }

    /// Point, first and second derivatives (TNB A3.6 and A4.4). O(degrees² + log knots).
    #[must_use]
    pub fn jet(&self, parameters: [f64; 2]) -> Jet {
        let rows = |axis: usize| -> (usize, [Values; 3]) {
            let (degree, knots) = (self.degrees[axis], &self.knots[axis]);
            let [low, high] = self.domain()[axis];
            let t = parameters[axis].clamp(low, high);
            let span = basis::span(knots, degree, t);
            (span - degree, basis::derivatives(knots, degree, span, t))
        };
        let ((first, along), (start, across)) = (rows(0), rows(1));
        let mut sums = [[0.0; 4]; 6];
        let [p, q] = self.degrees;
        for (i, j) in (0..=p).flat_map(|i| (0..=q).map(move |j| (i, j))) {
            let Some(&[x, y, z]) = self.points.get(first + i).and_then(|row| row.get(start + j)) else { continue };
            let weights = self.weights.as_ref().and_then(|weights| weights.get(first + i));
            let weight = weights.and_then(|row| row.get(start + j)).copied().unwrap_or(1.0);
            for (sum, (u, v)) in sums.iter_mut().zip([(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]) {
                let value = along[u][i] * across[v][j] * weight;
                sum.iter_mut().zip([x, y, z, 1.0]).for_each(|(sum, x)| *sum += value * x);
            }
        }
        project(sums)
    }
}

/// Derivatives of a quotient by the weight (TNB equation 4.20), in the order of the sums: value, u, v, uu, uv, vv.
fn project(sums: [[f64; 4]; 6]) -> Jet {
    let [a, u, v, uu, uv, vv] = sums.map(|[x, y, z, _]| [x, y, z]);
    let [w, wu, wv, wuu, wuv, wvv] = sums.map(|[.., w]| w);
    let over = |vector: Point| scale(vector, 1.0 / w);
    let point = over(a);
    let du = over(sub(u, scale(point, wu)));
    let dv = over(sub(v, scale(point, wv)));
    let second = |sum: Point, [x, y]: [(f64, Point); 2], z: f64| {
        over(sub(sub(sum, add(scale(x.1, x.0), scale(y.1, y.0))), scale(point, z)))
    };
    let second =
        [second(uu, [(wu, du), (wu, du)], wuu), second(uv, [(wu, dv), (wv, du)], wuv), second(vv, [(wv, dv), (wv, dv)], wvv)];
    Jet { point, first: [du, dv], second }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curves::vector::{distance, norm};

    /// A quarter of a cylinder: rational of degree 2 around, of degree 1 along.
    fn cylinder() -> SplineSurface {
        let rows = [[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| vec![[x, y, 0.0], [x, y, 2.0]]);
        let weights = [1.0, 0.5_f64.sqrt(), 1.0].map(|w| vec![w, w]);
        let knots = [vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0], vec![0.0, 0.0, 1.0, 1.0]];
        SplineSurface::new([2, 1], knots, rows.to_vec(), Some(weights.to_vec())).unwrap()
    }

    #[test]
    fn a_rational_cylinder_is_round_and_its_derivatives_agree() {
        let surface = cylinder();
        for u in [0.0, 0.3, 0.8, 0.999] {
            let jet = surface.jet([u, 0.25]);
            let [x, y, z] = jet.point;
            assert!((x.hypot(y) - 1.0).abs() < 1e-14 && (z - 0.5).abs() < 1e-14);
            assert!(distance(jet.normal().unwrap(), [x, y, 0.0]) < 1e-12);
            let step = 1e-6;
            let later = surface.jet([u + step, 0.25]);
            assert!(norm(sub(scale(sub(later.point, jet.point), 1.0 / step), jet.first[0])) < 1e-5);
            assert!(norm(sub(scale(sub(later.first[0], jet.first[0]), 1.0 / step), jet.second[0])) < 1e-4);
        }
        assert!(
            SplineSurface::new([1, 1], [vec![0.0, 0.0, 1.0, 1.0], vec![0.0, 1.0, 1.0, 1.0]], vec![vec![[0.0; 3]; 2]; 2], None)
                .is_err()
        );
    }
}
