//! Surfaces between curves, and triangles of them that fit together.
//!
//! **In:** curves, and the outlines that they form. **Out:** a surface for each outline, one mesh of all, and what became of
//! each.
//! **Promise:** the same result for the same input, whatever the number of threads; outlines that share a curve share its points;
//! time near linear in curves and points. What no surface fits is left to the filling of mesh holes, with its points.

mod all;
mod basis;
mod blend;
mod body;
mod carrier;
mod chart;
mod chords;
mod coons;
mod entry;
mod faces;
mod fan;
mod fans;
mod fit;
mod grade;
mod improve;
#[cfg(test)]
mod known;
mod layout;
mod lifted;
mod linear;
mod measure;
mod mesh;
mod middle;
mod near;
mod nest;
mod network;
mod options;
mod orient;
mod patch;
mod pieces;
mod plate;
mod poor;
mod refine;
mod report;
mod revolved;
mod sense;
mod side;
mod sided;
mod sides;
mod space;
mod spline;
mod star;
mod strand;
mod sum;
mod tangent;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod told;
mod triangles;
mod tried;
mod unrolled;
mod weights;

pub use all::{FilledNetwork, fill_network};
pub use body::body;
pub use coons::{Base, Coons};
pub use entry::{FillError, Filled, fill, fill_beside};
pub use fit::{FitError, Fitted, fit};
pub use mesh::{Mesh, quality};
pub use options::{Continuity, Options, Outline};
pub use report::{Method, Problem, Report, Surface};
pub use spline::{Jet, SplineSurface};
pub use tangent::Beside;
