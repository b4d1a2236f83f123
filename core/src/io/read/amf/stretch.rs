//! The children of one element that holds vertices or triangles, from one byte of the text to another.
//!
//! Plain ones are read fast; the first byte that is not plain is read by [`Tokens`], child by child, until the text is plain again. So a stretch may
//! begin anywhere between two children, whatever stands before it.

use super::super::finding::Rejection;
use super::super::number::{self, COMMA, Number, POINT};
use super::super::rounding::Rounding;
use super::plain;
use super::xml::{Token, Tokens, Trouble};
use crate::util::words::{Count, Counted};

/// A position as it is kept until it is placed: x, y, z as little-endian `f64`.
pub(super) type Position = [u8; 24];
/// A triangle as it is kept: the indices of its vertices in its mesh, as little-endian `u32`; [`ASTRAY`] for one that is none.
pub(super) type Indices = [u8; 12];

/// No vertex has this index.
const ASTRAY: u32 = u32::MAX;
/// Bytes of a number that are kept; what is longer is none.
const LONGEST_NUMBER: usize = 1024;

/// The children that count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Children of `vertices`.
    Vertices,
    /// Children of `volume`.
    Triangles,
}

/// Why a stretch ends where it does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    /// It reached the byte that it was to reach.
    Reached,
    /// The element around ends there.
    Closed,
    /// A child begins there that ends beyond the text.
    CutOff,
    /// The text there is no XML.
    Bad(Trouble),
}

/// Counts of vertices and triangles, and of what is odd about them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Notes {
    /// All vertices.
    pub(super) vertices: u64,
    /// Those with a coordinate that is missing, or is no number.
    pub(super) damaged: u64,
    /// Where the first of them begins.
    pub(super) first_damage: Option<u64>,
    /// With a normal.
    pub(super) normals: u64,
    /// Curved edges.
    pub(super) edges: u64,
    /// Colours and places in textures.
    pub(super) colours: u64,
    /// Volumes that are no part of the model to a slicer.
    pub(super) roles: u64,
    /// Metadata of volumes, but for names.
    pub(super) metadata: u64,
    /// [`POINT`] and [`COMMA`], as they were seen.
    pub(super) separators: u8,
}

impl Notes {
    /// Joins the notes of what stands behind these.
    pub(super) fn append(&mut self, behind: Self) {
        self.vertices += behind.vertices;
        self.damaged += behind.damaged;
        self.first_damage = self.first_damage.or(behind.first_damage);
        self.normals += behind.normals;
        self.edges += behind.edges;
        self.colours += behind.colours;
        self.roles += behind.roles;
        self.metadata += behind.metadata;
        self.separators |= behind.separators;
    }

    /// Refuses coordinates that nobody can rely on.
    pub(super) fn judge(&self) -> Result<(), Rejection> {
        if self.separators == POINT | COMMA {
            return Err(Rejection::Unreadable("decimal commas and decimal points are mixed".into()));
        }
        if self.damaged > self.vertices / 2 {
            let vertices = Counted(self.damaged, "vertex", "vertices");
            let first = Count(self.first_damage.unwrap_or_default());
            let reason = format!("{vertices} with coordinates that are no numbers, the first at byte {first}");
            return Err(Rejection::Unreadable(reason));
        }
        Ok(())
    }
}

/// The children in a stretch of the text.
#[derive(Debug)]
pub(super) struct Stretch {
    /// The byte where it begins.
    pub(super) from: usize,
    /// The byte where it ends.
    pub(super) at: usize,
    pub(super) end: End,
    pub(super) positions: Vec<Position>,
    pub(super) indices: Vec<Indices>,
    pub(super) rounding: Rounding,
    pub(super) notes: Notes,
}

/// Reads children from the byte `from` until one ends at `until` or beyond it; `around` elements are open. O(bytes), and no more memory than the
/// text that is read.
pub(super) fn read(text: &[u8], (from, until): (usize, usize), kind: Kind, around: usize) -> Stretch {
    let (positions, indices) = (Vec::new(), Vec::new());
    let (rounding, notes) = (Rounding::default(), Notes::default());
    let mut stretch = Stretch { from, at: from, end: End::Reached, positions, indices, rounding, notes };
    match kind {
        Kind::Vertices => stretch.positions.reserve(until.saturating_sub(from) / 80),
        Kind::Triangles => stretch.indices.reserve(until.saturating_sub(from) / 60),
    }
    loop {
        stretch.at = plain::beyond_blanks(text, stretch.at);
        if stretch.at >= until {
            return stretch;
        }
        if !stretch.plain(text, kind) {
            match stretch.child(text, kind, around) {
                Ok(true) => {}
                Ok(false) => stretch.end = End::Closed,
                Err(Trouble::CutOff) => stretch.end = End::CutOff,
                Err(trouble) => stretch.end = End::Bad(trouble),
            }
            if stretch.end != End::Reached {
                return stretch;
            }
        }
    }
}

impl Stretch {
    /// Reads a child in plain form, if there is one.
    #[inline]
    fn plain(&mut self, text: &[u8], kind: Kind) -> bool {
        match kind {
            Kind::Vertices => plain::vertex(text, self.at).is_some_and(|(numbers, end)| {
                let point = numbers.map(|(digits, number)| self.coordinate(digits, number));
                self.position(point);
                self.at = end;
                true
            }),
            Kind::Triangles => plain::triangle(text, self.at).is_some_and(|(indices, end)| {
                self.triangle(indices);
                self.at = end;
                true
            }),
        }
    }

