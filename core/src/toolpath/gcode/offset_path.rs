//! Cutter compensation: `G40`, `G41`, `G42` (NISTIR 6556, appendix B; outside corners are gone around in arcs).
//!
//! Compensated moves wait until the compensation ends. The first move leads to beside its own end, as in LinuxCNC.

use super::arc::Arc;
use super::block::Block;
use super::fault::{Fault, refused};
use super::interpreter::Interpreter;
use super::memory::{Compensation, Waiting};
use super::offset_curve::{Flat, Join, Piece, distance, join, through};
use super::plan::Side;
use crate::toolpath::model::Kind;
use crate::toolpath::vector::Point;

/// Moves of one compensation, at most.
const MOST: usize = 1 << 20;
/// Moves in the plane that are shorter, in millimetres, are none.
const SHORTEST: f64 = 1e-9;

impl Interpreter<'_> {
    /// Begins to compensate; the radius is that of the tool D, or of the one in the spindle.
    pub(super) fn begin_compensation(&mut self, side: Side, block: &Block, is_dynamic: bool) -> Result<(), Fault> {
        let sign = if side == Side::Left { 1.0 } else { -1.0 };
        let word = block.get(b'd');
        let diameter = if is_dynamic {
            let Some(diameter) = word else { return refused("G41.1 or G42.1 without D") };
            diameter * self.machine.modes.unit
        } else {
            let tool = word.filter(|tool| (0.0..1e9).contains(tool)).map_or(self.tools.current, |tool| tool.round() as u32);
            match self.tools.diameter(tool) {
                Some(diameter) => diameter,
                // D0 is no tool but no offset.
                None if word == Some(0.0) => 0.0,
                None => {
                    return refused(format!(
                        "cutter compensation (G41, G42) needs the diameter of tool {tool}, which is not known"
                    ));
                }
            }
        };
        let side = sign * 0.5 * diameter;
        if self.compensation.as_ref().is_some_and(|compensation| compensation.side == side) {
            return Ok(());
        }
        self.end_compensation()?;
        let text = format!("{:.4} mm, tool {}", side.abs(), word.unwrap_or(f64::from(self.tools.current)));
        self.findings.add(self.line, "cutter compensation is applied", text);
        self.compensation = Some(Compensation { side, waiting: Vec::new() });
        Ok(())
    }

    pub(super) fn compensate_line(&mut self, kind: Kind, to: Point) -> Result<(), Fault> {
        let [a, b, _] = self.machine.modes.plane.axes();
        let (from, end) = ([self.machine.position[a], self.machine.position[b]], [to[a], to[b]]);
        let piece = (distance(from, end) > SHORTEST).then_some(Piece { from, to: end, arc: None });
        self.wait(piece, kind, to)
    }

    pub(super) fn compensate_arc(&mut self, arc: Arc) -> Result<(), Fault> {
        let [a, b, _] = self.machine.modes.plane.axes();
        let from = [self.machine.position[a], self.machine.position[b]];
        let centre = [arc.centre[a], arc.centre[b]];
        let piece = Piece { from, to: [arc.to[a], arc.to[b]], arc: Some((centre, arc.sweep)) };
        self.wait(Some(piece), Kind::Feed, arc.to)
    }

    fn wait(&mut self, piece: Option<Piece>, kind: Kind, to: Point) -> Result<(), Fault> {
        let [_, _, c] = self.machine.modes.plane.axes();
        let (line, feed) = (self.line, self.machine.modes.feed);
        let Some(compensation) = &mut self.compensation else { return Ok(()) };
        if compensation.waiting.len() >= MOST {
            return refused("more than a million moves within one cutter compensation");
        }
        compensation.waiting.push(Waiting { piece, height: to[c], kind, line, feed });
        self.machine.position = to;
        Ok(())
    }

    /// Ends it; the tool stays beside the end of the last move.
    pub(super) fn end_compensation(&mut self) -> Result<(), Fault> {
        let Some(Compensation { mut side, waiting }) = self.compensation.take() else { return Ok(()) };
        let entry = waiting.iter().find_map(|one| one.piece).map_or(f64::INFINITY, |piece| distance(piece.from, piece.to));
        if entry <= side.abs() {
            let text =
                "cutter compensation whose first move is shorter than the radius, as it is with wear alone; none is applied";
            self.findings.add(self.line, text, "");
            side = 0.0;
        }
        let (line, feed, programmed) = (self.line, self.machine.modes.feed, self.machine.position);
        self.machine.moved();
        for (index, one) in waiting.iter().enumerate() {
            self.line = one.line;
            let is_entry = waiting.get(..index).unwrap_or_default().iter().all(|before| before.piece.is_none());
            self.machine.modes.feed = one.feed;
            let next = waiting.get(index + 1..).unwrap_or_default().iter().find_map(|one| one.piece);
            self.beside(one, next, side, is_entry)?;
            // Moves along the normal come before the way around a corner.
            let follows = waiting.get(index + 1).is_none_or(|next| next.piece.is_some());
            if follows && let Some(next) = next {
                let last = waiting.get(..=index).unwrap_or_default().iter().rev().find_map(|one| one.piece);
                if let Some(last) = last {
                    self.corner(&last, &next, side)?;
                }
            }
        }
        (self.line, self.machine.modes.feed) = (line, feed);
        // The next move goes from beside the path to what it tells, and to the programmed place along the other axes.
        self.machine.position = programmed;
        Ok(())
    }

    fn here(&self) -> Flat {
        let [a, b, _] = self.machine.modes.plane.axes();
        [self.machine.position[a], self.machine.position[b]]
    }

    fn lift(&self, flat: Flat, height: f64) -> Point {
        let [a, b, c] = self.machine.modes.plane.axes();
        let mut point = [0.0; 3];
        (point[a], point[b], point[c]) = (flat[0], flat[1], height);
        point
    }

    /// A move beside a programmed one, up to where the next one begins.
    fn beside(&mut self, one: &Waiting, next: Option<Piece>, side: f64, is_entry: bool) -> Result<(), Fault> {
        let Some(piece) = one.piece else {
            let to = self.lift(self.here(), one.height);
            return self.line_to(one.kind, to);
        };
        let end = match next.map(|next| join(&piece, &next, side)) {
            Some(None) => return self.does_not_fit(),
            Some(Some(Join::Point(end))) => Some(end),
            Some(Some(Join::Around(_))) | None => piece.end_beside(side),
        };
        let Some(end) = end else { return self.does_not_fit() };
        let to = self.lift(end, one.height);
        if !is_entry && piece.goes_back(self.here(), end) {
            return self.does_not_fit();
        }
        let Some((mut centre, _)) = piece.arc else {
            return self.line_to(one.kind, to);
        };
        if is_entry && side != 0.0 {
            // The first arc begins where the tool is, and ends beside its end in the same direction.
            let Some(moved) = through(self.here(), end, centre) else { return self.does_not_fit() };
            centre = moved;
        } else if piece.radius_beside(side).is_some_and(|radius| radius <= 0.0) {
            return self.does_not_fit();
        }
        let piece = Piece { arc: piece.arc.map(|(_, sweep)| (centre, sweep)), ..piece };
        let sweep = piece.sweep_between(self.here(), end);
        let [_, _, c] = self.machine.modes.plane.axes();
        let centre = self.lift(centre, self.machine.position[c]);
        self.go_arc(Arc { to, centre, sweep })
    }

    fn does_not_fit(&self) -> Result<(), Fault> {
        refused("the tool does not fit into a corner or an arc with cutter compensation (G41, G42)")
    }

    /// The way around an outer corner.
    fn corner(&mut self, piece: &Piece, next: &Piece, side: f64) -> Result<(), Fault> {
        let Some(Join::Around(sweep)) = join(piece, next, side) else { return Ok(()) };
        let Some(start) = next.start_beside(side) else { return Ok(()) };
        let [_, _, c] = self.machine.modes.plane.axes();
        let height = self.machine.position[c];
        let (to, centre) = (self.lift(start, height), self.lift(piece.to, height));
        self.go_arc(Arc { to, centre, sweep })
    }
}
