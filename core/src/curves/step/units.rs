//! Units of length and of plane angle, and the uncertainty of a context.

use super::builder::{Builder, Context};
use super::text::decoded;
use crate::curves::network::Unit;

/// Conversions within each other, at most.
const DEEPEST: u32 = 8;

/// A unit that is known: what it measures, its name, and how much it is in metres or radians.
struct Known {
    is_length: bool,
    name: String,
    size: f64,
}

impl Builder<'_> {
    /// The context of a representation.
    pub(super) fn context(&mut self, id: u64) -> Context {
        let mut context = Context { unit: None, angle: 1.0, uncertainty: None };
        let units = self.record(id, &["GLOBAL_UNIT_ASSIGNED_CONTEXT"]).and_then(|record| {
            // On its own, it has the identifier and type of a context before its units.
            let at = record.values.len().saturating_sub(1);
            record.references(at)
        });
        for unit in units.unwrap_or_default() {
            match self.unit(unit, DEEPEST) {
                Ok(Some(known)) if known.is_length => {
                    context.unit = Some(Unit { name: known.name, millimetres: known.size * 1000.0 });
                }
                Ok(Some(known)) => context.angle = known.size,
                Ok(None) => {}
                Err(why) => self.note(unit, "a unit is not understood", &why),
            }
        }
        let uncertainty = self.record(id, &["GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT"]);
        for value in uncertainty.and_then(|record| record.references(record.values.len().saturating_sub(1))).unwrap_or_default() {
            let Ok(record) = self.record(value, &["UNCERTAINTY_MEASURE_WITH_UNIT"]) else { continue };
            let is_length = |known: &Known| known.is_length;
            let known = record.reference(1).and_then(|unit| self.unit(unit, DEEPEST)).ok().flatten().filter(is_length);
            if let (Some(known), Ok(size), Some(unit)) = (known, record.number(0), &context.unit) {
                context.uncertainty = Some(size * known.size * 1000.0 / unit.millimetres).filter(|size| *size > 0.0);
            }
        }
        context
    }

    /// A unit of length or plane angle; nothing of another one.
    fn unit(&mut self, id: u64, depth: u32) -> Result<Option<Known>, String> {
        if depth == 0 {
            return Err("it is converted from itself".into());
        }
        let records = self.records(id)?;
        let has = |name: &str| records.iter().any(|record| record.name.is(name));
        let is_length = has("LENGTH_UNIT");
        if !is_length && !has("PLANE_ANGLE_UNIT") {
            return Ok(None);
        }
        if let Some(record) = records.iter().find(|record| record.name.is("CONVERSION_BASED_UNIT")) {
            let measure = record.values.iter().find_map(super::record::Value::reference).ok_or("a conversion from nothing")?;
            let name = record.text(0).map(decoded).unwrap_or_default();
            let (number, base) = self.measure(measure)?;
            let base = self.unit(base, depth - 1)?.ok_or("a conversion from another kind of unit")?;
            return Ok(Some(Known { is_length, name, size: number * base.size }));
        }
        let record = records.iter().find(|record| record.name.is("SI_UNIT")).ok_or("neither of SI nor converted")?;
        let word = |at: usize| record.values.get(at).and_then(super::record::Value::word).map(|word| word.to_string());
        // On its own, it has dimensions before the prefix.
        let last = record.values.len().saturating_sub(1);
        let prefix = last.checked_sub(1).and_then(word);
        let power = prefix.as_deref().map_or(Some(0), power).ok_or("an unknown prefix")?;
        let name = word(last).unwrap_or_default();
        let name = match (is_length, prefix.as_deref()) {
            (true, None) => "m".into(),
            (true, Some("MILLI")) => "mm".into(),
            (true, Some("CENTI")) => "cm".into(),
            (true, Some("MICRO")) => "µm".into(),
            (_, prefix) => format!("{}{name}", prefix.unwrap_or_default()).to_lowercase(),
        };
        Ok(Some(Known { is_length, name, size: 10_f64.powi(power) }))
    }

    /// LENGTH_MEASURE_WITH_UNIT and others: a number, and its unit.
    fn measure(&mut self, id: u64) -> Result<(f64, u64), String> {
        let records = self.records(id)?;
        let record =
            records.iter().find(|record| record.name.to_string().ends_with("MEASURE_WITH_UNIT") && record.values.len() >= 2);
        let record = record.ok_or_else(|| format!("#{id} is no measure"))?;
        Ok((record.number(0)?, record.reference(1)?))
    }
}

fn power(prefix: &str) -> Option<i32> {
    let powers = [
        ("EXA", 18),
        ("PETA", 15),
        ("TERA", 12),
        ("GIGA", 9),
        ("MEGA", 6),
        ("KILO", 3),
        ("HECTO", 2),
        ("DECA", 1),
        ("DECI", -1),
        ("CENTI", -2),
        ("MILLI", -3),
        ("MICRO", -6),
        ("NANO", -9),
        ("PICO", -12),
        ("FEMTO", -15),
        ("ATTO", -18),
    ];
    powers.iter().find(|(name, _)| *name == prefix).map(|(_, power)| *power)
}
