//! Numbers in text, as tokens between blanks: within a line, or across line ends.

use super::cursor::{Cursor, Notes};
use super::layout::Scalar;
use crate::io::read::number::{is_blank, number};

/// Ends a line: LF, CR LF or CR alone. (Between CR and LF there is an empty line, which counts for nothing.)
#[inline(always)]
pub(super) fn ends_line(byte: u8) -> bool {
    byte == b'\n' || byte == b'\r'
}

/// A place in a text.
#[derive(Clone, Debug)]
pub(in crate::io) struct Line<'a> {
    pub(in crate::io) text: &'a [u8],
    pub(in crate::io) at: usize,
    /// Tokens end with the line.
    pub(in crate::io) within: bool,
    /// `#` begins a comment, which ends with the line.
    pub(in crate::io) comments: bool,
}

impl<'a> Line<'a> {
    /// The text from the next token on, if there is one: in this line, or at all.
    #[inline]
    pub(in crate::io) fn token(&mut self) -> Option<&'a [u8]> {
        loop {
            let rest = self.text.get(self.at..)?;
            match *rest.first()? {
                byte if ends_line(byte) && self.within => return None,
                b'#' if self.comments => self.skip_line(),
                byte if is_blank(byte) => self.at += 1,
                _ => return Some(rest),
            }
        }
    }

    /// Goes to the end of the line.
    #[inline]
    pub(in crate::io) fn skip_line(&mut self) {
        let rest = self.text.get(self.at..).unwrap_or_default();
        self.at += rest.iter().position(|byte| ends_line(*byte)).unwrap_or(rest.len());
    }

    /// Goes behind the end of the line, unless a token stands before it.
    pub(in crate::io) fn end(&mut self) {
        let (before, within) = (self.at, std::mem::replace(&mut self.within, true));
        if self.token().is_some() {
            self.at = before;
        } else {
            let rest = self.text.get(self.at..).unwrap_or_default();
            self.at += if rest.starts_with(b"\r\n") { 2 } else { rest.len().min(1) };
        }
        self.within = within;
    }

    /// Goes to the first token of the next line that has one, or to the end.
    #[inline]
    pub(super) fn next_line(&mut self) {
        let within = std::mem::replace(&mut self.within, false);
        self.token();
        self.within = within;
    }

    /// Passes over a token that begins here.
    #[inline]
    fn skip_token(&mut self) {
        while self.text.get(self.at).is_some_and(|byte| !is_blank(*byte)) {
            self.at += 1;
        }
    }

    /// A whole number.
    #[inline]
    pub(in crate::io) fn whole(&mut self) -> Option<i64> {
        let rest = self.token()?;
        let (mut value, mut digits) = (0_i64, 0);
        for byte in rest.iter().take(18) {
            let digit = byte.wrapping_sub(b'0');
            if digit > 9 {
                break;
            }
            value = value * 10 + i64::from(digit);
            digits += 1;
        }
        if digits > 0 && rest.get(digits).is_none_or(|byte| is_blank(*byte)) {
            self.at += digits;
            return Some(value);
        }
        self.unusual(rest)
    }

    /// A whole number with a sign, a point or an exponent; [`i64::MIN`] for a token that is none.
    #[cold]
    fn unusual(&mut self, rest: &[u8]) -> Option<i64> {
        let read = number(rest);
        self.skip_token();
        let whole = read.filter(|read| read.wide.fract() == 0.0 && read.wide.abs() < 1e15);
        Some(whole.map_or(i64::MIN, |read| read.wide as i64))
    }
}

impl Cursor for Line<'_> {
    #[inline]
    fn skip(&mut self, values: usize, _: usize) -> Option<()> {
        for _ in 0..values {
            self.token()?;
            self.skip_token();
        }
        Some(())
    }

    #[inline]
    fn coordinate(&mut self, _: Scalar, notes: &mut Notes) -> Option<f32> {
        let rest = self.token()?;
        let Some(read) = number(rest) else {
            self.skip_token();
            notes.damaged += 1;
            return Some(f32::NAN);
        };
        self.at += read.length;
        notes.rounding.of_decimal(rest, read.length, read.wide, read.value);
        Some(read.value)
    }

    #[inline]
    fn length(&mut self, _: Scalar, _: Scalar) -> Option<usize> {
        let length = usize::try_from(self.whole()?).ok()?;
        // Each item takes a blank and a digit.
        (length <= (self.text.len() - self.at) / 2).then_some(length)
    }

    #[inline]
    fn index(&mut self, _: Scalar) -> Option<i64> {
        self.whole()
    }
}

/// So many lines of `text` have a token. `text` begins and ends where lines do.
pub(super) fn count(text: &[u8], comments: bool) -> usize {
    let (mut lines, mut open, mut comment) = (0, false, false);
    for byte in text {
        if ends_line(*byte) {
            lines += usize::from(open);
            (open, comment) = (false, false);
        } else if comments {
            comment |= *byte == b'#';
            open |= !comment && !is_blank(*byte);
        } else {
            open |= !is_blank(*byte);
        }
    }
    lines + usize::from(open)
}

/// Where the first `lines` lines of `text` that have a token end.
pub(super) fn end_of(text: &[u8], lines: usize, comments: bool) -> usize {
    let mut line = Line { text, at: 0, within: true, comments };
    for _ in 0..lines {
        line.next_line();
        line.skip_line();
    }
    line.at
}
