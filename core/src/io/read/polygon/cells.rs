//! Corners by where they lie, to find those within a triangle.

use robust::Coord;

/// No corner.
pub(super) const NONE: u32 = u32::MAX;
/// Most cells.
const MOST: usize = 1 << 18;
/// How far a crossing of an edge and a row may be off, as a share of the coordinates: many times what `f64` rounds by.
const SLACK: f64 = 1e-12;

/// Columns and rows of about as many corners each, so that fine parts of a polygon have fine cells. Each cell begins a list.
pub(super) struct Cells {
    columns: Vec<f64>,
    rows: Vec<f64>,
    first: Vec<u32>,
    slack: f64,
}

impl Cells {
    /// For polygons with these corners, about `listed` of which will be in lists.
    pub(super) fn of(corners: &[Coord<f64>], listed: usize) -> Self {
        let cells = listed.clamp(1, MOST);
        let xs = |parts: usize| bounds(corners.iter().map(|corner| corner.x), parts);
        let ys = |parts: usize| bounds(corners.iter().map(|corner| corner.y), parts);
        let mut columns = xs(cells.isqrt());
        let rows = ys(cells / (columns.len() + 1));
        // Teeth of a comb end at few heights: the more columns there may be.
        if (rows.len() + 1) * (columns.len() + 1) * 2 < cells {
            columns = xs(cells / (rows.len() + 1));
        }
        let first = vec![NONE; (columns.len() + 1) * (rows.len() + 1)];
        let largest = corners.iter().fold(0.0, |largest: f64, corner| largest.max(corner.x.abs()));
        Self { columns, rows, first, slack: largest * SLACK }
    }

    fn column(&self, x: f64) -> usize {
        self.columns.partition_point(|bound| *bound <= x)
    }

    fn row(&self, y: f64) -> usize {
        self.rows.partition_point(|bound| *bound <= y)
    }

    /// The first corner in the list of this cell.
    pub(super) fn first(&mut self, cell: usize) -> &mut u32 {
        &mut self.first[cell]
    }

    /// The cell of a corner.
    pub(super) fn cell(&self, corner: Coord<f64>) -> usize {
        self.row(corner.y) * (self.columns.len() + 1) + self.column(corner.x)
    }

    /// The rows that a triangle lies in.
    pub(super) fn rows(&self, triangle: &[Coord<f64>; 3]) -> std::ops::RangeInclusive<usize> {
        let [a, b, c] = triangle.map(|corner| corner.y);
        self.row(a.min(b).min(c))..=self.row(a.max(b).max(c))
    }

    /// The cells of a row that a triangle lies in.
    pub(super) fn in_row(&self, row: usize, triangle: &[Coord<f64>; 3]) -> std::ops::Range<usize> {
        let low = row.checked_sub(1).and_then(|row| self.rows.get(row)).copied().unwrap_or(f64::NEG_INFINITY);
        let high = self.rows.get(row).copied().unwrap_or(f64::INFINITY);
        let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
        let [a, b, c] = *triangle;
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let (from, to) = if from.y <= to.y { (from, to) } else { (to, from) };
            if to.y < low || from.y > high {
                continue;
            }
            let at = |y: f64, end: Coord<f64>| {
                // An end within the row is taken as it is.
                if y == end.y { end.x } else { from.x + (to.x - from.x) * ((y - from.y) / (to.y - from.y)) }
            };
            let ends = [at(from.y.max(low), from), at(to.y.min(high), to)];
            left = left.min(ends[0]).min(ends[1]);
            right = right.max(ends[0]).max(ends[1]);
        }
        let begin = row * (self.columns.len() + 1);
        begin + self.column(left - self.slack)..begin + self.column(right + self.slack) + 1
    }
}

/// Bounds between so many parts of about as many values each.
fn bounds(values: impl Iterator<Item = f64>, parts: usize) -> Vec<f64> {
    if parts == 1 {
        return Vec::new();
    }
    let mut values: Vec<f64> = values.collect();
    values.sort_unstable_by(f64::total_cmp);
    let mut bounds: Vec<f64> = (1..parts).filter_map(|part| values.get(part * values.len() / parts)).copied().collect();
    bounds.dedup();
    bounds
}
