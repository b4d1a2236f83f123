//! Curves of IGES, STEP and JSON files, and the closed loops that they form.
//!
//! **In:** the bytes of a file.
//! **Out:** a [`Network`]: curves, faces with the loops that bound them, and what is odd or not read; [`loops::find`] gives closed loops.
//! **Promise:** the same network for the same bytes; memory and time linear in the length of the file; what is damaged costs nothing
//! of what is whole.

mod carrier;
mod collect;
pub mod curve;
mod elementary;
pub mod export;
pub mod fill;
mod finding;
mod iges;
mod json;
pub mod loops;
mod network;
mod read;
mod step;
pub mod vector;

pub use elementary::{Elementary, Frame, Told};
pub use finding::Finding;
pub(crate) use finding::Findings;
pub use network::{Face, Network, ReadError, Unit, Use};
pub use read::read;
