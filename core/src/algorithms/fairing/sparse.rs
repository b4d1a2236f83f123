//! Sparse matrices: products, and the LDLᵀ factors of a symmetric positive definite one.
//!
//! The factorisation goes up row by row along the elimination tree (Davis, "Algorithm 849: A concise sparse Cholesky factorization
//! package", ACM TOMS 31(4), 2005), in an order by nested dissection in space (George, SIAM J. Numer. Anal. 10, 1973): a set is halved
//! along its longest axis, and what of the one half has neighbours in the other comes last. Sequential, + − × ÷ √ alone: the same
//! bits everywhere.

use crate::util::ids::NONE;
use glam::DVec3;

/// A sparse matrix by rows.
#[derive(Clone, Debug, Default)]
pub(super) struct Rows {
    ends: Vec<usize>,
    columns: Vec<u32>,
    values: Vec<f64>,
}

impl Rows {
    pub(super) fn push(&mut self, row: impl IntoIterator<Item = (u32, f64)>) {
        for (column, value) in row {
            self.columns.push(column);
            self.values.push(value);
        }
        self.ends.push(self.columns.len());
    }

    pub(super) fn len(&self) -> usize {
        self.ends.len()
    }

    pub(super) fn row(&self, i: usize) -> impl Iterator<Item = (u32, f64)> + '_ {
        let range = if i == 0 { 0 } else { self.ends[i - 1] }..self.ends[i];
        self.columns[range.clone()].iter().copied().zip(self.values[range].iter().copied())
    }

    /// The product with a vector of points.
    pub(super) fn of(&self, points: &[DVec3]) -> Vec<DVec3> {
        (0..self.len()).map(|i| self.row(i).map(|(column, value)| points[column as usize] * value).sum()).collect()
    }

    /// `columns`: how many there are.
    pub(super) fn transposed(&self, columns: usize) -> Self {
        let mut next = vec![0; columns + 1];
        for &c in &self.columns {
            next[c as usize + 1] += 1;
        }
        for c in 0..columns {
            next[c + 1] += next[c];
        }
        let ends = next[1..].to_vec();
        let mut out = Self { ends, columns: vec![0; self.columns.len()], values: vec![0.0; self.values.len()] };
        for i in 0..self.len() {
            for (c, value) in self.row(i) {
                let place = &mut next[c as usize];
                out.columns[*place] = i as u32;
                out.values[*place] = value;
                *place += 1;
            }
        }
        out
    }

    /// The product of the first `rows` rows with `other`, whose columns are less than `columns` in number. Each row's columns are in the
    /// order in which they were met.
    pub(super) fn times(&self, rows: usize, other: &Self, columns: usize) -> Self {
        let mut out = Self::default();
        let mut sums = vec![0.0; columns];
        let mut met_in = vec![usize::MAX; columns];
        let mut met: Vec<u32> = Vec::new();
        for i in 0..rows {
            met.clear();
            for (j, factor) in self.row(i) {
                for (c, value) in other.row(j as usize) {
                    if met_in[c as usize] != i {
                        met_in[c as usize] = i;
                        sums[c as usize] = 0.0;
                        met.push(c);
                    }
                    sums[c as usize] += factor * value;
                }
            }
            out.push(met.iter().map(|&c| (c, sums[c as usize])));
        }
        out
    }
}

/// A symmetric positive definite matrix as P L D Lᵀ Pᵀ.
pub(super) struct Factor {
    /// The original numbers in the order of elimination.
    order: Vec<u32>,
    starts: Vec<usize>,
    rows: Vec<u32>,
    values: Vec<f64>,
    diagonal: Vec<f64>,
}

