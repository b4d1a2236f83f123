//! Triangles sorted by place through a file without a name, for inputs whose order has nothing to do with where triangles lie.
//!
//! Each chunk of such an input has its triangles all over the map, so a map larger than the page cache would be read from the disk
//! once for every few chunks. Instead, the pass that finds out who sees what appends every triangle, as its number and its corners, to
//! the **bucket** where it is at home: a subtree of the plan. When a bucket's turn comes, it is read in one go and sorted into its chunks
//! in memory. A file sorted by chunks would need a buffer for each; with buckets, what the buffers take and what loaded buckets take
//! are balanced, and both grow with the square root of the input only.
//!
//! 40 bytes are written and read once a triangle (more where one lies across buckets). Entries are in ascending order of their numbers
//! within each bucket, so a chunk sees what it would see in the map, in the same order.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use memmap2::{Advice, Mmap};

use crate::contract::error::{Error, Result};
use crate::contract::settings::Limits;
use crate::io::record::{Point, Record};
use crate::io::write_behind::{self, WriteBehind};
use crate::stream::budget::{Budget, Purpose};
use crate::stream::plan::{ChunkId, HomeBox, Plan};

/// A triangle's number and its corners, bytes 12 to 48 of its record.
pub(crate) type Entry = [u8; ENTRY];

const ENTRY: usize = 40;

#[inline(always)]
pub(crate) fn number(entry: &Entry) -> u32 {
    u32::from_le_bytes([entry[0], entry[1], entry[2], entry[3]])
}

#[inline(always)]
pub(crate) fn corners(entry: &Entry) -> [Point; 3] {
    let float = |at: usize| f32::from_le_bytes([entry[at], entry[at + 1], entry[at + 2], entry[at + 3]]);
    let point = |at: usize| [float(at), float(at + 4), float(at + 8)];
    [point(4), point(16), point(28)]
}

/// How a spool is cut.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layout {
    /// A bucket holds 2^shift chunks.
    shift: u32,
    /// Entries collected before they are written.
    buffer: usize,
}

/// Buffers of less than this make the disk seek more than it reads.
const SMALLEST_BUFFER: u64 = 4 << 10;
const LARGEST_BUFFER: u64 = 256 << 10;
/// Buckets there are at least, so that all threads find work.
const FEWEST_BUCKETS: u64 = 16;

impl Layout {
    /// For so many triangles: an eighth of the budget each for the buffers of all threads and for their loaded buckets.
    pub(crate) fn new(triangles: usize, plan: &Plan, limits: &Limits) -> Self {
        let share = limits.memory_bytes / 8 / limits.threads.max(1) as u64;
        let bytes = triangles as u64 * ENTRY as u64;
        let buckets = bytes.div_ceil(share.max(1 << 20)).max(FEWEST_BUCKETS).next_power_of_two().min(plan.chunks() as u64);
        let buffer = (share / buckets).clamp(SMALLEST_BUFFER, LARGEST_BUFFER) / ENTRY as u64;
        Self { shift: (plan.chunks() as u64 / buckets).trailing_zeros(), buffer: buffer as usize }
    }

    pub(crate) fn bucket(&self, chunk: ChunkId) -> usize {
        chunk.0 as usize >> self.shift
    }

    /// Memory that the writers of all threads take, in bytes.
    fn writers_bytes(&self, plan: &Plan, threads: usize) -> u64 {
        ((plan.chunks() >> self.shift) * self.buffer * ENTRY + plan.chunks() * 8) as u64 * threads as u64
    }
}

/// A stretch of the spool that belongs to one bucket.
#[derive(Clone, Copy, Debug)]
struct Extent {
    at: u64,
    entries: usize,
}

/// A spool that is being written, by several writers at a time.
pub(crate) struct Unsorted {
    layout: Layout,
    folder: PathBuf,
    file: File,
    behind: WriteBehind,
    /// Where the next extent goes: the file grows at its end only.
    end: AtomicU64,
}

