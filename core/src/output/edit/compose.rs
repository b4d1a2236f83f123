//! An edit of what another edit made, in terms of the records that the first one is of.

use std::collections::BTreeSet;
use std::convert::Infallible;

use super::{Change, Edit, Step};
use crate::contract::report::{FaceOrigin, RepairName};
use crate::io::record::Record;

impl Edit {
    /// This edit of `records`, then one that takes the triangles `gone` of its result away, by their numbers in it, ascending, and adds others as the work of
    /// `repair`. O(records).
    pub(crate) fn then(mut self, records: &[Record], gone: &[u32], added: Vec<Record>, repair: RepairName) -> Self {
        let (places, dropped) = self.gone_through(records, gone);
        for place in &places {
            if let Some(word) = self.flipped.get_mut(*place as usize / 64) {
                let bit = 1 << (place % 64);
                self.flips -= u64::from(*word & bit != 0);
                *word &= !bit;
            }
        }
        let of_place = |change: &(u32, Change)| places.binary_search(&change.0).is_ok();
        self.flips -= self.changes.iter().filter(|change| of_place(change) && change.1 == Change::Flip).count() as u64;
        self.changes.retain(|change| !of_place(change));
        self.changes.extend(places.iter().map(|place| (*place, Change::Delete)));
        self.changes.sort_unstable_by_key(|(place, _)| *place);
        self.deletions += places.len() as u64;
        let mut at = 0..self.added.len();
        let stays: Vec<bool> = at.by_ref().map(|k| !dropped.contains(&k)).collect();
        let mut kept = stays.iter();
        self.added.retain(|_| kept.next().is_none_or(|stays| *stays));
        let mut kept = stays.iter();
        self.added_from.retain(|_| kept.next().is_none_or(|stays| *stays));
        self.added_from.extend(added.iter().map(|_| FaceOrigin::Repair(repair)));
        self.added.extend(added);
        self
    }

    /// Where the triangles `gone` of the result come from: records of the input, ascending, and new ones by their places among those that are added.
    fn gone_through(&self, records: &[Record], gone: &[u32]) -> (Vec<u32>, BTreeSet<usize>) {
        let (mut places, mut dropped) = (Vec::new(), BTreeSet::new());
        let (mut gone, mut made, mut came, mut new) = (gone.iter().peekable(), 0u32, 0u32, 0);
        let walked: Result<(), Infallible> = self.walk(records, |step| {
            match step {
                Step::Untouched(run) => {
                    let end = made + run.len() as u32;
                    while let Some(one) = gone.next_if(|one| **one < end) {
                        places.push(came + (one - made));
                    }
                    (made, came) = (end, came + run.len() as u32);
                }
                Step::Changed(place, _, FaceOrigin::Flipped(_) | FaceOrigin::Moved(_) | FaceOrigin::Input(_)) => {
                    places.extend(gone.next_if_eq(&&made).map(|_| place));
                    (made, came) = (made + 1, came + 1);
                }
                Step::Changed(..) => {
                    dropped.extend(gone.next_if_eq(&&made).map(|_| new));
                    (made, came, new) = (made + 1, came + 1, new + 1);
                }
                Step::Deleted(_) => came += 1,
                Step::Added(..) => {
                    dropped.extend(gone.next_if_eq(&&made).map(|_| new));
                    (made, new) = (made + 1, new + 1);
                }
            }
            Ok(())
        });
        let Ok(()) = walked;
        (places, dropped)
    }
}
