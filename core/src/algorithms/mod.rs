//! Algorithms: surface that is made new.
//!
//! **In:** loops of positions, or triangles of any kind.
//! **Out:** triangles: of a boundary loop ([`triangulate`]), of flat surface that goes on to where it meets other ([`extend`]), of a patch that
//! continues the surface around it ([`fairing`]), of a wall along a sheet ([`thicken`]), of a solid around anything ([`wrap`]).
//! **Promise:** what is returned was tested exactly, in the f32 positions that will be written. No file, no survey, no submesh is known
//! here. All arithmetic is + − × ÷ √ in a fixed order, all bounds of work are counts.

pub(crate) mod extend;
pub(crate) mod fairing;
pub(crate) mod fans;
pub(crate) mod thicken;
pub(crate) mod triangulate;
pub(crate) mod wrap;
