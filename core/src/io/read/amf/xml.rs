//! The elements of an XML text, one after the other, where they lie.
//!
//! **In:** text in UTF-8, or in another encoding that holds ASCII as it is; a place in it.
//! **Out:** starts and ends of elements, text between them.
//! **Promise:** no recursion, no memory but for the names of open elements, of which there are at most [`DEEPEST`]; no entities but the five of XML
//! itself, no document type declaration, nothing that lies outside the text.
//!
//! Form: "Extensible Markup Language (XML) 1.0 (Fifth Edition)", W3C, 2008, sections 2.4 to 2.8, 3.1 and 4.1. Prefixes of namespaces stay in the names.

use memchr::{memchr, memmem};

use super::super::finding::Rejection;
use crate::util::words::Count;

/// Most elements within each other.
pub(super) const DEEPEST: usize = 64;
/// Bytes of a tag with its attributes, at most.
const LONGEST_TAG: usize = 1 << 20;

/// A part of the text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Token<'a> {
    /// An element begins. One without content ends with the next token.
    Start(Tag<'a>),
    /// The innermost open element ends.
    End,
    /// Text, in which entities stand as they are written.
    Text(&'a [u8]),
    /// Text that is taken as it is (CDATA).
    Data(&'a [u8]),
    /// A comment, or an instruction for programs.
    Aside,
}

/// The start of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Tag<'a> {
    pub(super) name: &'a [u8],
    attributes: &'a [u8],
}

/// Why there is no next token.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Trouble {
    /// The text ends before this is complete.
    CutOff,
    /// The text is no XML, or holds parts that are not read.
    Bad {
        /// The byte.
        at: usize,
        /// Completes "byte 7 of the XML: …".
        reason: &'static str,
    },
}

impl From<Trouble> for Rejection {
    fn from(trouble: Trouble) -> Self {
        Self::Unreadable(match trouble {
            Trouble::CutOff => "cut off within the XML".into(),
            Trouble::Bad { at, reason } => format!("byte {} of the XML: {reason}", Count(at)),
        })
    }
}

/// White space as XML has it.
#[inline(always)]
pub(super) fn is_blank(byte: u8) -> bool {
    matches!(byte, b' ' | b'\n' | b'\r' | b'\t')
}

/// Reads tokens.
pub(super) struct Tokens<'a> {
    text: &'a [u8],
    /// The byte of the next token.
    at: usize,
    open: Vec<&'a [u8]>,
    /// So many elements are open around the place where the reading began.
    around: usize,
    /// The innermost element has no content, and its end is the next token.
    ends: bool,
}

impl<'a> Tokens<'a> {
    /// From the byte `at`, within `around` open elements. There, the end of the innermost of those ends the tokens.
    pub(super) fn from(text: &'a [u8], at: usize, around: usize) -> Self {
        Self { text, at, open: Vec::new(), around, ends: false }
    }

    /// The byte of the next token.
    pub(super) fn at(&self) -> usize {
        self.at
    }

    /// Goes on at another byte, between children of the innermost open element.
    pub(super) fn go_on_at(&mut self, at: usize) {
        self.at = at;
    }

    /// The names of the open elements, the outermost first.
    pub(super) fn open(&self) -> &[&'a [u8]] {
        &self.open
    }

    /// The innermost element has no content.
    pub(super) fn is_empty(&self) -> bool {
        self.ends
    }

