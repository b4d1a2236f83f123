//! Parts that are the swept solid of a tool path, with the surface that was meant and the label of every triangle.
//!
//! Passes a step apart cut an intended surface. The part's vertices stand over a grid of that surface, each lifted along the normal to
//! where the nearest tool begins: they are points of the swept volume's boundary, up to rounding. Lines of the grid follow passes and
//! cusps. The distances from tools are computed here anew; they share no code with the engine's search for residue.
//!
//! A part of [`CASES`] was looked at while that search was written; a part of [`FRESH`] was not.

mod case;
mod close;
mod cutter;
mod judge;
mod lattice;
mod lift;
mod part;
mod pass;
mod program;
mod surface;
mod sweep;

pub use case::{CASES, Case, FRESH};
pub use cutter::Cutter;
pub use judge::{Verdict, judge};
pub use part::{Part, make};
pub use surface::Surface;