impl Factor {
    /// Of a matrix with both triangles stored; `None` where it is not positive definite as far as rounding lets tell, or where L
    /// would have more than `max_entries`. `points`: where each unknown lies, for the order.
    pub(super) fn new(matrix: &Rows, points: &[DVec3], max_entries: usize) -> Option<Self> {
        let n = matrix.len();
        let order = dissected(matrix, points);
        let mut place = vec![0_u32; n];
        for (k, &i) in order.iter().enumerate() {
            place[i as usize] = k as u32;
        }
        // Columns' lengths along the elimination tree.
        let (mut parent, mut seen) = (vec![NONE; n], vec![NONE; n]);
        let mut starts = vec![0_usize; n + 1];
        for k in 0..n as u32 {
            seen[k as usize] = k;
            for (column, _) in matrix.row(order[k as usize] as usize) {
                let mut i = place[column as usize];
                while i < k && seen[i as usize] != k {
                    if parent[i as usize] == NONE {
                        parent[i as usize] = k;
                    }
                    starts[i as usize + 1] += 1;
                    seen[i as usize] = k;
                    i = parent[i as usize];
                }
            }
        }
        for k in 0..n {
            starts[k + 1] += starts[k];
        }
        let entries = starts[n];
        if entries > max_entries {
            return None;
        }
        let mut factor = Self { order, starts, rows: vec![0; entries], values: vec![0.0; entries], diagonal: vec![0.0; n] };
        factor.eliminate(matrix, &place, &parent).then_some(factor)
    }

    fn eliminate(&mut self, matrix: &Rows, place: &[u32], parent: &[u32]) -> bool {
        let n = matrix.len();
        let mut next = self.starts[..n].to_vec();
        let mut seen = vec![NONE; n];
        let mut sums = vec![0.0; n];
        let (mut way, mut pattern): (Vec<u32>, Vec<u32>) = (Vec::new(), vec![0; n]);
        for k in 0..n as u32 {
            let mut top = n;
            seen[k as usize] = k;
            for (column, value) in matrix.row(self.order[k as usize] as usize) {
                let mut i = place[column as usize];
                if i > k {
                    continue;
                }
                sums[i as usize] += value;
                way.clear();
                while seen[i as usize] != k {
                    way.push(i);
                    seen[i as usize] = k;
                    i = parent[i as usize];
                }
                while let Some(i) = way.pop() {
                    top -= 1;
                    pattern[top] = i;
                }
            }
            let own = sums[k as usize];
            let mut pivot = own;
            sums[k as usize] = 0.0;
            for &i in &pattern[top..] {
                let i = i as usize;
                let sum = sums[i];
                sums[i] = 0.0;
                let range = self.starts[i]..next[i];
                for (row, value) in self.rows[range.clone()].iter().zip(&self.values[range]) {
                    sums[*row as usize] -= value * sum;
                }
                let entry = sum / self.diagonal[i];
                pivot -= entry * sum;
                self.rows[next[i]] = k;
                self.values[next[i]] = entry;
                next[i] += 1;
            }
            // What cancels down to rounding errors says nothing.
            let positive = pivot > 1e-14 * own;
            if !positive {
                return false;
            }
            self.diagonal[k as usize] = pivot;
        }
        true
    }

    /// Solves for three right-hand sides at once.
    pub(super) fn solve(&self, sides: &[DVec3]) -> Vec<DVec3> {
        let n = self.order.len();
        let mut x: Vec<DVec3> = self.order.iter().map(|&i| sides[i as usize]).collect();
        let column = |k: usize| {
            let range = self.starts[k]..self.starts[k + 1];
            self.rows[range.clone()].iter().zip(&self.values[range])
        };
        for k in 0..n {
            let solved = x[k];
            for (row, value) in column(k) {
                x[*row as usize] -= solved * *value;
            }
        }
        for k in (0..n).rev() {
            let mut sum = x[k] / self.diagonal[k];
            for (row, value) in column(k) {
                sum -= x[*row as usize] * *value;
            }
            x[k] = sum;
        }
        let mut out = vec![DVec3::ZERO; n];
        for (i, solved) in self.order.iter().zip(x) {
            out[*i as usize] = solved;
        }
        out
    }
}

/// Sets of this size are not halved any more.
const LEAF: usize = 24;

