//! What a repair changes, in numbers and face by face.

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

/// The edit in numbers. Every record of the output is an untouched input record, a replaced one or an added one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct EditSummary {
    /// Input records that stand in the output byte for byte, in order.
    pub untouched: u64,
    /// Input records left out.
    pub deleted: u64,
    /// Input records whose winding was reversed.
    pub flipped: u64,
    /// Input records with a moved vertex.
    pub moved: u64,
    /// New records: in the places of those left out as far as these go, then at the end of the file.
    pub added: u64,
    /// Largest distance any vertex moved.
    pub max_move: f64,
}

/// The edit, record by record. Ids are input record numbers from 0.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[non_exhaustive]
pub struct EditRecords {
    /// Inclusive ranges of records left out.
    pub deleted: Vec<[u32; 2]>,
    /// Inclusive ranges of records reversed.
    pub flipped: Vec<[u32; 2]>,
    /// Records with moved vertices and their new corners.
    pub moved: Vec<(u32, [[f32; 3]; 3])>,
    /// New records, in file order: corners and attribute word.
    pub added: Vec<([[f32; 3]; 3], u16)>,
    /// Where each of them comes from: [`FaceOrigin::Part`] or [`FaceOrigin::Repair`]. Empty in a report of an engine that did not tell.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub added_from: Vec<FaceOrigin>,
}
