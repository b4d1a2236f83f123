//! The rows of an OFF in text, where each stands on a line of its own.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use super::cells::{Cells, Form, number, put_decimal};
use super::table::{Corner, FaceRow, Faces, NONE, Rows, Triangle, VERTICES};
use super::values::Mix;
use crate::io::read::Vertices;
use crate::io::read::elements::lines::Line;
use crate::io::record::Point;

/// The file says more than positions and faces, by its keyword or a colour of a face. O(bytes).
pub(crate) fn says_more(bytes: &[u8]) -> bool {
    let mut line = line_at(bytes, 0);
    let keyword = word(&mut line).and_then(|range| bytes.get(range)).unwrap_or_default();
    let letters = keyword.strip_suffix(b"OFF").unwrap_or_default();
    !letters.is_empty() || has_coloured_faces(bytes, line).unwrap_or(false)
}

/// A face has a colour, in a file whose keyword has no letters. `line` stands behind the keyword. `None`: its rows are not where they should be.
fn has_coloured_faces(bytes: &[u8], mut line: Line<'_>) -> Option<bool> {
    let first = word(&mut line)?;
    if bytes.get(first.clone())? == b"BINARY" {
        line.skip_line();
        let behind = bytes.get(line.at..)?;
        let counts = line.at + behind.iter().take(2).take_while(|byte| matches!(byte, b'\r' | b'\n')).count();
        return has_coloured_faces_in_binary(bytes, counts);
    }
    let count = |range: Range<usize>| std::str::from_utf8(bytes.get(range)?).ok()?.parse::<u64>().ok();
    let (vertices, faces) = (count(first)?, count(word(&mut line)?)?);
    line.skip_line();
    line.end();
    let mut at = line.at;
    for _ in 0..vertices {
        at = row(bytes, at)?.end;
    }
    for _ in 0..faces {
        let row = row(bytes, at)?;
        let corners = Cells::of(Form::Text, bytes.get(row.clone())?).word().and_then(number)?;
        if count_words(bytes.get(row.clone())?) as f64 > corners + 1.0 {
            return Some(true);
        }
        at = row.end;
    }
    Some(false)
}

/// The same in binary, of counts and indices with the highest byte first.
fn has_coloured_faces_in_binary(bytes: &[u8], counts: usize) -> Option<bool> {
    let count = |at: usize| {
        let four = bytes.get(at..at.checked_add(4)?)?.first_chunk().copied()?;
        usize::try_from(i32::from_be_bytes(four)).ok()
    };
    let (vertices, faces) = (count(counts)?, count(counts + 4)?);
    let mut at = vertices.checked_mul(12)?.checked_add(counts + 12)?;
    for _ in 0..faces {
        at = count(at)?.checked_mul(4)?.checked_add(at + 4)?;
        if count(at)? > 0 {
            return Some(true);
        }
        at += 4;
    }
    Some(false)
}

/// An OFF in text.
pub(crate) struct Off<'a> {
    text: &'a [u8],
    /// Where the counts of vertices and faces stand.
    written: [Range<usize>; 2],
    head: usize,
    end_of_vertices: usize,
    end_of_faces: usize,
    faces: u64,
    positions: Vertices<'a>,
    mixes: Vec<Mix>,
    carries: bool,
}

impl<'a> Off<'a> {
    /// `None` for a file whose rows share lines, or that is not text. O(bytes).
    pub(crate) fn of(text: &'a [u8], positions: Vertices<'a>) -> Option<Self> {
        let mut line = line_at(text, 0);
        let keyword = word(&mut line)?;
        let keyword = text.get(keyword)?;
        if !keyword.ends_with(b"OFF") {
            return None;
        }
        let written = [word(&mut line)?, word(&mut line)?];
        let count = |range: &Range<usize>| std::str::from_utf8(text.get(range.clone())?).ok()?.parse::<u64>().ok();
        let (vertices, faces) = (count(&written[0])?, count(&written[1])?);
        let has_normals = keyword.strip_suffix(b"OFF")?.contains(&b'N');
        line.skip_line();
        line.end();
        let head = line.at;
        let first = text.get(row(text, head)?)?;
        let (mut at, width) = (head, count_words(first));
        for _ in 0..vertices {
            let row = row(text, at)?;
            if count_words(text.get(row.clone())?) != width || width < 3 {
                return None;
            }
            at = row.end;
        }
        let end_of_vertices = at;
        let mut cells = Cells::of(Form::Text, first);
        let is_whole: Vec<bool> = std::iter::from_fn(|| cells.word()).map(|word| word.iter().all(u8::is_ascii_digit)).collect();
        let mut carries = width > 3;
        for _ in 0..faces {
            let row = row(text, at)?;
            let mut cells = Cells::of(Form::Text, text.get(row.clone())?);
            let corners = cells.word().and_then(number)?;
            carries |= count_words(text.get(row.clone())?) as f64 > corners + 1.0;
            at = row.end;
        }
        let mixes = (0..width).map(|k| match k {
            0..3 => Mix::Axis(k),
            3..6 if has_normals => Mix::Direction,
            _ if is_whole.get(k) == Some(&true) => Mix::Whole,
            _ => Mix::Mean,
        });
        let whole = positions.len() as u64 == vertices;
        let (mixes, end_of_faces) = (mixes.collect(), at);
        whole.then_some(Self { text, written, head, end_of_vertices, end_of_faces, faces, positions, mixes, carries })
    }

