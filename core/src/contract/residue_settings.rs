//! Settings on what a milling tool left.

use serde::{Deserialize, Serialize};

/// Residue of a milling tool that is to be removed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[non_exhaustive]
pub struct ResidueSettings {
    /// The tool path that cut the part, a file: G-code, APT or CL data, or a project of CAMotics. Empty: no residue is looked for.
    pub toolpath: String,
    /// Its tools, where the path itself does not describe them: `3=ball,d=6`, lengths in millimetres.
    pub tools: Vec<String>,
    /// How far vertices of a cut surface may be from what the tool cut, in millimetres: noise of the simulation. 0: by the tool's size and single precision.
    pub tolerance_mm: f64,
    /// Boxes, by their least and greatest corners: all triangles with their centres within are residue's.
    pub include: Vec<[[f64; 3]; 2]>,
    /// Boxes of which no triangle is residue's; they count more than the others.
    pub exclude: Vec<[[f64; 3]; 2]>,
}
