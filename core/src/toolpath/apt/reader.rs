//! Reads statement by statement.

use super::cutter::Tools;
use super::cycle::Cycle;
use super::statement::{Joiner, Statement, plain_goto, split};
use crate::curves::Findings;
use crate::toolpath::emit::{Emitter, Receiver};
use crate::toolpath::lines::Place;
use crate::toolpath::options::{Options, Units};
use crate::toolpath::program::{Dialect, Header, ReadError};
use crate::toolpath::vector::{self, Point};

/// Statements that are not read, at most.
const UNREAD_MOST: u64 = 1000;

/// Words of machines and of people, which move nothing.
const QUIET: &str = " PARTNO REMARK PPRINT MACHIN SPINDL COOLNT STOP OPSTOP END FINI REWIND DELAY DISPLY PAINT PPFUN \
    INSERT TPRINT MODE TOOLPATH END-OF-PATH MCHTOL INTOL OUTTOL TOLER MAXDP CLEARP PREFUN AUXFUN \
    OPSKIP SEQNO LEADER BREAK PREGER CHECK AIR CSYS MFGNO FEATNO UNITS CUTCOM AUTOPS DWELL SWITCH \
    SELECTL OUTOL OPERATIONNAME SYS SELCTL LINTOL ARCSLP CLAMP HEAD RETRCT COUPLE ERASE ";

/// Words that make other moves than those that are written.
const REFUSED: &str = " TRACUT COPY INDEX MIRROR CALL MACRO TERMAC LOOPST LOOPND JUMPTO GO GOLFT GORGT GOBACK GOUP \
    GODOWN GOFWD PSIS TRANTO POCKET ROTABL ROTHED TRANS SPLINE NURBS ";

/// Reads a file.
pub(super) struct Reader<'a> {
    pub(super) options: &'a Options,
    pub(super) emitter: Emitter<'a>,
    pub(super) findings: Findings,
    pub(super) tools: Tools,
    pub(super) position: Point,
    pub(super) is_known: bool,
    pub(super) axis: Point,
    /// Millimetres in its unit.
    pub(super) unit: f64,
    has_units: bool,
    first_unit: Option<Units>,
    pub(super) feed: f64,
    /// Of the next motion.
    pub(super) is_rapid: bool,
    /// Centre and axis of an arc that the next point ends.
    pub(super) circle: Option<(Point, Point)>,
    /// Where the next arc goes at first.
    pub(super) direction: Option<Point>,
    pub(super) cycle: Option<Cycle>,
    /// Of NX's `MSYS`.
    system: Option<Vec<f64>>,
    pub(super) line: u64,
    unread: u64,
}

impl<'a> Reader<'a> {
    pub(super) fn new(options: &'a Options, receiver: Receiver<'a>) -> Self {
        Self {
            options,
            emitter: Emitter::new(receiver, options.moves_max),
            findings: Findings::default(),
            tools: Tools::new(&options.tools),
            position: [0.0; 3],
            is_known: false,
            axis: [0.0, 0.0, 1.0],
            unit: options.units.unwrap_or(Units::Millimetres).millimetres(),
            has_units: false,
            first_unit: None,
            feed: 0.0,
            is_rapid: false,
            circle: None,
            direction: None,
            cycle: None,
            system: None,
            line: 0,
            unread: 0,
        }
    }

    /// Reads all of it. O(length).
    pub(super) fn run(mut self, text: &[u8]) -> Result<Header, ReadError> {
        let mut joiner = Joiner::default();
        let (mut place, mut is_over) = (Place::START, false);
        while let Some((raw, next)) = place.next(text).filter(|_| !is_over) {
            let line = place.line;
            place = next;
            if let Some((numbers, count)) = plain_goto(raw).filter(|_| joiner.is_empty()) {
                self.line = line;
                self.goto(numbers.get(..count).unwrap_or_default())?;
                continue;
            }
            let raw = String::from_utf8_lossy(raw);
            let (part, said, goes_on) = split(&raw);
            if let Some(said) = said {
                self.line = line;
                self.said(&Statement::of(said));
            }
            if let Some((statement, begun)) = joiner.add(part, goes_on, line) {
                self.line = begun;
                is_over = statement.word == "FINI";
                self.statement(&statement)?;
            }
        }
        if let Some((statement, begun)) = joiner.add("", false, place.line) {
            self.line = begun;
            self.findings.add(begun, "the file ends within a statement", "");
            self.statement(&statement)?;
        }
        self.finish()
    }

    /// A statement in a comment of Creo's.
    fn said(&mut self, statement: &Statement) {
        if statement.word == "CUTTER" {
            self.cutter(statement);
        } else if statement.word == "CSYS" {
            let numbers = statement.numbers();
            let is_moved = numbers.iter().enumerate().any(|(index, number)| *number != [1.0, 0.0][usize::from(index % 5 != 0)]);
            if is_moved {
                self.findings.unread(self.line, "CSYS (the coordinate system of the part; points are those of the path)");
            }
        }
    }

