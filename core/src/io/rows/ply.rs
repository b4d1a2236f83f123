//! The rows of a PLY: those of its elements `vertex` and `face`, in any form.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::sync::OnceLock;

use super::cells::{self, Cells, Form};
use super::table::{Corner, FaceRow, Faces, NONE, Rows, Source, Triangle, VERTICES};
use super::values::{Mix, facing};
use crate::io::read::Vertices;
use crate::io::read::elements::cursor::Cursor;
use crate::io::read::elements::layout::{Layout, Scalar, Step};
use crate::io::read::elements::lines::Line;
use crate::io::read::elements::packed::Packed;
use crate::io::read::ply::header::{self, Element, Property};
use crate::io::read::ply::roles::{self, Role};
use crate::io::record::Point;

/// The file says more than positions, each in 32 bits, and faces, by its header.
pub(crate) fn says_more(bytes: &[u8]) -> bool {
    let is_plain = |element: &Element| match element.name.as_slice() {
        b"vertex" => element.properties.iter().all(|property| {
            property.kind != Scalar::F64 && matches!(property.name.as_slice(), b"x" | b"y" | b"z") && property.list.is_none()
        }),
        b"face" | b"tristrips" => element.properties.iter().all(is_indices),
        _ => element.count == 0,
    };
    !header::read(bytes).is_ok_and(|header| header.elements.iter().all(is_plain))
}

/// A PLY of one element of vertices and one of faces, and maybe others.
pub(crate) struct Ply<'a> {
    bytes: &'a [u8],
    form: Form,
    head: usize,
    vertices: Section,
    faces: Section,
    positions: Vertices<'a>,
    mixes: Vec<Mix>,
    carries: bool,
    /// The type of indices in the output, where it is wider than that of the file.
    index: OnceLock<Scalar>,
}

/// An element where it stands.
struct Section {
    element: Element,
    layout: Layout,
    range: Range<usize>,
}

impl<'a> Ply<'a> {
    /// `None` for a file that is not so. O(bytes) in text.
    pub(crate) fn of(bytes: &'a [u8], positions: Vertices<'a>) -> Option<Self> {
        let header = header::read(bytes).ok()?;
        let parts = roles::of(&header).ok()?;
        let form = match header.form {
            header::Form::Text => Form::Text,
            header::Form::Little => Form::Little,
            header::Form::Big => Form::Big,
        };
        let (mut vertices, mut faces, mut at) = (None, None, header.end);
        for (element, part) in header.elements.into_iter().zip(parts) {
            let from = at;
            at = end_of(bytes, form, at, part.count, &part.layout)?;
            let section = Section { element, layout: part.layout, range: from..at };
            match part.role {
                Role::Vertices if section.layout.stride().is_some() => vertices = Some(section),
                Role::Faces if faces.is_none() => faces = Some(section),
                Role::None => {}
                _ => return None,
            }
        }
        let (vertices, faces) = (vertices?, faces?);
        // New positions are fractions, for which whole numbers have no place.
        let is_whole = |step: &Step| matches!(step, Step::Coordinate(_, kind) if !matches!(kind, Scalar::F32 | Scalar::F64));
        if vertices.layout.steps().iter().any(is_whole) {
            return None;
        }
        let mixes: Vec<Mix> = vertices.element.properties.iter().map(mix).collect();
        let carries = says_more(bytes);
        Some(Self { bytes, form, head: header.end, vertices, faces, positions, mixes, carries, index: OnceLock::new() })
    }

    /// The corners of the face at a cursor.
    fn corners(&self, cursor: &mut dyn Cursor, row: &mut FaceRow) -> Option<()> {
        for step in self.faces.layout.steps() {
            match *step {
                Step::List { length, item, indices: true } => {
                    for _ in 0..cursor.length(length, item)? {
                        let vertex = u32::try_from(cursor.index(item)?).ok()?;
                        row.corners.push([vertex, NONE, NONE]);
                    }
                }
                step => cursor.pass(step)?,
            }
        }
        Some(())
    }
}

