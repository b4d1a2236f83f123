//! Small systems of linear equations and symmetric eigenproblems.

/// Solves `matrix · x = right` by Gauss's elimination with row pivots; `None` where a pivot is below 10⁻¹³ of the largest entry, or a result is no number.
pub(crate) fn solve<const N: usize>(mut matrix: [[f64; N]; N], mut right: [f64; N]) -> Option<[f64; N]> {
    let largest = matrix.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
    for k in 0..N {
        let pivot = (k..N).max_by(|a, b| matrix[*a][k].abs().total_cmp(&matrix[*b][k].abs()))?;
        if matrix[pivot][k].abs() <= 1e-13 * largest || !matrix[pivot][k].is_finite() {
            return None;
        }
        matrix.swap(k, pivot);
        right.swap(k, pivot);
        for i in k + 1..N {
            let factor = matrix[i][k] / matrix[k][k];
            let pivot = matrix[k];
            matrix[i].iter_mut().zip(pivot).skip(k).for_each(|(entry, above)| *entry -= factor * above);
            right[i] -= factor * right[k];
        }
    }
    for k in (0..N).rev() {
        let rest: f64 = (k + 1..N).map(|j| matrix[k][j] * right[j]).sum();
        right[k] = (right[k] - rest) / matrix[k][k];
    }
    right.iter().all(|x| x.is_finite()).then_some(right)
}

/// Eigenvalues of a symmetric matrix, least first, and the vectors to them: cyclic Jacobi rotations (Golub, Van Loan, Matrix
/// Computations, §8.5), 40 sweeps at most.
pub(crate) fn eigen<const N: usize>(mut a: [[f64; N]; N]) -> [(f64, [f64; N]); N] {
    let mut v = [[0.0; N]; N];
    (0..N).for_each(|k| v[k][k] = 1.0);
    for _ in 0..40 {
        let off: f64 = (0..N).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| a[i][j] * a[i][j]).sum();
        let diagonal: f64 = (0..N).map(|k| a[k][k] * a[k][k]).sum();
        if off <= 1e-32 * diagonal || !off.is_finite() {
            break;
        }
        for p in 0..N {
            for q in p + 1..N {
                rotate(&mut a, &mut v, p, q);
            }
        }
    }
    let mut pairs: [(f64, [f64; N]); N] = std::array::from_fn(|k| (a[k][k], std::array::from_fn(|i| v[i][k])));
    pairs.sort_by(|x, y| x.0.total_cmp(&y.0));
    pairs
}

fn rotate<const N: usize>(a: &mut [[f64; N]; N], v: &mut [[f64; N]; N], p: usize, q: usize) {
    if a[p][q] == 0.0 {
        return;
    }
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let t = if theta == 0.0 { 1.0 } else { t };
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    for row in a.iter_mut().chain(v.iter_mut()) {
        let (x, y) = (row[p], row[q]);
        (row[p], row[q]) = (c * x - s * y, s * x + c * y);
    }
    let (x, y) = (a[p], a[q]);
    a[p] = std::array::from_fn(|k| c * x[k] - s * y[k]);
    a[q] = std::array::from_fn(|k| s * x[k] + c * y[k]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_system_and_an_eigenproblem_known_by_hand() {
        let x = solve([[0.0, 2.0], [1.0, 1.0]], [4.0, 5.0]).unwrap();
        assert!((x[0] - 3.0).abs() < 1e-12 && (x[1] - 2.0).abs() < 1e-12);
        assert!(solve([[1.0, 2.0], [2.0, 4.0]], [1.0, 1.0]).is_none());
        // [[2, 1], [1, 2]] has 1 along (1, −1) and 3 along (1, 1).
        let [(low, first), (high, _)] = eigen([[2.0, 1.0], [1.0, 2.0]]);
        assert!((low - 1.0).abs() < 1e-12 && (high - 3.0).abs() < 1e-12);
        assert!((first[0] + first[1]).abs() < 1e-12);
    }

    #[test]
    fn a_system_is_solved_and_a_singular_one_refused() {
        assert_eq!(solve([[0.0, 2.0], [4.0, 0.0]], [2.0, 8.0]), Some([2.0, 1.0]));
        assert_eq!(solve([[1.0, 2.0], [2.0, 4.0]], [1.0, 2.0]), None);
    }
}
