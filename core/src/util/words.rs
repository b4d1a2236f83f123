//! Numbers in lines for people: as many digits as a person reads, thousands apart. The report holds them whole.

use std::fmt::{Display, Formatter, Result};

/// Significant digits of a number.
const DIGITS: usize = 5;

/// Thousands of a number with fractions stand apart from so many digits on; of fewer, the eye needs no help.
const LONG: usize = 5;

/// A whole number.
#[derive(Clone, Copy, Debug)]
pub struct Count<T>(pub T);

impl<T: Display> Display for Count<T> {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        f.pad(&apart(&self.0.to_string(), 0))
    }
}

/// So many of a thing: its word for one, and for any other number.
///
/// ```
/// # use suture_core::words::Counted;
/// assert_eq!(Counted(1, "body", "bodies").to_string(), "1 body");
/// assert_eq!(Counted(2000, "body", "bodies").to_string(), "2 000 bodies");
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Counted<'a>(pub u64, pub &'a str, pub &'a str);

impl Display for Counted<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let Self(count, one, many) = *self;
        write!(f, "{} {}", Count(count), if count == 1 { one } else { many })
    }
}

/// So many triangles.
pub fn triangles(count: u64) -> Counted<'static> {
    Counted(count, "triangle", "triangles")
}

/// A decimal number with a gap after each third digit before its point, which every terminal can show, if these are at least `long`.
fn apart(number: &str, long: usize) -> String {
    let digits = number.len() - number.trim_start_matches(|c: char| !c.is_ascii_digit()).len();
    let (sign, rest) = number.split_at(digits);
    let end = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
    let (whole, fraction) = rest.split_at(end);
    if whole.len() < long {
        return number.to_owned();
    }
    let mut out = sign.to_owned();
    for (i, digit) in whole.chars().enumerate() {
        if i > 0 && (whole.len() - i).is_multiple_of(3) {
            out.push(' ');
        }
        out.push(digit);
    }
    out + fraction
}

/// A number with few digits.
#[derive(Clone, Copy, Debug)]
pub struct Short(pub f64);

impl Display for Short {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let scientific = format!("{:.*e}", DIGITS - 1, self.0);
        // Read back, so that zeros at the end go.
        match (scientific.parse::<f64>(), scientific.split_once('e').and_then(|(_, e)| e.parse().ok())) {
            (Ok(short), Some(-4..=8)) => f.pad(&apart(&short.to_string(), LONG)),
            (Ok(short), _) => write!(f, "{short:e}"),
            _ => write!(f, "{}", self.0),
        }
    }
}

/// A position with few digits.
#[derive(Clone, Copy, Debug)]
pub struct At(pub [f32; 3]);

impl Display for At {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let [x, y, z] = self.0.map(|x| Short(x.into()));
        write!(f, "[{x}, {y}, {z}]")
    }
}

/// From the one end of a box to the other.
pub fn span([lo, hi]: [[f32; 3]; 2]) -> String {
    format!("from {} to {}", At(lo), At(hi))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_few_digits() {
        let all = [0.0, 1.0, -0.000_117_128_109_559, 31_752.016_182, 71_442_719.7, 1e20, -2.5e-9, f64::INFINITY, 0.1 + 0.2];
        let want = ["0", "1", "-0.00011713", "31 752", "71 443 000", "1e20", "-2.5e-9", "inf", "0.3"];
        assert_eq!(all.map(|x| Short(x).to_string()), want);
        assert_eq!(span([[0.1, -3.796_062, 10.0], [2.0, 0.0, 1e-7]]), "from [0.1, -3.7961, 10] to [2, 0, 1e-7]");
        assert_eq!([1234.5, -12_345.6, -123_456.0].map(|x| Short(x).to_string()), ["1234.5", "-12 346", "-123 460"]);
        assert_eq!(
            [0, 999, 1000, 1_234_567, -23_456].map(|n| Count(n).to_string()),
            ["0", "999", "1 000", "1 234 567", "-23 456"]
        );
    }
}
