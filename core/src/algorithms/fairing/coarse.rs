//! A coarse patch with the surface around it, and what comes of it.

use crate::geometry::exact::Point;

/// What a patch is shaped from, in one numbering of vertices. Positions are finite, and no two of the same piece are equal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CoarsePatch<'a> {
    /// The rim's vertices and those of the rings around.
    pub(crate) positions: &'a [Point],
    /// The coarse patch, with all its vertices on its border, the rim.
    pub(crate) patch: &'a [[u32; 3]],
    /// The surface's triangles of three rings (at least two) beyond the rim, turned as the patch is. There may be other borders in them.
    pub(crate) around: &'a [[u32; 3]],
}

/// A patch in place of the coarse one.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Shaped {
    /// New vertices, numbered from the number of positions on.
    pub(crate) added: Vec<Point>,
    pub(crate) triangles: Vec<[u32; 3]>,
}

/// Why there is nothing better than the coarse patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Unshaped {
    /// The patch's triangles are as small as those around.
    #[error("nothing to add")]
    NothingToAdd,
    /// The patch is no coherent 2-manifold with a border.
    #[error("not a surface with a border")]
    NotASurface,
    /// Creases run into the rim in a way that is not followed.
    #[error("creases run into the hole")]
    Creased,
    /// The rim is an edge of the surface: a lid is missing, which does not continue what is around.
    #[error("the rim is an edge of the surface")]
    RimIsEdge,
    /// The surface was cut along a plane there.
    #[error("the surface was cut along a plane")]
    Cut,
    /// Most of what is next to the rim is sharp: the surface around says nothing of curvature.
    #[error("the surface around does not tell how it is curved")]
    Uncurved,
    /// The equations could not be solved reliably.
    #[error("the equations could not be solved")]
    Unsolved,
    /// A vertex left the box.
    #[error("the patch goes too far")]
    TooFar,
    /// The exact tests failed.
    #[error("the patch crosses itself or what is around")]
    Crosses,
}
