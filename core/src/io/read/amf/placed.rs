//! Records of the triangles of all objects, wherever they are placed.

use std::ops::Range;

use rayon::prelude::*;

use super::super::faces::{Faces, Tally};
use super::super::finding::Rejection;
use super::super::limits::MAX_TRIANGLES;
use super::super::rounding::Rounding;
use super::super::spool::{Context, Items, Spool};
use super::super::vertices::Vertices;
use super::constellation::{self, Names};
use super::document::{Document, Mesh};
use super::placement::Placement;
use super::stretch::{Indices, Position};
use crate::contract::error::{Error, Result};
use crate::io::record::{Point, Record};

/// Triangles placed at a time by one thread.
const PIECE: usize = 1 << 15;

/// What becomes of the objects of a document.
pub(super) struct Placed {
    pub(super) records: Items<50>,
    pub(super) tally: Tally,
    pub(super) rounding: Rounding,
    /// Objects that hold triangles, each counted as often as it is placed.
    pub(super) objects: u64,
    /// Their meshes, in the order of the records; none of more than [`MOST_PARTS`].
    pub(super) parts: Vec<PartOf>,
    /// There is more than one such mesh.
    pub(super) several: bool,
}

/// A mesh that is placed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct PartOf {
    pub(super) object: usize,
    /// Its number among the object's meshes, from 0.
    pub(super) mesh: usize,
    pub(super) triangles: Range<usize>,
}

/// Meshes that are told apart, at most: each is repaired by itself, which takes some milliseconds.
const MOST_PARTS: usize = 1000;

/// Positions and triangles as they were read.
#[derive(Clone, Copy)]
struct Kept<'a> {
    positions: &'a [Position],
    indices: &'a [Indices],
}

impl<'a> Kept<'a> {
    fn of(self, mesh: &Mesh) -> Self {
        Self { positions: part(self.positions, &mesh.positions), indices: part(self.indices, &mesh.indices) }
    }
}

fn part<'a, T>(items: &'a [T], range: &Range<u64>) -> &'a [T] {
    items.get(range.start as usize..range.end as usize).unwrap_or_default()
}

/// Places all objects. `text`: bytes of it; placing is told as what follows them, up to `steps`. Copies of objects may have `most` triangles.
///
/// # Errors
/// Refusals by constellations, [`Error::Refused`] for too many triangles, [`Error::NoSpace`], [`Error::Io`].
pub(super) fn place(
    (document, names): (&Document, &Names),
    (positions, indices): (&Items<24>, &Items<12>),
    ((text, steps), most): ((u64, u64), u64),
    context: &Context<'_>,
) -> Result<Placed> {
    let reject = |rejection: Rejection| rejection.at(context.path);
    let (mut total, own) = (0u64, indices.all().len() as u64);
    let count = |object: usize, _: &Placement| {
        total += document.meshes(object).iter().map(|mesh| mesh.indices.end - mesh.indices.start).sum::<u64>();
        if total > MAX_TRIANGLES {
            Err(Rejection::TooMany)
        } else if total.saturating_sub(own) > most {
            Err(Rejection::Copies(most))
        } else {
            Ok(())
        }
    };
    constellation::each(document, names, count).map_err(reject)?;
    context.make_room(total * size_of::<Record>() as u64, "the triangles of the objects")?;
    let kept = Kept { positions: positions.all(), indices: indices.all() };
    let mut placing = Placing {
        context,
        spool: context.records()?,
        waiting: Vec::new(),
        tally: Tally::default(),
        rounding: Rounding::default(),
        objects: 0,
        parts: Vec::new(),
        text,
        steps,
        total,
    };
    constellation::each(document, names, |object, placement| {
        let mut holds = false;
        for (number, mesh) in document.meshes(object).iter().enumerate() {
            holds |= !mesh.indices.is_empty();
            let from = placing.count();
            placing.mesh(mesh, kept.of(mesh), placement)?;
            placing.note(PartOf { object, mesh: number, triangles: from..placing.count() });
        }
        placing.objects += u64::from(holds);
        Ok::<(), Stop>(())
    })
    .map_err(|stop| match stop {
        Stop::Refused(rejection) => reject(rejection),
        Stop::Failed(error) => error,
    })?;
    placing.flush()?;
    let Placing { spool, tally, rounding, objects, mut parts, .. } = placing;
    let several = parts.len() > 1;
    if parts.len() > MOST_PARTS {
        parts.clear();
    }
    Ok(Placed { records: spool.map()?, tally, rounding, objects, parts, several })
}

enum Stop {
    Refused(Rejection),
    Failed(Error),
}

impl From<Rejection> for Stop {
    fn from(rejection: Rejection) -> Self {
        Self::Refused(rejection)
    }
}

impl From<Error> for Stop {
    fn from(error: Error) -> Self {
        Self::Failed(error)
    }
}

