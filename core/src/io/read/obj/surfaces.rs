//! The second look at an OBJ: its faces become records.

use super::super::faces::{Faces, MOST_CORNERS, Tally};
use super::super::vertices::Vertices;
use super::line::Cursor;
use super::survey::Statement;
use crate::io::record::Record;

/// What a piece of text gave.
pub(super) struct Surfaces {
    pub(super) records: Vec<Record>,
    pub(super) tally: Tally,
    /// The text ends within a face, which was left out, since its last number may be cut.
    pub(super) cut_off: bool,
}

/// The faces of `text`, which begins with a line; `before` vertices stand before it.
pub(super) fn surfaces(text: &[u8], vertices: Vertices<'_>, before: u64) -> Surfaces {
    let mut cursor = Cursor::of(text);
    let mut faces = Faces::of(vertices);
    faces.records.reserve(text.len() / 24);
    let mut indices = Vec::new();
    let (mut so_far, mut cut_off) = (before, false);
    while let Some(keyword) = cursor.keyword() {
        match Statement::of(keyword) {
            Statement::Vertex => so_far += 1,
            Statement::Face => {
                let begin = cursor.at;
                corners(&mut cursor, so_far, &mut indices);
                if cursor.is_at_end() && is_cut(cursor.since(begin), indices.len()) {
                    cut_off = true;
                } else if let [a, b, c] = *indices.as_slice() {
                    faces.triangle([a, b, c]);
                } else {
                    faces.polygon(indices.iter().copied());
                }
            }
            _ => {}
        }
        cursor.skip_line();
    }
    Surfaces { records: faces.records, tally: faces.tally, cut_off }
}

/// The indices of a face, counted from 0; `u64::MAX` for one that no vertex has.
#[inline]
fn corners(cursor: &mut Cursor<'_>, so_far: u64, indices: &mut Vec<u64>) {
    indices.clear();
    while let Some(index) = cursor.index() {
        let place = match index {
            Some(index) if index > 0 => (index - 1) as u64,
            Some(index) if index < 0 => so_far.checked_sub(index.unsigned_abs()).unwrap_or(u64::MAX),
            _ => u64::MAX,
        };
        indices.push(place);
        if indices.len() > MOST_CORNERS {
            return;
        }
    }
}

/// Whether a face at the end of a text is not whole: it has fewer than three corners, or its last corner has fewer indices than its first one.
fn is_cut(face: &[u8], corners: usize) -> bool {
    let mut words = face.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
    let slashes = |word: &[u8]| word.iter().filter(|&&byte| byte == b'/').count();
    let (first, last) = (words.next().unwrap_or_default(), words.next_back().unwrap_or_default());
    corners < 3 || slashes(last) < slashes(first) || last.ends_with(b"/") && !first.ends_with(b"/")
}