/// Where so many rows of an element end.
fn end_of(bytes: &[u8], form: Form, from: usize, rows: u64, layout: &Layout) -> Option<usize> {
    if let (Some(stride), true) = (layout.stride(), form != Form::Text) {
        let end = usize::try_from(rows).ok()?.checked_mul(stride)?.checked_add(from)?;
        return (end <= bytes.len()).then_some(end);
    }
    let mut at = from;
    for _ in 0..rows {
        at = row(bytes, form, at, &mut |cursor| layout.steps().iter().try_for_each(|step| cursor.pass(*step)))?.end;
    }
    Some(at)
}

/// The row there, whose numbers are taken by `take`.
fn row(bytes: &[u8], form: Form, at: usize, take: &mut dyn FnMut(&mut dyn Cursor) -> Option<()>) -> Option<Range<usize>> {
    match form {
        Form::Text => {
            let mut line = Line { text: bytes, at, within: false, comments: false };
            line.token()?;
            let from = line.at;
            take(&mut line)?;
            line.end();
            Some(from..line.at)
        }
        Form::Little => {
            let mut packed = Packed::<false> { bytes, at };
            take(&mut packed)?;
            Some(at..packed.at)
        }
        Form::Big => {
            let mut packed = Packed::<true> { bytes, at };
            take(&mut packed)?;
            Some(at..packed.at)
        }
    }
}

/// How the numbers of a property are mixed.
fn mix(property: &Property) -> Mix {
    match property.name.as_slice() {
        b"x" => Mix::Axis(0),
        b"y" => Mix::Axis(1),
        b"z" => Mix::Axis(2),
        b"nx" | b"ny" | b"nz" => Mix::Direction,
        _ if property.kind.is_float() => Mix::Mean,
        b"red" | b"green" | b"blue" | b"alpha" | b"r" | b"g" | b"b" | b"a" | b"intensity" | b"quality" | b"confidence" => {
            Mix::Mean
        }
        name if [b"diffuse_".as_slice(), b"ambient_", b"specular_"].iter().any(|before| name.starts_with(before)) => Mix::Mean,
        _ => Mix::Heaviest,
    }
}

/// A list of coordinates in a texture, so many for each corner.
fn is_of_corners(property: &Property) -> bool {
    property.kind.is_float() && matches!(property.name.as_slice(), b"texcoord" | b"tex_coord" | b"texture_uv" | b"uv")
}

struct PlyFaces<'r, 'a> {
    ply: &'r Ply<'a>,
    at: usize,
    left: u64,
}

impl Faces for PlyFaces<'_, '_> {
    fn next_face(&mut self, face: &mut FaceRow) -> Option<()> {
        self.left = self.left.checked_sub(1)?;
        face.corners.clear();
        let Ply { bytes, form, .. } = *self.ply;
        face.whole = row(bytes, form, self.at, &mut |cursor| self.ply.corners(cursor, face))?;
        self.at = face.whole.end;
        Some(())
    }
}

