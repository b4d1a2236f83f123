//! Vertices and triangles in the form that nearly all programs write them in: nothing but the elements that must be there, in order, without
//! attributes, and blanks between tags. Everything else is `None` here, and is read the slow way.

use super::super::number::{self, COMMA, Number};
use super::xml::is_blank;

/// Bytes of a number that are looked at.
const LONGEST_NUMBER: usize = 40;

/// A number and its text.
pub(super) type Written<'a> = (&'a [u8], Number);

/// A place in a text, beyond blanks.
struct Cursor<'a> {
    text: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    /// Goes behind blanks and this tag.
    #[inline(always)]
    fn tag(&mut self, tag: &[u8]) -> Option<()> {
        self.at = beyond_blanks(self.text, self.at);
        self.exactly(tag)
    }

    /// Goes behind this tag, which must be here.
    #[inline(always)]
    fn exactly(&mut self, tag: &[u8]) -> Option<()> {
        let here = self.text.get(self.at..self.at + tag.len())?;
        self.at += tag.len();
        (here == tag).then_some(())
    }

    /// The bytes before the next tag, which are a number's.
    #[inline(always)]
    fn digits(&mut self) -> Option<&'a [u8]> {
        let rest = self.text.get(self.at..)?;
        let length = rest.iter().take(LONGEST_NUMBER).position(|&byte| byte == b'<')?;
        self.at += length;
        rest.get(..length)
    }

    #[inline(always)]
    fn coordinate(&mut self, begin: &[u8], end: &[u8]) -> Option<Written<'a>> {
        self.tag(begin)?;
        let digits = self.digits()?;
        let number = number::number(digits).filter(|number| number.length == digits.len() && number.separator != COMMA)?;
        self.exactly(end)?;
        Some((digits, number))
    }

    #[inline(always)]
    fn index(&mut self, begin: &[u8], end: &[u8]) -> Option<u32> {
        self.tag(begin)?;
        let index = index(self.digits()?)?;
        self.exactly(end)?;
        Some(index)
    }
}

/// The first byte from `at` on that is no blank, or the end.
#[inline(always)]
pub(super) fn beyond_blanks(text: &[u8], mut at: usize) -> usize {
    while text.get(at).copied().is_some_and(is_blank) {
        at += 1;
    }
    at
}

/// An index as its digits.
#[inline(always)]
pub(super) fn index(digits: &[u8]) -> Option<u32> {
    let short = digits.iter().try_fold(0u32, |index, byte| {
        let digit = byte.wrapping_sub(b'0');
        (digit < 10).then_some(index.wrapping_mul(10).wrapping_add(digit.into()))
    });
    short.filter(|_| matches!(digits.len(), 1..=9)).or_else(|| long_index(digits))
}

/// One with a sign or many zeros, or none at all.
#[cold]
fn long_index(digits: &[u8]) -> Option<u32> {
    std::str::from_utf8(digits).ok()?.parse().ok()
}

/// A vertex at this byte: its coordinates as they are written and as numbers, and the byte behind it.
#[inline]
pub(super) fn vertex(text: &[u8], at: usize) -> Option<([Written<'_>; 3], usize)> {
    let mut cursor = Cursor { text, at };
    cursor.exactly(b"<vertex>")?;
    cursor.tag(b"<coordinates>")?;
    let x = cursor.coordinate(b"<x>", b"</x>")?;
    let y = cursor.coordinate(b"<y>", b"</y>")?;
    let z = cursor.coordinate(b"<z>", b"</z>")?;
    cursor.tag(b"</coordinates>")?;
    cursor.tag(b"</vertex>")?;
    Some(([x, y, z], cursor.at))
}

/// A triangle at this byte: the indices of its vertices, and the byte behind it.
#[inline]
pub(super) fn triangle(text: &[u8], at: usize) -> Option<([u32; 3], usize)> {
    let mut cursor = Cursor { text, at };
    cursor.exactly(b"<triangle>")?;
    let a = cursor.index(b"<v1>", b"</v1>")?;
    let b = cursor.index(b"<v2>", b"</v2>")?;
    let c = cursor.index(b"<v3>", b"</v3>")?;
    cursor.tag(b"</triangle>")?;
    Some(([a, b, c], cursor.at))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_plain_forms_and_no_others() {
        let text = b" <vertex>\n <coordinates><x>1.5</x>\t<y>-2</y><z>3e1</z></coordinates></vertex><";
        let (numbers, end) = vertex(text, 1).unwrap();
        assert_eq!((numbers.map(|(_, number)| number.value), end), ([1.5, -2.0, 30.0], text.len() - 1));
        let text = b"<triangle><v1>0</v1><v2>12</v2>\r\n<v3>4294967294</v3></triangle>";
        assert_eq!(triangle(text, 0), Some(([0, 12, u32::MAX - 1], text.len())));
        for odd in [
            "<triangle ><v1>0</v1><v2>1</v2><v3>2</v3></triangle>",
            "<triangle><v1> 0</v1><v2>1</v2><v3>2</v3></triangle>",
            "<triangle><v2>0</v2><v1>1</v1><v3>2</v3></triangle>",
            "<triangle><v1>0</v1><v2>1</v2><v3></v3></triangle>",
            "<triangle><v1>0</v1><v2>1</v2><v3>4294967296</v3></triangle>",
            "<triangle><v1>0</v1><v2>1</v2><v3>2</v3>",
        ] {
            assert_eq!(triangle(odd.as_bytes(), 0), None, "{odd}");
        }
    }
}
