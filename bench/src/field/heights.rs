//! The height of what is left over each place of a grid.

use super::path::Move;
use crate::space::Vector;

/// The block that is cut, by its least and greatest corners, in millimetres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stock {
    /// Least corner.
    pub low: Vector,
    /// Greatest corner.
    pub high: Vector,
}

/// Heights over a grid whose places are a cell apart.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    origin: [f64; 2],
    cell: f64,
    bottom: f64,
    columns: usize,
    rows: usize,
    /// Row by row.
    heights: Vec<f64>,
}

impl Field {
    /// Simulates a ball-nosed tool of this radius. The grid begins at the stock's least corner, and has whole cells only. Linear in the places that moves
    /// pass.
    pub fn cut(stock: Stock, cell: f64, radius: f64, moves: &[Move]) -> Self {
        let count = |axis: usize| ((stock.high[axis] - stock.low[axis]) / cell + 1e-9).floor().max(1.0) as usize + 1;
        let (columns, rows) = (count(0), count(1));
        let origin = [stock.low[0], stock.low[1]];
        let mut field = Self { origin, cell, bottom: stock.low[2], columns, rows, heights: vec![stock.high[2]; columns * rows] };
        for one in moves.iter().filter(|one| one.is_cut) {
            field.pass(radius, one);
        }
        field
    }

    /// Takes away what one move cuts.
    fn pass(&mut self, radius: f64, one: &Move) {
        let range = |axis: usize, count: usize| {
            let (low, high) = (one.from[axis].min(one.to[axis]) - radius, one.from[axis].max(one.to[axis]) + radius);
            let first = ((low - self.origin[axis]) / self.cell).ceil().max(0.0) as usize;
            let last = ((high - self.origin[axis]) / self.cell).floor();
            first..if last < 0.0 { 0 } else { (last as usize + 1).min(count) }
        };
        let (across, along) = (range(0, self.columns), range(1, self.rows));
        for row in along {
            for column in across.clone() {
                let place = [self.origin[0] + self.cell * column as f64, self.origin[1] + self.cell * row as f64];
                let height = under(radius, one, place);
                let stands = &mut self.heights[row * self.columns + column];
                *stands = stands.min(height.max(self.bottom));
            }
        }
    }

    /// The part as a closed mesh: the field, sides, and a bottom at the stock's own.
    pub fn triangles(&self) -> Vec<[[f32; 3]; 3]> {
        let top = |column: usize, row: usize| {
            let [x, y] = [self.origin[0] + self.cell * column as f64, self.origin[1] + self.cell * row as f64];
            [x, y, self.heights[row * self.columns + column]].map(|x| x as f32)
        };
        let mut all = Vec::with_capacity(2 * self.columns * self.rows);
        for row in 0..self.rows - 1 {
            for column in 0..self.columns - 1 {
                let [a, b] = [top(column, row), top(column + 1, row)];
                let [c, d] = [top(column + 1, row + 1), top(column, row + 1)];
                all.extend([[a, b, c], [a, c, d]]);
            }
        }
        let (right, back) = (self.columns - 1, self.rows - 1);
        let ring = (0..right).map(|i| top(i, 0)).chain((0..back).map(|j| top(right, j)));
        let ring: Vec<[f32; 3]> =
            ring.chain((0..right).map(|i| top(right - i, back))).chain((0..back).map(|j| top(0, back - j))).collect();
        // A thousandth of the cell lower: a place that is cut down to the bottom has a side, too.
        let level = (self.bottom - 1e-3 * self.cell) as f32;
        let foot = |[x, y, _]: [f32; 3]| [x, y, level];
        let low = foot(top(0, 0));
        let high = foot(top(right, back));
        let middle = [0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), level];
        for (n, here) in ring.iter().enumerate() {
            let next = ring[(n + 1) % ring.len()];
            all.extend([[foot(*here), foot(next), next], [foot(*here), next, *here], [foot(next), foot(*here), middle]]);
        }
        all
    }
}

