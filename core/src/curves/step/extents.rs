//! How composites count their parameter (ISO 10303-42, composite_curve): from 0 on, each segment as far as its own curve counts.

use super::builder::{Builder, DEEPEST};
use super::curves::{Basis, COMPOSITES};
use crate::curves::curve::Shape;
use crate::curves::vector::{distance, norm};

/// Entities that are a segment of a composite.
const SEGMENTS: [&str; 2] = ["COMPOSITE_CURVE_SEGMENT", "REPARAMETRISED_COMPOSITE_CURVE_SEGMENT"];

impl Builder<'_> {
    /// How far each part of a composite counts, those of composites within it one by one; nothing if it is no composite.
    pub(super) fn extents(&mut self, id: u64, depth: usize) -> Result<Option<Vec<f64>>, String> {
        if depth > DEEPEST {
            return Err("composites are more than 32 within each other, or one within itself".into());
        }
        let records = self.records(id)?;
        let Some(record) = records.iter().find(|record| COMPOSITES.iter().any(|name| record.name.is(name))) else {
            return Ok(None);
        };
        let at = record.values.iter().position(|value| value.list().is_some()).unwrap_or(1);
        let mut extents = Vec::new();
        for segment in record.references(at)? {
            let segment = self.record(segment, &SEGMENTS)?;
            let parent = segment.reference(2)?;
            let mut own = match self.extents(parent, depth + 1)? {
                Some(own) => own,
                None => vec![self.extent(parent, depth)?],
            };
            if !segment.truth(1)? {
                own.reverse();
            }
            // A segment that tells its length counts so far, whatever its curve does.
            if let Ok(told) = segment.number(3) {
                let sum: f64 = own.iter().sum();
                own.iter_mut().for_each(|extent| *extent *= told / sum);
            }
            extents.extend(own);
        }
        Ok(Some(extents))
    }

    /// How far a curve counts: lines by the length of their vector, circles by angles in the file's unit.
    fn extent(&mut self, id: u64, depth: usize) -> Result<f64, String> {
        let Some(Basis::Bounded(shape)) = self.basis(id, depth + 1)? else { return Err(format!("#{id} has no ends")) };
        let [low, high] = shape.domain();
        match shape {
            Shape::Line([a, b]) => {
                let of = self.record(id, &["TRIMMED_CURVE"]).and_then(|trimmed| self.record(trimmed.reference(1)?, &["LINE"]));
                let vector = of.and_then(|line| self.vector(line.reference(2)?));
                Ok(vector.map_or(high - low, |vector| distance(a, b) / norm(vector)))
            }
            Shape::Arc(_) => Ok((high - low) / self.angle),
            Shape::Conic(_) => Err("a composite with a parabola or a hyperbola that is trimmed by parameters".into()),
            _ => Ok(high - low),
        }
    }
}

/// The parameter of a shape at the parameter of the composite that it is.
pub(super) fn parameter(extents: &[f64], shape: &Shape, told: f64) -> f64 {
    let mut rest = told;
    let mut number = 0;
    // A joint belongs to the part before it, so that the end is that of the last part.
    while let Some(extent) = extents.get(number).filter(|extent| rest > **extent && number + 1 < extents.len()) {
        rest -= extent;
        number += 1;
    }
    let share = extents.get(number).map_or(0.0, |extent| rest / extent);
    let [low, high] = shape.domain();
    match shape {
        Shape::Composite(_) => low + number as f64 + share,
        // A composite of one curve is that curve.
        _ => low + (high - low) * share,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_run_through_the_parts() {
        let line = Shape::Line([[0.0; 3], [1.0, 0.0, 0.0]]);
        let both = Shape::Composite(vec![line.clone(), line.clone()]);
        let at = |told| parameter(&[10.0, 90.0], &both, told);
        assert_eq!([at(0.0), at(5.0), at(10.0), at(55.0), at(100.0)], [0.0, 0.5, 1.0, 1.5, 2.0]);
        assert_eq!(parameter(&[4.0], &line, 1.0), 0.25);
    }
}
