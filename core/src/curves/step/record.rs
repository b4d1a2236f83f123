//! Values and records of instances.

use std::fmt::{self, Display};

/// A name of an entity or a type, in any case of letters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Name<'a>(pub(super) &'a [u8]);

impl Name<'_> {
    pub(super) fn is(&self, name: &str) -> bool {
        self.0.eq_ignore_ascii_case(name.as_bytes())
    }
}

impl Display for Name<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&String::from_utf8_lossy(self.0).to_ascii_uppercase())
    }
}

/// A value.
#[derive(Clone, Debug)]
pub(super) enum Value<'a> {
    /// `$`, `*`, and binaries, which no curve has.
    Nothing,
    Number(f64),
    /// As it stands in the file, between quotes.
    Text(&'a [u8]),
    /// `.WORD.`
    Word(&'a [u8]),
    Reference(u64),
    List(Vec<Value<'a>>),
    /// A value that has a type, without it.
    Typed(Vec<Value<'a>>),
}

/// A name and its values.
#[derive(Clone, Debug)]
pub(super) struct Record<'a> {
    pub(super) name: Name<'a>,
    pub(super) values: Vec<Value<'a>>,
}

/// Lists within each other, at most.
const DEEPEST: usize = 32;

impl<'a> Value<'a> {
    pub(super) fn reference(&self) -> Option<u64> {
        if let Self::Reference(id) = self { Some(*id) } else { None }
    }

    pub(super) fn list(&self) -> Option<&[Self]> {
        if let Self::List(list) = self { Some(list) } else { None }
    }

    /// A number, with or without a type.
    pub(super) fn number(&self) -> Option<f64> {
        match self {
            Self::Number(number) => Some(*number),
            Self::Typed(values) => {
                values.first().and_then(|value| if let Self::Number(number) = value { Some(*number) } else { None })
            }
            _ => None,
        }
    }

    pub(super) fn word(&self) -> Option<Name<'a>> {
        if let Self::Word(word) = self { Some(Name(word)) } else { None }
    }
}

impl<'a> Record<'a> {
    fn value(&self, at: usize) -> Result<&Value<'a>, String> {
        self.values.get(at).ok_or_else(|| format!("{} has {} values, {} are needed", self.name, self.values.len(), at + 1))
    }

    pub(super) fn reference(&self, at: usize) -> Result<u64, String> {
        self.value(at)?.reference().ok_or_else(|| format!("value {at} of {} is no reference", self.name))
    }

    pub(super) fn number(&self, at: usize) -> Result<f64, String> {
        let number = self.value(at)?.number().filter(|number| number.is_finite());
        number.ok_or_else(|| format!("value {at} of {} is no number", self.name))
    }

    pub(super) fn list(&self, at: usize) -> Result<&[Value<'a>], String> {
        self.value(at)?.list().ok_or_else(|| format!("value {at} of {} is no list", self.name))
    }

    pub(super) fn references(&self, at: usize) -> Result<Vec<u64>, String> {
        let ids = self.list(at)?.iter().map(Value::reference).collect::<Option<Vec<_>>>();
        ids.ok_or_else(|| format!("value {at} of {} is no list of references", self.name))
    }

    pub(super) fn numbers(&self, at: usize) -> Result<Vec<f64>, String> {
        let numbers = self.list(at)?.iter().map(Value::number).collect::<Option<Vec<_>>>();
        numbers.ok_or_else(|| format!("value {at} of {} is no list of numbers", self.name))
    }

    /// `.T.`, or anything but `.F.`.
    pub(super) fn truth(&self, at: usize) -> Result<bool, String> {
        self.value(at).map(|value| value.word().is_none_or(|word| !word.is("F")))
    }

    pub(super) fn text(&self, at: usize) -> Option<&'a [u8]> {
        if let Some(Value::Text(text)) = self.values.get(at) { Some(text) } else { None }
    }
}

/// Reads the records of an instance: one, or several of a complex one.
///
/// # Errors
/// What is wrong with the text.
pub(super) fn records(text: &[u8]) -> Result<Vec<Record<'_>>, String> {
    let mut parser = Parser { text, at: 0 };
    parser.skip();
    let mut records = Vec::new();
    if parser.eat(b'(') {
        while !parser.eat(b')') {
            records.push(parser.record()?);
        }
    } else {
        records.push(parser.record()?);
    }
    if parser.at < text.len() {
        return Err("there is more behind its end".into());
    }
    Ok(records)
}

