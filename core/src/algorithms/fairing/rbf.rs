//! An implicit surface through the surroundings, and the way onto it.
//!
//! f(x) = Σ wᵢ|x − cᵢ|³ + a linear polynomial is, of all functions with the same values at the centres, the one of least third derivatives
//! (triharmonic; Carr et al., "Reconstruction and Representation of 3D Objects with Radial Basis Functions", SIGGRAPH 2001). It is 0
//! at vertices of the rim and the rings around, and the distance at points off the surface on both sides along the normals. The
//! patch's vertices then move along the gradient until f is 0.

use glam::DVec3;

use super::sheet::Sheet;

/// Centres on the surface, at most; the matrix is three times as large. Beyond, those farthest from one another are taken.
const CENTRES: usize = 250;
/// How far off the surface the other centres lie, as a share of the edges there.
const OFF: f64 = 0.5;
/// Steps along the gradient, and the value of f (in units of the rim's radius) that is on the surface.
const STEPS: usize = 12;
const ON: f64 = 1e-9;
/// Longest step.
const STRIDE: f64 = 0.1;

/// Moves all new vertices onto the implicit surface. `None` where the equations cannot be solved, or a vertex does not get there.
/// O(c³) for c centres, O(c) a vertex and step.
pub(super) fn project(sheet: &mut Sheet<'_>) -> Option<()> {
    let f = Implicit::new(sheet)?;
    for v in sheet.held..sheet.points.len() {
        let mut p = sheet.points[v];
        let mut value = f.at(p);
        for _ in 0..STEPS {
            if value.0.abs() <= ON {
                break;
            }
            let step = value.1 * (value.0 / value.1.length_squared());
            let length = step.length();
            p -= if length > STRIDE { step * (STRIDE / length) } else { step };
            value = f.at(p);
        }
        // Also for what is not a number.
        let arrived = value.0.abs() <= 1e-6;
        if !arrived {
            return None;
        }
        sheet.points[v] = p;
    }
    Some(())
}

struct Implicit {
    centres: Vec<DVec3>,
    weights: Vec<f64>,
    slope: DVec3,
    height: f64,
}

impl Implicit {
    fn new(sheet: &Sheet<'_>) -> Option<Self> {
        let mut normals = vec![DVec3::ZERO; sheet.fixed];
        let mut lengths = vec![(0.0, 0.0); sheet.fixed];
        for t in sheet.around {
            let corners = sheet.corners(*t);
            let normal = sheet.normal(*t).normalize_or_zero();
            for k in 0..3 {
                let (to, from) = (corners[(k + 1) % 3] - corners[k], corners[(k + 2) % 3] - corners[k]);
                // Weighed so that a sphere's normals are exact (Max, "Weights for Computing Vertex Normals from Facet Normals", 1999).
                let weight = to.cross(from).length() / (to.length_squared() * from.length_squared()).max(f64::MIN_POSITIVE);
                normals[t[k] as usize] += normal * weight;
                let sum = &mut lengths[t[k] as usize];
                *sum = (sum.0 + to.length(), sum.1 + 1.0);
            }
        }
        let known: Vec<usize> = (0..sheet.fixed).filter(|&v| normals[v] != DVec3::ZERO).collect();
        let chosen = spread(&known.iter().map(|&v| sheet.points[v]).collect::<Vec<_>>(), CENTRES);
        let (mut centres, mut values) = (Vec::new(), Vec::new());
        for v in chosen.iter().map(|&i| known[i]) {
            let (p, n) = (sheet.points[v], normals[v].normalize_or_zero());
            let off = OFF * lengths[v].0 / lengths[v].1;
            centres.extend([p, p + n * off, p - n * off]);
            values.extend([0.0, off, -off]);
        }
        let n = centres.len();
        if n < 12 {
            return None;
        }
        let size = n + 4;
        let mut matrix = vec![0.0; size * size];
        for i in 0..n {
            for j in 0..n {
                let r2 = centres[i].distance_squared(centres[j]);
                matrix[i * size + j] = r2 * r2.sqrt();
            }
            let polynomial = [centres[i].x, centres[i].y, centres[i].z, 1.0];
            for (k, value) in polynomial.into_iter().enumerate() {
                matrix[i * size + n + k] = value;
                matrix[(n + k) * size + i] = value;
            }
        }
        values.resize(size, 0.0);
        if !solve(&mut matrix, &mut values) {
            return None;
        }
        let slope = DVec3::new(values[n], values[n + 1], values[n + 2]);
        let f = Self { slope, height: values[n + 3], weights: values[..n].to_vec(), centres };
        // At the rim it has to be right, whether a vertex is a centre or was left out.
        let right = |v: usize| f.at(sheet.points[v]).0.abs() <= 0.1 * lengths[v].0 / lengths[v].1;
        known.iter().all(|&v| !sheet.on_rim[v] || right(v)).then_some(f)
    }