/// The order of elimination.
fn dissected(matrix: &Rows, points: &[DVec3]) -> Vec<u32> {
    let n = matrix.len();
    let mut set: Vec<u32> = (0..n as u32).collect();
    // In which part of the set being halved each is.
    let mut part = vec![0_u32; n];
    let mut parts = 0;
    // Separators fill the order from its end; so the larger part of a stack comes out in reverse.
    let mut ranges = vec![(0, n)];
    while let Some((start, end)) = ranges.pop() {
        if end - start <= LEAF {
            continue;
        }
        let here = &mut set[start..end];
        let at = |i: u32| points[i as usize];
        let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for &i in here.iter() {
            (lo, hi) = (lo.min(at(i)), hi.max(at(i)));
        }
        let extent = hi - lo;
        let axis = (0..3).fold(0, |best, k| if extent[k] > extent[best] { k } else { best });
        let half = here.len() / 2;
        here.select_nth_unstable_by(half, |&i, &j| at(i)[axis].total_cmp(&at(j)[axis]).then(i.cmp(&j)));
        parts += 1;
        for &i in &here[..half] {
            part[i as usize] = parts;
        }
        let mut upper: Vec<u32> = here[half..].to_vec();
        upper.sort_unstable();
        let (between, beyond): (Vec<u32>, Vec<u32>) =
            upper.into_iter().partition(|&i| matrix.row(i as usize).any(|(j, _)| part[j as usize] == parts));
        here[..half].sort_unstable();
        let middle = start + half + beyond.len();
        here[half..half + beyond.len()].copy_from_slice(&beyond);
        here[half + beyond.len()..].copy_from_slice(&between);
        // A set that is one dense block cannot be parted.
        if !beyond.is_empty() {
            ranges.push((start, start + half));
            ranges.push((start + half, middle));
        }
    }
    set
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid's Laplacian plus one, times its transpose: symmetric, positive definite, with wide rows.
    fn grid(side: usize) -> (Rows, Vec<DVec3>) {
        let mut rows = Rows::default();
        let mut points = Vec::new();
        for i in 0..side * side {
            let (x, y) = (i % side, i / side);
            points.push(DVec3::new(x as f64, y as f64, 0.0));
            let mut row = vec![(i as u32, 6.0)];
            for (there, j) in
                [(x > 0, i.wrapping_sub(1)), (x + 1 < side, i + 1), (y > 0, i.wrapping_sub(side)), (y + 1 < side, i + side)]
            {
                if there {
                    row.push((j as u32, -1.0 - i.min(j) as f64 / 4000.0));
                }
            }
            rows.push(row);
        }
        let n = rows.len();
        (rows.transposed(n).times(n, &rows, n), points)
    }

    #[test]
    fn what_is_solved_solves() {
        for side in [1, 2, 5, 13, 30] {
            let (matrix, points) = grid(side);
            let expected: Vec<DVec3> = points.iter().map(|p| DVec3::new(p.x - p.y, p.x * 0.3, p.y * p.y)).collect();
            let sides: Vec<DVec3> =
                (0..matrix.len()).map(|i| matrix.row(i).map(|(j, value)| expected[j as usize] * value).sum()).collect();
            let solved = Factor::new(&matrix, &points, usize::MAX).unwrap().solve(&sides);
            for (x, y) in solved.iter().zip(&expected) {
                assert!(x.distance(*y) < 1e-12 * (side * side * side) as f64, "{x} {y}");
            }
        }
    }

    #[test]
    fn what_is_not_definite_is_refused() {
        let mut rows = Rows::default();
        rows.push([(0, 1.0), (1, 2.0)]);
        rows.push([(0, 2.0), (1, 1.0)]);
        assert!(Factor::new(&rows, &[DVec3::ZERO, DVec3::X], usize::MAX).is_none());
    }

    #[test]
    fn dissection_keeps_the_factor_sparse() {
        let (matrix, points) = grid(40);
        let entries = Factor::new(&matrix, &points, usize::MAX).unwrap().values.len();
        assert!(entries < 1600 * 60, "{entries}");
        assert!(Factor::new(&matrix, &points, entries - 1).is_none());
    }
}
