//! The records of an object's mesh, made when they are asked for.
//!
//! Plain stretches of text are cut before tags into windows, which are read in parallel. Memory: some windows a thread and what they give.

use std::ops::Range;

use super::super::binary;
use super::super::limits::window;
use super::super::parsed::{Besides, Parsed};
use super::super::spool::{Context, Items, POSITION_BYTES, Spool};
use super::super::vertices::Vertices;
use super::careful::{self, Piece};
use super::model::{Content, Mesh, Model, Part, Place, Region};
use super::scan;
use super::shards::{PointCounts, Points, Shard, TriangleCounts};
use crate::contract::error::Result;
use crate::io::record::Record;

/// Text read at a time by one thread.
const WINDOW: usize = window(1 << 20);
/// Bytes of text for a vertex or a triangle, about, for what room there should be.
const TEXT_EACH: usize = 40;

/// A mesh that was read.
#[derive(Debug)]
pub(crate) struct MeshRecords {
    pub(crate) parsed: Parsed,
    /// The positions that the file has, in its order.
    pub(crate) positions: Items<POSITION_BYTES>,
    /// Triangles that the file has, with those that were left out.
    pub(crate) triangles: u64,
    /// Triangles with properties of their own, or attributes of vendors.
    pub(crate) with_any: u64,
}

impl MeshRecords {
    /// The positions, by the numbers that triangles have for them.
    pub(crate) fn vertices(&self) -> Vertices<'_> {
        Vertices::spooled(self.positions.all())
    }
}

/// Triangles of a window: their records, and what is told of them.
type Told = (Vec<Record>, TriangleCounts);

impl Model {
    /// Reads the mesh of an object, in its own coordinates. Call it within a pool of threads. O(text).
    ///
    /// # Errors
    /// [`crate::Error::Unreadable`] if it has no mesh, or something besides triangles, or if most of it is damaged;
    /// [`crate::Error::Refused`] for too many triangles, [`crate::Error::NoSpace`], [`crate::Error::Io`].
    pub(crate) fn records(&self, place: Place, context: &Context<'_>) -> Result<MeshRecords> {
        let refuse = |reason: String| self.refuse(place, reason).at(context.path);
        let object = self.parts.get(place.part).and_then(|part| Some((part, part.objects.get(place.object)?)));
        let Some((part, object)) = object else { return Err(refuse("is not there".into())) };
        let mesh = match &object.content {
            Content::Mesh(mesh) if mesh.lattice => return Err(refuse("is a beam lattice, which has no triangles".into())),
            Content::Mesh(mesh) => mesh,
            Content::Components(_) => return Err(refuse("is made of components, not of a mesh".into())),
            Content::Foreign(content) => return Err(refuse(format!("is made of {content}, not of a mesh"))),
            Content::Nothing => return Err(refuse("holds nothing that is known".into())),
        };
        let (positions, points) = read_vertices(part, mesh, context)?;
        let count = positions.all().len() as u64;
        points.judge(count).map_err(|rejection| rejection.at(context.path))?;
        let (records, told) = read_triangles(part, mesh, Vertices::spooled(positions.all()), context)?;
        told.tally.judge().map_err(|rejection| rejection.at(context.path))?;
        let mut findings = points.findings();
        findings.extend(told.findings());
        let header = binary::header_of(object.name.as_bytes());
        let parsed = Parsed { records, findings, header, rounding: points.rounding.if_any(), besides: Besides::default() };
        let TriangleCounts { tally, with_any, .. } = told;
        Ok(MeshRecords { parsed, positions, triangles: tally.faces, with_any })
    }
}

fn piece<'a>(part: &'a Part, region: &'a Region, range: Range<usize>) -> Piece<'a> {
    Piece { part: &part.name, text: part.text(), range, scopes: &region.scopes }
}

fn read_vertices(part: &Part, mesh: &Mesh, context: &Context<'_>) -> Result<(Items<POSITION_BYTES>, PointCounts)> {
    let region = &mesh.vertices;
    context.make_room((region.inner.len() / TEXT_EACH * POSITION_BYTES) as u64, "the vertices of the text")?;
    let (mut spool, mut counts) = (context.positions()?, PointCounts::default());
    let mut take = |points: Points| {
        counts.append(points.counts);
        spool.append(&points.positions)
    };
    if !region.plain {
        careful::vertices(&piece(part, region, region.inner.clone()), context.path, |points| {
            context.at(0, region.inner.len() as u64)?;
            take(points)
        })?;
        return Ok((spool.map()?, counts));
    }
    let parse = |range: &Range<usize>| -> Result<Vec<Points>> {
        let text = part.text().get(range.clone()).unwrap_or_default();
        if let Some(points) = scan::vertices(text, region.prefix.as_bytes()) {
            return Ok(vec![points]);
        }
        let mut all = Vec::new();
        careful::vertices(&piece(part, region, range.clone()), context.path, |points| {
            all.push(points);
            Ok(())
        })?;
        Ok(all)
    };
    in_windows(part, region, context, parse, |all| all?.into_iter().try_for_each(&mut take))?;
    Ok((spool.map()?, counts))
}

fn read_triangles(
    part: &Part,
    mesh: &Mesh,
    vertices: Vertices<'_>,
    context: &Context<'_>,
) -> Result<(Items<50>, TriangleCounts)> {
    let region = &mesh.triangles;
    context.make_room((region.inner.len() / TEXT_EACH * size_of::<Record>()) as u64, "the triangles of the text")?;
    let (mut spool, mut counts): (Spool<'_, 50>, _) = (context.records()?, TriangleCounts::default());
    let mut take = |(records, told): Told| {
        counts.append(told);
        spool.append(&records)
    };
    let split = |shard: Shard<'_>| -> Told {
        let told = shard.told();
        (shard.faces.records, told)
    };
    if !region.plain {
        careful::triangles(&piece(part, region, region.inner.clone()), context.path, vertices, |shard| {
            context.at(0, region.inner.len() as u64)?;
            take(split(shard))
        })?;
        return Ok((spool.map()?, counts));
    }
    let parse = |range: &Range<usize>| -> Result<Vec<Told>> {
        let text = part.text().get(range.clone()).unwrap_or_default();
        if let Some(shard) = scan::triangles(text, region.prefix.as_bytes(), Shard::of(vertices)) {
            return Ok(vec![split(shard)]);
        }
        let mut all = Vec::new();
        careful::triangles(&piece(part, region, range.clone()), context.path, vertices, |shard| {
            all.push(split(shard));
            Ok(())
        })?;
        Ok(all)
    };
    in_windows(part, region, context, parse, |all| all?.into_iter().try_for_each(&mut take))?;
    Ok((spool.map()?, counts))
}

/// Reads a plain region window by window.
fn in_windows<R: Send>(
    part: &Part,
    region: &Region,
    context: &Context<'_>,
    parse: impl Fn(&Range<usize>) -> R + Sync,
    take: impl FnMut(R) -> Result<()> + Send,
) -> Result<()> {
    let text = part.text();
    let Range { start, end } = region.inner;
    let mut at = start;
    let next = || {
        let mut batch = Vec::new();
        while at < end && batch.len() < 2 * rayon::current_num_threads() {
            let limit = at.saturating_add(WINDOW).min(end);
            let tag = text.get(limit..end).and_then(|rest| memchr::memchr(b'<', rest));
            let to = tag.map_or(end, |found| limit + found);
            batch.push(at..to);
            at = to;
        }
        Ok((batch, (at - start) as u64))
    };
    context.passing(part.text.map()).in_order((end - start) as u64, next, parse, take)
}
