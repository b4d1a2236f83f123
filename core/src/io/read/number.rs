//! Decimal text to the nearest `f32`, in every spelling that C, Fortran and spreadsheet writers put into an STL.
//!
//! Based on: W. D. Clinger, "How to read floating point numbers accurately", PLDI 1990: an integer up to 2^53 times or divided by
//! a power of ten up to 10^22 is one correctly rounded `f64` operation. Rounding that once more to `f32` is right unless the
//! `f64` lies exactly half-way between two `f32`, since every such half-way point is an `f64` and rounding is monotone; those
//! few, and everything longer, go to the standard library.

/// Seen in a number: a decimal point.
pub(super) const POINT: u8 = 1;
/// Seen in a number: a decimal comma.
pub(super) const COMMA: u8 = 2;

/// A number and how it was written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Number {
    pub(super) value: f32,
    /// The nearest `f64`.
    pub(super) wide: f64,
    /// Bytes it takes.
    pub(super) length: usize,
    /// [`POINT`], [`COMMA`] or neither.
    pub(super) separator: u8,
}

const TENS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21,
    1e22,
];

/// White space as C has it. Other control characters are none: one in the middle of a number is damage, not its end.
#[inline(always)]
pub(super) fn is_blank(byte: u8) -> bool {
    byte == b' ' || byte.wrapping_sub(b'\t') < 5
}

/// The number at the beginning of `text`, which must end there or before a blank. `None` if the token is no number.
#[inline]
pub(super) fn number(text: &[u8]) -> Option<Number> {
    plain(text).or_else(|| unusual(text))
}

/// `[+-]digits[.digits][e[+-]digits]` within the reach of one `f64` operation.
#[inline]
fn plain(text: &[u8]) -> Option<Number> {
    let byte = |at: usize| text.get(at).copied().unwrap_or(b' ');
    let mut at = usize::from(matches!(byte(0), b'-' | b'+'));
    let whole_from = at;
    let mut mantissa = 0u64;
    // Overflow needs more than 19 digits, and those are counted below.
    let mut digits = |at: &mut usize| {
        loop {
            let digit = byte(*at).wrapping_sub(b'0');
            if digit > 9 {
                return;
            }
            mantissa = mantissa.wrapping_mul(10).wrapping_add(digit.into());
            *at += 1;
        }
    };
    digits(&mut at);
    let mut count = at - whole_from;
    let mut exponent = 0i32;
    let mut separator = 0;
    if byte(at) == b'.' {
        separator = POINT;
        let fraction_from = at + 1;
        at = fraction_from;
        digits(&mut at);
        count += at - fraction_from;
        exponent = -i32::try_from(at - fraction_from).ok()?;
    }
    if byte(at) | 0x20 == b'e' {
        let negative = byte(at + 1) == b'-';
        at += 1 + usize::from(negative || byte(at + 1) == b'+');
        let from = at;
        let mut power = 0i32;
        while byte(at).is_ascii_digit() && at - from < 4 {
            power = power * 10 + i32::from(byte(at) - b'0');
            at += 1;
        }
        if at == from {
            return None;
        }
        exponent += if negative { -power } else { power };
    }
    if count == 0 || count > 19 || mantissa > 1 << 53 || !is_blank(byte(at)) {
        return None;
    }
    let scale = *TENS.get(exponent.unsigned_abs() as usize)?;
    let exact = if exponent < 0 { mantissa as f64 / scale } else { mantissa as f64 * scale };
    if exact.to_bits() & 0x1fff_ffff == 0x1000_0000 {
        return None;
    }
    let wide = if byte(0) == b'-' { -exact } else { exact };
    Some(Number { value: wide as f32, wide, length: at, separator })
}

/// Everything else that means a number: any length, decimal comma between digits, exponent written with a Fortran `D`, `nan` and
/// `inf` as C99 and as older Windows libraries print them.
#[cold]
fn unusual(text: &[u8]) -> Option<Number> {
    let length = text.iter().position(|&byte| is_blank(byte)).unwrap_or(text.len());
    let mut token = text.get(..length)?.to_ascii_lowercase();
    let (negative, magnitude) = match token.split_first() {
        Some((b'-', rest)) => (true, rest),
        Some((b'+', rest)) => (false, rest),
        _ => (false, token.as_slice()),
    };
    if let Some(value) = not_a_finite_number(magnitude) {
        let value = if negative { -value } else { value };
        return Some(Number { value, wide: value.into(), length, separator: 0 });
    }
    let mut separator = 0;
    for at in 0..token.len() {
        let digit = |at: Option<usize>| at.and_then(|at| token.get(at)).is_some_and(u8::is_ascii_digit);
        let replaced = match token.get(at)? {
            b'0'..=b'9' | b'+' | b'-' | b'e' => continue,
            b'.' => {
                separator |= POINT;
                b'.'
            }
            b',' if digit(at.checked_sub(1)) && digit(Some(at + 1)) => {
                separator |= COMMA;
                b'.'
            }
            b'd' => b'e',
            _ => return None,
        };
        *token.get_mut(at)? = replaced;
    }
    let text = std::str::from_utf8(&token).ok()?;
    Some(Number { value: text.parse().ok()?, wide: text.parse().ok()?, length, separator })
}

