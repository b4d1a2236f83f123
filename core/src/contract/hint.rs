//! Hints in the report.

use serde::{Deserialize, Serialize};

/// What a person may want to know, and no repair changes. It decides neither verdict nor outcome.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Hint {
    /// What it is about.
    pub kind: HintKind,
    /// A line for people.
    pub text: String,
}

/// What a hint is about.
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
}
