//! Where the bodies and cavities of a file are in what a repair made of it, in the report.

use serde::{Deserialize, Serialize};

/// Whether bodies are still inside of the result: points in each are looked for there. In the file's units, cubed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Volumes {
    /// Bodies that were looked for: the largest, at most 4096, each of more than a millionth of the volume of all.
    pub bodies: u64,
    /// Points in them.
    pub points: u64,
    /// What they enclose, each for itself: what several share counts for each.
    pub volume: f64,
    /// Of that, what is outside now, an estimate: of each body the share of its points that are.
    pub outside: f64,
    /// Bodies with no point inside.
    pub lost: u64,
    /// These, the largest first (at most 1000 listed).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub listed: Vec<BodyLost>,
    /// What cavities enclosed of which every point is material now. Of those of more than a thousandth of the volume, at most 256.
    #[serde(default, skip_serializing_if = "is_none")]
    pub filled: f64,
    /// These, the largest first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub filled_listed: Vec<BodyLost>,
}

fn is_none(x: &f64) -> bool {
    *x == 0.0
}

/// A body that is not inside of the result, or a cavity that is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct BodyLost {
    /// Smallest and largest coordinates of what was there.
    pub bounds: [[f32; 3]; 2],
    /// The volume that it enclosed.
    pub volume: f64,
}
