//! A piece of a mesh that lies on one surface.

use super::super::surface::Surface;
use super::super::vector::Point;

/// A piece of the mesh.
pub(crate) struct Segment {
    pub(crate) surface: Surface,
    /// Whether the surface's material lies outside of it: walls of holes.
    pub(crate) is_concave: bool,
    pub(crate) triangles: Vec<u32>,
    pub(crate) area: f64,
    /// Largest distance of a vertex from the surface.
    pub(crate) residual: f64,
    /// Whether it was drawn, rather than that some triangles of a free form lie so.
    pub(crate) is_proven: bool,
}

impl Segment {
    /// The direction out of the part at a point.
    pub(crate) fn outward(&self, point: Point) -> Point {
        let gradient = self.surface.gradient(point);
        if self.is_concave { gradient.map(|x| -x) } else { gradient }
    }
}
