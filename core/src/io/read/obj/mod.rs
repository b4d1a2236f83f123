//! Wavefront OBJ into a spool of records.
//!
//! **In:** text by "Object Files (.obj)", appendix B1 of the manual of Wavefront's Advanced Visualizer, with the colours that common writers put
//! behind a vertex. Lines end in LF, CR or CR LF.
//!
//! **Out:** its faces, polygons cut into triangles, in their order. Lines, points and free-form geometry are counted and left out.
//!
//! **Promise:** the text is parsed twice, in parallel, cut before lines into windows of about a megabyte: at first the vertices, with how many stand
//! before each window, then the faces, which may refer to vertices behind them. Memory: the windows being parsed, and positions that the system can
//! drop at any time.

pub(in crate::io) mod line;
mod surfaces;
pub(in crate::io) mod survey;
#[cfg(test)]
mod tests;

use super::binary;
use super::faces::Tally;
use super::finding::{Finding, Rejection};
use super::foreign;
use super::limits::window;
use super::number::{COMMA, POINT};
use super::parsed::{Besides, Parsed};
use super::spool::{Context, POSITION_BYTES};
use super::vertices::{Positions, Vertices};
use crate::contract::error::Result;
use crate::io::record::Record;
use crate::util::legible::legible_bytes;
use crate::util::words::{Count, Counted};
use line::{Cursor, next_line};
use surfaces::Surfaces;
use survey::{Statement, Survey};

/// Text parsed at a time by one thread.
const WINDOW: usize = window(1 << 20);
/// A window grows up to this to reach the end of a line; beyond that the text is no mesh.
const LONGEST: usize = 16 * WINDOW;
/// So much of a text is looked at to tell its kind, behind the comments that it begins with.
const HEAD: usize = 4096;
/// Comments are passed over up to here.
const LONGEST_COMMENT: usize = 1 << 20;

/// Where an OBJ begins, if `bytes` are one: behind a byte order mark and blanks. Most of its first statements are those of an OBJ, at least one of
/// them a vertex, a normal or a texture vertex of numbers.
pub(super) fn begins(bytes: &[u8]) -> Option<usize> {
    let mark = if bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
    let start = mark + bytes.get(mark..)?.iter().position(|byte| !byte.is_ascii_whitespace())?;
    let rest = bytes.get(start..)?;
    let rest = rest.get(..LONGEST_COMMENT).unwrap_or(rest);
    let mut cursor = Cursor::of(rest);
    let first = cursor.keyword()?.len();
    let from = cursor.at - first;
    let head = rest.get(from..from + HEAD).or(rest.get(from..))?;
    // Some writers pad their last block with zeros.
    let padding = head.iter().rev().take_while(|&&byte| byte == 0).count();
    let head = head.get(..head.len() - padding)?;
    // A line that the head cuts says nothing.
    let whole = if from + head.len() < rest.len() { last_line(head) } else { head };
    (foreign::is_text(head) && is_mostly_obj(whole)).then_some(start)
}

/// Up to the end of its last whole line.
fn last_line(head: &[u8]) -> &[u8] {
    let end = head.iter().rposition(|byte| matches!(byte, b'\n' | b'\r')).map_or(head.len(), |end| end + 1);
    head.get(..end).unwrap_or_default()
}

fn is_mostly_obj(head: &[u8]) -> bool {
    let mut cursor = Cursor::of(head);
    let (mut known, mut all, mut geometry) = (0usize, 0usize, false);
    while let Some(keyword) = cursor.keyword() {
        all += 1;
        known += usize::from(Statement::of(keyword) != Statement::Unknown);
        if matches!(keyword, b"v" | b"vn" | b"vt") {
            geometry |= matches!(cursor.number(), Some(Some(_)));
        }
        cursor.skip_line();
    }
    geometry && known * 2 > all
}

