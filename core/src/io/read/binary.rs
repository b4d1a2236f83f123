//! Binary STL: 80 bytes of header, a `u32` count, records of 50 bytes. How many of the bytes are triangles is decided here.
//!
//! A count that fits the length is believed as it is; nothing else about the content is asked. Where the two disagree, the
//! records must look like triangles before they are taken for some, and then the length is believed rather than the count, as
//! most slicers do: a count of 0 or `u32::MAX` is what streaming exporters leave behind, a larger one means that the end is
//! missing, and a smaller one that it was never updated, unless what follows does not look like triangles at all.

use super::finding::{Finding, Rejection};
use super::limits::{HEADER_BYTES, MAX_TRIANGLES, PREFIX_BYTES};
use crate::io::record::{self, Record};
use crate::util::words::{Count, Counted, triangles as triangles_of};

/// Records looked at when a file must prove that it holds triangles.
const SAMPLES: usize = 1000;
/// Coordinates of a plausible triangle stay below this. Text read as `f32` mostly does not.
const PLAUSIBLE_COORDINATE: f32 = 1e10;

/// The part of a binary file that is triangles.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Layout {
    pub(super) triangles: usize,
    pub(super) findings: Vec<Finding>,
}

/// The header of a file of at least [`PREFIX_BYTES`]; blank for a shorter one.
pub(super) fn header(bytes: &[u8]) -> [u8; HEADER_BYTES] {
    bytes.first_chunk().copied().unwrap_or([0; HEADER_BYTES])
}

/// The header of an output that is made of a file with this name of its own, in ASCII since headers declare no encoding.
pub(super) fn header_of(name: &[u8]) -> [u8; HEADER_BYTES] {
    let mut header = [0; HEADER_BYTES];
    let name = if name.is_empty() { "Suture".into() } else { String::from_utf8_lossy(name) };
    let printable = name.chars().map(|c| if c.is_ascii_graphic() || c == ' ' { c as u8 } else { b'?' });
    header.iter_mut().zip(printable).for_each(|(byte, c)| *byte = c);
    safe_header(header)
}

/// The first `triangles` records, as many of them as there are.
pub(super) fn records(bytes: &[u8], triangles: usize) -> &[Record] {
    let whole = bytes.get(PREFIX_BYTES..).unwrap_or_default().as_chunks().0;
    whole.get(..triangles).unwrap_or(whole)
}

/// The count a file of at least [`PREFIX_BYTES`] declares.
fn declared_count(bytes: &[u8]) -> Option<u32> {
    bytes.get(HEADER_BYTES..)?.first_chunk().copied().map(u32::from_le_bytes)
}

/// Length of a file of so many triangles.
fn length_of(triangles: u64) -> u64 {
    PREFIX_BYTES as u64 + triangles * size_of::<Record>() as u64
}

/// A layout for a file whose declared count fits its length; nothing else.
pub(super) fn exact(bytes: &[u8]) -> Option<Result<Layout, Rejection>> {
    let declared = declared_count(bytes)?;
    (bytes.len() as u64 == length_of(declared.into())).then(|| match declared {
        0 => Err(Rejection::Unreadable("no triangles: the header says 0, and the file ends there".into())),
        _ => Ok(Layout { triangles: declared as usize, findings: header_findings(bytes) }),
    })
}

/// A layout for a file whose declared count does not fit its length, if its records look like triangles; `None` if they do not.
pub(super) fn mismatched(bytes: &[u8]) -> Option<Result<Layout, Rejection>> {
    let declared = declared_count(bytes)?;
    let body = bytes.get(PREFIX_BYTES..)?;
    let (all, rest) = body.as_chunks::<{ size_of::<Record>() }>();
    let announced = usize::try_from(declared).unwrap_or(usize::MAX);
    if all.is_empty() {
        // Too short for a single record: a binary STL only if the count does not say otherwise.
        return (declared == 0).then(|| Err(none_of(body)));
    }
    let mut findings = header_findings(bytes);
    let triangles = match declared {
        0 | u32::MAX => {
            if !look_like_triangles(all, Normals::Checked) {
                return (declared == 0 && is_blank(body.get(..1 << 20).unwrap_or(body))).then(|| Err(none_of(body)));
            }
            findings.push(Finding::flaw(format!(
                "header leaves the count open ({}), file holds {}",
                Count(declared),
                triangles_of(all.len() as u64)
            )));
            all.len()
        }
        _ if announced > all.len() => {
            if !look_like_triangles(all, Normals::Checked) {
                return None;
            }
            let text =
                format!("header says {}, file holds {}: cut off or miscounted", triangles_of(declared.into()), Count(all.len()));
            findings.push(if announced - all.len() > 1 { Finding::loss(text) } else { Finding::flaw(text) });
            all.len()
        }
        _ => {
            let (counted, beyond) = all.split_at(announced);
            // That so many records are there is some evidence already: normals may be as odd as they like.
            if !look_like_triangles(counted, Normals::Ignored) {
                return None;
            }
            if beyond.is_empty() || !look_like_triangles(beyond, Normals::Checked) {
                let trailing = body.len() - counted.as_flattened().len();
                findings.push(ignored(trailing, "triangle"));
                return Some(within_bounds(counted.len(), findings));
            }
            findings.push(Finding::flaw(format!(
                "header says {}, file holds {}",
                triangles_of(declared.into()),
                Count(all.len())
            )));
            all.len()
        }
    };
    if !rest.is_empty() {
        let what = if announced > all.len() && declared != u32::MAX { "a triangle that is cut off" } else { "trailing" };
        findings.push(ignored(rest.len(), &format!("whole triangle ({what})")));
    }
    Some(within_bounds(triangles, findings))
}

