//! Numbers as text.

use std::fmt::Write;

/// Appends the shortest text that reads back as the same number, with a decimal point as both formats demand; `exponent` is the
/// letter before a power of ten. The number is finite.
pub(super) fn real(text: &mut String, value: f64, exponent: char) {
    let start = text.len();
    // Shortest digits that are read as the same number; writing to a string never fails.
    let _ = write!(text, "{value:?}");
    let Some(digits) = text.get(start..) else { return };
    if let Some((mantissa, power)) = digits.split_once('e') {
        let point = if mantissa.contains('.') { "" } else { "." };
        let whole = format!("{mantissa}{point}{exponent}{power}");
        text.truncate(start);
        text.push_str(&whole);
    } else if digits.ends_with(".0") {
        text.pop();
    }
}

/// Knots that differ, and how often each is repeated.
pub(super) fn multiplicities(knots: &[f64]) -> (Vec<usize>, Vec<f64>) {
    let (mut counts, mut distinct): (Vec<usize>, Vec<f64>) = (Vec::new(), Vec::new());
    for knot in knots {
        match counts.last_mut() {
            Some(count) if distinct.last() == Some(knot) => *count += 1,
            _ => {
                counts.push(1);
                distinct.push(*knot);
            }
        }
    }
    (counts, distinct)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn text(value: f64) -> String {
        let mut text = String::new();
        real(&mut text, value, 'D');
        text
    }

    #[test]
    fn numbers_have_a_point() {
        let cases = [(0.0, "0."), (1.0, "1."), (-2.5, "-2.5"), (1e-7, "1.D-7"), (1.5e-7, "1.5D-7"), (1e22, "1.D22")];
        for (value, expected) in cases {
            assert_eq!(text(value), expected);
        }
        assert_eq!(multiplicities(&[0.0, 0.0, 1.0, 2.0, 2.0]), (vec![2, 1, 2], vec![0.0, 1.0, 2.0]));
    }

    proptest! {
        #[test]
        fn numbers_read_back(bits in any::<u64>()) {
            let value = f64::from_bits(bits);
            prop_assume!(value.is_finite());
            let text = text(value);
            prop_assert!(text.contains('.') && text.len() <= 26);
            prop_assert_eq!(text.replace('D', "e").parse::<f64>().unwrap().to_bits(), bits);
        }
    }
}
