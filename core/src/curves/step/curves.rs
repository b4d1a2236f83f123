//! Curves of geometry.

use std::rc::Rc;

use super::builder::{Builder, DEEPEST, Place};
use super::record::{Record, Value};
use super::splines;
use crate::curves::curve::{Arc, Curve, Id, Shape, Source, Spline};
use crate::curves::network::Use;
use crate::curves::vector::{Affine, Point, add, scale};

/// A curve that may go on for ever.
#[derive(Clone, Debug)]
pub(super) enum Basis {
    Bounded(Shape),
    /// Of a point and a direction with its length.
    Line(Point, Point),
    /// Of its axes and the distance of its focus.
    Parabola(Affine, f64),
    /// Of its axes and both radii.
    Hyperbola(Affine, f64, f64),
}

/// Entities that stand for their curve in space.
const ON_SURFACES: [&str; 4] = ["SURFACE_CURVE", "SEAM_CURVE", "INTERSECTION_CURVE", "BOUNDED_SURFACE_CURVE"];
/// Entities that are curves one behind the other.
pub(super) const COMPOSITES: [&str; 4] =
    ["COMPOSITE_CURVE", "BOUNDARY_CURVE", "OUTER_BOUNDARY_CURVE", "COMPOSITE_CURVE_ON_SURFACE"];
/// Other entities that are curves.
const CURVES: [&str; 11] = [
    "LINE",
    "CIRCLE",
    "ELLIPSE",
    "PARABOLA",
    "HYPERBOLA",
    "POLYLINE",
    "TRIMMED_CURVE",
    "CURVE_REPLICA",
    "PCURVE",
    "OFFSET_CURVE_3D",
    "DEGENERATE_PCURVE",
];

