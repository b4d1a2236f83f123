//! The sparse edit: which input records leave, turn or change, and what is added. Everything else is untouched.

mod added;
mod compose;
#[cfg(test)]
mod tests;

use std::ops::Range;

use rayon::prelude::*;

use crate::contract::report::{EditRecords, EditSummary, FaceOrigin, RepairName};
use crate::geometry::distance::distance;
use crate::io::record::{self, Record};
use crate::output::attribute_words;
use crate::submesh::components::Reversed;
use crate::submesh::{Origin, Submesh};
use crate::topology::survey::Survey;
use crate::util::bits::{self, Shared, next_one, ones};
use added::Added;
pub(crate) use added::NewRecords;

/// The change of an input record that is not untouched.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Change {
    Delete,
    Flip,
    /// The same triangle with moved vertices.
    Move(Box<Record>),
}

/// Words of bits that one thread looks through at a time.
const WORDS_AT_ONCE: usize = 64;

/// As the budget counts them.
const _: () = assert!(size_of::<(u32, Change)>() == 24);

/// An edit against the input.
#[derive(Debug, Default)]
pub(crate) struct Edit {
    /// By record, ascending.
    changes: Vec<(u32, Change)>,
    /// Records of reversed regions, a bit each; empty when there are none.
    flipped: Vec<u64>,
    /// And of regions that go.
    dropped: Vec<u64>,
    /// New records. As many as can take the places of deleted ones, in order; the rest goes to the end of the file.
    added: Added,
    flips: u64,
    deletions: u64,
    max_move: f64,
}

impl Edit {
    /// What stands in the submesh against the records it was gathered from, and the triangles of wraps. O(submesh + wrapped), and one pass
    /// over the records of reversed regions.
    pub(crate) fn of(survey: &Survey<'_>, submesh: &Submesh, reversed: &Reversed, wrapped: &[[[f32; 3]; 3]]) -> Self {
        let mut edit = Self::default();
        let words = attribute_words::of_new(survey, submesh);
        edit.changes.reserve_exact(survey.nonfinite.iter().map(|r| r.1 as usize).sum());
        edit.changes
            .extend(survey.nonfinite.iter().flat_map(|(first, count)| *first..*first + *count).map(|t| (t, Change::Delete)));
        for i in submesh.beside_records(survey) {
            let triangle = &submesh.triangles[i as usize];
            let points = || submesh.points(i);
            match triangle.origin {
                Origin::Input(_) if triangle.alive => edit.compare(survey.records, submesh, i),
                Origin::Input(t) => edit.changes.push((t, Change::Delete)),
                Origin::Part(t) if triangle.alive => {
                    edit.add(points(), record::attribute(&survey.records[t as usize]), FaceOrigin::Part(t));
                }
                Origin::Added(repair) if triangle.alive => {
                    edit.add(points(), words.get(&i).copied().unwrap_or_default(), FaceOrigin::Repair(repair));
                }
                Origin::Part(_) | Origin::Added(_) => {}
            }
        }
        wrapped.iter().for_each(|corners| edit.add(*corners, 0, FaceOrigin::Repair(RepairName::Wrap)));
        edit.changes.sort_unstable_by_key(|(t, _)| *t);
        edit.deletions = edit.changes.iter().filter(|c| c.1 == Change::Delete).count() as u64;
        edit.flips = edit.changes.iter().filter(|c| c.1 == Change::Flip).count() as u64;
        let dropped = |region: u32| reversed.dropped[region as usize];
        let (flipped, flips) = records_of(survey, |region| reversed.regions[region as usize] && !dropped(region));
        let (gone, deletions) = records_of(survey, dropped);
        (edit.flipped, edit.dropped) = (flipped, gone);
        edit.flips += flips;
        edit.deletions += deletions;
        edit
    }

