//! What a mesh file holds, by the judge.

use crate::counts::Counts;

/// Three corners.
pub type Triangle = [[f32; 3]; 3];

/// Counts and sums of a mesh file.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "compare", derive(serde::Serialize, serde::Deserialize))]
pub struct Judgement {
    /// Numbers of triangles and defects.
    pub counts: Counts,
    /// Triangles with a NaN or infinite coordinate.
    pub nonfinite: u64,
    /// Distinct positions.
    pub vertices: u64,
    /// Signed volume about the centre of the bounding box, in cubic units of the file. Means something only where closed and
    /// oriented.
    pub volume: f64,
    /// Closed, coherent components of positive volume.
    pub positive_bodies: u64,
    /// Closed, coherent components of negative volume: cavities, or bodies inside out.
    pub negative_bodies: u64,
}

impl Judgement {
    /// Closed, manifold and consistently oriented: what a slicer needs at least.
    pub fn sound(&self) -> bool {
        self.counts.closed() && self.counts.manifold() && self.counts.oriented()
    }
}
