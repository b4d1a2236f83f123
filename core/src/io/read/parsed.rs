//! A file that was parsed.

use std::ops::Range;

use super::finding::Finding;
use super::limits::HEADER_BYTES;
use super::rounding::Rounding;
use super::spool::Items;
use super::vertices::Positions;

/// A mesh of its own in a file of several.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Part {
    /// As the file calls it; without control characters.
    pub(crate) name: String,
    /// Its triangles among all of the file.
    pub(crate) triangles: Range<usize>,
}

/// A file that was parsed.
#[derive(Debug)]
pub(crate) struct Parsed {
    /// The records, in a file without a name.
    pub(crate) records: Items<50>,
    pub(crate) findings: Vec<Finding>,
    /// The header of an output in binary STL.
    pub(crate) header: [u8; HEADER_BYTES],
    /// How far coordinates were moved to be `f32`, where the file holds finer ones.
    pub(crate) rounding: Option<Rounding>,
    pub(crate) besides: Besides,
}

/// What a file says besides its triangles, where it says it.
#[derive(Debug, Default)]
pub(crate) struct Besides {
    /// The name of the unit of all coordinates.
    pub(crate) unit: Option<&'static str>,
    /// The name of the whole; without control characters.
    pub(crate) title: String,
    /// The positions that faces name by number, where there is one table of them.
    pub(crate) positions: Option<Positions>,
    /// Faces of fewer than three corners were left out, and a finding says so.
    pub(crate) short_faces: bool,
    /// Triangles with colours or materials in a form that no result in another format keeps.
    pub(crate) coloured: u64,
    /// Meshes that are never welded to each other, one behind the other, all triangles in them. Of a file of one mesh that one, if it has a name; else none.
    pub(crate) parts: Vec<Part>,
    /// What the file builds and another format has no place for, in words.
    pub(crate) left_out: Vec<String>,
    /// A person should look at a result that is no copy, for this reason.
    pub(crate) doubt: Option<&'static str>,
}
