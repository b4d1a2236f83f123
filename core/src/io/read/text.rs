//! Text STL into a spool of records: cut before facets into windows of about a megabyte, parsed in parallel, written in order.

use super::binary;
use super::facets::{self, Tally};
use super::finding::{Finding, Rejection};
use super::limits::{HEADER_BYTES, window};
use super::number::{COMMA, POINT};
use super::parsed::{Besides, Parsed};
use super::spool::Context;
use crate::contract::error::Result;
use crate::io::record::Record;
use crate::util::legible::legible_bytes;
use crate::util::words::{Count, Counted};

/// Text parsed at a time by one thread.
pub(super) const WINDOW: usize = window(1 << 20);
/// A window grows up to this to reach the next facet; beyond that the text is no mesh.
const LONGEST: usize = 8 * WINDOW;

/// Parses `text` from byte `start` on.
pub(super) fn read(text: &[u8], start: usize, context: &Context<'_>) -> Result<Parsed> {
    let reject = |rejection: Rejection| rejection.at(context.path);
    context.make_room(expected_bytes(text, start).map_err(reject)?, "the triangles of the text")?;
    let mut spool = context.records()?;
    let mut tally = Tally::default();
    let mut windows = Windows { text, at: start };
    let next = || {
        let batch = windows.batch(rayon::current_num_threads() * 2 * WINDOW).map_err(reject)?;
        Ok((batch, windows.at as u64))
    };
    let parse = |piece: &Piece<'_>| facets::parse(piece.text, piece.at as u64, piece.last);
    let take = |(records, piece): (Vec<Record>, Tally)| {
        tally.append(piece);
        spool.append(&records)
    };
    context.in_order(text.len() as u64, next, parse, take)?;
    judge(&tally, spool.count()).map_err(reject)?;
    let (records, findings, header) = (spool.map()?, findings(&tally), header(&tally));
    Ok(Parsed { records, findings, header, rounding: None, besides: Besides::default() })
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
        let names: Vec<_> = tally.names.iter().map(|name| legible_bytes(name)).collect();
        let more = if tally.solids > names.len() as u64 { ", …" } else { "" };
        let text = format!("{} solids ({}{more}), read as one mesh", Count(tally.solids), names.join(", "));
        found.push(Finding { harmless: true, ..Finding::flaw(text) });
    }
    found
}

fn facets_word(count: u64) -> Counted<'static> {
    Counted(count, "facet", "facets")
}

fn vertices_word(count: u64) -> Counted<'static> {
    Counted(count, "vertex", "vertices")
}

/// A binary header from the first solid's name.
fn header(tally: &Tally) -> [u8; HEADER_BYTES] {
    binary::header_of(tally.names.first().map_or(&[], Vec::as_slice))
}
