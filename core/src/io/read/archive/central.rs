//! One header of the central directory (APPNOTE 4.3.12).

use super::super::finding::Rejection;
use super::entry::Method;
use super::fields::{extra, short, widened, word};
use super::name::{self, refused};
use crate::util::words::Count;

const SIGNATURE: u32 = 0x0201_4b50;
/// Bytes of a header before its name.
pub(super) const HEADER_BYTES: usize = 46;
/// Flags of encryption: of the data, strong, and of the headers (APPNOTE 4.4.4).
pub(super) const ENCRYPTED: u16 = 1 | 1 << 6 | 1 << 13;
/// Id of the extra field with another name (APPNOTE 4.6.9).
const UNICODE_PATH: u16 = 0x7075;
/// More plain bytes for one packed byte than deflate can make: 258 bytes by two bits.
const HIGHEST_RATIO: u64 = 1032;

/// An entry as the central directory has it.
#[derive(Clone, Debug)]
pub(super) struct Listed<'a> {
    pub(super) name: &'a [u8],
    pub(super) method: Method,
    pub(super) flags: u16,
    pub(super) time: u32,
    pub(super) crc: u32,
    pub(super) packed: u64,
    pub(super) plain: u64,
    /// Where the local header stands.
    pub(super) local: u64,
    /// Bytes of this header.
    pub(super) length: usize,
}

/// The fields of the header at the beginning of `bytes`; `None` where it ends early or is none.
fn parse(bytes: &[u8]) -> Option<(Listed<'_>, u16, u32, &[u8])> {
    (word(bytes, 0)? == SIGNATURE).then_some(())?;
    let [name, extra, comment] = [28, 30, 32].map(|at| short(bytes, at).map(usize::from));
    let (extra_at, comment_at) = (HEADER_BYTES + name?, HEADER_BYTES + name? + extra?);
    let length = comment_at + comment?;
    bytes.get(..length)?;
    let extra = bytes.get(extra_at..comment_at)?;
    let [plain, packed, local] = widened([word(bytes, 24)?, word(bytes, 20)?, word(bytes, 42)?], extra)?;
    let listed = Listed {
        name: bytes.get(HEADER_BYTES..extra_at)?,
        method: Method::Stored,
        flags: short(bytes, 8)?,
        time: word(bytes, 12)?,
        crc: word(bytes, 16)?,
        packed,
        plain,
        local,
        length,
    };
    Some((listed, short(bytes, 10)?, word(bytes, 38)?, extra))
}

/// Reads the header at the beginning of `bytes`, the `number`th from 1, and refuses an entry that is not for us.
pub(super) fn read(bytes: &[u8], number: usize) -> Result<Listed<'_>, Rejection> {
    let Some((listed, method, attributes, extra_fields)) = parse(bytes) else {
        let reason = format!("entry {} of the archive's central directory is damaged or cut off", Count(number));
        return Err(Rejection::Unreadable(reason));
    };
    name::check(listed.name)?;
    let refuse = |reason: &str| Err(refused(&name::text(listed.name), reason));
    if other_name(extra_fields, listed.name) {
        return refuse("has two names");
    }
    if listed.flags & ENCRYPTED != 0 {
        return refuse("is encrypted");
    }
    let method = match method {
        0 => Method::Stored,
        8 => Method::Deflated,
        other => return refuse(&format!("is compressed by {}, not by deflate", method_name(other))),
    };
    // The upper half is the mode of Unix, as all programs write it that know links.
    if attributes >> 28 == 0o12 {
        return refuse("is a symbolic link");
    }
    let possible = match method {
        Method::Stored => listed.plain == listed.packed,
        Method::Deflated => listed.plain <= listed.packed.saturating_mul(HIGHEST_RATIO),
    };
    if !possible {
        let reason = format!("claims {} bytes in {}, which is impossible", Count(listed.plain), Count(listed.packed));
        return refuse(&reason);
    }
    Ok(Listed { method, ..listed })
}

/// An extra field has another name for the same entry, which some readers take.
fn other_name(extra_fields: &[u8], name: &[u8]) -> bool {
    extra(extra_fields, UNICODE_PATH).is_some_and(|field| {
        let of_this = word(field, 1) == Some(crc32fast::hash(name));
        of_this && field.first() == Some(&1) && field.get(5..) != Some(name)
    })
}

/// Methods by name (APPNOTE 4.4.5).
fn method_name(method: u16) -> String {
    let name = match method {
        1 => "shrink",
        2..=5 => "reduce",
        6 => "implode",
        9 => "Deflate64",
        12 => "bzip2",
        14 => "LZMA",
        93 => "Zstandard",
        95 => "XZ",
        98 => "PPMd",
        99 => "AES",
        other => return format!("method {other}"),
    };
    name.into()
}
