//! The grid of a part's upper side: rows of constant `v`, and as many columns in each row.

use super::case::Case;

/// Lines of the grid on each side of what the passes cover.
const MARGIN: usize = 6;

/// The grid's rows, and which of its places the passes cover.
pub(super) struct Lattice {
    /// `v` of each row, in millimetres.
    pub(super) rows: Vec<f64>,
    /// Vertices in a row.
    pub(super) columns: usize,
    /// Cells between the first pass and the last.
    across: usize,
    /// Cells between the passes' begin and their end.
    along: usize,
}

/// How far the lines of the margin stand from the outermost pass, in millimetres: the last one is still under the tool.
pub(super) fn margin(case: &Case) -> [f64; MARGIN] {
    let whole = 0.9 * case.cutter.radius;
    std::array::from_fn(|n| whole * (n + 1) as f64 / MARGIN as f64)
}

impl Lattice {
    /// The grid of a case. Its cells are about three times as long as wide.
    pub(super) fn of(case: &Case) -> Self {
        let cells = 2 * case.half();
        let long = case.step / cells as f64 * 3.0;
        let along = ((case.length / long).ceil() as usize).clamp(8, 400);
        let margin = margin(case);
        let before = margin.iter().rev().map(|m| -m);
        let within = (0..=along).map(|j| case.length * j as f64 / along as f64);
        let rows = before.chain(within).chain(margin.iter().map(|m| case.length + m)).collect();
        let across = case.strips() * cells;
        Self { rows, columns: 2 * MARGIN + across + 1, across, along }
    }

    /// Whether the cell in column `i` and row `j` lies within what the passes cover.
    pub(super) fn is_covered(&self, i: usize, j: usize) -> bool {
        (MARGIN..MARGIN + self.across).contains(&i) && (MARGIN..MARGIN + self.along).contains(&j)
    }

    /// Whether all four cells at the vertex in column `i` and row `j` do.
    pub(super) fn is_within(&self, i: usize, j: usize) -> bool {
        i > MARGIN && j > MARGIN && self.is_covered(i, j)
    }

    /// The vertex in column `i` and row `j`.
    pub(super) fn vertex(&self, i: usize, j: usize) -> u32 {
        (j * self.columns + i) as u32
    }

    /// The two triangles of each cell with the cell's column and row, row after row.
    pub(super) fn triangles(&self) -> impl Iterator<Item = ([usize; 2], [[u32; 3]; 2])> {
        (0..self.rows.len() - 1).flat_map(move |j| {
            (0..self.columns - 1).map(move |i| {
                let [a, b] = [self.vertex(i, j), self.vertex(i + 1, j)];
                let [c, d] = [self.vertex(i + 1, j + 1), self.vertex(i, j + 1)];
                ([i, j], [[a, b, c], [a, c, d]])
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::case::CASES;
    use super::*;

    #[test]
    fn covered_cells_lie_between_the_ends_of_the_passes() {
        for case in CASES {
            let lattice = Lattice::of(&case);
            assert!(lattice.rows.is_sorted(), "{}", case.name);
            let covered: Vec<usize> = (0..lattice.rows.len()).filter(|j| lattice.is_covered(MARGIN, *j)).collect();
            let ends = [covered[0], covered[covered.len() - 1] + 1].map(|j| lattice.rows[j]);
            assert_eq!(ends, [0.0, case.length], "{}", case.name);
            let across = (0..lattice.columns).filter(|i| lattice.is_covered(*i, MARGIN)).count();
            assert_eq!(across, 11 * case.cells, "{}", case.name);
        }
    }
}
