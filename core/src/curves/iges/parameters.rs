//! Parameters in free format: numbers, strings after Hollerith, and nothing at all between delimiters.

use crate::curves::collect::significant;

/// What separates parameters and ends records.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Delimiters {
    pub(super) parameter: u8,
    pub(super) record: u8,
}

impl Delimiters {
    /// Those that a global section begins with, and the rest of it: `1H,,1H;,` or nothing in place of either.
    pub(super) fn of(text: &[u8]) -> (Self, &[u8]) {
        let mut delimiters = Self { parameter: b',', record: b';' };
        let text = text.trim_ascii_start();
        let text = match text {
            [b'1', b'H' | b'h', own, rest @ ..] => {
                delimiters.parameter = *own;
                rest.strip_prefix(&[*own]).unwrap_or(rest)
            }
            [b',', rest @ ..] => rest,
            _ => return (delimiters, text),
        };
        let rest = match text.trim_ascii_start() {
            [b'1', b'H' | b'h', own, rest @ ..] => {
                delimiters.record = *own;
                rest
            }
            rest => rest,
        };
        let rest = rest.trim_ascii_start();
        (delimiters, rest.strip_prefix(&[delimiters.parameter]).unwrap_or(rest))
    }
}

/// Parameters of one record.
#[derive(Debug)]
pub(super) struct Parameters {
    /// Numbers by their places; not a number where there is none.
    numbers: Vec<f64>,
    /// Strings and words that are no numbers, by their places in order.
    texts: Vec<(usize, String)>,
    /// Places where nothing stands.
    empty: Vec<bool>,
    /// Whether the record has an end.
    pub(super) is_complete: bool,
    /// Bytes of the record.
    pub(super) length: usize,
    /// Significant digits, the most of any number.
    pub(super) digits: u32,
}

/// Longest string that is kept.
const LONGEST_TEXT: usize = 1 << 10;

impl Parameters {
    /// Reads up to the end of the record. O(length).
    pub(super) fn of(text: &[u8], delimiters: Delimiters) -> Self {
        let (numbers, texts, empty) = Default::default();
        let mut all = Self { numbers, texts, empty, is_complete: false, length: 0, digits: 0 };
        let mut at = 0;
        loop {
            let rest = text.get(at..).unwrap_or_default();
            let blanks = rest.len() - rest.trim_ascii_start().len();
            let rest = rest.get(blanks..).unwrap_or_default();
            at += blanks;
            if let Some((text, length)) = hollerith(rest) {
                at += length;
                all.push_text(text);
                // Whatever is between a string and the next delimiter means nothing.
                at += text_end(rest.get(length..).unwrap_or_default(), delimiters);
            } else {
                let length = text_end(rest, delimiters);
                all.push_word(rest.get(..length).unwrap_or_default().trim_ascii());
                at += length;
            }
            match text.get(at) {
                None => break,
                Some(byte) if *byte == delimiters.record => {
                    all.is_complete = true;
                    at += 1;
                    break;
                }
                Some(_) => at += 1,
            }
        }
        all.length = at;
        all
    }

    fn push_text(&mut self, text: &[u8]) {
        let kept = text.get(..LONGEST_TEXT).unwrap_or(text);
        self.texts.push((self.numbers.len(), String::from_utf8_lossy(kept).into_owned()));
        self.numbers.push(f64::NAN);
        self.empty.push(false);
    }

    fn push_word(&mut self, word: &[u8]) {
        if word.is_empty() {
            self.numbers.push(f64::NAN);
            self.empty.push(true);
        } else if let Some(number) = number(word) {
            self.digits = self.digits.max(significant(word));
            self.numbers.push(number);
            self.empty.push(false);
        } else {
            self.push_text(word);
        }
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.numbers.len()
    }

    /// The number at a place, from 0; 0 where nothing stands.
    pub(super) fn real(&self, at: usize) -> Result<f64, String> {
        match (self.numbers.get(at), self.empty.get(at)) {
            (Some(_), Some(true)) => Ok(0.0),
            (Some(number), _) if number.is_finite() => Ok(*number),
            (Some(_), _) => Err(format!("parameter {at} is no number")),
            _ => Err(format!("parameter {at} of {} is missing", self.len().saturating_sub(1))),
        }
    }

