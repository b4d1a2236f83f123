//! Statements: a major word, a slash, and numbers and minor words between commas.

/// A field between commas.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Field {
    Number(f64),
    /// In capitals.
    Word(String),
}

/// A statement.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Statement {
    /// Before the slash, in capitals, without spaces.
    pub(super) word: String,
    pub(super) fields: Vec<Field>,
    /// Behind the slash, as it is.
    pub(super) rest: String,
}

/// Bytes of a statement over all its lines, at most.
const LONGEST: usize = 100_000;

impl Statement {
    /// Reads one; empty if there is none. O(length).
    pub(super) fn of(text: &str) -> Self {
        let (word, rest) = text.split_once('/').unwrap_or((text, ""));
        // A label before a closing bracket, as loops have.
        let word = word.rsplit(')').next().unwrap_or(word);
        let word: String =
            word.chars().filter(|letter| !letter.is_whitespace()).map(|letter| letter.to_ascii_uppercase()).collect();
        let fields = if rest.trim().is_empty() { Vec::new() } else { rest.split(',').map(field).collect() };
        Self { word, fields, rest: rest.trim().to_owned() }
    }

    /// All numbers in their order.
    pub(super) fn numbers(&self) -> Vec<f64> {
        self.fields.iter().filter_map(|field| if let Field::Number(number) = field { Some(*number) } else { None }).collect()
    }

    /// Whether a minor word is there.
    pub(super) fn has(&self, word: &str) -> bool {
        self.fields.iter().any(|field| matches!(field, Field::Word(own) if own == word))
    }

    /// The number behind one of these minor words.
    pub(super) fn behind(&self, words: &[&str]) -> Option<f64> {
        let at = self.fields.iter().position(|field| matches!(field, Field::Word(own) if words.contains(&own.as_str())))?;
        match self.fields.get(at + 1) {
            Some(Field::Number(number)) => Some(*number),
            _ => None,
        }
    }
}

fn field(text: &str) -> Field {
    let text = text.trim();
    match number(text) {
        Some(number) => Field::Number(number),
        None => Field::Word(text.to_ascii_uppercase()),
    }
}

/// A number, also with Fortran's `D` for the exponent.
pub(super) fn number(text: &str) -> Option<f64> {
    let first = text.bytes().next()?;
    if !first.is_ascii_digit() && !matches!(first, b'.' | b'-' | b'+') {
        return None;
    }
    let text = text.strip_prefix('+').unwrap_or(text);
    text.parse().ok().or_else(|| text.replace(['D', 'd'], "e").parse().ok()).filter(|number: &f64| number.is_finite())
}

/// The numbers of a line that is a plain `GOTO`: three, or six with the tool's axis. The way of all but a few lines of a file.
pub(super) fn plain_goto(line: &[u8]) -> Option<([f64; 6], usize)> {
    let (word, rest) = line.split_at_checked(4)?;
    let rest = rest.trim_ascii_start().strip_prefix(b"/")?;
    if !word.eq_ignore_ascii_case(b"GOTO") {
        return None;
    }
    let (mut numbers, mut count) = ([0.0; 6], 0);
    for text in std::str::from_utf8(rest).ok()?.split(',') {
        *numbers.get_mut(count)? = number(text.trim())?;
        count += 1;
    }
    matches!(count, 3 | 6).then_some((numbers, count))
}

/// A line without its comment: what is to be read, what a `$$->` comment says, and whether the statement goes on.
pub(super) fn split(line: &str) -> (&str, Option<&str>, bool) {
    let line = line.trim();
    if let Some(at) = line.find("$$") {
        let comment = line.get(at + 2..).unwrap_or_default();
        let said = comment.strip_prefix("->").map(str::trim);
        let before = line.get(..at).unwrap_or_default().trim_end();
        return match before.strip_suffix('$') {
            Some(before) => (before, said, true),
            None => (before, said, false),
        };
    }
    match line.split_once('$') {
        Some((before, _)) => (before, None, true),
        None => (line, None, false),
    }
}

/// Joins lines to statements.
#[derive(Debug, Default)]
pub(super) struct Joiner {
    text: String,
    line: u64,
}

impl Joiner {
    /// Whether no statement has begun.
    pub(super) fn is_empty(&self) -> bool {
        self.text.is_empty()
    }

    /// Takes a part of a statement; gives the statement and the line where it began, once it is whole.
    pub(super) fn add(&mut self, part: &str, goes_on: bool, line: u64) -> Option<(Statement, u64)> {
        if self.text.is_empty() {
            self.line = line;
        }
        self.text.push_str(part);
        if goes_on && self.text.len() < LONGEST {
            self.text.push(' ');
            return None;
        }
        let text = std::mem::take(&mut self.text);
        (!text.trim().is_empty()).then(|| (Statement::of(&text), self.line))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statements_are_joined_and_split() {
        let mut joiner = Joiner::default();
        let (part, _, goes_on) = split("CIRCLE / 1.0, 2, $ 5");
        assert_eq!(joiner.add(part, goes_on, 7), None);
        let (part, said, goes_on) = split("  -3.D1, ON $$ a comment");
        assert_eq!(said, None);
        let (statement, line) = joiner.add(part, goes_on, 8).expect("whole");
        assert_eq!((statement.word.as_str(), statement.numbers(), line), ("CIRCLE", vec![1.0, 2.0, -30.0], 7));
        assert!(statement.has("ON"));
        assert_eq!(split("$$-> CUTTER / 10.0"), ("", Some("CUTTER / 10.0"), false));
    }
}
