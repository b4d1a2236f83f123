//! Tells binary from text: by size first, then by content, never by the word `solid` alone, which many binary headers begin
//! with (56 of 410 files drawn from a model site, ArtOfIllusion and SolidWorks among their makers).

use super::archive::Archive;
pub(super) use super::binary::Layout;
use super::finding::{Finding, Rejection};
use super::{amf, binary, facets, foreign, obj, off};

/// How much of a text is looked at.
const HEAD: usize = 4096;
/// Readers that tell text by its bytes look at no more than this.
const HIGH_BYTES_WITHIN: usize = 1024;

/// The kind of a file.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Binary(Layout),
    Text(Text),
    /// XML whose root is `amf`.
    Amf,
    /// A ZIP archive: a 3MF package, or a packed AMF.
    Archive,
    /// An OBJ, and the byte of its first statement or comment.
    Obj(usize),
    Ply,
    Off,
}

/// A text STL.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Text {
    /// Byte of the first token.
    pub(super) start: usize,
    /// Oddities of its letters and line ends.
    pub(super) findings: Vec<Finding>,
}

/// Decides what the bytes are. In order: a binary file whose count fits its length; a format that says its name; a text with facets; an OBJ; a binary file with
/// another count whose records look like triangles; a stranger, named.
pub(super) fn sniff(bytes: &[u8]) -> Result<Kind, Rejection> {
    if begins_ply(bytes) {
        return Ok(Kind::Ply);
    }
    if off::begins(bytes) {
        return Ok(Kind::Off);
    }
    if Archive::looks_like(bytes) {
        return Ok(Kind::Archive);
    }
    if let Some(layout) = binary::exact(bytes) {
        return layout.map(Kind::Binary);
    }
    if amf::is_amf(bytes) {
        return Ok(Kind::Amf);
    }
    if let Some(text) = text(bytes) {
        return Ok(Kind::Text(text));
    }
    if let Some(start) = obj::begins(bytes) {
        return Ok(Kind::Obj(start));
    }
    match binary::mismatched(bytes) {
        Some(layout) => layout.map(Kind::Binary),
        None if off::begins_with_counts(bytes) => Ok(Kind::Off),
        None => Err(Rejection::Unreadable(foreign::describe(bytes))),
    }
}

/// A line of `ply` alone.
fn begins_ply(bytes: &[u8]) -> bool {
    let line = bytes.get(..80).unwrap_or(bytes).strip_prefix(b"ply").unwrap_or_default();
    matches!(line.iter().find(|byte| !matches!(byte, b' ' | b'\t')), Some(b'\n' | b'\r'))
}

/// Is this a text STL? After blanks and a byte order mark it begins with `solid`, and after that line's end come facets and no
/// control characters; or, lacking `solid`, a whole facet is near its beginning.
fn text(bytes: &[u8]) -> Option<Text> {
    let mark = if bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
    let start = mark + bytes.get(mark..)?.iter().position(|byte| !byte.is_ascii_whitespace())?;
    let rest = bytes.get(start..)?;
    let solid = rest.get(..5)?.eq_ignore_ascii_case(b"solid") && rest.get(5).is_none_or(u8::is_ascii_whitespace);
    // A name may hold anything.
    let near = rest.get(..HEAD).unwrap_or(rest);
    let name = near.iter().position(|byte| matches!(byte, b'\n' | b'\r')).filter(|_| solid).unwrap_or(0);
    let body = rest.get(name..name + HEAD).or(rest.get(name..))?;
    let whole = name + body.len() == rest.len();
    // Some writers pad their last block with zeros.
    let padding = body.iter().rev().take_while(|&&byte| byte == 0).count();
    let body = body.get(..body.len() - padding)?;
    if !foreign::is_text(body) {
        return None;
    }
    let fits = if solid {
        whole || foreign::holds(body, b"facet")
    } else {
        foreign::holds(body, b"vertex") && facets::next_facet(body, 0, HEAD).is_some()
    };
    fits.then(|| Text { start, findings: findings(bytes, body, mark > 0) })
}

/// Oddities of the letters and line ends near the beginning.
fn findings(bytes: &[u8], body: &[u8], mark: bool) -> Vec<Finding> {
    let has = |byte: u8| body.contains(&byte);
    let after_mark = bytes.iter().take(HIGH_BYTES_WITHIN).skip(if mark { 3 } else { 0 });
    // Blanks of any kind are skipped alike by readers of tokens; readers of lines know LF and CR LF.
    let all = [
        (mark, false, "begins with a byte order mark"),
        (
            after_mark.clone().any(|&byte| byte > 127),
            false,
            "letters beyond ASCII near the beginning, which some readers take for a binary file",
        ),
        (has(b'\r') && !has(b'\n'), false, "lines end in CR alone"),
        (has(b'\r') && has(b'\n'), true, "lines end in CR LF"),
        (has(b'\t'), true, "tabs between words"),
    ];
    all.into_iter().filter(|(found, ..)| *found).map(|(_, harmless, text)| Finding { harmless, ..Finding::flaw(text) }).collect()
}
