//! Small features that were removed, in the report.

use serde::{Deserialize, Serialize};

/// Features smaller than the profile wants them ([`crate::Profile::remove_holes_below_mm`] and its like). Lengths in the file's units.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Features {
    /// Features that were removed.
    pub removed: u64,
    /// Features that were found and left.
    pub left: u64,
    /// Triangles that went.
    pub triangles_gone: u64,
    /// Triangles that took their places.
    pub triangles_added: u64,
    /// Why nothing was removed, where that is not for want of features.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why_not: Option<String>,
    /// Each feature, removed ones first (at most 1000 listed).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub listed: Vec<Feature>,
}

/// A feature of a part.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Feature {
    /// `through-hole`, `blind-hole`, `counterbored-hole`, `countersunk-hole`, `dimple`, `pocket`, `slot`, `groove`, `ring-groove`, `fillet`, `chamfer`, `boss`.
    pub kind: String,
    /// Its middle.
    pub centre: [f64; 3],
    /// The direction out of the part, or along the edge of fillets and chamfers.
    pub axis: [f64; 3],
    /// The length that its limit is compared with: diameter of holes, width of pockets, slots, grooves and chamfers, radius of fillets, height of bosses.
    pub size: f64,
    /// The largest extent of its rim, or of its edge.
    pub length: f64,
    /// How far it goes down from its face, or stands out of it; 0 for fillets and chamfers.
    pub depth: f64,
    /// From 0 to 1: how well its surfaces are those of its kind.
    pub confidence: f64,
    /// Triangles that it is made of.
    pub triangles: u64,
    /// Why it was left; absent if it was removed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub left: Option<String>,
}
