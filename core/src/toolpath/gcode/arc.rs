//! Arcs and helices (NISTIR 6556, section 3.5.3).

use super::block::Block;
use super::fault::{Fault, refused};
use super::interpreter::Interpreter;
use crate::toolpath::model::Kind;
use crate::toolpath::vector::{Point, sub};
use std::f64::consts::TAU;

/// Angles below it, in radians, are a full circle: what is left of rounding.
const NO_ANGLE: f64 = 1e-9;

/// An arc of the program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Arc {
    pub(super) to: Point,
    pub(super) centre: Point,
    /// About the normal of the plane, in radians.
    pub(super) sweep: f64,
}

impl Interpreter<'_> {
    pub(super) fn arc(&mut self, block: &Block, is_clockwise: bool) -> Result<(), Fault> {
        let to = self.target(block)?;
        let centre = if block.has_any(b"r") {
            self.centre_by_radius(block, to, is_clockwise)?
        } else if block.has_any(b"ijk") {
            self.centre(block, to)?
        } else {
            return refused("an arc without a centre or a radius");
        };
        self.cut(block);
        let turns = block.get(b'p').map_or(1.0, f64::round);
        if !(1.0..=1e6).contains(&turns) {
            return refused(format!("an arc of {turns} turns is not done"));
        }
        let sweep = self.sweep(to, centre, is_clockwise);
        let sweep = sweep + (turns - 1.0) * TAU * sweep.signum();
        self.arc_to(Arc { to, centre, sweep })
    }

    /// The angle from here to a point.
    fn sweep(&self, to: Point, centre: Point, is_clockwise: bool) -> f64 {
        let [a, b, _] = self.machine.modes.plane.axes();
        let [start, end] = [sub(self.machine.position, centre), sub(to, centre)];
        let angle = (start[a] * end[b] - start[b] * end[a]).atan2(start[a] * end[a] + start[b] * end[b]);
        if angle.abs() < NO_ANGLE {
            return if is_clockwise { -TAU } else { TAU };
        }
        match is_clockwise {
            true if angle > 0.0 => angle - TAU,
            false if angle < 0.0 => angle + TAU,
            _ => angle,
        }
    }

    /// The centre by I, J, K.
    fn centre(&mut self, block: &Block, to: Point) -> Result<Point, Fault> {
        let is_absolute = self.machine.modes.is_arc_absolute;
        let centre = self.centre_in(block, is_absolute);
        let Err(misfit) = self.fits(to, centre) else { return Ok(centre) };
        let other = self.centre_in(block, !is_absolute);
        if self.fits(to, other).is_ok() {
            let text = if is_absolute {
                "an arc whose I, J, K are no absolute centre as G90.1 says, but fit as offsets, which is taken"
            } else {
                "an arc whose I, J, K are no offsets but fit as an absolute centre, which is taken"
            };
            self.findings.add(self.line, text, "");
            return Ok(other);
        }
        let (start, end) = misfit;
        refused(format!("an arc begins {start:.4} mm and ends {end:.4} mm from its centre"))
    }

    fn centre_in(&self, block: &Block, is_absolute: bool) -> Point {
        let (modes, position) = (&self.machine.modes, self.machine.position);
        let [a, b, c] = modes.plane.axes();
        let mut centre = position;
        for axis in [a, b] {
            if let Some(value) = block.get(b'i' + axis as u8) {
                centre[axis] = value * modes.unit + if is_absolute { 0.0 } else { position[axis] };
            }
        }
        centre[c] = position[c];
        centre
    }

    /// Whether a centre is as far from the end as from here: to 0.5 mm or to a hundredth, as controls take it.
    fn fits(&self, to: Point, centre: Point) -> Result<(), (f64, f64)> {
        let [a, b, _] = self.machine.modes.plane.axes();
        let [start, end] = [self.machine.position, to].map(|point| (point[a] - centre[a]).hypot(point[b] - centre[b]));
        let difference = (start - end).abs();
        if start > 0.0 && (difference <= 0.01 * start.max(end) || (difference <= 0.5 && difference <= 0.1 * start.max(end))) {
            Ok(())
        } else {
            Err((start, end))
        }
    }

    /// The centre by R; a negative one is of the longer arc.
    fn centre_by_radius(&mut self, block: &Block, to: Point, is_clockwise: bool) -> Result<Point, Fault> {
        let radius = block.get(b'r').unwrap_or(0.0) * self.machine.modes.unit;
        let [a, b, _] = self.machine.modes.plane.axes();
        let from = self.machine.position;
        let chord = [to[a] - from[a], to[b] - from[b]];
        let half = 0.5 * chord[0].hypot(chord[1]);
        if half == 0.0 {
            return refused("an arc by its radius (R) that ends where it begins");
        }
        if half > radius.abs() * 1.001 + 0.01 {
            return refused(format!("an arc of radius {:.4} mm between points {:.4} mm apart", radius.abs(), 2.0 * half));
        }
        let height = (radius * radius - half * half).max(0.0).sqrt();
        // The centre is left of the way if the shorter arc turns counter-clockwise, and right of it else.
        let side = if is_clockwise == (radius < 0.0) { height } else { -height };
        let mut centre = from;
        centre[a] = 0.5 * (from[a] + to[a]) - chord[1] / (2.0 * half) * side;
        centre[b] = 0.5 * (from[b] + to[b]) + chord[0] / (2.0 * half) * side;
        Ok(centre)
    }

    /// An arc to a point of the program, by way of cutter compensation.
    pub(super) fn arc_to(&mut self, arc: Arc) -> Result<(), Fault> {
        if self.compensation.is_some() {
            return self.compensate_arc(arc);
        }
        self.go_arc(arc)
    }

    /// An arc as it is.
    pub(super) fn go_arc(&mut self, arc: Arc) -> Result<(), Fault> {
        let plane = self.machine.modes.plane;
        let flips = self.machine.arc_flips(plane)?;
        let centre = self.machine.forward(arc.centre);
        let sweep = if flips { -arc.sweep } else { arc.sweep };
        let place = self.machine.forward(arc.to);
        self.go(Kind::Arc { centre, normal: plane.normal(), sweep }, place)?;
        self.machine.position = arc.to;
        Ok(())
    }
}