    /// The same edit in terms of the records that its own come from: those that are `gone` were left out, and those that `turned` had been flipped. Each of them
    /// a bit for each of so many `records`. O(records).
    pub(crate) fn over(self, gone: &[u64], turned: &[u64], records: usize) -> Self {
        let stayed = Stayed::of(gone, records);
        let added = self.added.with_origins(|from| match from {
            FaceOrigin::Part(t) => FaceOrigin::Part(stayed.record(t)),
            other => other,
        });
        let mut edit = Self { flipped: turned.to_vec(), added, max_move: self.max_move, ..Self::default() };
        let is_left_out = gone.iter().any(|word| *word > 0);
        edit.dropped = if is_left_out || !self.dropped.is_empty() { gone.to_vec() } else { Vec::new() };
        ones(&self.flipped).for_each(|t| edit.flip(stayed.record(t)));
        for t in ones(&self.dropped).map(|t| stayed.record(t)) {
            bits::put(&mut edit.dropped, t as usize);
            bits::take(&mut edit.flipped, t as usize);
        }
        for (t, change) in self.changes.into_iter().map(|(t, change)| (stayed.record(t), change)) {
            if change == Change::Flip {
                edit.flip(t);
            } else {
                bits::take(&mut edit.flipped, t as usize);
                edit.changes.push((t, change));
            }
        }
        edit.flips = bits::count(&edit.flipped);
        edit.deletions = bits::count(&edit.dropped) + edit.changes.iter().filter(|c| c.1 == Change::Delete).count() as u64;
        edit
    }

    /// Turns a record, or turns it back.
    fn flip(&mut self, t: u32) {
        self.flipped[t as usize / 64] ^= 1 << (t % 64);
    }

    fn add(&mut self, corners: [[f32; 3]; 3], attribute: u16, from: FaceOrigin) {
        self.added.push(record::encode(corners, attribute), from);
    }

