//! Elements in binary files.
//!
//! Rows with lists have no common length: one thread goes over the lengths alone and cuts the section into pieces, which are then read in parallel.

use super::cursor::{Collector, Cursor, Notes, Sink};
use super::layout::{Layout, Scalar, ShortList, Step};
use crate::contract::error::Result;
use crate::io::read::limits::window;
use crate::io::read::spool::Context;

/// Bytes of rows that are read at a time by one thread, and items of their lists: an item may take one byte, and its triangle's record fifty.
const WINDOW: usize = window(256 << 10);
const ITEMS: usize = 128 << 10;
/// Pieces of a batch for each thread.
const PIECES: usize = 4;

/// A place among numbers, whose bytes begin with the highest where `BIG`.
#[derive(Clone, Debug)]
pub(in crate::io) struct Packed<'a, const BIG: bool> {
    pub(in crate::io) bytes: &'a [u8],
    pub(in crate::io) at: usize,
}

impl<const BIG: bool> Packed<'_, BIG> {
    #[inline(always)]
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let mut number: [u8; N] = *self.bytes.get(self.at..)?.first_chunk()?;
        self.at += N;
        if BIG {
            number.reverse();
        }
        Some(number)
    }

    #[inline(always)]
    fn wide(&mut self, kind: Scalar) -> Option<f64> {
        Some(match kind {
            Scalar::F32 => f32::from_le_bytes(self.take()?).into(),
            Scalar::F64 => f64::from_le_bytes(self.take()?),
            kind => self.whole(kind)? as f64,
        })
    }

    /// A whole number; [`i64::MIN`] for a fraction.
    #[inline(always)]
    fn whole(&mut self, kind: Scalar) -> Option<i64> {
        Some(match kind {
            Scalar::I8 => i8::from_le_bytes(self.take()?).into(),
            Scalar::U8 => u8::from_le_bytes(self.take()?).into(),
            Scalar::I16 => i16::from_le_bytes(self.take()?).into(),
            Scalar::U16 => u16::from_le_bytes(self.take()?).into(),
            Scalar::I32 => i32::from_le_bytes(self.take()?).into(),
            Scalar::U32 => u32::from_le_bytes(self.take()?).into(),
            Scalar::F32 => exactly(f32::from_le_bytes(self.take()?).into()),
            Scalar::F64 => exactly(f64::from_le_bytes(self.take()?)),
        })
    }
}

/// A whole number that is held as a float.
#[cold]
fn exactly(wide: f64) -> i64 {
    if wide.fract() == 0.0 && wide.abs() < 1e15 { wide as i64 } else { i64::MIN }
}

impl<const BIG: bool> Cursor for Packed<'_, BIG> {
    #[inline]
    fn skip(&mut self, _: usize, bytes: usize) -> Option<()> {
        self.at = self.at.checked_add(bytes).filter(|at| *at <= self.bytes.len())?;
        Some(())
    }

    #[inline]
    fn coordinate(&mut self, kind: Scalar, notes: &mut Notes) -> Option<f32> {
        Some(match kind {
            Scalar::F32 => f32::from_le_bytes(self.take()?),
            kind => notes.rounding.of_double(self.wide(kind)?),
        })
    }

    #[inline]
    fn length(&mut self, kind: Scalar, item: Scalar) -> Option<usize> {
        let length = usize::try_from(self.whole(kind)?).ok()?;
        (length <= (self.bytes.len() - self.at) / item.bytes()).then_some(length)
    }

    #[inline]
    fn index(&mut self, kind: Scalar) -> Option<i64> {
        self.whole(kind)
    }
}

/// A section of elements of one kind.
#[derive(Clone, Copy, Debug)]
pub(in crate::io) struct Section<'a, const BIG: bool> {
    /// The whole file.
    pub(in crate::io) bytes: &'a [u8],
    /// Where the section begins.
    pub(in crate::io) from: usize,
    /// So many are announced.
    pub(in crate::io) rows: u64,
    pub(in crate::io) layout: &'a Layout,
}

/// What was read of a section.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::io) struct Read {
    /// So many elements were there.
    pub(in crate::io) rows: u64,
    /// Where the section, or what there is of it, ends.
    pub(in crate::io) end: usize,
}

