//! Decimal numbers, and a cursor over a line.

/// Powers of ten that `f64` has exactly.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21,
    1e22,
];

/// Reads a line from left to right.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cursor<'a> {
    text: &'a [u8],
    pub(super) at: usize,
}

impl<'a> Cursor<'a> {
    pub(super) fn new(text: &'a [u8]) -> Self {
        Self { text, at: 0 }
    }

    pub(super) fn peek(&self) -> Option<u8> {
        self.text.get(self.at).copied()
    }

    pub(super) fn rest(&self) -> &'a [u8] {
        self.text.get(self.at..).unwrap_or_default()
    }

    /// Goes past what comes next if it is this.
    pub(super) fn eat(&mut self, expected: &[u8]) -> bool {
        let is = self.rest().starts_with(expected);
        if is {
            self.at += expected.len();
        }
        is
    }

    /// The bytes that come next, up to and without a byte, which it goes past.
    pub(super) fn until(&mut self, end: u8) -> Option<&'a [u8]> {
        let rest = self.rest();
        let length = memchr::memchr(end, rest)?;
        self.at += length + 1;
        rest.get(..length)
    }

    /// A number without a sign, with or without a decimal point, and with an exponent if it has a sign and two digits, as
    /// `printf` writes it; `E` alone is a word. Correctly rounded: exact up to 2⁵³ and 22 decimals (Clinger 1990), and by the
    /// library beyond.
    pub(super) fn number(&mut self) -> Option<f64> {
        let start = self.at;
        let (mut mantissa, mut digits, mut decimals, mut point) = (0_u64, 0_usize, 0_usize, false);
        while let Some(&byte) = self.text.get(self.at) {
            match byte {
                b'0'..=b'9' => {
                    mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(byte - b'0'));
                    digits += 1;
                    decimals += usize::from(point);
                }
                b'.' if !point => point = true,
                _ => break,
            }
            self.at += 1;
        }
        if digits == 0 {
            self.at = start;
            return None;
        }
        let exponent = self.exponent();
        match POWERS.get(decimals) {
            Some(power) if !exponent && digits < 19 && mantissa <= 1 << 53 => Some(mantissa as f64 / power),
            _ => std::str::from_utf8(self.text.get(start..self.at)?).ok()?.parse().ok(),
        }
    }

    /// Goes past an exponent; whether there is one.
    fn exponent(&mut self) -> bool {
        let is_exponent = matches!(self.rest(), [b'e', b'+' | b'-', b'0'..=b'9', b'0'..=b'9', ..]);
        if is_exponent {
            self.at += 4;
            // A third digit, of what is far too small or too great.
            self.at += usize::from(self.peek().is_some_and(|byte| byte.is_ascii_digit()));
        }
        is_exponent
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_the_library() {
        for text in [
            "1",
            "1.",
            ".5",
            "0.1",
            "123456.789012",
            "00012",
            "0.000001",
            "99999999999999999999",
            "1.5e-05",
            "3.14159265358979323846",
        ] {
            assert_eq!(Cursor::new(text.as_bytes()).number(), text.parse().ok(), "{text}");
        }
        let mut cursor = Cursor::new(b"10e5");
        assert_eq!((cursor.number(), cursor.rest()), (Some(10.0), &b"e5"[..]));
        assert_eq!(Cursor::new(b".").number(), None);
    }
}
