//! `CYCLE`: each point that follows is drilled.

use super::cycle::Cycle;
use super::reader::Reader;
use super::statement::Statement;
use crate::toolpath::model::Kind;
use crate::toolpath::program::ReadError;
use crate::toolpath::vector::{Point, add, scale};

impl Reader<'_> {
    /// `CYCLE/DRILL, DEPTH, d, CLEAR, c` of Creo, `CYCLE/DRILL, FEDTO, d, RAPTO, c` of NCL and NX; `CYCLE/OFF`.
    pub(super) fn set_cycle(&mut self, statement: &Statement) -> Result<(), ReadError> {
        if statement.has("OFF") || statement.has("NOMORE") {
            self.cycle = None;
            return Ok(());
        }
        if statement.has("ON") && self.cycle.is_some() {
            return Ok(());
        }
        // The older way has the depth behind the kind, then the feed, then the clearance.
        let older = statement.behind(&["DRILL", "DEEP", "TAP", "BORE", "REAM", "FACE", "CSINK", "BRKCHP"]);
        let Some(depth) = statement.behind(&["DEPTH", "FEDTO"]).or(older) else {
            return self.refuse(format!("CYCLE without DEPTH or FEDTO (“{}”)", statement.rest));
        };
        let third = statement.numbers().get(2).copied().filter(|_| older.is_some());
        let clear = statement.behind(&["CLEAR", "RAPTO"]).or(third).unwrap_or(0.0) * self.unit;
        let back = statement.behind(&["RETURN", "RTRCTO"]).map_or(clear, |back| back * self.unit);
        // NX writes depths as heights, below the point.
        let depth = depth.abs() * self.unit;
        let is_slow = ["TAP", "BORE", "REAM"].into_iter().any(|word| statement.has(word));
        if statement.has("DEEP") || statement.has("BRKCHP") || statement.behind(&["STEP", "INCR"]).is_some() {
            self.findings.unread(self.line, "steps of a drilling cycle (each hole is one way down)");
        }
        self.cycle = Some(Cycle { depth, clear, back: back.max(clear), is_slow });
        Ok(())
    }

    /// Drills at a point.
    pub(super) fn drill(&mut self, point: Point) -> Result<(), ReadError> {
        let Some(cycle) = self.cycle else { return Ok(()) };
        self.is_rapid = false;
        let at = |height: f64, axis: Point| add(point, scale(axis, height));
        let axis = self.axis;
        self.go(at(cycle.back, axis), true)?;
        if cycle.back != cycle.clear {
            self.go(at(cycle.clear, axis), true)?;
        }
        self.push(at(-cycle.depth, axis), Kind::Feed)?;
        if cycle.is_slow {
            self.push(at(cycle.clear, axis), Kind::Feed)?;
        }
        if !cycle.is_slow || cycle.back != cycle.clear {
            self.push(at(cycle.back, axis), Kind::Rapid)?;
        }
        Ok(())
    }
}
