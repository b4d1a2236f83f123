//! Where each instance stands in the text.
//!
//! Statements end with `;` outside of strings and comments. A line that begins an instance ends whatever is not ended before it, so
//! that a lost quote or semicolon costs one instance.

use std::collections::HashMap;

use super::record::Name;
use crate::curves::finding::Findings;
use crate::util::legible::legible_bytes;

/// An instance: its text behind `#number =`, up to its semicolon.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) id: u64,
    from: usize,
    to: usize,
    pub(super) line: u64,
}

/// All instances.
#[derive(Debug)]
pub(super) struct Index<'a> {
    text: &'a [u8],
    pub(super) places: Vec<Place>,
    by_id: HashMap<u64, usize>,
    /// Whether the last words of the format are there.
    pub(super) is_complete: bool,
}

impl<'a> Index<'a> {
    /// Finds all instances. O(length); 32 bytes and a place in a table for each.
    pub(super) fn of(text: &'a [u8], findings: &mut Findings) -> Self {
        let mut index = Self { text, places: Vec::new(), by_id: HashMap::new(), is_complete: false };
        let mut scanner = Scanner { text, at: 0, line: 1, has_comments: true };
        while let Some((from, to, line, flaw)) = scanner.statement() {
            let statement = text.get(from..to).unwrap_or_default();
            if let Some((id, length)) = instance(statement) {
                if let Some(flaw) = flaw {
                    findings.add(line, flaw, format!("#{id}"));
                }
                let number = index.places.len();
                if *index.by_id.entry(id).or_insert(number) == number {
                    index.places.push(Place { id, from: from + length, to, line });
                } else {
                    findings.add(line, "a second instance of the same number; left out", format!("#{id}"));
                }
            } else if statement.eq_ignore_ascii_case(b"END-ISO-10303-21") {
                index.is_complete = true;
            } else if statement.starts_with(b"#") {
                findings.add(line, "an instance without its equals sign", legible_bytes(statement));
            }
        }
        index
    }

    /// The place of an instance.
    pub(super) fn get(&self, id: u64) -> Option<Place> {
        self.places.get(*self.by_id.get(&id)?).copied()
    }

    /// Its text.
    pub(super) fn text(&self, place: Place) -> &'a [u8] {
        self.text.get(place.from..place.to).unwrap_or_default()
    }

    /// The name of the entity of an instance; empty for complex ones.
    pub(super) fn name(&self, place: Place) -> Name<'a> {
        let text = self.text(place);
        let count = text.iter().take_while(|byte| byte.is_ascii_alphanumeric() || **byte == b'_').count();
        Name(text.get(..count).unwrap_or_default())
    }
}

/// The number of an instance, and how long the text before its entity is.
fn instance(statement: &[u8]) -> Option<(u64, usize)> {
    let rest = statement.strip_prefix(b"#")?;
    let count = rest.iter().take_while(|byte| byte.is_ascii_digit()).count();
    let id = std::str::from_utf8(rest.get(..count)?).ok()?.parse().ok()?;
    let rest = rest.get(count..)?.trim_ascii_start().strip_prefix(b"=")?.trim_ascii_start();
    Some((id, statement.len() - rest.len()))
}

/// Whether a line begins an instance. Looks at no more than 40 bytes.
fn begins_instance(line: &[u8]) -> bool {
    let line = line.get(..40).unwrap_or(line);
    instance(line.trim_ascii_start()).is_some()
}

struct Scanner<'a> {
    text: &'a [u8],
    at: usize,
    line: u64,
    /// Whether another end of a comment may follow.
    has_comments: bool,
}

impl Scanner<'_> {
    fn byte(&self) -> Option<u8> {
        self.text.get(self.at).copied()
    }

    fn rest(&self) -> &[u8] {
        self.text.get(self.at..).unwrap_or_default()
    }

    /// Skips a comment that begins here; one without an end counts as two odd characters.
    fn comment(&mut self) -> bool {
        if !self.rest().starts_with(b"/*") || !self.has_comments {
            return false;
        }
        let Some(end) = memchr::memmem::find(self.rest(), b"*/") else {
            self.has_comments = false;
            return false;
        };
        let skipped = self.rest().get(..end).unwrap_or_default();
        self.line += memchr::memchr_iter(b'\n', skipped).count() as u64;
        self.at += end + 2;
        true
    }

    /// The next statement without its semicolon: where it begins and ends, its line, and what is wrong with its end.
    fn statement(&mut self) -> Option<(usize, usize, u64, Option<&'static str>)> {
        loop {
            match self.byte()? {
                b'\n' => self.line += 1,
                byte if byte.is_ascii_whitespace() || byte == b';' => {}
                b'/' if self.comment() => continue,
                _ => break,
            }
            self.at += 1;
        }
        let (from, line) = (self.at, self.line);
        let mut in_string = false;
        while let Some(byte) = self.byte() {
            match byte {
                b'\'' => in_string = !in_string,
                b';' if !in_string => {
                    self.at += 1;
                    return Some((from, self.at - 1, line, None));
                }
                b'/' if !in_string && self.comment() => continue,
                b'\n' => {
                    self.line += 1;
                    if begins_instance(self.text.get(self.at + 1..).unwrap_or_default()) {
                        self.at += 1;
                        let flaw = if in_string { "a string without an end" } else { "an instance without its semicolon" };
                        return Some((from, self.at - 1, line, Some(flaw)));
                    }
                }
                _ => {}
            }
            self.at += 1;
        }
        Some((from, self.at, line, Some("an instance that is cut off")))
    }
}
