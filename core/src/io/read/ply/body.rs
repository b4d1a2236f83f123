//! The elements of a PLY, in any of its forms.

use super::header::Form;
use super::roles::Part;
use crate::contract::error::Result;
use crate::io::read::elements::cursor::{Collector, Passed, Sink};
use crate::io::read::elements::lines::Line;
use crate::io::read::elements::packed::{self, Packed};
use crate::io::read::elements::text::{self, Behind};
use crate::io::read::elements::{points, polygons, strips};
use crate::io::read::spool::Context;
use crate::io::read::vertices::{Positions, Vertices};
use crate::util::words::Counted;

/// What was read of an element: so many rows, those on lines with other numbers than theirs, and where it ends.
pub(super) use crate::io::read::elements::text::Read;

/// The bytes of a file, and what its numbers are.
#[derive(Clone, Copy)]
pub(super) struct Body<'a> {
    pub(super) form: Form,
    pub(super) bytes: &'a [u8],
}

impl<'a> Body<'a> {
    fn lines(self, from: usize, part: &Part) -> text::Section<'a> {
        text::Section { text: self.bytes, from, rows: part.count, comments: false, behind: Behind::Nothing }
    }

    fn packed<'s, const BIG: bool>(self, from: usize, part: &'s Part) -> packed::Section<'s, BIG>
    where
        'a: 's,
    {
        packed::Section { bytes: self.bytes, from, rows: part.count, layout: &part.layout }
    }

    /// Reads the element there.
    fn read<S: Sink>(
        self,
        context: &Context<'_>,
        from: usize,
        part: &Part,
        sink: &S,
        collector: &mut impl Collector<S::Made>,
    ) -> Result<Read> {
        match self.form {
            Form::Text => self.lines(from, part).read(context, sink, (sink, &part.layout), collector),
            Form::Little => self.packed::<false>(from, part).read(context, sink, collector).map(Read::from),
            Form::Big => self.packed::<true>(from, part).read(context, sink, collector).map(Read::from),
        }
    }

    /// Finds the end of the element there.
    pub(super) fn pass(self, context: &Context<'_>, from: usize, part: &Part) -> Result<Read> {
        match self.form {
            Form::Text => self.read(context, from, part, &Passed(&part.layout), &mut ()),
            Form::Little => Ok(self.packed::<false>(from, part).pass().into()),
            Form::Big => Ok(self.packed::<true>(from, part).pass().into()),
        }
    }

    /// The vertices there, if they can stay where they are.
    pub(super) fn vertices_in_place(self, from: usize, part: &Part) -> Option<(Positions, Read)> {
        let (stride, offset) = (part.layout.stride()?, part.layout.side_by_side()?);
        if self.form != Form::Little {
            return None;
        }
        let read = self.packed::<false>(from, part).pass();
        let count = usize::try_from(read.rows).ok()?;
        Some((Positions::InPlace { from: from + offset, stride, count }, read.into()))
    }

    /// Reads the vertices there.
    pub(super) fn points(
        self,
        context: &Context<'_>,
        from: usize,
        part: &Part,
        gathered: &mut points::Gathered<'_>,
    ) -> Result<Read> {
        self.read(context, from, part, &points::Points(&part.layout), gathered)
    }

    /// Reads the faces there.
    pub(super) fn polygons(
        self,
        context: &Context<'_>,
        from: usize,
        part: &Part,
        vertices: Vertices<'_>,
        gathered: &mut polygons::Gathered<'_>,
    ) -> Result<Read> {
        self.read(context, from, part, &polygons::Polygons { layout: &part.layout, vertices }, gathered)
    }

    /// Reads the strips there.
    pub(super) fn strips(
        self,
        from: usize,
        part: &Part,
        vertices: Vertices<'_>,
        gathered: &mut polygons::Gathered<'_>,
    ) -> Result<Read> {
        let (rows, layout, bytes) = (part.count, &part.layout, self.bytes);
        let (rows, end) = match self.form {
            Form::Text => {
                let mut line = Line { text: bytes, at: from, within: false, comments: false };
                (strips::take(rows, layout, vertices, &mut line, gathered)?, line.at)
            }
            Form::Little => {
                let mut cursor = Packed::<false> { bytes, at: from };
                (strips::take(rows, layout, vertices, &mut cursor, gathered)?, cursor.at)
            }
            Form::Big => {
                let mut cursor = Packed::<true> { bytes, at: from };
                (strips::take(rows, layout, vertices, &mut cursor, gathered)?, cursor.at)
            }
        };
        Ok(Read { rows, bent: 0, end })
    }

    /// Rows of this element that the file has room for, at most.
    pub(super) fn most_rows(self, from: usize, part: &Part) -> u64 {
        let least = match self.form {
            // A digit and a blank for each number.
            Form::Text => part.layout.steps().len() * 2,
            _ => part.layout.least_bytes(),
        };
        part.count.min((self.bytes.len().saturating_sub(from) / least.max(1)) as u64)
    }

    /// What stands behind the last element, if anything does.
    pub(super) fn behind(self, end: usize) -> Option<String> {
        let mut line = Line { text: self.bytes, at: end, within: false, comments: false };
        let bytes = (self.bytes.len() - end.min(self.bytes.len())) as u64;
        let any = bytes > 0 && (self.form != Form::Text || line.token().is_some());
        any.then(|| format!("{} after the last element, ignored", Counted(bytes, "byte", "bytes")))
    }
}