impl Unsorted {
    /// Refuses the work on `path` if the writers, or the pages they make dirty, do not fit the budget.
    pub(crate) fn new(path: &Path, layout: Layout, plan: &Plan, limits: &Limits) -> Result<Self> {
        let budget = Budget::new(limits.memory_bytes);
        budget.take(Purpose::Tables, layout.writers_bytes(plan, limits.threads) + write_behind::most_dirty(limits));
        budget.check(path, || "its triangles have to be sorted by place".into())?;
        let folder = limits.spool_folder();
        let (file, behind) = write_behind::nameless(&folder, limits)?;
        Ok(Self { layout, folder, file, behind, end: AtomicU64::new(0) })
    }

    /// A writer for one stretch of the input.
    pub(crate) fn writer(&self, chunks: usize) -> Writer<'_> {
        let buckets = chunks >> self.layout.shift;
        Writer {
            spool: self,
            buffers: vec![Vec::new(); buckets],
            extents: vec![Vec::new(); buckets],
            members: vec![0; chunks],
            visitors: vec![0; chunks],
            failed: None,
        }
    }

    /// Joins what was written for consecutive stretches of the input.
    pub(crate) fn sorted(self, parts: Vec<Part>, chunks: usize, reach: f32) -> Result<Spool> {
        let failed = Error::io(&self.folder, "spooling");
        let mut extents = vec![Vec::new(); chunks >> self.layout.shift];
        let (mut members, mut visitors) = (vec![0u32; chunks], vec![0u32; chunks]);
        for part in parts {
            let part = match part.0 {
                Ok(part) => part,
                Err(error) => return Err(failed(error)),
            };
            extents.iter_mut().zip(part.extents).for_each(|(all, more)| all.extend(more));
            members.iter_mut().zip(part.members).for_each(|(all, more)| *all += more);
            visitors.iter_mut().zip(part.visitors).for_each(|(all, more)| *all += more);
        }
        // Synced, so that no dirty pages are left to count against what comes next.
        // SAFETY: the file has no name and nobody writes to it any more: no one changes or truncates it.
        let map = || self.behind.finish().and_then(|()| self.file.sync_data()).and_then(|()| unsafe { Mmap::map(&self.file) });
        let map = if self.end.into_inner() > 0 { Some(map().map_err(failed)?) } else { None };
        Ok(Spool { map, extents, members, visitors, shift: self.layout.shift, reach })
    }
}

/// Appends the triangles of one stretch of the input to their buckets.
pub(crate) struct Writer<'a> {
    spool: &'a Unsorted,
    buffers: Vec<Vec<u8>>,
    extents: Vec<Vec<Extent>>,
    members: Vec<u32>,
    visitors: Vec<u32>,
    failed: Option<io::Error>,
}

/// The part of a spool that a writer leaves behind.
pub(crate) struct Part(io::Result<PartSpooled>);

struct PartSpooled {
    extents: Vec<Vec<Extent>>,
    members: Vec<u32>,
    visitors: Vec<u32>,
}

impl Writer<'_> {
    /// Triangles that are members of this chunk alone.
    pub(crate) fn take_run(&mut self, chunk: ChunkId, first: u32, run: &[Record]) {
        self.members[chunk.0 as usize] += run.len() as u32;
        let bucket = self.spool.layout.bucket(chunk);
        for (i, record) in run.iter().enumerate() {
            self.put(bucket, first + i as u32, record);
        }
    }

    /// A triangle that is a member of all `members` and a visitor of all `visitors`, which are all distinct.
    pub(crate) fn take(&mut self, members: &[ChunkId], visitors: &[ChunkId], number: u32, record: &Record) {
        members.iter().for_each(|c| self.members[c.0 as usize] += 1);
        visitors.iter().for_each(|c| self.visitors[c.0 as usize] += 1);
        let layout = self.spool.layout;
        // Once for each bucket. Visited chunks come in order, those of a bucket together.
        let (mut last, bucket) = (usize::MAX, |c: &ChunkId| layout.bucket(*c));
        for (k, chunk) in members.iter().enumerate() {
            if !members[..k].iter().any(|c| bucket(c) == bucket(chunk)) {
                self.put(bucket(chunk), number, record);
            }
        }
        for own in visitors.iter().map(bucket) {
            if own != last && !members.iter().any(|c| bucket(c) == own) {
                self.put(own, number, record);
            }
            last = own;
        }
    }

    #[inline]
    fn put(&mut self, bucket: usize, number: u32, record: &Record) {
        let full = self.spool.layout.buffer * ENTRY;
        let buffer = &mut self.buffers[bucket];
        if buffer.capacity() == 0 {
            buffer.reserve_exact(full);
        }
        buffer.extend_from_slice(&number.to_le_bytes());
        buffer.extend_from_slice(&record[12..48]);
        if buffer.len() >= full {
            self.flush(bucket);
        }
    }

    fn flush(&mut self, bucket: usize) {
        let buffer = &mut self.buffers[bucket];
        let bytes = buffer.len() as u64;
        if self.failed.is_none() && bytes > 0 {
            let at = self.spool.end.fetch_add(bytes, Ordering::Relaxed);
            let written = self.spool.file.write_all_at(buffer, at).and_then(|()| self.spool.behind.wrote(bytes));
            self.failed = written.err();
            self.extents[bucket].push(Extent { at, entries: buffer.len() / ENTRY });
        }
        buffer.clear();
    }

    /// A write has failed; nothing more is taken.
    pub(crate) fn has_failed(&self) -> bool {
        self.failed.is_some()
    }

    pub(crate) fn finish(mut self) -> Part {
        (0..self.buffers.len()).for_each(|bucket| self.flush(bucket));
        Part(match self.failed {
            Some(error) => Err(error),
            None => Ok(PartSpooled { extents: self.extents, members: self.members, visitors: self.visitors }),
        })
    }
}

