//! Walls that may be too thin to be printed, in the report.

use serde::{Deserialize, Serialize};

/// Walls thinner than [`crate::Profile::thin_wall_mm`]. Measured at points spread over the surface by area, so that a place smaller than
/// the distance between them may be missed. In the file's units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ThinWalls {
    /// Walls thinner than this were looked for.
    pub minimum: f64,
    /// The points that were looked at.
    pub points: u64,
    /// The share of them, and so about that of the surface, where the wall is thinner.
    pub share: f64,
    /// Where it is, the thinnest first, at most one in each part of the box (at most 8 listed).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub places: Vec<ThinPlace>,
}

/// A place where a wall is thin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ThinPlace {
    /// A point of the surface.
    pub at: [f32; 3],
    /// Diameter of the largest sphere in the material that touches the surface there.
    pub thickness: f64,
}