    fn statement(&mut self, statement: &Statement) -> Result<(), ReadError> {
        let word = statement.word.as_str();
        match word {
            "GOTO" => return self.goto(&self.point_of(statement)?),
            "GODLTA" => return self.godlta(statement),
            "FROM" => return self.from(statement),
            "GOHOME" => return self.home(),
            "CIRCLE" | "MOVARC" => return self.circle(statement),
            "TLON" | "TLON,GOFWD" | "GOFWD" => return self.forward(statement),
            "CYCLE" => return self.set_cycle(statement),
            "RAPID" => self.is_rapid = true,
            "INDIRV" => self.direction = three(&statement.numbers()),
            "TLAXIS" => self.set_axis(&statement.numbers()),
            "FEDRAT" => self.set_feed(statement),
            "CUTTER" => self.cutter(statement),
            "TLDATA" => self.tool_data(statement),
            "LOADTL" | "TURRET" | "TOOLNO" | "LOAD" => self.load(statement),
            "UNITS" => self.units(statement),
            "MULTAX" if statement.has("OFF") => self.axis = [0.0, 0.0, 1.0],
            "MULTAX" => {}
            "MSYS" => return self.system(statement),
            "ORIGIN" => {
                self.findings.unread(self.line, "ORIGIN (where the part is on the machine; points are the part's)");
            }
            _ => return self.other(statement),
        }
        Ok(())
    }

    fn other(&mut self, statement: &Statement) -> Result<(), ReadError> {
        let word = statement.word.as_str();
        let is_in = |list: &str| list.contains(&format!(" {word} "));
        let first = word.split(',').next().unwrap_or(word);
        // Texts of people begin with their word and need no slash.
        let is_text = ["PARTNO", "REMARK", "PPRINT", "INSERT", "TPRINT", "LETTER"].into_iter().any(|text| word.starts_with(text));
        if is_in(QUIET) || is_text {
            return Ok(());
        }
        if is_in(REFUSED) || REFUSED.contains(&format!(" {first} ")) {
            return self.refuse(format!("{word} is not done"));
        }
        if word.contains('=') {
            return self.refuse(format!("geometry of an APT source ({word}) is not done; a CL file is needed"));
        }
        self.unread += 1;
        self.findings.unread(self.line, crate::util::legible::legible(word));
        if self.unread > UNREAD_MOST {
            return Err(ReadError::TooMany { line: self.line, most: UNREAD_MOST, what: "statements that are not known" });
        }
        Ok(())
    }

    pub(super) fn refuse<T>(&self, what: impl Into<String>) -> Result<T, ReadError> {
        Err(ReadError::Refused { line: self.line, what: crate::util::legible::legible(&what.into()) })
    }

    fn cutter(&mut self, statement: &Statement) {
        let (numbers, unit, line) = (statement.numbers(), self.unit, self.line);
        if let Err(why) = self.tools.cutter(&numbers, unit, line) {
            self.findings.add(line, why, &statement.rest);
        }
    }

    fn tool_data(&mut self, statement: &Statement) {
        let (numbers, unit, line) = (statement.numbers(), self.unit, self.line);
        if !statement.has("MILL") && !statement.has("DRILL") {
            self.findings.add(self.line, "a tool that is neither a mill nor a drill is not read", &statement.rest);
            return;
        }
        if let Err(why) = self.tools.data(statement.has("DRILL"), &numbers, unit, line) {
            self.findings.add(line, why, &statement.rest);
        }
    }

    fn load(&mut self, statement: &Statement) {
        match statement.numbers().first().filter(|number| (0.0..1e9).contains(*number)) {
            Some(number) => self.tools.load(number.round() as u32),
            None => self.findings.add(self.line, "a tool without a number", &statement.rest),
        }
    }

    fn units(&mut self, statement: &Statement) {
        let unit = if statement.has("MM") {
            Units::Millimetres
        } else if statement.has("INCHES") || statement.has("INCH") {
            Units::Inches
        } else {
            self.findings.add(self.line, "a unit is not known; the one before is kept", &statement.rest);
            return;
        };
        self.has_units = true;
        self.first_unit = self.first_unit.or(Some(unit));
        self.unit = unit.millimetres();
    }

    fn set_feed(&mut self, statement: &Statement) {
        self.is_rapid = false;
        if let Some(feed) = statement.numbers().first() {
            let unit = if statement.has("MMPM") { 1.0 } else { self.unit };
            self.feed = feed * unit;
        }
    }

    /// `MSYS` of NX: the system of coordinates. Points of several systems would need to be brought together.
    fn system(&mut self, statement: &Statement) -> Result<(), ReadError> {
        let numbers = statement.numbers();
        if self.system.as_ref().is_some_and(|system| *system != numbers) {
            return self.refuse("a second system of coordinates (MSYS) is not done; each needs a file of its own");
        }
        self.system = Some(numbers);
        Ok(())
    }

    /// The direction of the tool.
    pub(super) fn set_axis(&mut self, numbers: &[f64]) {
        match three(numbers).and_then(vector::unit) {
            Some(axis) => self.axis = axis,
            None => self.findings.add(self.line, "a direction of the tool that is none; the one before is kept", ""),
        }
    }

    fn finish(mut self) -> Result<Header, ReadError> {
        self.emitter.finish([0.0; 3])?;
        if self.emitter.counts == [0; 4] {
            self.findings.add(0, "the file moves nothing", "");
        }
        let unit = self.first_unit.or(self.options.units).unwrap_or(Units::Millimetres);
        if !self.has_units && self.options.units.is_none() {
            self.findings.add(0, "the file names no unit; millimetres are taken", "");
        }
        let tools = self.tools.finish();
        Ok(self.emitter.header((Dialect::Apt, unit, self.has_units), tools, self.unread, self.findings))
    }
}

/// The first three numbers.
pub(super) fn three(numbers: &[f64]) -> Option<Point> {
    numbers.first_chunk().copied()
}
