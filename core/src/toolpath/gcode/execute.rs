//! Executes the words of a block in the order of the standard (NISTIR 6556, table 8).

use super::block::{Block, bit};
use super::fault::{Fault, refused};
use super::interpreter::Interpreter;
use super::machine::{Motion, Rotation, Scaling};
use super::plan::{Once, Plan, Side, name};
use crate::toolpath::model::Plane;

/// Words of places.
const AXES: &[u8] = b"xyz@^";
/// Additional work offsets (`G54.1 P`), at most.
const EXTENDED_MOST: f64 = 300.0;
/// Modal states that are saved, at most.
const SAVED_MOST: usize = 100;

impl Interpreter<'_> {
    /// Executes a block.
    pub(super) fn execute(&mut self, block: &Block) -> Result<(), Fault> {
        let plan = Plan::of(block, self.options.rotary.is_some())?;
        self.other_axes(block, &plan)?;
        self.signs.has_y |= block.has_any(b"y");
        if let Some(inverse) = plan.is_inverse_time {
            self.machine.modes.is_inverse_time = inverse;
        }
        if let Some(unit) = plan.unit {
            self.set_unit(unit);
        }
        self.words(block, &plan);
        self.tool_words(block)?;
        self.modes(block, &plan)?;
        if let Some(code) = plan.ignored {
            self.findings.unread(self.line, format!("G{}", name(code)));
        }
        if let Some(once) = plan.once {
            self.once(once, block, &plan)?;
        } else if let Some(motion) = plan.motion.or(Some(self.machine.modes.motion)) {
            self.motion_words(motion, block, &plan)?;
        }
        if plan.ends_curve {
            self.end_motion()?;
            self.machine.modes.motion = Motion::None;
        }
        self.program_words(block)
    }

    /// Axes other than X, Y, Z: those that turn the tool, and those that are not done.
    fn other_axes(&mut self, block: &Block, plan: &Plan) -> Result<(), Fault> {
        if !block.has_any(b"abcuvw") {
            return Ok(());
        }
        if let Some(rotary) = self.options.rotary.filter(|_| block.has_any(b"abc") && plan.once.is_none()) {
            let is_absolute = plan.is_absolute.unwrap_or(self.machine.modes.is_absolute);
            for (axis, letter) in b"abc".iter().enumerate() {
                if let Some(angle) = block.get(*letter) {
                    self.machine.angles[axis] = if is_absolute { angle } else { self.machine.angles[axis] + angle };
                }
            }
            self.machine.point_tool(rotary);
        }
        for letter in *b"abcuvw" {
            let is_done = letter < b'd' && self.options.rotary.is_some();
            if !is_done && block.get(letter).is_some_and(|value| value != 0.0) {
                let kind =
                    if letter < b'd' { "a rotary axis; how it turns the tool is not known" } else { "a second linear axis" };
                return refused(format!("{} ({kind}) is not done", char::from(letter.to_ascii_uppercase())));
            }
        }
        Ok(())
    }

    fn words(&mut self, block: &Block, plan: &Plan) {
        if let Some(feed) = block.get(b'f') {
            let unit = if self.machine.modes.is_inverse_time { 1.0 } else { self.machine.modes.unit };
            self.machine.modes.feed = feed * unit;
        }
        if let Some(speed) = block.get(b's') {
            self.machine.speed = speed;
        }
        // M67 E and the like set outputs.
        if block.has_any(b"e") && block.m.is_empty() {
            self.signs.has_extruder = true;
            self.findings.unread(self.line, "E (extruder)");
        }
        let is_home = matches!(plan.once, Some(Once::Home(_)));
        if block.bare & !(if is_home { bit(b'x') | bit(b'y') | bit(b'z') } else { 0 }) != 0 {
            self.findings.add(self.line, "a letter without a number is not read", "");
        }
    }

    fn tool_words(&mut self, block: &Block) -> Result<(), Fault> {
        let is_change = block.m.contains(&6);
        if let Some(tool) = block.get(b't') {
            if !(0.0..1e9).contains(&tool) {
                return refused(format!("T{tool} is no tool"));
            }
            if !self.tools.has_change {
                self.end_compensation()?;
            }
            self.tools.select(tool.round() as u32, self.line);
        }
        if is_change {
            self.end_compensation()?;
            self.tools.change(self.line);
        }
        if block.m.contains(&61)
            && let Some(tool) = block.get(b'q').filter(|tool| (0.0..1e9).contains(tool))
        {
            self.tools.set(tool.round() as u32, self.line);
        }
        Ok(())
    }

    fn modes(&mut self, block: &Block, plan: &Plan) -> Result<(), Fault> {
        if let Some(plane) = plan.plane.filter(|plane| *plane != self.machine.modes.plane) {
            if self.compensation.is_some() {
                return refused("a change of planes within cutter compensation (G41, G42) is not done");
            }
            self.machine.modes.plane = plane;
        }
        if let Some(absolute) = plan.is_absolute {
            self.machine.modes.is_absolute = absolute;
        }
        if let Some(absolute) = plan.is_arc_absolute {
            self.machine.modes.is_arc_absolute = absolute;
        }
        if let Some(initial) = plan.is_initial_return {
            self.machine.modes.is_initial_return = initial;
        }
        if let Some(polar) = plan.is_polar {
            self.machine.modes.is_polar = polar;
        }
        if plan.ends_scaling && self.machine.scaling.take().is_some() {
            self.signs.has_fanuc_code = true;
            self.moved()?;
        }
        if plan.ends_rotation && self.machine.rotation.take().is_some() {
            self.moved()?;
        }
        let extended = match block.get(b'p').map(f64::round) {
            Some(number) if plan.is_extended && (1.0..=EXTENDED_MOST).contains(&number) => Some(8 + number as usize),
            _ if plan.is_extended => return refused("an additional work offset (G54.1, G154) without P from 1 to 300"),
            _ => None,
        };
        if let Some(system) = extended.or(plan.system).filter(|system| *system != self.machine.modes.system) {
            self.machine.modes.system = system;
            if self.machine.offsets[self.machine.modes.system] == [0.0; 3] && self.machine.known != [false; 3] {
                let text = "another work offset, of which the file does not say where it is; the same place is taken";
                self.findings.add(self.line, text, "");
            }
            self.moved()?;
        }
        if plan.has_length {
            self.signs.has_fanuc_code |= block.has_any(b"h");
        }
        match plan.side {
            Some(Side::Off) => self.end_compensation(),
            Some(side) => self.begin_compensation(side, block, plan.is_side_dynamic),
            None => Ok(()),
        }
    }

    /// After a change of offsets.
    pub(super) fn moved(&mut self) -> Result<(), Fault> {
        self.end_compensation()?;
        self.machine.moved();
        Ok(())
    }

    fn once(&mut self, once: Once, block: &Block, plan: &Plan) -> Result<(), Fault> {
        if let Some(motion) = plan.motion {
            self.set_motion(motion)?;
        }
        if once != Once::Dwell {
            if block.has_any(b"xyzijr") {
                self.settle_unit();
            }
            self.end_motion()?;
        }
        match once {
            Once::Dwell => Ok(()),
            Once::Set => self.set_data(block),
            Once::Home(number) => self.home(number, block),
            Once::SetHome(number) => {
                self.machine.home[number] = self.machine.place;
                Ok(())
            }
            Once::Local => self.local(block),
            Once::Shift(code) => self.shift(code, block),
            Once::Scale => self.scale(block),
            Once::Rotate => self.rotate(block),
        }
    }

    fn scale(&mut self, block: &Block) -> Result<(), Fault> {
        self.signs.has_fanuc_code = true;
        let unit = self.machine.modes.unit;
        let centre =
            std::array::from_fn(|axis| block.get(b'x' + axis as u8).map_or(self.machine.position[axis], |value| value * unit));
        let all = block.get(b'p');
        let by: [f64; 3] = std::array::from_fn(|axis| block.get(b'i' + axis as u8).or(all).unwrap_or(1.0));
        // Mach writes the scales themselves as X, Y, Z, Fanuc's control a scale in thousandths.
        if all.is_none() && !block.has_any(b"ijk") {
            return refused("G51 without P or I, J, K is not done");
        }
        if by.iter().any(|by| *by == 0.0 || !by.is_finite() || by.abs() > 100.0) {
            return refused("G51 with a scale of 0 or beyond 100 is not done");
        }
        self.machine.scaling = Some(Scaling { centre, by });
        self.moved()
    }

    fn rotate(&mut self, block: &Block) -> Result<(), Fault> {
        self.signs.has_fanuc_code = true;
        if self.machine.modes.plane != Plane::Xy {
            return refused("G68 outside of the plane X Y is not done");
        }
        let unit = self.machine.modes.unit;
        let Some(degrees) = block.get(b'r') else { return refused("G68 without R is not done") };
        self.machine.rotation = None;
        self.machine.moved();
        let position = self.machine.position;
        let [x, y] = [block.get(b'x').or(block.get(b'a')), block.get(b'y').or(block.get(b'b'))];
        let centre = [x.map_or(position[0], |x| x * unit), y.map_or(position[1], |y| y * unit), 0.0];
        let (sin, cos) = degrees.to_radians().sin_cos();
        self.machine.rotation = Some(Rotation { centre, sin, cos });
        self.moved()
    }

    fn motion_words(&mut self, motion: Motion, block: &Block, plan: &Plan) -> Result<(), Fault> {
        if motion != self.machine.modes.motion || plan.motion.is_some() {
            self.set_motion(motion)?;
        }
        let is_arc = matches!(motion, Motion::Clockwise | Motion::Counter);
        let is_curve = matches!(motion, Motion::Nurbs | Motion::Knotted) && (plan.motion.is_some() || block.has_any(b"xyzk"));
        let turns = self.options.rotary.is_some() && block.has_any(b"abc");
        let has_axes = block.has_any(AXES) || turns || (is_arc && block.has_any(b"ijkr") && !self.is_word_of_code(block));
        if !has_axes && !is_curve {
            return Ok(());
        }
        self.settle_unit();
        match motion {
            Motion::None => {
                self.findings.add(self.line, "a place without a motion (after G80, or at the beginning); a rapid is taken", "");
                self.rapid(block, plan.is_machine)
            }
            Motion::Rapid => self.rapid(block, plan.is_machine),
            Motion::Feed => self.feed(block, plan.is_machine),
            Motion::Clockwise | Motion::Counter => self.arc(block, motion == Motion::Clockwise),
            Motion::Tap => self.tap(block),
            Motion::Cubic | Motion::Quadratic => self.bezier(block, motion == Motion::Cubic),
            Motion::Nurbs | Motion::Knotted => self.control_point(block, motion),
            Motion::Cycle(code) => self.drill(block, code),
        }
    }

    /// Whether I, J, K, R of a block belong to a code that is no motion.
    fn is_word_of_code(&self, block: &Block) -> bool {
        block.m.iter().any(|code| *code >= 60)
    }

    fn set_motion(&mut self, motion: Motion) -> Result<(), Fault> {
        if motion != self.machine.modes.motion {
            self.end_motion()?;
            self.machine.modes.motion = motion;
            if !matches!(motion, Motion::Cycle(_)) {
                self.cycle = super::memory::Sticky::default();
            }
        }
        Ok(())
    }

    /// M-codes behind the motion.
    fn program_words(&mut self, block: &Block) -> Result<(), Fault> {
        for code in &block.m {
            match code {
                0 | 1 | 3..=9 | 19 | 48..=53 | 60..=68 => {}
                2 | 30 => self.end(),
                70 | 71 | 73 => self.save(*code)?,
                72 => self.restore()?,
                97 | 98 => self.program_call(*code, block)?,
                99 => {
                    if !self.return_program()? {
                        self.findings.add(self.line, "M99 outside of a subprogram ends the program, not to run for ever", "");
                        self.end();
                    }
                }
                _ => self.findings.unread(self.line, format!("M{code}")),
            }
        }
        Ok(())
    }

    fn program_call(&mut self, code: u16, block: &Block) -> Result<(), Fault> {
        self.signs.has_fanuc_code = true;
        let Some(number) = block.get(b'p') else { return refused("M98 without P is not done") };
        let times = block.get(b'l').or(block.get(b'q')).unwrap_or(1.0);
        if code == 97 { self.call_block(number, times) } else { self.call_program(number, times) }
    }

    fn save(&mut self, code: u16) -> Result<(), Fault> {
        if code == 71 {
            self.machine.saved.pop();
        } else if self.machine.saved.len() >= SAVED_MOST {
            return refused("more than 100 saved states (M70)");
        } else {
            self.machine.saved.push(self.machine.modes);
        }
        Ok(())
    }

    fn restore(&mut self) -> Result<(), Fault> {
        let Some(saved) = self.machine.saved.pop() else { return refused("M72 without M70") };
        // The motion and the work offset stay, as in LinuxCNC.
        let (motion, system) = (self.machine.modes.motion, self.machine.modes.system);
        self.machine.modes = super::machine::Modes { motion, system, ..saved };
        Ok(())
    }
}
