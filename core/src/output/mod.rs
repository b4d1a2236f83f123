//! Output: the repaired file, written once and looked at again.
//!
//! **In:** the records of the input, and the submesh as repairs left it.
//! **Out:** a sparse [`edit::Edit`]; the file, written over a copy of the input ([`emit`]); what is true of the written bytes
//! ([`readback`], [`incremental`]).
//! **Promise:** a triangle that the edit does not name leaves as the same 50 bytes, in input order. The verdict is of the bytes that were
//! read back, not of what should have been written.

pub(crate) mod archive;
mod attribute_words;
pub(crate) mod edit;
pub(crate) mod emit;
pub(crate) mod encode;
pub(crate) mod incremental;
pub(crate) mod indexed;
pub(crate) mod model;
mod package;
pub(crate) mod readback;
pub(crate) mod rows;
