//! Medians, and how far runs lie apart.

/// Several values of one quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spread {
    pub(super) median: f64,
    pub(super) least: f64,
    pub(super) most: f64,
    pub(super) count: usize,
}

impl Spread {
    /// `None` of no values. The median of an even number of them is the mean of the two in the middle.
    pub(super) fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut values: Vec<_> = values.into_iter().collect();
        values.sort_unstable_by(f64::total_cmp);
        let upper = *values.get(values.len() / 2)?;
        let lower = *values.get((values.len() - 1) / 2)?;
        Some(Self { median: (lower + upper) / 2.0, least: *values.first()?, most: *values.last()?, count: values.len() })
    }

    /// The median, and the range in brackets if there is one.
    pub(super) fn text(self) -> String {
        match self.count {
            1 => number(self.median),
            _ => format!("{} ({}–{})", number(self.median), number(self.least), number(self.most)),
        }
    }
}

/// Three digits that count.
pub(super) fn number(value: f64) -> String {
    match value.abs() {
        99.95.. => spaced(value.round() as u64),
        9.995.. => format!("{value:.1}"),
        0.9995.. => format!("{value:.2}"),
        _ => format!("{value:.3}"),
    }
}

/// Thousands apart.
pub(super) fn spaced(number: u64) -> String {
    let digits = number.to_string();
    let groups: Vec<_> = digits.as_bytes().rchunks(3).rev().map(String::from_utf8_lossy).collect();
    groups.join(" ")
}

/// A round number of triangles in few letters: 100 k, 10 M.
pub(super) fn short(number: u64) -> String {
    let digits = |value: f64| if value < 9.95 && value.fract() > 0.04 { format!("{value:.1}") } else { format!("{value:.0}") };
    match number {
        1_000_000.. => format!("{} M", digits(number as f64 / 1e6)),
        1_000.. => format!("{} k", digits(number as f64 / 1e3)),
        _ => number.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_three_digits() {
        let shown = [0.01234, 0.9996, 1.234, 9.996, 12.34, 99.97, 123.4, 12_345_678.0].map(number);
        assert_eq!(shown, ["0.012", "1.00", "1.23", "10.0", "12.3", "100", "123", "12 345 678"]);
        assert_eq!([512, 2_000, 99_800, 1_500_000, 10_000_000].map(short), ["512", "2 k", "100 k", "1.5 M", "10 M"]);
    }

    #[test]
    fn middle_of_an_even_number_of_values_is_between_two() {
        assert_eq!(Spread::of([]), None);
        assert_eq!(Spread::of([3.0, 1.0, 2.0]), Some(Spread { median: 2.0, least: 1.0, most: 3.0, count: 3 }));
        assert_eq!(Spread::of([4.0, 1.0, 2.0, 9.0]).map(|spread| spread.median), Some(3.0));
    }
}
