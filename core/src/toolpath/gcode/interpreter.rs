//! Executes a program line by line.

use super::block::Block;
use super::calls::Flow;
use super::clean::Line;
use super::fault::Fault;
use super::labels::{self, Labels, Word};
use super::machine::Machine;
use super::memory::{Compensation, Spline, Sticky};
use super::number::Cursor;
use super::parameters::{Parameters, System};
use super::signs::Signs;
use super::toolbook::Toolbook;
use crate::curves::Findings;
use crate::toolpath::emit::{Emitter, Receiver};
use crate::toolpath::lines::Place;
use crate::toolpath::options::{Options, Units};
use crate::toolpath::program::{Header, ReadError};
use crate::toolpath::vector::scale;
use crate::util::legible::legible_bytes;

/// Lines that are not read, at most; a file with more is not what it seems.
const UNREAD_MOST: u64 = 1000;

/// Reads and executes a program.
pub(super) struct Interpreter<'a> {
    pub(super) text: &'a [u8],
    pub(super) options: &'a Options,
    pub(super) emitter: Emitter<'a>,
    pub(super) findings: Findings,
    pub(super) parameters: Parameters,
    pub(super) machine: Machine,
    pub(super) tools: Toolbook,
    pub(super) spline: Spline,
    pub(super) compensation: Option<Compensation>,
    pub(super) cycle: Sticky,
    pub(super) flow: Flow,
    pub(super) signs: Signs,
    /// For a look at other lines.
    pub(super) flow_line: Line,
    /// The line that is executed.
    pub(super) line: u64,
    has_units: bool,
    first_unit: Option<Units>,
    unread: u64,
    /// Lines that are read, comments left out.
    read: u64,
    /// Blocks that are executed again.
    steps: u64,
    is_over: bool,
}

impl<'a> Interpreter<'a> {
    pub(super) fn new(text: &'a [u8], options: &'a Options, receiver: Receiver<'a>) -> Self {
        let labels = Labels::of(text);
        let signs = Signs::of(text, &labels);
        let unit = options.units.unwrap_or(Units::Millimetres);
        Self {
            text,
            options,
            emitter: Emitter::new(receiver, options.moves_max),
            findings: Findings::default(),
            parameters: Parameters::default(),
            // Fanuc's control returns to where a cycle began (G98) if nothing else is said; LinuxCNC to R.
            machine: Machine::new(unit.millimetres(), signs.is_fanuc()),
            tools: Toolbook::new(&options.tools),
            spline: Spline::default(),
            compensation: None,
            cycle: Sticky::default(),
            flow: Flow::new(labels),
            signs,
            flow_line: Line::default(),
            line: 0,
            has_units: false,
            first_unit: None,
            unread: 0,
            read: 0,
            steps: 0,
            is_over: false,
        }
    }

    /// Executes all of it. O(blocks executed), bounded by the file and the options.
    pub(super) fn run(mut self) -> Result<Header, ReadError> {
        let (mut line, mut block) = (Line::default(), Block::default());
        let mut furthest = 0;
        let text = self.text;
        while let Some((raw, next)) = self.flow.next.next(text) {
            let here = self.flow.next;
            self.flow.next = next;
            self.line = here.line;
            // Long lines and long searches count more, for the time that they take.
            let again = if here.at < furthest { 1 + raw.len() as u64 / 64 } else { 0 };
            self.steps += again + self.flow.labels.looked_at.take() / 16;
            if self.steps > self.options.steps_max {
                let (line, most) = (self.line, self.options.steps_max);
                return Err(ReadError::TooMany { line, most, what: "blocks in loops (a loop without an end?)" });
            }
            let is_new = here.at >= furthest;
            furthest = furthest.max(here.at + 1);
            if raw.trim_ascii_start().starts_with(b"%") {
                if self.tape(here) {
                    break;
                }
                continue;
            }
            line.set(raw, self.signs.has_brackets);
            let result = self.line(&line, &mut block, here, is_new);
            self.settle(result, raw)?;
            if self.is_over {
                break;
            }
        }
        self.finish()
    }

    /// A percent sign begins the tape and ends it; whether it is the end.
    fn tape(&mut self, here: Place) -> bool {
        let before = self.text.get(..here.at).unwrap_or_default();
        let is_end = self.signs.is_tape_begun || !before.trim_ascii().is_empty();
        let is_first = !self.signs.is_tape_begun;
        self.signs.is_tape_begun = true;
        let is_header = is_first && before.len() < 4096 && !self.emitted() && self.line < 50;
        is_end && !is_header
    }

    fn emitted(&self) -> bool {
        self.machine.known != [false; 3]
    }

    fn settle(&mut self, result: Result<(), Fault>, raw: &[u8]) -> Result<(), ReadError> {
        match result {
            Ok(()) => {
                self.read += 1;
                Ok(())
            }
            Err(Fault::Syntax(why)) => {
                self.unread += 1;
                self.findings.add(self.line, "a line is not read", format!("{why} in “{}”", legible_bytes(raw.trim_ascii())));
                if self.unread > UNREAD_MOST {
                    return Err(ReadError::TooMany { line: self.line, most: UNREAD_MOST, what: "lines that are not readable" });
                }
                Ok(())
            }
            Err(Fault::Refused(what)) => Err(ReadError::Refused { line: self.line, what }),
            Err(Fault::Stop(error)) => Err(error),
        }
    }