pub(super) fn within_bounds(triangles: usize, findings: Vec<Finding>) -> Result<Layout, Rejection> {
    match triangles as u64 {
        0 => Err(no_triangles()),
        many if many > MAX_TRIANGLES => Err(Rejection::TooMany),
        _ => Ok(Layout { triangles, findings }),
    }
}

/// Bytes behind the last triangle.
fn ignored(bytes: usize, last: &str) -> Finding {
    Finding::flaw(format!("{} after the last {last}, ignored", Counted(bytes as u64, "byte", "bytes")))
}

/// The header announces none, and these bytes are none.
fn none_of(bytes: &[u8]) -> Rejection {
    if bytes.len() >= size_of::<Record>() && is_blank(bytes.get(..1 << 20).unwrap_or(bytes)) {
        return Rejection::Unreadable("no triangles: the file is all zeros, as a copy that was interrupted leaves it".into());
    }
    let bytes = bytes.len();
    let (what, follow) = (Counted(bytes as u64, "byte", "bytes"), if bytes == 1 { "follows" } else { "follow" });
    Rejection::Unreadable(format!("no triangles: the header says 0, and {what} without any {follow}"))
}

pub(super) fn no_triangles() -> Rejection {
    Rejection::Unreadable("no triangles".into())
}

/// Nothing but zero bytes.
pub(super) fn is_blank(bytes: &[u8]) -> bool {
    bytes.iter().all(|&byte| byte == 0)
}

/// Must a record's normal make sense for the record to be plausible?
#[derive(Clone, Copy, PartialEq, Eq)]
enum Normals {
    Checked,
    Ignored,
}

/// At least 95 of 100 records, of up to [`SAMPLES`] spread evenly, have finite coordinates of a sane size and a normal that is
/// zero, of unit length or at right angles to the triangle; and they are not all blank.
fn look_like_triangles(records: &[Record], normals: Normals) -> bool {
    let step = records.len().div_ceil(SAMPLES).max(1);
    let sampled = records.iter().step_by(step);
    let (mut seen, mut good, mut blank) = (0usize, 0usize, true);
    for record in sampled {
        seen += 1;
        blank &= is_blank(record);
        let sane = record::corners(record).as_flattened().iter().all(|c| c.abs() < PLAUSIBLE_COORDINATE);
        good += usize::from(sane && (normals == Normals::Ignored || normal_makes_sense(record)));
    }
    !blank && good * 100 >= seen * 95
}

fn normal_makes_sense(record: &Record) -> bool {
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let stored = record::normal(record).map(f64::from);
    let length = dot(stored, stored).sqrt();
    if length == 0.0 || (length - 1.0).abs() < 0.02 {
        return true;
    }
    // Some exporters write the bare cross product.
    let own = record::unit_normal(record::corners(record)).map(f64::from);
    dot(stored, own).abs() > 0.99 * length
}

/// Where `solid` stands if a reader might take the header for the beginning of a text STL: after blanks, in any case.
fn solid_at(header: &[u8]) -> Option<usize> {
    let at = header.iter().position(|byte| !byte.is_ascii_whitespace())?;
    header.get(at..at + 5)?.eq_ignore_ascii_case(b"solid").then_some(at)
}

fn header_findings(bytes: &[u8]) -> Vec<Finding> {
    let text = "binary file whose header begins with \"solid\", as text files do";
    solid_at(&header(bytes)).map(|_| Finding::flaw(text)).into_iter().collect()
}

/// The header, with `solid` at its beginning replaced by a word of the same length that no reader looks for: one reader in seven
/// would take the file for text.
pub(super) fn safe_header(mut header: [u8; HEADER_BYTES]) -> [u8; HEADER_BYTES] {
    let word = solid_at(&header).and_then(|at| header.get_mut(at..at + 5));
    if let Some(word) = word {
        word.copy_from_slice(b"model");
    }
    header
}
