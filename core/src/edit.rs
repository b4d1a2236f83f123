//! The sparse edit: which input records leave, turn or change, and what is added. Everything else is untouched.

use crate::record::{self, Record};
use crate::report::{EditRecords, EditSummary};
use crate::shop::components::Reversed;
use crate::shop::{Origin, Shop, distance};
use crate::survey::Survey;

/// What happens to an input record that is not untouched.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Change {
    Delete,
    Flip,
    /// The same triangle with moved vertices.
    Move(Box<Record>),
}

/// An edit against the input.
#[derive(Debug, Default)]
pub(crate) struct Edit {
    /// By record, ascending.
    changes: Vec<(u32, Change)>,
    /// Records of reversed patches, a bit each; empty when there are none.
    flipped: Vec<u64>,
    /// New records, for the end of the file.
    pub(crate) added: Vec<Record>,
    flips: u64,
    deletions: u64,
    max_move: f64,
}

impl Edit {
    /// What stands in the workshop against the records it was gathered from. O(workshop), and one pass over the records of
    /// reversed patches.
    pub(crate) fn of(survey: &Survey<'_>, shop: &Shop, reversed: &Reversed) -> Self {
        let mut edit = Self::default();
        edit.changes
            .extend(survey.nonfinite.iter().flat_map(|(first, count)| *first..*first + *count).map(|t| (t, Change::Delete)));
        for (i, triangle) in shop.triangles.iter().enumerate() {
            let points = || shop.points(i as u32);
            match triangle.origin {
                Origin::Input(t) if triangle.alive => edit.compare(survey.records, t, points()),
                Origin::Input(t) => edit.changes.push((t, Change::Delete)),
                Origin::Part(t) if triangle.alive => {
                    edit.added.push(record::encode(points(), record::attribute(&survey.records[t as usize])));
                }
                Origin::Patch if triangle.alive => edit.added.push(record::encode(points(), 0)),
                Origin::Part(_) | Origin::Patch => {}
            }
        }
        edit.changes.sort_unstable_by_key(|(t, _)| *t);
        edit.deletions = edit.changes.iter().filter(|c| c.1 == Change::Delete).count() as u64;
        edit.flips = edit.changes.iter().filter(|c| c.1 == Change::Flip).count() as u64;
        if reversed.patches.iter().any(|r| *r) {
            edit.flip_patches(survey, reversed);
        }
        edit
    }

    /// Notes how a living triangle differs from its record, if it does.
    fn compare(&mut self, records: &[Record], t: u32, now: [[f32; 3]; 3]) {
        let before = record::corners(&records[t as usize]);
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

    fn flip_patches(&mut self, survey: &Survey<'_>, reversed: &Reversed) {
        let runs = survey.visit_sound(
            |patch| reversed.patches[patch as usize],
            |_| true,
            Vec::<(u32, u32)>::new,
            |runs, triangle, _| match runs.last_mut() {
                Some((first, count)) if *first + *count == triangle => *count += 1,
                _ => runs.push((triangle, 1)),
            },
        );
        self.flipped = vec![0; survey.records.len().div_ceil(64)];
        for (first, count) in runs.into_iter().flatten() {
            (first..first + count).for_each(|t| self.flipped[t as usize / 64] |= 1 << (t % 64));
            self.flips += u64::from(count);
        }
    }

    /// Records in the output.
    pub(crate) fn output_records(&self, input_records: usize) -> u64 {
        input_records as u64 - self.deletions + self.added.len() as u64
    }

    /// Walks through the input in order: runs of untouched records, then what becomes of the one that follows.
    pub(crate) fn walk<E>(&self, records: &[Record], mut step: impl FnMut(Step<'_>) -> Result<(), E>) -> Result<(), E> {
        let mut changes = self.changes.iter().peekable();
        let mut start = 0;
        let mut at = 0;
        while at < records.len() {
            let next_change = changes.peek().map_or(records.len(), |c| c.0 as usize);
            let next = next_change.min(self.next_flipped(at));
            if next >= records.len() {
                break;
            }
            if next > start {
                step(Step::Untouched(&records[start..next]))?;
            }
            if next == next_change {
                match changes.next().map(|c| &c.1) {
                    Some(Change::Flip) => step(Step::Changed(&record::flip(&records[next])))?,
                    Some(Change::Move(record)) => step(Step::Changed(record))?,
                    Some(Change::Delete) | None => {}
                }
            } else {
                step(Step::Changed(&record::flip(&records[next])))?;
            }
            at = next + 1;
            start = at;
        }
        if start < records.len() {
            step(Step::Untouched(&records[start..]))?;
        }
        self.added.iter().try_for_each(|record| step(Step::Changed(record)))
    }

    /// The first record from `at` on whose patch is reversed, or past the end.
    fn next_flipped(&self, at: usize) -> usize {
        let mut word = at / 64;
        let mut mask = !0u64 << (at % 64);
        while word < self.flipped.len() {
            let bits = self.flipped[word] & mask;
            if bits != 0 {
                return word * 64 + bits.trailing_zeros() as usize;
            }
            word += 1;
            mask = !0;
        }
        usize::MAX
    }

    pub(crate) fn summary(&self, input_records: usize) -> EditSummary {
        let moved = self.changes.iter().filter(|c| matches!(c.1, Change::Move(_))).count() as u64;
        EditSummary {
            untouched: input_records as u64 - self.deletions - self.flips - moved,
            deleted: self.deletions,
            flipped: self.flips,
            moved,
            added: self.added.len() as u64,
            max_move: self.max_move,
        }
    }

    /// The edit record by record.
    pub(crate) fn listed(&self) -> EditRecords {
        let mut all = EditRecords::default();
        let mut flips: Vec<u32> = Vec::new();
        for (t, change) in &self.changes {
            match change {
                Change::Delete => extend_ranges(&mut all.deleted, *t),
                Change::Flip => flips.push(*t),
                Change::Move(record) => all.moved.push((*t, record::corners(record))),
            }
        }
        let mut at = self.next_flipped(0);
        while at != usize::MAX {
            flips.push(at as u32);
            at = self.next_flipped(at + 1);
        }
        flips.sort_unstable();
        flips.iter().for_each(|t| extend_ranges(&mut all.flipped, *t));
        all.added = self.added.iter().map(|r| (record::corners(r), record::attribute(r))).collect();
        all
    }
}

/// A stretch of the output.
pub(crate) enum Step<'a> {
    Untouched(&'a [Record]),
    Changed(&'a Record),
}

/// Adds the next number to inclusive ranges.
fn extend_ranges(ranges: &mut Vec<[u32; 2]>, t: u32) {
    match ranges.last_mut() {
        Some(last) if last[1] + 1 == t => last[1] = t,
        _ => ranges.push([t, t]),
    }
}
