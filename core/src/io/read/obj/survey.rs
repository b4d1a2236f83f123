//! The first look at an OBJ: its vertices, and how much of what else there is.

use super::super::number::Number;
use super::super::rounding::Rounding;
use super::super::spool::POSITION_BYTES;
use super::super::vertices::packed;
use super::line::Cursor;

/// Names of objects kept for the report.
pub(super) const NAMES_KEPT: usize = 5;

/// Counts of a piece of text.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Survey {
    pub(super) vertices: u64,
    /// Vertices with a coordinate that is missing or no number; it reads as NaN.
    pub(super) damaged: u64,
    /// Where the first of them stands.
    pub(super) first_damage: Option<u64>,
    /// Union of the separators seen in numbers.
    pub(super) separators: u8,
    /// Vertices with a weight that is not 1.
    pub(super) weighted: u64,
    pub(super) rounding: Rounding,
    pub(super) faces: u64,
    pub(super) points: u64,
    pub(super) lines: u64,
    /// Curves and surfaces of free form.
    pub(super) curves: u64,
    pub(super) objects: u64,
    /// Names of the first objects.
    pub(super) names: Vec<Vec<u8>>,
    /// The first group that has a name.
    pub(super) group: Option<Vec<u8>>,
    /// Statements that the specification does not know.
    pub(super) unknown: u64,
    /// The first of them.
    pub(super) first_unknown: Option<Vec<u8>>,
    /// The text ends within a statement.
    pub(super) cut_off: bool,
}

impl Survey {
    /// Joins the counts of the text that follows.
    pub(super) fn append(&mut self, next: Self) {
        self.vertices += next.vertices;
        self.damaged += next.damaged;
        self.first_damage = self.first_damage.or(next.first_damage);
        self.separators |= next.separators;
        self.weighted += next.weighted;
        self.rounding.append(next.rounding);
        self.faces += next.faces;
        self.points += next.points;
        self.lines += next.lines;
        self.curves += next.curves;
        self.objects += next.objects;
        self.names.extend(next.names);
        self.names.truncate(NAMES_KEPT);
        self.group = self.group.take().or(next.group);
        self.unknown += next.unknown;
        self.first_unknown = self.first_unknown.take().or(next.first_unknown);
        self.cut_off |= next.cut_off;
    }
}

/// A statement by its keyword.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::io) enum Statement {
    Vertex,
    Face,
    Point,
    Line,
    Curve,
    Object,
    Group,
    /// In the specification, and of no matter for a mesh.
    Other,
    Unknown,
}

impl Statement {
    /// The statement that a keyword begins.
    #[inline]
    pub(in crate::io) fn of(keyword: &[u8]) -> Self {
        match keyword {
            b"v" => Self::Vertex,
            b"vt" | b"vn" => Self::Other,
            // "fo" is its older name.
            b"f" | b"fo" => Self::Face,
            b"p" => Self::Point,
            b"l" => Self::Line,
            b"o" => Self::Object,
            b"g" => Self::Group,
            b"s" | b"mg" | b"usemtl" | b"mtllib" | b"usemap" | b"maplib" | b"vp" => Self::Other,
            b"curv" | b"curv2" | b"surf" | b"bzp" | b"bsp" | b"cdc" | b"cdp" => Self::Curve,
            b"cstype" | b"deg" | b"bmat" | b"step" | b"parm" | b"trim" | b"hole" | b"scrv" | b"sp" | b"end" | b"con" | b"res" => {
                Self::Other
            }
            b"bevel" | b"c_interp" | b"d_interp" | b"lod" | b"shadow_obj" | b"trace_obj" | b"ctech" | b"stech" | b"call"
            | b"csh" => Self::Other,
            _ => Self::Unknown,
        }
    }
}

/// The vertices of `text`, which stands at byte `base` and begins with a line; and what else there is.
pub(super) fn survey(text: &[u8], base: u64) -> (Vec<[u8; POSITION_BYTES]>, Survey) {
    let mut cursor = Cursor::of(text);
    let mut positions = Vec::new();
    let mut found = Survey::default();
    while let Some(keyword) = cursor.keyword() {
        let statement = Statement::of(keyword);
        match statement {
            Statement::Vertex => {
                let at = base + (cursor.at - keyword.len()) as u64;
                positions.extend(vertex(&mut cursor, at, &mut found));
            }
            Statement::Face => found.faces += 1,
            Statement::Point => found.points += 1,
            Statement::Line => found.lines += 1,
            Statement::Curve => found.curves += 1,
            Statement::Object => object(cursor.name(), &mut found),
            Statement::Group => {
                let name = cursor.name();
                found.group = found.group.take().or((!name.is_empty()).then(|| shortened(name)));
            }
            Statement::Other => {}
            Statement::Unknown if cursor.is_at_end() => found.cut_off = true,
            Statement::Unknown => {
                found.unknown += 1;
                found.first_unknown.get_or_insert_with(|| shortened(keyword));
            }
        }
        cursor.skip_line();
    }
    found.vertices = positions.len() as u64;
    (positions, found)
}

fn object(name: &[u8], found: &mut Survey) {
    found.objects += 1;
    if found.names.len() < NAMES_KEPT {
        found.names.push(shortened(name));
    }
}

/// As much of a name as a report or a header can use.
fn shortened(name: &[u8]) -> Vec<u8> {
    name.get(..256).unwrap_or(name).to_vec()
}

/// A vertex, its keyword behind. `None` if the text ends within it.
#[inline]
fn vertex(cursor: &mut Cursor<'_>, at: u64, found: &mut Survey) -> Option<[u8; POSITION_BYTES]> {
    let mut point = [f32::NAN; 3];
    let mut complete = true;
    for value in &mut point {
        match cursor.number() {
            Some(Some((number, text))) => {
                *value = number.value;
                found.separators |= number.separator;
                found.rounding.of_decimal(text, number.length, number.wide, number.value);
            }
            Some(None) => complete = false,
            None if cursor.is_at_end() => {
                found.cut_off = true;
                return None;
            }
            None => complete = false,
        }
    }
    if !complete {
        found.damaged += 1;
        found.first_damage = found.first_damage.or(Some(at));
    }
    if cursor.is_at_word() {
        beyond_position(cursor, found);
    }
    Some(packed(point))
}

/// Behind x, y, z: a weight, a colour or both, the weight first.
fn beyond_position(cursor: &mut Cursor<'_>, found: &mut Survey) {
    let mut numbers = [None::<Number>; 4];
    let mut count = 0;
    while let (Some(place), Some(number)) = (numbers.get_mut(count), cursor.number()) {
        *place = number.map(|(number, _)| number);
        count += 1;
    }
    let weight = numbers[0].filter(|_| count == 1 || count == 4);
    found.weighted += u64::from(weight.is_some_and(|weight| weight.value != 1.0));
}