    fn line(&mut self, line: &Line, block: &mut Block, here: Place, is_new: bool) -> Result<(), Fault> {
        if is_new {
            self.comments(line);
        }
        if line.is_optional {
            let what = if self.options.block_delete { "left out" } else { "executed" };
            self.findings.add(self.line, "an optional line (/)", what);
            if self.options.block_delete {
                return Ok(());
            }
        }
        if line.code.is_empty() {
            return Ok(());
        }
        let mut cursor = Cursor::new(&line.code);
        if line.code.contains(&b'#') {
            self.publish();
        }
        let mut at = cursor;
        labels::skip_number(&mut at);
        // Programs in ISO code have a colon for the letter.
        if at.eat(b"o") || at.eat(b":") {
            match labels::label(&mut at, Some(&self.parameters))? {
                (_, Word::Program) => cursor = at,
                (label, word) => return self.o_word(label, word, &mut at, here),
            }
        }
        if line.code.starts_with(b"$") {
            self.findings.unread(self.line, format!("command {}", legible_bytes(&line.code)));
            return Ok(());
        }
        block.read(&mut cursor, &mut self.parameters)?;
        self.oddities(block, line);
        if block.is_empty() { Ok(()) } else { self.execute(block) }
    }

    fn comments(&mut self, line: &Line) {
        for comment in &line.comments {
            if self.first_unit.is_none() {
                self.signs.comment(comment);
            }
            self.tools.comment(comment, self.line);
        }
        if line.is_open {
            self.findings.add(self.line, "a comment is not closed; it is taken to the end of the line", "");
        }
    }

    fn oddities(&mut self, block: &Block, line: &Line) {
        if let Some(sum) = block.checksum {
            self.signs.has_checksum = true;
            if sum != f64::from(line.checksum) {
                let details = format!("{sum} instead of {}", line.checksum);
                self.findings.add(self.line, "a checksum does not fit its line, which is read nevertheless", details);
            }
        }
        if block.unknown != 0 {
            self.findings.add(self.line, "a feed or speed that only the machine knows; the one before is kept", "");
        }
        if block.twice != 0 {
            self.findings.add(self.line, "a word stands twice on a line; the last one counts", legible_bytes(&line.code));
        }
    }

    /// Tells the parameters where the machine is.
    fn publish(&mut self) {
        let (machine, modes) = (&self.machine, &self.machine.modes);
        let units = 1.0 / modes.unit;
        self.parameters.system = System {
            position: scale(machine.position, units),
            offset_92: scale(machine.offset_92, units),
            offsets: std::array::from_fn(|system| scale(machine.offsets[system], units)),
            system: modes.system,
            tool: self.tools.current,
            selected: self.tools.selected,
            diameter: self.tools.diameter(self.tools.current).unwrap_or(0.0) * units,
            feed: modes.feed * units,
            speed: machine.speed,
            plane: [170.0, 180.0, 190.0][modes.plane as usize],
            is_metric: modes.unit == 1.0,
            is_absolute: modes.is_absolute,
            line: self.line,
        };
    }

    pub(super) fn set_unit(&mut self, unit: f64) {
        self.has_units = true;
        self.machine.modes.unit = unit;
        if self.first_unit.is_none() {
            self.tools.unit = unit;
            self.first_unit = Some(if unit == 1.0 { Units::Millimetres } else { Units::Inches });
        }
    }

    /// Before the first move: the unit that comments speak of, if nothing else tells one.
    pub(super) fn settle_unit(&mut self) {
        if self.first_unit.is_some() {
            return;
        }
        let from_comment = if self.options.units.is_none() { self.signs.unit } else { None };
        let unit = self.options.units.or(from_comment).unwrap_or(Units::Millimetres);
        self.first_unit = Some(unit);
        self.tools.unit = unit.millimetres();
        self.machine.modes.unit = unit.millimetres();
        if self.options.units.is_none() {
            let word = if unit == Units::Inches { "inches" } else { "millimetres" };
            let source = if from_comment.is_some() { ", of which its comments speak" } else { "" };
            self.findings.add(self.line, "the file names no unit before it moves", format!("{word} are taken{source}"));
        }
    }

    /// The end of the program.
    pub(super) fn end(&mut self) {
        self.is_over = true;
    }

    fn finish(mut self) -> Result<Header, ReadError> {
        let result = self.end_motion().and_then(|()| self.end_compensation());
        self.settle(result, b"")?;
        if self.unread > 10 && self.unread > self.read {
            return Err(ReadError::Unknown(legible_bytes(self.text.get(..24).unwrap_or(self.text).trim_ascii_end())));
        }
        let zero = self.machine.zero();
        self.emitter.finish(zero)?;
        let [references, rapids, feeds, arcs] = self.emitter.counts;
        if let Some(line) = self.signs.lathe(feeds + arcs) {
            let what = "a program of a lathe (it cuts in Z X alone and never names Y), which is not done".into();
            return Err(ReadError::Refused { line, what });
        }
        if references + rapids + feeds + arcs == 0 {
            self.findings.add(0, "the file moves nothing; it may hold subprograms alone", "");
        }
        let dialect = self.signs.dialect();
        let unit = self.first_unit.unwrap_or(Units::Millimetres);
        let mut findings = self.findings;
        let tools = self.tools.finish(unit, &mut findings);
        Ok(self.emitter.header((dialect, unit, self.has_units), tools, self.unread, findings))
    }
}
