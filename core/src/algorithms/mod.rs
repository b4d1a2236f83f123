//! Algorithms: surface that is made new: fills, fair patches, wraps.

pub(crate) mod fairing;
pub(crate) mod triangulate;
pub(crate) mod wrap;
