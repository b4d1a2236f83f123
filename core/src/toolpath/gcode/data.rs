//! Offsets and references: `G10`, `G28`, `G30`, `G52`, `G92`.

use super::block::{Block, bit};
use super::fault::{Fault, refused};
use super::interpreter::Interpreter;
use crate::toolpath::model::Kind;
use crate::toolpath::vector::{Point, sub};

impl Interpreter<'_> {
    /// `G10`: offsets of work (L2, L20) and of tools (L1, L10 to L13).
    pub(super) fn set_data(&mut self, block: &Block) -> Result<(), Fault> {
        let unit = self.machine.modes.unit;
        match block.get(b'l').map(f64::round) {
            Some(2.0) => self.set_offset(block, false),
            Some(20.0) => self.set_offset(block, true),
            Some(1.0 | 10.0 | 11.0 | 12.0) => {
                if let (Some(tool), Some(radius)) = (block.get(b'p'), block.get(b'r'))
                    && (0.0..1e9).contains(&tool)
                    && radius > 0.0
                {
                    self.tools.set_radius(tool.round() as u32, radius.abs() * unit, self.line);
                }
                Ok(())
            }
            _ => {
                self.findings.unread(self.line, "G10 of data other than offsets");
                Ok(())
            }
        }
    }

    fn set_offset(&mut self, block: &Block, is_here: bool) -> Result<(), Fault> {
        let system = match block.get(b'p').map(f64::round) {
            None | Some(0.0) => self.machine.modes.system,
            Some(number) if (1.0..=9.0).contains(&number) => number as usize - 1,
            Some(number) => return refused(format!("G10 of work offset {number} is not done")),
        };
        let unit = self.machine.modes.unit;
        if let Some(degrees) = block.get(b'r') {
            self.machine.turned[system] = degrees;
        }
        for (axis, letter) in b"xyz".iter().enumerate() {
            let Some(value) = block.get(*letter).map(|value| value * unit) else { continue };
            let old = self.machine.offsets[system][axis];
            self.machine.offsets[system][axis] = if is_here {
                if self.machine.turned[system] != 0.0 {
                    return refused("G10 L20 of a rotated system is not done");
                }
                // The tool is then at this coordinate of the system.
                self.machine.place[axis] - value
            } else if !self.machine.modes.is_absolute && self.signs.is_fanuc() {
                // LinuxCNC sets offsets, whatever the mode of distances.
                old + value
            } else {
                value
            };
        }
        self.moved()
    }

    /// `G28` and `G30`: by way of a point to the machine's reference.
    pub(super) fn home(&mut self, number: usize, block: &Block) -> Result<(), Fault> {
        let letters = b"xyz";
        self.end_compensation()?;
        let has = |letter: u8| block.has_any(&[letter]) || block.bare & bit(letter) != 0;
        let all = !letters.iter().any(|letter| has(*letter));
        if block.has_any(letters) {
            let to = self.target(block)?;
            let kind = self.rapid_kind();
            self.line_to(kind, to)?;
        }
        let mut place = self.machine.place;
        for (axis, letter) in letters.iter().enumerate() {
            if all || has(*letter) {
                place[axis] = self.machine.home[number][axis];
                self.machine.known[axis] = false;
            }
        }
        self.go(Kind::Reference, place)
    }

    /// `G52`: a local shift.
    pub(super) fn local(&mut self, block: &Block) -> Result<(), Fault> {
        self.signs.has_fanuc_code = true;
        for (axis, letter) in b"xyz".iter().enumerate() {
            if let Some(value) = block.get(*letter) {
                self.machine.offset_52[axis] = value * self.machine.modes.unit;
            }
        }
        self.moved()
    }

    /// `G92`: the tool is at these coordinates; `G92.1` to `G92.3` take it back.
    pub(super) fn shift(&mut self, code: u16, block: &Block) -> Result<(), Fault> {
        match code {
            920 => {
                if self.machine.scaling.is_some() || self.machine.rotation.is_some() {
                    return refused("G92 in a system rotated by G68 or scaled by G51 is not done");
                }
                if !self.machine.is_92_on {
                    self.machine.is_92_on = true;
                    self.machine.moved();
                }
                let unit = self.machine.modes.unit;
                let mut told: Point = self.machine.position;
                for (axis, letter) in b"xyz".iter().enumerate() {
                    if let Some(value) = block.get(*letter) {
                        told[axis] = value * unit;
                        self.machine.known[axis] = true;
                    }
                }
                let change = sub(self.machine.position, told);
                (0..3).for_each(|axis| self.machine.offset_92[axis] += change[axis]);
            }
            921 => {
                self.machine.offset_92 = [0.0; 3];
                self.machine.is_92_on = true;
            }
            922 => self.machine.is_92_on = false,
            _ => self.machine.is_92_on = true,
        }
        self.moved()
    }
}
