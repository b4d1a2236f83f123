//! Numbers that the form of a binary STL sets, a bound of what a file makes of itself, and the lengths of windows.

/// Bytes of a binary STL before its count.
pub const HEADER_BYTES: usize = 80;

/// Bytes of a binary STL before its first record.
pub const PREFIX_BYTES: usize = HEADER_BYTES + 4;

/// Most triangles a binary STL's count can hold, hence the most we read.
pub const MAX_TRIANGLES: u64 = u32::MAX as u64;

/// Triangles that copies of objects may have, at most: so many, and so many for each byte of the file. A mebibyte of copies of copies would else fill
/// a disk.
const COPIES: u64 = 16 << 20;
const COPIES_A_BYTE: u64 = 16;

/// Most triangles that a file of so many bytes makes by placing objects again that it has placed already.
pub(super) fn most_copies(bytes: usize) -> u64 {
    COPIES + COPIES_A_BYTE * bytes as u64
}

/// Bytes that one thread reads at a time. While the readers are fuzzed these are few, so that small files have several windows.
pub(super) const fn window(bytes: usize) -> usize {
    if cfg!(all(fuzzing, debug_assertions)) { 512 } else { bytes }
}
