//! Geometry: predicates, sums and searches over points and triangles.
//!
//! **In:** coordinates in f32.
//! **Out:** exact answers: does a triangle have area ([`collinear`]), do two triangles meet ([`tri_tri`]), which boxes meet a box
//! ([`boxes`]), which rays may meet a triangle ([`ray_grid`]), triangles cut along each other ([`arrange`]); distances ([`distance`]), how flat a patch is ([`flatness`]); points spread over triangles ([`spread`]); sums that do not depend on their order ([`sums`]).
//! **Promise:** what decides validity is exact; rounding only ever ranks. Nothing here knows a file or a mesh.

pub(crate) mod arrange;
pub(crate) mod askew;
pub(crate) mod axis;
pub(crate) mod boxes;
pub(crate) mod collinear;
pub(crate) mod distance;
pub(crate) mod exact;
pub(crate) mod flatness;
pub(crate) mod grid;
pub(crate) mod places;
pub(crate) mod position;
pub(crate) mod ray_grid;
pub(crate) mod self_crossing;
pub(crate) mod spread;
pub(crate) mod sums;
pub(crate) mod tri_tri;
mod wide_boxes;
