//! Dense systems of linear equations of any size, and those of a narrow band.

use crate::curves::vector::{Point, add, scale, sub};

/// Solves a dense system, whose rows have their right side behind them, by elimination with the largest pivot of each column; `None` if it
/// is singular. O(rows³).
pub(super) fn solve_dense(mut rows: Vec<Vec<f64>>) -> Option<Vec<f64>> {
    let count = rows.len();
    let size = rows.iter().flat_map(|row| row.iter().take(count)).fold(0.0_f64, |most, x| most.max(x.abs()));
    for column in 0..count {
        let pivot = (column..count).max_by(|a, b| rows[*a][column].abs().total_cmp(&rows[*b][column].abs()))?;
        rows.swap(column, pivot);
        let (top, below) = rows.split_at_mut(column + 1);
        let top = top.last()?;
        let head = *top.get(column)?;
        if head.abs() <= 1e-14 * size || !size.is_finite() {
            return None;
        }
        for row in below {
            let factor = row[column] / head;
            row.iter_mut().zip(top).skip(column).for_each(|(x, y)| *x -= factor * y);
        }
    }
    let mut solved = vec![0.0; count];
    for row in (0..count).rev() {
        let known: f64 = (row + 1..count).map(|column| rows[row][column] * solved[column]).sum();
        solved[row] = (rows[row].get(count)? - known) / rows[row][row];
    }
    solved.iter().all(|x| x.is_finite()).then_some(solved)
}

/// Normal equations of cubic B-splines: each row holds its diagonal and the three entries right of it.
#[derive(Debug, Default)]
pub(super) struct Band {
    rows: Vec<[f64; 4]>,
    right: Vec<Point>,
}

impl Band {
    pub(super) fn new(size: usize) -> Self {
        Self { rows: vec![[0.0; 4]; size], right: vec![[0.0; 3]; size] }
    }

    /// Adds an observation: the values of four basis functions, the first one of the number `first`, and what their sum shall be.
    /// Functions before 0 and behind the last are left out.
    pub(super) fn observe(&mut self, first: isize, values: [f64; 4], target: Point) {
        for (number, value) in values.into_iter().enumerate() {
            let Some(place) = usize::try_from(first + number as isize).ok().filter(|place| *place < self.rows.len()) else {
                continue;
            };
            if let (Some(row), Some(right)) = (self.rows.get_mut(place), self.right.get_mut(place)) {
                row.iter_mut().zip(values.iter().skip(number)).for_each(|(entry, other)| *entry += value * other);
                *right = add(*right, scale(target, value));
            }
        }
    }

    /// Solves by Cholesky's method; `None` if the matrix is not positive definite. O(size).
    pub(super) fn solve(mut self) -> Option<Vec<Point>> {
        let size = self.rows.len();
        for column in 0..size {
            let [diagonal, rest @ ..] = *self.rows.get(column)?;
            // An entry that rounding alone makes positive is none.
            if diagonal <= 1e-14 || !diagonal.is_finite() {
                return None;
            }
            let right = *self.right.get(column)?;
            for (step, x) in rest.into_iter().enumerate() {
                let factor = x / diagonal;
                let Some(row) = self.rows.get_mut(column + step + 1) else { break };
                row.iter_mut().zip(rest.iter().skip(step)).for_each(|(entry, y)| *entry -= factor * y);
                let below = self.right.get_mut(column + step + 1)?;
                *below = sub(*below, scale(right, factor));
            }
        }
        for row in (0..size).rev() {
            let [diagonal, rest @ ..] = *self.rows.get(row)?;
            let mut value = *self.right.get(row)?;
            for (step, x) in rest.into_iter().enumerate() {
                value = self.right.get(row + step + 1).map_or(value, |known| sub(value, scale(*known, x)));
            }
            *self.right.get_mut(row)? = scale(value, 1.0 / diagonal);
        }
        Some(self.right)
    }
}

/// Eigenvalues of a symmetric matrix and their directions, the lowest first, by Jacobi's rotations (12 rounds).
pub(super) fn eigen(mut matrix: [[f64; 3]; 3]) -> [(f64, Point); 3] {
    let mut axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for (p, q) in [(0, 1), (0, 2), (1, 2)].into_iter().cycle().take(36) {
        if matrix[p][q] == 0.0 {
            continue;
        }
        let (sin, cos) = (0.5 * (2.0 * matrix[p][q]).atan2(matrix[q][q] - matrix[p][p])).sin_cos();
        for row in &mut matrix {
            (row[p], row[q]) = (cos * row[p] - sin * row[q], sin * row[p] + cos * row[q]);
        }
        for rows in [&mut matrix, &mut axes] {
            let (a, b) = (rows[p], rows[q]);
            rows[p] = sub(scale(a, cos), scale(b, sin));
            rows[q] = add(scale(a, sin), scale(b, cos));
        }
    }
    let mut pairs = [(matrix[0][0], axes[0]), (matrix[1][1], axes[1]), (matrix[2][2], axes[2])];
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three observations of single functions, and one of two neighbours that agrees with them.
    #[test]
    fn a_band_is_solved() {
        let mut band = Band::new(3);
        band.observe(-1, [7.0, 1.0, 0.0, 0.0], [1.0, 0.0, 0.0]);
        band.observe(1, [1.0, 0.0, 0.0, 0.0], [2.0, 0.0, 0.0]);
        band.observe(2, [1.0, 0.0, 9.0, 9.0], [3.0, 0.0, 0.0]);
        band.observe(0, [0.5, 0.5, 0.0, 0.0], [1.5, 0.0, 0.0]);
        let solved = band.solve().unwrap();
        assert!(solved.iter().zip([1.0, 2.0, 3.0]).all(|(a, b)| (a[0] - b).abs() < 1e-12), "{solved:?}");
    }

    #[test]
    fn eigenvalues_come_in_order() {
        let pairs = eigen([[2.0, 1.0, 0.0], [1.0, 2.0, 0.0], [0.0, 0.0, 9.0]]);
        assert!(pairs.iter().zip([1.0, 3.0, 9.0]).all(|(pair, value)| (pair.0 - value).abs() < 1e-12));
    }
}
