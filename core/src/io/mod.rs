//! Input and output: bytes of files become records, and the disk is asked early and written in turn.
//!
//! **In:** a path; binary or text STL.
//! **Out:** [`record::Record`]s of 50 bytes in input order, mapped or copied ([`read`]); files read before they are needed
//! ([`read_ahead`]), written without dirty pages that pile up ([`write_behind`]), and hashed ([`digest`]).
//! **Promise:** an input is never written to. Whatever is odd about a file is a finding, and what is no mesh is refused by name. A file
//! that changes meanwhile is noticed.

pub(crate) mod digest;
pub(crate) mod disk_space;
pub(crate) mod file_map;
pub mod read;
pub(crate) mod read_ahead;
pub mod record;
pub(crate) mod rows;
pub(crate) mod write_behind;
