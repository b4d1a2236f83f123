//! A file of vertices and faces, written as a repair left its mesh.
//!
//! **In:** the rows of the file, and what became of its triangles.
//! **Out:** the file with new rows of vertices behind the old ones, and its faces as they are now.
//! **Promise:** a face that stays is written byte for byte, and so is everything that is no face. A triangle that was moved or cut takes what its
//! face says, and of its corners the means of those that it lies between; a new one takes what most of the faces around it say.
//!
//! A triangle that was turned keeps the normals of its corners, and counts as one that says about what it said where they look against it now.
//!
//! Faces that stay or are turned come first, where they stood; all others behind them.

mod made;
mod plan;
mod spread;
#[cfg(test)]
mod tests;
mod turned;
mod votes;
mod walk;
mod wanted;

use std::collections::BTreeSet;
use std::ops::Range;

use crate::contract::error::Result;
use crate::io::rows::{CHANNELS, FaceRow, Rows, Source, State, Triangle, VERTICES, WHOLE};
use crate::output::model::{Account, Change};
use made::From;
use plan::Plan;
use walk::{Own, Step, walk};
use wanted::Wanted;

/// Bytes that are given on at once.
const BATCH: usize = 256 << 10;

/// A file that can be written.
pub(crate) struct Planned<'p> {
    rows: &'p dyn Rows,
    change: Change<'p>,
    wanted: Wanted,
    plan: Plan,
    /// Made triangles in the order in which they are written.
    order: Vec<usize>,
    /// The statements that hold at the end of the file.
    end: State,
    pub(crate) account: Account,
}

impl<'p> Planned<'p> {
    /// `None` if the file does not fit the change, or has no room for new rows. Memory by the triangles that changed. O(n).
    pub(crate) fn of(rows: &'p dyn Rows, change: Change<'p>) -> Option<Self> {
        let wanted = Wanted::of(rows, &change)?;
        let plan = Plan::of(rows, &wanted)?;
        let end = if wanted.made.is_empty() { State::default() } else { rows.end_state() };
        let mut planned = Self { rows, change, wanted, plan, order: Vec::new(), end, account: Account::default() };
        if !rows.make_room(planned.vertices(), planned.faces()) {
            return None;
        }
        let mut order: Vec<usize> = (0..planned.wanted.made.len()).collect();
        // States that hold at the end need no statement.
        order.sort_by_cached_key(|made| {
            let state = planned.source(*made).map_or(end, |source| source.state);
            (state != end, state)
        });
        planned.order = order;
        planned.account = planned.count();
        let against = turned::against(rows, &planned.wanted.turned)?;
        planned.account.kept -= against;
        planned.account.approximated += against;
        Some(planned)
    }

    /// The triangles of the result in the order of the file, by their numbers in the order of the edit.
    pub(crate) fn order(&self) -> impl Iterator<Item = Range<u32>> {
        let number = |made: &usize| self.wanted.made.get(*made).map_or(0..0, |made| made.number..made.number + 1);
        self.wanted.in_place.iter().cloned().chain(self.order.iter().map(number))
    }

    fn vertices(&self) -> u64 {
        u64::from(self.rows.counts()[VERTICES]) + self.plan.fresh[VERTICES].len() as u64
    }

    fn faces(&self) -> u64 {
        self.wanted.rows + self.wanted.made.len() as u64
    }

    /// The face whose values a made triangle takes.
    fn source(&self, made: usize) -> Option<&Source> {
        match self.wanted.made.get(made)?.from.triangle() {
            Some(of) => self.wanted.parents.get(&of).map(|parent| &parent.source),
            None => self.wanted.winners.get(made)?.as_ref(),
        }
    }

    fn count(&self) -> Account {
        let kept = self.wanted.in_place.iter().map(|range| u64::from(range.end - range.start)).sum();
        let mut account = Account { kept, ..Account::default() };
        let mut parted = BTreeSet::new();
        for (k, made) in self.wanted.made.iter().enumerate() {
            match made.from {
                From::Moved(_) => account.kept += 1,
                From::Part(of) => {
                    parted.insert(of);
                    account.divided += 1;
                }
                From::Rim => account.inherited += u64::from(self.source(k).is_some()),
            }
        }
        account.lost = self.wanted.gone.saturating_sub(parted.len() as u64);
        account
    }

