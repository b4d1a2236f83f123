//! The text of instances.

use std::fmt::Write as _;
use std::io::{self, Write};

use crate::curves::export::number;

/// Columns behind which a list goes on in a new line.
const WIDTH: usize = 110;

/// Writes instances one after the other and numbers them from 1.
pub(super) struct Instances<'a, W> {
    sink: &'a mut W,
    text: String,
    last: u64,
}

impl<'a, W: Write> Instances<'a, W> {
    pub(super) fn new(sink: &'a mut W) -> Self {
        Self { sink, text: String::new(), last: 0 }
    }

    /// Writes an instance; gives its number.
    pub(super) fn put(&mut self, fill: impl FnOnce(&mut Record)) -> io::Result<u64> {
        self.last += 1;
        self.text.clear();
        let _ = write!(self.text, "#{}=", self.last);
        let mut record = Record { text: std::mem::take(&mut self.text), line: 0 };
        fill(&mut record);
        self.text = record.text;
        writeln!(self.sink, "{};", self.text)?;
        Ok(self.last)
    }

    /// Writes an instance of words alone.
    pub(super) fn say(&mut self, words: &str) -> io::Result<u64> {
        self.put(|record| record.say(words))
    }
}

/// The text of an instance on its way.
pub(super) struct Record {
    text: String,
    /// Where its last line begins.
    line: usize,
}

impl Record {
    /// Appends words as they are.
    pub(super) fn say(&mut self, words: &str) {
        self.text.push_str(words);
    }

    /// Appends a reference.
    pub(super) fn reference(&mut self, id: u64) {
        // Writing to a string never fails.
        let _ = write!(self.text, "#{id}");
    }

    /// Appends a whole number.
    pub(super) fn integer(&mut self, value: usize) {
        let _ = write!(self.text, "{value}");
    }

    /// Appends a real number.
    pub(super) fn real(&mut self, value: f64) {
        number::real(&mut self.text, value, 'E');
    }

    /// Appends a truth.
    pub(super) fn truth(&mut self, is_true: bool) {
        self.say(if is_true { ".T." } else { ".F." });
    }

    /// Appends a list in brackets.
    pub(super) fn list<T>(&mut self, items: impl IntoIterator<Item = T>, mut each: impl FnMut(&mut Self, T)) {
        self.say("(");
        for (number, item) in items.into_iter().enumerate() {
            if number > 0 {
                self.say(",");
                if self.text.len() - self.line > WIDTH {
                    self.say("\n");
                    self.line = self.text.len();
                }
            }
            each(self, item);
        }
        self.say(")");
    }

    /// Appends a list of references.
    pub(super) fn references(&mut self, ids: &[u64]) {
        self.list(ids, |record, id| record.reference(*id));
    }
}

/// A string in quotes (ISO 10303-21, section 6.4.3): quotes and backslashes doubled, what is not ASCII by its number.
pub(super) fn quoted(words: &str) -> String {
    let mut text = String::from("'");
    for character in words.chars() {
        match character {
            '\'' => text.push_str("''"),
            '\\' => text.push_str("\\\\"),
            ' '..='~' => text.push(character),
            '\u{80}'..='\u{ffff}' => {
                let _ = write!(text, "\\X2\\{:04X}\\X0\\", u32::from(character));
            }
            '\u{10000}'.. => {
                let _ = write!(text, "\\X4\\{:08X}\\X0\\", u32::from(character));
            }
            // Characters that steer something are no part of a name.
            _ => {}
        }
    }
    text.push('\'');
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strings_are_escaped() {
        assert_eq!(quoted("it's ä \\ 😀\n"), "'it''s \\X2\\00E4\\X0\\ \\\\ \\X4\\0001F600\\X0\\'");
    }

    #[test]
    fn long_lists_have_lines() {
        let mut sink = Vec::new();
        let mut instances = Instances::new(&mut sink);
        let ids: Vec<u64> = (100_000..100_030).collect();
        assert_eq!(instances.put(|record| record.references(&ids)).unwrap(), 1);
        let text = String::from_utf8(sink).unwrap();
        assert!(text.lines().count() == 3 && text.lines().all(|line| line.len() < 130));
    }
}