/// Triangles in buckets, each in ascending order.
#[derive(Debug)]
pub(crate) struct Spool {
    /// `None` if there is nothing in it.
    map: Option<Mmap>,
    /// Of each bucket, in the order of the triangles.
    extents: Vec<Vec<Extent>>,
    /// How many members and visitors each chunk has.
    members: Vec<u32>,
    visitors: Vec<u32>,
    shift: u32,
    /// How near to a cell its visitors come.
    reach: f32,
}

/// One bucket, sorted into its chunks. Keeps its memory from bucket to bucket.
#[derive(Default)]
pub(crate) struct Loaded {
    entries: Vec<Entry>,
    /// The bucket's first chunk, and where each chunk's members and then its visitors begin.
    first: usize,
    starts: Vec<usize>,
}

impl Loaded {
    /// Members of a chunk of the bucket.
    pub(crate) fn members(&self, chunk: ChunkId) -> &[Entry] {
        self.part(2 * (chunk.0 as usize - self.first))
    }

    /// Its visitors.
    pub(crate) fn visitors(&self, chunk: ChunkId) -> &[Entry] {
        self.part(2 * (chunk.0 as usize - self.first) + 1)
    }

    fn part(&self, at: usize) -> &[Entry] {
        &self.entries[self.starts[at]..self.starts[at + 1]]
    }
}

impl Spool {
    pub(crate) fn buckets(&self) -> usize {
        self.extents.len()
    }

    /// The chunks of a bucket.
    pub(crate) fn chunks(&self, bucket: usize) -> impl Iterator<Item = ChunkId> + use<> {
        (bucket << self.shift..(bucket + 1) << self.shift).map(|c| ChunkId(c as u32))
    }

    /// Members of `chunk` and its visitors.
    pub(crate) fn seen(&self, chunk: ChunkId) -> u64 {
        u64::from(self.members[chunk.0 as usize]) + u64::from(self.visitors[chunk.0 as usize])
    }

    /// Memory that loading takes when each thread holds one of the largest buckets, in bytes.
    pub(crate) fn loaded_bytes(&self, threads: usize) -> u64 {
        let mut buckets: Vec<u64> = (0..self.buckets()).map(|b| self.chunks(b).map(|c| self.seen(c)).sum()).collect();
        buckets.sort_unstable_by(|a, b| b.cmp(a));
        buckets.iter().take(threads).sum::<u64>() * ENTRY as u64
    }

    /// Bytes held.
    pub(crate) fn heap_bytes(&self) -> usize {
        self.extents.iter().map(|e| e.capacity() * size_of::<Extent>() + 24).sum::<usize>() + self.members.len() * 8
    }

