//! An edit of what another edit made, in terms of the records that the first one is of.

use std::collections::BTreeSet;
use std::convert::Infallible;

use super::{Change, Edit, Step};
use crate::contract::report::{FaceOrigin, RepairName};
use crate::io::record::Record;
use crate::util::bits;

impl Edit {
    /// This edit of `records`, then one that takes the triangles `gone` of its result away, by their numbers in it, and adds others as the work of
    /// `repair`. O(records).
    pub(crate) fn then(mut self, records: &[Record], gone: &[u64], added: Vec<Record>, repair: RepairName) -> Self {
        let (places, dropped) = self.gone_through(records, gone);
        for (word, gone) in self.flipped.iter_mut().zip(&places) {
            self.flips -= u64::from((*word & gone).count_ones());
            *word &= !gone;
        }
        let is_gone = |change: &(u32, Change)| bits::holds(&places, change.0 as usize);
        self.flips -= self.changes.iter().filter(|change| is_gone(change) && change.1 == Change::Flip).count() as u64;
        self.changes.retain(|change| !is_gone(change));
        let count = bits::count(&places);
        self.deletions += count;
        if self.dropped.is_empty() && count > 0 {
            self.dropped = places;
        } else {
            self.dropped.iter_mut().zip(places).for_each(|(word, gone)| *word |= gone);
        }
        let stays: Vec<bool> = (0..self.added.len()).map(|k| !dropped.contains(&k)).collect();
        let mut kept = stays.iter();
        self.added.retain(|_| kept.next().is_none_or(|stays| *stays));
        let mut kept = stays.iter();
        self.added_from.retain(|_| kept.next().is_none_or(|stays| *stays));
        self.added_from.extend(added.iter().map(|_| FaceOrigin::Repair(repair)));
        if self.added.is_empty() {
            // Many may come: they are not moved.
            self.added = added;
        } else {
            self.added.extend(added);
        }
        self
    }

    /// The new records.
    pub(crate) fn into_added(self) -> Vec<Record> {
        self.added
    }

    /// Where the triangles `gone` of the result come from: records of the input, and new ones by their places among those that are added.
    fn gone_through(&self, records: &[Record], gone: &[u64]) -> (Vec<u64>, BTreeSet<usize>) {
        let (mut places, mut dropped) = (vec![0; records.len().div_ceil(64)], BTreeSet::new());
        let (mut made, mut came, mut new) = (0, 0, 0);
        let is_gone = |made: usize| bits::holds(gone, made);
        let walked: Result<(), Infallible> = self.walk(records, |step| {
            match step {
                Step::Untouched(run) => {
                    (0..run.len()).filter(|k| is_gone(made + k)).for_each(|k| bits::put(&mut places, came + k));
                    (made, came) = (made + run.len(), came + run.len());
                }
                Step::Changed(place, _, FaceOrigin::Flipped(_) | FaceOrigin::Moved(_) | FaceOrigin::Input(_)) => {
                    if is_gone(made) {
                        bits::put(&mut places, place as usize);
                    }
                    (made, came) = (made + 1, came + 1);
                }
                Step::Changed(..) => {
                    dropped.extend(is_gone(made).then_some(new));
                    (made, came, new) = (made + 1, came + 1, new + 1);
                }
                Step::Deleted(places) => came += places.len(),
                Step::Added(..) => {
                    dropped.extend(is_gone(made).then_some(new));
                    (made, new) = (made + 1, new + 1);
                }
            }
            Ok(())
        });
        let Ok(()) = walked;
        (places, dropped)
    }
}
