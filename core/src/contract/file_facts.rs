//! A mesh file's identity, format and unit, in the report.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize, Serializer};

/// A mesh file's identity and format.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[non_exhaustive]
pub struct FileFacts {
    /// What is not UTF-8 in it is replaced when the report is written: names of files may be any bytes, JSON may not.
    #[serde(serialize_with = "lossy")]
    pub path: PathBuf,
    /// Length of the file; of a mesh in memory, that of a binary STL of it.
    pub bytes: u64,
    /// BLAKE3 of the whole file, hexadecimal.
    pub blake3: String,
    /// The format that it was read from.
    pub format: Format,
    /// The unit of its coordinates, where the file says one; nothing is scaled.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Triangle records in the file, non-finite and degenerate ones included.
    pub triangles: u64,
    /// What is odd about the file itself, in the reader's words; empty for a flawless file.
    pub findings: Vec<String>,
}

/// A file that was written in another format.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Converted {
    /// The file read.
    pub input: FileFacts,
    /// The file written.
    pub output: FileFacts,
    /// Triangles of the input whose colours, paint or other attributes the output does not hold.
    #[serde(default)]
    pub attributes_lost: u64,
}

fn lossy<S: Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&path.to_string_lossy())
}

/// Where a mesh is read from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Format {
    /// A binary STL.
    BinaryStl,
    /// A text STL.
    AsciiStl,
    /// No file: a mesh that a program handed over in memory.
    Memory,
    /// A 3MF package.
    #[serde(rename = "3mf")]
    ThreeMf,
    /// An AMF.
    Amf,
    /// A Wavefront OBJ.
    Obj,
    /// A PLY, as text or in binary.
    Ply,
    /// An OFF, as text or in binary.
    Off,
}

impl Format {
    /// The ending of names of this format, without a point; `None` for a mesh in memory.
    pub fn ending(self) -> Option<&'static str> {
        match self {
            Self::BinaryStl | Self::AsciiStl => Some("stl"),
            Self::ThreeMf => Some("3mf"),
            Self::Ply => Some("ply"),
            Self::Off => Some("off"),
            Self::Obj => Some("obj"),
            Self::Amf => Some("amf"),
            Self::Memory => None,
        }
    }
}
