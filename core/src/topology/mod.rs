//! Topology: from chunks to what is sound and what is not, over the whole file.

pub(crate) mod chunk;
pub(crate) mod chunk_regions;
pub(crate) mod crossings;
pub(crate) mod intersect;
pub(crate) mod labels;
pub(crate) mod patch_sums;
pub(crate) mod solving;
pub(crate) mod star;
pub(crate) mod survey;
pub(crate) mod vertex_table;
