//! Reading ahead by what is known to come, for maps that do not stay in the page cache.
//!
//! A chunk's triangles lie in stretches of some kilobytes all over a part of the file, samples for the plan a page here and there, and
//! each thread reads a part of its own. The system, seeing faults at all these places, reads megabytes around each: a file of twice the
//! cache was read seven times over. So where it matters it is told not to guess, and asked for what is wanted a little before it is
//! wanted: every page is read about once a pass.

use rustix::mm::Advice;

use crate::contract::settings::Limits;
use crate::io::record::Record;
use crate::util::machine;

/// Records that the disk is asked for together where the file does not stay in the page cache.
const ASKED_AT_ONCE: usize = 8192;

/// Stretches closer than this are read as one: a seek costs more.
const GAP: usize = 64 << 10;
const PAGE: usize = 4096;
/// So little is not worth asking what the machine has left.
const ALWAYS_STAYS: usize = 16 << 20;
/// Bytes of a group of chunks; two are asked for at a time.
const SMALLEST_GROUP: u64 = 4 << 20;
const LARGEST_GROUP: u64 = 64 << 20;
/// Bytes asked for at a time where reading goes straight on.
const BLOCK: usize = 8 << 20;

/// How one map is read from now on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Guide<'a> {
    bytes: &'a [u8],
    /// What can stay of the map; `None` if all of it can, and nothing needs to be asked for.
    room: Option<u64>,
}

impl<'a> Guide<'a> {
    /// Looks at what the machine has left.
    pub(crate) fn new(bytes: &'a [u8], limits: &Limits) -> Self {
        if bytes.len() < ALWAYS_STAYS {
            return Self { bytes, room: None };
        }
        let room = machine::page_cache_room(limits.memory_bytes);
        let guide = Self { bytes, room: Some(room).filter(|room| bytes.len() as u64 > *room) };
        guide.advise(0, bytes.len(), if guide.is_needed() { Advice::Random } else { Advice::Normal });
        guide
    }

    /// For what is in memory, or will stay there.
    #[cfg(any(test, feature = "internals"))]
    pub(crate) const NONE: Self = Self { bytes: &[], room: None };

    /// The map does not stay in the page cache.
    pub(crate) fn is_needed(&self) -> bool {
        self.room.is_some()
    }

    /// How many of so many chunks are to be asked for at a time, if at all.
    pub(crate) fn group(&self, chunks: usize) -> Option<usize> {
        let of_group = (self.room? / 4).clamp(SMALLEST_GROUP, LARGEST_GROUP);
        Some((chunks as u64 * of_group / self.bytes.len().max(1) as u64).max(1) as usize)
    }

    /// Asks for these runs of records (first and count, in any order), if the map is an array of them.
    pub(crate) fn ask_for(&self, runs: impl Iterator<Item = (u32, u32)>) {
        if self.is_needed() {
            let at = |number: usize| number * size_of::<Record>();
            let mut stretches: Vec<(usize, usize)> =
                runs.map(|(first, count)| (at(first as usize), at(first as usize + count as usize))).collect();
            for (from, to) in joined(&mut stretches) {
                self.advise(from, to, Advice::WillNeed);
            }
        }
    }

    /// The same items in the same order; the disk is asked for the records they are about, a block of items before they come.
    pub(crate) fn ahead<T>(
        &self,
        mut items: impl Iterator<Item = T>,
        number: impl Fn(&T) -> Option<u32>,
    ) -> impl Iterator<Item = T> {
        let mut block = move || {
            let block: Vec<T> = items.by_ref().take(ASKED_AT_ONCE).collect();
            self.ask_for(block.iter().filter_map(&number).map(|number| (number, 1)));
            block
        };
        let mut soon = block();
        let blocks = std::iter::from_fn(move || (!soon.is_empty()).then(|| std::mem::replace(&mut soon, block())));
        blocks.flatten()
    }