    /// The words behind the corners of a face.
    fn behind_corners(&self, row: Range<usize>) -> &[u8] {
        let text = self.text.get(row).unwrap_or_default();
        let mut line = line_at(text, 0);
        let corners = line.whole().unwrap_or_default();
        for _ in 0..corners {
            let _ = line.whole();
        }
        line.within = true;
        if line.token().is_none() {
            return &[];
        }
        let from = line.at;
        line.skip_line();
        let said = text.get(from..line.at).unwrap_or_default();
        said.split(|byte| *byte == b'#').next().unwrap_or_default().trim_ascii()
    }
}

fn line_at(text: &[u8], at: usize) -> Line<'_> {
    Line { text, at, within: false, comments: true }
}

/// The next word.
fn word(line: &mut Line<'_>) -> Option<Range<usize>> {
    let rest = line.token()?;
    let length = rest.iter().position(|byte| byte.is_ascii_whitespace() || *byte == b'#').unwrap_or(rest.len());
    let from = line.at;
    line.at += length;
    (length > 0).then_some(from..line.at)
}

/// The next line that has a word, from its first one on, with its end.
fn row(text: &[u8], at: usize) -> Option<Range<usize>> {
    let mut line = line_at(text, at);
    line.token()?;
    let from = line.at;
    line.skip_line();
    line.end();
    Some(from..line.at)
}

/// Words of a row, without a comment.
fn count_words(row: &[u8]) -> usize {
    let row = row.split(|byte| *byte == b'#').next().unwrap_or_default();
    row.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).count()
}

struct OffFaces<'a> {
    text: &'a [u8],
    at: usize,
    left: u64,
}

impl Faces for OffFaces<'_> {
    fn next_face(&mut self, face: &mut FaceRow) -> Option<()> {
        self.left = self.left.checked_sub(1)?;
        face.whole = row(self.text, self.at)?;
        self.at = face.whole.end;
        face.corners.clear();
        let mut line = line_at(self.text.get(..face.whole.end)?, face.whole.start);
        for _ in 0..line.whole()? {
            face.corners.push([u32::try_from(line.whole()?).ok()?, NONE, NONE]);
        }
        Some(())
    }
}

impl Rows for Off<'_> {
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
        [self.positions.len() as u32, 0, 0]
    }

    fn position(&self, vertex: u32) -> Option<Point> {
        self.positions.get(vertex.into())
    }

    fn faces(&self) -> Box<dyn Faces + '_> {
        Box::new(OffFaces { text: self.text, at: self.end_of_vertices, left: self.faces })
    }

    fn says(&self, row: &FaceRow) -> Vec<u8> {
        self.behind_corners(row.whole.clone()).to_vec()
    }

    fn mixes(&self, _: usize) -> &[Mix] {
        &self.mixes
    }

    fn values(&self, channel: usize, rows: &BTreeSet<u32>) -> Option<BTreeMap<u32, Vec<f64>>> {
        if channel != VERTICES {
            return rows.is_empty().then(BTreeMap::new);
        }
        let (mut all, mut at, mut passed) = (BTreeMap::new(), self.head, 0);
        for wanted in rows {
            for _ in passed..*wanted {
                at = row(self.text, at)?.end;
            }
            passed = *wanted;
            let mut cells = Cells::of(Form::Text, self.text.get(row(self.text, at)?)?);
            all.insert(*wanted, self.mixes.iter().map(|_| number(cells.word()?)).collect::<Option<_>>()?);
        }
        Some(all)
    }

    fn make_room(&self, vertices: u64, faces: u64) -> bool {
        vertices <= 1 << 31 && faces <= 1 << 31
    }

    fn head(&self, vertices: u64, faces: u64) -> (Vec<u8>, usize) {
        let text = |range: Range<usize>| self.text.get(range).unwrap_or_default();
        let [first, second] = self.written.clone();
        let [vertices, faces] = [vertices, faces].map(|count| count.to_string());
        let before_faces = [text(0..first.start), vertices.as_bytes(), text(first.end..second.start)].concat();
        ([&before_faces, faces.as_bytes(), text(second.end..self.head)].concat(), self.head)
    }

    fn end_of_vertices(&self) -> usize {
        self.end_of_vertices
    }

    fn end_of_faces(&self) -> usize {
        self.end_of_faces
    }

    fn put_row(&self, _: usize, values: &[f64], out: &mut Vec<u8>) {
        for (place, _) in self.mixes.iter().enumerate() {
            if place > 0 {
                out.push(b' ');
            }
            put_decimal(values.get(place).copied().unwrap_or_default(), out);
        }
        out.push(b'\n');
    }

    fn put_face(&self, triangle: &Triangle<'_>, out: &mut Vec<u8>) {
        out.push(b'3');
        for corner in triangle.corners {
            out.push(b' ');
            out.extend_from_slice(corner[VERTICES].to_string().as_bytes());
        }
        let said = triangle.source.map(|source| self.behind_corners(source.row.clone())).unwrap_or_default();
        if !said.is_empty() {
            out.push(b' ');
            out.extend_from_slice(said);
        }
        out.push(b'\n');
    }
}
