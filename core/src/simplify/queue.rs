//! Edges by what their collapse costs: in buckets, 16 for each doubling of the cost, the first come of a bucket first. To add one and to take one are
//! O(1), as a heap is not; a cost that is less than 7 % larger is not told from another one.

use crate::util::ids::NONE;

/// Bits of a cost that its bucket does not tell.
const SHIFT: u32 = 19;

/// How many buckets there are: one for each of the other bits of numbers that are not negative.
pub(super) const BUCKETS: usize = 1 << (31 - SHIFT);

/// So many buckets are a group.
const GROUP: usize = u64::BITS as usize;

/// An edge, by its ends.
type Entry = [u32; 2];

/// Entries of a chunk: they are read in a row, not from all over the memory.
const CHUNK: usize = 16;

/// Some entries of a bucket.
#[derive(Clone, Copy)]
struct Chunk {
    entries: [Entry; CHUNK],
    next: u32,
}

/// A list of chunks, [`NONE`] where there is none.
#[derive(Clone, Copy)]
struct Bucket {
    first: u32,
    last: u32,
    /// The first entry of the first chunk, and the end of those of the last one.
    start: u32,
    end: u32,
    count: u32,
}

/// The cheapest bucket first.
pub(super) struct Queue {
    buckets: Vec<Bucket>,
    /// By groups, a bit for each bucket that holds an entry.
    filled: [u64; BUCKETS / GROUP],
    chunks: Vec<Chunk>,
    /// The first chunk that is free; each knows the next one.
    free: u32,
}

/// The bucket of a cost that is not negative.
#[inline]
#[expect(clippy::disallowed_methods, reason = "a cost is no coordinate")]
pub(super) fn bucket(cost: f32) -> usize {
    (cost.to_bits() >> SHIFT) as usize % BUCKETS
}

impl Queue {
    /// With room for so many entries.
    pub(super) fn new(entries: usize) -> Self {
        let empty = Bucket { first: NONE, last: NONE, start: 0, end: CHUNK as u32, count: 0 };
        Self {
            buckets: vec![empty; BUCKETS],
            filled: [0; BUCKETS / GROUP],
            chunks: Vec::with_capacity(entries / CHUNK),
            free: NONE,
        }
    }

    /// The first bucket that is not empty.
    #[inline]
    pub(super) fn cheapest(&self) -> Option<usize> {
        let group = self.filled.iter().position(|bits| *bits != 0)?;
        Some(group * GROUP + self.filled[group].trailing_zeros() as usize)
    }

    /// How many entries each bucket holds.
    pub(super) fn counts(&self) -> impl Iterator<Item = usize> + '_ {
        self.buckets.iter().map(|bucket| bucket.count as usize)
    }

    /// Takes the first entry of a bucket.
    #[inline]
    pub(super) fn pop(&mut self, number: usize) -> Option<Entry> {
        let bucket = self.buckets.get_mut(number).filter(|bucket| bucket.count > 0)?;
        let at = bucket.first;
        let chunk = self.chunks.get_mut(at as usize)?;
        let entry = *chunk.entries.get(bucket.start as usize)?;
        bucket.start += 1;
        bucket.count -= 1;
        if bucket.count == 0 || bucket.start == CHUNK as u32 {
            (bucket.first, bucket.start) = (std::mem::replace(&mut chunk.next, self.free), 0);
            self.free = at;
        }
        if bucket.count == 0 {
            (bucket.first, bucket.last, bucket.end) = (NONE, NONE, CHUNK as u32);
            self.filled[number / GROUP] &= !(1 << (number % GROUP));
        }
        Some(entry)
    }

    /// The entry that is taken from a bucket so many times from now, fewer than a chunk's, if none comes before; `None` where that is not known at once.
    #[inline]
    pub(super) fn ahead(&self, number: usize, times: usize) -> Option<Entry> {
        let bucket = self.buckets.get(number).filter(|bucket| bucket.count as usize > times)?;
        let at = bucket.start as usize + times;
        let first = self.chunks.get(bucket.first as usize)?;
        let chunk = if at < CHUNK { first } else { self.chunks.get(first.next as usize)? };
        chunk.entries.get(at % CHUNK).copied()
    }

    /// Adds an entry of a cost that is not negative.
    #[inline]
    pub(super) fn push(&mut self, cost: f32, entry: Entry) {
        let number = bucket(cost);
        if self.buckets[number].end == CHUNK as u32 {
            self.lengthen(number, entry);
        }
        let bucket = &mut self.buckets[number];
        self.chunks[bucket.last as usize].entries[bucket.end as usize] = entry;
        bucket.end += 1;
        bucket.count += 1;
    }

    /// Gives a bucket one more chunk, full of this entry.
    fn lengthen(&mut self, number: usize, entry: Entry) {
        let chunk = Chunk { entries: [entry; CHUNK], next: NONE };
        let at = self.free;
        let at = if let Some(free) = self.chunks.get_mut(at as usize) {
            self.free = std::mem::replace(free, chunk).next;
            at
        } else {
            self.chunks.push(chunk);
            self.chunks.len() as u32 - 1
        };
        let bucket = &mut self.buckets[number];
        let last = std::mem::replace(&mut bucket.last, at);
        bucket.end = 0;
        if let Some(last) = self.chunks.get_mut(last as usize) {
            last.next = at;
        } else {
            bucket.first = at;
            self.filled[number / GROUP] |= 1 << (number % GROUP);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn gives_entries_by_buckets_the_first_come_first(costs in prop::collection::vec((0u16..9, any::<bool>()), 0..60)) {
            let mut queue = Queue::new(0);
            // Bucket and number of each that is in the queue.
            let mut want: Vec<(usize, u32)> = Vec::new();
            for (number, (cost, takes)) in (0..).zip(costs) {
                let cost = f32::from(cost).powi(3);
                queue.push(cost, [number, 0]);
                want.push((bucket(cost), number));
                if takes {
                    want.sort_unstable();
                    let first = want.remove(0);
                    prop_assert_eq!(queue.cheapest(), Some(first.0));
                    prop_assert_eq!(queue.pop(first.0).map(|ends| ends[0]), Some(first.1));
                }
                prop_assert_eq!(queue.counts().sum::<usize>(), want.len());
            }
            want.sort_unstable();
            for (place, (at, number)) in want.iter().enumerate() {
                for times in 0..CHUNK {
                    let later = want.get(place + times).filter(|later| later.0 == *at).map(|later| later.1);
                    prop_assert_eq!(queue.ahead(*at, times).map(|ends| ends[0]), later);
                }
                prop_assert_eq!(queue.cheapest(), Some(*at));
                prop_assert_eq!(queue.pop(*at).map(|ends| ends[0]), Some(*number));
            }
            prop_assert_eq!(queue.cheapest(), None);
        }

        #[test]
        fn a_bucket_is_narrow_and_in_order(a in 0.0f32..1e30, share in 0.0f32..1.0) {
            let b = a * share;
            prop_assert!(bucket(b) <= bucket(a));
            prop_assert!(bucket(a) != bucket(b) || b * 1.0626 >= a);
        }
    }
}
