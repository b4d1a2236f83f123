//! Points, directions, and systems of axes.

use super::builder::Builder;
use crate::curves::collect::significant;
use crate::curves::vector::{Affine, Point, cross, dot, norm, scale, sub, unit};

impl Builder<'_> {
    /// CARTESIAN_POINT: three coordinates. Two are a point in the space of parameters, or of a drawing.
    pub(super) fn point(&mut self, id: u64) -> Result<Point, String> {
        let record = self.record(id, &["CARTESIAN_POINT"])?;
        let mut numbers = record.numbers(1)?;
        if self.is_flat {
            numbers.resize(if numbers.len() == 2 { 3 } else { 0 }, 0.0);
        }
        let point = numbers.as_slice().try_into().map_err(|_| format!("#{id} has {} coordinates", numbers.len()))?;
        if self.is_flat {
            return Ok(point);
        }
        if let Some(place) = self.index.get(id) {
            let words = self.index.text(place).split(|byte| matches!(byte, b',' | b'(' | b')'));
            let numbers =
                words.map(<[u8]>::trim_ascii).filter(|word| word.first().is_some_and(|byte| !byte.is_ascii_alphabetic()));
            self.digits = numbers.map(significant).fold(self.digits, u32::max);
        }
        Ok(point)
    }

    /// DIRECTION, of length 1.
    pub(super) fn direction(&mut self, id: u64) -> Result<Point, String> {
        let record = self.record(id, &["DIRECTION"])?;
        let mut numbers = record.numbers(1)?;
        if self.is_flat {
            numbers.resize(if numbers.len() == 2 { 3 } else { 0 }, 0.0);
        }
        let [x, y, z] = numbers.as_slice().try_into().map_err(|_| format!("#{id} has {} components", numbers.len()))?;
        unit([x, y, z]).ok_or_else(|| format!("#{id} is a direction without length"))
    }

    /// VECTOR: a direction times a length.
    pub(super) fn vector(&mut self, id: u64) -> Result<Point, String> {
        let record = self.record(id, &["VECTOR"])?;
        let direction = self.direction(record.reference(1)?)?;
        Ok(scale(direction, record.number(2)?))
    }

    /// AXIS2_PLACEMENT_3D, AXIS1_PLACEMENT: the map that takes the axes there. An axis that is missing or damaged is the usual one, a first axis
    /// along the third any other one. AXIS2_PLACEMENT_2D of a curve of two dimensions.
    pub(super) fn frame(&mut self, id: u64) -> Result<Affine, String> {
        if self.is_flat {
            let record = self.record(id, &["AXIS2_PLACEMENT_2D"])?;
            let origin = self.point(record.reference(1)?)?;
            let x = record.reference(2).ok().map(|id| self.direction(id)).transpose()?.unwrap_or([1.0, 0.0, 0.0]);
            return Ok(Affine::from_axes(axes(x, [0.0, 0.0, 1.0]), origin));
        }
        let record = self.record(id, &["AXIS2_PLACEMENT_3D", "AXIS1_PLACEMENT"])?;
        let origin = self.point(record.reference(1)?)?;
        let mut direction = |at: usize| record.reference(at).ok().map(|id| self.direction(id)).transpose();
        let z = direction(2)?.unwrap_or([0.0, 0.0, 1.0]);
        let x = direction(3)?.unwrap_or([1.0, 0.0, 0.0]);
        Ok(Affine::from_axes(axes(x, z), origin))
    }

    /// CARTESIAN_TRANSFORMATION_OPERATOR_3D, or a system of axes.
    pub(super) fn map(&mut self, id: u64) -> Result<Affine, String> {
        let Ok(record) = self.record(id, &["CARTESIAN_TRANSFORMATION_OPERATOR_3D"]) else { return self.frame(id) };
        // Names and descriptions before them differ between editions; complex ones have the rest in a record of the supertype.
        let rest = match self.record(id, &["CARTESIAN_TRANSFORMATION_OPERATOR"]) {
            Ok(general) => general.values.into_iter().rev().take(4).rev().chain(record.values.into_iter().last()).collect(),
            Err(_) => record.values,
        };
        let from_end = |at: usize| rest.len().checked_sub(at).and_then(|at| rest.get(at));
        let reference = |at: usize| from_end(at).and_then(super::record::Value::reference);
        let origin = reference(3).ok_or_else(|| format!("#{id} has no origin"))?;
        let size = from_end(2).and_then(super::record::Value::number).unwrap_or(1.0);
        let origin = self.point(origin)?;
        let mut direction = |at: usize| reference(at).map(|id| self.direction(id)).transpose();
        let z = direction(1)?.unwrap_or([0.0, 0.0, 1.0]);
        let x = direction(5)?.unwrap_or([1.0, 0.0, 0.0]);
        let [x, y, z] = axes(x, z);
        let y = match direction(4)? {
            Some(told) if dot(told, y) < 0.0 => scale(y, -1.0),
            _ => y,
        };
        Ok(Affine::from_axes([x, y, z].map(|axis| scale(axis, size)), origin))
    }
}

/// Three axes at right angles: the third as given, the first as near to what is given as it can be.
fn axes(x: Point, z: Point) -> [Point; 3] {
    let level = |x: Point| sub(x, scale(z, dot(x, z)));
    let x = [x, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].into_iter().map(level).find(|x| norm(*x) > 1e-9).and_then(unit);
    let x = x.unwrap_or([1.0, 0.0, 0.0]);
    [x, cross(z, x), z]
}
