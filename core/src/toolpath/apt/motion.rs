//! Points and arcs.

use super::reader::{Reader, three};
use super::statement::{Statement, number};
use crate::toolpath::model::{Kind, Move};
use crate::toolpath::program::ReadError;
use crate::toolpath::vector::{Point, add, cross, dot, length, scale, sub, unit};
use std::f64::consts::TAU;

impl Reader<'_> {
    /// The numbers of a statement that has a point, three at least.
    pub(super) fn point_of(&self, statement: &Statement) -> Result<Vec<f64>, ReadError> {
        let numbers = statement.numbers();
        if numbers.len() < 3 {
            return self.refuse(format!("{} without three numbers (“{}”)", statement.word, statement.rest));
        }
        Ok(numbers)
    }

    /// A point in millimetres; its tool axis is set if it has one.
    fn point(&mut self, numbers: &[f64]) -> Point {
        if let Some(axis) = numbers.get(3..6) {
            self.set_axis(axis);
        }
        scale(three(numbers).unwrap_or_default(), self.unit)
    }

    /// `GOTO`.
    pub(super) fn goto(&mut self, numbers: &[f64]) -> Result<(), ReadError> {
        let to = self.point(numbers);
        if self.cycle.is_some() {
            return self.drill(to);
        }
        if let Some((centre, axis)) = self.circle.take() {
            return self.arc(to, centre, axis);
        }
        let is_rapid = std::mem::take(&mut self.is_rapid);
        self.go(to, is_rapid)
    }

    /// `GODLTA`: a way from here; one number is along the tool's axis.
    pub(super) fn godlta(&mut self, statement: &Statement) -> Result<(), ReadError> {
        let numbers = statement.numbers();
        let way = match (three(&numbers), numbers.as_slice()) {
            (Some(way), _) => scale(way, self.unit),
            (None, [along]) => scale(self.axis, along * self.unit),
            _ => return self.refuse(format!("GODLTA without one or three numbers (“{}”)", statement.rest)),
        };
        let is_rapid = std::mem::take(&mut self.is_rapid);
        self.go(add(self.position, way), is_rapid)
    }

    /// `FROM`: where the tool is.
    pub(super) fn from(&mut self, statement: &Statement) -> Result<(), ReadError> {
        let point = self.point(&self.point_of(statement)?);
        if self.emitter.counts != [0; 4] || self.is_known {
            // Moves go on from there; how the tool got there is not told.
            self.push(point, Kind::Reference)?;
        }
        self.position = point;
        self.is_known = true;
        Ok(())
    }

    /// `GOHOME`: where that is, only the machine knows.
    pub(super) fn home(&mut self) -> Result<(), ReadError> {
        self.push(self.position, Kind::Reference)?;
        self.is_known = false;
        Ok(())
    }

    /// A line.
    pub(super) fn go(&mut self, to: Point, is_rapid: bool) -> Result<(), ReadError> {
        let kind = match (is_rapid, self.is_known) {
            // The first point of a path without FROM is where it begins.
            (_, false) => Kind::Reference,
            (true, true) => Kind::Rapid,
            (false, true) => Kind::Feed,
        };
        self.push(to, kind)?;
        self.is_known = true;
        Ok(())
    }

    pub(super) fn push(&mut self, to: Point, kind: Kind) -> Result<(), ReadError> {
        let tool = self.tools.current(self.line, &mut self.findings);
        let line = self.line.min(u64::from(u32::MAX)) as u32;
        let one = Move { from: self.position, to, kind, axis: self.axis, tool, feed: self.feed, line };
        self.emitter.push(one, [0.0; 3])?;
        self.position = to;
        Ok(())
    }

    /// `CIRCLE` of Creo and NX, and `MOVARC`: centre, axis and radius; the next point ends the arc.
    pub(super) fn circle(&mut self, statement: &Statement) -> Result<(), ReadError> {
        let numbers = statement.numbers();
        let (Some(centre), Some(axis)) = (three(&numbers), numbers.get(3..6).and_then(three)) else {
            return self.refuse(format!("{} without a centre and an axis (“{}”)", statement.word, statement.rest));
        };
        let Some(axis) = unit(axis) else { return self.refuse("an arc whose axis has no direction") };
        let centre = scale(centre, self.unit);
        if let Some(degrees) = statement.behind(&["ANGLE", "DEGREE"]) {
            return self.turn(centre, axis, degrees.to_radians());
        }
        self.circle = Some((centre, axis));
        Ok(())
    }

    /// An arc by its angle.
    fn turn(&mut self, centre: Point, normal: Point, sweep: f64) -> Result<(), ReadError> {
        let spoke = sub(self.position, centre);
        let along = scale(normal, dot(spoke, normal));
        let flat = sub(spoke, along);
        let to = add(add(centre, along), add(scale(flat, sweep.cos()), scale(cross(normal, flat), sweep.sin())));
        self.push(to, Kind::Arc { centre, normal, sweep })
    }

    /// An arc to a point, counter-clockwise about its axis.
    fn arc(&mut self, to: Point, centre: Point, normal: Point) -> Result<(), ReadError> {
        self.is_rapid = false;
        let flat = |point: Point| {
            let spoke = sub(point, centre);
            sub(spoke, scale(normal, dot(spoke, normal)))
        };
        let [start, end] = [flat(self.position), flat(to)];
        let [inner, outer] = [length(start), length(end)];
        if inner == 0.0 || (inner - outer).abs() > (0.01 * inner.max(outer)).max(0.01) {
            return self.refuse(format!("an arc begins {inner:.4} mm and ends {outer:.4} mm from its axis"));
        }
        let angle = dot(normal, cross(start, end)).atan2(dot(start, end));
        let sweep = if angle.abs() < 1e-9 { TAU } else { angle.rem_euclid(TAU) };
        self.push(to, Kind::Arc { centre, normal, sweep })
    }

    /// `TLON, GOFWD/ (CIRCLE/ centre, radius), ON, (LINE/ centre, end)` of CATIA, the way told by `INDIRV`.
    pub(super) fn forward(&mut self, statement: &Statement) -> Result<(), ReadError> {
        let numbers: Vec<f64> = statement.rest.split(['/', ',', '(', ')']).filter_map(|text| number(text.trim())).collect();
        let is_arc =
            statement.rest.to_ascii_uppercase().contains("CIRCLE") && statement.rest.to_ascii_uppercase().contains("LINE");
        // A number of an intersection may stand between the circle and the line.
        let last = numbers.len().checked_sub(3).filter(|last| *last >= 7);
        let (Some(centre), Some(to)) = (three(&numbers), last.and_then(|last| three(numbers.get(last..)?))) else {
            return self.refuse(format!("{} along anything other than a circle is not done", statement.word));
        };
        let Some(direction) = self.direction.take().filter(|_| is_arc) else {
            return self.refuse(format!("{} along a circle without INDIRV before it", statement.word));
        };
        let (centre, to) = (scale(centre, self.unit), scale(to, self.unit));
        let spoke = sub(self.position, centre);
        // About the tool's axis, or about the one that the way and the spoke span.
        let normal = unit(cross(spoke, direction)).unwrap_or(self.axis);
        let normal =
            if dot(normal, self.axis).abs() > 0.999 { scale(self.axis, dot(normal, self.axis).signum()) } else { normal };
        self.arc(to, centre, normal)
    }
}
