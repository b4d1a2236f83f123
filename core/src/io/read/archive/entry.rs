//! One entry of an archive.

use std::ops::Range;

/// How an entry's bytes are held (APPNOTE 4.4.5).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Method {
    Stored,
    Deflated,
}

impl Method {
    /// As archives say it.
    pub(crate) fn number(self) -> u16 {
        match self {
            Self::Stored => 0,
            Self::Deflated => 8,
        }
    }
}

/// An entry that was checked against its local header and against all others.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Entry {
    /// The name as text; bytes that are no UTF-8 are U+FFFD.
    pub(crate) name: String,
    /// The name as it stands.
    pub(crate) raw_name: Vec<u8>,
    pub(crate) method: Method,
    /// Bytes in the archive, as they are held.
    pub(crate) packed: u64,
    /// Bytes of the content, as the archive claims.
    pub(crate) plain: u64,
    /// CRC-32 of the content, as the archive claims.
    pub(crate) crc: u32,
    /// Flags of the central directory (APPNOTE 4.4.4).
    pub(crate) flags: u16,
    /// Time and date, as they stand (APPNOTE 4.4.6).
    pub(crate) time: u32,
    /// Where local header, data and data descriptor stand in the archive. A copy of these bytes is the entry.
    pub(crate) whole: Range<usize>,
    /// Where the packed bytes stand in the archive.
    pub(crate) data: Range<usize>,
    /// Where its header stands in the central directory of the archive.
    pub(crate) listed: Range<usize>,
}

impl Entry {
    /// A folder, which has no content.
    pub(crate) fn is_folder(&self) -> bool {
        self.raw_name.ends_with(b"/")
    }
}
