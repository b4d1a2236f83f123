//! The header of a PLY: lines of words, up to `end_header`.

use crate::io::read::elements::layout::Scalar;
use crate::io::read::finding::{Finding, Rejection};
use crate::util::words::Count;

/// Longest header.
const LONGEST: usize = 1 << 20;

/// The numbers behind the header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::io) enum Form {
    Text,
    Little,
    Big,
}

/// A property of an element.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::io) struct Property {
    pub(in crate::io) name: Vec<u8>,
    /// Of a list: that of its length.
    pub(in crate::io) list: Option<Scalar>,
    pub(in crate::io) kind: Scalar,
}

/// Elements of one kind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::io) struct Element {
    pub(in crate::io) name: Vec<u8>,
    pub(in crate::io) count: u64,
    pub(in crate::io) properties: Vec<Property>,
}

/// A header.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::io) struct Header {
    pub(in crate::io) form: Form,
    pub(in crate::io) elements: Vec<Element>,
    /// Where the elements begin.
    pub(in crate::io) end: usize,
    pub(in crate::io) findings: Vec<Finding>,
}

/// Reads the header at the beginning of `bytes`.
///
/// # Errors
/// [`Rejection::Unreadable`], with the number of the line that is no PLY.
pub(in crate::io) fn read(bytes: &[u8]) -> Result<Header, Rejection> {
    let mut lines = Lines::new(bytes);
    let (mut form, mut findings, mut elements) = (None, Vec::new(), Vec::<Element>::new());
    // The first is `ply`, by which the format was told.
    lines.next();
    loop {
        let Some(line) = lines.next() else {
            return Err(Rejection::Unreadable("a PLY model whose header does not end".into()));
        };
        let bad = || Rejection::Unreadable(format!("a PLY model; line {} of its header is damaged", Count(lines.number)));
        let words: Vec<&[u8]> = line.split(|byte| byte.is_ascii_whitespace()).filter(|word| !word.is_empty()).collect();
        match words.as_slice() {
            [] | [b"comment" | b"obj_info", ..] => {}
            [b"format", name, version, ..] => {
                form = Some(form_of(name).ok_or_else(bad)?);
                if *version != b"1.0" && findings.is_empty() {
                    findings.push(Finding::flaw("a version of PLY that is not 1.0, read as 1.0"));
                }
            }
            [b"element", name, count] => {
                let count = std::str::from_utf8(count).ok().and_then(|count| count.parse().ok()).ok_or_else(bad)?;
                elements.push(Element { name: name.to_vec(), count, properties: Vec::new() });
            }
            [b"property", rest @ ..] => {
                let property = property_of(rest).ok_or_else(bad)?;
                elements.last_mut().ok_or_else(bad)?.properties.push(property);
            }
            [b"end_header"] => break,
            _ => return Err(bad()),
        }
    }
    let form = form.ok_or_else(|| Rejection::Unreadable("a PLY model whose header names no format".into()))?;
    Ok(Header { form, elements, end: lines.at, findings })
}

fn form_of(name: &[u8]) -> Option<Form> {
    Some(match name {
        b"ascii" => Form::Text,
        b"binary_little_endian" => Form::Little,
        b"binary_big_endian" => Form::Big,
        _ => return None,
    })
}

/// A property by the words behind `property`.
fn property_of(words: &[&[u8]]) -> Option<Property> {
    let (list, kind, name) = match *words {
        [b"list", length, item, name] => (Some(scalar_of(length)?), item, name),
        [kind, name] => (None, kind, name),
        _ => return None,
    };
    Some(Property { name: name.to_vec(), list, kind: scalar_of(kind)? })
}

/// A type by either of its names.
fn scalar_of(name: &[u8]) -> Option<Scalar> {
    Some(match name {
        b"char" | b"int8" => Scalar::I8,
        b"uchar" | b"uint8" => Scalar::U8,
        b"short" | b"int16" => Scalar::I16,
        b"ushort" | b"uint16" => Scalar::U16,
        b"int" | b"int32" => Scalar::I32,
        b"uint" | b"uint32" => Scalar::U32,
        b"float" | b"float32" => Scalar::F32,
        b"double" | b"float64" => Scalar::F64,
        _ => return None,
    })
}

/// The lines of a header.
struct Lines<'a> {
    bytes: &'a [u8],
    /// Where the next one begins.
    at: usize,
    /// The number of the last one, from 1.
    number: usize,
    /// The first one ended in CR alone: so does every other, and an LF behind the last one is a number's.
    bare: bool,
}

impl<'a> Lines<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        let first = bytes.iter().take(LONGEST).position(|byte| matches!(byte, b'\r' | b'\n')).unwrap_or_default();
        let bare = bytes.get(first) == Some(&b'\r') && bytes.get(first + 1) != Some(&b'\n');
        Self { bytes, at: 0, number: 0, bare }
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        let rest = self.bytes.get(self.at..LONGEST.min(self.bytes.len()))?;
        let length = rest.iter().position(|byte| matches!(byte, b'\r' | b'\n'))?;
        let wide = !self.bare && rest.get(length) == Some(&b'\r') && self.bytes.get(self.at + length + 1) == Some(&b'\n');
        self.at += length + 1 + usize::from(wide);
        self.number += 1;
        rest.get(..length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(end: &str) -> Vec<u8> {
        let lines = [
            "ply",
            "format ascii 1.0",
            "comment made by hand",
            "obj_info a fan",
            "element vertex 3",
            "property float32 x",
            "element face 1",
            "property list uchar int vertex_index",
            "end_header",
            "",
        ];
        lines.join(end).into_bytes()
    }

    #[test]
    fn lines_end_in_any_way() {
        for end in ["\n", "\r\n", "\r"] {
            let mut bytes = header(end);
            let length = bytes.len();
            // A number that begins as a line end does.
            bytes.push(b'\n');
            let read = read(&bytes).unwrap();
            assert_eq!((read.end, read.form, read.elements.len()), (length, Form::Text, 2));
            let x = Property { name: b"x".into(), list: None, kind: Scalar::F32 };
            assert_eq!(read.elements[0], Element { name: b"vertex".into(), count: 3, properties: vec![x] });
            let list = Property { name: b"vertex_index".into(), list: Some(Scalar::U8), kind: Scalar::I32 };
            assert_eq!(read.elements[1].properties, [list]);
        }
    }

    #[test]
    fn damage_is_named_by_its_line() {
        let text = String::from_utf8(header("\n")).unwrap();
        for (old, new, line) in [
            ("float32 x", "float33 x", "line 6 "),
            ("element vertex 3", "element vertex -3", "line 5 "),
            ("comment", "kommentar", "line 3 "),
            ("ascii", "text", "line 2 "),
            ("end_header", "", "does not end"),
            ("format ascii 1.0", "", "names no format"),
        ] {
            let read = read(text.replace(old, new).as_bytes());
            let Err(Rejection::Unreadable(reason)) = read else { panic!("{new}: {read:?}") };
            assert!(reason.contains(line), "{reason}");
        }
    }
}
