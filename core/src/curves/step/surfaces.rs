//! Surfaces by their parameters (ISO 10303-42, section 4), as far as they carry curves.

use super::builder::{Builder, DEEPEST};
use super::curves::Basis;
use super::record::{Record, Value};
use super::splines;
use crate::curves::carrier::{Carrier, Tensor};
use crate::curves::curve::{HIGHEST_DEGREE, Shape};
use crate::curves::vector::{Affine, Point, scale};

/// A surface, and how much its parameters grow when those of the file grow by 1: angles are in the file's unit.
pub(super) struct Carried {
    pub(super) carrier: Carrier,
    pub(super) units: [f64; 2],
}

/// Entities that are B-spline surfaces, alone or with others.
const SPLINES: [&str; 5] =
    ["B_SPLINE_SURFACE_WITH_KNOTS", "BEZIER_SURFACE", "UNIFORM_SURFACE", "QUASI_UNIFORM_SURFACE", "B_SPLINE_SURFACE"];

impl<'a> Builder<'a> {
    /// A surface of an instance.
    pub(super) fn carried(&mut self, id: u64, depth: usize) -> Result<Carried, String> {
        if depth > DEEPEST {
            return Err("surfaces are more than 32 within each other, or one within itself".into());
        }
        let records = self.records(id)?;
        if records.iter().any(|record| SPLINES.iter().any(|name| record.name.is(name))) {
            let tensor = self.tensor(&records).map_err(|why| format!("#{id}: {why}"))?;
            return Ok(Carried { carrier: tensor.into(), units: [1.0; 2] });
        }
        let Some(record) = records.first() else { return Err(format!("#{id} is no surface")) };
        let (angle, one) = (self.angle, 1.0);
        let (carrier, units) = match record.name.to_string().as_str() {
            "PLANE" => (Carrier::Plane(self.frame(record.reference(1)?)?), [one, one]),
            "CYLINDRICAL_SURFACE" => (Carrier::Cylinder(self.frame(record.reference(1)?)?, record.number(2)?), [angle, one]),
            "CONICAL_SURFACE" => {
                let growth = (record.number(3)? * angle).tan();
                (Carrier::Cone(self.frame(record.reference(1)?)?, [record.number(2)?, growth]), [angle, one])
            }
            "SPHERICAL_SURFACE" => (Carrier::Sphere(self.frame(record.reference(1)?)?, record.number(2)?), [angle, angle]),
            "TOROIDAL_SURFACE" | "DEGENERATE_TOROIDAL_SURFACE" => {
                let radii = [record.number(2)?, record.number(3)?];
                (Carrier::Torus(self.frame(record.reference(1)?)?, radii), [angle, angle])
            }
            "SURFACE_OF_LINEAR_EXTRUSION" => {
                let vector = self.vector(record.reference(2)?)?;
                match self.profile(record.reference(1)?, depth)? {
                    (Basis::Line(point, along), _) => {
                        (Carrier::Plane(Affine::from_axes([along, vector, [0.0; 3]], point)), [one, one])
                    }
                    (Basis::Bounded(shape), unit) => (Carrier::Drawn(shape, vector), [unit, one]),
                    _ => return Err(format!("#{id} is drawn from a curve without ends")),
                }
            }
            "SURFACE_OF_REVOLUTION" => {
                let axes = self.frame(record.reference(2)?)?;
                let inverse = axes.inverse().ok_or("axes that are flat")?;
                match self.profile(record.reference(1)?, depth)? {
                    (Basis::Bounded(shape), unit) => (Carrier::Turned(axes, shape.transformed(&inverse)), [angle, unit]),
                    _ => return Err(format!("#{id} is turned from a curve without ends")),
                }
            }
            name => return Err(format!("its surface is a {name}")),
        };
        Ok(Carried { carrier, units })
    }

