//! Elements and text of a part, one after the other.

use std::ops::Range;

use quick_xml::Reader;
use quick_xml::events::Event;

use super::super::archive::shown;
use super::super::finding::Rejection;
use super::element::Element;
use super::scopes::Scopes;
use crate::util::words::Count;

/// Elements in each other, at most.
const DEEPEST: usize = 64;
/// Bytes of a piece of text, at most.
const LONGEST_TEXT: usize = 64 << 10;
const BOM: &[u8] = b"\xef\xbb\xbf";

/// What stands next.
#[derive(Debug)]
pub(crate) enum Node<'a> {
    Start(Element<'a>),
    /// The end of the innermost open element; its end tag stands there.
    End(Range<usize>),
    /// A piece of text, its references resolved, cut to 64 KiB.
    Text(String),
    /// The end of the part.
    Over,
}

/// An element that is open.
struct Open<'a> {
    raw_name: &'a [u8],
    /// Namespaces that were declared before it.
    scopes: usize,
}

/// Pulls what a part holds.
pub(crate) struct Xml<'a> {
    part: &'a str,
    text: &'a [u8],
    /// Where the reader began.
    base: usize,
    reader: Reader<&'a [u8]>,
    open: Vec<Open<'a>>,
    scopes: Scopes,
    /// The element that was told of last is a tag of its own.
    ends: bool,
    /// It is a piece, whose outermost elements stand in others.
    piece: bool,
}

impl<'a> Xml<'a> {
    /// Of a whole part.
    ///
    /// # Errors
    /// Another encoding than UTF-8.
    pub(crate) fn of(part: &'a str, text: &'a [u8]) -> Result<Self, Rejection> {
        let utf16 = [b"\xff\xfe".as_slice(), b"\xfe\xff", b"<\0", b"\0<"];
        if utf16.iter().any(|mark| text.starts_with(mark)) {
            return Err(refused(part, "is UTF-16, which is not read; UTF-8 is"));
        }
        let base = if text.starts_with(BOM) { BOM.len() } else { 0 };
        Ok(Self::at(part, text, base, Scopes::default()))
    }

    /// Of a piece of a part that stands within these namespaces: what lies between two bytes of `text`, and may hold several elements and any text.
    pub(crate) fn within(part: &'a str, text: &'a [u8], piece: Range<usize>, scopes: Scopes) -> Self {
        let text = text.get(..piece.end).unwrap_or(text);
        Self { piece: true, ..Self::at(part, text, piece.start, scopes) }
    }

    fn at(part: &'a str, text: &'a [u8], base: usize, scopes: Scopes) -> Self {
        Self {
            part,
            text,
            base,
            reader: reader(text.get(base..).unwrap_or_default()),
            open: Vec::new(),
            scopes,
            ends: false,
            piece: false,
        }
    }

    /// Where the reading stands in the part: behind the tag that was told of last.
    pub(crate) fn position(&self) -> usize {
        self.base.saturating_add(usize::try_from(self.reader.buffer_position()).unwrap_or(usize::MAX)).min(self.text.len())
    }

    /// The namespaces that are declared here.
    pub(crate) fn scopes(&self) -> &Scopes {
        &self.scopes
    }

    /// A refusal of the part.
    pub(crate) fn refuse(&self, reason: impl std::fmt::Display) -> Rejection {
        refused(self.part, reason)
    }

    /// A refusal of the part, for an element of it.
    pub(crate) fn refuse_element(&self, element: &Element<'_>, reason: impl std::fmt::Display) -> Rejection {
        self.refuse(format!("is damaged: <{}> at byte {} {reason}", element.name, Count(element.tag.start)))
    }

    fn damaged(&self, at: usize, reason: impl std::fmt::Display) -> Rejection {
        self.refuse(format!("is no sound XML: {reason}, at byte {}", Count(at)))
    }

