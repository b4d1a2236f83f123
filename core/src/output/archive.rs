//! A ZIP archive written anew: entries that changed are packed, all others are copied as they stand.
//!
//! **In:** an [`Archive`], and the new content of some of its entries.
//! **Out:** an archive of the same entries in the same order.
//! **Promise:** local header, data and descriptor of an entry that is kept are the same bytes. The same bytes come out for any number of threads.
//!
//! By PKWARE's APPNOTE.TXT 6.3.10, sections 4.3 and 4.5.3. Content is deflated in blocks that know nothing of each other, side by side, each but the
//! last ended by an empty stored block (RFC 1951, section 3.2.4), so that one after the other they are one stream.

use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::Path;

use flate2::{Compress, Compression, FlushCompress};
use rayon::prelude::*;

use crate::contract::error::{Error, Result};
use crate::contract::progress::Progress;
use crate::contract::settings::Limits;
use crate::io::read::{Archive, Entry};
use crate::io::write_behind::WriteBehind;
use crate::output::emit;
use crate::util::parallel;

/// Bytes of content that are deflated by one thread at a time.
const BLOCK: usize = 1 << 20;
/// Sizes and places from here on stand in the extra field for 64 bits.
const WIDE: u64 = 0xffff_ffff;
/// A content of this length may be longer than 32 bits count when it is packed.
const MAYBE_WIDE: usize = 0xf000_0000;
const WIDE_FIELD: u16 = 1;
/// Versions of the format (APPNOTE 4.4.3.2).
const NEEDED_FOR_DEFLATE: u16 = 20;
const NEEDED_FOR_WIDE: u16 = 45;
/// Flag: names and comments are UTF-8.
const UTF8: u16 = 1 << 11;
const DEFLATED: u16 = 8;

/// Where an entry stands in the new archive, and how large it is.
struct Placed {
    at: u64,
    /// The version of the format that is needed to read it, the same in both headers.
    version: u16,
    flags: u16,
    method: u16,
    crc: u32,
    packed: u64,
    plain: u64,
}

/// The new archive, as far as it is written.
struct Writer<'a> {
    output: &'a Path,
    file: &'a File,
    behind: WriteBehind,
    at: u64,
    progress: &'a dyn Progress,
}

/// Writes `archive` to the new file `output`, with the content that `replaced` gives for the entry of a number, and syncs it unless that is deferred.
///
/// # Errors
/// [`Error::Io`], cancellation among them.
pub(crate) fn write<'c>(
    archive: &Archive<'_>,
    replaced: impl Fn(usize) -> Option<&'c [u8]>,
    output: &Path,
    limits: &Limits,
    progress: &dyn Progress,
) -> Result<()> {
    let file = emit::create(output).map_err(Error::io(output, "creating"))?;
    let behind = WriteBehind::new(&file, limits).map_err(Error::io(output, "creating"))?;
    let mut writer = Writer { output, file: &file, behind, at: 0, progress };
    // In the order in which they stand in the archive.
    let mut order: Vec<usize> = (0..archive.entries.len()).collect();
    order.sort_by_key(|number| archive.entries.get(*number).map(|entry| entry.whole.start));
    let mut placed: Vec<(usize, Placed)> = Vec::with_capacity(order.len());
    for number in order {
        let Some(entry) = archive.entries.get(number) else { continue };
        let there = match replaced(number) {
            Some(content) => {
                let listed = archive.bytes.get(entry.listed.clone()).unwrap_or_default();
                parallel::in_pool(limits.threads, || writer.pack((entry, listed), content))?
            }
            None => writer.keep(archive, entry)?,
        };
        placed.push((number, there));
    }
    placed.sort_by_key(|(number, _)| *number);
    writer.list(archive, &placed)?;
    writer.behind.finish().map_err(Error::io(output, "syncing"))?;
    if limits.defer_sync { Ok(()) } else { file.sync_all().map_err(Error::io(output, "syncing")) }
}

