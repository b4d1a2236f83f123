//! The model of a curve: what it is, where it comes from, and what can be asked of it.
//!
//! Based on: L. Piegl, W. Tiller, *The NURBS Book*, 2nd edition, Springer 1997 ("TNB" below, with the number of the algorithm).

mod arc;
mod conic;
mod error;
mod exact;
mod fit;
mod length;
mod lengths;
mod nearest;
mod offset;
mod shape;
mod spline;
#[cfg(test)]
mod tests;
mod trim;

pub use arc::Arc;
pub use conic::conic;
pub use error::{CurveError, HIGHEST_DEGREE};
pub(crate) use fit::fit;
pub(crate) use offset::{Away, Offset};
pub use shape::Shape;
pub(crate) use shape::widen;
pub use spline::Spline;

/// The name by which a file calls a curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Id {
    /// Number in the directory of an IGES file.
    Directory(u64),
    /// `#number` in a STEP file.
    Instance(u64),
    /// Place among the curves of a JSON file, from 0.
    Place(u64),
}

impl std::fmt::Display for Id {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Directory(number) => write!(formatter, "D{number}"),
            Self::Instance(number) => write!(formatter, "#{number}"),
            Self::Place(number) => write!(formatter, "[{number}]"),
        }
    }
}

/// Where something stands in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Source {
    /// The file's name for it.
    pub id: Id,
    /// Line from 1; 0 where lines mean nothing.
    pub line: u64,
}

/// The purpose of a curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Role {
    /// Bounds nothing that the file knows.
    Free,
    /// Bounds a face of the file.
    Edge,
    /// Makes a surface: the axis or the profile of one that is turned, drawn or ruled. In no loop.
    Generator,
    /// Drawn for people, or an aid to construction. In no loop.
    Aid,
}

/// A curve of a file.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Curve {
    /// Its shape, in the file's unit.
    pub shape: Shape,
    /// Where it stands.
    pub source: Source,
    /// The file's name for people.
    pub name: Option<String>,
    /// Its purpose.
    pub role: Role,
    /// Whether the file hides it.
    pub is_blanked: bool,
    /// Vertices at its beginning and end, where the file has any: the same number, the same vertex.
    pub vertices: Option<[u64; 2]>,
}