    /// What stands next.
    pub(crate) fn next(&mut self) -> Result<Node<'a>, Rejection> {
        self.step(true)
    }

    /// The next element in the one that is open, or `None` at its end. Text between them is left out.
    pub(crate) fn child(&mut self) -> Result<Option<Element<'a>>, Rejection> {
        loop {
            match self.next()? {
                Node::Start(element) => return Ok(Some(element)),
                Node::End(_) | Node::Over => return Ok(None),
                Node::Text(_) => {}
            }
        }
    }

    /// Leaves out the rest of the innermost open element; gives where its end tag stands. Attributes are not looked at.
    pub(crate) fn skip(&mut self) -> Result<Range<usize>, Rejection> {
        let depth = self.open.len();
        loop {
            match self.step(false)? {
                Node::End(tag) if self.open.len() < depth => return Ok(tag),
                Node::Over => return Ok(self.text.len()..self.text.len()),
                _ => {}
            }
        }
    }

    /// Leaves out the rest of the open element up to the next end tag, if that is its own and nothing but elements without content lies before it.
    /// `None`, and nothing is left out, if not. Gives where the end tag stands.
    pub(crate) fn skip_plain(&mut self) -> Option<Range<usize>> {
        if self.ends {
            return None;
        }
        let from = self.position();
        let rest = self.text.get(from..)?;
        let length = memchr::memmem::find(rest, b"</")?;
        let inner = rest.get(..length)?;
        let name = self.open.last()?.raw_name;
        let behind = rest.get(length + 2..)?.strip_prefix(name)?;
        let blank = behind.iter().take_while(|byte| byte.is_ascii_whitespace()).count();
        if behind.get(blank) != Some(&b'>') || has_markup(inner) {
            return None;
        }
        let tag = from + length..from + length + 2 + name.len() + blank + 1;
        self.base = tag.end;
        self.reader = reader(self.text.get(tag.end..)?);
        self.leave();
        Some(tag)
    }

    fn leave(&mut self) -> Option<Open<'a>> {
        let open = self.open.pop()?;
        self.scopes.truncate(open.scopes);
        Some(open)
    }

    /// `attributes`: whether elements are read, or only their depth is.
    fn step(&mut self, attributes: bool) -> Result<Node<'a>, Rejection> {
        if std::mem::take(&mut self.ends) {
            self.leave();
            let at = self.position();
            return Ok(Node::End(at..at));
        }
        loop {
            let from = self.position();
            let event = self.reader.read_event();
            let to = self.position();
            match event {
                Err(error) => return Err(self.damaged(from, error)),
                Ok(Event::Start(_)) => return self.enter(from..to, false, attributes),
                Ok(Event::Empty(_)) => return self.enter(from..to, true, attributes),
                Ok(Event::End(end)) => {
                    let same = self.open.last().is_some_and(|open| open.raw_name == end.name().0);
                    if !same {
                        return Err(self.damaged(from, "an end tag without its start"));
                    }
                    self.leave();
                    return Ok(Node::End(from..to));
                }
                Ok(Event::Eof) if self.open.is_empty() => return Ok(Node::Over),
                Ok(Event::Eof) => return Err(self.damaged(from, "it ends within an element")),
                Ok(Event::DocType(_)) => return Err(self.refuse("has a document type definition, which no part may have")),
                Ok(Event::Decl(decl)) => self.check_encoding(decl.encoding())?,
                Ok(Event::Comment(_) | Event::PI(_)) => {}
                Ok(Event::Text(_) | Event::GeneralRef(_)) => {
                    let raw = self.text.get(from..to).unwrap_or_default();
                    if let Some(text) = self.text_of(raw, from, attributes)? {
                        return Ok(Node::Text(text));
                    }
                }
                Ok(Event::CData(data)) => {
                    if attributes {
                        let start = data.get(..LONGEST_TEXT).unwrap_or(&data);
                        return Ok(Node::Text(String::from_utf8_lossy(start).into_owned()));
                    }
                }
            }
        }
    }

    /// A piece of text, if it is asked for and more than blank.
    fn text_of(&self, raw: &[u8], at: usize, wanted: bool) -> Result<Option<String>, Rejection> {
        let blank = raw.iter().all(u8::is_ascii_whitespace);
        if self.open.is_empty() && !blank && !self.piece {
            return Err(self.damaged(at, "text outside of its elements"));
        }
        if blank || !(wanted || raw.first() == Some(&b'&')) {
            return Ok(None);
        }
        let raw = std::str::from_utf8(raw).map_err(|_| self.damaged(at, "text that is no UTF-8"))?;
        let raw = raw.get(..raw.floor_char_boundary(LONGEST_TEXT)).unwrap_or(raw);
        let text = quick_xml::escape::unescape(raw);
        let text = text.map_err(|_| self.damaged(at, "a reference to an entity or a character that is not there"))?;
        Ok(wanted.then(|| text.into_owned()))
    }

    fn enter(&mut self, tag: Range<usize>, empty: bool, attributes: bool) -> Result<Node<'a>, Rejection> {
        let (from, to) = (tag.start + 1, tag.end.saturating_sub(if empty { 2 } else { 1 }));
        let inner = self.text.get(from..to).unwrap_or_default();
        if self.open.len() == DEEPEST {
            return Err(self.damaged(tag.start, format!("more than {DEEPEST} elements in each other")));
        }
        let length = inner.iter().position(u8::is_ascii_whitespace).unwrap_or(inner.len());
        let raw_name = inner.get(..length).unwrap_or_default();
        if raw_name.is_empty() {
            return Err(self.damaged(tag.start, "an element without a name"));
        }
        self.open.push(Open { raw_name, scopes: self.scopes.len() });
        self.ends = empty;
        if !attributes {
            return Ok(Node::Text(String::new()));
        }
        let Ok(inner) = std::str::from_utf8(inner) else {
            return Err(self.damaged(tag.start, "a tag that is no UTF-8"));
        };
        let element = Element::read(inner, tag.clone(), &mut self.scopes);
        element.map(Node::Start).map_err(|reason| self.damaged(tag.start, format!("a tag that {reason}")))
    }

    fn check_encoding(
        &self,
        encoding: Option<Result<std::borrow::Cow<'_, [u8]>, quick_xml::events::attributes::AttrError>>,
    ) -> Result<(), Rejection> {
        let Some(Ok(name)) = encoding else { return Ok(()) };
        if [b"utf-8".as_slice(), b"us-ascii", b"utf8", b"ascii"].iter().any(|known| name.eq_ignore_ascii_case(known)) {
            return Ok(());
        }
        Err(self.refuse(format!("is encoded as {}, which is not read; UTF-8 is", shown(&String::from_utf8_lossy(&name)))))
    }
}

/// A refusal that names the part.
pub(super) fn refused(part: &str, reason: impl std::fmt::Display) -> Rejection {
    Rejection::Unreadable(format!("the part {} {reason}", shown(part)))
}

fn reader(text: &[u8]) -> Reader<&[u8]> {
    let mut reader = Reader::from_reader(text);
    let config = reader.config_mut();
    // Both are looked at here, so that the reader keeps no names.
    config.check_end_names = false;
    config.allow_unmatched_ends = true;
    reader
}

/// A comment, a CDATA section or a processing instruction.
fn has_markup(text: &[u8]) -> bool {
    memchr::memmem::find(text, b"<!").is_some() || memchr::memmem::find(text, b"<?").is_some()
}