    /// Writes the file. O(n).
    ///
    /// # Errors
    /// Those of `sink`.
    pub(crate) fn write(&self, sink: &mut dyn FnMut(&[u8]) -> Result<()>) -> Result<()> {
        let (head, at) = self.rows.head(self.vertices(), self.faces());
        let mut writer = Writer { planned: self, at, batch: head, last: 0, has_vertices: false, result: Ok(()), sink };
        // It was walked before, and did fit.
        let _ = walk(self.rows, &self.change, |step| writer.step(step));
        writer.go_to(self.rows.end_of_faces());
        writer.made();
        writer.go_to(self.rows.bytes().len());
        writer.flush();
        writer.result
    }
}

struct Writer<'w, 'p> {
    planned: &'w Planned<'p>,
    /// Up to here, the bytes of the file are dealt with.
    at: usize,
    /// Waits to be given on.
    batch: Vec<u8>,
    /// The last byte that was given on.
    last: u8,
    /// New vertices are written.
    has_vertices: bool,
    /// The first error of `sink`; nothing is written after it.
    result: Result<()>,
    sink: &'w mut dyn FnMut(&[u8]) -> Result<()>,
}

impl Writer<'_, '_> {
    fn flush(&mut self) {
        if self.result.is_ok() && !self.batch.is_empty() {
            self.result = (self.sink)(&self.batch);
        }
        self.last = self.batch.last().copied().unwrap_or(self.last);
        self.batch.clear();
    }

    fn flush_if_full(&mut self) {
        if self.batch.len() >= BATCH {
            self.flush();
        }
    }

    fn copy_to(&mut self, to: usize) {
        if to > self.at {
            self.planned.rows.copy(self.at..to, &mut |bytes| {
                for part in bytes.chunks(BATCH) {
                    self.batch.extend_from_slice(part);
                    self.flush_if_full();
                }
            });
            self.at = to;
        }
    }

    /// Copies the bytes of the file up to this one, with new vertices where they belong.
    fn go_to(&mut self, to: usize) {
        let end = self.planned.rows.end_of_vertices();
        if !self.has_vertices && to >= end {
            self.copy_to(end);
            self.has_vertices = true;
            self.end_line();
            for (channel, fresh) in self.planned.plan.fresh.iter().enumerate() {
                for values in fresh {
                    self.planned.rows.put_row(channel, values, &mut self.batch);
                    self.flush_if_full();
                }
            }
        }
        self.copy_to(to);
    }

    /// In text, what follows stands on a line of its own.
    fn end_line(&mut self) {
        let last = self.batch.last().copied().unwrap_or(self.last);
        let is_needed = self.planned.rows.is_text() && !matches!(last, b'\n' | b'\r' | 0);
        let has_any = self.planned.plan.fresh.iter().any(|rows| !rows.is_empty()) || !self.planned.order.is_empty();
        if is_needed && has_any {
            self.batch.push(b'\n');
        }
    }

    fn step(&mut self, step: Step<'_>) {
        match step {
            Step::Face(..) | Step::Made => {}
            Step::Stays(own) => self.replace(&own, false),
            Step::Turned(own) => self.replace(&own, true),
            Step::Moved(own) | Step::Gone(own) => self.leave_out(own.row),
            Step::Short(row) => self.leave_out(row),
        }
    }

    fn leave_out(&mut self, row: &FaceRow) {
        if self.at < row.whole.end {
            self.go_to(row.whole.start);
            self.at = row.whole.end;
        }
    }

    /// Writes a triangle in the place of its face.
    fn replace(&mut self, own: &Own<'_>, is_turned: bool) {
        self.leave_out(own.row);
        let source = own.source();
        let ([a, b, c], [u, v, w]) = (own.corners(), WHOLE);
        let (corners, weights) = if is_turned { ([a, c, b], [u, w, v]) } else { ([a, b, c], [u, v, w]) };
        let triangle = Triangle { corners, source: Some(&source), weights, is_turned };
        self.planned.rows.put_face(&triangle, &mut self.batch);
        self.flush_if_full();
    }

    /// Writes the triangles that were made.
    fn made(&mut self) {
        self.end_line();
        let planned = self.planned;
        let mut state = planned.end;
        for made in &planned.order {
            let source = planned.source(*made);
            if let Some(wanted) = source.map(|source| source.state).filter(|wanted| *wanted != state) {
                planned.rows.put_state(state, wanted, &mut self.batch);
                state = wanted;
            }
            let corners = planned.plan.corners.get(*made).copied().unwrap_or([[0; CHANNELS]; 3]);
            let weights = planned.plan.weights.get(*made).copied().unwrap_or(WHOLE);
            planned.rows.put_face(&Triangle { corners, source, weights, is_turned: false }, &mut self.batch);
            self.flush_if_full();
        }
    }
}