/// Whether records are those of a curve.
pub(super) fn is_curve(records: &[Record<'_>]) -> bool {
    let names = [&CURVES[..], &COMPOSITES, &ON_SURFACES, &splines::NAMES];
    records.iter().any(|record| names.iter().any(|names| names.iter().any(|name| record.name.is(name))))
}

/// A part of a hyperbola or a parabola between two parameters, exact: its middle point is where the tangents at both ends meet.
fn bent([start, top, end]: [Point; 3], weight: f64) -> Result<Shape, String> {
    let knots = vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
    let spline = Spline::new(2, knots, vec![start, top, end], Some(vec![1.0, weight, 1.0]), None);
    spline.map(Shape::Conic).map_err(|error| error.to_string())
}

impl Basis {
    /// The point at a parameter as the standard counts it, angles in radians.
    pub(super) fn point(&self, t: f64) -> Point {
        match self {
            Self::Bounded(shape) => shape.point(t),
            Self::Line(point, vector) => add(*point, scale(*vector, t)),
            Self::Parabola(axes, focus) => axes.point([focus * t * t, 2.0 * focus * t, 0.0]),
            Self::Hyperbola(axes, a, b) => axes.point([a * t.cosh(), b * t.sinh(), 0.0]),
        }
    }

    /// The parameter of the nearest point.
    pub(super) fn parameter(&self, point: Point) -> f64 {
        let local = |axes: &Affine| axes.inverse().map_or([0.0; 3], |inverse| inverse.point(point));
        match self {
            Self::Bounded(shape) => shape.nearest(point),
            Self::Line(start, vector) => {
                let offset = crate::curves::vector::sub(point, *start);
                crate::curves::vector::dot(offset, *vector) / crate::curves::vector::dot(*vector, *vector)
            }
            Self::Parabola(axes, focus) => local(axes)[1] / (2.0 * focus),
            Self::Hyperbola(axes, _, b) => (local(axes)[1] / b).asinh(),
        }
    }

    /// From one parameter to another; `gap` is how far ends of a closed curve may be apart.
    pub(super) fn between(self, [from, to]: [f64; 2], gap: f64) -> Result<Shape, String> {
        let ends = [from, to].map(|t| self.point(t));
        let [start, end] = ends;
        match self {
            Self::Bounded(shape) => shape.onward([from, to], gap).map_err(|error| error.to_string()),
            Self::Line(..) if start == end => Err("a line without length".into()),
            Self::Line(..) => Ok(Shape::Line(ends)),
            Self::Parabola(axes, focus) => bent([start, axes.point([focus * from * to, focus * (from + to), 0.0]), end], 1.0),
            Self::Hyperbola(axes, a, b) => {
                let (middle, weight) = (0.5 * (from + to), (0.5 * (to - from)).cosh());
                let top = axes.point([a * middle.cosh() / weight, b * middle.sinh() / weight, 0.0]);
                bent([start, top, end], weight)
            }
        }
    }
}

impl<'a> Builder<'a> {
    /// Curves that an instance is made of, one behind the other; nothing if it has none in space, which is noted.
    pub(super) fn uses(&mut self, id: u64, place: Place, depth: usize) -> Option<Rc<[Use]>> {
        if let Some(known) = self.known.get(&(id, place)) {
            return Some(Rc::clone(known));
        }
        let uses = match self.records(id) {
            Ok(records) => match records.iter().find(|record| COMPOSITES.iter().any(|name| record.name.is(name))) {
                Some(record) => self.composite(id, record, place, depth),
                None => self.single(id, place).map(|one| vec![one]),
            },
            Err(why) => {
                self.note(id, "damaged and not read", &why);
                None
            }
        };
        let uses: Rc<[Use]> = uses?.into();
        self.known.insert((id, place), Rc::clone(&uses));
        Some(uses)
    }

    /// Segments, each in its direction; those that are damaged are left out.
    fn composite(&mut self, id: u64, record: &Record<'_>, place: Place, depth: usize) -> Option<Vec<Use>> {
        if depth > DEEPEST || self.open.contains(&id) {
            self.note(id, "composites are more than 32 within each other, or one within itself", "");
            return None;
        }
        self.open.push(id);
        let uses = self.segments(id, record, place, depth);
        self.open.pop();
        uses
    }

    fn segments(&mut self, id: u64, record: &Record<'_>, place: Place, depth: usize) -> Option<Vec<Use>> {
        // On its own, its name comes first.
        let at = record.values.iter().position(|value| value.list().is_some()).unwrap_or(1);
        let segments = match record.references(at) {
            Ok(segments) => segments,
            Err(why) => {
                self.note(id, "damaged and not read", &why);
                return None;
            }
        };
        self.done.insert(id);
        let mut uses = Vec::new();
        for segment in segments {
            let read = self.record(segment, &["COMPOSITE_CURVE_SEGMENT", "REPARAMETRISED_COMPOSITE_CURVE_SEGMENT"]);
            match read.and_then(|record| Ok((record.truth(1)?, record.reference(2)?))) {
                Ok((is_same, parent)) => {
                    let found = self.uses(parent, place, depth + 1);
                    directed(&mut uses, found.as_deref().unwrap_or_default(), !is_same);
                }
                Err(why) => self.note(segment, "damaged and not read", &why),
            }
        }
        Some(uses)
    }

    fn single(&mut self, id: u64, place: Place) -> Option<Use> {
        match self.bounded(id) {
            Ok(Some(shape)) => self.push(id, shape, place, None).map(|curve| Use { curve, is_reversed: false }),
            Ok(None) => None,
            Err(why) => {
                self.note(id, "damaged and not read", &why);
                None
            }
        }
    }

    /// Adds a curve with the source and name of an instance.
    pub(super) fn push(&mut self, id: u64, shape: Shape, place: Place, vertices: Option<[u64; 2]>) -> Option<usize> {
        self.done.insert(id);
        let shape = shape.transformed(&self.map_of(place));
        let source = Source { id: Id::Instance(id), line: self.line(id) };
        let (name, role, is_blanked) = (self.name(id), self.role, self.blanked.contains(&id));
        self.collector.push(Curve { shape, source, name, role, is_blanked, vertices })
    }

    /// The shape of a curve that has ends; nothing of one that is only in the space of parameters or not read, which is noted.
    fn bounded(&mut self, id: u64) -> Result<Option<Shape>, String> {
        match self.basis(id, 0)? {
            Some(Basis::Bounded(shape)) => Ok(Some(shape)),
            Some(Basis::Line(point, vector)) => {
                self.note(id, "a line without ends, which its vector gives it", "");
                Ok(Some(Shape::Line([point, add(point, vector)])))
            }
            Some(_) => {
                self.note_unread(id, "curve without ends");
                Ok(None)
            }
            None => Ok(None),
        }
    }

    /// Any curve.
    pub(super) fn basis(&mut self, id: u64, depth: usize) -> Result<Option<Basis>, String> {
        if depth > DEEPEST {
            return Err("curves are more than 32 within each other, or one within itself".into());
        }
        let records = self.records(id)?;
        let find = |names: &[&str]| records.iter().find(|record| names.iter().any(|name| record.name.is(name)));
        if find(&splines::NAMES).is_some() {
            let spline = self.spline(&records).map_err(|why| format!("#{id}: {why}"))?;
            return Ok(Some(Basis::Bounded(Shape::Spline(spline))));
        }
        if let Some(record) = find(&COMPOSITES) {
            return self.joined(record, depth);
        }
        // Records of complex instances lack the name that a simple one begins with.
        let named = |record: &Record<'a>| {
            let mut record = record.clone();
            if records.len() > 1 {
                record.values.insert(0, Value::Nothing);
            }
            record
        };
        if let Some(record) = find(&ON_SURFACES).map(named) {
            return self.basis(record.reference(1)?, depth + 1);
        }
        let Some(record) = find(&CURVES).map(named) else { return Err(format!("#{id} is no curve")) };
        self.elementary(id, &record, depth)
    }

    /// A curve of one record.
    fn elementary(&mut self, id: u64, record: &Record<'a>, depth: usize) -> Result<Option<Basis>, String> {
        let basis = match record.name.to_string().as_str() {
            "LINE" => Basis::Line(self.point(record.reference(1)?)?, self.vector(record.reference(2)?)?),
            "CIRCLE" | "ELLIPSE" => Basis::Bounded(Shape::Arc(self.ellipse(record)?)),
            "PARABOLA" => Basis::Parabola(self.frame(record.reference(1)?)?, record.number(2)?),
            "HYPERBOLA" => Basis::Hyperbola(self.frame(record.reference(1)?)?, record.number(2)?, record.number(3)?),
            "POLYLINE" => {
                let mut points = Vec::new();
                for point in record.references(1)? {
                    points.push(self.point(point)?);
                }
                Basis::Bounded(Shape::polyline(points).map_err(|error| error.to_string())?)
            }
            "TRIMMED_CURVE" => return Ok(self.trimmed(record, depth)?.map(Basis::Bounded)),
            "CURVE_REPLICA" => {
                let map = self.map(record.reference(2)?)?;
                let Some(Basis::Bounded(shape)) = self.basis(record.reference(1)?, depth + 1)? else { return Ok(None) };
                Basis::Bounded(shape.transformed(&map))
            }
            "OFFSET_CURVE_3D" => return self.offset(id, record, depth),
            "PCURVE" if !self.is_flat => return self.pcurve(id, record, depth),
            "PCURVE" | "DEGENERATE_PCURVE" => {
                self.note_unread(id, "curve in the space of parameters of a surface");
                return Ok(None);
            }
            name => {
                self.note_unread(id, name);
                return Ok(None);
            }
        };
        Ok(Some(basis))
    }

    /// A whole circle or ellipse, from the first axis on.
    fn ellipse(&mut self, record: &Record<'_>) -> Result<Arc, String> {
        let frame = self.frame(record.reference(1)?)?;
        let a = record.number(2)?;
        let b = if record.name.is("ELLIPSE") { record.number(3)? } else { a };
        let axes = [frame.vector([a, 0.0, 0.0]), frame.vector([0.0, b, 0.0])];
        Arc::new(frame.shift, axes, [0.0, 0.0]).map_err(|error| error.to_string())
    }

    /// A composite as one curve, for what is trimmed from it.
    fn joined(&mut self, record: &Record<'_>, depth: usize) -> Result<Option<Basis>, String> {
        let at = record.values.iter().position(|value| value.list().is_some()).unwrap_or(1);
        let mut parts = Vec::new();
        for segment in record.references(at)? {
            let segment = self.record(segment, &["COMPOSITE_CURVE_SEGMENT", "REPARAMETRISED_COMPOSITE_CURVE_SEGMENT"])?;
            match self.basis(segment.reference(2)?, depth + 1)? {
                Some(Basis::Bounded(shape)) => parts.push(if segment.truth(1)? { shape } else { shape.reversed() }),
                _ => return Ok(None),
            }
        }
        Shape::composite(parts).map(|shape| Some(Basis::Bounded(shape))).map_err(|error| error.to_string())
    }
}

/// Adds curves in their direction, or all the other way.
pub(super) fn directed(uses: &mut Vec<Use>, found: &[Use], is_reversed: bool) {
    if is_reversed {
        uses.extend(found.iter().rev().map(|one| Use { is_reversed: !one.is_reversed, ..*one }));
    } else {
        uses.extend(found);
    }
}
