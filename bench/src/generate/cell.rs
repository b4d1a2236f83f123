//! One cell of the surface with the defect it was given, and what that defect adds to the counts.

use super::surface::{CELL, Point, Ring, Triangle, on_grid};
use crate::counts::Counts;

/// The quads of a cell that are meant.
pub(super) type Mask = [[bool; CELL]; CELL];

/// 16 × 16 quads. A defect keeps two vertices away from the border, so that the defects of neighbours never touch.
pub(super) struct Cell {
    pub(super) vertices: [[Point; CELL + 1]; CELL + 1],
    /// Row, column, half; `None`: left out.
    pub(super) triangles: [[[Option<Triangle>; 2]; CELL]; CELL],
    /// Written after the cell's own.
    pub(super) extra: Vec<Triangle>,
    /// The counts that the defect adds, except for the number of triangles.
    pub(super) counts: Counts,
}

impl Cell {
    pub(super) fn of(ring: &Ring, row: usize, column: usize) -> Box<Self> {
        let mut cell = Box::new(Self {
            vertices: [[[0.0; 3]; CELL + 1]; CELL + 1],
            triangles: [[[None; 2]; CELL]; CELL],
            extra: Vec::new(),
            counts: Counts::default(),
        });
        cell.move_to(ring, row, column);
        cell
    }

    /// Becomes another cell, sound again.
    pub(super) fn move_to(&mut self, ring: &Ring, row: usize, column: usize) {
        for (i, line) in self.vertices.iter_mut().enumerate() {
            for (j, vertex) in line.iter_mut().enumerate() {
                *vertex = ring.vertex(row * CELL + i, column * CELL + j);
            }
        }
        for (i, line) in self.triangles.iter_mut().enumerate() {
            for (j, quad) in line.iter_mut().enumerate() {
                *quad = Ring::CORNERS.map(|corners| Some(corners.map(|(di, dj)| self.vertices[i + di][j + dj])));
            }
        }
        self.extra.clear();
        self.counts = Counts::default();
    }

    pub(super) fn written(&self) -> impl Iterator<Item = &Triangle> {
        self.triangles.iter().flatten().flatten().flatten().chain(&self.extra)
    }

    pub(super) fn count(&self) -> u64 {
        self.written().count() as u64
    }

    /// Leaves out the quads of a mask; the new boundary edges are counted, the loops are not.
    pub(super) fn cut(&mut self, mask: &Mask) {
        for (quads, line) in self.triangles.iter_mut().zip(mask) {
            for (quad, _) in quads.iter_mut().zip(line).filter(|(_, cut)| **cut) {
                *quad = [None; 2];
            }
        }
        self.open_edges(perimeter(mask));
    }

    /// Counts boundary edges, which no edge balances.
    pub(super) fn open_edges(&mut self, edges: u64) {
        self.counts.boundary_edges += edges;
        self.counts.unbalanced_edges += edges;
    }

    /// The step of length one row that stands upright on the surface, outwards, at an inner vertex.
    pub(super) fn upright(&self, i: usize, j: usize) -> [f64; 3] {
        let v = &self.vertices;
        let (along, across) = (minus(v[i + 1][j], v[i - 1][j]), minus(v[i][j + 1], v[i][j - 1]));
        let normal = cross(along, across);
        let step = minus(v[i + 1][j], v[i][j]);
        scaled(normal, (dot(step, step) / dot(normal, normal)).sqrt())
    }
}

/// How many quad sides separate a mask from the rest of the cell; the mask keeps away from the cell's border.
pub(super) fn perimeter(mask: &Mask) -> u64 {
    let rows = mask.windows(2).map(|pair| (0..CELL).filter(|&j| pair[0][j] != pair[1][j]).count());
    let columns = mask.iter().map(|line| line.windows(2).filter(|pair| pair[0] != pair[1]).count());
    rows.chain(columns).sum::<usize>() as u64
}

pub(super) fn minus(a: Point, b: Point) -> [f64; 3] {
    std::array::from_fn(|k| f64::from(a[k]) - f64::from(b[k]))
}

pub(super) fn scaled(a: [f64; 3], s: f64) -> [f64; 3] {
    a.map(|x| x * s)
}

/// `a` moved by `step`, on the grid of coordinates.
pub(super) fn plus(a: Point, step: [f64; 3]) -> Point {
    std::array::from_fn(|k| on_grid(f64::from(a[k]) + step[k]))
}

/// The midpoint, exact: coordinates are multiples of 2⁻¹⁵.
pub(super) fn middle(a: Point, b: Point) -> Point {
    std::array::from_fn(|k| ((f64::from(a[k]) + f64::from(b[k])) / 2.0) as f32)
}

pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
