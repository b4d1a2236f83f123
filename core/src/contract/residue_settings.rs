//! Settings on what a milling tool left.

use serde::{Deserialize, Serialize};

/// Residue of a milling tool that is to be removed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[non_exhaustive]
pub struct ResidueSettings {
    /// The tool path that cut the part, a file: G-code, APT or CL data, or a project of CAMotics. Empty: no residue is removed.
    /// In the daemon, `*` is the mesh's own name, and the path is copied before a worker begins: workers reach no other file.
    pub toolpath: String,
    /// How long a mesh of a hot folder waits for its tool path, in minutes; without one, it is repaired, and the report says so.
    pub wait_minutes: f64,
    /// Its tools, where the path itself does not describe them: `3=ball,d=6`, lengths in millimetres.
    pub tools: Vec<String>,
    /// How far vertices of a cut surface may be from what the tool cut, in millimetres: noise of the simulation. 0: by the tool's size and single precision.
    pub tolerance_mm: f64,
    /// Boxes, by their least and greatest corners: all triangles with their centres within are residue's.
    pub include: Vec<[[f64; 3]; 2]>,
    /// Boxes of which no triangle is residue's; they count more than the others.
    pub exclude: Vec<[[f64; 3]; 2]>,
    /// A file with numbers of triangles that are residue's, counted from 0 in the order of the input: `12 40-52`, with `#` before comments. They count more than boxes. Empty: none.
    /// `*` is as in `toolpath`.
    pub brush: String,
    /// A mesh file: no triangle is residue's whose centre is neither on this mesh nor, where it is closed, within it. It counts most. Empty: all may be. `*` is as in `toolpath`.
    pub mask: String,
    /// Where no tool path is named, periodic waves are looked for without one. Nothing is changed, and the result needs a review.
    pub without_path: bool,
}

impl Default for ResidueSettings {
    fn default() -> Self {
        Self {
            toolpath: String::new(),
            wait_minutes: 10.0,
            tools: Vec::new(),
            tolerance_mm: 0.0,
            include: Vec::new(),
            exclude: Vec::new(),
            brush: String::new(),
            mask: String::new(),
            without_path: false,
        }
    }
}
