//! Hints in the report.

use serde::{Deserialize, Serialize};

/// Something that a person may want to know, and that no repair changes. It decides neither verdict nor outcome.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Hint {
    /// Its subject.
    pub kind: HintKind,
    /// A line for people.
    pub text: String,
}

/// The subject of a hint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum HintKind {
    /// It is so small that it may be drawn in inches.
    Inches,
    /// Likewise in metres.
    Metres,
    /// There is no room for it in [`crate::Profile::build_volume_mm`].
    BuildVolume,
    /// It has so many triangles that slicers are slow.
    ManyTriangles,
    /// Walls are thinner than [`crate::Profile::thin_wall_mm`], or it was not possible to look for them.
    ThinWalls,
    /// Colours, paint or other attributes are lost.
    Attributes,
}