struct Placing<'a, 'c> {
    context: &'c Context<'a>,
    spool: Spool<'a, 50>,
    /// Records of small objects, to be appended together.
    waiting: Vec<Record>,
    tally: Tally,
    rounding: Rounding,
    objects: u64,
    parts: Vec<PartOf>,
    text: u64,
    steps: u64,
    total: u64,
}

impl Placing<'_, '_> {
    /// Records so far.
    fn count(&self) -> usize {
        self.spool.count() as usize + self.waiting.len()
    }

    /// Notes a mesh that was placed; of too many, one more than are told apart.
    fn note(&mut self, part: PartOf) {
        if !part.triangles.is_empty() && self.parts.len() <= MOST_PARTS {
            self.parts.push(part);
        }
    }

    /// Places one mesh.
    fn mesh(&mut self, mesh: &Mesh, kept: Kept<'_>, placement: &Placement) -> Result<()> {
        self.rounding.append(if *placement == Placement::NONE { mesh.rounding } else { rounding(kept, placement) });
        if kept.indices.len() <= PIECE {
            let (records, tally) = records(kept, kept.indices, placement);
            self.waiting.extend(records);
            self.tally.append(tally);
            return if self.waiting.len() > PIECE { self.flush() } else { Ok(()) };
        }
        self.flush()?;
        let Self { context, spool, tally: all, text, steps, total, .. } = self;
        let mut pieces = kept.indices.chunks(PIECE);
        let mut done = spool.count();
        let next = || {
            let batch: Vec<_> = pieces.by_ref().take(rayon::current_num_threads() * 2).collect();
            done += batch.iter().map(|piece| piece.len() as u64).sum::<u64>();
            Ok((batch, step(*text, *steps, done, *total)))
        };
        let parse = |piece: &&[Indices]| records(kept, piece, placement);
        let take = |(records, tally): (Vec<Record>, Tally)| {
            all.append(tally);
            spool.append(&records)
        };
        context.in_order(*steps, next, parse, take)
    }

    /// Appends the records that wait.
    fn flush(&mut self) -> Result<()> {
        self.spool.append(&self.waiting)?;
        self.waiting.clear();
        self.context.at(step(self.text, self.steps, self.spool.count(), self.total), self.steps)
    }
}

/// The step at which so many of all triangles are placed.
fn step(text: u64, steps: u64, done: u64, total: u64) -> u64 {
    let share = done.min(total) as f64 / total.max(1) as f64;
    (text + (steps.saturating_sub(text) as f64 * share) as u64).min(steps)
}

/// Records of these triangles of a mesh.
fn records(kept: Kept<'_>, indices: &[Indices], placement: &Placement) -> (Vec<Record>, Tally) {
    let mut faces = Faces::of(Vertices::spooled(&[]));
    faces.records.reserve(indices.len());
    let (stays, mirrors) = (*placement == Placement::NONE, placement.mirrors());
    for triangle in indices {
        let corners = [0, 4, 8].map(|at| {
            let index = triangle.get(at..at + 4).and_then(<[u8]>::first_chunk).copied().map(u32::from_le_bytes)?;
            let point = kept.positions.get(index as usize).map(point)?;
            Some(rounded(if stays { point } else { placement.place(point) }))
        });
        let [a, b, c] = corners;
        faces.triangle_at(if mirrors { [a, c, b] } else { corners });
    }
    (faces.records, faces.tally)
}

fn point(position: &Position) -> [f64; 3] {
    let mut point = [0.0; 3];
    for (value, bytes) in point.iter_mut().zip(position.as_chunks().0) {
        *value = f64::from_le_bytes(*bytes);
    }
    point
}

fn rounded(point: [f64; 3]) -> Point {
    point.map(|value| value as f32)
}

/// How far the positions of a placed mesh are rounded: of its vertices, or of the corners of its triangles where those are fewer, so that vertices
/// without a triangle take no time for each instance.
fn rounding(kept: Kept<'_>, placement: &Placement) -> Rounding {
    let Kept { positions, indices } = kept;
    let of = |rounding: &mut Rounding, position: &Position| {
        for value in placement.place(point(position)) {
            rounding.of_double(value);
        }
    };
    if indices.len() < positions.len() / 3 {
        let mut rounding = Rounding::default();
        let corners = indices.iter().flat_map(|triangle| triangle.as_chunks().0);
        let placed = corners.filter_map(|index| positions.get(u32::from_le_bytes(*index) as usize));
        placed.for_each(|position| of(&mut rounding, position));
        return rounding;
    }
    let of_piece = |positions: &[Position]| {
        let mut rounding = Rounding::default();
        positions.iter().for_each(|position| of(&mut rounding, position));
        rounding
    };
    let join = |mut a: Rounding, b| {
        a.append(b);
        a
    };
    positions.par_chunks(PIECE).map(of_piece).reduce(Rounding::default, join)
}
