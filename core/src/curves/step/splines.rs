//! B-splines of all kinds: with knots, uniform, quasi uniform, Bézier; rational or not; as simple or complex instances.

use super::builder::Builder;
use super::record::Record;
use crate::curves::curve::{HIGHEST_DEGREE, Spline};
use crate::curves::vector::Point;

/// Entities that are B-splines, alone or with others.
pub(super) const NAMES: [&str; 6] = [
    "B_SPLINE_CURVE_WITH_KNOTS",
    "BEZIER_CURVE",
    "UNIFORM_CURVE",
    "QUASI_UNIFORM_CURVE",
    "RATIONAL_B_SPLINE_CURVE",
    "B_SPLINE_CURVE",
];

impl Builder<'_> {
    /// A B-spline by its records.
    pub(super) fn spline(&mut self, records: &[Record<'_>]) -> Result<Spline, String> {
        let find = |name: &str| records.iter().find(|record| record.name.is(name));
        // On its own, everything stands in one record behind a name.
        let (base, offset) = match (records, find("B_SPLINE_CURVE")) {
            ([single], _) => (single, 1),
            (_, Some(base)) => (base, 0),
            _ => return Err("a B-spline without degree and points".into()),
        };
        let degree = base.number(offset)?;
        if degree.fract() != 0.0 || !(1.0..=HIGHEST_DEGREE as f64).contains(&degree) {
            return Err(format!("a B-spline of degree {degree}"));
        }
        let degree = degree as usize;
        let mut points: Vec<Point> = Vec::new();
        for id in base.references(offset + 1)? {
            points.push(self.point(id)?);
        }
        let weights = match find("RATIONAL_B_SPLINE_CURVE") {
            Some(record) => Some(record.numbers(if records.len() == 1 { record.values.len() - 1 } else { 0 })?),
            None => None,
        };
        let count = points.len();
        let knots = if let Some(record) = find("B_SPLINE_CURVE_WITH_KNOTS") {
            let at = if records.len() == 1 { 6 } else { 0 };
            repeated(&record.numbers(at)?, &record.numbers(at + 1)?, count + degree + 1)?
        } else if find("UNIFORM_CURVE").is_some() {
            (0..count + degree + 1).map(|number| number as f64 - degree as f64).collect()
        } else if find("BEZIER_CURVE").is_some() {
            bezier(count, degree)?
        } else {
            quasi_uniform(count, degree)
        };
        Spline::new(degree, knots, points, weights, None).map_err(|error| error.to_string())
    }
}

/// Knots as often as they are repeated; it is known how many there must be.
pub(super) fn repeated(multiplicities: &[f64], knots: &[f64], count: usize) -> Result<Vec<f64>, String> {
    let sum: f64 = multiplicities.iter().sum();
    let is_whole = multiplicities.iter().all(|number| number.fract() == 0.0 && *number > 0.0);
    if multiplicities.len() != knots.len() || !is_whole || sum != count as f64 {
        return Err(format!("{sum} knots where {count} are needed"));
    }
    Ok(multiplicities.iter().zip(knots).flat_map(|(number, knot)| std::iter::repeat_n(*knot, *number as usize)).collect())
}

/// Each inner knot as often as the degree.
pub(super) fn bezier(count: usize, degree: usize) -> Result<Vec<f64>, String> {
    if count <= degree || !(count - 1).is_multiple_of(degree) {
        return Err(format!("{count} points for Bézier curves of degree {degree}"));
    }
    let pieces = (count - 1) / degree;
    let mut knots = vec![0.0];
    knots.extend((0..=pieces).flat_map(|number| std::iter::repeat_n(number as f64, degree)));
    knots.push(pieces as f64);
    Ok(knots)
}

/// Both ends repeated, one step from knot to knot between.
pub(super) fn quasi_uniform(count: usize, degree: usize) -> Vec<f64> {
    let pieces = count.saturating_sub(degree);
    let mut knots = vec![0.0; degree];
    knots.extend((0..=pieces).map(|number| number as f64));
    knots.extend(std::iter::repeat_n(pieces as f64, degree));
    knots
}
