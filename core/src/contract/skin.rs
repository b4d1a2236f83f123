//! What a repair did to the surface that can be seen, in the report.

use serde::{Deserialize, Serialize};

use crate::contract::repair_name::RepairName;

/// Surface that can be seen from outside and was lost or invented by the repair. Measured at points, so that areas are estimates. In the file's
/// units, areas squared.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Skin {
    /// Surface that moved no farther than this counts as neither.
    pub reach: f64,
    /// What could be seen before, and is farther than the reach from all of the result.
    pub lost: SkinChange,
    /// What can be seen in the result, and is farther than the reach from all that was there; without patches that are flat, or small against
    /// their body.
    pub invented: SkinChange,
}

/// How much, where, and by what.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct SkinChange {
    /// The area.
    pub area: f64,
    /// The same as a fraction of all that could be seen of what was there; below a ten-thousandth, of all that was there.
    pub share: f64,
    /// The largest distance that was measured.
    pub farthest: f64,
    /// The area by the repair that did it, the largest first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub causes: Vec<SkinCause>,
    /// Where it is, the largest area first (at most 8 listed).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub places: Vec<SkinPlace>,
}

/// What one repair did to the skin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct SkinCause {
    /// The repair.
    pub repair: RepairName,
    /// Its part of the area.
    pub area: f64,
}

/// Where skin was lost or invented.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct SkinPlace {
    /// Smallest and largest coordinates.
    pub bounds: [[f32; 3]; 2],
    /// The area there.
    pub area: f64,
    /// The largest distance that was measured there; 0 if none was.
    pub farthest: f64,
}