impl Writer<'_> {
    fn append(&mut self, bytes: &[u8]) -> Result<()> {
        self.at += bytes.len() as u64;
        self.behind.append(bytes).map_err(Error::io(self.output, "writing"))?;
        if self.progress.cancelled() { Err(Error::cancelled(self.output, "writing")) } else { Ok(()) }
    }

    fn keep(&mut self, archive: &Archive<'_>, entry: &Entry) -> Result<Placed> {
        let at = self.at;
        for part in archive.bytes.get(entry.whole.clone()).unwrap_or_default().chunks(BLOCK) {
            self.append(part)?;
        }
        let method = entry.method.number();
        let listed = archive.bytes.get(entry.listed.clone()).unwrap_or_default();
        Ok(Placed {
            at,
            version: short(listed, 6),
            flags: entry.flags,
            method,
            crc: entry.crc,
            packed: entry.packed,
            plain: entry.plain,
        })
    }

    /// Packs a content; its header is written once its sizes are known.
    fn pack(&mut self, (entry, listed): (&Entry, &[u8]), content: &[u8]) -> Result<Placed> {
        let at = self.at;
        let is_wide = content.len() >= MAYBE_WIDE;
        let plain = content.len() as u64;
        let version = short(listed, 6).max(if is_wide { NEEDED_FOR_WIDE } else { NEEDED_FOR_DEFLATE });
        let mut there = Placed { at, version, flags: entry.flags & UTF8, method: DEFLATED, crc: 0, packed: 0, plain };
        self.append(&local_header(entry, &there, is_wide))?;
        let mut hasher = crc32fast::Hasher::new();
        let begin = self.at;
        let blocks: Vec<&[u8]> = content.chunks(BLOCK).collect();
        let last = blocks.len().saturating_sub(1);
        let batch = 2 * rayon::current_num_threads();
        for (round, group) in blocks.chunks(batch).enumerate() {
            let deflated = |(k, block): (usize, &&[u8])| (deflate(block, round * batch + k == last), crc32fast::hash(block));
            let packed: Vec<(Option<Vec<u8>>, u32)> = group.par_iter().enumerate().map(deflated).collect();
            for (block, (packed, crc)) in group.iter().zip(packed) {
                let packed = packed.ok_or_else(|| Error::io(self.output, "packing")(std::io::ErrorKind::InvalidData.into()))?;
                hasher.combine(&crc32fast::Hasher::new_with_initial_len(crc, block.len() as u64));
                self.append(&packed)?;
            }
            self.progress.at("pack", ((round * batch + group.len()) * BLOCK).min(content.len()) as u64, plain);
        }
        if blocks.is_empty() {
            self.append(&[3, 0])?;
        }
        (there.crc, there.packed) = (hasher.finalize(), self.at - begin);
        let header = local_header(entry, &there, is_wide);
        self.file.write_all_at(&header, at).map_err(Error::io(self.output, "writing"))?;
        Ok(there)
    }

    /// The central directory and its end.
    fn list(&mut self, archive: &Archive<'_>, placed: &[(usize, Placed)]) -> Result<()> {
        let begin = self.at;
        for (number, there) in placed {
            let Some(entry) = archive.entries.get(*number) else { continue };
            let listed = archive.bytes.get(entry.listed.clone()).unwrap_or_default();
            self.append(&central_header(listed, entry, there))?;
        }
        let (count, size, end) = (placed.len() as u64, self.at - begin, self.at);
        if count >= 0xffff || size >= WIDE || begin >= WIDE {
            let mut record = b"PK\x06\x06".to_vec();
            record.extend(44u64.to_le_bytes());
            record.extend([45u16, 45].map(u16::to_le_bytes).as_flattened());
            record.extend([0u8; 8]);
            record.extend([count, count, size, begin].map(u64::to_le_bytes).as_flattened());
            record.extend(b"PK\x06\x07");
            record.extend(0u32.to_le_bytes());
            record.extend(end.to_le_bytes());
            record.extend(1u32.to_le_bytes());
            self.append(&record)?;
        }
        let count_of = |value: u64| u16::try_from(value).unwrap_or(u16::MAX);
        let mut record = b"PK\x05\x06\0\0\0\0".to_vec();
        record.extend([count_of(count), count_of(count)].map(u16::to_le_bytes).as_flattened());
        record.extend([narrow(size), narrow(begin)].map(u32::to_le_bytes).as_flattened());
        record.extend([0, 0]);
        self.append(&record)
    }
}

