//! Vertices and triangles of the text into spools: cut into windows of about a megabyte, read in parallel, taken in their order.
//!
//! Where a window begins is a guess: a `<vertex` within a comment is none. So a window counts only if the one before it ended right there, between two
//! children; else everything behind that one is read again from there. Work: at most a constant times the length of the text.

use std::sync::atomic::{AtomicBool, Ordering};

use memchr::memmem;

use super::super::limits::window;
use super::super::rounding::Rounding;
use super::super::spool::{Context, Spool};
use super::stretch::{self, End, Indices, Kind, Notes, Position, Stretch};
use crate::contract::error::Result;

/// Text read at a time by one thread.
pub(super) const WINDOW: usize = window(1 << 20);
/// Text read before other threads are called: small objects are read by one.
const FIRST: usize = window(1 << 16);
/// Farther than this behind its window no child is read there, nor the next one looked for: [`FIRST`] reads on.
const SLACK: usize = 1 << 20;

/// What was read of vertices and triangles.
pub(super) struct Intake<'a> {
    pub(super) positions: Spool<'a, 24>,
    pub(super) indices: Spool<'a, 12>,
    pub(super) notes: Notes,
    /// Of the coordinates since it was taken out.
    pub(super) rounding: Rounding,
    /// Bytes of the text at which the progress was told.
    told: usize,
}

impl<'a> Intake<'a> {
    /// Of nothing yet.
    pub(super) fn new(context: &Context<'a>) -> Result<Self> {
        let (positions, indices) = (context.spool(u64::from(u32::MAX))?, context.spool(u64::from(u32::MAX))?);
        Ok(Self { positions, indices, notes: Notes::default(), rounding: Rounding::default(), told: 0 })
    }

    fn take(&mut self, stretch: Stretch) -> Result<()> {
        let Stretch { positions, indices, rounding, notes, .. } = stretch;
        let positions: Vec<Position> = positions;
        let indices: Vec<Indices> = indices;
        self.notes.append(notes);
        self.rounding.append(rounding);
        self.positions.append(&positions)?;
        self.indices.append(&indices)
    }

    /// Reads the children from byte `from` on, within `around` open elements. Gives the byte where they end, and why there; never
    /// [`End::Reached`].
    pub(super) fn read(
        &mut self,
        text: &[u8],
        from: usize,
        (kind, around): (Kind, usize),
        context: &Context<'_>,
    ) -> Result<(usize, End)> {
        let mut at = from;
        loop {
            let first = stretch::read(text, (at, at.saturating_add(FIRST)), kind, around);
            let end = first.end;
            at = first.at;
            self.take(first)?;
            if at - self.told.min(at) > WINDOW {
                self.told = at;
                context.at(at as u64, expected_steps(text))?;
            }
            if end != End::Reached {
                return Ok((at, end));
            }
            let (reached, end) = self.in_parallel(text, at, (kind, around), context)?;
            if end != End::Reached {
                return Ok((reached, end));
            }
            at = reached;
        }
    }

    fn in_parallel(
        &mut self,
        text: &[u8],
        from: usize,
        (kind, around): (Kind, usize),
        context: &Context<'_>,
    ) -> Result<(usize, End)> {
        let over = AtomicBool::new(false);
        let mut windows = Windows { text, kind, at: from, closed: false };
        let (mut at, mut end) = (from, End::Reached);
        let next = || {
            let most = if over.load(Ordering::Relaxed) { 0 } else { rayon::current_num_threads() * 2 * WINDOW };
            let batch = windows.batch(most);
            Ok((batch, windows.at as u64))
        };
        let parse = |&(from, until): &(usize, usize)| {
            let near = text.get(..until.saturating_add(SLACK)).unwrap_or(text);
            let mut stretch = stretch::read(near, (from, until), kind, around);
            if stretch.end == End::CutOff && near.len() < text.len() {
                stretch.end = End::Reached;
            }
            stretch
        };
        let take = |stretch: Stretch| {
            if end != End::Reached || stretch.from != at {
                over.store(true, Ordering::Relaxed);
                return Ok(());
            }
            (at, end) = (stretch.at, stretch.end);
            self.take(stretch)
        };
        context.in_order(expected_steps(text), next, parse, take)?;
        self.told = self.told.max(at);
        Ok((at, end))
    }
}

/// All steps of a reading in the words of its progress: bytes of the text, and as many as a quarter of them for placing what was read.
pub(super) fn expected_steps(text: &[u8]) -> u64 {
    text.len() as u64 + text.len() as u64 / 4 + 1
}

/// Cuts a text before children of a kind.
struct Windows<'a> {
    text: &'a [u8],
    kind: Kind,
    at: usize,
    /// The element around seems to end, or nobody knows where the next child begins.
    closed: bool,
}

impl Windows<'_> {
    /// Beginnings and ends of windows, of at least `bytes` together.
    fn batch(&mut self, bytes: usize) -> Vec<(usize, usize)> {
        let (open, close): (&[u8], &[u8]) = match self.kind {
            Kind::Vertices => (b"<vertex", b"</vertices"),
            Kind::Triangles => (b"<triangle", b"</volume"),
        };
        let find = |word: &[u8], from: usize, to: usize| {
            let part = self.text.get(from..to.min(self.text.len()))?;
            memmem::find(part, word).map(|place| from + place)
        };
        let from = self.at;
        let mut windows = Vec::new();
        while !self.closed && self.at < self.text.len() && self.at - from < bytes {
            let nearest = self.at.saturating_add(WINDOW).min(self.text.len());
            let closing = find(close, self.at, nearest);
            let child = || find(open, nearest, nearest.saturating_add(SLACK));
            let next = if closing.is_none() { child() } else { None };
            self.closed = next.is_none();
            let end = closing.or(next).unwrap_or(nearest);
            windows.push((self.at, end));
            self.at = end;
        }
        windows
    }
}