    /// The curve that makes a surface, and how much its parameter grows when that of the file does.
    fn profile(&mut self, id: u64, depth: usize) -> Result<(Basis, f64), String> {
        let basis = self.basis(id, depth + 1)?.ok_or("its surface is made of a curve that is not read")?;
        match basis {
            Basis::Bounded(shape @ Shape::Arc(_)) => Ok((Basis::Bounded(shape), self.angle)),
            Basis::Bounded(Shape::Line(ends)) => {
                // The parameter of a part of a line is the line's own, which is that of a line without ends.
                let line = self.record(id, &["TRIMMED_CURVE"]).and_then(|trimmed| self.basis_of(&trimmed, depth));
                Ok((line.unwrap_or(Basis::Bounded(Shape::Line(ends))), 1.0))
            }
            other => Ok((other, 1.0)),
        }
    }

    fn basis_of(&mut self, trimmed: &Record<'a>, depth: usize) -> Result<Basis, String> {
        self.basis(trimmed.reference(1)?, depth + 1)?.ok_or_else(|| "a curve that is not read".into())
    }

    /// A B-spline surface by its records.
    fn tensor(&mut self, records: &[Record<'_>]) -> Result<Tensor, String> {
        let find = |name: &str| records.iter().find(|record| record.name.is(name));
        // On its own, everything stands in one record behind a name.
        let (base, offset) = match (records, find("B_SPLINE_SURFACE")) {
            ([single], _) => (single, 1),
            (_, Some(base)) => (base, 0),
            _ => return Err("a B-spline surface without degrees and points".into()),
        };
        let mut degrees = [0; 2];
        for (at, degree) in degrees.iter_mut().enumerate() {
            let told = base.number(offset + at)?;
            if told.fract() != 0.0 || !(1.0..=HIGHEST_DEGREE as f64).contains(&told) {
                return Err(format!("a B-spline surface of degree {told}"));
            }
            *degree = told as usize;
        }
        let weights =
            find("RATIONAL_B_SPLINE_SURFACE").map(|record| record.list(record.values.len().saturating_sub(1))).transpose()?;
        let mut rows: Vec<Vec<(Point, f64)>> = Vec::new();
        for (number, row) in base.list(offset + 2)?.iter().enumerate() {
            let ids = row.list().ok_or("control points that are no rows")?;
            let own =
                weights.map(|weights| weights.get(number).and_then(Value::list).ok_or("weights that are no rows")).transpose()?;
            let mut points = Vec::with_capacity(ids.len());
            for (at, id) in ids.iter().enumerate() {
                let weight = own.map_or(Some(1.0), |own| own.get(at).and_then(Value::number));
                let point = self.point(id.reference().ok_or("a control point that is none")?)?;
                points.push((point, weight.ok_or("weights are missing")?));
            }
            rows.push(points);
        }
        let counts = [rows.len(), rows.first().map_or(0, Vec::len)];
        let mut knots = [Vec::new(), Vec::new()];
        for (along, ((knots, count), degree)) in knots.iter_mut().zip(counts).zip(degrees).enumerate() {
            *knots = if let Some(record) = find("B_SPLINE_SURFACE_WITH_KNOTS") {
                let at = along + if records.len() == 1 { 8 } else { 0 };
                splines::repeated(&record.numbers(at)?, &record.numbers(at + 2)?, count + degree + 1)?
            } else if find("UNIFORM_SURFACE").is_some() {
                (0..count + degree + 1).map(|number| number as f64 - degree as f64).collect()
            } else if find("BEZIER_SURFACE").is_some() {
                splines::bezier(count, degree)?
            } else {
                splines::quasi_uniform(count, degree)
            };
        }
        Tensor::new(degrees, knots, rows).map_err(|error| error.to_string())
    }
}

/// A shape of parameters, counted as the carrier does.
pub(super) fn counted(units: [f64; 2], shape: Shape) -> Shape {
    let [u, v] = units;
    let axes = [scale([1.0, 0.0, 0.0], u), scale([0.0, 1.0, 0.0], v), [0.0, 0.0, 1.0]];
    shape.transformed(&Affine::from_axes(axes, [0.0; 3]))
}
