//! ZIP archives for tests, sound ones and such that lie.

use std::io::Write;

use flate2::Compression;
use flate2::write::DeflateEncoder;

/// An entry, and how its headers differ from the truth.
#[derive(Clone, Default)]
pub(crate) struct Member {
    pub(crate) name: Vec<u8>,
    pub(crate) content: Vec<u8>,
    pub(crate) stored: bool,
    /// Sizes and CRC stand behind the data.
    pub(crate) described: bool,
    /// Sizes stand in the ZIP64 extra field.
    pub(crate) wide: bool,
    /// Name in the local header, if it is another one.
    pub(crate) local_name: Option<Vec<u8>>,
    /// Added to the plain size in both headers.
    pub(crate) more: i64,
    /// Added to the plain size in the local header alone.
    pub(crate) local_more: i64,
    pub(crate) wrong_crc: bool,
    pub(crate) flags: u16,
    /// Method in both headers, if it is another one.
    pub(crate) method: Option<u16>,
    /// Attributes of the central directory.
    pub(crate) attributes: u32,
    /// The local header of this entry stands for it.
    pub(crate) same_as: Option<usize>,
}

/// A deflated entry.
pub(crate) fn member(name: &str, content: impl AsRef<[u8]>) -> Member {
    Member { name: name.into(), content: content.as_ref().to_vec(), ..Member::default() }
}

pub(crate) fn deflate(content: &[u8]) -> Vec<u8> {
    let mut encoder = DeflateEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(content).unwrap();
    encoder.finish().unwrap()
}

/// An archive of these, with a comment.
pub(crate) fn zip(members: &[Member]) -> Vec<u8> {
    let (mut bytes, mut central, mut places) = (Vec::new(), Vec::new(), Vec::new());
    for member in members {
        let place = member.same_as.map_or(bytes.len(), |of| places[of]);
        places.push(place);
        let packed = if member.stored { member.content.clone() } else { deflate(&member.content) };
        let method = member.method.unwrap_or(if member.stored { 0 } else { 8 });
        let flags = member.flags | if member.described { 8 } else { 0 };
        let crc = crc32fast::hash(&member.content) ^ u32::from(member.wrong_crc);
        let plain = member.content.len() as u64;
        let size = plain.wrapping_add_signed(member.more);
        let sizes = [size.wrapping_add_signed(member.local_more), packed.len() as u64];
        if member.same_as.is_none() {
            let known = if member.described { (0, [0, 0]) } else { (crc, sizes) };
            let name = member.local_name.as_ref().unwrap_or(&member.name);
            bytes.extend(b"PK\x03\x04");
            bytes.extend(header(flags, method, known, name, member.wide));
            bytes.extend(name);
            bytes.extend(extra(known.1, member.wide));
            bytes.extend(&packed);
            if member.described {
                bytes.extend(b"PK\x07\x08");
                bytes.extend(crc.to_le_bytes());
                for size in [packed.len() as u64, size] {
                    if member.wide { bytes.extend(size.to_le_bytes()) } else { bytes.extend((size as u32).to_le_bytes()) }
                }
            }
        }
        let sizes = [size, packed.len() as u64];
        central.extend(b"PK\x01\x02\x14\0");
        central.extend(header(flags, method, (crc, sizes), &member.name, member.wide));
        central.extend([0; 6]);
        central.extend(member.attributes.to_le_bytes());
        central.extend((place as u32).to_le_bytes());
        central.extend(&member.name);
        central.extend(extra(sizes, member.wide));
    }
    let wide = members.iter().any(|member| member.wide);
    let (count, size, offset) = (members.len() as u64, central.len() as u64, bytes.len() as u64);
    bytes.extend(central);
    end(&mut bytes, count, size, offset, wide);
    bytes
}

/// Version, flags, method, time, CRC, sizes (plain, packed) and lengths, as both headers have them.
fn header(flags: u16, method: u16, (crc, [plain, packed]): (u32, [u64; 2]), name: &[u8], wide: bool) -> Vec<u8> {
    let mut fields = 20u16.to_le_bytes().to_vec();
    fields.extend([flags, method, 0x6000, 0x5b21].map(u16::to_le_bytes).as_flattened());
    fields.extend(crc.to_le_bytes());
    let sizes = if wide { [u32::MAX; 2] } else { [packed as u32, plain as u32] };
    fields.extend(sizes.map(u32::to_le_bytes).as_flattened());
    fields.extend([name.len() as u16, if wide { 20 } else { 0 }].map(u16::to_le_bytes).as_flattened());
    fields
}

fn extra(sizes: [u64; 2], wide: bool) -> Vec<u8> {
    let mut field = Vec::new();
    if wide {
        field.extend([1, 0, 16, 0]);
        field.extend(sizes.map(u64::to_le_bytes).as_flattened());
    }
    field
}

/// The end of an archive.
pub(super) fn end(bytes: &mut Vec<u8>, count: u64, size: u64, offset: u64, wide: bool) {
    if wide {
        let at = bytes.len() as u64;
        bytes.extend(b"PK\x06\x06");
        bytes.extend(44u64.to_le_bytes());
        bytes.extend([45, 0, 45, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
        bytes.extend([count, count, size, offset].map(u64::to_le_bytes).as_flattened());
        bytes.extend(b"PK\x06\x07\0\0\0\0");
        bytes.extend(at.to_le_bytes());
        bytes.extend([1, 0, 0, 0]);
    }
    bytes.extend(b"PK\x05\x06\0\0\0\0");
    let counts = if wide { [u16::MAX; 2] } else { [count as u16; 2] };
    bytes.extend(counts.map(u16::to_le_bytes).as_flattened());
    let places = if wide { [u32::MAX; 2] } else { [size as u32, offset as u32] };
    bytes.extend(places.map(u32::to_le_bytes).as_flattened());
    bytes.extend([7, 0]);
    bytes.extend(b"comment");
}
