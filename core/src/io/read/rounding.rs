//! How far coordinates were moved to be `f32`.

use super::finding::Finding;

/// Decimal digits that tell every `f32` from the next: a writer of `f32` needs no more.
const DIGITS_OF_F32: usize = 9;

/// What became of coordinates that are finer than an `f32` can be.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Rounding {
    /// So many coordinates are held in more than an `f32` needs, and moved.
    pub(super) moved: u64,
    /// The farthest that one was moved, in units of the file.
    pub(super) farthest: f64,
}

impl Rounding {
    /// The nearest `f32` of a coordinate that is held as an `f64`.
    #[inline]
    pub(super) fn of_double(&mut self, wide: f64) -> f32 {
        let value = wide as f32;
        self.note(wide, value);
        value
    }

    /// Notes a decimal number of `length` bytes, which was read as `value`.
    #[inline]
    pub(super) fn of_decimal(&mut self, text: &[u8], length: usize, wide: f64, value: f32) {
        if length > DIGITS_OF_F32 && is_long(text.get(..length).unwrap_or_default()) {
            self.note(wide, value);
        }
    }

    #[inline]
    fn note(&mut self, wide: f64, value: f32) {
        let distance = (wide - f64::from(value)).abs();
        // What is no number, and what no `f32` reaches, is not finite and counted elsewhere.
        if distance > 0.0 && distance.is_finite() {
            self.moved += 1;
            self.farthest = self.farthest.max(distance);
        }
    }

    /// Joins what another piece of the file noted.
    pub(super) fn append(&mut self, other: Self) {
        self.moved += other.moved;
        self.farthest = self.farthest.max(other.farthest);
    }

    /// This, if anything was moved.
    pub(super) fn if_any(self) -> Option<Self> {
        (self.moved > 0).then_some(self)
    }

    /// A line for people.
    pub(super) fn finding(self) -> Finding {
        let text = format!(
            "coordinates finer than 32 bits hold: {} rounded to the nearest, by at most {:.2e} units",
            crate::util::words::Count(self.moved),
            self.farthest
        );
        Finding { harmless: true, ..Finding::flaw(text) }
    }
}

/// More significant digits than an `f32` needs.
fn is_long(number: &[u8]) -> bool {
    let mantissa = number.iter().take_while(|byte| !matches!(byte, b'e' | b'E' | b'd' | b'D'));
    let digits = mantissa.filter(|byte| byte.is_ascii_digit()).skip_while(|byte| **byte == b'0');
    // Zeros at the end are the width of a column.
    digits.enumerate().filter(|(_, digit)| **digit != b'0').last().is_some_and(|(last, _)| last >= DIGITS_OF_F32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noted(text: &str) -> Rounding {
        let mut rounding = Rounding::default();
        let wide: f64 = text.parse().unwrap();
        rounding.of_decimal(text.as_bytes(), text.len(), wide, text.parse().unwrap());
        rounding
    }

    #[test]
    fn a_decimal_that_an_f32_was_written_as_is_not_rounded() {
        for text in ["0.1", "-0.100000001", "123456.789", "0.000000123456789", "1.100000000000000e+00", "16777216.0000000"] {
            assert_eq!(noted(text), Rounding::default(), "{text}");
        }
    }

    #[test]
    fn a_longer_one_is() {
        let rounding = noted("0.12345678901");
        assert_eq!(rounding.moved, 1);
        assert!((rounding.farthest - (0.123_456_789_01 - f64::from(0.123_456_79_f32)).abs()).abs() < 1e-18);
        assert_eq!(noted("1e400").moved + noted("0.50000000000").moved, 0);
    }

    #[test]
    fn a_double_is_rounded_when_no_f32_is_the_same() {
        let mut rounding = Rounding::default();
        assert_eq!([0.5, f64::NAN, f64::INFINITY].map(|wide| rounding.of_double(wide)).len(), 3);
        assert_eq!(rounding.if_any(), None);
        assert_eq!(rounding.of_double(0.1), 0.1);
        assert_eq!(rounding.if_any().map(|r| r.moved), Some(1));
        let mut all = Rounding::default();
        all.append(rounding);
        assert_eq!(all, rounding);
    }
}
