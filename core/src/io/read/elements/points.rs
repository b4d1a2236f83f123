//! Rows as positions.

use super::cursor::{Collector, Cursor, Notes, Sink};
use super::layout::{Layout, Step};
use crate::contract::error::Result;
use crate::io::read::finding::{Finding, Rejection};
use crate::io::read::rounding::Rounding;
use crate::io::read::spool::{Context, Items, POSITION_BYTES, Spool};
use crate::io::read::vertices::packed;
use crate::util::words::{Count, Counted};

/// Positions of a piece.
pub(in crate::io) struct Made {
    positions: Vec<[u8; POSITION_BYTES]>,
    notes: Notes,
    /// Vertices with a coordinate that is no number or not there, and the first of them in this piece, from 1.
    damaged: u64,
    first: Option<u64>,
}

/// Takes rows of this layout for vertices.
pub(in crate::io) struct Points<'l>(pub(in crate::io) &'l Layout);

impl Points<'_> {
    #[inline]
    fn take(&self, cursor: &mut impl Cursor, point: &mut [f32; 3], notes: &mut Notes) -> Option<()> {
        for step in self.0.steps() {
            match *step {
                Step::Coordinate(axis, kind) => {
                    let value = cursor.coordinate(kind, notes)?;
                    if let Some(coordinate) = point.get_mut(axis) {
                        *coordinate = value;
                    }
                }
                step => cursor.pass(step)?,
            }
        }
        Some(())
    }
}

impl Sink for Points<'_> {
    type Made = Made;

    fn begin(&self, rows: usize) -> Made {
        Made { positions: Vec::with_capacity(rows), notes: Notes::default(), damaged: 0, first: None }
    }

    #[inline]
    fn row(&self, cursor: &mut impl Cursor, made: &mut Made) -> Option<()> {
        let (mut point, before) = ([f32::NAN; 3], made.notes.damaged);
        let whole = self.take(cursor, &mut point, &mut made.notes);
        made.positions.push(packed(point));
        if whole.is_none() || made.notes.damaged > before {
            made.damaged += 1;
            made.first = made.first.or(Some(made.positions.len() as u64));
        }
        whole
    }
}

/// All positions of a file.
pub(in crate::io) struct Gathered<'a> {
    spool: Spool<'a, POSITION_BYTES>,
    rounding: Rounding,
    damaged: u64,
    first: Option<u64>,
}

impl<'a> Gathered<'a> {
    /// None so far, and room for so many.
    pub(in crate::io) fn new(context: &Context<'a>, expected: u64) -> Result<Self> {
        context.make_room(expected.saturating_mul(POSITION_BYTES as u64), "the positions of the vertices")?;
        Ok(Self { spool: context.positions()?, rounding: Rounding::default(), damaged: 0, first: None })
    }

    /// How far they were rounded, if they were.
    pub(in crate::io) fn rounding(&self) -> Option<Rounding> {
        self.rounding.if_any()
    }

    /// Refuses positions that are damaged for the most part.
    pub(in crate::io) fn judge(&self) -> std::result::Result<(), Rejection> {
        let all = self.spool.count();
        if self.damaged > all / 2 {
            let all = Counted(all, "vertex has", "vertices have");
            let reason = format!("{} of {all} coordinates that are no numbers", Count(self.damaged));
            return Err(Rejection::Unreadable(reason));
        }
        Ok(())
    }

    /// What is odd about them.
    pub(in crate::io) fn findings(&self) -> Vec<Finding> {
        let damaged = (self.damaged > 0).then(|| {
            let vertices = Counted(self.damaged, "vertex", "vertices");
            let first = Count(self.first.unwrap_or_default());
            let text = format!("{vertices} with a coordinate that is no number, read as NaN; the first is vertex {first}");
            Finding::flaw(text)
        });
        damaged.into_iter().collect()
    }

    /// The positions, mapped.
    pub(in crate::io) fn map(self) -> Result<Items<POSITION_BYTES>> {
        self.spool.map()
    }
}

impl Collector<Made> for Gathered<'_> {
    fn take(&mut self, made: Made) -> Result<()> {
        self.first = self.first.or(made.first.map(|first| self.spool.count() + first));
        self.damaged += made.damaged;
        self.rounding.append(made.notes.rounding);
        self.spool.append(&made.positions)
    }

    fn forget(&mut self) -> Result<()> {
        (self.rounding, self.damaged, self.first) = (Rounding::default(), 0, None);
        self.spool.back_to(0)
    }

    /// There is one element of vertices in a file.
    fn keep(&mut self) {}
}
