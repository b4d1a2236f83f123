//! What a row is read by, and who takes its numbers: so that rows of text and of bytes are taken by the same code.

use super::layout::{Layout, Scalar, Step};
use crate::contract::error::Result;
use crate::io::read::rounding::Rounding;

/// What there is to say of the coordinates of a piece.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::io) struct Notes {
    pub(in crate::io) rounding: Rounding,
    /// Coordinates that are no numbers, and read as NaN.
    pub(in crate::io) damaged: u64,
}

/// A place in a file, from which numbers are taken one after the other. `None`: there is none left.
pub(in crate::io) trait Cursor {
    /// Passes over so many numbers, which are so many bytes in a binary file.
    fn skip(&mut self, values: usize, bytes: usize) -> Option<()>;

    /// A coordinate; NaN where a token is no number.
    fn coordinate(&mut self, kind: Scalar, notes: &mut Notes) -> Option<f32>;

    /// The length of a list. `None`, too, for one that is no whole number, or of more items than the file has room for.
    fn length(&mut self, kind: Scalar, item: Scalar) -> Option<usize>;

    /// An index; [`i64::MIN`] where a number is none.
    fn index(&mut self, kind: Scalar) -> Option<i64>;

    /// Passes over this part of a row.
    #[inline]
    fn pass(&mut self, step: Step) -> Option<()> {
        match step {
            Step::Skip { values, bytes } => self.skip(values, bytes),
            Step::Coordinate(_, kind) => self.skip(1, kind.bytes()),
            Step::List { length, item, .. } => {
                let items = self.length(length, item)?;
                self.skip(items, items.checked_mul(item.bytes())?)
            }
        }
    }
}

/// Takes rows, piece by piece, by several threads.
pub(in crate::io) trait Sink: Sync {
    /// What becomes of a piece.
    type Made: Send;

    /// For a piece of so many rows.
    fn begin(&self, rows: usize) -> Self::Made;

    /// Takes a row. `None`: some of its numbers are not there; something stands for the row all the same.
    fn row(&self, cursor: &mut impl Cursor, made: &mut Self::Made) -> Option<()>;
}

/// Joins what became of the pieces, in their order.
pub(in crate::io) trait Collector<M>: Send {
    /// Appends what became of a piece.
    fn take(&mut self, made: M) -> Result<()>;

    /// Forgets the pieces since it was made, or was told to [`Collector::keep`] them.
    fn forget(&mut self) -> Result<()>;

    /// Will forget no piece before now.
    fn keep(&mut self);
}

/// Passes over rows.
pub(in crate::io) struct Passed<'l>(pub(in crate::io) &'l Layout);

impl Sink for Passed<'_> {
    type Made = ();

    fn begin(&self, _: usize) {}

    #[inline]
    fn row(&self, cursor: &mut impl Cursor, _: &mut ()) -> Option<()> {
        self.0.steps().iter().try_for_each(|step| cursor.pass(*step))
    }
}

/// Takes nothing.
impl Collector<()> for () {
    fn take(&mut self, (): ()) -> Result<()> {
        Ok(())
    }

    fn forget(&mut self) -> Result<()> {
        Ok(())
    }

    fn keep(&mut self) {}
}
