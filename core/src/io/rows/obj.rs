//! The rows of an OBJ: vertices, texture vertices, normals; and faces, with the statements that hold for them.
//!
//! New rows and faces stand at the end of the file, so that no number in it becomes another one, and no face names a row behind it.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicBool, Ordering};

use super::cells::{number, put_decimal};
use super::table::{CHANNELS, Corner, FaceRow, Faces, NONE, Rows, State, TEXTURE, Triangle, VERTICES};
use super::values::Mix;
use crate::io::read::Vertices;
use crate::io::read::obj::line::Cursor;
use crate::io::read::obj::survey::Statement;
use crate::io::record::Point;

/// Statements that hold for the faces behind them.
const STATES: [&[u8]; 4] = [b"o", b"g", b"usemtl", b"s"];
/// Each of them where none was said; `None`: it cannot be said.
const UNSAID: [Option<&[u8]>; 4] = [None, Some(b"g default\n"), None, Some(b"s off\n")];
/// The rows of each channel, by their keyword.
const ROWS: [&[u8]; 3] = [b"v", b"vt", b"vn"];

/// The text says more than positions and faces. O(bytes), up to the first such statement.
pub(crate) fn says_more(text: &[u8]) -> bool {
    let mut cursor = Cursor::of(text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text));
    while let Some(keyword) = cursor.keyword() {
        let says = match channel(keyword) {
            Some(VERTICES) => (0..5).all(|_| cursor.word().is_some()),
            Some(_) => true,
            None => !matches!(keyword, b"f" | b"fo"),
        };
        if says {
            return true;
        }
        cursor.skip_line();
    }
    false
}

/// An OBJ.
pub(crate) struct Obj<'a> {
    text: &'a [u8],
    positions: Vertices<'a>,
    counts: Corner,
    carries: bool,
    /// By channel: a face that was passed names a row that is not there.
    astray: [AtomicBool; CHANNELS],
}

impl<'a> Obj<'a> {
    /// `None` for a file with geometry of free form, whose statements name rows, too. O(bytes).
    pub(crate) fn of(text: &'a [u8], positions: Vertices<'a>) -> Option<Self> {
        let (mut cursor, mut counts, mut carries) = (Cursor::of(text), [0u32; 3], false);
        while let Some(keyword) = cursor.keyword() {
            match channel(keyword) {
                Some(channel) => {
                    let count = counts.get_mut(channel)?;
                    *count = count.checked_add(1).filter(|count| *count < NONE)?;
                    carries |= channel != VERTICES || (0..5).all(|_| cursor.word().is_some());
                }
                None if Statement::of(keyword) == Statement::Curve => return None,
                None => carries |= !matches!(keyword, b"f" | b"fo"),
            }
            cursor.skip_line();
        }
        (counts[VERTICES] as usize == positions.len()).then_some(Self {
            text,
            positions,
            counts,
            carries,
            astray: Default::default(),
        })
    }

    /// The line of a statement that holds; empty for none.
    fn line(&self, state: State, kind: usize) -> &[u8] {
        let Some(from) = state.0.get(kind).and_then(|at| at.checked_sub(1)) else { return &[] };
        let rest = self.text.get(from..).unwrap_or_default();
        let mut cursor = Cursor::of(rest);
        cursor.skip_line();
        rest.get(..cursor.at).unwrap_or_default().trim_ascii_end()
    }
}

fn channel(keyword: &[u8]) -> Option<usize> {
    ROWS.iter().position(|own| *own == keyword)
}

struct ObjFaces<'r, 'a> {
    obj: &'r Obj<'a>,
    cursor: Cursor<'a>,
    so_far: Corner,
    state: State,
}

impl<'r, 'a> ObjFaces<'r, 'a> {
    fn of(obj: &'r Obj<'a>) -> Self {
        Self { obj, cursor: Cursor::of(obj.text), so_far: [0; 3], state: State::default() }
    }

    /// Takes numbers of rows that are not there for none. Programs write `1/1/1` where they have written no texture vertex at all.
    fn leave_out(&self, corner: Corner) -> Corner {
        let mut there = corner;
        for ((number, count), astray) in there.iter_mut().zip(self.obj.counts).zip(&self.obj.astray).skip(1) {
            if *number != NONE && *number >= count {
                *number = NONE;
                astray.store(true, Ordering::Relaxed);
            }
        }
        there
    }
}

impl Faces for ObjFaces<'_, '_> {
    fn next_face(&mut self, row: &mut FaceRow) -> Option<()> {
        loop {
            let keyword = self.cursor.keyword()?;
            let from = self.cursor.at - keyword.len();
            if matches!(keyword, b"f" | b"fo") {
                row.corners.clear();
                while let Some(word) = self.cursor.word() {
                    row.corners.push(self.leave_out(corner(word, self.so_far)?));
                }
                self.cursor.end();
                (row.whole, row.state) = (from..self.cursor.at, self.state);
                return Some(());
            }
            if let Some(count) = channel(keyword).and_then(|channel| self.so_far.get_mut(channel)) {
                *count += 1;
            } else if let Some(kind) = STATES.iter().position(|own| *own == keyword)
                && let Some(state) = self.state.0.get_mut(kind)
            {
                *state = from + 1;
            }
            self.cursor.skip_line();
        }
    }
}

