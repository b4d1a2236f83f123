//! ZIP archives: written with entries as they are, read with these and deflated ones.

use std::io::Read;

/// Flag of an entry whose data is encrypted (APPNOTE 4.4.4).
pub const ENCRYPTED: u16 = 1;

/// An entry that was read.
pub struct Entry {
    pub name: String,
    /// Its plain bytes.
    pub content: Vec<u8>,
    /// Local header and data, as they stand.
    pub raw: Vec<u8>,
}

/// An archive of these names and contents; each has these flags.
pub fn write(entries: &[(&str, &[u8])], flags: u16) -> Vec<u8> {
    let (mut bytes, mut central) = (Vec::new(), Vec::new());
    for (name, content) in entries {
        let (place, size) = (bytes.len() as u32, content.len() as u32);
        // Version, flags, method, time and date of 2026-11-27, checksum, sizes, lengths of name and extra field.
        let mut header = [20, flags, 0, 0, 0x5d7b].map(u16::to_le_bytes).concat();
        header.extend([crc(content), size, size].map(u32::to_le_bytes).concat());
        header.extend([name.len() as u16, 0].map(u16::to_le_bytes).concat());
        bytes.extend([b"PK\x03\x04", &header[..], name.as_bytes(), content].concat());
        let place = [&[0; 10][..], &place.to_le_bytes()].concat();
        central.extend([b"PK\x01\x02\x14\0", &header[..], &place, name.as_bytes()].concat());
    }
    let [count, size, place] = [entries.len(), central.len(), bytes.len()];
    bytes.extend(central);
    bytes.extend(b"PK\x05\x06\0\0\0\0");
    bytes.extend([count as u16; 2].map(u16::to_le_bytes).concat());
    bytes.extend([size as u32, place as u32].map(u32::to_le_bytes).concat());
    bytes.extend([0; 2]);
    bytes
}

/// The entries of an archive without a comment, in the order of its directory.
///
/// # Panics
/// When it is none, or the checksum of an entry is wrong.
pub fn read(bytes: &[u8]) -> Vec<Entry> {
    let short = |at: usize| usize::from(u16::from_le_bytes(bytes[at..at + 2].try_into().expect("two bytes")));
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes")) as usize;
    let end = bytes.len() - 22;
    assert!(bytes[end..].starts_with(b"PK\x05\x06"), "the end of an archive");
    let mut at = word(end + 16);
    let mut entries = Vec::new();
    for _ in 0..short(end + 10) {
        assert!(bytes[at..].starts_with(b"PK\x01\x02"), "an entry of the directory");
        let (packed, local) = (word(at + 20), word(at + 42));
        let name = String::from_utf8(bytes[at + 46..at + 46 + short(at + 28)].to_vec()).expect("a name in UTF-8");
        let from = local + 30 + short(local + 26) + short(local + 28);
        let data = &bytes[from..from + packed];
        let content = match short(at + 10) {
            0 => data.to_vec(),
            _ => {
                let mut plain = Vec::new();
                flate2::read::DeflateDecoder::new(data).read_to_end(&mut plain).expect("deflated data");
                plain
            }
        };
        assert_eq!(crc(&content) as usize, word(at + 16), "the checksum of {name}");
        entries.push(Entry { name, content, raw: bytes[local..from + packed].to_vec() });
        at += 46 + short(at + 28) + short(at + 30) + short(at + 32);
    }
    entries
}

/// CRC-32, bit by bit.
fn crc(bytes: &[u8]) -> u32 {
    let step = |crc: u32| (0..8).fold(crc, |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 });
    !bytes.iter().fold(!0, |crc, byte| step(crc ^ u32::from(*byte)))
}
