//! An edit of what another edit made, in terms of the records that the first one is of.

use std::collections::BTreeSet;
use std::convert::Infallible;

use super::{Change, Edit, NewRecords, Step};
use crate::contract::report::{FaceOrigin, RepairName};
use crate::io::record::Record;
use crate::util::bits;

impl Edit {
    /// This edit of `records`, then one that takes the triangles `gone` of its result away, by their numbers in it, and adds others as the work of
    /// `repair`. O(records).
    pub(crate) fn then(mut self, records: &[Record], gone: &[u64], added: NewRecords, repair: RepairName) -> Self {
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
        self.added.retain(|place| !dropped.contains(&place));
        self.added.follow(added, repair);
        self
    }

    /// The new records of the last step.
    pub(crate) fn into_added(self) -> NewRecords {
        self.added.into_last()
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
