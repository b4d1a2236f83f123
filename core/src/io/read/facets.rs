//! The grammar of text STL, as a stream of tokens: line breaks mean nothing except at the end of a solid's name, keywords may be
//! in any case, and what is no keyword is passed over (some writers put colours or comments between facets).
//!
//! One rule makes the text divisible: the words `facet normal` begin a facet wherever they stand, be it in the middle of a name
//! or of an unfinished facet. So a file may be cut before any of them, and parsing the pieces gives what parsing the whole would.

use super::number::{is_blank, number};
use crate::io::record::{self, Point, Record};

/// Names of solids kept for the report.
pub(super) const NAMES_KEPT: usize = 5;

/// Counts of a piece of text, besides triangles.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Tally {
    pub(super) facets: u64,
    /// Facets (or loops) of fewer than three vertices; they give no triangle.
    pub(super) short: u64,
    /// Loops of more than three vertices, cut into fans.
    pub(super) polygons: u64,
    /// Facets that another one begins in.
    pub(super) unclosed: u64,
    /// Vertices with a coordinate that is no number; it reads as NaN.
    pub(super) damaged: u64,
    /// Where the first of them stands.
    pub(super) first_damage: Option<u64>,
    /// Union of the separators seen in numbers.
    pub(super) separators: u8,
    pub(super) solids: u64,
    pub(super) ends: u64,
    /// Names of the first solids.
    pub(super) names: Vec<Vec<u8>>,
    /// Solids whose name is not UTF-8.
    pub(super) odd_names: u64,
    /// A `facet` was not in lower case.
    pub(super) upper_case: bool,
    /// The text ends within a facet; its last loop was left out, since its last number may be cut.
    pub(super) cut_off: bool,
}

impl Tally {
    /// Joins the tally of the text that follows.
    pub(super) fn append(&mut self, next: Self) {
        self.facets += next.facets;
        self.short += next.short;
        self.polygons += next.polygons;
        self.unclosed += next.unclosed;
        self.damaged += next.damaged;
        self.first_damage = self.first_damage.or(next.first_damage);
        self.separators |= next.separators;
        self.solids += next.solids;
        self.ends += next.ends;
        self.names.extend(next.names);
        self.names.truncate(NAMES_KEPT);
        self.odd_names += next.odd_names;
        self.upper_case |= next.upper_case;
        self.cut_off |= next.cut_off;
    }
}

/// Does `text` begin with the words `facet normal`?
pub(super) fn begins_facet(text: &[u8]) -> bool {
    let Some((facet, rest)) = text.split_at_checked(5) else { return false };
    if !facet.eq_ignore_ascii_case(b"facet") {
        return false;
    }
    let blanks = rest.iter().take_while(|&&byte| is_blank(byte)).count();
    let Some((normal, rest)) = rest.get(blanks..).and_then(|rest| rest.split_at_checked(6)) else { return false };
    blanks > 0 && normal.eq_ignore_ascii_case(b"normal") && rest.first().is_none_or(|&byte| is_blank(byte))
}

/// The first place in `from..until` where a facet begins.
pub(super) fn next_facet(text: &[u8], from: usize, until: usize) -> Option<usize> {
    let until = until.min(text.len());
    let mut after_blank = from.checked_sub(1).and_then(|at| text.get(at)).is_none_or(|&byte| is_blank(byte));
    for (at, &byte) in text.get(..until)?.iter().enumerate().skip(from) {
        if after_blank && byte | 0x20 == b'f' && begins_facet(text.get(at..)?) {
            return Some(at);
        }
        after_blank = is_blank(byte);
    }
    None
}

/// The triangles of `text`, which stands at byte `base` and begins with the file or with a facet. `last`: nothing follows it.
pub(super) fn parse(text: &[u8], base: u64, last: bool) -> (Vec<Record>, Tally) {
    // A facet takes some 250 bytes; a generous guess saves regrowth.
    let records = Vec::with_capacity(text.len() / 160);
    let mut parser = Parser { text, at: 0, base, records, tally: Tally::default(), facet: Facet::default() };
    while parser.step() {}
    parser.finish(last);
    (parser.records, parser.tally)
}

/// The facet being read.
#[derive(Default)]
struct Facet {
    open: bool,
    normal: Point,
    /// It has a complete loop.
    looped: bool,
    /// Vertices of the present loop, and the two of them that the next triangle of its fan needs.
    vertices: u64,
    first: Point,
    previous: Point,
    /// Records, damaged vertices and the first of those before the present loop, to undo it.
    before: (usize, u64, Option<u64>),
}

struct Parser<'a> {
    text: &'a [u8],
    at: usize,
    base: u64,
    records: Vec<Record>,
    tally: Tally,
    facet: Facet,
}

/// The words that mean something.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Keyword {
    Solid,
    EndSolid,
    Facet,
    EndFacet,
    Loop,
    EndLoop,
    Vertex,
    End,
}

#[inline]
fn keyword(token: &[u8]) -> Option<Keyword> {
    let (word, keyword): (&[u8], _) = match (token.len(), token.first()? | 0x20) {
        (6, b'v') => (b"vertex", Keyword::Vertex),
        (5, b'f') => (b"facet", Keyword::Facet),
        (8, b'e') if token.get(3)? | 0x20 == b'f' => (b"endfacet", Keyword::EndFacet),
        (7, b'e') => (b"endloop", Keyword::EndLoop),
        (4, b'l') => (b"loop", Keyword::Loop),
        (8, b'e') => (b"endsolid", Keyword::EndSolid),
        (5, b's') => (b"solid", Keyword::Solid),
        (3, b'e') => (b"end", Keyword::End),
        _ => return None,
    };
    token.eq_ignore_ascii_case(word).then_some(keyword)
}

