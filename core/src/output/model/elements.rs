//! The triangles of a mesh in a 3MF model part, as they stand in its text.
//!
//! Only text that the reader took is looked at here: well-formed, without entities but the five of XML.

use std::ops::Range;

/// One `<triangle …/>`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Element<'t> {
    /// Its number among the elements that were asked for.
    pub(crate) number: u32,
    /// Where it stands in the text, from `<` to the end of the tag that closes it.
    pub(crate) whole: Range<usize>,
    /// Its name with its prefix.
    pub(crate) name: &'t [u8],
    /// The numbers of its vertices.
    pub(crate) vertices: [u32; 3],
    /// All other attributes, in order: name with prefix, and value as it stands.
    pub(crate) attributes: Vec<(&'t [u8], &'t [u8])>,
}

impl<'t> Element<'t> {
    /// The value of the attribute of this name, whatever its prefix.
    pub(crate) fn value(&self, name: &[u8]) -> Option<&'t [u8]> {
        self.attributes.iter().find(|(own, _)| local(own) == name).map(|(_, value)| *value)
    }
}

/// The name without its prefix.
pub(crate) fn local(name: &[u8]) -> &[u8] {
    name.iter().position(|byte| *byte == b':').map_or(name, |colon| name.get(colon + 1..).unwrap_or_default())
}

/// A tag.
pub(crate) enum Tag<'t> {
    /// That an element begins with.
    Start(Element<'t>),
    /// All of an element.
    Empty(Element<'t>),
    /// That an element of this name ends with, and where it stands.
    End(&'t [u8], Range<usize>),
}

/// The triangles within a stretch of a text, in order.
#[derive(Clone)]
pub(crate) struct Elements<'t> {
    text: &'t [u8],
    at: usize,
    end: usize,
    /// So many were given.
    count: u32,
}

impl<'t> Elements<'t> {
    /// Those between the tags of a `<triangles>`.
    pub(crate) fn within(text: &'t [u8], range: Range<usize>) -> Self {
        Self { text, at: range.start, end: range.end.min(text.len()), count: 0 }
    }

    fn rest(&self) -> &'t [u8] {
        self.text.get(self.at..self.end).unwrap_or_default()
    }

    /// Moves behind the next of these bytes; `false` at the end.
    fn skip_past(&mut self, mark: &[u8]) -> bool {
        let found = self.rest().windows(mark.len()).position(|window| window == mark);
        self.at = found.map_or(self.end, |found| self.at + found + mark.len());
        found.is_some()
    }

    /// The tag that begins here, and whether it is closed by itself.
    fn tag(&mut self) -> Option<(Element<'t>, bool)> {
        let begin = self.at;
        self.at += 1;
        let name = self.word();
        let mut element = Element { number: 0, whole: begin..begin, name, vertices: [u32::MAX; 3], attributes: Vec::new() };
        loop {
            self.skip_blanks();
            match self.rest() {
                [b'/', b'>', ..] => {
                    self.at += 2;
                    element.whole.end = self.at;
                    return Some((element, true));
                }
                [b'>', ..] => {
                    self.at += 1;
                    element.whole.end = self.at;
                    return Some((element, false));
                }
                [] => return None,
                _ => {}
            }
            let name = self.word();
            self.skip_blanks();
            if self.rest().first() != Some(&b'=') {
                return None;
            }
            self.at += 1;
            self.skip_blanks();
            let quote = *self.rest().first()?;
            self.at += 1;
            let length = self.rest().iter().position(|byte| *byte == quote)?;
            let value = self.rest().get(..length)?;
            self.at += length + 1;
            match name {
                b"v1" => element.vertices[0] = number(value)?,
                b"v2" => element.vertices[1] = number(value)?,
                b"v3" => element.vertices[2] = number(value)?,
                _ => element.attributes.push((name, value)),
            }
        }
    }

    fn word(&mut self) -> &'t [u8] {
        let rest = self.rest();
        let ends = |byte: &u8| byte.is_ascii_whitespace() || matches!(byte, b'=' | b'/' | b'>');
        let word = rest.get(..rest.iter().position(ends).unwrap_or(rest.len())).unwrap_or_default();
        self.at += word.len();
        word
    }

    fn skip_blanks(&mut self) {
        self.at += self.rest().iter().take_while(|byte| byte.is_ascii_whitespace()).count();
    }
}

