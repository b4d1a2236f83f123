//! Where a face of a result comes from.

use serde::{Deserialize, Serialize};

use crate::contract::repair_name::RepairName;

/// Where a face of a result comes from. Numbers are those of the input's faces, from 0.
///
/// In JSON it is one field: `{"input": 7}`, `{"repair": "fill"}`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum FaceOrigin {
    /// This face of the input, as it was.
    Input(u32),
    /// This face of the input, turned over: its second and third corner are swapped.
    Flipped(u32),
    /// This face of the input with at least one vertex at another place.
    Moved(u32),
    /// A part of this face of the input, which was split or cut.
    Part(u32),
    /// New: this repair made it.
    Repair(RepairName),
}

impl FaceOrigin {
    /// The face of the input that it is, or is a part of; `None` for a new one.
    pub fn input_face(self) -> Option<u32> {
        match self {
            Self::Input(face) | Self::Flipped(face) | Self::Moved(face) | Self::Part(face) => Some(face),
            Self::Repair(_) => None,
        }
    }
}