/// Parses `bytes` from byte `start` on.
pub(super) fn read(bytes: &[u8], start: usize, context: &Context<'_>) -> Result<Parsed> {
    let reject = |rejection: Rejection| rejection.at(context.path);
    let total = 2 * bytes.len() as u64;
    // A vertex takes twelve bytes of the spool and hardly less than fifteen of text; most files are faces and normals for the better part.
    context.make_room(bytes.len() as u64 / 4, "the vertices of the text")?;
    let mut positions = context.positions()?;
    let (mut found, mut with_faces) = (Survey::default(), Vec::new());
    let mut windows = Windows { text: bytes, at: start };
    let next = || {
        let batch = windows.batch().map_err(reject)?;
        Ok((batch, windows.at as u64))
    };
    context.in_order(total, next, look_at, |(window, points, piece)| {
        if piece.faces > 0 {
            with_faces.push(Window { before: found.vertices, ..window });
        }
        found.append(piece);
        positions.append(&points)
    })?;
    judge(&found).map_err(reject)?;

    context.make_room(found.faces * size_of::<Record>() as u64, "the triangles of the text")?;
    let positions = positions.map()?;
    let vertices = Vertices::spooled(positions.all());
    let mut records = context.records()?;
    let (mut tally, mut cut_off) = (Tally::default(), found.cut_off);
    let mut waiting = with_faces.into_iter();
    let next = || {
        let batch: Vec<_> = waiting.by_ref().take(windows_at_a_time()).collect();
        let done = batch.last().map_or(total, |window| (bytes.len() + window.at + window.text.len()) as u64);
        Ok((batch, done))
    };
    let cut = |window: &Window<'_>| surfaces::surfaces(window.text, vertices, window.before);
    let take = |piece: Surfaces| {
        tally.append(piece.tally);
        cut_off |= piece.cut_off;
        records.append(&piece.records)
    };
    context.in_order(total, next, cut, take)?;
    tally.judge().map_err(reject)?;
    if records.count() == 0 {
        return Err(reject(binary::no_triangles()));
    }
    let mut findings = findings(bytes, &found, cut_off);
    findings.extend(tally.findings());
    let (header, rounding) = (header(&found), found.rounding.if_any());
    let positions = Some(Positions::Spooled(positions));
    Ok(Parsed {
        records: records.map()?,
        findings,
        header,
        rounding,
        besides: Besides { positions, short_faces: tally.has_short(), ..Besides::default() },
    })
}

fn windows_at_a_time() -> usize {
    rayon::current_num_threads() * 2
}

fn look_at<'a>(window: &Window<'a>) -> (Window<'a>, Vec<[u8; POSITION_BYTES]>, Survey) {
    let (positions, found) = survey::survey(window.text, window.at as u64);
    (*window, positions, found)
}

/// A piece of text that begins with a line and ends with one.
#[derive(Clone, Copy)]
struct Window<'a> {
    text: &'a [u8],
    at: usize,
    /// So many vertices stand before it.
    before: u64,
}

/// Cuts a text into windows.
struct Windows<'a> {
    text: &'a [u8],
    at: usize,
}

impl<'a> Windows<'a> {
    /// A few for each thread, fewer at the end of the text, none beyond it.
    fn batch(&mut self) -> std::result::Result<Vec<Window<'a>>, Rejection> {
        let mut windows = Vec::new();
        while self.at < self.text.len() && windows.len() < windows_at_a_time() {
            let limit = self.at.saturating_add(LONGEST);
            let end = match next_line(self.text, self.at.saturating_add(WINDOW), limit) {
                Some(end) => end,
                None if limit < self.text.len() => {
                    let reason =
                        format!("{} MiB of text without the end of a line, from byte {} on", LONGEST >> 20, Count(self.at));
                    return Err(Rejection::Unreadable(reason));
                }
                None => self.text.len(),
            };
            windows.push(Window { text: self.text.get(self.at..end).unwrap_or_default(), at: self.at, before: 0 });
            self.at = end;
        }
        Ok(windows)
    }
}

