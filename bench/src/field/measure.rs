//! How high the crests between passes along X are, on any mesh that has one height over each place.

use super::path::Move;
use crate::space::{Vector, wide};

/// Places where a crest may be: halfway between the middle ones of four neighbouring passes along X.
#[derive(Clone, Debug)]
pub struct Crests {
    /// X, and Y of the four passes.
    places: Vec<(f64, [f64; 4])>,
}

/// Heights of a mesh at these places: how far each crest stands over the middle between the passes beside it.
#[derive(Clone, Debug, PartialEq)]
pub struct Heights {
    /// For each place; none where the mesh has no height, or a wall is.
    pub at: Vec<Option<f64>>,
    /// For each place, whether the four passes lie on a slope that hardly bends, so that the form adds nothing to the crest.
    pub is_even: Vec<bool>,
}

/// Passes that differ by less are one, in millimetres.
const SAME: f64 = 1e-4;
/// Passes of which one is higher than the other by more than this part of the way between them have a wall there, which no crest stands on.
const STEEP: f64 = 0.36;
/// Second differences of the heights of passes on a slope that hardly bends, in millimetres: the form is an eighth of that at a crest.
const BENT: f64 = 0.004;

impl Crests {
    /// Within a rectangle, so far apart along X. Passes are those Y at which moves go along X alone.
    pub fn of(moves: &[Move], [low, high]: [[f64; 2]; 2], every: f64) -> Self {
        let level = |one: &&Move| one.is_cut && one.from[1] == one.to[1] && one.from[0] != one.to[0];
        let mut passes: Vec<f64> = moves.iter().filter(level).map(|one| one.from[1]).collect();
        passes.sort_unstable_by(f64::total_cmp);
        passes.dedup_by(|a, b| *a - *b < SAME);
        let count = ((high[0] - low[0]) / every).floor().max(0.0) as usize;
        let mut places = Vec::new();
        for four in passes.array_windows::<4>().filter(|four| four[0] > low[1] && four[3] < high[1]) {
            // A little beside edges of the grid, where a height is that of two triangles.
            let x = |n: usize| low[0] + (n as f64 + 0.37) * every;
            places.extend((0..count).map(|n| (x(n), *four)));
        }
        Self { places }
    }

    /// The heights of crests on a mesh. O(triangles + places).
    pub fn on(&self, triangles: &[[[f32; 3]; 3]]) -> Heights {
        let grid = Grid::of(triangles);
        let height = |x: f64, y: f64| grid.height(triangles, [x, y]);
        let at = |(x, [_, before, behind, _]): &(f64, [f64; 4])| {
            let [low, high] = [height(*x, *before)?, height(*x, *behind)?];
            let is_wall = (low - high).abs() > STEEP * (behind - before);
            if is_wall { None } else { Some(height(*x, 0.5 * (before + behind))? - 0.5 * (low + high)) }
        };
        let is_even = |(x, passes): &(f64, [f64; 4])| {
            let [a, b, c, d] = passes.map(|y| height(*x, y).unwrap_or(f64::NAN));
            (a - 2.0 * b + c).abs() < BENT && (b - 2.0 * c + d).abs() < BENT
        };
        Heights { at: self.places.iter().map(at).collect(), is_even: self.places.iter().map(is_even).collect() }
    }
}

impl Heights {
    /// The values of which these parts lie below, at places that are even on a mesh before; and how many these are.
    pub fn shares(&self, before: &Self, parts: [f64; 3]) -> ([f64; 3], usize) {
        let even =
            self.at.iter().zip(&before.at).zip(&before.is_even).filter(|((_, before), is_even)| before.is_some() && **is_even);
        let mut values: Vec<f64> = even.filter_map(|((own, _), _)| *own).collect();
        values.sort_unstable_by(f64::total_cmp);
        let at = |part: f64| values.get((values.len() as f64 * part) as usize).or(values.last()).copied().unwrap_or(f64::NAN);
        (parts.map(at), values.len())
    }
}

/// Triangles by squares of the ground that they lie over.
struct Grid {
    low: [f64; 2],
    cell: f64,
    columns: usize,
    rows: usize,
    lists: Vec<Vec<u32>>,
}

