//! Reading ahead by what is known to come, for maps that do not stay in the page cache.
//!
//! A chunk's triangles lie in stretches of some kilobytes all over a part of the file, samples for the plan a page here and there, and
//! each thread reads a part of its own. The system, seeing faults at all these places, reads megabytes around each: a file of twice the
//! cache was read seven times over. So where it matters it is told not to guess, and asked for what is wanted a little before it is
//! wanted: every page is read about once a pass. Where a pass goes on in order, the system guesses right, and is left to it.

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
/// Bytes of a block where reading goes straight on.
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

    /// Cuts a part of the map, as something else than bytes, into blocks to be read one after the other, each [in order](Self::in_order): others
    /// may read elsewhere in the map meanwhile. All of it is one block where all of it stays.
    pub(crate) fn blocks<T>(self, part: &'a [T]) -> impl Iterator<Item = &'a [T]> {
        let size = if self.is_needed() { (BLOCK / size_of::<T>()).max(1) } else { part.len().max(1) };
        let mut in_order = None;
        part.chunks(size).enumerate().map(move |(i, block)| {
            // The one before ends first, which is about this block, too.
            drop(in_order.take());
            in_order = Some(self.in_order(&part[i * size..part.len().min((i + 2) * size)]));
            block
        })
    }

    /// Until the result is dropped, the system reads ahead by itself in this part of the map, which is read in order, maybe with gaps. In order it
    /// guesses right, and it reads, charges and gives up pages by the hundred then (large folios: XFS since Linux 5.18, ext4 since 6.16).
    /// Measured, 2.5 GB, ext4, 6.18, a cgroup of 272 MiB, two threads: 0.37 s of system time, 1.23 s where each block is asked for.
    pub(crate) fn in_order<T>(self, part: &[T]) -> InOrder<'a> {
        let from = (part.as_ptr() as usize).saturating_sub(self.bytes.as_ptr() as usize);
        let order = InOrder { guide: self, from, to: from + size_of_val(part) };
        order.advise(Advice::Normal);
        order
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

/// A part of a map that is read in order.
#[derive(Debug)]
pub(crate) struct InOrder<'a> {
    guide: Guide<'a>,
    from: usize,
    to: usize,
}

impl InOrder<'_> {
    fn advise(&self, advice: Advice) {
        if self.guide.is_needed() {
            self.guide.advise(self.from, self.to, advice);
        }
    }
}

impl Drop for InOrder<'_> {
    fn drop(&mut self) {
        self.advise(Advice::Random);
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

    /// Whether the system reads only what is asked for at this address of a map.
    fn is_random(at: *const u8) -> bool {
        let maps = std::fs::read_to_string("/proc/self/smaps").unwrap();
        let mut holds = false;
        for line in maps.lines() {
            let range = line.split_once(' ').and_then(|(range, _)| range.split_once('-'));
            let ends = range.map(|(from, to)| [from, to].map(|end| usize::from_str_radix(end, 16)));
            match (ends, line.strip_prefix("VmFlags:")) {
                (Some([Ok(from), Ok(to)]), _) => holds = (from..to).contains(&(at as usize)),
                (_, Some(flags)) if holds => return flags.split(' ').any(|flag| flag == "rr"),
                _ => {}
            }
        }
        panic!("no map is there");
    }

    #[test]
    fn the_system_reads_ahead_in_this_block_and_the_next_alone() {
        let file = tempfile::tempfile().unwrap();
        file.set_len(5 * BLOCK as u64).unwrap();
        // SAFETY: nobody else knows the file.
        let map = unsafe { memmap2::Mmap::map(&file) }.unwrap();
        let guide = Guide { bytes: &map, room: Some(0) };
        guide.advise(0, map.len(), Advice::Random);
        let random = || -> Vec<bool> { map.chunks(BLOCK).map(|block| is_random(block.as_ptr())).collect() };
        let mut blocks = guide.blocks(&map[BLOCK..]);
        assert_eq!(random(), [true; 5]);
        blocks.next();
        assert_eq!(random(), [true, false, false, true, true]);
        blocks.next();
        assert_eq!(random(), [true, true, false, false, true]);
        drop(blocks);
        assert_eq!(random(), [true; 5]);
        let part = guide.in_order(&map[..3 * BLOCK]);
        assert_eq!(random(), [false, false, false, true, true]);
        drop(part);
        assert_eq!(random(), [true; 5]);
    }
}
