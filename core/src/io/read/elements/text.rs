//! Elements in text: by the formats' papers numbers between blanks, in practice one element a line.
//!
//! Lines are read in parallel: the text is cut at line ends into pieces, whose lines are counted. Where a line has other numbers than an element,
//! the element's section is read once more as tokens, by one thread, if that ends where a line ends: then the writer broke lines elsewhere. If it does
//! not, a number is missing or too many. Then each line stands for one element, so that the damage of one does not shift those behind it.

use rayon::prelude::*;

use super::cursor::{Collector, Passed, Sink};
use super::layout::Layout;
use super::lines::{Line, count, end_of, ends_line};
use super::packed;
use crate::contract::error::Result;
use crate::io::read::limits::window;
use crate::io::read::spool::Context;

/// Text parsed at a time by one thread. A triangle of text takes two bytes at least, its record fifty.
const WINDOW: usize = window(256 << 10);
/// Pieces of a batch for each thread.
const PIECES: usize = 4;
/// Elements that are read as tokens before they are handed over.
const AT_ONCE: u64 = 32 << 10;

/// Whether more numbers may stand behind an element, until the line ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::io) enum Behind {
    Nothing,
    /// Where each element has a line of its own.
    IfLines,
    Always,
}

/// A section of elements of one kind.
#[derive(Clone, Copy, Debug)]
pub(in crate::io) struct Section<'a> {
    /// The whole text.
    pub(in crate::io) text: &'a [u8],
    /// Where the section begins.
    pub(in crate::io) from: usize,
    /// So many are announced.
    pub(in crate::io) rows: u64,
    /// `#` begins a comment.
    pub(in crate::io) comments: bool,
    pub(in crate::io) behind: Behind,
}

/// What was read of a section.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::io) struct Read {
    /// So many elements were there.
    pub(in crate::io) rows: u64,
    /// Those on a line with other numbers than an element has.
    pub(in crate::io) bent: u64,
    /// Where the section ends.
    pub(in crate::io) end: usize,
}

impl From<packed::Read> for Read {
    fn from(read: packed::Read) -> Self {
        Self { rows: read.rows, bent: 0, end: read.end }
    }
}

impl<'a> Section<'a> {
    /// Reads the section: by `lines`, or by `tokens`, of which `layout` is the layout.
    ///
    /// # Errors
    /// Those of `collector`, and [`crate::contract::error::Error::Io`] when the progress cancels.
    pub(in crate::io) fn read<S: Sink>(
        self,
        context: &Context<'_>,
        lines: &S,
        (tokens, layout): (&S, &Layout),
        collector: &mut impl Collector<S::Made>,
    ) -> Result<Read> {
        if layout.steps().is_empty() {
            return Ok(Read { rows: self.rows, bent: 0, end: self.from });
        }
        collector.keep();
        let read = self.by_lines(context, lines, collector)?;
        // Elements that share a line look like too few, or as if their numbers were other ones behind the first.
        let fits = read.bent == 0 && read.rows == self.rows;
        if fits || !self.fits_tokens(context, layout, read.rows == self.rows)? {
            return Ok(read);
        }
        collector.forget()?;
        self.by_tokens(context, tokens, collector)
    }

    /// Each line is an element.
    fn by_lines<S: Sink>(self, context: &Context<'_>, sink: &S, collector: &mut impl Collector<S::Made>) -> Result<Read> {
        let mut cutter = Cutter { section: self, at: self.from, left: self.rows };
        let mut bent = 0;
        let next = || {
            let pieces = cutter.batch(rayon::current_num_threads() * PIECES);
            Ok((pieces, cutter.at as u64, cutter.left))
        };
        let (mut left, mut end) = (self.rows, self.from);
        let mut next = next;
        let batch = || {
            let (pieces, done, rest) = next()?;
            (left, end) = (rest, done as usize);
            Ok((pieces, done))
        };
        let parse = |piece: &Piece<'a>| self.lines_of(*piece, sink);
        let take = |(made, odd): (S::Made, u64)| {
            bent += odd;
            collector.take(made)
        };
        context.in_order(self.text.len() as u64, batch, parse, take)?;
        Ok(Read { rows: self.rows - left, bent, end })
    }