impl<'t> Iterator for Elements<'t> {
    type Item = Element<'t>;

    fn next(&mut self) -> Option<Element<'t>> {
        self.next_called(b"triangle")
    }
}

impl<'t> Elements<'t> {
    /// The next element of this name, whatever its prefix.
    pub(crate) fn next_called(&mut self, name: &[u8]) -> Option<Element<'t>> {
        loop {
            let (mut element, is_closed) = match self.next_tag()? {
                Tag::Start(element) => (element, false),
                Tag::Empty(element) => (element, true),
                Tag::End(..) => continue,
            };
            if local(element.name) != name {
                continue;
            }
            if !is_closed && self.skip_past(b"</") && self.skip_past(b">") {
                element.whole.end = self.at;
            }
            element.number = self.count;
            self.count = self.count.saturating_add(1);
            return Some(element);
        }
    }

    /// The next tag. `None` at the end, and for ever where one is not understood.
    pub(crate) fn next_tag(&mut self) -> Option<Tag<'t>> {
        loop {
            let length = self.rest().iter().position(|byte| *byte == b'<')?;
            self.at += length;
            let begin = self.at;
            match self.rest() {
                [b'<', b'!', b'-', b'-', ..] => {
                    self.skip_past(b"-->");
                }
                [b'<', b'?', ..] => {
                    self.skip_past(b"?>");
                }
                [b'<', b'/', ..] => {
                    self.at += 2;
                    let name = self.word();
                    self.skip_past(b">");
                    return Some(Tag::End(name, begin..self.at));
                }
                _ => {
                    let tag = self.tag();
                    if tag.is_none() {
                        self.at = begin;
                    }
                    let (element, is_closed) = tag?;
                    return Some(if is_closed { Tag::Empty(element) } else { Tag::Start(element) });
                }
            }
        }
    }

    /// There is no tag any more, not even one that is not understood.
    pub(crate) fn is_at_end(&self) -> bool {
        !self.rest().contains(&b'<')
    }
}

/// A whole number, maybe between blanks, its digits maybe as character references.
fn number(text: &[u8]) -> Option<u32> {
    let text = std::str::from_utf8(text).ok()?;
    if !text.contains('&') {
        return text.trim().parse().ok();
    }
    quick_xml::escape::unescape(text).ok()?.trim().parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_are_found_in_any_form() {
        let text = b"<triangles><triangle v1=\"0\" v2='1'\n v3 = \"&#50;\" pid=\"5\" s:paint='8'/><!-- <triangle v1=\"9\"/> -->\
            <x:triangle v1=\"2\" v2=\"1\" v3=\"3\" ></x:triangle >\n</triangles>";
        let inner = 11..text.len() - 12;
        let all: Vec<_> = Elements::within(text, inner).collect();
        assert_eq!(all.len(), 2);
        assert_eq!([all[0].number, all[1].number], [0, 1]);
        assert_eq!(all[0].vertices, [0, 1, 2]);
        assert_eq!(all[0].attributes, [(&b"pid"[..], &b"5"[..]), (b"s:paint", b"8")]);
        assert_eq!(all[0].value(b"paint"), Some(&b"8"[..]));
        assert!(text[all[0].whole.clone()].ends_with(b"'8'/>"));
        assert_eq!((all[1].vertices, all[1].name), ([2, 1, 3], &b"x:triangle"[..]));
        assert!(text[all[1].whole.clone()].ends_with(b"</x:triangle >"));
    }

    #[test]
    fn cut_off_text_ends_the_triangles() {
        let text = b"<triangle v1=\"0\" v2=\"1\" v3=\"2\"/><triangle v1=\"0\" v2";
        for end in 0..text.len() {
            assert_eq!(Elements::within(text, 0..end).count(), usize::from(end >= 32), "{end}");
        }
    }
}
