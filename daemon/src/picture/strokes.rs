//! Curves as lines.

use suture_core::record::Point;

/// The purpose of a curve in a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mark {
    /// It bounds a surface.
    Bounds,
    /// It closes a gap.
    Added,
    /// It bounds no surface.
    Left,
}

/// A curve as a chain of points.
#[derive(Clone, Debug)]
pub(crate) struct Stroke {
    pub points: Vec<Point>,
    pub mark: Mark,
}