/// The lowest height of a ball over a place while it makes a move; infinite where it does not come.
///
/// With the place u beside the ball's middle along the move, and R² what is left of r² across it, the height is m·u − √(R² − u²) more than that of the middle
/// beside the place, m being the slope of the move: convex in u, and least at −m·R / √(1 + m²).
fn under(radius: f64, one: &Move, place: [f64; 2]) -> f64 {
    let way = [one.to[0] - one.from[0], one.to[1] - one.from[1]];
    let off = [place[0] - one.from[0], place[1] - one.from[1]];
    let (long, rise) = (way[0].hypot(way[1]), one.to[2] - one.from[2]);
    let middle = one.from[2] + radius;
    if long == 0.0 {
        let left = radius * radius - off[0] * off[0] - off[1] * off[1];
        return if left < 0.0 { f64::INFINITY } else { middle + rise.min(0.0) - left.sqrt() };
    }
    let beside = (off[0] * way[0] + off[1] * way[1]) / long;
    let across = (off[1] * way[0] - off[0] * way[1]) / long;
    let left = radius * radius - across * across;
    if left < 0.0 {
        return f64::INFINITY;
    }
    let slope = rise / long;
    let best = -slope * (left / (1.0 + slope * slope)).sqrt();
    let u = best.clamp(-beside, long - beside);
    let depth = left - u * u;
    if depth < 0.0 { f64::INFINITY } else { middle + slope * (beside + u) - depth.sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(from: Vector, to: Vector) -> Move {
        Move { from, to, is_cut: true }
    }

    /// Against the least over many places of the ball on its way.
    #[test]
    fn heights_are_the_least_of_all_balls_on_the_way() {
        for (from, to) in
            [([0.0, 0.0, 0.0], [4.0, 0.0, 0.0]), ([0.0, 1.0, 2.0], [3.0, -1.0, -1.0]), ([1.0, 1.0, 0.5], [1.0, 1.0, -2.0])]
        {
            let one = cut(from, to);
            for n in 0..400 {
                let place = [f64::from(n % 20) * 0.4 - 2.0, f64::from(n / 20) * 0.3 - 3.0];
                let sampled = (0..=20_000).map(|k| f64::from(k) / 20_000.0).map(|t| {
                    let tip = [0, 1, 2].map(|axis| from[axis] + t * (to[axis] - from[axis]));
                    let left = 1.0 - (place[0] - tip[0]).powi(2) - (place[1] - tip[1]).powi(2);
                    if left < 0.0 { f64::INFINITY } else { tip[2] + 1.0 - left.sqrt() }
                });
                let (least, found) = (sampled.fold(f64::INFINITY, f64::min), under(1.0, &one, place));
                // At the rim of the ball the height is steep: samples miss up to a part of it, and a rounding of 1e-16 is one of 1e-8 under the root.
                assert!(found <= least + 1e-7, "{place:?}: {found} {least}");
                assert!(least - found < 0.02 || least.is_infinite(), "{place:?}: {found} {least}");
            }
        }
    }

    #[test]
    fn a_field_is_a_closed_solid_of_its_volume() {
        let stock = Stock { low: [0.0, 0.0, -2.0], high: [4.0, 3.0, 0.0] };
        let field = Field::cut(stock, 0.5, 1.0, &[cut([-2.0, 1.5, -0.5], [6.0, 1.5, -0.5])]);
        let all = field.triangles();
        let bits = |p: [f32; 3]| p.map(|x| (x + 0.0).to_bits());
        let edges: std::collections::BTreeSet<_> =
            all.iter().flat_map(|t| [(0, 1), (1, 2), (2, 0)].map(|(a, b)| (bits(t[a]), bits(t[b])))).collect();
        assert_eq!(edges.len(), 3 * all.len());
        assert!(edges.iter().all(|(a, b)| edges.contains(&(*b, *a))));
        let volume: f64 = all
            .iter()
            .map(|t| t.map(crate::space::wide))
            .map(|[a, b, c]| crate::space::dot(a, crate::space::cross(b, c)) / 6.0)
            .sum();
        // Across the groove, heights at 1.0, 1.5 and 2.0 are 0.5 − √(1 − 0.25), −0.5, and the first again; elsewhere nothing is cut.
        let groove = 0.5 * (2.0 * (0.75f64.sqrt() - 0.5) + 0.5);
        let expected = 4.0 * (3.0 * 2.0 - groove);
        assert!((volume - expected).abs() < 0.01, "{volume} {expected}");
    }

    #[test]
    fn rapid_moves_cut_nothing() {
        let stock = Stock { low: [0.0; 3], high: [2.0, 2.0, 1.0] };
        let rapid = Move { is_cut: false, ..cut([0.0; 3], [2.0, 2.0, 0.0]) };
        assert_eq!(Field::cut(stock, 0.5, 1.0, &[rapid]), Field::cut(stock, 0.5, 1.0, &[]));
    }
}