    /// So many numbers from a place on.
    pub(super) fn reals(&self, at: usize, count: usize) -> Result<Vec<f64>, String> {
        let end = at.checked_add(count).filter(|end| *end <= self.len());
        let end = end.ok_or_else(|| format!("{count} parameters from {at} on are announced, there are {}", self.len()))?;
        (at..end).map(|at| self.real(at)).collect()
    }

    /// Three numbers from a place on.
    pub(super) fn point(&self, at: usize) -> Result<[f64; 3], String> {
        Ok([self.real(at)?, self.real(at + 1)?, self.real(at + 2)?])
    }

    /// A whole number.
    pub(super) fn integer(&self, at: usize) -> Result<i64, String> {
        let number = self.real(at)?;
        // Above 2⁵³ floats have no fractions, and a cast saturates.
        if number.fract() == 0.0 { Ok(number as i64) } else { Err(format!("parameter {at} is not whole")) }
    }

    /// The number of a directory entry; 0 if there is none.
    pub(super) fn pointer(&self, at: usize) -> Result<u32, String> {
        let number = self.integer(at)?;
        u32::try_from(number).map_err(|_| format!("parameter {at} is no directory entry: {number}"))
    }

    /// A count of things of so many parameters each, which begin at `from`: it is checked that so many are there.
    pub(super) fn count(&self, at: usize, from: usize, each: usize) -> Result<usize, String> {
        let count = usize::try_from(self.integer(at)?).map_err(|_| format!("parameter {at} is no count"))?;
        let room = self.len().saturating_sub(from) / each.max(1);
        if count <= room { Ok(count) } else { Err(format!("{count} are announced, {room} are there")) }
    }

    /// The string at a place.
    pub(super) fn text(&self, at: usize) -> Option<&str> {
        let place = self.texts.binary_search_by_key(&at, |(place, _)| *place).ok()?;
        self.texts.get(place).map(|(_, text)| text.as_str())
    }
}

/// Bytes before the next delimiter.
fn text_end(text: &[u8], delimiters: Delimiters) -> usize {
    memchr::memchr2(delimiters.parameter, delimiters.record, text).unwrap_or(text.len())
}

/// A string of so many bytes as stand before the `H`, and the bytes that it takes; cut where the text ends.
fn hollerith(text: &[u8]) -> Option<(&[u8], usize)> {
    let count = text.iter().take(10).take_while(|byte| byte.is_ascii_digit()).count();
    let length: usize = std::str::from_utf8(text.get(..count)?).ok()?.parse().ok()?;
    text.get(count).filter(|byte| byte.eq_ignore_ascii_case(&b'H'))?;
    let rest = text.get(count + 1..)?;
    let string = rest.get(..length).unwrap_or(rest);
    Some((string, count + 1 + string.len()))
}

/// A number of Fortran's kinds: `1`, `-1.5`, `.5E3`, `1.D-4`, `1.5+3` (an exponent without its letter).
pub(super) fn number(word: &[u8]) -> Option<f64> {
    // Longest that any writer gives; more are no number of this format.
    let mut text = [0_u8; 64];
    let (text, mut length) = (text.get_mut(..word.len() + 1)?, 0);
    for (at, &byte) in word.iter().enumerate() {
        let before = at.checked_sub(1).and_then(|at| word.get(at));
        let byte = match byte {
            b'0'..=b'9' | b'.' | b'+' | b'-' => byte,
            b'e' | b'E' | b'd' | b'D' => b'e',
            _ => return None,
        };
        let is_bare = matches!(byte, b'+' | b'-') && before.is_some_and(|byte| byte.is_ascii_digit() || *byte == b'.');
        for byte in is_bare.then_some(b'e').into_iter().chain([byte]) {
            *text.get_mut(length)? = byte;
            length += 1;
        }
    }
    std::str::from_utf8(text.get(..length)?).ok()?.parse().ok()
}