    /// The next token; `None` at the end of the text, or before the end of the element around.
    pub(super) fn next(&mut self) -> Result<Option<Token<'a>>, Trouble> {
        if self.ends {
            self.ends = false;
            self.open.pop();
            return Ok(Some(Token::End));
        }
        let rest = self.text.get(self.at..).unwrap_or_default();
        match *rest {
            [] if self.open.is_empty() && self.around == 0 => Ok(None),
            [] | [b'<'] => Err(Trouble::CutOff),
            [b'<', b'/', ..] if self.open.is_empty() && self.around > 0 => Ok(None),
            [b'<', b'/', ..] => self.end(rest).map(Some),
            [b'<', b'?', ..] => self.until(rest, 2, b"?>").map(|_| Some(Token::Aside)),
            [b'<', b'!', ..] => self.declaration(rest).map(Some),
            [b'<', ..] => self.start(rest).map(Some),
            _ => {
                let length = memchr(b'<', rest).unwrap_or(rest.len());
                self.at += length;
                Ok(Some(Token::Text(rest.get(..length).unwrap_or_default())))
            }
        }
    }

    /// Everything until the end of the innermost element; it may have just begun.
    pub(super) fn skip(&mut self) -> Result<(), Trouble> {
        let around = self.open.len();
        while self.open.len() >= around {
            self.next()?.ok_or(Trouble::CutOff)?;
        }
        Ok(())
    }

    /// The text directly in the innermost element, until its end: without blanks at its beginning, and no more than `most` bytes of it.
    pub(super) fn content(&mut self, most: usize) -> Result<Vec<u8>, Trouble> {
        let mut text = Vec::new();
        loop {
            let at = self.at;
            match self.next()?.ok_or(Trouble::CutOff)? {
                Token::Text(raw) => decode(raw, most, &mut text).map_err(|reason| Trouble::Bad { at, reason })?,
                Token::Data(data) => append(data, most, &mut text),
                Token::Start(_) => self.skip()?,
                Token::End => return Ok(text),
                Token::Aside => {}
            }
        }
    }

    fn bad<T>(&self, reason: &'static str) -> Result<T, Trouble> {
        Err(Trouble::Bad { at: self.at, reason })
    }

    /// Goes behind the next `end`; gives the bytes before it, without the first `begin` of `rest`.
    fn until(&mut self, rest: &'a [u8], begin: usize, end: &[u8]) -> Result<&'a [u8], Trouble> {
        let rest = rest.get(begin..).ok_or(Trouble::CutOff)?;
        let length = memmem::find(rest, end).ok_or(Trouble::CutOff)?;
        self.at += begin + length + end.len();
        Ok(rest.get(..length).unwrap_or_default())
    }

    fn declaration(&mut self, rest: &'a [u8]) -> Result<Token<'a>, Trouble> {
        let begins = |begin: &[u8]| rest.starts_with(begin);
        if begins(b"<!--") {
            self.until(rest, 4, b"-->").map(|_| Token::Aside)
        } else if begins(b"<![CDATA[") {
            self.until(rest, 9, b"]]>").map(Token::Data)
        } else if [b"<!--".as_slice(), b"<![CDATA["].iter().any(|begin| begin.starts_with(rest)) {
            Err(Trouble::CutOff)
        } else {
            self.bad("a declaration of a document type or of entities, which is not read")
        }
    }

    fn end(&mut self, rest: &'a [u8]) -> Result<Token<'a>, Trouble> {
        let near = rest.get(..LONGEST_TAG).unwrap_or(rest);
        let Some(length) = memchr(b'>', near) else {
            return if near.len() < rest.len() { self.bad("a tag of more than 1 MiB") } else { Err(Trouble::CutOff) };
        };
        let name = rest.get(2..length).unwrap_or_default().trim_ascii_end();
        if self.open.last().is_none_or(|open| *open != name) {
            return self.bad("the end of an element that is not open");
        }
        self.open.pop();
        self.at += length + 1;
        Ok(Token::End)
    }

    fn start(&mut self, rest: &'a [u8]) -> Result<Token<'a>, Trouble> {
        let body = rest.get(1..LONGEST_TAG).or(rest.get(1..)).unwrap_or_default();
        if !body.first().is_some_and(|&byte| byte.is_ascii_alphabetic() || matches!(byte, b'_' | b':' | 128..)) {
            return self.bad("a \"<\" that begins no tag");
        }
        let Some(length) = tag_length(body) else {
            return if body.len() + 1 < rest.len() { self.bad("a tag of more than 1 MiB") } else { Err(Trouble::CutOff) };
        };
        let body = body.get(..length).unwrap_or_default();
        let (body, is_empty) = body.strip_suffix(b"/").map_or((body, false), |body| (body, true));
        let (name, attributes) = body.split_at(body.iter().position(|&byte| is_blank(byte)).unwrap_or(body.len()));
        if name.iter().any(|byte| matches!(byte, b'<' | b'"' | b'\'' | b'=')) {
            return self.bad("a \"<\" that begins no tag");
        }
        if self.around + self.open.len() >= DEEPEST {
            return self.bad("elements more than 64 deep");
        }
        self.open.push(name);
        self.at += length + 2;
        self.ends = is_empty;
        Ok(Token::Start(Tag { name, attributes }))
    }
}

/// Bytes before the `>` of a tag; one in an attribute is none.
fn tag_length(body: &[u8]) -> Option<usize> {
    let mut quote = None;
    body.iter().position(|&byte| {
        match (quote, byte) {
            (None, b'"' | b'\'') => quote = Some(byte),
            (Some(open), _) if open == byte => quote = None,
            _ => {}
        }
        quote.is_none() && byte == b'>'
    })
}

impl Tag<'_> {
    /// The value of an attribute, if it is there and no more than `most` bytes long. A value that XML does not allow counts as absent.
    pub(super) fn attribute(&self, name: &[u8], most: usize) -> Option<Vec<u8>> {
        let mut rest = self.attributes.trim_ascii_start();
        loop {
            let equals = memchr(b'=', rest)?;
            let (key, behind) = rest.split_at_checked(equals)?;
            let behind = behind.get(1..)?.trim_ascii_start();
            let (&quote, value) = behind.split_first().filter(|(quote, _)| matches!(quote, b'"' | b'\''))?;
            let length = memchr(quote, value)?;
            if key.trim_ascii_end() == name {
                let mut text = Vec::new();
                decode(value.get(..length)?, most + 1, &mut text).ok()?;
                return (text.len() <= most).then_some(text);
            }
            rest = value.get(length + 1..)?.trim_ascii_start();
        }
    }
}

/// Appends text, up to `most` bytes together.
fn append(bytes: &[u8], most: usize, text: &mut Vec<u8>) {
    let bytes = if text.is_empty() { bytes.trim_ascii_start() } else { bytes };
    text.extend(bytes.iter().take(most.saturating_sub(text.len())));
}

/// Appends text with its entities and characters by number as they are meant.
fn decode(raw: &[u8], most: usize, text: &mut Vec<u8>) -> Result<(), &'static str> {
    const UNKNOWN: &str = "an entity that is none of XML's own";
    let mut rest = raw;
    while let Some(at) = memchr(b'&', rest) {
        append(rest.get(..at).unwrap_or_default(), most, text);
        let near = rest.get(at + 1..).unwrap_or_default();
        let near = near.get(..12).unwrap_or(near);
        let length = memchr(b';', near).ok_or(UNKNOWN)?;
        let name = near.get(..length).unwrap_or_default();
        let character = match name {
            b"lt" => '<',
            b"gt" => '>',
            b"amp" => '&',
            b"quot" => '"',
            b"apos" => '\'',
            [b'#', number @ ..] => by_number(number).ok_or("a character that XML does not have")?,
            _ => return Err(UNKNOWN),
        };
        append(character.encode_utf8(&mut [0; 4]).as_bytes(), most, text);
        rest = rest.get(at + length + 2..).unwrap_or_default();
    }
    append(rest, most, text);
    Ok(())
}

/// A character by its number in Unicode, decimal or with an `x` hexadecimal.
fn by_number(number: &[u8]) -> Option<char> {
    let text = std::str::from_utf8(number).ok().filter(|text| !text.starts_with('+'))?;
    let code = match text.strip_prefix('x') {
        Some(digits) if !digits.starts_with('+') => u32::from_str_radix(digits, 16),
        Some(_) => return None,
        None => text.parse(),
    };
    char::from_u32(code.ok()?).filter(|character| !matches!(character, '\0'..='\x08' | '\x0b' | '\x0c' | '\x0e'..='\x1f'))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(text: &str) -> Result<Vec<Token<'_>>, Trouble> {
        let mut tokens = Tokens::from(text.as_bytes(), 0, 0);
        std::iter::from_fn(|| tokens.next().transpose()).collect()
    }

    fn tag<'a>(name: &'a str, attributes: &'a str) -> Token<'a> {
        Token::Start(Tag { name: name.as_bytes(), attributes: attributes.as_bytes() })
    }

    #[test]
    fn all_kinds_of_tokens() {
        let found = all("<?xml v?><a b='>'><!-- <b> -->x<c /><![CDATA[<&]]></a >");
        let expected = [
            Token::Aside,
            tag("a", " b='>'"),
            Token::Aside,
            Token::Text(b"x"),
            tag("c", " "),
            Token::End,
            Token::Data(b"<&"),
            Token::End,
        ];
        assert_eq!(found.as_deref(), Ok(expected.as_slice()));
    }

    #[test]
    fn attributes_are_found_and_decoded() {
        let tokens = all("<a x = \"1\" yy='&lt;&#65;&#x42;' y=\"'\" z=5/>").unwrap();
        let Some(Token::Start(tag)) = tokens.first() else { panic!("{tokens:?}") };
        let of = |name: &str| tag.attribute(name.as_bytes(), 10).map(|value| String::from_utf8(value).unwrap());
        assert_eq!(["x", "yy", "y"].map(of), [Some("1".into()), Some("<AB".into()), Some("'".into())]);
        assert_eq!(["z", "a"].map(of), [None, None], "a value without quotes is none");
        assert_eq!(tag.attribute(b"yy", 2), None, "longer than asked for");
    }

    #[test]
    fn content_is_the_text_of_an_element_alone() {
        let mut tokens = Tokens::from(b"<a>  1<!-- 7 -->2<b>3</b><![CDATA[4]]> &amp;</a>", 0, 0);
        tokens.next().unwrap();
        assert_eq!(tokens.content(100), Ok(b"124 &".to_vec()));
        assert_eq!(tokens.next(), Ok(None));
    }

    #[test]
    fn text_that_ends_early_and_text_that_is_no_xml() {
        let whole = "<a b=\"c\"><!-- d --><![CDATA[e]]></a>";
        for length in 1..whole.len() {
            assert_eq!(all(&whole[..length]), Err(Trouble::CutOff), "{length}");
        }
        assert!(all(whole).is_ok());
        let deep = "<a>".repeat(DEEPEST + 1);
        for (text, place) in
            [("<a></b>", 3), ("</a>", 0), ("<a>< b></a>", 3), ("<!DOCTYPE a>", 0), ("<a<b></a>", 0), (deep.as_str(), 3 * DEEPEST)]
        {
            assert!(matches!(all(text), Err(Trouble::Bad { at, .. }) if at == place), "{text}: {:?}", all(text));
        }
        for entity in ["&e;", "&", "&#0;", "&#x;", "&#+65;", "&#xd800;", "&#99999999;"] {
            let text = format!("<a>{entity}</a>");
            let mut tokens = Tokens::from(text.as_bytes(), 0, 0);
            tokens.next().unwrap();
            assert!(matches!(tokens.content(9), Err(Trouble::Bad { at: 3, .. })), "{entity}");
        }
    }

    #[test]
    fn tokens_within_an_element_end_before_its_end() {
        let text = b"<a><b/></a>";
        let mut tokens = Tokens::from(text, 3, 1);
        assert!(matches!(tokens.next(), Ok(Some(Token::Start(_)))));
        assert_eq!(tokens.next(), Ok(Some(Token::End)));
        assert_eq!((tokens.next(), tokens.at()), (Ok(None), 7));
    }
}
