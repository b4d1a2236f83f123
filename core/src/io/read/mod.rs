//! A mesh file as an array of `Record`s.
//!
//! Binary STL is read where it lies, mapped or copied (`Access`). Text STL is parsed once, in parallel, into a nameless spool file of the same
//! records, which is mapped in its place. So the rest of the engine sees one thing: `&[Record]` in input order, backed by pages
//! the system can drop at any time.
//!
//! What is odd about a file never stops the reading as long as its triangles are certain: it becomes a [`Finding`]. What is no
//! mesh is refused with the reason a person needs ("a PNG picture").

mod access;
mod binary;
mod elements;
mod faces;
mod facets;
mod finding;
mod foreign;
mod limits;
mod mesh_file;
mod number;
mod off;
mod ply;
mod polygon;
mod rounding;
mod sniff;
mod spool;
mod tail;
#[cfg(test)]
mod tests;
mod text;
mod vertices;

pub use finding::{Finding, Loss};
pub use limits::{HEADER_BYTES, MAX_TRIANGLES, PREFIX_BYTES};
pub use mesh_file::MeshFile;
pub use tail::ends_in_zeros;
