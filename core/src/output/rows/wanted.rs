//! The first look: which positions and triangles of the file the changed triangles need, and what stands there.

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

use super::made::{From, Made, Parent};
use super::turned;
use super::votes::Votes;
use super::walk::{Own, Step, walk};
use crate::geometry::position;
use crate::io::record::{self, Point};
use crate::io::rows::{CHANNELS, Corner, NONE, Rows, Source, VERTICES};
use crate::output::model::{Change, Fate};
use crate::util::bits;

/// What the changed triangles need.
#[derive(Default)]
pub(super) struct Wanted {
    /// By the bits of a position: its number.
    numbers: HashMap<[u32; 3], u32>,
    /// A bit for each of those, by [`filtered`]: most positions of a file are told by it not to be among them.
    filter: Vec<u64>,
    /// By number.
    pub(super) points: Vec<Point>,
    /// By number: a corner of the file there, and whether it is one of a triangle that stays.
    there: Vec<Option<(Corner, bool)>>,
    pub(super) made: Vec<Made>,
    pub(super) parents: BTreeMap<u32, Parent>,
    /// Triangles that stay where the file has them, by their numbers in the result.
    pub(super) in_place: Vec<Range<u32>>,
    /// Rows of faces that are written for those.
    pub(super) rows: u64,
    /// Triangles of the file of which nothing is left, but for parts.
    pub(super) gone: u64,
    /// By triangle that is made: whose values it takes, where those around it tell.
    pub(super) winners: Vec<Option<Source>>,
    /// Triangles that were turned, by their corners as they came, in a file that says normals at corners.
    pub(super) turned: Vec<[Corner; 3]>,
    /// Triangles of the result so far.
    result: u32,
    has_normals: bool,
}

impl Wanted {
    /// `None` if the file does not fit the change. O(n) in both; memory by the triangles that changed.
    pub(super) fn of(rows: &dyn Rows, change: &Change<'_>) -> Option<Self> {
        let mut wanted = Self { has_normals: turned::has_normals(rows), ..Self::default() };
        wanted.list(change);
        wanted.there = vec![None; wanted.points.len()];
        let mut filter = vec![0; wanted.points.len().next_power_of_two() / 4 + 1];
        for point in &wanted.points {
            let bit = filtered(position::bits(*point), filter.len());
            bits::put(&mut filter, bit);
        }
        wanted.filter = filter;
        let mut votes = Votes::of(&wanted.made);
        walk(rows, change, |step| wanted.look(rows, step, &mut votes))?;
        for made in &wanted.made {
            if let Some(parent) = made.from.triangle().and_then(|of| wanted.parents.get(&of)) {
                votes.ask(made.corners.map(Some), &wanted.points, || (parent.says.clone(), parent.source.clone()));
            }
        }
        wanted.winners = votes.winners();
        Some(wanted)
    }

    /// The corner of the file at this position.
    pub(super) fn there(&self, number: u32) -> Option<Corner> {
        self.there.get(number as usize).copied().flatten().map(|(corner, _)| corner)
    }

    /// Lists the triangles that are made, and those whose values they take.
    fn list(&mut self, change: &Change<'_>) {
        let (mut at, mut number) = (0, 0);
        change.each(|fate| {
            let (corners, from) = match fate {
                Fate::Kept | Fate::Turned => {
                    (at, number) = (at + 1, number + 1);
                    return;
                }
                Fate::Gone => {
                    at += 1;
                    return;
                }
                Fate::Moved(corners) => {
                    at += 1;
                    (corners, From::Moved(at - 1))
                }
                Fate::Part(of, corners) => (corners, From::Part(of)),
                Fate::New(corners) => (corners, From::Rim),
            };
            let corners = corners.map(|point| self.number(point));
            self.made.push(Made { corners, from, number });
            number += 1;
        });
        for of in self.made.iter().filter_map(|made| made.from.triangle()) {
            let points = change.came.get(of as usize).map(record::corners).unwrap_or_default();
            let parent = Parent { source: Source::default(), corners: [[NONE; CHANNELS]; 3], points, says: Vec::new() };
            self.parents.entry(of).or_insert(parent);
        }
    }

    /// The number of a position, a new one if it has none.
    fn number(&mut self, point: Point) -> u32 {
        let next = self.points.len() as u32;
        let number = *self.numbers.entry(position::bits(point)).or_insert(next);
        if number == next {
            self.points.push(point);
        }
        number
    }

    fn look(&mut self, rows: &dyn Rows, step: Step<'_>, votes: &mut Votes) {
        match step {
            Step::Face(row, first, triangles) => {
                self.rows += 1;
                self.stay(triangles.len() as u32);
                for (number, places) in (first..).zip(triangles) {
                    self.note(rows, &Own { row, number, places: *places }, Some(votes));
                }
            }
            Step::Stays(own) | Step::Turned(own) => {
                if self.has_normals && matches!(step, Step::Turned(_)) {
                    self.turned.push(own.corners());
                }
                self.rows += 1;
                self.stay(1);
                self.note(rows, &own, Some(votes));
            }
            Step::Moved(own) => {
                self.result += 1;
                self.note(rows, &own, None);
            }
            Step::Gone(own) => {
                self.gone += 1;
                self.note(rows, &own, None);
            }
            Step::Made => self.result += 1,
            Step::Short(_) => {}
        }
    }

    /// Notes a triangle of the file; with `votes` one that stays.
    fn note(&mut self, rows: &dyn Rows, own: &Own<'_>, votes: Option<&mut Votes>) {
        if self.made.is_empty() {
            return;
        }
        let corners = own.corners();
        let numbers = corners.map(|corner| {
            let at = position::bits(rows.position(corner[VERTICES])?);
            if !bits::holds(&self.filter, filtered(at, self.filter.len())) {
                return None;
            }
            let number = *self.numbers.get(&at)?;
            let there = self.there.get_mut(number as usize)?;
            // A triangle that stays tells more of a place than one that does not.
            let is_better = there.is_none_or(|(_, stays)| votes.is_some() && !stays);
            if is_better {
                *there = Some((corner, votes.is_some()));
            }
            Some(number)
        });
        if let Some(votes) = votes {
            votes.ask(numbers, &self.points, || (rows.says(own.row), own.source()));
        }
        if let Some(parent) = self.parents.get_mut(&own.number) {
            (parent.source, parent.corners, parent.says) = (own.source(), corners, rows.says(own.row));
        }
    }

    /// So many triangles more stay where the file has them.
    fn stay(&mut self, triangles: u32) {
        let from = self.result;
        self.result += triangles;
        match self.in_place.last_mut() {
            Some(last) if last.end == from => last.end = self.result,
            _ => self.in_place.push(from..self.result),
        }
    }
}

/// One of the bits of so many words, by the bits of a position.
fn filtered([x, y, z]: [u32; 3], words: usize) -> usize {
    let mixed = (u64::from(x) ^ u64::from(y).rotate_left(21) ^ u64::from(z).rotate_left(42)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    // The upper half of a product depends on all bits.
    (mixed >> 32) as usize % (words * 64)
}