impl Grid {
    fn of(triangles: &[[[f32; 3]; 3]]) -> Self {
        let axis = |axis: usize| triangles.iter().flatten().map(move |p| f64::from(p[axis]));
        let low = [0, 1].map(|k| axis(k).fold(f64::INFINITY, f64::min));
        let high = [0, 1].map(|k| axis(k).fold(f64::NEG_INFINITY, f64::max));
        let area = (high[0] - low[0]) * (high[1] - low[1]);
        let cell = (2.0 * area / triangles.len().max(1) as f64).sqrt().max(1e-6);
        let count = |k: usize| ((high[k] - low[k]) / cell).max(0.0) as usize + 1;
        let (columns, rows) = (count(0), count(1));
        let mut grid = Self { low, cell, columns, rows, lists: vec![Vec::new(); columns * rows] };
        for (number, corners) in triangles.iter().enumerate() {
            let [a, b, c] = corners.map(wide);
            let span = |k: usize| (a[k].min(b[k]).min(c[k]), a[k].max(b[k]).max(c[k]));
            // Sides and the bottom are not seen from above.
            if (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) <= 0.0 {
                continue;
            }
            let [(x0, x1), (y0, y1)] = [span(0), span(1)];
            for row in grid.place(y0, 1)..=grid.place(y1, 1) {
                for column in grid.place(x0, 0)..=grid.place(x1, 0) {
                    grid.lists[row * grid.columns + column].push(number as u32);
                }
            }
        }
        grid
    }

    fn place(&self, value: f64, axis: usize) -> usize {
        let most = if axis == 0 { self.columns } else { self.rows } - 1;
        (((value - self.low[axis]) / self.cell).max(0.0) as usize).min(most)
    }

    /// The greatest height over a place.
    fn height(&self, triangles: &[[[f32; 3]; 3]], [x, y]: [f64; 2]) -> Option<f64> {
        let list = self.lists.get(self.place(y, 1) * self.columns + self.place(x, 0))?;
        let over = |number: &u32| over(triangles.get(*number as usize)?.map(wide), [x, y]);
        list.iter().filter_map(over).max_by(f64::total_cmp)
    }
}

/// The height of a triangle over a place, if it is there.
fn over([a, b, c]: [Vector; 3], [x, y]: [f64; 2]) -> Option<f64> {
    let side = |p: Vector, q: Vector| (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]);
    let parts = [side(b, c), side(c, a), side(a, b)];
    let sum: f64 = parts.iter().sum();
    let least = parts.iter().copied().fold(f64::INFINITY, f64::min);
    (sum > 0.0 && least >= -1e-9 * sum).then(|| (parts[0] * a[2] + parts[1] * b[2] + parts[2] * c[2]) / sum)
}

#[cfg(test)]
mod tests {
    use super::super::heights::{Field, Stock};
    use super::*;

    fn bend([x, y, z]: Vector) -> Vector {
        [x, y, z - 0.05 * (y - 1.5) * (y - 1.5)]
    }

    /// Passes of a ball of radius 1, half a millimetre apart, leave crests of 1 − √(1 − 1/16); where only the stock's top is, there is none.
    #[test]
    fn crests_have_the_height_that_the_tool_leaves() {
        let pass = |k: i32| {
            let y = 0.5 * f64::from(k);
            Move { from: [-1.0, y, -1.0], to: [5.0, y, -1.0], is_cut: true }
        };
        let moves: Vec<Move> = (0..=6).map(pass).collect();
        let stock = Stock { low: [0.0, 0.0, -3.0], high: [4.0, 3.0, 0.0] };
        let field = Field::cut(stock, 0.125, 1.0, &moves).triangles();
        let crests = Crests::of(&moves, [[0.0, -0.1], [4.0, 3.1]], 0.5);
        let heights = crests.on(&field);
        let ([low, middle, high], count) = heights.shares(&heights, [0.0, 0.5, 1.0]);
        let exact = 1.0 - (1.0f64 - 1.0 / 16.0).sqrt();
        // Of seven passes, the middle ones of each four have four gaps; eight places in each.
        assert_eq!(count, 4 * 8);
        assert!(
            (low - exact).abs() < 1e-6 && (middle - exact).abs() < 1e-6 && (high - exact).abs() < 1e-6,
            "{low} {middle} {high}"
        );
        let flat = Crests::of(&moves, [[0.0, -0.1], [4.0, 3.1]], 0.5).on(&Field::cut(stock, 0.125, 1.0, &[]).triangles());
        assert_eq!(flat.shares(&heights, [0.0, 0.5, 1.0]), ([0.0; 3], 32));
        // A hill under the passes bends the slope: nothing is even there.
        let bent: Vec<Move> = moves.iter().map(|one| Move { from: bend(one.from), to: bend(one.to), ..*one }).collect();
        let hill = Crests::of(&bent, [[0.0, -0.1], [4.0, 3.1]], 0.5).on(&Field::cut(stock, 0.125, 1.0, &bent).triangles());
        assert!(hill.is_even.iter().all(|is_even| !is_even));
    }
}
