//! Two meshes that a proof is about.

use crate::geometry::exact::Point;

/// Two meshes, and the vertex of the second that each of the first has become.
#[derive(Clone, Copy)]
pub(crate) struct Pairing<'a> {
    pub(crate) points: &'a [Point],
    pub(crate) faces: &'a [[u32; 3]],
    pub(crate) new_points: &'a [Point],
    pub(crate) new_faces: &'a [[u32; 3]],
    pub(crate) became: &'a [u32],
    /// The vertices of the first mesh whose triangles form no closed fan, or more of them.
    pub(crate) open: &'a [u32],
}
