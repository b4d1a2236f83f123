//! Words of a text of lines. A backslash before a line's end joins the line with the next one; comments are not joined.

use super::super::number::{self, Number, is_blank};

/// A place in a text.
#[derive(Clone, Copy, Debug)]
pub(in crate::io) struct Cursor<'a> {
    text: &'a [u8],
    pub(in crate::io) at: usize,
}

#[inline(always)]
fn is_line_end(byte: u8) -> bool {
    byte == b'\n' || byte == b'\r'
}

/// Bytes of the line end that stands here: LF, CR or CR LF; 0 for none.
#[inline]
fn line_end(text: &[u8], at: usize) -> usize {
    match text.get(at) {
        Some(b'\n') => 1,
        Some(b'\r') => 1 + usize::from(text.get(at + 1) == Some(&b'\n')),
        _ => 0,
    }
}

/// The first place behind `from`, and not beyond `until`, where a line begins that is not joined with the one before.
pub(in crate::io) fn next_line(text: &[u8], from: usize, until: usize) -> Option<usize> {
    let mut at = from;
    loop {
        at += text.get(at..until.min(text.len()))?.iter().position(|&byte| is_line_end(byte))?;
        let is_joined = at.checked_sub(1).and_then(|before| text.get(before)) == Some(&b'\\');
        at += line_end(text, at);
        if !is_joined {
            return Some(at);
        }
    }
}

impl<'a> Cursor<'a> {
    /// At the beginning of a text.
    pub(in crate::io) fn of(text: &'a [u8]) -> Self {
        Self { text, at: 0 }
    }

