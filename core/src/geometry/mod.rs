//! Geometry: predicates, sums and searches over points and triangles. No file, no mesh.

pub(crate) mod arrange;
pub(crate) mod boxes;
pub(crate) mod collinear;
pub(crate) mod exact;
pub(crate) mod grid;
pub(crate) mod position;
pub(crate) mod self_crossing;
pub(crate) mod sums;
pub(crate) mod tri_tri;
