//! Headers of a ZIP archive (APPNOTE 4.3.7, 4.3.12, 4.3.14 to 4.3.16).

/// Sizes and places from here on stand in the extra field for 64 bits.
pub(super) const WIDE: u64 = 0xffff_ffff;
const WIDE_FIELD: u16 = 1;
/// Versions of the format (APPNOTE 4.4.3.2).
pub(super) const NEEDED_FOR_DEFLATE: u16 = 20;
pub(super) const NEEDED_FOR_WIDE: u16 = 45;
/// Midnight of 1980-01-01, the earliest date that there is (APPNOTE 4.4.6): the same archive whenever it is written.
const EARLIEST: u32 = 0x0021_0000;

/// Name and time of an entry, and its header in the directory of the archive that it comes from.
#[derive(Clone, Copy)]
pub(super) struct Label<'l> {
    pub(super) name: &'l [u8],
    /// Time and date, as they stand.
    pub(super) time: u32,
    /// Empty for an entry that comes from no archive.
    pub(super) listed: &'l [u8],
}

impl<'l> Label<'l> {
    /// Of an entry that comes from no archive.
    pub(super) fn new(name: &'l str) -> Self {
        Self { name: name.as_bytes(), time: EARLIEST, listed: &[] }
    }
}

/// Where an entry stands in the new archive, and how large it is.
pub(super) struct Placed {
    pub(super) at: u64,
    /// The version of the format that is needed to read it, the same in both headers.
    pub(super) version: u16,
    pub(super) flags: u16,
    pub(super) method: u16,
    pub(super) crc: u32,
    pub(super) packed: u64,
    pub(super) plain: u64,
}

/// A field of a header.
pub(super) fn short(header: &[u8], at: usize) -> u16 {
    header.get(at..).and_then(|bytes| bytes.first_chunk()).copied().map_or(0, u16::from_le_bytes)
}

/// The value, or the sign that it stands in the extra field.
fn narrow(value: u64) -> u32 {
    value.min(WIDE) as u32
}

/// The header before an entry's data. Its length depends on the name and on `is_wide` alone.
pub(super) fn local(label: &Label<'_>, there: &Placed, is_wide: bool) -> Vec<u8> {
    let mut header = b"PK\x03\x04".to_vec();
    header.extend([there.version, there.flags, there.method].map(u16::to_le_bytes).as_flattened());
    header.extend(label.time.to_le_bytes());
    header.extend(there.crc.to_le_bytes());
    let sizes = if is_wide { [u32::MAX; 2] } else { [narrow(there.packed), narrow(there.plain)] };
    header.extend(sizes.map(u32::to_le_bytes).as_flattened());
    let extra: u16 = if is_wide { 20 } else { 0 };
    header.extend([label.name.len() as u16, extra].map(u16::to_le_bytes).as_flattened());
    header.extend_from_slice(label.name);
    if is_wide {
        header.extend([WIDE_FIELD, 16].map(u16::to_le_bytes).as_flattened());
        header.extend([there.plain, there.packed].map(u64::to_le_bytes).as_flattened());
    }
    header
}

/// The header in the central directory: the old one's fields, with what is of the new place and size.
pub(super) fn central(label: &Label<'_>, there: &Placed) -> Vec<u8> {
    let listed = label.listed;
    let [name, extra, comment] = [28, 30, 32].map(|at| usize::from(short(listed, at)));
    let old = listed.get(46 + name..46 + name + extra).unwrap_or_default();
    let comment = listed.get(46 + name + extra..46 + name + extra + comment).unwrap_or_default();
    let mut fields = without_wide(old);
    let wide: Vec<u64> = [there.plain, there.packed, there.at].into_iter().filter(|value| *value >= WIDE).collect();
    if !wide.is_empty() {
        fields.extend([WIDE_FIELD, 8 * wide.len() as u16].map(u16::to_le_bytes).as_flattened());
        wide.iter().for_each(|value| fields.extend(value.to_le_bytes()));
    }
    let version = there.version.max(if wide.is_empty() { 0 } else { NEEDED_FOR_WIDE });
    let made_by = if listed.is_empty() { version } else { short(listed, 4) };
    let mut header = b"PK\x01\x02".to_vec();
    header.extend([made_by, version, there.flags, there.method].map(u16::to_le_bytes).as_flattened());
    header.extend(label.time.to_le_bytes());
    header.extend([there.crc, narrow(there.packed), narrow(there.plain)].map(u32::to_le_bytes).as_flattened());
    header.extend([label.name.len(), fields.len(), comment.len()].map(|length| (length as u16).to_le_bytes()).as_flattened());
    // Disk, attributes.
    header.extend_from_slice(listed.get(34..42).unwrap_or(&[0; 8]));
    header.extend(narrow(there.at).to_le_bytes());
    header.extend_from_slice(label.name);
    header.extend_from_slice(&fields);
    header.extend_from_slice(comment);
    header
}

/// The end of an archive of so many entries, whose central directory stands in these bytes.
pub(super) fn end(count: u64, begin: u64, end: u64) -> Vec<u8> {
    let size = end - begin;
    let mut record = Vec::new();
    if count >= 0xffff || size >= WIDE || begin >= WIDE {
        record.extend(b"PK\x06\x06");
        record.extend(44u64.to_le_bytes());
        record.extend([45u16, 45].map(u16::to_le_bytes).as_flattened());
        record.extend([0u8; 8]);
        record.extend([count, count, size, begin].map(u64::to_le_bytes).as_flattened());
        record.extend(b"PK\x06\x07");
        record.extend(0u32.to_le_bytes());
        record.extend(end.to_le_bytes());
        record.extend(1u32.to_le_bytes());
    }
    let count = u16::try_from(count).unwrap_or(u16::MAX);
    record.extend(b"PK\x05\x06\0\0\0\0");
    record.extend([count, count].map(u16::to_le_bytes).as_flattened());
    record.extend([narrow(size), narrow(begin)].map(u32::to_le_bytes).as_flattened());
    record.extend([0, 0]);
    record
}

/// Extra fields without that for 64 bits.
fn without_wide(mut extra: &[u8]) -> Vec<u8> {
    let mut kept = Vec::new();
    while let [a, b, c, d, rest @ ..] = extra {
        let (id, length) = (u16::from_le_bytes([*a, *b]), usize::from(u16::from_le_bytes([*c, *d])));
        if rest.len() < length {
            break;
        }
        if id != WIDE_FIELD {
            kept.extend_from_slice(extra.get(..4 + length).unwrap_or_default());
        }
        extra = rest.get(length..).unwrap_or_default();
    }
    kept
}