/// A field of a header.
fn short(header: &[u8], at: usize) -> u16 {
    header.get(at..).and_then(|bytes| bytes.first_chunk()).copied().map_or(0, u16::from_le_bytes)
}

/// The value, or the sign that it stands in the extra field.
fn narrow(value: u64) -> u32 {
    value.min(WIDE) as u32
}

/// One block of a deflate stream; the stream ends with it if it is the last.
fn deflate(block: &[u8], is_last: bool) -> Option<Vec<u8>> {
    let mut stream = Compress::new(Compression::new(6), false);
    let mut packed = Vec::with_capacity(block.len() / 2 + 1024);
    let flush = if is_last { FlushCompress::Finish } else { FlushCompress::Sync };
    loop {
        let rest = block.get(usize::try_from(stream.total_in()).ok()?..)?;
        let made = stream.total_out();
        stream.compress_vec(rest, &mut packed, flush).ok()?;
        let has_room = packed.len() < packed.capacity();
        if stream.total_in() as usize == block.len() && has_room {
            return Some(packed);
        }
        if stream.total_out() == made && has_room {
            return None;
        }
        packed.reserve(block.len() / 4 + 1024);
    }
}

fn local_header(entry: &Entry, there: &Placed, is_wide: bool) -> Vec<u8> {
    let mut header = b"PK\x03\x04".to_vec();
    header.extend([there.version, there.flags, there.method].map(u16::to_le_bytes).as_flattened());
    header.extend(entry.time.to_le_bytes());
    header.extend(there.crc.to_le_bytes());
    let sizes = if is_wide { [u32::MAX; 2] } else { [narrow(there.packed), narrow(there.plain)] };
    header.extend(sizes.map(u32::to_le_bytes).as_flattened());
    let extra: u16 = if is_wide { 20 } else { 0 };
    header.extend([entry.raw_name.len() as u16, extra].map(u16::to_le_bytes).as_flattened());
    header.extend_from_slice(&entry.raw_name);
    if is_wide {
        header.extend([WIDE_FIELD, 16].map(u16::to_le_bytes).as_flattened());
        header.extend([there.plain, there.packed].map(u64::to_le_bytes).as_flattened());
    }
    header
}

/// The header in the central directory: the old one's fields, with what is of the new place and size. `listed`: the old one.
fn central_header(listed: &[u8], entry: &Entry, there: &Placed) -> Vec<u8> {
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
    let mut header = b"PK\x01\x02".to_vec();
    header.extend([short(listed, 4), version, there.flags, there.method].map(u16::to_le_bytes).as_flattened());
    header.extend(entry.time.to_le_bytes());
    header.extend([there.crc, narrow(there.packed), narrow(there.plain)].map(u32::to_le_bytes).as_flattened());
    header.extend([entry.raw_name.len(), fields.len(), comment.len()].map(|length| (length as u16).to_le_bytes()).as_flattened());
    // Disk, attributes.
    header.extend_from_slice(listed.get(34..42).unwrap_or(&[0; 8]));
    header.extend(narrow(there.at).to_le_bytes());
    header.extend_from_slice(&entry.raw_name);
    header.extend_from_slice(&fields);
    header.extend_from_slice(comment);
    header
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