impl<'a> Parser<'a> {
    #[inline]
    fn rest(&self) -> &'a [u8] {
        self.text.get(self.at..).unwrap_or_default()
    }

    #[inline]
    fn skip_blanks(&mut self) {
        while self.text.get(self.at).is_some_and(|&byte| is_blank(byte)) {
            self.at += 1;
        }
    }

    /// The next token, which is left where it is; empty at the end.
    #[inline]
    fn peek(&mut self) -> &'a [u8] {
        self.skip_blanks();
        let rest = self.rest();
        let length = rest.iter().position(|&byte| is_blank(byte)).unwrap_or(rest.len());
        rest.get(..length).unwrap_or_default()
    }

    /// Reads one token and what belongs to it; `false` at the end.
    #[inline]
    fn step(&mut self) -> bool {
        let token = self.peek();
        if token.is_empty() {
            return false;
        }
        let begin = self.at;
        self.at += token.len();
        match keyword(token) {
            Some(Keyword::Vertex) => self.vertex(),
            Some(Keyword::Facet) => self.begin_facet(token),
            Some(Keyword::EndFacet) => self.end_facet(),
            Some(Keyword::Loop | Keyword::EndLoop) => self.end_loop(),
            Some(Keyword::Solid) => self.solid(),
            Some(Keyword::EndSolid) => self.end_solid(),
            Some(Keyword::End) => self.spaced_end(),
            None => {}
        }
        self.at > begin
    }

    /// Three numbers; missing and unreadable ones are `None`. A keyword in their place is left to be read as one.
    #[inline]
    fn numbers(&mut self) -> [Option<f32>; 3] {
        let mut values = [None; 3];
        for value in &mut values {
            self.skip_blanks();
            match number(self.rest()) {
                Some(number) => {
                    *value = Some(number.value);
                    self.tally.separators |= number.separator;
                    self.at += number.length;
                }
                None => {
                    let token = self.peek();
                    if keyword(token).is_some() {
                        break;
                    }
                    self.at += token.len();
                }
            }
        }
        values
    }

    #[inline]
    fn vertex(&mut self) {
        if self.facet.vertices == 0 {
            self.facet.before = (self.records.len(), self.tally.damaged, self.tally.first_damage);
        }
        let at = self.at;
        let values = self.numbers();
        if values.contains(&None) {
            self.tally.damaged += 1;
            self.tally.first_damage = self.tally.first_damage.or(Some(self.base + at as u64));
        }
        let point = values.map(|value| value.unwrap_or(f32::NAN));
        let facet = &mut self.facet;
        match facet.vertices {
            0 => facet.first = point,
            1 => {}
            _ => self.records.push(record::assemble(facet.normal, [facet.first, facet.previous, point], 0)),
        }
        facet.previous = point;
        facet.vertices += 1;
    }

    fn begin_facet(&mut self, token: &[u8]) {
        if self.facet.open {
            self.tally.unclosed += 1;
        }
        self.end_facet();
        self.tally.facets += 1;
        self.tally.upper_case |= token != b"facet";
        self.facet.open = true;
        let word = self.peek();
        if word.eq_ignore_ascii_case(b"normal") {
            self.at += word.len();
            self.facet.normal = self.numbers().map(|value| value.unwrap_or(0.0));
        }
    }

    fn end_loop(&mut self) {
        match self.facet.vertices {
            0 => return,
            1 | 2 => self.tally.short += 1,
            3 => {}
            _ => self.tally.polygons += 1,
        }
        self.facet.looped = true;
        self.facet.vertices = 0;
    }

    fn end_facet(&mut self) {
        self.end_loop();
        if self.facet.open && !self.facet.looped {
            self.tally.short += 1;
        }
        self.facet = Facet::default();
    }

    fn solid(&mut self) {
        let name = self.rest_of_line();
        self.tally.solids += 1;
        self.tally.odd_names += u64::from(std::str::from_utf8(name).is_err());
        if self.tally.names.len() < NAMES_KEPT {
            // As much of a name as a report or a header can use.
            self.tally.names.push(name.get(..256).unwrap_or(name).to_vec());
        }
    }

    fn end_solid(&mut self) {
        self.rest_of_line();
        self.tally.ends += 1;
    }

    /// `end` with a blank before `facet`, `loop` or `solid`.
    fn spaced_end(&mut self) {
        let token = self.peek();
        let end = match keyword(token) {
            Some(Keyword::Facet) if !begins_facet(self.rest()) => Self::end_facet,
            Some(Keyword::Loop) => Self::end_loop,
            Some(Keyword::Solid) => Self::end_solid,
            _ => return,
        };
        self.at += token.len();
        end(self);
    }

    /// A name: up to the end of the line, or to a facet that begins on the same line.
    fn rest_of_line(&mut self) -> &'a [u8] {
        let rest = self.rest();
        let line = rest.iter().position(|byte| matches!(byte, b'\n' | b'\r')).unwrap_or(rest.len());
        let length = next_facet(rest, 0, line).unwrap_or(line);
        self.at += length;
        rest.get(..length).unwrap_or_default().trim_ascii()
    }

    fn finish(&mut self, last: bool) {
        if !last {
            if self.facet.open {
                self.tally.unclosed += 1;
            }
            self.end_facet();
        } else if self.facet.open || self.facet.vertices > 0 {
            self.tally.cut_off = true;
            if self.facet.vertices > 0 {
                let (records, damaged, first_damage) = self.facet.before;
                self.records.truncate(records);
                (self.tally.damaged, self.tally.first_damage) = (damaged, first_damage);
            }
        }
    }
}
