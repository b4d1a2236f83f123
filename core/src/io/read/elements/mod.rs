//! Vertices and faces as rows of numbers, text or binary: what PLY and OFF have in common.
//!
//! **In:** a place in a file, how many rows the header announces there, and the [`layout::Layout`] of a row.
//! **Out:** positions or records in their spools, how many rows were there, and where they end.
//! **Promise:** memory for a few pieces of the file, whatever counts it claims; the same result for any number of threads.

pub(in crate::io) mod cursor;
pub(in crate::io) mod layout;
pub(in crate::io) mod lines;
pub(in crate::io) mod packed;
pub(super) mod points;
pub(super) mod polygons;
pub(super) mod strips;
pub(super) mod text;
