//! Numbers in lines for people: as many digits as a person reads. The report holds them whole.

use std::fmt::{Display, Formatter, Result};

/// Significant digits of a number.
const DIGITS: usize = 5;

/// A number with few digits.
#[derive(Clone, Copy)]
pub(crate) struct Short(pub(crate) f64);

impl Display for Short {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let scientific = format!("{:.*e}", DIGITS - 1, self.0);
        // Read back, so that zeros at the end go.
        match (scientific.parse::<f64>(), scientific.split_once('e').and_then(|(_, e)| e.parse().ok())) {
            (Ok(short), Some(-4..=8)) => write!(f, "{short}"),
            (Ok(short), _) => write!(f, "{short:e}"),
            _ => write!(f, "{}", self.0),
        }
    }
}

/// A position with few digits.
#[derive(Clone, Copy)]
pub(crate) struct At(pub(crate) [f32; 3]);

impl Display for At {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let [x, y, z] = self.0.map(|x| Short(x.into()));
        write!(f, "[{x}, {y}, {z}]")
    }
}

/// From the one end of a box to the other.
pub(crate) fn span([lo, hi]: [[f32; 3]; 2]) -> String {
    format!("from {} to {}", At(lo), At(hi))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_few_digits() {
        let all = [0.0, 1.0, -0.000_117_128_109_559, 31_752.016_182, 71_442_719.7, 1e20, -2.5e-9, f64::INFINITY, 0.1 + 0.2];
        let want = ["0", "1", "-0.00011713", "31752", "71443000", "1e20", "-2.5e-9", "inf", "0.3"];
        assert_eq!(all.map(|x| Short(x).to_string()), want);
        assert_eq!(span([[0.1, -3.796_062, 10.0], [2.0, 0.0, 1e-7]]), "from [0.1, -3.7961, 10] to [2, 0, 1e-7]");
    }
}