    /// The edit that changes nothing.
    pub(crate) fn none() -> &'static Self {
        static NONE: Edit = Edit {
            changes: Vec::new(),
            flipped: Vec::new(),
            dropped: Vec::new(),
            added: Added::NONE,
            flips: 0,
            deletions: 0,
            max_move: 0.0,
        };
        &NONE
    }

    /// New records with the faces that they come from, in order.
    pub(crate) fn added_with_origins(&self) -> impl Iterator<Item = (&Record, FaceOrigin)> {
        self.added.iter()
    }

    /// All records that are new, moved ones included and turned ones not, in no order that matters.
    pub(crate) fn new_records(&self) -> impl Iterator<Item = &Record> {
        let moved = self.changes.iter().filter_map(|(_, change)| match change {
            Change::Move(record) => Some(&**record),
            Change::Delete | Change::Flip => None,
        });
        moved.chain(self.added.iter().map(|(record, _)| record))
    }

    /// Notes how a living triangle differs from its record, if it does.
    fn compare(&mut self, records: &[Record], submesh: &Submesh, i: u32) {
        let (now, t) = (submesh.points(i), submesh.record(i));
        let Some(before) = submesh.as_read(records, i) else { return };
        // Comparing as numbers: −0.0 is 0.0.
        if before == now {
            return;
        }
        let change = if [before[0], before[2], before[1]] == now {
            Change::Flip
        } else {
            for p in now {
                let moved = before.iter().map(|q| distance(p, *q)).fold(f64::INFINITY, f64::min);
                self.max_move = self.max_move.max(moved);
            }
            Change::Move(Box::new(record::encode(now, record::attribute(&records[t as usize]))))
        };
        self.changes.push((t, change));
    }

    /// Every record stays untouched, and none is added.
    pub(crate) fn is_empty(&self) -> bool {
        self.changes.is_empty() && self.flips + self.deletions == 0 && self.added.is_empty()
    }

    /// Input records that do not stay as they are.
    pub(crate) fn gone(&self) -> u64 {
        let moved = self.changes.iter().filter(|c| matches!(c.1, Change::Move(_))).count() as u64;
        self.deletions + self.flips + moved
    }

    /// The numbers of all records that are no more what they were, each once.
    pub(crate) fn gone_records(&self) -> impl Iterator<Item = u32> {
        self.changes.iter().map(|(t, _)| *t).chain(ones(&self.flipped)).chain(ones(&self.dropped))
    }

    /// The numbers of those of the records that are left out for which `is_wanted` holds, each once. They may be nearly all there are: all threads look.
    pub(crate) fn deleted_where(&self, is_wanted: impl Fn(u32) -> bool + Sync) -> Vec<u32> {
        let deleted = self.changes.iter().filter(|change| change.1 == Change::Delete).map(|(t, _)| *t);
        let mut wanted: Vec<u32> = deleted.filter(|t| is_wanted(*t)).collect();
        let of_words = |(k, words): (usize, &[u64])| {
            let first = (k * WORDS_AT_ONCE * 64) as u32;
            ones(words).map(move |t| first + t).filter(|t| is_wanted(*t)).collect::<Vec<_>>()
        };
        wanted.par_extend(self.dropped.par_chunks(WORDS_AT_ONCE).enumerate().flat_map_iter(of_words));
        wanted
    }

    /// Records in the output.
    pub(crate) fn output_records(&self, input_records: usize) -> u64 {
        input_records as u64 - self.deletions + self.added.len() as u64
    }

    /// The first deleted record whose place nothing takes, if there is one: up to there, every record of the output stands where the
    /// input's does. O(edit).
    pub(crate) fn first_gap(&self) -> Option<u32> {
        let deleted = self.changes.iter().filter(|c| c.1 == Change::Delete).map(|c| c.0);
        if self.dropped.is_empty() {
            return deleted.into_iter().nth(self.added.len());
        }
        let mut both: Vec<u32> = deleted.collect();
        both.extend(ones(&self.dropped).take(self.added.len() + 1));
        both.sort_unstable();
        both.get(self.added.len()).copied()
    }

    /// Walks through the input in order: runs of untouched records, then what becomes of the one that follows.
    pub(crate) fn walk<'r, 'e, E>(
        &'e self,
        records: &'r [Record],
        mut step: impl FnMut(Step<'r, 'e>) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut changes = self.changes.iter().peekable();
        let mut added = self.added.iter().peekable();
        let mut start = 0;
        let mut at = 0;
        // Each is looked for again only once it is passed: every word of bits is read once.
        let (mut dropped, mut turned) = (next_one(&self.dropped, 0), next_one(&self.flipped, 0));
        while at < records.len() {
            let next_change = changes.peek().map_or(records.len(), |c| c.0 as usize);
            let next = next_change.min(turned).min(dropped);
            if next >= records.len() {
                break;
            }
            if next > start {
                step(Step::Untouched(&records[start..next]))?;
            }
            if next == dropped && next < next_change && added.peek().is_none() {
                // They may be nearly all there are.
                at = bits::next_zero(&self.dropped, next).min(next_change);
                step(Step::Deleted(next as u32..at as u32))?;
                (start, dropped, turned) = (at, next_one(&self.dropped, at), next_one(&self.flipped, at));
                continue;
            }
            let place = next as u32;
            let flipped = || Step::Changed(place, record::flip(&records[next]), FaceOrigin::Flipped(place));
            step(match changes.next_if(|c| c.0 == place).map(|c| &c.1) {
                None if next != dropped => flipped(),
                Some(Change::Flip) => flipped(),
                Some(Change::Move(record)) => Step::Changed(place, **record, FaceOrigin::Moved(place)),
                Some(Change::Delete) | None => {
                    added.next().map_or(Step::Deleted(place..place + 1), |(record, from)| Step::Changed(place, *record, from))
                }
            })?;
            at = next + 1;
            start = at;
            if dropped < at {
                dropped = next_one(&self.dropped, at);
            }
            if turned < at {
                turned = next_one(&self.flipped, at);
            }
        }
        if start < records.len() {
            step(Step::Untouched(&records[start..]))?;
        }
        added.try_for_each(|(record, from)| step(Step::Added(record, from)))
    }

    /// For each record of the output the record of the input that it is, or is a part of; `None` for a new one. O(output).
    pub(crate) fn origins(&self, records: &[Record]) -> Vec<Option<u32>> {
        let mut origins = Vec::with_capacity(records.len());
        let mut at = 0;
        let walked: Result<(), std::convert::Infallible> = self.walk(records, |step| {
            match step {
                Step::Untouched(run) => {
                    origins.extend((at..).take(run.len()).map(Some));
                    at += run.len() as u32;
                }
                Step::Changed(_, _, from) => {
                    origins.push(from.input_face());
                    at += 1;
                }
                Step::Deleted(places) => at += places.len() as u32,
                Step::Added(_, from) => origins.push(from.input_face()),
            }
            Ok(())
        });
        let Ok(()) = walked;
        origins
    }

    pub(crate) fn summary(&self, input_records: usize) -> EditSummary {
        let gone = self.gone();
        EditSummary {
            untouched: input_records as u64 - gone,
            deleted: self.deletions,
            flipped: self.flips,
            moved: gone - self.deletions - self.flips,
            added: self.added.len() as u64,
            max_move: self.max_move,
        }
    }

    /// The edit record by record.
    pub(crate) fn listed(&self) -> EditRecords {
        let mut all = EditRecords::default();
        let (mut flips, mut deleted): (Vec<u32>, Vec<u32>) = Default::default();
        for (t, change) in &self.changes {
            match change {
                Change::Delete => deleted.push(*t),
                Change::Flip => flips.push(*t),
                Change::Move(record) => all.moved.push((*t, record::corners(record))),
            }
        }
        flips.extend(ones(&self.flipped));
        flips.sort_unstable();
        deleted.extend(ones(&self.dropped));
        deleted.sort_unstable();
        deleted.iter().for_each(|t| extend_ranges(&mut all.deleted, *t));
        flips.iter().for_each(|t| extend_ranges(&mut all.flipped, *t));
        let (added, from) = self.added.iter().map(|(r, from)| ((record::corners(r), record::attribute(r)), from)).unzip();
        (all.added, all.added_from) = (added, from);
        all
    }
}

