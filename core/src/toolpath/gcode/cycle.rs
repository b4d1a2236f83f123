//! Canned cycles of drilling and boring (NISTIR 6556, section 3.5.16; LinuxCNC for `G73` and `G74`).

use super::block::Block;
use super::fault::{Fault, refused};
use super::interpreter::Interpreter;
use super::memory::Sticky;
use crate::toolpath::model::Kind;
use crate::toolpath::vector::Point;

/// How far a chip-breaking drill goes back, and how far above the ground a pecking one slows down, in millimetres.
const RETREAT: f64 = 0.254;

/// Heights of a hole, in millimetres.
#[derive(Clone, Copy, Debug)]
struct Hole {
    r: f64,
    bottom: f64,
    /// Where it returns to.
    clear: f64,
    peck: f64,
}

impl Interpreter<'_> {
    pub(super) fn drill(&mut self, block: &Block, code: u16) -> Result<(), Fault> {
        if self.compensation.is_some() {
            return refused(format!("G{code} within cutter compensation (G41, G42) is not done"));
        }
        let modes = self.machine.modes;
        let [_, _, c] = modes.plane.axes();
        let start = self.machine.position[c];
        // R counts from where the first of a row of cycles began.
        let initial = self.cycle.initial.unwrap_or(start);
        let base = if modes.is_absolute { 0.0 } else { initial };
        let depth = block.get(b'x' + c as u8).map(|depth| depth * modes.unit).or(self.cycle.depth);
        let r = block.get(b'r').map(|r| r * modes.unit).or(self.cycle.r);
        // Haas writes pecks that grow smaller as I, J, K; the first is taken for all.
        let q = block.get(b'q').or(block.get(b'i')).map(|q| q * modes.unit).or(self.cycle.q);
        self.cycle = Sticky { initial: Some(initial), depth, r, q };
        let (Some(depth), Some(r)) = (depth, r) else {
            return refused(format!("G{code} without a depth or without R"));
        };
        let r = base + r;
        let bottom = if modes.is_absolute { depth } else { r + depth };
        let peck = q.unwrap_or(0.0);
        if r < bottom {
            return refused(format!("G{code} with R below the ground of the hole"));
        }
        if matches!(code, 73 | 83) && peck <= 0.0 && r > bottom {
            return refused(format!("G{code} without a positive Q"));
        }
        let repeats = block.get(b'k').filter(|k| k.fract() == 0.0 && !block.has_any(b"i"));
        let times = block.get(b'l').or(repeats).unwrap_or(1.0).round();
        if !(0.0..1e9).contains(&times) {
            return refused(format!("G{code} with {times} repetitions"));
        }
        self.cut(block);
        if start < r {
            self.along(c, Kind::Rapid, r)?;
        }
        let clear = if modes.is_initial_return { initial.max(r) } else { r };
        for _ in 0..times as u64 {
            let mut to = self.target(block)?;
            to[c] = self.machine.position[c];
            let kind = self.rapid_kind();
            self.line_to(kind, to)?;
            if to[c] != r {
                self.along(c, Kind::Rapid, r)?;
            }
            self.hole(code, c, Hole { r, bottom, clear, peck })?;
        }
        Ok(())
    }

    /// A line along an axis.
    fn along(&mut self, axis: usize, kind: Kind, to: f64) -> Result<(), Fault> {
        let mut point: Point = self.machine.position;
        point[axis] = to;
        let kind = if kind == Kind::Rapid { self.rapid_kind() } else { kind };
        self.line_to(kind, point)
    }

    fn hole(&mut self, code: u16, c: usize, hole: Hole) -> Result<(), Fault> {
        let Hole { r, bottom, clear, peck } = hole;
        if matches!(code, 73 | 83) {
            let mut depth = r - peck;
            while depth > bottom {
                self.along(c, Kind::Feed, depth)?;
                if code == 73 {
                    self.along(c, Kind::Rapid, depth + RETREAT)?;
                } else {
                    self.along(c, Kind::Rapid, r)?;
                    self.along(c, Kind::Rapid, depth + RETREAT)?;
                }
                let next = depth - peck;
                if next >= depth {
                    return refused(format!("G{code} with a Q too small to go deeper"));
                }
                depth = next;
            }
        }
        self.along(c, Kind::Feed, bottom)?;
        if code == 89 {
            return self.along(c, Kind::Feed, clear);
        }
        if matches!(code, 74 | 84 | 85) {
            self.along(c, Kind::Feed, r)?;
            if clear == r {
                return Ok(());
            }
        }
        self.along(c, Kind::Rapid, clear)
    }
}
