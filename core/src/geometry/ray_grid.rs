//! Upright rays by their place seen from above, in a grid of cells: which of them may meet a triangle.

/// Rays in cells, which are looked up by boxes.
pub(crate) struct RayGrid {
    lo: [f64; 2],
    per_unit: [f64; 2],
    side: usize,
    /// Rays by cell, and where each cell's begin.
    starts: Vec<u32>,
    order: Vec<u32>,
}

impl RayGrid {
    /// Rays from these points. Along a side there are `times` as many cells as the root of the number of rays, and `most` of them at most.
    pub(crate) fn new(points: impl ExactSizeIterator<Item = [f64; 3]> + Clone, times: usize, most: usize) -> Self {
        let side = ((points.len() as f64).sqrt() as usize * times).clamp(1, most);
        let (mut lo, mut hi) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in points.clone() {
            for k in 0..2 {
                lo[k] = lo[k].min(p[k]);
                hi[k] = hi[k].max(p[k]);
            }
        }
        let per_unit = std::array::from_fn(|k| if hi[k] > lo[k] { side as f64 / (hi[k] - lo[k]) } else { 0.0 });
        let mut grid = Self { lo, per_unit, side, starts: vec![0; side * side + 1], order: Vec::new() };
        let cells: Vec<usize> = points.map(|p| grid.cell(1, p[1]) * side + grid.cell(0, p[0])).collect();
        cells.iter().for_each(|c| grid.starts[c + 1] += 1);
        (0..side * side).for_each(|c| grid.starts[c + 1] += grid.starts[c]);
        grid.order = (0..cells.len() as u32).collect();
        grid.order.sort_by_key(|r| cells[*r as usize]);
        grid
    }

    /// Monotonous, so that a ray in a box is in one of the cells between those of its ends.
    #[inline]
    fn cell(&self, axis: usize, x: f64) -> usize {
        (((x - self.lo[axis]) * self.per_unit[axis]) as usize).min(self.side - 1)
    }

    /// The rays in the cells under the box of three corners, row by row.
    #[inline]
    pub(crate) fn under<T: Copy + Into<f64>>(&self, corners: &[[T; 3]; 3]) -> impl Iterator<Item = &[u32]> + use<'_, T> {
        let span = |k: usize| {
            let x: [f64; 3] = [corners[0][k].into(), corners[1][k].into(), corners[2][k].into()];
            (self.cell(k, x[0].min(x[1]).min(x[2])), self.cell(k, x[0].max(x[1]).max(x[2])))
        };
        let ((x0, x1), (y0, y1)) = (span(0), span(1));
        (y0..=y1).map(move |row| {
            let row = row * self.side;
            &self.order[self.starts[row + x0] as usize..self.starts[row + x1 + 1] as usize]
        })
    }

    /// Is there a ray in the cells under the triangle? Asked of every triangle, so one cell is the case to be fast in.
    #[inline]
    pub(crate) fn may_meet(&self, corners: &[[f32; 3]; 3]) -> bool {
        let cell = |k: usize, x: f32| self.cell(k, f64::from(x));
        let low = |k: usize| corners[0][k].min(corners[1][k]).min(corners[2][k]);
        let high = |k: usize| corners[0][k].max(corners[1][k]).max(corners[2][k]);
        let (x0, x1, y0, y1) = (cell(0, low(0)), cell(0, high(0)), cell(1, low(1)), cell(1, high(1)));
        (y0..=y1).any(|row| self.starts[row * self.side + x0] != self.starts[row * self.side + x1 + 1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rays from the corners of unit squares, four by four, and a triangle in a box of side 2.5.
    #[test]
    fn no_ray_under_a_triangle_is_missed_and_most_others_are_not_looked_at() {
        let points: Vec<[f64; 3]> = (0..16).map(|i| [f64::from(i % 4), f64::from(i / 4), 9.0]).collect();
        for (times, most) in [(1, 1), (4, 512), (8, 1024)] {
            let grid = RayGrid::new(points.iter().copied(), times, most);
            let looked_at = |by: f32| -> Vec<u32> {
                let corners = [[by, 0.0, 0.0], [2.5 + by, 0.0, 0.0], [by, 2.5, 0.0]];
                let mut found = grid.under(&corners).flatten().copied().collect::<Vec<u32>>();
                assert_eq!(grid.may_meet(&corners), !found.is_empty(), "{times}");
                found.sort_unstable();
                found
            };
            let in_box = [0, 1, 2, 4, 5, 6, 8, 9, 10];
            let found = looked_at(0.0);
            assert!(in_box.iter().all(|ray| found.contains(ray)), "{times}: {found:?}");
            if times > 1 {
                assert_eq!(found, in_box);
                assert_eq!(looked_at(0.5), [1, 2, 3, 5, 6, 7, 9, 10, 11]);
            }
        }
        let none = RayGrid::new(std::iter::empty(), 8, 1024);
        assert_eq!(none.under(&[[0.0_f32; 3]; 3]).flatten().count(), 0);
    }
}
