//! The sound surface: a bumpy ring (torus) as a grid of quads that closes in both directions, so that every vertex has six
//! triangles and every place is as good as any other for a defect.
//!
//! Coordinates are whole multiples of 2⁻¹⁵ and below 64 in size, so that the midpoint of any edge is exact in f32: what is meant
//! to be collinear is exactly collinear.

use super::noise::{noise, turn};

/// A position in millimetres.
pub(super) type Point = [f32; 3];
/// Three corners, counter-clockwise seen from outside.
pub(super) type Triangle = [Point; 3];

/// Quads along a cell's side.
pub(super) const CELL: usize = 16;
/// Triangles of a sound cell.
pub(super) const CELL_TRIANGLES: u64 = (CELL * CELL * 2) as u64;

const RADIUS: f64 = 35.0;
const TUBE: f64 = 14.0;
const GRAIN: f64 = 32_768.0;

/// A ring of `cell_rows` × `cell_columns` cells.
pub(super) struct Ring {
    pub(super) cell_rows: usize,
    pub(super) cell_columns: usize,
    rows: usize,
    columns: usize,
    seed: u64,
    around: Vec<(f64, f64)>,
    across: Vec<(f64, f64)>,
    shift: f64,
    grain: f64,
}

impl Ring {
    /// A ring of about `triangles` triangles, at least one cell, moved by `shift` along x.
    pub(super) fn new(triangles: u64, seed: u64, shift: f64) -> Self {
        let cells = (triangles as f64 / CELL_TRIANGLES as f64).max(1.0);
        let cell_columns = ((cells * TUBE / RADIUS).sqrt().round()).max(1.0);
        let cell_rows = (cells / cell_columns).round().max(1.0) as usize;
        let cell_columns = cell_columns as usize;
        let (rows, columns) = (cell_rows * CELL, cell_columns * CELL);
        Self {
            cell_rows,
            cell_columns,
            rows,
            columns,
            seed,
            around: (0..rows as u64).map(|i| turn(i, rows as u64)).collect(),
            across: (0..columns as u64).map(|j| turn(j, columns as u64)).collect(),
            shift,
            // Roughness: a share of the distance between rows, small enough that the surface never meets itself.
            grain: 0.1 * TUBE / (rows.max(columns) as f64),
        }
    }

    pub(super) fn cells(&self) -> u64 {
        (self.cell_rows * self.cell_columns) as u64
    }

    pub(super) fn triangles(&self) -> u64 {
        self.cells() * CELL_TRIANGLES
    }

    /// About the length of an edge.
    pub(super) fn spacing(&self) -> f64 {
        std::f64::consts::TAU * TUBE / self.columns.max(self.rows) as f64
    }

    /// The vertex in row `i` and column `j`, both taken around.
    pub(super) fn vertex(&self, i: usize, j: usize) -> Point {
        let (i, j) = (i % self.rows, j % self.columns);
        let (around, across) = (self.around[i], self.across[j]);
        let bumps = 0.06 * self.around[5 * i % self.rows].1 * self.across[3 * j % self.columns].0
            + 0.04 * self.around[13 * i % self.rows].0 * self.across[2 * j % self.columns].1;
        let tube = TUBE * (1.0 + bumps) + self.grain * noise(self.seed, (i * self.columns + j) as u64);
        let reach = RADIUS + tube * across.0;
        [on_grid(self.shift + reach * around.0), on_grid(reach * around.1), on_grid(tube * across.1)]
    }

    /// Corner `c` of triangle `half` of a quad, as steps in row and column: the quad is cut from its first to its last vertex.
    pub(super) const CORNERS: [[(usize, usize); 3]; 2] = [[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]];

    /// Row, column and half of triangle `index` of the whole ring, in file order.
    pub(super) fn locate(&self, index: u64) -> (usize, usize, usize) {
        let (cell, inside) = (index / CELL_TRIANGLES, (index % CELL_TRIANGLES) as usize);
        let (row, column) = ((cell / self.cell_columns as u64) as usize, (cell % self.cell_columns as u64) as usize);
        (row * CELL + inside / (2 * CELL), column * CELL + inside / 2 % CELL, inside % 2)
    }
}

/// The nearest multiple of 2⁻¹⁵.
pub(super) fn on_grid(x: f64) -> f32 {
    ((x * GRAIN).round() / GRAIN) as f32
}
