//! Where triangles come from: the records of a mapped file, or the entries of a spool.

use crate::geometry::sums::Bounds;
use crate::io::read_ahead::Guide;
use crate::io::record::{self, Point, Record};
use crate::stream::run_list::RunList;
use crate::stream::spool::{self, Entry};
use crate::stream::stretches::Stretches;

/// A triangle where it lies. Its corners are decoded only when they are asked for.
pub(crate) trait Triangle: Copy {
    /// The three corners, in file order.
    fn corners(self) -> [Point; 3];
}

impl Triangle for &Record {
    #[inline(always)]
    fn corners(self) -> [Point; 3] {
        record::corners(self)
    }
}

impl Triangle for &Entry {
    #[inline(always)]
    fn corners(self) -> [Point; 3] {
        spool::corners(self)
    }
}

/// Triangles with their numbers, ascending.
pub(crate) trait Source {
    type Triangle: Triangle;

    /// How many there are.
    fn count(&self) -> usize;

    fn for_each(&self, visit: impl FnMut(u32, Self::Triangle));
}

/// Triangles of the file itself, by lists of runs.
#[derive(Clone, Copy)]
pub(crate) struct Mapped<'a> {
    pub(crate) records: &'a [Record],
    /// Each goes on where the one before it ends.
    pub(crate) lists: &'a [RunList],
    pub(crate) stretches: &'a Stretches,
    pub(crate) guide: &'a Guide<'a>,
}

impl Mapped<'_> {
    /// Asks the disk for what is [near](Seen::each_near), where that is read anew: often a small part of the chunk.
    fn ask_for<S>(&self, state: &mut S, near: &impl Fn(&mut S, &Bounds) -> bool) {
        if self.guide.is_needed() {
            let mut parts = Vec::new();
            for run in self.lists.iter().flat_map(RunList::runs) {
                self.stretches.each_near(run, state, near, |_, from, count| parts.push((from, count)));
            }
            self.guide.ask_for(parts.into_iter());
        }
    }
}

impl<'a> Source for Mapped<'a> {
    type Triangle = &'a Record;

    fn count(&self) -> usize {
        self.lists.iter().flat_map(RunList::runs).map(|(_, count)| count as usize).sum()
    }

    #[inline(always)]
    fn for_each(&self, mut visit: impl FnMut(u32, &'a Record)) {
        for (first, count) in self.lists.iter().flat_map(RunList::runs) {
            let run = &self.records[first as usize..first as usize + count as usize];
            for (i, record) in run.iter().enumerate() {
                record::prefetch_after(record);
                visit(first + i as u32, record);
            }
        }
    }
}

/// Triangles copied out of a spool.
#[derive(Clone, Copy)]
pub(crate) struct Spooled<'a> {
    pub(crate) entries: &'a [Entry],
}

impl<'a> Source for Spooled<'a> {
    type Triangle = &'a Entry;

    fn count(&self) -> usize {
        self.entries.len()
    }

    #[inline(always)]
    fn for_each(&self, mut visit: impl FnMut(u32, &'a Entry)) {
        for entry in self.entries {
            visit(spool::number(entry), entry);
        }
    }
}

/// The triangles that a chunk sees.
#[derive(Clone, Copy)]
pub(crate) enum Seen<'a> {
    Mapped(Mapped<'a>),
    Spooled(Spooled<'a>),
}

/// Either kind of triangle, for code that is not hot enough to be made for both.
#[derive(Clone, Copy)]
pub(crate) enum Either<'a> {
    Record(&'a Record),
    Entry(&'a Entry),
}

impl Triangle for Either<'_> {
    #[inline]
    fn corners(self) -> [Point; 3] {
        match self {
            Self::Record(record) => record.corners(),
            Self::Entry(entry) => entry.corners(),
        }
    }
}

impl<'a> Source for Seen<'a> {
    type Triangle = Either<'a>;

    fn count(&self) -> usize {
        match self {
            Self::Mapped(source) => source.count(),
            Self::Spooled(source) => source.count(),
        }
    }

    #[inline(always)]
    fn for_each(&self, mut visit: impl FnMut(u32, Either<'a>)) {
        match self {
            Self::Mapped(source) => source.for_each(|number, record| visit(number, Either::Record(record))),
            Self::Spooled(source) => source.for_each(|number, entry| visit(number, Either::Entry(entry))),
        }
    }
}

impl<'a> Seen<'a> {
    /// As [`Source::for_each`], each triangle with its place among them. Passes over triangles whose stretch of the file lies in no box that is
    /// `near`, as far as boxes are known: what `near` does to `state` is there for the triangles of that stretch. It may be asked twice.
    #[inline(always)]
    pub(crate) fn each_near<S>(
        &self,
        state: &mut S,
        near: &impl Fn(&mut S, &Bounds) -> bool,
        mut visit: impl FnMut(&mut S, usize, u32, Either<'a>),
    ) {
        match self {
            Self::Mapped(source) => {
                source.ask_for(state, near);
                let mut before = 0;
                for (first, count) in source.lists.iter().flat_map(RunList::runs) {
                    source.stretches.each_near((first, count), state, near, |state, from, count| {
                        let place = before + (from - first) as usize;
                        for (i, record) in source.records[from as usize..from as usize + count as usize].iter().enumerate() {
                            record::prefetch_after(record);
                            visit(state, place + i, from + i as u32, Either::Record(record));
                        }
                    });
                    before += count as usize;
                }
            }
            Self::Spooled(source) => {
                let all = source.entries.iter().enumerate();
                all.for_each(|(place, entry)| visit(state, place, spool::number(entry), Either::Entry(entry)));
            }
        }
    }
}