/// The records that stayed when others were left out.
struct Stayed<'g> {
    gone: &'g [u64],
    /// How many stayed before each word; empty if all did.
    before: Vec<u32>,
}

impl<'g> Stayed<'g> {
    fn of(gone: &'g [u64], records: usize) -> Self {
        let mut sum = 0;
        let words = if gone.iter().all(|word| *word == 0) { 0 } else { records.div_ceil(64) };
        let before = gone.iter().take(words).map(|word| {
            let so_far = sum;
            sum += word.count_zeros();
            so_far
        });
        Self { before: before.collect(), gone }
    }

    /// The record that was the `t`-th of those that stayed.
    fn record(&self, t: u32) -> u32 {
        if self.before.is_empty() {
            return t;
        }
        let word = self.before.partition_point(|before| *before <= t) - 1;
        let place = nth_one(!self.gone[word], t - self.before[word]);
        word as u32 * 64 + place
    }
}

/// The place of the `n`-th bit that is set, from 0.
fn nth_one(mut word: u64, n: u32) -> u32 {
    for _ in 0..n {
        word &= word - 1;
    }
    word.trailing_zeros()
}

/// What becomes of the input's records, one stretch after the other, and then what is added beyond their places.
pub(crate) enum Step<'r, 'e> {
    Untouched(&'r [Record]),
    /// What stands in the place of the record of this number, and where it comes from.
    Changed(u32, Record, FaceOrigin),
    /// Nothing stands in the places of these.
    Deleted(Range<u32>),
    Added(&'e Record, FaceOrigin),
}

/// The records of some regions, a bit each, and how many; no bits if there are none. One pass over them.
pub(crate) fn records_of(survey: &Survey<'_>, wanted: impl Fn(u32) -> bool + Sync) -> (Vec<u64>, u64) {
    if !(0..survey.regions.len() as u32).any(&wanted) {
        return (Vec::new(), 0);
    }
    let records = Shared::none(survey.records.len());
    let counts = survey.visit_regular(
        wanted,
        || 0,
        |count: &mut u64, triangle, _| {
            records.put(triangle);
            *count += 1;
        },
    );
    (records.into_bits(), counts.into_iter().sum())
}

/// Adds the next number to inclusive ranges.
fn extend_ranges(ranges: &mut Vec<[u32; 2]>, t: u32) {
    match ranges.last_mut() {
        Some(last) if last[1] + 1 == t => last[1] = t,
        _ => ranges.push([t, t]),
    }
}
