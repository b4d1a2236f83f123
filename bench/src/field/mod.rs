//! Workpieces as height fields: what a ball-nosed tool leaves of a stock over a grid of places, by closed formulas.
//!
//! **In:** straight moves of an upright tool ([`moves`]), a stock. **Out:** a closed mesh ([`Field::triangles`]), and how high crests between
//! passes are on any mesh of it ([`Crests`]). **Promise:** nothing is shared with the engine that finds residue.

mod heights;
mod measure;
mod path;

pub use heights::{Field, Stock};
pub use measure::{Crests, Heights};
pub use path::{Move, PathError, moves};
