//! Rows as faces.

use super::cursor::{Collector, Cursor, Sink};
use super::layout::{Layout, Step};
use crate::contract::error::Result;
use crate::io::read::faces::{Faces, MOST_CORNERS, Tally};
use crate::io::read::spool::{Context, Items, Spool};
use crate::io::read::vertices::Vertices;

/// Faces of a piece.
pub(in crate::io) struct Made<'v> {
    pub(super) faces: Faces<'v>,
    indices: Vec<u64>,
}

impl<'v> Made<'v> {
    /// None so far.
    pub(super) fn of(vertices: Vertices<'v>, expected: usize) -> Self {
        let mut faces = Faces::of(vertices);
        faces.records.reserve(expected);
        Self { faces, indices: Vec::new() }
    }

    /// Takes a face of so many indices, which follow.
    #[inline]
    fn face(&mut self, corners: usize, kind: super::layout::Scalar, cursor: &mut impl Cursor) -> Option<()> {
        // What is negative has no vertex.
        if corners == 3 {
            let mut triangle = [0; 3];
            for index in &mut triangle {
                *index = cursor.index(kind)?.cast_unsigned();
            }
            self.faces.triangle(triangle);
        } else if corners > MOST_CORNERS {
            cursor.skip(corners, corners.checked_mul(kind.bytes())?)?;
            self.faces.huge();
        } else {
            self.indices.clear();
            for _ in 0..corners {
                self.indices.push(cursor.index(kind)?.cast_unsigned());
            }
            self.faces.polygon(self.indices.iter().copied());
        }
        Some(())
    }
}

/// Takes rows of this layout for faces of these vertices.
pub(in crate::io) struct Polygons<'l, 'v> {
    pub(in crate::io) layout: &'l Layout,
    pub(in crate::io) vertices: Vertices<'v>,
}

impl<'v> Sink for Polygons<'_, 'v> {
    type Made = Made<'v>;

    fn begin(&self, rows: usize) -> Made<'v> {
        Made::of(self.vertices, rows)
    }

    #[inline]
    fn row(&self, cursor: &mut impl Cursor, made: &mut Made<'v>) -> Option<()> {
        let before = made.faces.tally.faces;
        let mut take = |step: &Step| match *step {
            Step::List { length, item, indices: true } => {
                let corners = cursor.length(length, item)?;
                made.face(corners, item, cursor)
            }
            step => cursor.pass(step),
        };
        let whole = self.layout.steps().iter().try_for_each(&mut take);
        if made.faces.tally.faces == before {
            made.faces.lost();
        }
        whole
    }
}

/// All faces of a file.
pub(in crate::io) struct Gathered<'a> {
    spool: Spool<'a, 50>,
    tally: Tally,
    /// What there was when it was told to keep it.
    kept: (u64, Tally),
}

impl<'a> Gathered<'a> {
    /// None so far, and room for so many.
    pub(in crate::io) fn new(context: &Context<'a>, expected: u64) -> Result<Self> {
        context.make_room(expected.saturating_mul(50), "the triangles of the faces")?;
        Ok(Self { spool: context.records()?, tally: Tally::default(), kept: (0, Tally::default()) })
    }

    /// The counts of all faces.
    pub(in crate::io) fn tally(&self) -> &Tally {
        &self.tally
    }

    /// So many triangles.
    pub(in crate::io) fn triangles(&self) -> u64 {
        self.spool.count()
    }

    /// The triangles, mapped.
    pub(in crate::io) fn map(self) -> Result<Items<50>> {
        self.spool.map()
    }
}

impl<'v> Collector<Made<'v>> for Gathered<'_> {
    fn take(&mut self, made: Made<'v>) -> Result<()> {
        self.tally.append(made.faces.tally);
        self.spool.append(&made.faces.records)
    }

    fn forget(&mut self) -> Result<()> {
        self.tally = self.kept.1;
        self.spool.back_to(self.kept.0)
    }

    fn keep(&mut self) {
        self.kept = (self.spool.count(), self.tally);
    }
}
