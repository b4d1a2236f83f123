//! Moves on their way out: counted, measured and brought into the frame of the first cut.

use super::model::{Kind, Move, widen};
use super::options::Units;
use super::program::{Dialect, Header, ReadError, Travel};
use super::tool::Tool;
use super::vector::{Point, is_finite, sub};
use crate::curves::Findings;
use std::collections::BTreeSet;
use std::ops::ControlFlow;

/// Who wants the moves.
pub(super) type Receiver<'a> = &'a mut dyn FnMut(&Move) -> ControlFlow<()>;

/// Moves before the first cut that wait until the frame is known, at most.
const HELD_MOST: usize = 4096;

/// Counts and measures moves and gives them to a receiver.
pub(super) struct Emitter<'a> {
    receiver: Receiver<'a>,
    moves_max: u64,
    /// The place that is subtracted from all others; `None` until the first cut.
    origin: Option<Point>,
    held: Vec<Move>,
    last_tool: Option<u32>,
    /// References, rapids, feeds and arcs.
    pub(super) counts: [u64; 4],
    pub(super) used: BTreeSet<u32>,
    pub(super) bounds: [[f64; 3]; 2],
    pub(super) cut: [[f64; 3]; 2],
    pub(super) travel: Travel,
}

impl<'a> Emitter<'a> {
    pub(super) fn new(receiver: Receiver<'a>, moves_max: u64) -> Self {
        let empty = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        Self {
            receiver,
            moves_max,
            origin: None,
            held: Vec::new(),
            last_tool: None,
            counts: [0; 4],
            used: BTreeSet::new(),
            bounds: empty,
            cut: empty,
            travel: Travel::default(),
        }
    }

    /// Takes a move between places of the machine; `offset` is where the program's zero is.
    pub(super) fn push(&mut self, one: Move, offset: Point) -> Result<(), ReadError> {
        let line = u64::from(one.line);
        if !is_finite(one.to) || !is_finite(one.from) {
            return Err(ReadError::Refused { line, what: "a place is not finite".into() });
        }
        if self.counts.iter().sum::<u64>() + self.held.len() as u64 >= self.moves_max {
            return Err(ReadError::TooMany { line, most: self.moves_max, what: "moves" });
        }
        match self.origin {
            Some(origin) => self.give(one, origin),
            None if one.is_cut() || self.held.len() >= HELD_MOST => {
                self.origin = Some(offset);
                self.release(offset)?;
                self.give(one, offset)
            }
            None => {
                self.held.push(one);
                Ok(())
            }
        }
    }

    fn release(&mut self, origin: Point) -> Result<(), ReadError> {
        std::mem::take(&mut self.held).into_iter().try_for_each(|one| self.give(one, origin))
    }

    fn give(&mut self, mut one: Move, origin: Point) -> Result<(), ReadError> {
        if origin != [0.0; 3] {
            one.from = sub(one.from, origin);
            one.to = sub(one.to, origin);
            if let Kind::Arc { centre, .. } = &mut one.kind {
                *centre = sub(*centre, origin);
            }
        }
        self.measure(&one);
        if (self.receiver)(&one).is_break() {
            return Err(ReadError::Stopped { line: u64::from(one.line) });
        }
        Ok(())
    }

    fn measure(&mut self, one: &Move) {
        let number = match one.kind {
            Kind::Reference => 0,
            Kind::Rapid => 1,
            Kind::Feed => 2,
            Kind::Arc { .. } => 3,
        };
        self.counts[number] += 1;
        if self.last_tool != Some(one.tool) {
            self.last_tool = Some(one.tool);
            self.used.insert(one.tool);
        }
        if number == 0 {
            return;
        }
        let corners = one.bounds();
        corners.into_iter().for_each(|corner| widen(&mut self.bounds, corner));
        if one.is_cut() {
            corners.into_iter().for_each(|corner| widen(&mut self.cut, corner));
            self.travel.feed += one.length();
        } else {
            self.travel.rapid += one.length();
        }
    }

    /// All that is known of the moves, and what the reader knows.
    pub(super) fn header(
        self,
        (dialect, units, has_units): (Dialect, Units, bool),
        tools: Vec<Tool>,
        unread: u64,
        findings: Findings,
    ) -> Header {
        let [references, rapids, feeds, arcs] = self.counts;
        let known = |bounds: [[f64; 3]; 2]| (bounds[0][0] <= bounds[1][0]).then_some(bounds);
        Header {
            dialect,
            units,
            has_units,
            tools,
            used: self.used.into_iter().collect(),
            references,
            rapids,
            feeds,
            arcs,
            bounds: known(self.bounds),
            cut: known(self.cut),
            travel: self.travel,
            unread,
            findings: findings.finish(),
        }
    }

    /// Gives what still waits.
    pub(super) fn finish(&mut self, offset: Point) -> Result<(), ReadError> {
        self.release(self.origin.unwrap_or(offset))
    }
}