    /// Cuts a part of the map, as something else than bytes, into blocks to be read one after the other, and asks for each of them while
    /// the one before it is worked on. All of it is one block where nothing needs to be asked for.
    pub(crate) fn blocks<T>(self, part: &'a [T]) -> impl Iterator<Item = &'a [T]> {
        let size = if self.is_needed() { (BLOCK / size_of::<T>()).max(1) } else { part.len().max(1) };
        let start = (part.as_ptr() as usize).saturating_sub(self.bytes.as_ptr() as usize);
        let ask = move |block: usize| {
            if self.is_needed() {
                let at = |block: usize| start + (block * size).min(part.len()) * size_of::<T>();
                self.advise(at(block), at(block + 1), Advice::WillNeed);
            }
        };
        ask(0);
        part.chunks(size).enumerate().map(move |(i, block)| {
            ask(i + 1);
            block
        })
    }

    /// For reading that goes straight on with gaps: asks for a block or two beyond `part`, a part of the map. `asked` is how far that was
    /// done before, 0 to begin with.
    pub(crate) fn keep_ahead(&self, asked: &mut usize, part: &[u8]) {
        if self.is_needed() {
            let start = (part.as_ptr() as usize).saturating_sub(self.bytes.as_ptr() as usize);
            *asked = (*asked).max(start);
            while *asked < (start + part.len() + BLOCK).min(self.bytes.len()) {
                self.advise(*asked, *asked + BLOCK, Advice::WillNeed);
                *asked += BLOCK;
            }
        }
    }

    /// Only advice: without it the reading is slower.
    fn advise(&self, from: usize, to: usize, advice: Advice) {
        let to = to.min(self.bytes.len());
        if from < to {
            let start = (self.bytes.as_ptr() as usize + from) / PAGE * PAGE;
            let length = self.bytes.as_ptr() as usize + to - start;
            // SAFETY: the kinds of advice that are given here change when pages are read, never what is in them; and the pages are those
            // that hold these bytes, the first one from its beginning.
            let _ = unsafe { rustix::mm::madvise(start as *mut std::ffi::c_void, length, advice) };
        }
    }
}

/// Stretches (from, to) of bytes that are near each other as one.
fn joined(stretches: &mut [(usize, usize)]) -> Vec<(usize, usize)> {
    stretches.sort_unstable();
    let mut all: Vec<(usize, usize)> = Vec::new();
    for (from, to) in stretches {
        match all.last_mut() {
            Some((_, end)) if *from <= *end + GAP => *end = (*end).max(*to),
            _ => all.push((*from, *to)),
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_near_is_read_as_one() {
        let mut stretches =
            [(100_000, 100_100), (0, 10), (10, 20), (2, 4), (100_100 + GAP, 190_000), (190_001 + GAP, 190_002 + GAP)];
        assert_eq!(joined(&mut stretches), [(0, 20), (100_000, 190_000), (190_001 + GAP, 190_002 + GAP)]);
    }

    #[test]
    fn blocks_are_the_whole_in_order_and_nothing_changes() {
        let records: Vec<Record> = (0..400_000u32).map(|i| [i as u8; 50]).collect();
        let bytes = records.as_flattened();
        for (room, blocks) in [(None, 1), (Some(0), 3)] {
            let guide = Guide { bytes, room };
            let got: Vec<&[Record]> = guide.blocks(&records).collect();
            assert_eq!(got.len(), blocks);
            guide.ask_for([(399_999, 1), (0, 1), (70, 0)].into_iter());
            assert!(got.concat() == records);
            let tail: Vec<u8> = guide.blocks(&bytes[bytes.len() - 7..]).flatten().copied().collect();
            assert_eq!(tail, [399_999u32 as u8; 7]);
            let mut asked = 0;
            guide.keep_ahead(&mut asked, &bytes[..100]);
            guide.keep_ahead(&mut asked, &bytes[5000..6000]);
            assert_eq!(asked, if room.is_some() { 2 * BLOCK } else { 0 }, "the block of the part, and one more");
            assert_eq!(guide.blocks(&records[..0]).map(<[Record]>::len).sum::<usize>(), 0);
        }
    }

    #[test]
    fn a_file_that_stays_in_the_page_cache_needs_no_groups() {
        let bytes = vec![0; 16 << 20];
        assert_eq!(Guide { bytes: &bytes, room: None }.group(1000), None);
        assert_eq!(Guide { bytes: &bytes, room: Some(0) }.group(1000), Some(250), "4 of 16 MiB");
        assert_eq!(Guide { bytes: &bytes, room: Some(0) }.group(1), Some(1));
        assert!(!Guide::new(&bytes[..100], &Limits { memory_bytes: 1 << 20, ..Limits::default() }).is_needed());
    }
}
