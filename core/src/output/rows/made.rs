//! Triangles of a result that the file does not have.

use crate::io::record::Point;
use crate::io::rows::{Corner, Source};

/// A triangle that is written behind those of the file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Made {
    /// Its corners, as numbers of positions.
    pub(super) corners: [u32; 3],
    pub(super) from: From,
    /// Its number among the triangles of the result.
    pub(super) number: u32,
}

/// Whose values a triangle takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum From {
    /// This triangle of the file, which was moved.
    Moved(u32),
    /// This triangle of the file, of which it is a part.
    Part(u32),
    /// Those around it.
    Rim,
}

impl From {
    /// The triangle of the file.
    pub(super) fn triangle(self) -> Option<u32> {
        match self {
            Self::Moved(of) | Self::Part(of) => Some(of),
            Self::Rim => None,
        }
    }
}

/// A triangle of the file whose values others take.
#[derive(Clone, Debug)]
pub(super) struct Parent {
    pub(super) source: Source,
    pub(super) corners: [Corner; 3],
    pub(super) points: [Point; 3],
    /// What its face says.
    pub(super) says: Vec<u8>,
}
