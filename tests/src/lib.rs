//! Helpers of the end-to-end tests: they look at the product as a user can (its command line, its files, its documented JSON)
//! and at meshes with their own eyes, sharing no code with the engine.
//!
//! Every helper panics where it cannot do its work: a test then means nothing and must fail.

pub mod binary;
pub mod edit;
pub mod hot;
pub mod place;
pub mod stl;

pub use place::{Place, Ran};
