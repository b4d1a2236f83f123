//! Surface that belongs together is joined: welds, T-junctions, gaps, overlaps, slits.

pub(crate) mod layer;
pub(crate) mod overlaps;
pub(crate) mod sew;
pub(crate) mod slits;
pub(crate) mod t_junctions;
pub(crate) mod weld;
pub(crate) mod zip;
