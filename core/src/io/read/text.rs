//! Text STL into a spool of records: cut before facets into windows of about a megabyte, parsed in parallel, written in order.
//!
//! Memory: the records of a batch and of the batch before it, so some megabytes for each thread, whatever the file's length; the
//! spool's dirty pages are written back step by step, since the kernel would otherwise let a share of all memory fill with them.

use std::fs::File;
use std::path::Path;

use memmap2::Mmap;
use rayon::prelude::*;

use super::binary;
use super::facets::{self, Tally};
use super::finding::{Finding, Rejection};
use super::limits::{HEADER_BYTES, MAX_TRIANGLES};
use super::number::{COMMA, POINT};
use crate::contract::error::{Error, Result};
use crate::contract::progress::Progress;
use crate::contract::settings::Limits;
use crate::io::disk_space::{self, Need};
use crate::io::record::Record;
use crate::io::write_behind::{self, WriteBehind};
use crate::util::words::Count;

/// Text parsed at a time by one thread.
pub(super) const WINDOW: usize = 1 << 20;
/// A window grows up to this to reach the next facet; beyond that the text is no mesh.
const LONGEST: usize = 8 * WINDOW;

/// A text file's triangles.
#[derive(Debug)]
pub(super) struct Parsed {
    /// The records, in a file without a name.
    pub(super) spool: Mmap,
    pub(super) findings: Vec<Finding>,
    pub(super) header: [u8; HEADER_BYTES],
}

/// Paths, limits and progress of reading a text.
pub(super) struct Context<'a> {
    pub(super) path: &'a Path,
    pub(super) spool: &'a Path,
    pub(super) limits: &'a Limits,
    pub(super) progress: &'a dyn Progress,
}

/// Parses `text` from byte `start` on.
pub(super) fn read(text: &[u8], start: usize, context: &Context<'_>) -> Result<Parsed> {
    let reject = |rejection: Rejection| rejection.at(context.path);
    let bytes = expected_bytes(text, start).map_err(reject)?;
    disk_space::check(context.path, &[Need { folder: context.spool.into(), bytes, what: "the triangles of the text" }])?;
    let mut spool = Spool::new(context)?;
    let mut tally = Tally::default();
    let mut windows = Windows { text, at: start };
    let mut parsed: Vec<Vec<Record>> = Vec::new();
    loop {
        let batch = windows.batch(rayon::current_num_threads() * 2 * WINDOW).map_err(reject)?;
        // The previous batch is written while this one is parsed.
        let (written, pieces) = rayon::join(
            || spool.append(&parsed),
            || batch.par_iter().map(|piece| facets::parse(piece.text, piece.at as u64, piece.last)).collect::<Vec<_>>(),
        );
        written?;
        if pieces.is_empty() {
            break;
        }
        parsed.clear();
        for (records, piece) in pieces {
            parsed.push(records);
            tally.append(piece);
        }
        context.progress.at("read", windows.at as u64, text.len() as u64);
        if context.progress.cancelled() {
            return Err(Error::cancelled(context.path, "reading"));
        }
    }
    judge(&tally, spool.records).map_err(reject)?;
    Ok(Parsed { spool: spool.map()?, findings: findings(&tally), header: header(&tally) })
}

/// Bytes of records that a text will make, if it goes on as it begins.
fn expected_bytes(text: &[u8], start: usize) -> std::result::Result<u64, Rejection> {
    let first = Windows { text, at: start }.batch(1)?;
    let (records, length) = first.first().map_or((0, 1), |piece| {
        let (records, _) = facets::parse(piece.text, piece.at as u64, piece.last);
        (records.len() as u64, piece.text.len().max(1) as u64)
    });
    let pieces = (text.len() - start) as u64 / length + 1;
    Ok(records * size_of::<Record>() as u64 * pieces)
}

/// A piece of text that ends before a facet or with the file.
struct Piece<'a> {
    text: &'a [u8],
    at: usize,
    last: bool,
}

/// Cuts a text into pieces.
struct Windows<'a> {
    text: &'a [u8],
    at: usize,
}

impl<'a> Windows<'a> {
    /// Pieces of at least `bytes` together, fewer at the end of the text, none beyond it.
    fn batch(&mut self, bytes: usize) -> std::result::Result<Vec<Piece<'a>>, Rejection> {
        let from = self.at;
        let mut pieces = Vec::new();
        while self.at < self.text.len() && self.at - from < bytes {
            let limit = self.at.saturating_add(LONGEST);
            let end = match facets::next_facet(self.text, self.at.saturating_add(WINDOW), limit) {
                Some(end) => end,
                None if limit < self.text.len() => {
                    let reason = format!("{} MiB of text without a new facet, from byte {} on", LONGEST >> 20, Count(self.at));
                    return Err(Rejection::Unreadable(reason));
                }
                None => self.text.len(),
            };
            let text = self.text.get(self.at..end).unwrap_or_default();
            pieces.push(Piece { text, at: self.at, last: end == self.text.len() });
            self.at = end;
        }
        Ok(pieces)
    }
}

