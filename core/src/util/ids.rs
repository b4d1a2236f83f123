//! Numbers of things, and the number that stands for no thing.
//!
//! Records, vertices, triangles, regions and components are numbered by `u32`, since their tables are the largest part of memory.

/// No record, vertex, triangle, region or component. Never a valid number: a file holds fewer records ([`crate::io::read::MAX_TRIANGLES`]).
pub(crate) const NONE: u32 = u32::MAX;
