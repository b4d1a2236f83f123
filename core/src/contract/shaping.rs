//! Work on a repaired mesh that a profile asks for, in the report: residue of tools, smoothing, fewer triangles. Lengths in the file's units.

use serde::{Deserialize, Serialize};

/// Residue of a milling tool that was found and removed ([`crate::Profile::residue`]).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Residue {
    /// Vertices that moved onto the intended surface.
    pub moved: u64,
    /// The longest way of one of them: no place of the result is farther than this from the mesh before, and none of that from the result, before triangles are made fewer.
    pub displacement: f64,
    /// How far the simplified regions may be from the moved ones, both ways, proved.
    pub deviation: f64,
    /// Change of the volume.
    pub volume_change: f64,
    /// Triangles in regions before.
    pub triangles_before: u64,
    /// Triangles in their places.
    pub triangles_after: u64,
    /// Of the vertices that the tool reaches, the share that lies where it left the material, from 0 to 1: of a mesh that this path has cut, all do; 0 if it
    /// reaches none. `None` without a path.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path_fit: Option<f64>,
    /// The axes of the mesh that those of the path are, as `y, -x, z`, where the path fits the mesh so and not as it is. The outcome is `needs_review` then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path_axes: Option<String>,
    /// Oddities of the tool path, with their lines (at most 20).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub findings: Vec<String>,
    /// Why nothing was removed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why_not: Option<String>,
    /// Each region (at most 1000 listed).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub regions: Vec<ResidueRegion>,
    /// Places that may be residue, looked for without a tool path ([`crate::ResidueSettings::without_path`]): nothing was changed there. At most 1000 are
    /// listed; `None` if none were looked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub suspects: Option<Vec<ResidueSuspect>>,
}

/// A place with periodic waves that may be what a tool left. A knurl or a thread looks the same.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ResidueSuspect {
    /// Height from trough to crest.
    pub height: f64,
    /// Distance of the crests.
    pub pitch: f64,
    /// Direction across the crests, of length 1.
    pub across: [f64; 3],
    /// The share of the variance of its height that a sine of this pitch explains.
    pub confidence: f64,
    /// Its area.
    pub area: f64,
    /// Its triangles.
    pub triangles: u64,
    /// The box that it lies in, by its least and greatest corners.
    pub within: [[f64; 3]; 2],
}

/// A region of residue.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ResidueRegion {
    /// `stairs` where passes follow each other along the tool's axis, `ripples` where they lie beside each other.
    pub kind: String,
    /// The share of its area that speaks for that kind.
    pub confidence: f64,
    /// Height above the intended surface that 98 % of its vertices do not exceed.
    pub height: f64,
    /// Median distance of neighbouring passes.
    pub pitch: f64,
    /// Its area.
    pub area: f64,
    /// Its triangles.
    pub triangles: u64,
}

/// Waves that were smoothed ([`crate::Profile::smooth_waves_below_mm`]).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Smoothed {
    /// Passes of the filter.
    pub passes: u64,
    /// Vertices that moved.
    pub moved: u64,
    /// Vertices that were held back, since triangles would have crossed or turned over.
    pub held: u64,
    /// The longest way of a vertex: no place of either surface is farther from the other.
    pub displacement: f64,
    /// Change of the volume.
    pub volume_change: f64,
    /// Why nothing was smoothed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why_not: Option<String>,
}

/// Triangles that were made fewer ([`crate::Profile::simplify_triangles`], [`crate::Profile::simplify_ratio`], [`crate::Profile::simplify_within_mm`]).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Simplified {
    /// Triangles before.
    pub before: u64,
    /// Triangles after.
    pub after: u64,
    /// No place of the mesh before is farther than this from the result; proved.
    pub to_result: f64,
    /// No place of the result is farther than this from the mesh before; proved.
    pub from_result: f64,
    /// Change of the volume.
    #[serde(default)]
    pub volume_change: f64,
    /// Why nothing was simplified, or why more triangles are left than asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why_not: Option<String>,
}
