//! Numbers of rows: how those of a new row follow from those of others.

use crate::io::record::Point;

/// A vector that looks where a triangle looks, of twice its area.
pub(crate) fn facing([a, b, c]: [Point; 3]) -> [f64; 3] {
    let from_a = |p: Point| [0, 1, 2].map(|k| f64::from(p[k]) - f64::from(a[k]));
    let ([x, y, z], [u, v, w]) = (from_a(b), from_a(c));
    [y * w - z * v, z * u - x * w, x * v - y * u]
}

/// How a number of a new row follows from the same number of other rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mix {
    /// A coordinate of this axis: given.
    Axis(usize),
    /// Their mean, by weight.
    Mean,
    /// Their mean, by weight, as a whole number.
    Whole,
    /// A coordinate of a direction: their mean, of the length that the first has. Directions follow each other by threes.
    Direction,
    /// That of the heaviest, the first of equals: names, classes, flags.
    Heaviest,
}

/// The numbers of a row made of others, each with its weight; weights have the sum 1. Numbers that some of them lack are left out.
pub(crate) fn mixed(mixes: &[Mix], parts: &[(&[f64], f64)]) -> Vec<f64> {
    let length = parts.iter().map(|(values, _)| values.len()).min().unwrap_or_default();
    let heaviest = parts.iter().fold(None, |best: Option<&(&[f64], f64)>, part| match best {
        Some(most) if most.1 >= part.1 => best,
        _ => Some(part),
    });
    let mean = |k: usize| parts.iter().map(|(values, weight)| values.get(k).copied().unwrap_or_default() * weight).sum::<f64>();
    let of_heaviest = |k: usize| heaviest.and_then(|(values, _)| values.get(k)).copied().unwrap_or_default();
    let mut all: Vec<f64> = (0..length)
        .map(|k| match mixes.get(k).or(mixes.last()) {
            Some(Mix::Heaviest) => of_heaviest(k),
            // One row's numbers are taken as they are.
            _ if parts.len() == 1 => of_heaviest(k),
            Some(Mix::Whole) => mean(k).round(),
            _ => mean(k),
        })
        .collect();
    if parts.len() > 1 {
        straighten(mixes, &mut all, of_heaviest);
    }
    all
}

/// Gives mixed directions the length of the heaviest.
fn straighten(mixes: &[Mix], all: &mut [f64], of_heaviest: impl Fn(usize) -> f64) {
    let mut at = 0;
    while let Some(three) = all.get_mut(at..at + 3) {
        if mixes.get(at..at + 3) != Some(&[Mix::Direction; 3]) {
            at += 1;
            continue;
        }
        let length = |of: [f64; 3]| of.iter().map(|x| x * x).sum::<f64>().sqrt();
        let wanted = length([0, 1, 2].map(|k| of_heaviest(at + k)));
        let own = length([0, 1, 2].map(|k| three.get(k).copied().unwrap_or_default()));
        let scale = if own > 0.0 && own.is_finite() { wanted / own } else { 1.0 };
        three.iter_mut().for_each(|x| *x *= scale);
        at += 3;
    }
}

/// Gives a row this position.
pub(crate) fn set_position(mixes: &[Mix], values: &mut Vec<f64>, point: Point) {
    for (k, mix) in mixes.iter().enumerate() {
        let Mix::Axis(axis) = *mix else { continue };
        if values.len() <= k {
            values.resize(k + 1, 0.0);
        }
        if let (Some(value), Some(coordinate)) = (values.get_mut(k), point.get(axis)) {
            *value = f64::from(*coordinate);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_mixed_by_their_kind() {
        let mixes = [Mix::Axis(0), Mix::Mean, Mix::Direction, Mix::Direction, Mix::Direction, Mix::Heaviest];
        let (a, b) = ([9.0, 10.0, 2.0, 0.0, 0.0, 7.0], [9.0, 20.0, 0.0, 2.0, 0.0, 8.0]);
        let mut row = mixed(&mixes, &[(&a, 0.5), (&b, 0.5)]);
        set_position(&mixes, &mut row, [1.5, 0.0, 0.0]);
        let half = 2.0_f64.sqrt();
        assert_eq!((row[0], row[1], row[5]), (1.5, 15.0, 7.0));
        assert!((row[2] - half).abs() < 1e-12 && (row[3] - half).abs() < 1e-12 && row[4] == 0.0);
        assert_eq!(mixed(&mixes, &[(&b, 1.0)])[1..], b[1..]);
        assert_eq!(mixed(&mixes, &[(&a, 0.25), (&b[..2], 0.75)]).len(), 2, "a number that one row lacks");
        assert!(mixed(&mixes, &[]).is_empty());
    }
}
