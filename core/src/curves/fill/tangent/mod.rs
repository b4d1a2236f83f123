//! Surfaces bent so that they continue what is beside them: tangent planes along their sides.
//!
//! **In:** Coons surfaces of outlines, and normals of what is beside their curves: surfaces with an equation, faces that are given,
//! other Coons surfaces. **Out:** the same surfaces, each with one added that is 0 along its sides.
//! **Promise:** a surface is bent only if its normals come nearer to those beside it and it does not fold; the sum is a B-spline of
//! degree 3 both ways, so files can have it as it is; the same result for any order of outlines and any number of threads.
//!
//! Based on: S. A. Coons, *Surfaces for computer-aided design of space forms*, MIT 1967, and G. Farin, *Curves and surfaces for
//! CAGD*, 5th edition 2002, chapter 22 (bicubically blended, with vectors across the sides and twists at the corners). What is
//! blended is the difference of these vectors from those of the surface that there is; so sides without a neighbour keep theirs.
//!
//! Twists that both sides of a corner want must agree (Farin, 22.3). Where the planes of two neighbours do not allow that, J. A.
//! Gregory's rational patch (*Smooth interpolation without twist constraints*, 1974) has both, but is no B-spline. Here the mean
//! of both is taken, and vectors leave it in spans that are halved towards the corner, so that the angle by which normals are off
//! is halved, too.

mod bend;
mod flank;
mod lacking;
mod ribbon;
#[cfg(test)]
mod tests;

pub use bend::Beside;
pub(super) use bend::bend;