    fn lines_of<S: Sink>(self, piece: Piece<'a>, sink: &S) -> (S::Made, u64) {
        let mut made = sink.begin(piece.rows);
        let mut line = Line { text: piece.text, at: 0, within: true, comments: self.comments };
        let mut bent = 0;
        for _ in 0..piece.rows {
            line.next_line();
            let whole = sink.row(&mut line, &mut made).is_some();
            let more = self.behind == Behind::Nothing && line.token().is_some();
            bent += u64::from(!whole || more);
            line.skip_line();
        }
        (made, bent)
    }

    /// Read as tokens, the section is whole and ends where a line does; or there are not `enough_lines`, so that it need not.
    fn fits_tokens(self, context: &Context<'_>, layout: &Layout, enough_lines: bool) -> Result<bool> {
        let read = self.by_tokens(context, &Passed(layout), &mut ())?;
        let mut line = Line { text: self.text, at: read.end, within: true, comments: self.comments };
        Ok(read.rows == self.rows && (!enough_lines || line.token().is_none()))
    }

    /// Line ends mean nothing.
    fn by_tokens<S: Sink>(self, context: &Context<'_>, sink: &S, collector: &mut impl Collector<S::Made>) -> Result<Read> {
        let mut line = Line { text: self.text, at: self.from, within: false, comments: self.comments };
        let mut rows = 0;
        let mut there = true;
        while there && rows < self.rows {
            let mut made = sink.begin(0);
            let until = self.rows.min(rows + AT_ONCE);
            while rows < until && there {
                there = line.token().is_some() && sink.row(&mut line, &mut made).is_some();
                rows += u64::from(there);
                if self.behind == Behind::Always {
                    line.skip_line();
                }
            }
            collector.take(made)?;
            context.at(line.at as u64, self.text.len() as u64)?;
        }
        Ok(Read { rows, bent: 0, end: line.at })
    }
}

/// A piece of a section, and how many of its lines are elements.
#[derive(Clone, Copy, Debug)]
struct Piece<'a> {
    text: &'a [u8],
    rows: usize,
}

/// Cuts a section into pieces.
struct Cutter<'a> {
    section: Section<'a>,
    at: usize,
    /// Elements that are not yet in a piece.
    left: u64,
}

impl<'a> Cutter<'a> {
    /// Up to so many pieces; none behind the section.
    fn batch(&mut self, pieces: usize) -> Vec<Piece<'a>> {
        let (text, comments) = (self.section.text, self.section.comments);
        let mut windows = Vec::with_capacity(pieces);
        let mut from = self.at;
        while self.left > 0 && windows.len() < pieces && from < text.len() {
            let rest = text.get(from + WINDOW..).unwrap_or_default();
            let to = rest.iter().position(|byte| ends_line(*byte)).map_or(text.len(), |end| from + WINDOW + end + 1);
            windows.push(text.get(from..to).unwrap_or_default());
            from = to;
        }
        let counts: Vec<usize> = windows.par_iter().map(|window| count(window, comments)).collect();
        let mut batch = Vec::with_capacity(pieces);
        for (window, lines) in windows.into_iter().zip(counts) {
            if self.left == 0 {
                break;
            }
            let rows = usize::try_from(self.left).map_or(lines, |left| left.min(lines));
            let end = if rows < lines { end_of(window, rows, comments) } else { window.len() };
            self.at += end;
            self.left -= rows as u64;
            batch.push(Piece { text: window.get(..end).unwrap_or_default(), rows });
        }
        self.cut_off(&mut batch);
        batch
    }

    /// Leaves the last line out of a text that ends too early without a line end: its last number may be cut, too.
    fn cut_off(&mut self, batch: &mut [Piece<'a>]) {
        let text = self.section.text;
        let open = text.last().is_some_and(|byte| !ends_line(*byte));
        if let Some(last) = batch.last_mut().filter(|last| last.rows > 0 && self.left > 0 && open && self.at == text.len()) {
            last.rows -= 1;
            self.left += 1;
        }
    }
}
