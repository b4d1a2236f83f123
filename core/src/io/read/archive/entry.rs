//! One entry of an archive.

use std::ops::Range;

/// How an entry's bytes are held (APPNOTE 4.4.5).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) enum Method {
    Stored,
    Deflated,
}

/// An entry that was checked against its local header and against all others.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in super::super) struct Entry {
    /// The name as text; bytes that are no UTF-8 are U+FFFD.
    pub(in super::super) name: String,
    /// The name as it stands.
    pub(in super::super) raw_name: Vec<u8>,
    pub(in super::super) method: Method,
    /// Bytes in the archive, as they are held.
    pub(in super::super) packed: u64,
    /// Bytes of the content, as the archive claims.
    pub(in super::super) plain: u64,
    /// CRC-32 of the content, as the archive claims.
    pub(in super::super) crc: u32,
    /// Flags of the central directory (APPNOTE 4.4.4).
    pub(in super::super) flags: u16,
    /// Time and date, as they stand (APPNOTE 4.4.6).
    pub(in super::super) time: u32,
    /// Where local header, data and data descriptor stand in the archive. A copy of these bytes is the entry.
    pub(in super::super) whole: Range<usize>,
    /// Where the packed bytes stand in the archive.
    pub(in super::super) data: Range<usize>,
    /// Where its header stands in the central directory of the archive.
    pub(in super::super) listed: Range<usize>,
}

impl Entry {
    /// A folder, which has no content.
    pub(in super::super) fn is_folder(&self) -> bool {
        self.raw_name.ends_with(b"/")
    }
}
