//! Offset curves (130), and the shapes of what they go beside.

use super::build::{Builder, DEEPEST};
use super::parameters::Parameters;
use super::shapes;
use crate::curves::curve::{Away, Offset, Shape};
use crate::curves::vector::distance;

impl Builder<'_> {
    /// The shape of any curve, where its own matrix puts it.
    pub(super) fn shape_of(&mut self, number: u32, depth: usize) -> Result<Shape, String> {
        if depth > DEEPEST {
            return Err("curves are more than 32 within each other, or one within itself".into());
        }
        let entry = *self.directory.get(number).ok_or_else(|| format!("D{number} is not in the file"))?;
        let parameters = self.parameters(&entry).ok_or_else(|| format!("D{number} is damaged"))?;
        let shape = match entry.kind {
            102 => {
                let mut parts = Vec::new();
                for part in (2..2 + parameters.count(1, 2, 1)?).map(|at| parameters.pointer(at)) {
                    let part = part?;
                    // Points between curves are allowed, and mean nothing here.
                    if self.directory.get(part).is_none_or(|part| !matches!(part.kind, 116 | 132)) {
                        parts.push(self.shape_of(part, depth + 1)?);
                    }
                }
                Shape::composite(parts).map_err(|error| error.to_string())?
            }
            130 => self.offset(&parameters, depth)?.0,
            _ if shapes::is_curve(&entry) => shapes::shape(&entry, &parameters)?.0,
            kind => return Err(format!("D{number} of type {kind} is no curve")),
        };
        let map = if entry.matrix == 0 { None } else { Some(self.places.matrix(self.directory, entry.matrix)?) };
        Ok(map.map_or(shape.clone(), |map| shape.transformed(&map)))
    }

    /// 130: curve, kind of distance, curve of distances and its coordinate, what these depend on, two distances with their
    /// places, normal, parameters of both ends.
    pub(super) fn offset(&mut self, parameters: &Parameters, depth: usize) -> Result<(Shape, Option<String>), String> {
        let base = self.shape_of(parameters.pointer(1)?, depth + 1)?;
        let [d1, t1, d2, t2] = parameters.reals(6, 4)?.try_into().map_err(|_| "distances are missing")?;
        let away = match parameters.integer(2)? {
            1 => Away::Constant(d1),
            2 => Away::Linear { distances: [d1, d2], at: [t1, t2] },
            3 => {
                let axis = parameters.integer(4)?;
                let axis = usize::try_from(axis - 1).ok().filter(|axis| *axis < 3);
                let axis = axis.ok_or("a coordinate that is none of three")?;
                Away::Coordinate(self.shape_of(parameters.pointer(3)?, depth + 1)?, axis)
            }
            other => return Err(format!("distances of the unknown kind {other}")),
        };
        let by_length = parameters.integer(5)? == 1 && !matches!(away, Away::Constant(_));
        let between = match [parameters.real(13), parameters.real(14)] {
            [Ok(from), Ok(to)] if from < to => Some([from, to]),
            _ => None,
        };
        let offset = Offset { normal: parameters.point(10)?, away, by_length, between };
        let [low, high] = base.bounds();
        let tolerance = self.fitting(distance(low, high));
        self.collector.may_fit()?;
        let (shape, off) = offset.of(&base, tolerance).map_err(|error| error.to_string())?;
        if off.is_some() {
            self.collector.count_fit(&shape)?;
        }
        Ok((shape, off.map(|off| format!("beside another one; fitted within {off:.1e}, {tolerance:.1e} were wanted"))))
    }

    /// How far what is fitted may be off: the file's resolution, or 10⁻⁶ of the size.
    pub(super) fn fitting(&self, size: f64) -> f64 {
        self.resolution.unwrap_or(1e-6 * size).clamp(1e-9 * size, (1e-4 * size).max(1e-9 * size))
    }
}
