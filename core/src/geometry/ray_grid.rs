//! Upright rays by their place seen from above, in a grid of cells: which of them may meet a triangle.

/// Rays in cells, which are looked up by boxes.
pub(crate) struct RayGrid {
    lo: [f64; 2],
    per_unit: [f64; 2],
    side: usize,
    /// Rays by cell, and where each cell's begin.
    starts: Vec<u32>,
    order: Vec<u32>,
    /// A bit for each cell, rows of whole words: is a ray in it? Small enough for the caches, where `starts` is not.
    taken: Vec<u64>,
}

/// A point's coordinates with those along an axis as the last ones: that axis is upright then.
#[inline(always)]
pub(crate) fn upright<T: Copy>(axis: usize, p: [T; 3]) -> [T; 3] {
    match axis {
        0 => [p[1], p[2], p[0]],
        1 => [p[2], p[0], p[1]],
        _ => p,
    }
}

/// A box as seen from above: the smaller and the larger of x, and of y.
pub(crate) type Flat = [[f64; 2]; 2];

/// The box of three corners, seen from above.
#[inline(always)]
pub(crate) fn flat<T: Copy + Into<f64>>([a, b, c]: &[[T; 3]; 3]) -> Flat {
    let span = |a: f64, b: f64, c: f64| [a.min(b).min(c), a.max(b).max(c)];
    [span(a[0].into(), b[0].into(), c[0].into()), span(a[1].into(), b[1].into(), c[1].into())]
}

/// Words of a row of so many bits.
#[inline(always)]
fn words(side: usize) -> usize {
    side.div_ceil(64)
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
        let words = words(side);
        let taken = vec![0; side * words];
        let mut grid = Self { lo, per_unit, side, starts: vec![0; side * side + 1], order: Vec::new(), taken };
        let cells: Vec<usize> = points.map(|p| grid.cell(1, p[1]) * side + grid.cell(0, p[0])).collect();
        for cell in &cells {
            grid.starts[cell + 1] += 1;
            grid.taken[cell / side * words + cell % side / 64] |= 1 << (cell % side % 64);
        }
        (0..side * side).for_each(|c| grid.starts[c + 1] += grid.starts[c]);
        grid.order = (0..cells.len() as u32).collect();
        grid.order.sort_by_key(|r| cells[*r as usize]);
        grid
    }

    /// Monotonous, so that a ray in a box is in one of the cells between those of its ends.
    #[inline(always)]
    fn cell(&self, axis: usize, x: f64) -> usize {
        // Through i32, which processors have an instruction for.
        ((x - self.lo[axis]) * self.per_unit[axis]).clamp(0.0, (self.side - 1) as f64) as i32 as usize
    }

    /// The rays in the order of their cells, in which those under a box lie side by side.
    pub(crate) fn order(&self) -> &[u32] {
        &self.order
    }

    /// The rays in the cells under a box, row by row: their places in the order.
    #[inline(always)]
    pub(crate) fn places_under(&self, [x, y]: Flat) -> impl Iterator<Item = usize> + use<'_> {
        let (x0, x1) = (self.cell(0, x[0]), self.cell(0, x[1]));
        (self.cell(1, y[0])..=self.cell(1, y[1])).flat_map(move |row| {
            let row = row * self.side;
            self.starts[row + x0] as usize..self.starts[row + x1 + 1] as usize
        })
    }

    /// The rays in the cells under a box.
    pub(crate) fn under(&self, of: Flat) -> impl Iterator<Item = usize> + use<'_> {
        self.places_under(of).map(|place| self.order[place] as usize)
    }

    /// Is there a ray in the cells under a box? Asked of every triangle, so a few cells in one word are the case to be fast in.
    #[inline(always)]
    pub(crate) fn may_meet(&self, [x, y]: Flat) -> bool {
        let (x0, x1) = (self.cell(0, x[0]), self.cell(0, x[1]));
        let (first, last) = (!0u64 << (x0 % 64), !0u64 >> (63 - x1 % 64));
        let words = words(self.side);
        (self.cell(1, y[0])..=self.cell(1, y[1])).any(|row| match &self.taken[row * words + x0 / 64..=row * words + x1 / 64] {
            [word] => word & first & last != 0,
            [start, between @ .., end] => start & first | end & last != 0 || between.iter().any(|word| *word != 0),
            [] => false,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Rays from the corners of unit squares, four by four, and a triangle in a box of side 2.5.
    #[test]
    fn no_ray_under_a_triangle_is_missed_and_most_others_are_not_looked_at() {
        let points: Vec<[f64; 3]> = (0..16).map(|i| [f64::from(i % 4), f64::from(i / 4), 9.0]).collect();
        for (times, most) in [(1, 1), (4, 512), (8, 1024)] {
            let grid = RayGrid::new(points.iter().copied(), times, most);
            let looked_at = |by: f32| -> Vec<usize> {
                let corners = flat(&[[by, 0.0, 0.0], [2.5 + by, 0.0, 0.0], [by, 2.5, 0.0]]);
                let mut found = grid.under(corners).collect::<Vec<usize>>();
                assert_eq!(grid.may_meet(corners), !found.is_empty(), "{times}");
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
        assert_eq!(none.under([[0.0; 2]; 2]).count(), 0);
        assert!(!none.may_meet([[0.0; 2]; 2]));
    }

    proptest! {
        /// In grids of rows of several words, too.
        #[test]
        fn the_bits_say_what_the_cells_hold(
            points in prop::collection::vec(prop::array::uniform3(0.0f64..9.0), 1..40),
            boxes in prop::collection::vec(prop::array::uniform4(-1.0f64..10.0), 1..40),
            times in 1usize..64,
        ) {
            let grid = RayGrid::new(points.iter().copied(), times, 1024);
            for [a, b, c, d] in boxes {
                let of = [[a.min(b), a.max(b)], [c.min(d), c.max(d)]];
                let found: Vec<usize> = grid.under(of).collect();
                prop_assert_eq!(grid.may_meet(of), !found.is_empty());
                let is_in = |p: &[f64; 3]| (0..2).all(|k| of[k][0] <= p[k] && p[k] <= of[k][1]);
                prop_assert!((0..).zip(&points).filter(|(_, p)| is_in(p)).all(|(ray, _)| found.contains(&ray)));
            }
        }
    }
}