/// `nan`, `nan(ind)`, `inf`, `infinity`, `1.#inf`, `1.#qnan0`, and `1.#j`, which is `1.#inf` rounded to two places. No sign.
fn not_a_finite_number(token: &[u8]) -> Option<f32> {
    if token.starts_with(b"nan") {
        Some(f32::NAN)
    } else if token == b"inf" || token == b"infinity" {
        Some(f32::INFINITY)
    } else {
        let kind = token.strip_prefix(b"1.#").or_else(|| token.strip_prefix(b"1,#"))?;
        Some(if kind.starts_with(b"inf") || kind.starts_with(b"j") { f32::INFINITY } else { f32::NAN })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn value(text: &str) -> Option<f32> {
        number(text.as_bytes()).map(|number| number.value)
    }

    #[test]
    fn every_spelling_of_a_number() {
        for (text, expected) in [
            ("1", 1.0),
            ("+1", 1.0),
            (".5", 0.5),
            ("5.", 5.0),
            ("-0", -0.0),
            ("1.5E+003", 1500.0),
            ("1.5e-3", 0.0015),
            ("2.5D2", 250.0),
            ("-2.5d-01", -0.25),
            ("1,25", 1.25),
            ("-1,25e1", -12.5),
            ("00012.50000", 12.5),
            ("1e400", f32::INFINITY),
            ("-1e400", f32::NEG_INFINITY),
            ("1e-400", 0.0),
            ("inf", f32::INFINITY),
            ("-Infinity", f32::NEG_INFINITY),
            ("1.#INF", f32::INFINITY),
            ("-1.#INF000e+000", f32::NEG_INFINITY),
            ("1.#J", f32::INFINITY),
        ] {
            assert_eq!(value(text).map(f32::to_bits), Some(f32::to_bits(expected)), "{text}");
        }
        for text in ["nan", "-nan(ind)", "NaN", "1.#QNAN", "-1.#IND00", "1,#IND"] {
            assert!(value(text).is_some_and(f32::is_nan), "{text}");
        }
    }

    #[test]
    fn what_is_no_number() {
        for text in [
            "", "-", ".", "e5", "1e", "1e+", "1.2.3", "1,", ",5", "1,2,3", "1-2", "0x10", "vertex", "1.5mm", "1_000", "é", "1\0",
            "2e+0\x10",
        ] {
            assert_eq!(value(text), None, "{text}");
        }
    }

    #[test]
    fn separators_are_reported() {
        let separator = |text: &str| number(text.as_bytes()).unwrap().separator;
        assert_eq!(["1", "1.5", "1,5", "nan", "1.#INF", "1e5"].map(separator), [0, POINT, COMMA, 0, 0, 0]);
    }

    #[test]
    fn a_number_ends_at_any_blank() {
        for end in [" 7", "\t", "\r\n", "\n", "\x0b", "\x0c"] {
            let number = number(format!("12.5{end}").as_bytes()).unwrap();
            assert_eq!((number.value, number.length), (12.5, 4));
        }
    }

    #[test]
    fn half_way_cases_round_once() {
        // 1 + 2^-24 lies half-way between 1 and the next f32: to even, unless a digit behind it decides. Rounding to f64 first
        // swallows that digit.
        assert_eq!(value("1.000000059604644775390625"), Some(1.0));
        assert_eq!(value("1.000000059604644775390626"), Some(1.0 + f32::EPSILON));
        // The same where the detour through f64 alone is within reach: 2^24 + 1 is half-way, exactly.
        assert_eq!(value("16777217"), Some(16_777_216.0));
        assert_eq!(value("16777219"), Some(16_777_220.0));
        // 9007199254740993 = 2^53 + 1 is not an f64.
        assert_eq!(value("9007199254740993"), Some(9_007_199_254_740_992.0));
    }

    proptest! {
        #[test]
        fn agrees_with_the_standard_library(
            whole in "[-+]?[0-9]{0,12}", fraction in "(\\.[0-9]{0,14})?", e in "([eE][-+]?[0-9]{1,3})?",
        ) {
            let text = format!("{whole}{fraction}{e}");
            prop_assert_eq!(value(&text).map(f32::to_bits), text.parse::<f32>().ok().map(f32::to_bits), "{}", text);
        }

        /// Decimal expansions near half-way points between neighbouring f32, shortened to a random number of digits.
        #[test]
        fn is_right_next_to_half_way_points(bits in 0x3000_0000u32..0x5000_0000, places in 1usize..20) {
            let (low, high) = (f64::from(f32::from_bits(bits)), f64::from(f32::from_bits(bits + 1)));
            let text = format!("{:.places$e}", (low + high) / 2.0);
            prop_assert_eq!(value(&text).map(f32::to_bits), text.parse::<f32>().ok().map(f32::to_bits), "{}", text);
        }

        #[test]
        fn shortest_text_comes_back(bits: u32) {
            let number = f32::from_bits(bits);
            prop_assume!(!number.is_nan());
            for text in [format!("{number}"), format!("{number:e}"), format!("{number:.9e}")] {
                prop_assert_eq!(value(&text).map(f32::to_bits), Some(bits), "{}", text);
            }
        }
    }
}
