//! Curves beside other curves.

use super::builder::Builder;
use super::curves::Basis;
use super::record::Record;
use crate::curves::curve::{Away, Offset, Shape, Spline};
use crate::curves::vector::{add, cross, distance, scale, unit};

impl<'a> Builder<'a> {
    /// OFFSET_CURVE_3D: curve, distance, whether it crosses itself, normal.
    pub(super) fn offset(&mut self, id: u64, record: &Record<'a>, depth: usize) -> Result<Option<Basis>, String> {
        let Some(basis) = self.basis(record.reference(1)?, depth + 1)? else { return Ok(None) };
        let (away, normal) = (record.number(2)?, self.direction(record.reference(4)?)?);
        match basis {
            Basis::Bounded(shape) => {
                let offset = Offset { normal, away: Away::Constant(away), by_length: false, between: None };
                let [low, high] = shape.bounds();
                let tolerance = self.fitting(distance(low, high));
                self.collector.may_fit()?;
                let is_arc = matches!(shape, Shape::Arc(_));
                let (mut shape, off) = offset.of(&shape, tolerance).map_err(|error| error.to_string())?;
                if let (Shape::Spline(spline), true) = (&shape, is_arc) {
                    shape = Shape::Spline(self.in_angles(spline)?);
                }
                if let Some(off) = off {
                    self.collector.count_fit(&shape)?;
                    let text = format!("within {off:.1e}, {tolerance:.1e} were wanted");
                    self.note(id, "a curve beside another one is fitted", &text);
                }
                Ok(Some(Basis::Bounded(shape)))
            }
            Basis::Line(point, vector) => {
                let across = unit(cross(normal, vector)).ok_or("an offset along its normal")?;
                Ok(Some(Basis::Line(add(point, scale(across, away)), vector)))
            }
            // Without ends, what is beside a parabola or a hyperbola cannot be fitted.
            _ => {
                self.note_unread(id, "OFFSET_CURVE_3D of a curve without ends");
                Ok(None)
            }
        }
    }

    /// A curve whose parameter is an angle, counted in the file's unit, as what is trimmed from it is.
    fn in_angles(&self, spline: &Spline) -> Result<Spline, String> {
        let knots = spline.knots().iter().map(|knot| knot / self.angle).collect();
        let weights = spline.weights().map(<[f64]>::to_vec);
        Spline::new(spline.degree(), knots, spline.points().to_vec(), weights, None).map_err(|error| error.to_string())
    }

    /// How far what is fitted may be off: the file's uncertainty, or 10⁻⁶ of the size.
    pub(super) fn fitting(&self, size: f64) -> f64 {
        let told = Some(self.uncertainty).filter(|uncertainty| *uncertainty > 0.0);
        told.unwrap_or(1e-6 * size).clamp(1e-9 * size, (1e-4 * size).max(1e-9 * size))
    }
}
