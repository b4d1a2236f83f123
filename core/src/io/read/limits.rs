//! Numbers that the form of a binary STL sets.

/// Bytes of a binary STL before its count.
pub const HEADER_BYTES: usize = 80;

/// Bytes of a binary STL before its first record.
pub const PREFIX_BYTES: usize = HEADER_BYTES + 4;

/// Most triangles a binary STL's count can hold, hence the most we read.
pub const MAX_TRIANGLES: u64 = u32::MAX as u64;
