//! An entry's local header, which must say the same as the central directory (APPNOTE 4.3.7 to 4.3.9).

use std::ops::Range;

use super::super::finding::Rejection;
use super::central::{ENCRYPTED, Listed};
use super::entry::Method;
use super::fields::{long, short, widened, word};
use super::name::{self, refused};

const SIGNATURE: u32 = 0x0403_4b50;
const HEADER_BYTES: usize = 30;
/// Flag: CRC and sizes follow the data.
const DESCRIBED: u16 = 1 << 3;
const DESCRIPTOR: u32 = 0x0807_4b50;

/// Where an entry's bytes stand: all of it, and its data.
pub(super) fn check(bytes: &[u8], listed: &Listed<'_>) -> Result<(Range<usize>, Range<usize>), Rejection> {
    let refuse = |reason: &str| refused(&name::text(listed.name), reason);
    let from = usize::try_from(listed.local).ok().filter(|from| *from < bytes.len());
    let (from, header) = from
        .and_then(|from| Some((from, bytes.get(from..)?)))
        .filter(|(_, header)| word(header, 0) == Some(SIGNATURE))
        .ok_or_else(|| refuse("has no local header where the archive says"))?;
    let (name, data_at) = agree(header, listed).map_err(|field| {
        refuse(&match field {
            Some(field) => format!("has another {field} in its local header than in the central directory"),
            None => "has a local header that is cut off".into(),
        })
    })?;
    if name != listed.name {
        return Err(refuse("has another name in its local header than in the central directory"));
    }
    let packed = usize::try_from(listed.packed).ok();
    let end = packed.and_then(|packed| data_at.checked_add(packed)).filter(|end| *end <= header.len());
    let end = end.ok_or_else(|| refuse("is longer than the file"))?;
    let flags = short(header, 6).unwrap_or_default();
    let described = match flags & DESCRIBED {
        0 => 0,
        _ => descriptor(header.get(end..).unwrap_or_default(), listed)
            .ok_or_else(|| refuse("has a data descriptor that disagrees with the central directory"))?,
    };
    Ok((from..from + end + described, from + data_at..from + end))
}

/// The name of a local header, and where the data begins. An error names the field that disagrees, or is `None` for a header that ends early.
fn agree<'h>(header: &'h [u8], listed: &Listed<'_>) -> Result<(&'h [u8], usize), Option<&'static str>> {
    let name_length = short(header, 26).map(usize::from).ok_or(None)?;
    let extra_length = short(header, 28).map(usize::from).ok_or(None)?;
    let extra_at = HEADER_BYTES + name_length;
    let data_at = extra_at + extra_length;
    let name = header.get(HEADER_BYTES..extra_at).ok_or(None)?;
    let extra = header.get(extra_at..data_at).ok_or(None)?;
    let [flags, method] = [6, 8].map(|at| short(header, at).unwrap_or_default());
    let [crc, packed, plain] = [14, 18, 22].map(|at| word(header, at).unwrap_or_default());
    let [plain, packed] = widened([plain, packed], extra).ok_or(Some("size"))?;
    let expected = match listed.method {
        Method::Stored => 0,
        Method::Deflated => 8,
    };
    if method != expected {
        return Err(Some("method"));
    }
    if (flags ^ listed.flags) & (ENCRYPTED | DESCRIBED) != 0 {
        return Err(Some("set of flags"));
    }
    // Nothing is known yet where a descriptor follows, which is said by zeros.
    let same = |here: u64, there: u64| here == there || (flags & DESCRIBED != 0 && here == 0);
    if !same(packed, listed.packed) || !same(plain, listed.plain) {
        return Err(Some("size"));
    }
    if !same(crc.into(), listed.crc.into()) {
        return Err(Some("checksum"));
    }
    Ok((name, data_at))
}

/// Bytes of the data descriptor: with a signature or without, with sizes of 32 bits or of 64. `None` if none of them says what the directory does.
fn descriptor(bytes: &[u8], listed: &Listed<'_>) -> Option<usize> {
    let signature = if word(bytes, 0) == Some(DESCRIPTOR) { 4 } else { 0 };
    // A checksum may look like the signature.
    [signature, 0].into_iter().find_map(|from| {
        let fields = bytes.get(from..)?;
        (word(fields, 0)? == listed.crc).then_some(())?;
        let narrow = || Some([word(fields, 4)?.into(), word(fields, 8)?.into()]);
        let wide = || Some([long(fields, 4)?, long(fields, 12)?]);
        let sizes = Some([listed.packed, listed.plain]);
        // The wide form first: its upper halves of zero are nothing that another header begins with.
        if wide() == sizes { Some(from + 20) } else { (narrow() == sizes).then_some(from + 12) }
    })
}