impl<'a, const BIG: bool> Section<'a, BIG> {
    /// Where the section ends, without looking at its elements if they are all of one length. O(rows) else.
    pub(in crate::io) fn pass(self) -> Read {
        let mut walk = Walk::new(self);
        match self.layout.stride() {
            Some(stride) => walk.stride(stride, self.rows),
            None => while walk.lists(usize::MAX, usize::MAX).rows > 0 {},
        }
        Read { rows: self.rows - walk.left, end: walk.at }
    }

    /// Reads the section.
    ///
    /// # Errors
    /// Those of `collector`, and [`crate::contract::error::Error::Io`] when the progress cancels.
    pub(in crate::io) fn read<S: Sink>(
        self,
        context: &Context<'_>,
        sink: &S,
        collector: &mut impl Collector<S::Made>,
    ) -> Result<Read> {
        let (mut walk, stride) = (Walk::new(self), self.layout.stride());
        let next = || {
            let mut pieces = Vec::new();
            while pieces.len() < rayon::current_num_threads() * PIECES {
                let piece = match stride {
                    Some(stride) => {
                        let (from, left) = (walk.at, walk.left);
                        walk.stride(stride, (WINDOW / stride.max(1)).max(1) as u64);
                        Piece { from, to: walk.at, rows: (left - walk.left) as usize }
                    }
                    None => walk.lists(WINDOW, ITEMS),
                };
                if piece.rows == 0 {
                    break;
                }
                pieces.push(piece);
            }
            Ok((pieces, walk.at as u64))
        };
        let parse = |piece: &Piece| {
            let mut cursor = Packed::<BIG> { bytes: self.bytes.get(..piece.to).unwrap_or_default(), at: piece.from };
            let mut made = sink.begin(piece.rows);
            for _ in 0..piece.rows {
                // The walk has seen that the row is there.
                let _ = sink.row(&mut cursor, &mut made);
            }
            made
        };
        context.in_order(self.bytes.len() as u64, next, parse, |made| collector.take(made))?;
        Ok(Read { rows: self.rows - walk.left, end: walk.at })
    }
}

/// Rows side by side.
#[derive(Clone, Copy, Debug)]
struct Piece {
    from: usize,
    to: usize,
    rows: usize,
}

/// Goes over a section.
struct Walk<'a, const BIG: bool> {
    section: Section<'a, BIG>,
    short: Option<ShortList>,
    at: usize,
    /// Elements that were not passed yet.
    left: u64,
}

impl<'a, const BIG: bool> Walk<'a, BIG> {
    fn new(section: Section<'a, BIG>) -> Self {
        Self { section, short: section.layout.short_list(), at: section.from, left: section.rows }
    }

    /// Passes up to `most` rows of one length.
    fn stride(&mut self, stride: usize, most: u64) {
        let there = (self.section.bytes.len() - self.at).checked_div(stride).map_or(u64::MAX, |rows| rows as u64);
        let rows = most.min(self.left).min(there);
        // No more bytes than there are.
        self.at += rows as usize * stride;
        self.left -= rows;
    }

    /// Passes rows of lists, until they have so many bytes or items. No rows: there is none left.
    fn lists(&mut self, bytes: usize, items: usize) -> Piece {
        let (from, mut rows, mut seen) = (self.at, 0, 0);
        while self.left > 0 && self.at - from < bytes && seen < items {
            let Some((end, length)) = self.row() else { break };
            self.at = end;
            self.left -= 1;
            rows += 1;
            seen += length;
        }
        Piece { from, to: self.at, rows }
    }

    /// Where the row ends, and how many items its lists have.
    #[inline]
    fn row(&self) -> Option<(usize, usize)> {
        let bytes = self.section.bytes;
        if let Some(short) = self.short {
            let length = usize::from(*bytes.get(self.at + short.before)?);
            let end = self.at + short.before + 1 + length * short.item + short.behind;
            return (end <= bytes.len()).then_some((end, length));
        }
        let (mut cursor, mut items) = (Packed::<BIG> { bytes, at: self.at }, 0);
        for step in self.section.layout.steps() {
            match *step {
                Step::List { length, item, .. } => {
                    let length = cursor.length(length, item)?;
                    cursor.skip(length, length * item.bytes())?;
                    items += length;
                }
                step => cursor.pass(step)?,
            }
        }
        Some((cursor.at, items))
    }
}