impl Rows for Ply<'_> {
    fn bytes(&self) -> &[u8] {
        self.bytes
    }

    fn is_text(&self) -> bool {
        self.form == Form::Text
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
        Box::new(PlyFaces { ply: self, at: self.faces.range.start, left: self.faces.element.count })
    }

    fn says(&self, row: &FaceRow) -> Vec<u8> {
        let mut said = Vec::new();
        let cells = self.cells(row.whole.clone());
        for (property, values) in self.faces.element.properties.iter().zip(cells.unwrap_or_default()) {
            let is_own = !is_indices(property) && !is_of_corners(property);
            values.iter().filter(|_| is_own).for_each(|value| said.extend(value.to_le_bytes()));
        }
        said
    }

    fn mixes(&self, _: usize) -> &[Mix] {
        &self.mixes
    }

    fn values(&self, channel: usize, rows: &BTreeSet<u32>) -> Option<BTreeMap<u32, Vec<f64>>> {
        if channel != VERTICES {
            return rows.is_empty().then(BTreeMap::new);
        }
        let Section { element, layout, range } = &self.vertices;
        let (mut all, mut at, mut passed) = (BTreeMap::new(), range.start, 0);
        for number in rows {
            at = end_of(self.bytes, self.form, at, u64::from(number - passed), layout)?;
            passed = *number;
            let mut cells = Cells::of(self.form, self.bytes.get(at..range.end)?);
            let values = element.properties.iter().map(|property| cells.next(property.kind)).collect::<Option<_>>()?;
            all.insert(*number, values);
        }
        Some(all)
    }

    fn is_split(&self) -> bool {
        let is_of_texture =
            |property: &Property| matches!(property.name.as_slice(), b"s" | b"t" | b"u" | b"v" | b"texture_u" | b"texture_v");
        self.vertices.element.properties.iter().any(is_of_texture)
    }

    fn make_room(&self, vertices: u64, faces: u64) -> bool {
        let kind = self.faces.element.properties.iter().find(|property| is_indices(property)).map(|property| property.kind);
        let has_room = kind.is_none_or(|kind| vertices <= most_vertices(kind));
        if !has_room && vertices <= most_vertices(Scalar::I32) {
            return faces <= u64::from(u32::MAX) && *self.index.get_or_init(|| Scalar::I32) == Scalar::I32;
        }
        has_room && faces <= u64::from(u32::MAX)
    }

    fn copy(&self, range: Range<usize>, put: &mut dyn FnMut(&[u8])) {
        let faces = self.faces.range.clone();
        let [from, to] = [faces.start, faces.end].map(|end| end.clamp(range.start, range.end));
        if self.index.get().is_none() || self.form == Form::Text || from >= to {
            return put(self.bytes.get(range).unwrap_or_default());
        }
        put(self.bytes.get(range.start..from).unwrap_or_default());
        self.widen(from..to, put);
        put(self.bytes.get(to..range.end).unwrap_or_default());
    }

    fn head(&self, vertices: u64, faces: u64) -> (Vec<u8>, usize) {
        let head = self.bytes.get(..self.head).unwrap_or_default();
        let mut out = Vec::with_capacity(head.len() + 20);
        let mut is_of_faces = false;
        for line in head.split_inclusive(|byte| matches!(byte, b'\r' | b'\n')) {
            let words: Vec<&[u8]> = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).collect();
            if let [b"element", name, _] = words.as_slice() {
                is_of_faces = *name == self.faces.element.name;
            }
            let count = match words.as_slice() {
                [b"property", b"list", _, kind, b"vertex_indices" | b"vertex_index"]
                    if is_of_faces && self.index.get().is_some() =>
                {
                    let at = kind.as_ptr() as usize - line.as_ptr() as usize;
                    out.extend_from_slice(line.get(..at).unwrap_or_default());
                    out.extend_from_slice(b"int");
                    out.extend_from_slice(line.get(at + kind.len()..).unwrap_or_default());
                    continue;
                }
                [b"element", name, _] if *name == self.vertices.element.name => vertices,
                [b"element", name, _] if *name == self.faces.element.name => faces,
                _ => {
                    out.extend_from_slice(line);
                    continue;
                }
            };
            let digits = line.iter().rposition(u8::is_ascii_digit).unwrap_or_default() + 1;
            let before = line.get(..digits).unwrap_or_default();
            let before = before.iter().rposition(|byte| !byte.is_ascii_digit()).map_or(0, |last| last + 1);
            out.extend_from_slice(line.get(..before).unwrap_or_default());
            out.extend_from_slice(count.to_string().as_bytes());
            out.extend_from_slice(line.get(digits..).unwrap_or_default());
        }
        (out, self.head)
    }

    fn end_of_vertices(&self) -> usize {
        self.vertices.range.end
    }

    fn end_of_faces(&self) -> usize {
        self.faces.range.end
    }

    fn put_row(&self, _: usize, values: &[f64], out: &mut Vec<u8>) {
        for (place, property) in self.vertices.element.properties.iter().enumerate() {
            cells::put(self.form, property.kind, values.get(place).copied().unwrap_or_default(), out);
        }
        self.end_row(out);
    }

    fn put_face(&self, triangle: &Triangle<'_>, out: &mut Vec<u8>) {
        let there = triangle.source.and_then(|source| self.cells(source.row.clone()));
        let is_against = triangle.is_turned && there.as_ref().is_none_or(|cells| self.is_against(cells, triangle));
        for (place, property) in self.faces.element.properties.iter().enumerate() {
            let own = there.as_ref().and_then(|cells| cells.get(place)).map_or(&[][..], Vec::as_slice);
            let values = if is_indices(property) {
                triangle.corners.map(|corner| f64::from(corner[VERTICES])).to_vec()
            } else if is_of_corners(property) {
                of_corners(own, triangle)
            } else if is_against && matches!(property.name.as_slice(), b"nx" | b"ny" | b"nz") {
                own.iter().map(|value| -value).collect()
            } else {
                own.to_vec()
            };
            match property.list {
                Some(length) => cells::put(self.form, length, values.len() as f64, out),
                None if values.is_empty() => cells::put(self.form, property.kind, 0.0, out),
                None => {}
            }
            let kind = self.kind_of(property);
            values.iter().for_each(|value| cells::put(self.form, kind, *value, out));
        }
        self.end_row(out);
    }
}