    /// Value and gradient.
    fn at(&self, p: DVec3) -> (f64, DVec3) {
        let (mut value, mut gradient) = (self.slope.dot(p) + self.height, self.slope);
        for (centre, weight) in self.centres.iter().zip(&self.weights) {
            let d = p - *centre;
            let r2 = d.length_squared();
            let r = r2.sqrt();
            value += weight * r2 * r;
            gradient += d * (3.0 * weight * r);
        }
        (value, gradient)
    }
}

/// The first point and then always the one farthest from all chosen, until there are `most`: O(n · most).
fn spread(points: &[DVec3], most: usize) -> Vec<usize> {
    if points.len() <= most {
        return (0..points.len()).collect();
    }
    let mut distances = vec![f64::INFINITY; points.len()];
    let mut chosen = vec![0];
    while chosen.len() < most {
        let last = points[chosen[chosen.len() - 1]];
        let mut farthest = 0;
        for (i, p) in points.iter().enumerate() {
            distances[i] = distances[i].min(p.distance_squared(last));
            if distances[i] > distances[farthest] {
                farthest = i;
            }
        }
        chosen.push(farthest);
    }
    chosen
}

/// Gaussian elimination with partial pivoting, in place; `false` where the matrix is singular.
fn solve(matrix: &mut [f64], x: &mut [f64]) -> bool {
    let n = x.len();
    for k in 0..n {
        let pivot = (k..n).fold(k, |best, i| if matrix[i * n + k].abs() > matrix[best * n + k].abs() { i } else { best });
        let regular = matrix[pivot * n + k].abs() > 1e-13;
        if !regular {
            return false;
        }
        if pivot != k {
            let (above, below) = matrix.split_at_mut(pivot * n);
            above[k * n..(k + 1) * n].swap_with_slice(&mut below[..n]);
            x.swap(k, pivot);
        }
        let (above, below) = matrix.split_at_mut((k + 1) * n);
        let row = &above[k * n + k..];
        for (i, other) in below.chunks_exact_mut(n).enumerate() {
            let factor = other[k] / row[0];
            if factor != 0.0 {
                for (a, b) in other[k..].iter_mut().zip(row) {
                    *a -= factor * b;
                }
                x[k + 1 + i] -= factor * x[k];
            }
        }
    }
    for k in (0..n).rev() {
        let sum: f64 = (k + 1..n).map(|j| matrix[k * n + j] * x[j]).sum();
        x[k] = (x[k] - sum) / matrix[k * n + k];
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elimination_swaps_rows_where_it_must() {
        let mut x = [5.0, 1.0, 9.0];
        assert!(solve(&mut [0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 2.0, 1.0, 2.0], &mut x));
        assert_eq!(x, [1.0, 3.0, 2.0]);
        assert!(!solve(&mut [1.0, 2.0, 2.0, 4.0], &mut [1.0, 1.0]));
    }

    #[test]
    fn spread_points_come_from_all_over() {
        let points: Vec<DVec3> = (0..100).map(|i| DVec3::X * f64::from(i * i)).collect();
        assert_eq!(spread(&points, 3), [0, 99, 70]);
        assert_eq!(spread(&points, 100).len(), 100);
    }
}