    /// Reads the next child, comment or text, whatever it is; `false` where the element around ends.
    fn child(&mut self, text: &[u8], kind: Kind, around: usize) -> Result<bool, Trouble> {
        let mut tokens = Tokens::from(text, self.at, around);
        let Some(token) = tokens.next()? else { return Ok(false) };
        if let Token::Start(tag) = token {
            match (kind, tag.name) {
                (Kind::Vertices, b"vertex") => self.odd_vertex(&mut tokens)?,
                (Kind::Triangles, b"triangle") => self.odd_triangle(&mut tokens)?,
                (Kind::Vertices, b"edge") => {
                    tokens.skip()?;
                    self.notes.edges += 1;
                }
                (Kind::Triangles, b"metadata") => {
                    let of = tag.attribute(b"type", LONGEST_NUMBER).unwrap_or_default();
                    let value = tokens.content(LONGEST_NUMBER)?;
                    self.notes.metadata += u64::from(of != b"name");
                    self.notes.roles += u64::from(is_role(&of, value.trim_ascii()));
                }
                _ => {
                    self.notes.colours += u64::from(is_colour(tag.name));
                    tokens.skip()?;
                }
            }
        }
        self.at = tokens.at();
        Ok(true)
    }

    /// Reads a vertex that has begun.
    fn odd_vertex(&mut self, tokens: &mut Tokens<'_>) -> Result<(), Trouble> {
        let mut texts: [Option<Vec<u8>>; 3] = [None, None, None];
        let mut normals = 0;
        loop {
            match tokens.next()?.ok_or(Trouble::CutOff)? {
                Token::Start(tag) if tag.name == b"coordinates" => coordinates(tokens, &mut texts)?,
                Token::Start(tag) => {
                    normals += u64::from(tag.name == b"normal");
                    self.notes.colours += u64::from(is_colour(tag.name));
                    tokens.skip()?;
                }
                Token::End => break,
                _ => {}
            }
        }
        self.notes.normals += normals;
        let point = texts.map(|text| {
            let text = text.unwrap_or_default();
            let digits = text.trim_ascii_end();
            let number = number::number(digits).filter(|number| number.length == digits.len() && text.len() < LONGEST_NUMBER)?;
            Some(self.coordinate(digits, number))
        });
        if point.contains(&None) {
            self.notes.damaged += 1;
            self.notes.first_damage = self.notes.first_damage.or(Some(self.at as u64));
        }
        self.position(point.map(|value| value.unwrap_or(f64::NAN)));
        Ok(())
    }

    /// Reads a triangle that has begun.
    fn odd_triangle(&mut self, tokens: &mut Tokens<'_>) -> Result<(), Trouble> {
        let mut indices = [ASTRAY; 3];
        loop {
            match tokens.next()?.ok_or(Trouble::CutOff)? {
                Token::Start(tag) => {
                    let [a, b, c] = &mut indices;
                    let index = match tag.name {
                        b"v1" => a,
                        b"v2" => b,
                        b"v3" => c,
                        name => {
                            self.notes.colours += u64::from(is_colour(name));
                            tokens.skip()?;
                            continue;
                        }
                    };
                    let text = tokens.content(LONGEST_NUMBER)?;
                    *index = plain::index(text.trim_ascii_end()).filter(|_| text.len() < LONGEST_NUMBER).unwrap_or(ASTRAY);
                }
                Token::End => break,
                _ => {}
            }
        }
        self.triangle(indices);
        Ok(())
    }

    /// Notes a coordinate, and gives the `f64` that is kept of it: the nearest one that becomes the same `f32`. (A decimal next to the middle of two
    /// `f32` may have the middle itself as its nearest `f64`.)
    #[inline]
    fn coordinate(&mut self, digits: &[u8], Number { value, wide, length, separator }: Number) -> f64 {
        self.notes.separators |= separator;
        self.rounding.of_decimal(digits, length, wide, value);
        if wide as f32 == value || value.is_nan() {
            wide
        } else if f64::from(value) > wide {
            wide.next_up()
        } else {
            wide.next_down()
        }
    }

    #[inline]
    fn position(&mut self, point: [f64; 3]) {
        self.notes.vertices += 1;
        let mut position = [0; 24];
        for (bytes, value) in position.as_chunks_mut().0.iter_mut().zip(point) {
            *bytes = value.to_le_bytes();
        }
        self.positions.push(position);
    }

    #[inline]
    fn triangle(&mut self, indices: [u32; 3]) {
        let mut triangle = [0; 12];
        for (bytes, index) in triangle.as_chunks_mut().0.iter_mut().zip(indices) {
            *bytes = index.to_le_bytes();
        }
        self.indices.push(triangle);
    }
}

/// An element that colours what it stands in (ISO/ASTM 52915, section 6.5 and 6.6).
pub(super) fn is_colour(name: &[u8]) -> bool {
    matches!(name, b"color" | b"texmap" | b"map")
}

/// Says this metadatum of a volume that it is no part of the model? (PrusaSlicer's `src/libslic3r/Format/AMF.cpp`, `amf_volume`.)
fn is_role(of: &[u8], value: &[u8]) -> bool {
    match of {
        b"slic3r.volume_type" => !matches!(value, b"ModelPart" | b""),
        b"slic3r.modifier" => value == b"1",
        _ => false,
    }
}

/// Reads the element `coordinates` that has begun.
fn coordinates(tokens: &mut Tokens<'_>, texts: &mut [Option<Vec<u8>>; 3]) -> Result<(), Trouble> {
    loop {
        match tokens.next()?.ok_or(Trouble::CutOff)? {
            Token::Start(tag) => {
                let [x, y, z] = &mut *texts;
                let axis = match tag.name {
                    b"x" => x,
                    b"y" => y,
                    b"z" => z,
                    _ => {
                        tokens.skip()?;
                        continue;
                    }
                };
                *axis = Some(tokens.content(LONGEST_NUMBER)?);
            }
            Token::End => return Ok(()),
            _ => {}
        }
    }
}