    /// Reads a bucket. O(its entries × depth of a bucket in the plan).
    pub(crate) fn load(&self, plan: &Plan, bucket: usize, into: &mut Loaded) {
        let chunks = bucket << self.shift..(bucket + 1) << self.shift;
        into.first = chunks.start;
        into.starts.clear();
        into.starts.push(0);
        let mut end = 0;
        for count in chunks.flat_map(|c| [self.members[c], self.visitors[c]]) {
            end += count as usize;
            into.starts.push(end);
        }
        into.entries.clear();
        into.entries.resize(end, [0; ENTRY]);
        let mut next = into.starts.clone();
        let visited = self.chunks(bucket).any(|c| self.visitors[c.0 as usize] > 0);
        let Some(map) = &self.map else { return };
        // Advice, so that the disk is asked for all of them at once; without it the reading is only slower.
        for extent in &self.extents[bucket] {
            let _ = map.advise_range(Advice::WillNeed, extent.at as usize, extent.entries * ENTRY);
        }
        for extent in &self.extents[bucket] {
            let at = extent.at as usize;
            for entry in map[at..at + extent.entries * ENTRY].as_chunks::<ENTRY>().0 {
                let corners = corners(entry);
                let homes = corners.map(|p| plan.home_below(self.shift, bucket, p));
                let mut put = |at: usize| {
                    into.entries[next[at]] = *entry;
                    next[at] += 1;
                };
                let part_of = |home: ChunkId| 2 * (home.0 as usize - into.first);
                if let [Some(home), b, c] = homes
                    && b == homes[0]
                    && c == homes[0]
                    && (self.reach == 0.0 || !visited)
                {
                    put(part_of(home));
                    continue;
                }
                for k in 0..3 {
                    if let Some(home) = homes[k]
                        && !homes[..k].contains(&homes[k])
                    {
                        put(part_of(home));
                    }
                }
                if visited {
                    let (lo, hi) = HomeBox::around(&corners, self.reach).ends();
                    plan.meeting_below(self.shift, bucket, lo, hi, &mut |chunk| {
                        if !homes.contains(&Some(chunk)) {
                            put(part_of(chunk) + 1);
                        }
                    });
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::record;

    /// A plate of many triangles in an order that has nothing to do with their place, cut into extents of three triangles.
    #[test]
    fn buckets_give_back_what_was_written_in_its_order() {
        let at = |i: usize| {
            let [x, y] = [(i * 7919 % 1000 % 40) as f32, (i * 7919 % 1000 / 40) as f32];
            record::encode([[x, y, 0.0], [x + 1.0, y, 0.0], [x, y + 1.0, 0.0]], i as u16)
        };
        let records: Vec<Record> = (0..1000).map(at).collect();
        let plan = Plan::new(&records, &crate::io::read_ahead::Guide::NONE, 8);
        for (shift, buffer) in [(0, 3), (3, 3), (2, 1), (7, 1000)] {
            let limits = Limits::default();
            let spool = Unsorted::new(Path::new("test"), Layout { shift, buffer }, &plan, &limits).unwrap();
            // Two stretches, the second one written first.
            let homes = |r: &Record| {
                let mut homes: Vec<ChunkId> = record::corners(r).iter().map(|p| plan.home(*p)).collect();
                homes.sort_unstable();
                homes.dedup();
                homes
            };
            let write = |range: std::ops::Range<usize>| {
                let mut writer = spool.writer(plan.chunks());
                range.for_each(|i| writer.take(&homes(&records[i]), &[], i as u32, &records[i]));
                writer.finish()
            };
            let second = write(400..1000);
            let first = write(0..400);
            let spool = spool.sorted(vec![first, second], plan.chunks(), 0.0).unwrap();
            let mut loaded = Loaded::default();
            let mut found = 0;
            for bucket in 0..spool.buckets() {
                spool.load(&plan, bucket, &mut loaded);
                for chunk in spool.chunks(bucket) {
                    let want: Vec<usize> = (0..1000).filter(|i| homes(&records[*i]).contains(&chunk)).collect();
                    let got: Vec<usize> = loaded.members(chunk).iter().map(|e| number(e) as usize).collect();
                    assert_eq!(got, want, "{shift} {buffer}");
                    assert!(loaded.members(chunk).iter().zip(want).all(|(e, i)| corners(e) == record::corners(&records[i])));
                    found += got.len() as u64;
                }
            }
            assert!(found >= 1000 && spool.loaded_bytes(spool.buckets()) == found * ENTRY as u64);
        }
    }
}
