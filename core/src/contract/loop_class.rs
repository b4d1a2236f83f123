//! Kinds of boundary loops.

use serde::{Deserialize, Serialize};

/// What kind of opening a boundary loop is (`core/REPORT.md` has the rules).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum LoopClass {
    /// No opening: vertices of one side lie on the edges of the other (T-junctions).
    Crack,
    /// Narrow, with sides that run alike.
    Gap,
    /// Narrow, with sides that do not run alike.
    Misaligned,
    /// Meets another loop in a vertex.
    Nested,
    /// One of the two rims of a missing ring, both in about one plane.
    AnnularCoplanar,
    /// One of the two rims of a missing ring, in planes one above the other.
    AnnularParallel,
    /// A hole with a piece of surface in it, or the rim of that piece.
    Island,
    /// A slit when seen along an axis, though not flat.
    Machining,
    /// None of these.
    Simple,
}

impl LoopClass {
    /// In words, for one or several.
    pub fn name(self) -> &'static str {
        match self {
            Self::Crack => "crack",
            Self::Gap => "gap",
            Self::Misaligned => "misaligned",
            Self::Nested => "nested",
            Self::AnnularCoplanar => "annular, coplanar",
            Self::AnnularParallel => "annular, parallel",
            Self::Island => "island",
            Self::Machining => "machining direction",
            Self::Simple => "simple",
        }
    }
}