/// The rows that a word as `1/2/3` names, where so many stand before it.
fn corner(word: &[u8], so_far: Corner) -> Option<Corner> {
    let mut corner = [NONE; 3];
    for (channel, index) in word.split(|byte| *byte == b'/').enumerate() {
        if index.is_empty() && channel > 0 {
            continue;
        }
        let index: i64 = std::str::from_utf8(index).ok()?.parse().ok()?;
        let before = *so_far.get(channel)?;
        let number = if index > 0 { index - 1 } else { i64::from(before).checked_add(index).filter(|_| index < 0)? };
        *corner.get_mut(channel)? = u32::try_from(number).ok().filter(|number| *number != NONE)?;
    }
    Some(corner)
}

impl Rows for Obj<'_> {
    fn bytes(&self) -> &[u8] {
        self.text
    }

    fn is_text(&self) -> bool {
        true
    }

    fn carries(&self) -> bool {
        self.carries
    }

    fn counts(&self) -> Corner {
        self.counts
    }

    fn position(&self, vertex: u32) -> Option<Point> {
        self.positions.get(vertex.into())
    }

    fn faces(&self) -> Box<dyn Faces + '_> {
        Box::new(ObjFaces::of(self))
    }

    fn says(&self, row: &FaceRow) -> Vec<u8> {
        let mut said = Vec::new();
        for kind in 0..STATES.len() {
            said.extend_from_slice(self.line(row.state, kind));
            said.push(b'\n');
        }
        said
    }

    fn mixes(&self, channel: usize) -> &[Mix] {
        match channel {
            VERTICES => &[Mix::Axis(0), Mix::Axis(1), Mix::Axis(2), Mix::Mean],
            TEXTURE => &[Mix::Mean],
            _ => &[Mix::Direction; 3],
        }
    }

    fn values(&self, channel: usize, rows: &BTreeSet<u32>) -> Option<BTreeMap<u32, Vec<f64>>> {
        let (mut cursor, mut at, mut all) = (Cursor::of(self.text), 0, BTreeMap::new());
        let keyword_of_rows = *ROWS.get(channel)?;
        let mut rows = rows.iter().peekable();
        while let (Some(wanted), Some(keyword)) = (rows.peek(), cursor.keyword()) {
            if keyword == keyword_of_rows {
                if at == **wanted {
                    let mut values = Vec::new();
                    while let Some(word) = cursor.word() {
                        values.push(number(word)?);
                    }
                    all.insert(at, values);
                    rows.next();
                }
                at += 1;
            }
            cursor.skip_line();
        }
        rows.next().is_none().then_some(all)
    }

    fn may_grow(&self, channel: usize) -> bool {
        self.astray.get(channel).is_none_or(|astray| !astray.load(Ordering::Relaxed))
    }

    fn make_room(&self, vertices: u64, _: u64) -> bool {
        vertices < u64::from(NONE)
    }

    fn head(&self, _: u64, _: u64) -> (Vec<u8>, usize) {
        (Vec::new(), 0)
    }

    fn end_of_vertices(&self) -> usize {
        self.text.len()
    }

    fn end_of_faces(&self) -> usize {
        self.text.len()
    }

    fn put_row(&self, channel: usize, values: &[f64], out: &mut Vec<u8>) {
        out.extend_from_slice(ROWS.get(channel).copied().unwrap_or_default());
        for value in values {
            out.push(b' ');
            put_decimal(*value, out);
        }
        out.push(b'\n');
    }

    fn put_face(&self, triangle: &Triangle<'_>, out: &mut Vec<u8>) {
        out.push(b'f');
        for [vertex, texture, normal] in triangle.corners {
            let written = |row: u32| (u64::from(row) + 1).to_string();
            let word = match (texture, normal) {
                (NONE, NONE) => written(vertex),
                (texture, NONE) => [written(vertex), written(texture)].join("/"),
                (NONE, normal) => [written(vertex), written(normal)].join("//"),
                _ => [written(vertex), written(texture), written(normal)].join("/"),
            };
            out.push(b' ');
            out.extend_from_slice(word.as_bytes());
        }
        out.push(b'\n');
    }

    fn end_state(&self) -> State {
        let mut faces = ObjFaces::of(self);
        let mut row = FaceRow::default();
        while faces.next_face(&mut row).is_some() {}
        faces.state
    }

    fn put_state(&self, from: State, to: State, out: &mut Vec<u8>) -> bool {
        let mut can_be_said = true;
        for (kind, unsaid) in UNSAID.into_iter().enumerate() {
            let (before, wanted) = (self.line(from, kind), self.line(to, kind));
            if before == wanted {
                continue;
            }
            if !wanted.is_empty() {
                out.extend_from_slice(wanted);
                out.push(b'\n');
            } else if let Some(unsaid) = unsaid {
                out.extend_from_slice(unsaid);
            } else {
                can_be_said = false;
            }
        }
        can_be_said
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_corner_names_its_rows() {
        let so_far = [10, 20, 30];
        assert_eq!(corner(b"1", so_far), Some([0, NONE, NONE]));
        assert_eq!(corner(b"-1/-2/3", so_far), Some([9, 18, 2]));
        assert_eq!(corner(b"2//-30", so_far), Some([1, NONE, 0]));
        assert_eq!(corner(b"2/7/", so_far), Some([1, 6, NONE]));
        for bad in ["0", "-11", "1/x", "1/2/3/4", "/1", ""] {
            assert_eq!(corner(bad.as_bytes(), so_far), None, "{bad}");
        }
    }
}