struct Parser<'a> {
    text: &'a [u8],
    at: usize,
}

impl<'a> Parser<'a> {
    fn rest(&self) -> &'a [u8] {
        self.text.get(self.at..).unwrap_or_default()
    }

    /// Skips blanks and comments.
    fn skip(&mut self) {
        loop {
            let rest = self.rest();
            let blanks = rest.len() - rest.trim_ascii_start().len();
            self.at += blanks;
            if !self.rest().starts_with(b"/*") {
                return;
            }
            self.at += memchr::memmem::find(self.rest(), b"*/").map_or(self.rest().len(), |end| end + 2);
        }
    }

    /// Takes a byte and what can be skipped behind it.
    fn eat(&mut self, byte: u8) -> bool {
        let is_there = self.rest().first() == Some(&byte);
        if is_there {
            self.at += 1;
            self.skip();
        }
        is_there
    }

    fn take(&mut self, is_part: impl Fn(u8) -> bool) -> &'a [u8] {
        let rest = self.rest();
        let count = rest.iter().take_while(|byte| is_part(**byte)).count();
        self.at += count;
        rest.get(..count).unwrap_or_default()
    }

    fn record(&mut self) -> Result<Record<'a>, String> {
        let name = self.take(|byte| byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'!' | b'-'));
        self.skip();
        if name.is_empty() || !self.eat(b'(') {
            return Err("a name with values is expected".into());
        }
        Ok(Record { name: Name(name), values: self.values(0)? })
    }

    /// Values up to the closing bracket.
    fn values(&mut self, depth: usize) -> Result<Vec<Value<'a>>, String> {
        if depth > DEEPEST {
            return Err("lists are more than 32 within each other".into());
        }
        let mut values = Vec::new();
        if self.eat(b')') {
            return Ok(values);
        }
        loop {
            values.push(self.value(depth)?);
            self.skip();
            if self.eat(b')') {
                return Ok(values);
            }
            if !self.eat(b',') {
                return Err("a comma or a bracket is missing".into());
            }
        }
    }

    fn value(&mut self, depth: usize) -> Result<Value<'a>, String> {
        match self.rest().first() {
            Some(b'$' | b'*') => {
                self.at += 1;
                Ok(Value::Nothing)
            }
            Some(b'#' | b'@') => {
                self.at += 1;
                let digits = self.take(|byte| byte.is_ascii_digit());
                let id = std::str::from_utf8(digits).ok().and_then(|digits| digits.parse().ok());
                id.map(Value::Reference).ok_or_else(|| "a reference without a number".into())
            }
            Some(b'\'') => self.string(),
            Some(b'"') => {
                self.at += 1;
                self.take(|byte| byte != b'"');
                if self.eat(b'"') { Ok(Value::Nothing) } else { Err("a binary without an end".into()) }
            }
            Some(b'.') if self.rest().get(1).is_some_and(|byte| byte.is_ascii_alphabetic()) => {
                self.at += 1;
                let word = self.take(|byte| byte.is_ascii_alphanumeric() || byte == b'_');
                if self.eat(b'.') { Ok(Value::Word(word)) } else { Err("a word without its second dot".into()) }
            }
            Some(b'(') => {
                self.eat(b'(');
                self.values(depth + 1).map(Value::List)
            }
            Some(byte) if byte.is_ascii_alphabetic() || *byte == b'!' => {
                self.take(|byte| byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'!'));
                self.skip();
                if !self.eat(b'(') {
                    return Err("a type without its value".into());
                }
                self.values(depth + 1).map(Value::Typed)
            }
            _ => {
                let word = self.take(|byte| byte.is_ascii_digit() || matches!(byte, b'+' | b'-' | b'.' | b'e' | b'E'));
                let number = std::str::from_utf8(word).ok().and_then(|word| word.parse().ok());
                number.map(Value::Number).ok_or_else(|| "no value where one is expected".into())
            }
        }
    }

    /// A string; two quotes within it are one.
    fn string(&mut self) -> Result<Value<'a>, String> {
        self.at += 1;
        let from = self.at;
        loop {
            let end = memchr::memchr(b'\'', self.rest()).ok_or("a string without an end")?;
            self.at += end + 1;
            if self.rest().first() != Some(&b'\'') {
                return Ok(Value::Text(self.text.get(from..self.at - 1).unwrap_or_default()));
            }
            self.at += 1;
        }
    }
}