    /// Goes to the keyword of the next line that is neither empty nor a comment, and behind it.
    #[inline]
    pub(in crate::io) fn keyword(&mut self) -> Option<&'a [u8]> {
        loop {
            let rest = self.text.get(self.at..)?;
            self.at += rest.iter().position(|&byte| !is_blank(byte))?;
            match self.text.get(self.at) {
                Some(b'#') => {
                    let rest = self.text.get(self.at..)?;
                    self.at += rest.iter().position(|&byte| is_line_end(byte)).unwrap_or(rest.len());
                }
                Some(b'\\') if line_end(self.text, self.at + 1) > 0 => self.at += 1,
                _ => return Some(self.rest_of_word()),
            }
        }
    }

    /// From here up to a blank or the text's end; goes behind it. A backslash that joins lines is no part of it.
    #[inline]
    fn rest_of_word(&mut self) -> &'a [u8] {
        let rest = self.text.get(self.at..).unwrap_or_default();
        let length = rest.iter().position(|&byte| is_blank(byte)).unwrap_or(rest.len());
        let word = rest.get(..length).unwrap_or_default();
        let word = word.strip_suffix(b"\\").filter(|_| line_end(rest, length) > 0).unwrap_or(word);
        self.at += word.len();
        word
    }

    /// Goes to the next word of this line; `false` at its end.
    #[inline]
    pub(in crate::io) fn is_at_word(&mut self) -> bool {
        loop {
            match self.text.get(self.at) {
                None | Some(b'\n' | b'\r' | b'#') => return false,
                Some(b'\\') => match line_end(self.text, self.at + 1) {
                    0 => return true,
                    end => self.at += 1 + end,
                },
                Some(&byte) if is_blank(byte) => self.at += 1,
                Some(_) => return true,
            }
        }
    }

    /// The next word of this line, which it goes behind.
    pub(in crate::io) fn word(&mut self) -> Option<&'a [u8]> {
        self.is_at_word().then(|| self.rest_of_word())
    }

    /// The next word of this line as a number, which it goes behind; `Some(None)` for a word that is none.
    #[inline]
    pub(in crate::io::read) fn number(&mut self) -> Option<Option<(Number, &'a [u8])>> {
        if !self.is_at_word() {
            return None;
        }
        let rest = self.text.get(self.at..).unwrap_or_default();
        if let Some(number) = number::number(rest) {
            self.at += number.length;
            return Some(Some((number, rest)));
        }
        let word = self.rest_of_word();
        Some(number::number(word).map(|number| (number, word)))
    }

    /// The next word of this line as the index of a vertex, which may have others behind slashes; `Some(None)` for a word that is none.
    #[inline]
    pub(in crate::io) fn index(&mut self) -> Option<Option<i64>> {
        if !self.is_at_word() {
            return None;
        }
        let begin = self.at;
        let negative = self.text.get(begin) == Some(&b'-');
        let from = begin + usize::from(negative || self.text.get(begin) == Some(&b'+'));
        let mut at = from;
        let mut index = 0i64;
        while let Some(digit) = self.text.get(at).map(|byte| byte.wrapping_sub(b'0')).filter(|digit| *digit < 10) {
            index = index.saturating_mul(10).saturating_add(digit.into());
            at += 1;
        }
        let is_index = at > from && self.text.get(at).is_none_or(|&byte| byte == b'/' || byte == b'\\' || is_blank(byte));
        self.at = at;
        if self.text.get(at).is_some_and(|&byte| !is_blank(byte)) {
            self.rest_of_word();
        }
        Some(is_index.then_some(if negative { -index } else { index }))
    }

    /// The rest of this line as a name.
    pub(in crate::io) fn name(&mut self) -> &'a [u8] {
        let rest = self.text.get(self.at..).unwrap_or_default();
        let length = rest.iter().position(|&byte| is_line_end(byte)).unwrap_or(rest.len());
        let name = rest.get(..length).unwrap_or_default();
        let name = name.strip_suffix(b"\\").filter(|_| length < rest.len()).unwrap_or(name);
        self.at += name.len();
        name.trim_ascii()
    }

    /// Goes to the end of this line, and of those that are joined with it.
    #[inline]
    pub(in crate::io) fn skip_line(&mut self) {
        loop {
            let rest = self.text.get(self.at..).unwrap_or_default();
            let length = rest.iter().position(|&byte| is_line_end(byte)).unwrap_or(rest.len());
            let is_joined = length > 0 && rest.get(length - 1) == Some(&b'\\');
            self.at += length + if is_joined { line_end(rest, length) } else { 0 };
            if !is_joined || length == rest.len() {
                return;
            }
        }
    }

    /// Goes behind the end of the line that ends here.
    pub(in crate::io) fn end(&mut self) {
        self.skip_line();
        self.at += line_end(self.text, self.at);
    }

    /// The text ends here, and within a line.
    pub(in crate::io) fn is_at_end(&self) -> bool {
        self.at >= self.text.len()
    }

    /// The text from `begin` up to here.
    pub(in crate::io) fn since(&self, begin: usize) -> &'a [u8] {
        self.text.get(begin..self.at).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_end_with_their_line() {
        let mut cursor = Cursor::of(b"\r\n\n # a comment\\\n\tf 1/2 -3//4 \\\r\n 5\\\n+6 x # no word\nv 1.5 y");
        assert_eq!(cursor.keyword(), Some(b"f".as_slice()));
        let indices: Vec<_> = std::iter::from_fn(|| cursor.index()).collect();
        assert_eq!(indices, [Some(1), Some(-3), Some(5), Some(6), None]);
        assert!(!cursor.is_at_end());
        cursor.skip_line();
        assert_eq!(cursor.keyword(), Some(b"v".as_slice()));
        let numbers: Vec<_> =
            std::iter::from_fn(|| cursor.number()).map(|number| number.map(|(number, _)| number.value)).collect();
        assert_eq!(numbers, [Some(1.5), None]);
        assert!(cursor.is_at_end() && !cursor.is_at_word() && cursor.keyword().is_none());
    }

    #[test]
    fn an_index_beyond_all_numbers_is_a_great_one() {
        let mut cursor = Cursor::of(b"99999999999999999999999 -99999999999999999999999 - 1e5 \\x");
        assert_eq!(
            [(); 5].map(|()| cursor.index()),
            [Some(Some(i64::MAX)), Some(Some(-i64::MAX)), Some(None), Some(None), Some(None)]
        );
        assert_eq!(cursor.index(), None);
    }

    #[test]
    fn joined_lines_are_not_parted() {
        let text = b"f 1 2 \\\n3\rv 1\r\nend";
        assert_eq!(next_line(text, 0, text.len()), Some(10));
        assert_eq!(next_line(text, 10, text.len()), Some(15));
        assert_eq!(next_line(text, 15, text.len()), None);
        assert_eq!(next_line(text, 0, 8), None, "nothing within the limit");
    }
}
