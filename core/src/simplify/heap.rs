//! Edges by what their collapse costs: a heap of four branches, whose entries go stale when a vertex changes and are thrown away when they come up.

/// An edge at the time it was looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Entry {
    pub(super) cost: f32,
    pub(super) ends: [u32; 2],
    /// The sum of the versions of its ends, which only grows: another sum tells that one has changed.
    pub(super) version: u32,
}

/// The cheapest entry first.
#[derive(Default)]
pub(super) struct Heap {
    entries: Vec<Entry>,
}

impl Heap {
    /// O(n).
    pub(super) fn new(entries: Vec<Entry>) -> Self {
        let mut heap = Self { entries };
        for i in (0..heap.entries.len().div_ceil(4)).rev() {
            heap.sink(i);
        }
        heap
    }

    #[inline]
    pub(super) fn cheapest(&self) -> Option<Entry> {
        self.entries.first().copied()
    }

    pub(super) fn entries(&self) -> &[Entry] {
        &self.entries
    }

    #[inline]
    pub(super) fn pop(&mut self) -> Option<Entry> {
        let last = self.entries.pop()?;
        let Some(first) = self.entries.first_mut() else { return Some(last) };
        let cheapest = std::mem::replace(first, last);
        self.sink(0);
        Some(cheapest)
    }

    #[inline]
    pub(super) fn push(&mut self, entry: Entry) {
        let mut at = self.entries.len();
        self.entries.push(entry);
        while at > 0 {
            let above = (at - 1) / 4;
            if self.entries[above].cost <= entry.cost {
                break;
            }
            self.entries[at] = self.entries[above];
            at = above;
        }
        self.entries[at] = entry;
    }

    #[inline]
    fn sink(&mut self, mut at: usize) {
        let entry = self.entries[at];
        loop {
            let below = 4 * at + 1;
            let Some(rest) = self.entries.get(below..).filter(|rest| !rest.is_empty()) else { break };
            let (mut least, mut cost) = (0, rest[0].cost);
            for (i, other) in rest.iter().enumerate().take(4).skip(1) {
                if other.cost < cost {
                    (least, cost) = (i, other.cost);
                }
            }
            if entry.cost <= cost {
                break;
            }
            self.entries[at] = self.entries[below + least];
            at = below + least;
        }
        self.entries[at] = entry;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn gives_entries_by_cost(first in prop::collection::vec(0u16..50, 0..40), then in prop::collection::vec(0u16..50, 0..40)) {
            let entry = |cost: u16| Entry { cost: f32::from(cost), ends: [0, 1], version: 0 };
            let mut heap = Heap::new(first.iter().copied().map(entry).collect());
            then.iter().for_each(|cost| heap.push(entry(*cost)));
            let mut want: Vec<f32> = first.iter().chain(&then).map(|x| f32::from(*x)).collect();
            want.sort_by(f32::total_cmp);
            prop_assert_eq!(heap.cheapest().map(|e| e.cost), want.first().copied());
            let got: Vec<f32> = std::iter::from_fn(|| heap.pop()).map(|e| e.cost).collect();
            prop_assert_eq!(got, want);
        }
    }
}
