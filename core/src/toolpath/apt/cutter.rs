//! Tools of a file: `LOADTL` numbers them, `CUTTER` describes them, in either order.

use crate::curves::Findings;
use crate::toolpath::tool::{Cutter, Shape, Tool};
use std::collections::BTreeMap;

/// Added to the number of a tool that is described anew.
const ANEW: u32 = 1_000_000;
/// Tools, at most; more are no tools but an error of the file.
const MOST: usize = 10_000;

/// All tools of a file.
#[derive(Debug, Default)]
pub(super) struct Tools {
    given: BTreeMap<u32, Tool>,
    known: BTreeMap<u32, Tool>,
    /// The number that the last statement named; tools are told apart when they move.
    number: u32,
    shape: Option<Tool>,
    current: Option<u32>,
}

impl Tools {
    pub(super) fn new(given: &[Tool]) -> Self {
        Self { given: given.iter().map(|tool| (tool.number, tool.clone())).collect(), ..Self::default() }
    }

    /// `LOADTL`. Creo says the cutter before, NCL behind it.
    pub(super) fn load(&mut self, number: u32) {
        if number != self.number {
            self.number = number;
            self.current = None;
        }
    }

    /// `CUTTER` with one to seven numbers, in the file's unit. Fewer than seven mean an end mill with a corner.
    pub(super) fn cutter(&mut self, numbers: &[f64], unit: f64, line: u64) -> Result<(), &'static str> {
        let Some(diameter) = numbers.first().copied().filter(|diameter| *diameter >= 0.0) else {
            return Err("a cutter without a diameter");
        };
        let at = |index: usize| numbers.get(index).copied().unwrap_or(0.0);
        let corner = at(1);
        let tool = if numbers.len() < 7 {
            let shape = match corner * unit {
                0.0 => Shape::Flat,
                _ if corner >= 0.5 * diameter => Shape::Ball,
                corner => Shape::BullNose { corner },
            };
            Tool::new(0, shape, diameter * unit)
        } else {
            let (e, f, height) = (at(2) * unit, at(3) * unit, at(6) * unit);
            let (diameter, corner) = (diameter * unit, corner * unit);
            Tool::from_cutter(0, Cutter { diameter, corner, e, f, alpha: at(4), beta: at(5), height })
        };
        self.set(Tool { line, ..tool });
        Ok(())
    }

    /// `TLDATA/MILL` and `TLDATA/DRILL` of NX: diameter, corner or point, length, taper.
    pub(super) fn data(&mut self, is_drill: bool, numbers: &[f64], unit: f64, line: u64) -> Result<(), &'static str> {
        let at = |index: usize| numbers.get(index).copied().unwrap_or(0.0);
        let diameter = at(0) * unit;
        if diameter <= 0.0 {
            return Err("a tool without a diameter");
        }
        let length = Some(at(2) * unit).filter(|length| *length > 0.0).unwrap_or(f64::INFINITY);
        let corner = at(1) * unit;
        // The angle of a drill's point stands in one of two places.
        let point = [at(3), at(1)].into_iter().find(|angle| (45.0..=180.0).contains(angle));
        let shape = match (is_drill, at(3)) {
            (true, _) => Shape::Drill { angle: point.unwrap_or(118.0) },
            (false, taper) if taper != 0.0 => Shape::Taper { tip: diameter, angle: taper },
            _ if corner <= 0.0 => Shape::Flat,
            _ if corner >= 0.5 * diameter => Shape::Ball,
            _ => Shape::BullNose { corner },
        };
        self.set(Tool { length, line, is_guess: is_drill && point.is_none(), ..Tool::new(0, shape, diameter) });
        Ok(())
    }

    fn set(&mut self, tool: Tool) {
        let is_same = self.shape.as_ref().is_some_and(|old| old.shape == tool.shape && old.diameter == tool.diameter);
        if !is_same {
            self.shape = Some(tool);
            self.current = None;
        }
    }

    /// The number of the tool that moves now.
    pub(super) fn current(&mut self, line: u64, findings: &mut Findings) -> u32 {
        if let Some(current) = self.current {
            return current;
        }
        let mut number = self.number;
        if let Some(shape) = &self.shape
            && self.known.len() < MOST
        {
            let is_other = |tool: &Tool| tool.shape != shape.shape || tool.diameter != shape.diameter;
            while self.known.get(&number).is_some_and(is_other) {
                number = number.saturating_add(ANEW);
            }
            if number != self.number && !self.known.contains_key(&number) {
                let details = format!("{}, now {number}", self.number);
                findings.add(line, "a tool is described anew and has another number from here on", details);
            }
            self.known.entry(number).or_insert_with(|| Tool { number, ..shape.clone() });
        }
        self.current = Some(number);
        number
    }

    /// All of them, in the order of their numbers.
    pub(super) fn finish(self) -> Vec<Tool> {
        let mut tools = self.given;
        for (number, tool) in self.known {
            tools.entry(number).or_insert(tool);
        }
        tools.into_values().collect()
    }
}
