//! Parts of curves between points or parameters.

use super::builder::Builder;
use super::curves::Basis;
use super::extents;
use super::record::{Record, Value};
use crate::curves::curve::Shape;
use crate::curves::vector::{Point, distance, norm};

/// One end of a part: a point, a parameter, or both.
#[derive(Clone, Copy, Debug, Default)]
struct Trim {
    point: Option<Point>,
    parameter: Option<f64>,
}

impl Builder<'_> {
    /// TRIMMED_CURVE: a curve, both ends, whether it runs with the curve, and which of point and parameter counts.
    pub(super) fn trimmed(&mut self, record: &Record<'_>, depth: usize) -> Result<Option<Shape>, String> {
        let id = record.reference(1)?;
        let Some(basis) = self.basis(id, depth + 1)? else { return Ok(None) };
        let mut trims = [self.trim(record.list(2)?)?, self.trim(record.list(3)?)?];
        if let (Basis::Bounded(shape), true) = (&basis, trims.iter().any(|trim| trim.parameter.is_some())) {
            self.count(id, shape, &mut trims, depth)?;
        }
        let is_same = record.truth(4)?;
        let by_point = record.values.get(5).and_then(Value::word).is_some_and(|word| word.is("CARTESIAN"));
        let ends = self.ends(id, &basis, trims, by_point)?;
        let gap = self.slack(&basis, ends);
        let ends = if is_same || matches!(basis, Basis::Line(..)) { ends } else { [ends[1], ends[0]] };
        let part = basis.clone().between(ends, gap).or_else(|why| match basis {
            // The whole of a curve, told by its ends the wrong way round.
            Basis::Bounded(shape) if matches!(shape, Shape::Spline(_)) && ends[0] > ends[1] => {
                shape.part([ends[1], ends[0]]).map(Shape::reversed).map_err(|_| why)
            }
            _ => Err(why),
        })?;
        let is_turned = !is_same && !matches!(part, Shape::Line(_));
        Ok(Some(if is_turned { part.reversed() } else { part }))
    }

    fn trim(&mut self, values: &[Value<'_>]) -> Result<Trim, String> {
        let mut trim = Trim::default();
        for value in values {
            match value {
                Value::Reference(id) => trim.point = Some(self.point(*id)?),
                other => trim.parameter = trim.parameter.or(other.number()),
            }
        }
        if trim.point.is_none() && trim.parameter.is_none() {
            Err("an end that is neither point nor parameter".into())
        } else {
            Ok(trim)
        }
    }

    /// Turns parameters of a composite into those of its shape. Where there are points as well, these count: programs differ in
    /// how they count the parameter of a composite.
    fn count(&mut self, id: u64, shape: &Shape, trims: &mut [Trim; 2], depth: usize) -> Result<(), String> {
        let is_needed = trims.iter().any(|trim| trim.point.is_none());
        let extents = match self.extents(id, depth) {
            Ok(Some(extents)) => extents,
            Ok(None) => return Ok(()),
            Err(why) if is_needed => return Err(why),
            Err(_) => Vec::new(),
        };
        // Parameters of arcs are angles in the file's unit, which are turned into radians later.
        let unit = if matches!(shape, Shape::Arc(_)) { self.angle } else { 1.0 };
        for trim in trims {
            let told = trim.parameter.filter(|_| trim.point.is_none());
            trim.parameter = told.map(|told| extents::parameter(&extents, shape, told) / unit);
        }
        Ok(())
    }

    /// Parameters of both ends. Where point and parameter are told and do not fit, the points count.
    fn ends(&mut self, id: u64, basis: &Basis, trims: [Trim; 2], by_point: bool) -> Result<[f64; 2], String> {
        let is_angle = matches!(basis, Basis::Bounded(Shape::Arc(_)));
        let unit = if is_angle { self.angle } else { 1.0 };
        let mut ends = [0.0; 2];
        let points = trims.map(|trim| trim.point);
        let reach = if let [Some(a), Some(b)] = points { distance(a, b).max(1e-3 * (norm(a) + norm(b))) } else { f64::INFINITY };
        for (end, trim) in ends.iter_mut().zip(trims) {
            let told = trim.parameter.map(|parameter| parameter * unit);
            let found = trim.point.map(|point| basis.parameter(point));
            let fits = match (told, trim.point) {
                (Some(told), Some(point)) => distance(basis.point(told), point) <= 1e-3 * reach,
                _ => true,
            };
            if !fits && !by_point {
                self.note(id, "a curve is trimmed by points and parameters that differ; the points count", "");
            }
            *end = match (told, found) {
                (Some(told), None) => told,
                (Some(told), Some(_)) if fits && !by_point => told,
                (_, Some(found)) => found,
                (None, None) => return Err("an end that is neither point nor parameter".into()),
            };
        }
        Ok(ends)
    }

    /// How far ends of a closed curve may be apart.
    pub(super) fn slack(&self, basis: &Basis, ends: [f64; 2]) -> f64 {
        let size = match basis {
            Basis::Bounded(shape) => {
                let [low, high] = shape.bounds();
                distance(low, high)
            }
            _ => distance(basis.point(ends[0]), basis.point(ends[1])),
        };
        (1e-6 * size).max(self.uncertainty.min(1e-3 * size))
    }
}
