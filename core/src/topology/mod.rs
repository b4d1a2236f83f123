//! Topology: from chunks to what is regular and what is not, over the whole file.
//!
//! **In:** the chunks of [`crate::stream`].
//! **Out:** a [`survey::Survey`]: the triangles around irregular vertices, regular surface as regions with exact sums, and the pairs of
//! triangles that intersect ([`intersect`]).
//! **Promise:** every vertex is decided by one chunk, which sees its whole star, and every pair of triangles by one owner. So the survey
//! depends on the mesh alone, and not on chunks, memory or threads.

pub(crate) mod chunk;
pub(crate) mod chunk_regions;
pub(crate) mod crossings;
pub(crate) mod everywhere;
pub(crate) mod intersect;
pub(crate) mod labels;
pub(crate) mod region_sums;
pub(crate) mod room;
pub(crate) mod solving;
pub(crate) mod star;
pub(crate) mod survey;
pub(crate) mod vertex_table;
