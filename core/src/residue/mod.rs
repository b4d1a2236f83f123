//! Tool residue: what a milling tool left between its passes is found from the tool path, and the surface that was meant is given back.
//!
//! **In:** a mesh of a simulated workpiece, the moves of the tool, the tools.
//! **Out:** [`find()`]: regions of residue, for each triangle its region, for each vertex its place on the intended surface; [`repair()`]: the
//! mesh with those regions moved there; [`hint`], [`suspects()`]: waves of a patch, or of a whole mesh, without a path, for a person to
//! look at.
//!
//! The swept volume is the least signed distance from the tool over all cutting moves (`chains`, `cuts`, `tree`, `sweep`, `profile`); `intended` has
//! the surface between passes, `find` and `regions` the triangles, `repair` the move.
//! **Promise:** borders of regions and all outside them stay as they are, to the bit; the same result for any number of threads.

mod brush;
mod chains;
mod cuts;
mod find;
mod found;
mod frame;
mod intended;
mod options;
mod profile;
mod regions;
mod repair;
mod spectrum;
mod sweep;
mod tree;
mod waves;

#[cfg(test)]
mod tests;

pub use brush::{Brush, BrushError};
pub use cuts::Cuts;
pub use find::{find, frame};
pub use found::{Fit, Found, Kind, Mesh, RegionReport};
pub use frame::{FIT_LEAST, Frame};
pub use options::{Corrections, Error, Options, Region};
pub use repair::{Repaired, repair};
pub use spectrum::{Hint, hint};
pub use waves::{Suspect, suspects};
