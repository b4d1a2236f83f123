//! Arrangements: points, pieces and cells.

use crate::geometry::exact;

/// A part of a triangle, or all of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Piece {
    /// The first of the triangles that it is part of.
    pub(crate) source: u32,
    /// Points of the arrangement, the way round that the source runs.
    pub(crate) v: [u32; 3],
    /// Triangles that it is part of and that run as it does, less those that run the other way: by so much the winding number behind it
    /// is larger than the one in front.
    pub(crate) step: i32,
    /// The cells in front of it and behind.
    pub(crate) cells: [u32; 2],
}

/// Triangles cut along all their intersections.
#[derive(Clone, Debug, Default)]
pub(crate) struct Arrangement {
    /// Rounded to the nearest f64; where a corner of a triangle is, exactly that.
    pub(crate) points: Vec<[f64; 3]>,
    /// Which of the points are exactly where they are said to be, in f32; others there are only very near.
    pub(crate) exact: Vec<bool>,
    /// By triangle: part of it is a piece of an earlier one, too.
    pub(crate) covered: Vec<bool>,
    /// By source. No two of them lie on top of each other, and they meet along whole edges.
    pub(crate) pieces: Vec<Piece>,
    /// Numbers of cells are below this. What is one cell of space may have several, if only triangles that are not here show it.
    pub(crate) cells: u32,
}

/// An engine that arranges triangles.
pub(crate) trait Arrange {
    /// The arrangement of triangles that have an area; `None` if it fails. The same for any number of threads.
    fn arrange(&self, triangles: &[[[f32; 3]; 3]], threads: usize) -> Option<Arrangement>;
}

/// Do two triangles of one plane face the same way? Exact: that of their shadows, along an axis in which they have any.
pub(crate) fn agree(a: &[[f32; 3]; 3], b: &[[f32; 3]; 3]) -> bool {
    let turn = |t: &[[f32; 3]; 3], axis: usize| exact::orientation_along(&t[0], &t[1], &t[2], axis);
    (0..3).any(|axis| turn(a, axis) * turn(b, axis) > 0)
}