/// Records on their way into a file without a name.
struct Spool<'a> {
    folder: &'a Path,
    path: &'a Path,
    file: File,
    behind: WriteBehind,
    records: u64,
}

impl<'a> Spool<'a> {
    fn new(context: &Context<'a>) -> Result<Self> {
        let (file, behind) = write_behind::nameless(context.spool, context.limits)?;
        Ok(Self { folder: context.spool, path: context.path, file, behind, records: 0 })
    }

    fn append(&mut self, pieces: &[Vec<Record>]) -> Result<()> {
        for records in pieces {
            self.records += records.len() as u64;
            if self.records > MAX_TRIANGLES {
                return Err(Rejection::TooMany.at(self.path));
            }
            self.behind.append(records.as_flattened()).map_err(Error::io(self.folder, "spooling"))?;
        }
        Ok(())
    }

    fn map(self) -> Result<Mmap> {
        self.behind.finish().map_err(Error::io(self.folder, "spooling"))?;
        // SAFETY: the file has no name and this was its only handle that writes: nobody changes or truncates it.
        unsafe { Mmap::map(&self.file) }.map_err(Error::io(self.folder, "mapping"))
    }
}

/// Refuses what gave no triangles, or none to rely on.
fn judge(tally: &Tally, records: u64) -> std::result::Result<(), Rejection> {
    let damage = tally.first_damage.unwrap_or_default();
    if tally.separators == POINT | COMMA {
        Err(Rejection::Unreadable("decimal commas and decimal points are mixed".into()))
    } else if tally.damaged > records / 2 && tally.damaged > 0 {
        let vertices = vertices_word(tally.damaged);
        let reason = format!("{vertices} with coordinates that are no numbers, the first at byte {}", Count(damage));
        Err(Rejection::Unreadable(reason))
    } else if records == 0 {
        Err(binary::no_triangles())
    } else {
        Ok(())
    }
}

/// Oddities of a text's grammar.
fn findings(tally: &Tally) -> Vec<Finding> {
    let mut found = Vec::new();
    if tally.cut_off {
        found.push(Finding::loss("cut off within a facet, which was left out"));
    }
    let mut flaw = |happened: bool, text: &dyn Fn() -> String| {
        if happened {
            found.push(Finding::flaw(text()));
        }
    };
    flaw(tally.upper_case, &|| "keywords not in lower case".into());
    flaw(tally.separators == COMMA, &|| "decimal commas, read as points".into());
    flaw(tally.solids == 0, &|| "does not begin with \"solid\"".into());
    flaw(tally.ends < tally.solids, &|| match tally.solids {
        1 => "no endsolid".into(),
        solids => format!("{} of {} solids have no endsolid", Count(solids - tally.ends), Count(solids)),
    });
    flaw(tally.unclosed > 0, &|| format!("{} without endfacet", facets_word(tally.unclosed)));
    flaw(tally.short > 0, &|| format!("{} of fewer than three vertices, left out", facets_word(tally.short)));
    flaw(tally.polygons > 0, &|| format!("{} of more than three vertices, cut into triangles", facets_word(tally.polygons)));
    flaw(tally.damaged > 0, &|| {
        let at = tally.first_damage.unwrap_or_default();
        format!(
            "{} with a coordinate that is no number, read as NaN; the first at byte {}",
            vertices_word(tally.damaged),
            Count(at)
        )
    });
    flaw(tally.odd_names > 0, &|| "the name of a solid is not UTF-8".into());
    if tally.solids > 1 {
        // Every common slicer joins them.
        let names: Vec<_> = tally.names.iter().map(|name| String::from_utf8_lossy(name)).collect();
        let more = if tally.solids > names.len() as u64 { ", …" } else { "" };
        let text = format!("{} solids ({}{more}), read as one mesh", Count(tally.solids), names.join(", "));
        found.push(Finding { harmless: true, ..Finding::flaw(text) });
    }
    found
}

fn facets_word(count: u64) -> String {
    if count == 1 { "1 facet".into() } else { format!("{} facets", Count(count)) }
}

fn vertices_word(count: u64) -> String {
    if count == 1 { "1 vertex".into() } else { format!("{} vertices", Count(count)) }
}

/// A binary header from the first solid's name, in ASCII since headers declare no encoding.
fn header(tally: &Tally) -> [u8; HEADER_BYTES] {
    let mut header = [0; HEADER_BYTES];
    let name = tally.names.first().filter(|name| !name.is_empty()).map_or("Suture".into(), |name| String::from_utf8_lossy(name));
    let printable = name.chars().map(|c| if c.is_ascii_graphic() || c == ' ' { c as u8 } else { b'?' });
    header.iter_mut().zip(printable).for_each(|(byte, c)| *byte = c);
    binary::safe_header(header)
}