/// Refuses an OBJ without faces, or with vertices that are none for the most part.
fn judge(found: &Survey) -> std::result::Result<(), Rejection> {
    let reason = if found.faces == 0 {
        if found.curves > 0 {
            format!("an OBJ of {} in free form, no faces", Counted(found.curves, "curve or surface", "curves and surfaces"))
        } else if found.lines + found.points > 0 {
            format!("an OBJ of {} only, no faces", lines_and_points(found))
        } else if found.vertices == 0 {
            "an OBJ without vertices and faces".into()
        } else {
            format!("a point cloud of {}, no faces", Counted(found.vertices, "point", "points"))
        }
    } else if found.separators == POINT | COMMA {
        "decimal commas and decimal points are mixed".into()
    } else if found.damaged > found.vertices / 2 {
        let at = found.first_damage.unwrap_or_default();
        format!(
            "{} with coordinates that are missing or no numbers, the first at byte {}",
            vertices_word(found.damaged),
            Count(at)
        )
    } else {
        return Ok(());
    };
    Err(Rejection::Unreadable(reason))
}

fn vertices_word(count: u64) -> Counted<'static> {
    Counted(count, "vertex", "vertices")
}

fn lines_and_points(found: &Survey) -> String {
    let (lines, points) = (Counted(found.lines, "line", "lines"), Counted(found.points, "point", "points"));
    match (found.lines, found.points) {
        (_, 0) => lines.to_string(),
        (0, _) => points.to_string(),
        _ => format!("{lines} and {points}"),
    }
}

/// Oddities of a text's grammar.
fn findings(bytes: &[u8], found: &Survey, cut_off: bool) -> Vec<Finding> {
    let head = bytes.get(..HEAD).unwrap_or(bytes);
    let mut all = Vec::new();
    let mut note = |happened: bool, harmless: bool, text: &dyn Fn() -> String| {
        if happened {
            all.push(Finding { harmless, ..Finding::flaw(text()) });
        }
    };
    note(head.starts_with(b"\xef\xbb\xbf"), false, &|| "begins with a byte order mark".into());
    note(head.contains(&b'\r') && !head.contains(&b'\n'), false, &|| "lines end in CR alone".into());
    note(found.separators == COMMA, false, &|| "decimal commas, read as points".into());
    note(found.damaged > 0, false, &|| {
        let at = Count(found.first_damage.unwrap_or_default());
        format!(
            "{} with a coordinate that is missing or no number, read as NaN; the first at byte {at}",
            vertices_word(found.damaged)
        )
    });
    note(found.weighted > 0, true, &|| format!("weights of {}, which faces have no use for", vertices_word(found.weighted)));
    note(found.lines + found.points > 0, true, &|| format!("{}, which are no part of the mesh", lines_and_points(found)));
    note(found.curves > 0, false, &|| {
        format!("{} in free form, left out", Counted(found.curves, "curve or surface", "curves and surfaces"))
    });
    note(found.unknown > 0, true, &|| {
        let first = legible_bytes(found.first_unknown.as_deref().unwrap_or_default());
        format!("{} unknown to OBJ, passed over; the first is \"{first}\"", Counted(found.unknown, "statement", "statements"))
    });
    note(found.objects > 1, true, &|| {
        let names: Vec<_> = found.names.iter().map(|name| legible_bytes(name)).collect();
        let more = if found.objects > names.len() as u64 { ", …" } else { "" };
        format!("{} objects ({}{more}), read as one mesh", Count(found.objects), names.join(", "))
    });
    if cut_off {
        all.push(Finding::loss("cut off within its last line, which was left out"));
    }
    all
}

/// A binary header from the first object's name, or else a group's.
fn header(found: &Survey) -> [u8; super::limits::HEADER_BYTES] {
    let object = found.names.iter().find(|name| !name.is_empty());
    binary::header_of(object.or(found.group.as_ref()).map_or(&[], Vec::as_slice))
}
