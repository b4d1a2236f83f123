//! The new archive, as far as it is written.
//!
//! Content is deflated in blocks that know nothing of each other, side by side, each but the last ended by an empty stored block (RFC 1951, section
//! 3.2.4), so that one after the other they are one stream. Memory: some blocks a thread, whatever the length of the content.

use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::Path;

use flate2::{Compress, Compression, FlushCompress};
use rayon::prelude::*;

use super::headers::{self, Label, NEEDED_FOR_DEFLATE, NEEDED_FOR_WIDE, Placed, WIDE, short};
use crate::contract::error::{Error, Result};
use crate::contract::progress::Progress;
use crate::contract::settings::Limits;
use crate::io::write_behind::WriteBehind;
use crate::output::emit;

/// Bytes of content that are deflated by one thread at a time.
pub(super) const BLOCK: usize = 1 << 20;
/// Texts of models become 1 % larger than at 6, the usual level, in half of the time (measured).
const LEVEL: u32 = 4;
/// A content of this length may be longer than 32 bits count when it is packed.
const MAYBE_WIDE: u64 = 0xf000_0000;
/// Flag: names and comments are UTF-8.
const UTF8: u16 = 1 << 11;
const DEFLATED: u16 = 8;
/// A deflate stream of nothing.
const NOTHING: [u8; 2] = [3, 0];

/// The new archive, as far as it is written.
pub(super) struct Writer<'a> {
    output: &'a Path,
    file: File,
    behind: WriteBehind,
    at: u64,
    progress: &'a dyn Progress,
}

impl<'a> Writer<'a> {
    /// Of the new file `output`.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub(super) fn new(output: &'a Path, limits: &Limits, progress: &'a dyn Progress) -> Result<Self> {
        let file = emit::create(output).map_err(Error::io(output, "creating"))?;
        let behind = WriteBehind::new(&file, limits).map_err(Error::io(output, "creating"))?;
        Ok(Self { output, file, behind, at: 0, progress })
    }

    /// So many bytes are written.
    pub(super) fn at(&self) -> u64 {
        self.at
    }

    /// Appends bytes as they are.
    ///
    /// # Errors
    /// [`Error::Io`], cancellation among them.
    pub(super) fn append(&mut self, bytes: &[u8]) -> Result<()> {
        self.at += bytes.len() as u64;
        self.behind.append(bytes).map_err(Error::io(self.output, "writing"))?;
        if self.progress.cancelled() { Err(Error::cancelled(self.output, "writing")) } else { Ok(()) }
    }

    /// Packs the content that `fill` gives, which is at most so many bytes long. Its header is written once its sizes are known. Call it within a pool
    /// of threads.
    ///
    /// # Errors
    /// [`Error::Io`], cancellation among them, and those of `fill`.
    pub(super) fn pack(
        &mut self,
        (label, flags): (&Label<'_>, u16),
        most: u64,
        fill: impl FnOnce(&mut Content<'_, 'a>) -> Result<()>,
    ) -> Result<Placed> {
        let at = self.at;
        let is_wide = most >= MAYBE_WIDE;
        let version = short(label.listed, 6).max(if is_wide { NEEDED_FOR_WIDE } else { NEEDED_FOR_DEFLATE });
        let mut there = Placed { at, version, flags: flags & UTF8, method: DEFLATED, crc: 0, packed: 0, plain: 0 };
        self.append(&headers::local(label, &there, is_wide))?;
        let begin = self.at;
        let mut content = Content { writer: self, waiting: Vec::new(), hasher: crc32fast::Hasher::new(), plain: 0 };
        fill(&mut content)?;
        content.deflate(true)?;
        let Content { hasher, plain, .. } = content;
        (there.crc, there.packed, there.plain) = (hasher.finalize(), self.at - begin, plain);
        if !is_wide && there.plain.max(there.packed) >= WIDE {
            return Err(Error::io(self.output, "packing")(std::io::ErrorKind::FileTooLarge.into()));
        }
        let header = headers::local(label, &there, is_wide);
        self.file.write_all_at(&header, at).map_err(Error::io(self.output, "writing"))?;
        Ok(there)
    }

    /// Writes the central directory and its end, and syncs the file unless that is deferred.
    ///
    /// # Errors
    /// [`Error::Io`], cancellation among them.
    pub(super) fn finish<'l>(
        mut self,
        entries: impl ExactSizeIterator<Item = (Label<'l>, &'l Placed)>,
        limits: &Limits,
    ) -> Result<()> {
        let (begin, count) = (self.at, entries.len() as u64);
        for (label, there) in entries {
            self.append(&headers::central(&label, there))?;
        }
        self.append(&headers::end(count, begin, self.at))?;
        let syncing = || Error::io(self.output, "syncing");
        self.behind.finish().map_err(syncing())?;
        if limits.defer_sync { Ok(()) } else { self.file.sync_all().map_err(syncing()) }
    }
}

/// The content of an entry, on its way into the archive.
pub(super) struct Content<'w, 'a> {
    writer: &'w mut Writer<'a>,
    /// Not deflated yet.
    waiting: Vec<u8>,
    hasher: crc32fast::Hasher,
    /// Bytes that were given.
    plain: u64,
}

impl Content<'_, '_> {
    /// Takes the next bytes.
    ///
    /// # Errors
    /// [`Error::Io`], cancellation among them.
    pub(super) fn put(&mut self, bytes: &[u8]) -> Result<()> {
        for part in bytes.chunks(BLOCK) {
            self.waiting.extend_from_slice(part);
            self.plain += part.len() as u64;
            // The last block ends the stream, so one stays for the end.
            if self.waiting.len() > 2 * BLOCK * rayon::current_num_threads() {
                self.deflate(false)?;
            }
        }
        Ok(())
    }

    /// Deflates the whole blocks that wait, but for the last byte; at the end all, and the stream ends with it.
    fn deflate(&mut self, is_end: bool) -> Result<()> {
        let length = self.waiting.len();
        let until = if is_end { length } else { length.saturating_sub(1) / BLOCK * BLOCK };
        let blocks: Vec<&[u8]> = self.waiting.get(..until).unwrap_or_default().chunks(BLOCK).collect();
        let last = if is_end { blocks.len().checked_sub(1) } else { None };
        let deflated = |(k, block): (usize, &&[u8])| (deflate(block, last == Some(k)), crc32fast::hash(block));
        let packed: Vec<(Option<Vec<u8>>, u32)> = blocks.par_iter().enumerate().map(deflated).collect();
        for (block, (packed, crc)) in blocks.iter().zip(packed) {
            let packed =
                packed.ok_or_else(|| Error::io(self.writer.output, "packing")(std::io::ErrorKind::InvalidData.into()))?;
            self.hasher.combine(&crc32fast::Hasher::new_with_initial_len(crc, block.len() as u64));
            self.writer.append(&packed)?;
        }
        if is_end && length == 0 {
            self.writer.append(&NOTHING)?;
        }
        self.waiting.drain(..until);
        Ok(())
    }
}

/// One block of a deflate stream; the stream ends with it if it is the last.
fn deflate(block: &[u8], is_last: bool) -> Option<Vec<u8>> {
    let mut stream = Compress::new(Compression::new(LEVEL), false);
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
