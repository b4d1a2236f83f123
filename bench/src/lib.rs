//! Generators of broken meshes with a known truth, and an independent judge of mesh files.
//!
//! The generators ([`generate`], [`meaning`], [`cut`], [`field`], [`outlines`]) and the judge ([`judge`]) need nothing but the standard library; they share no code with the
//! engine, so that neither can hide a fault of the other. The comparison with other tools is in the binary.

#![deny(missing_docs)]

pub mod counts;
pub mod cut;
pub mod field;
pub mod generate;
pub mod judge;
pub mod meaning;
pub mod outlines;
pub mod space;

pub use counts::Counts;
