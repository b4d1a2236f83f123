//! Tools of a program: which one is in the spindle, and what comments say about it.

use super::remark::{self, Remark};
use crate::curves::Findings;
use crate::toolpath::options::Units;
use crate::toolpath::tool::{Shape, Tool};
use std::collections::BTreeMap;

/// Added to the number of a tool that is described anew.
const ANEW: u32 = 1_000_000;

/// All tools of a program.
#[derive(Debug, Default)]
pub(super) struct Toolbook {
    given: BTreeMap<u32, Tool>,
    found: BTreeMap<u32, (Remark, u64)>,
    /// Said of a tool whose number follows.
    draft: Remark,
    /// Numbers that comments redefine, and what they are from then on.
    anew: BTreeMap<u32, u32>,
    /// In the spindle.
    pub(super) current: u32,
    /// Named by the last T.
    pub(super) selected: u32,
    /// After the first `M6`.
    pub(super) has_change: bool,
    has_word: bool,
    /// Millimetres in a unit of the program.
    pub(super) unit: f64,
}

impl Toolbook {
    pub(super) fn new(given: &[Tool]) -> Self {
        let given = given.iter().map(|tool| (tool.number, tool.clone())).collect();
        Self { given, unit: 1.0, ..Self::default() }
    }

    /// A `T` word. Routers have no `M6`, so it counts at once until the first one; from then on it prepares the next change.
    pub(super) fn select(&mut self, number: u32, line: u64) {
        self.selected = number;
        self.has_word = true;
        if !self.has_change {
            self.set(number, line);
        }
    }

    /// `M6`.
    pub(super) fn change(&mut self, line: u64) {
        self.has_change = true;
        self.set(self.selected, line);
    }

    /// A tool is in the spindle; what was said before without a number is about it.
    pub(super) fn set(&mut self, number: u32, line: u64) {
        self.current = self.anew.get(&number).copied().unwrap_or(number);
        self.settle_draft(number, line);
    }

    fn settle_draft(&mut self, number: u32, line: u64) {
        let draft = std::mem::take(&mut self.draft);
        if draft.says_something() {
            self.describe(number, draft, line);
        }
    }

    fn describe(&mut self, number: u32, remark: Remark, line: u64) {
        let current = self.anew.get(&number).copied().unwrap_or(number);
        let Some((known, _)) = self.found.get_mut(&current) else {
            self.found.insert(current, (remark, line));
            return;
        };
        if !known.contradicts(&remark) {
            known.add(&remark);
            return;
        }
        let next = current.saturating_add(ANEW);
        self.anew.insert(number, next);
        if self.current == current {
            self.current = next;
        }
        self.found.insert(next, (remark, line));
    }

    /// Looks for a tool in a comment.
    pub(super) fn comment(&mut self, comment: &[u8], line: u64) {
        let Some(remark) = remark::read(comment) else { return };
        match remark.number {
            Some(number) => {
                self.settle_draft(number, line);
                if remark.says_something() {
                    self.describe(number, remark, line);
                }
                // Programs without T words name the tool in comments alone.
                if !self.has_word {
                    self.current = self.anew.get(&number).copied().unwrap_or(number);
                }
            }
            None => {
                if self.draft.contradicts(&remark) {
                    self.draft = Remark::default();
                }
                self.draft.add(&remark);
            }
        }
    }

    /// `G10 L1 R`, in millimetres.
    pub(super) fn set_radius(&mut self, number: u32, radius: f64, line: u64) {
        let remark = Remark { diameter: Some((2.0 * radius, Some(1.0))), ..Remark::default() };
        self.found.insert(number, (remark, line));
    }

    /// Of a tool, in millimetres, if it is known.
    pub(super) fn diameter(&self, number: u32) -> Option<f64> {
        let given = self.given.get(&number).map(|tool| tool.diameter);
        given.or_else(|| self.found.get(&number)?.0.diameter.map(|(value, scale)| value * scale.unwrap_or(self.unit)))
    }

    /// All that are described, in the order of their numbers.
    pub(super) fn finish(self, unit: Units, findings: &mut Findings) -> Vec<Tool> {
        for (number, next) in &self.anew {
            let line = self.found.get(next).map_or(0, |(_, line)| *line);
            findings.add(line, "a tool is described anew and has another number from here on", format!("{number}, now {next}"));
        }
        let mut tools = self.given;
        let mut found = self.found;
        if self.draft.diameter.is_some() {
            found.entry(self.current).or_insert((self.draft, 0));
        }
        for (number, (remark, line)) in found {
            if let Some(tool) = remark.tool(number, unit.millimetres()) {
                tools.entry(number).or_insert(Tool { line, ..tool });
            }
        }
        tools.into_values().collect()
    }
}

impl Remark {
    fn says_something(&self) -> bool {
        self.diameter.is_some() || self.shape.is_some()
    }

    fn contradicts(&self, other: &Self) -> bool {
        let differ = |a: Option<(f64, Option<f64>)>, b: Option<(f64, Option<f64>)>| a.is_some() && b.is_some() && a != b;
        differ(self.diameter, other.diameter)
    }

    fn add(&mut self, other: &Self) {
        self.number = self.number.or(other.number);
        self.diameter = self.diameter.or(other.diameter);
        self.corner = self.corner.or(other.corner);
        self.length = self.length.or(other.length);
        self.angle = self.angle.or(other.angle);
        self.shape = self.shape.or(other.shape);
    }

    /// The tool, if its diameter is said.
    fn tool(&self, number: u32, unit: f64) -> Option<Tool> {
        let (diameter, scale) = self.diameter?;
        let unit = scale.unwrap_or(unit);
        let diameter = diameter * unit;
        let corner = self.corner.map(|corner| corner * unit);
        let shape = match (self.shape, corner) {
            (Some(remark::Form::Taper), _) => Shape::Taper { tip: 0.0, angle: self.angle.unwrap_or(45.0) },
            (Some(remark::Form::Drill), _) => Shape::Drill { angle: self.angle.unwrap_or(118.0) },
            (Some(remark::Form::Ball), _) => Shape::Ball,
            (_, Some(corner)) if corner >= 0.5 * diameter && corner > 0.0 => Shape::Ball,
            (_, Some(corner)) if corner > 0.0 => Shape::BullNose { corner },
            _ => Shape::Flat,
        };
        let length = self.length.map_or(f64::INFINITY, |length| length * unit);
        let is_guess = self.shape.is_none() && corner.is_none()
            || (self.angle.is_none() && self.shape == Some(remark::Form::Taper))
            || (self.shape == Some(remark::Form::Bull) && corner.is_none());
        Some(Tool { length, is_guess, ..Tool::new(number, shape, diameter) })
    }
}
