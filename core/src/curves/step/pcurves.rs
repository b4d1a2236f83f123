//! Curves in the space of parameters of a surface, where there is no other one.

use super::builder::Builder;
use super::curves::Basis;
use super::record::Record;
use super::surfaces::{Carried, counted};
use crate::curves::carrier::Carrier;
use crate::curves::curve::Shape;
use crate::curves::vector::{Affine, Point, sub};

impl<'a> Builder<'a> {
    /// PCURVE: surface, and a representation whose item is a curve of two dimensions. The curve in space, exact or fitted, which
    /// is noted.
    pub(super) fn pcurve(&mut self, id: u64, record: &Record<'a>, depth: usize) -> Result<Option<Basis>, String> {
        self.collector.may_fit()?;
        let carried = self.carried(record.reference(1)?, depth + 1)?;
        let flat = self.flat(record.reference(2)?, depth)?;
        let Some(flat) = flat else { return Ok(None) };
        let shape = match (&carried.carrier, flat) {
            (Carrier::Plane(axes), flat) => return Ok(Some(on_plane(axes, flat))),
            (_, Basis::Bounded(shape)) => shape,
            (_, Basis::Line(point, vector)) => match endless(&carried, point, vector) {
                Some(Endless::Bounded(shape)) => shape,
                Some(Endless::Line(basis)) => return Ok(Some(basis)),
                None => {
                    self.note_unread(id, "PCURVE without ends");
                    return Ok(None);
                }
            },
            _ => {
                self.note_unread(id, "PCURVE without ends");
                return Ok(None);
            }
        };
        self.composed(id, &carried, shape)
    }

    fn composed(&mut self, id: u64, carried: &Carried, shape: Shape) -> Result<Option<Basis>, String> {
        let flat = counted(carried.units, shape);
        let tolerance = self.fitting(carried.carrier.size(&flat));
        let lifted = carried.carrier.lift(&flat, tolerance).map_err(|error| error.to_string())?;
        if lifted.shapes.is_empty() {
            self.note_unread(id, "PCURVE that is a point in space");
            return Ok(None);
        }
        let shape = Shape::composite(lifted.shapes).map_err(|error| error.to_string())?;
        if let Some(off) = lifted.off {
            self.collector.count_fit(&shape)?;
            let text = format!("within {off:.1e}, {tolerance:.1e} were wanted");
            self.note(id, "a curve that is given in the space of parameters alone is fitted", &text);
        }
        Ok(Some(Basis::Bounded(shape)))
    }

    /// The curve of two dimensions of a representation.
    fn flat(&mut self, id: u64, depth: usize) -> Result<Option<Basis>, String> {
        // Complex instances have name and items in the record of the supertype.
        let record = self.record(id, &["REPRESENTATION"]).or_else(|_| self.record(id, &["DEFINITIONAL_REPRESENTATION"]))?;
        let items = record.references(1)?;
        let &[curve] = items.as_slice() else { return Err(format!("#{id} has {} items", items.len())) };
        // Its own parameters are angles of the file's unit only where they are angles of a circle; coordinates are scaled later.
        let before = std::mem::replace(&mut self.is_flat, true);
        let basis = self.basis(curve, depth + 1);
        self.is_flat = before;
        basis
    }
}

/// A curve without ends by another one.
enum Endless {
    Bounded(Shape),
    Line(Basis),
}

/// The line of parameters without ends, where its curve in space is one that is known: all of a circle, a line without ends, or
/// what a B-spline surface has of it.
fn endless(carried: &Carried, [u, v, _]: Point, [du, dv, _]: Point) -> Option<Endless> {
    let turn = |unit: f64| std::f64::consts::TAU / unit;
    let ([unit_u, unit_v], along_u, along_v) = (carried.units, dv == 0.0, du == 0.0);
    let line = |to: [f64; 2]| Some(Endless::Bounded(Shape::Line([[u, v, 0.0], [to[0], to[1], 0.0]])));
    match &carried.carrier {
        Carrier::Cylinder(..) | Carrier::Cone(..) | Carrier::Sphere(..) | Carrier::Torus(..) | Carrier::Turned(..) if along_u => {
            line([u + turn(unit_u).copysign(du), v])
        }
        Carrier::Sphere(..) | Carrier::Torus(..) if along_v => line([u, v + turn(unit_v).copysign(dv)]),
        Carrier::Cylinder(..) | Carrier::Cone(..) | Carrier::Drawn(..) if along_v => {
            let at = |v: f64| carried.carrier.point(u * unit_u, v);
            let (start, next) = (at(v), at(v + dv));
            Some(Endless::Line(Basis::Line(start, sub(next, start))))
        }
        Carrier::Tensor(tensor) => {
            let [[u0, u1], [v0, v1]] = tensor.domain();
            // From where the line comes into the domain to where it leaves it.
            let (mut from, mut to) = (f64::NEG_INFINITY, f64::INFINITY);
            for (start, step, low, high) in [(u, du, u0, u1), (v, dv, v0, v1)] {
                if step != 0.0 {
                    let ends = [(low - start) / step, (high - start) / step];
                    from = from.max(ends[0].min(ends[1]));
                    to = to.min(ends[0].max(ends[1]));
                }
            }
            let at = |t: f64| [(u + du * t).clamp(u0, u1), (v + dv * t).clamp(v0, v1), 0.0];
            (from < to && (to - from).is_finite()).then(|| Endless::Bounded(Shape::Line([at(from), at(to)])))
        }
        _ => None,
    }
}

/// On a plane, every curve has one of the same kind.
fn on_plane(axes: &Affine, flat: Basis) -> Basis {
    match flat {
        Basis::Bounded(shape) => Basis::Bounded(shape.transformed(axes)),
        Basis::Line(point, vector) => Basis::Line(axes.point(point), axes.vector(vector)),
        Basis::Parabola(own, focus) => Basis::Parabola(axes.after(&own), focus),
        Basis::Hyperbola(own, a, b) => Basis::Hyperbola(axes.after(&own), a, b),
    }
}
