//! Where a block goes, and moves on their way out.

use super::block::Block;
use super::fault::{Fault, refused};
use super::interpreter::Interpreter;
use super::machine::Motion;
use crate::toolpath::model::{Kind, Move, Plane};
use crate::toolpath::vector::Point;

impl Interpreter<'_> {
    /// The point of the program that a block goes to, in millimetres.
    pub(super) fn target(&self, block: &Block) -> Result<Point, Fault> {
        let (modes, position) = (&self.machine.modes, self.machine.position);
        let base = if modes.is_absolute { [0.0; 3] } else { position };
        let mut to = position;
        for (axis, letter) in b"xyz".iter().enumerate() {
            if let Some(value) = block.get(*letter) {
                to[axis] = base[axis] + value * modes.unit;
            }
        }
        if block.has_any(b"@^") {
            return self.polar(block, to);
        }
        let [a, b, _] = modes.plane.axes();
        if modes.is_polar && (block.has_any(&[b'x' + a as u8, b'x' + b as u8])) {
            return self.polar_plane(block, to);
        }
        Ok(to)
    }

    /// LinuxCNC's polar words: `@` a radius and `^` an angle around the program's zero.
    fn polar(&self, block: &Block, mut to: Point) -> Result<Point, Fault> {
        if block.has_any(b"xy") || self.machine.modes.plane != Plane::Xy {
            return refused("@ and ^ with X or Y, or outside of the plane X Y, are not done");
        }
        let (modes, position) = (&self.machine.modes, self.machine.position);
        let (mut radius, mut angle) = (position[0].hypot(position[1]), position[1].atan2(position[0]));
        let (more, turn) = (block.get(b'@').map(|radius| radius * modes.unit), block.get(b'^').map(f64::to_radians));
        if modes.is_absolute {
            radius = more.unwrap_or(radius);
            angle = turn.unwrap_or(angle);
        } else {
            if radius == 0.0 && turn.is_some() {
                return refused("an angle that is added (^) at the zero has no direction");
            }
            radius += more.unwrap_or(0.0);
            angle += turn.unwrap_or(0.0);
        }
        to[0] = radius * angle.cos();
        to[1] = radius * angle.sin();
        Ok(to)
    }

    /// `G16`: the first axis of the plane is a radius around the program's zero, the second an angle.
    fn polar_plane(&self, block: &Block, mut to: Point) -> Result<Point, Fault> {
        let modes = &self.machine.modes;
        if !modes.is_absolute {
            return refused("polar coordinates (G16) with increments (G91) are not done");
        }
        let [a, b, _] = modes.plane.axes();
        let position = self.machine.position;
        let radius = block.get(b'x' + a as u8).map(|value| value * modes.unit);
        let angle = block.get(b'x' + b as u8).map(f64::to_radians);
        let radius = radius.unwrap_or_else(|| position[a].hypot(position[b]));
        let angle = angle.unwrap_or_else(|| position[b].atan2(position[a]));
        to[a] = radius * angle.cos();
        to[b] = radius * angle.sin();
        Ok(to)
    }

    /// Notes which axes a block tells.
    pub(super) fn tell(&mut self, block: &Block) {
        for (axis, letter) in b"xyz".iter().enumerate() {
            self.machine.known[axis] |= block.has_any(std::slice::from_ref(letter));
        }
        if block.has_any(b"@^") || (self.machine.modes.is_polar && block.has_any(b"xyz")) {
            let [a, b, _] = self.machine.modes.plane.axes();
            self.machine.known[a] = true;
            self.machine.known[b] = true;
        }
    }

    /// The kind of a rapid from here.
    pub(super) fn rapid_kind(&self) -> Kind {
        if self.machine.known == [true; 3] { Kind::Rapid } else { Kind::Reference }
    }

    pub(super) fn rapid(&mut self, block: &Block, is_machine: bool) -> Result<(), Fault> {
        if is_machine {
            return self.machine_move(block);
        }
        let to = self.target(block)?;
        let kind = self.rapid_kind();
        self.tell(block);
        self.line_to(kind, to)
    }

    /// `G53`: to a place of the machine, of which the part does not know where it is.
    fn machine_move(&mut self, block: &Block) -> Result<(), Fault> {
        self.end_compensation()?;
        let mut place = self.machine.forward(self.machine.position);
        for (axis, letter) in b"xyz".iter().enumerate() {
            if let Some(value) = block.get(*letter) {
                place[axis] = value * self.machine.modes.unit;
                self.machine.known[axis] = false;
            }
        }
        self.go(Kind::Reference, place)
    }

    pub(super) fn feed(&mut self, block: &Block, is_machine: bool) -> Result<(), Fault> {
        if is_machine {
            return refused("a cut to a place of the machine (G53 G1) is not done");
        }
        let to = self.target(block)?;
        self.cut(block);
        self.line_to(Kind::Feed, to)
    }

    /// `G33.1`: down and back.
    pub(super) fn tap(&mut self, block: &Block) -> Result<(), Fault> {
        let (from, to) = (self.machine.position, self.target(block)?);
        self.end_compensation()?;
        self.cut(block);
        self.line_to(Kind::Feed, to)?;
        self.line_to(Kind::Feed, from)
    }

    /// Notes what has to be noted of each cut.
    pub(super) fn cut(&mut self, block: &Block) {
        self.tell(block);
        if self.machine.known != [true; 3] && !self.signs.cuts_unknown {
            self.signs.cuts_unknown = true;
            self.findings.add(
                self.line,
                "a cut while the program has not told where all axes are; 0 is taken, here and later",
                "",
            );
        }
        if !self.signs.cuts_outside_zx {
            let motion = self.machine.modes.motion;
            let is_zx = self.machine.modes.plane == Plane::Zx && !matches!(motion, Motion::Cycle(_));
            self.signs.cuts_outside_zx |= !is_zx;
            self.signs.first_zx = self.signs.first_zx.or(Some(self.line));
        }
    }

    /// A line to a point of the program, by way of cutter compensation.
    pub(super) fn line_to(&mut self, kind: Kind, to: Point) -> Result<(), Fault> {
        if self.compensation.is_some() {
            return self.compensate_line(kind, to);
        }
        let place = self.machine.forward(to);
        self.go(kind, place)?;
        self.machine.position = to;
        Ok(())
    }

    /// A move to a place.
    pub(super) fn go(&mut self, kind: Kind, place: Point) -> Result<(), Fault> {
        self.settle_unit();
        let one = Move {
            from: self.machine.place,
            to: place,
            kind,
            axis: self.machine.axis,
            tool: self.tools.current,
            feed: self.machine.modes.feed,
            line: self.line.min(u64::from(u32::MAX)) as u32,
        };
        let zero = self.machine.zero();
        self.emitter.push(one, zero)?;
        self.machine.place = place;
        if kind == Kind::Reference {
            self.machine.moved();
        }
        Ok(())
    }

    /// Before another kind of motion: splines end.
    pub(super) fn end_motion(&mut self) -> Result<(), Fault> {
        if self.spline.is_empty() { Ok(()) } else { self.end_spline() }
    }
}
