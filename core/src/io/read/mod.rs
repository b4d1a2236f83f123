//! A mesh file as an array of `Record`s.
//!
//! Binary STL is read where it lies, mapped or copied (`Access`). Text STL is parsed once, in parallel, into a nameless spool file of the same
//! records, which is mapped in its place. So the rest of the engine sees one thing: `&[Record]` in input order, backed by pages
//! the system can drop at any time.
//!
//! What is odd about a file never stops the reading as long as its triangles are certain: it becomes a [`Finding`]. What is no
//! mesh is refused with the reason a person needs ("a PNG picture").

mod access;
mod amf;
mod archive;
mod binary;
mod built;
pub(super) mod elements;
mod faces;
mod facets;
mod finding;
mod foreign;
#[cfg(fuzzing)]
pub mod fuzzing;
mod limits;
mod mesh_file;
mod number;
pub(super) mod obj;
pub(super) mod off;
mod opened;
mod package;
mod package_file;
mod parsed;
pub(super) mod ply;
pub(crate) mod polygon;
mod rounding;
mod sniff;
mod spool;
mod tail;
#[cfg(test)]
mod tests;
mod text;
mod threemf;
mod unpacked;
mod vertices;
mod xml;

/// Endings of names of the formats that are read, in lower case, without a point.
pub const ENDINGS: [&str; 6] = ["stl", "3mf", "ply", "off", "obj", "amf"];

#[cfg(test)]
pub(crate) use archive::build as archive_build;
pub(crate) use archive::{Archive, Entry};
pub use finding::{Finding, Loss};
pub use limits::{HEADER_BYTES, MAX_TRIANGLES, PREFIX_BYTES};
pub use mesh_file::MeshFile;
pub(crate) use package_file::PackageFile;
pub(crate) use parsed::Part;
pub use tail::ends_in_zeros;
pub(crate) use threemf::slicer;
pub(crate) use threemf::{MeshRecords, Place};
pub(crate) use vertices::Vertices;