impl Ply<'_> {
    /// The normal that a face says of itself does not look where its triangle looks.
    fn is_against(&self, cells: &[Vec<f64>], triangle: &Triangle<'_>) -> bool {
        let value = |name: &[u8]| {
            let place = self.faces.element.properties.iter().position(|property| property.name == name)?;
            cells.get(place)?.first().copied()
        };
        let [Some(nx), Some(ny), Some(nz)] = [b"nx", b"ny", b"nz"].map(|name| value(name)) else { return true };
        let now = facing(triangle.corners.map(|corner| self.position(corner[VERTICES]).unwrap_or_default()));
        nx * now[0] + ny * now[1] + nz * now[2] <= 0.0
    }

    /// The type of a property of faces in the output.
    fn kind_of(&self, property: &Property) -> Scalar {
        self.index.get().copied().filter(|_| is_indices(property)).unwrap_or(property.kind)
    }

    /// Gives faces on with wider indices.
    fn widen(&self, range: Range<usize>, put: &mut dyn FnMut(&[u8])) {
        let (mut at, mut out) = (range.start, Vec::new());
        while at < range.end {
            let pass = &mut |cursor: &mut dyn Cursor| self.faces.layout.steps().iter().try_for_each(|step| cursor.pass(*step));
            // All rows were read before.
            let Some(row) = row(self.bytes, self.form, at, pass) else { return };
            at = row.end;
            for (property, values) in self.faces.element.properties.iter().zip(self.cells(row).unwrap_or_default()) {
                if let Some(length) = property.list {
                    cells::put(self.form, length, values.len() as f64, &mut out);
                }
                values.iter().for_each(|value| cells::put(self.form, self.kind_of(property), *value, &mut out));
            }
            put(&out);
            out.clear();
        }
    }

    /// The numbers of a face by property.
    fn cells(&self, row: Range<usize>) -> Option<Vec<Vec<f64>>> {
        let mut cells = Cells::of(self.form, self.bytes.get(row)?);
        let mut next = |property: &Property| match property.list {
            None => Some(vec![cells.next(property.kind)?]),
            // As many as there are: the row was read before.
            Some(length) => (0..cells.next(length)? as u64).map(|_| cells.next(property.kind)).collect(),
        };
        self.faces.element.properties.iter().map(&mut next).collect()
    }

    fn end_row(&self, out: &mut Vec<u8>) {
        if self.form == Form::Text {
            out.pop_if(|byte| *byte == b' ');
            out.push(b'\n');
        }
    }
}

/// Most vertices that indices of this type tell apart.
fn most_vertices(kind: Scalar) -> u64 {
    match kind {
        Scalar::I8 => 1 << 7,
        Scalar::U8 => 1 << 8,
        Scalar::I16 => 1 << 15,
        Scalar::U16 => 1 << 16,
        Scalar::I32 => 1 << 31,
        Scalar::U32 | Scalar::F32 | Scalar::F64 => u64::from(NONE),
    }
}

/// The list that names the vertices of a face.
fn is_indices(property: &Property) -> bool {
    matches!(property.name.as_slice(), b"vertex_indices" | b"vertex_index")
}

/// Numbers of a triangle's corners, from those of its source's.
fn of_corners(own: &[f64], triangle: &Triangle<'_>) -> Vec<f64> {
    let Some(Source { places: Some(places), corners, .. }) = triangle.source else { return Vec::new() };
    let each = own.len().checked_div(*corners as usize).unwrap_or_default();
    let of = |place: u32, k: usize| own.get(place as usize * each + k).copied().unwrap_or_default();
    let corner = |weights: &[f64; 3], k: usize| places.iter().zip(weights).map(|(place, weight)| of(*place, k) * weight).sum();
    triangle.weights.iter().flat_map(|weights| (0..each).map(move |k| corner(weights, k))).collect()
}
