//! Edges: the part of a curve between two vertices.

use super::builder::{Builder, DEEPEST, Place};
use super::curves::Basis;
use crate::curves::curve::Shape;
use crate::curves::network::Use;
use crate::curves::vector::{Point, distance};

impl Builder<'_> {
    /// EDGE_CURVE, ORIENTED_EDGE: a curve between vertices, in which direction.
    pub(super) fn edge(&mut self, id: u64, place: Place) -> Option<Use> {
        let (mut id, mut is_reversed) = (id, false);
        for _ in 0..DEEPEST {
            let names = ["ORIENTED_EDGE", "EDGE_CURVE", "SUBEDGE"];
            match self.record(id, &names).and_then(|record| {
                let is_oriented = record.name.is("ORIENTED_EDGE");
                if is_oriented { Ok(Some((record.reference(3)?, record.truth(4)?))) } else { Ok(None) }
            }) {
                Ok(Some((inner, is_same))) => {
                    id = inner;
                    is_reversed ^= !is_same;
                }
                Ok(None) => return self.edge_curve(id, place).map(|curve| Use { curve, is_reversed }),
                Err(why) => {
                    self.note(id, "damaged and not read", &why);
                    return None;
                }
            }
        }
        self.note(id, "an edge that is made of itself", "");
        None
    }

    fn edge_curve(&mut self, id: u64, place: Place) -> Option<usize> {
        if let Some(known) = self.known.get(&(id, place)) {
            return known.first().map(|one| one.curve);
        }
        let read = self.edge_shape(id);
        let (shape, ends) = match read {
            Ok(Some(read)) => read,
            Ok(None) => {
                self.done.insert(id);
                return None;
            }
            Err(why) => {
                if self.done.insert(id) {
                    self.note(id, "damaged and not read", &why);
                }
                return None;
            }
        };
        let vertices = ends.map(|vertex| self.vertex(vertex, place));
        let curve = self.push(id, shape, place, Some(vertices))?;
        let uses = [Use { curve, is_reversed: false }];
        self.known.insert((id, place), uses.into());
        Some(curve)
    }

    /// The number of a vertex where it is placed.
    fn vertex(&mut self, id: u64, place: Place) -> u64 {
        let next = self.vertices.len() as u64;
        *self.vertices.entry((id, place)).or_insert(next)
    }

    fn edge_shape(&mut self, id: u64) -> Result<Option<(Shape, [u64; 2])>, String> {
        let record = self.record(id, &["EDGE_CURVE"])?;
        let ends = [record.reference(1)?, record.reference(2)?];
        let mut points = [[0.0; 3]; 2];
        for (point, end) in points.iter_mut().zip(ends) {
            let vertex = self.record(end, &["VERTEX_POINT"])?;
            *point = self.point(vertex.reference(1)?)?;
        }
        let Some(basis) = self.basis(record.reference(3)?, 0)? else { return Ok(None) };
        let is_same = record.truth(4)?;
        let is_closed = ends[0] == ends[1];
        let shape = match basis {
            Basis::Bounded(shape) => self.between(id, if is_same { shape } else { shape.reversed() }, points, is_closed)?,
            Basis::Line(..) if is_closed => return Err("a line from a vertex to itself".into()),
            Basis::Line(..) => Shape::Line(points),
            open => {
                let parameters = points.map(|point| open.parameter(point));
                open.between(parameters, 0.0)?
            }
        };
        Ok(Some((shape, ends)))
    }

    /// The part of a curve from one point to another; all of it, if it ends there.
    fn between(&mut self, id: u64, shape: Shape, [from, to]: [Point; 2], is_closed: bool) -> Result<Shape, String> {
        let [start, end] = shape.ends();
        let basis = Basis::Bounded(shape);
        let slack = self.slack(&basis, [0.0, 1.0]);
        let Basis::Bounded(shape) = basis else { return Err("a curve without ends".into()) };
        let near = |a: Point, b: Point| distance(a, b) <= slack;
        // A curve that is closed, and an edge that begins and ends where it does.
        if near(from, start) && near(to, end) && (is_closed || !near(start, end) || near(from, to)) {
            return Ok(shape);
        }
        if near(from, end) && near(to, start) && !near(start, end) {
            self.note(id, "an edge runs against the direction that it tells", "");
            return Ok(shape.reversed());
        }
        let parameters = [from, to].map(|point| shape.nearest(point));
        let off = parameters.into_iter().zip([from, to]).map(|(t, point)| distance(shape.point(t), point)).fold(0.0, f64::max);
        if off > 1e3 * slack {
            self.note(id, "vertices of an edge are off its curve", &format!("by {off:.3e}"));
        }
        // Both vertices at the joint: the first is its beginning, the second its end.
        let [low, high] = shape.domain();
        let to = if !is_closed && near(to, start) && near(start, end) { high } else { parameters[1] };
        let from = if near(from, start) && near(start, end) { low } else { parameters[0] };
        let ends = if is_closed { [from, from] } else { [from, to] };
        match shape.clone().onward(ends, slack) {
            Ok(part) => Ok(part),
            Err(error) => {
                self.note(id, "an edge is read with its whole curve", &error.to_string());
                Ok(shape)
            }
        }
    }
}
