//! The vertices of a mesh that was repaired, by their numbers: those of the text stay, new ones are numbered behind them.
//!
//! Consumers of 3MF tell vertices apart by number, and Suture by position. So within a unit, whose triangles are one body, all triangles that
//! meet at a position take the first number there; units share none that they did not share before.

use std::collections::{BTreeMap, BTreeSet};
use std::convert::Infallible;
use std::ops::Range;

use super::elements::{Element, Elements};
use crate::contract::report::FaceOrigin;
use crate::io::read::Vertices;
use crate::io::record::{self, Point, Record};
use crate::output::edit::{Edit, Step};
use crate::topology::vertex_table::Weld;

/// A mesh in the text of a model part.
#[derive(Clone)]
pub(crate) struct MeshText<'t> {
    pub(crate) text: &'t [u8],
    /// What stands between the tags of the vertices.
    pub(crate) vertices_within: Range<usize>,
    /// What stands between the tags of the triangles.
    pub(crate) triangles: Range<usize>,
    pub(crate) vertices: Vertices<'t>,
    /// Where sets of the triangles stand, if there are any; behind the triangles.
    pub(crate) sets: Option<Range<usize>>,
}

impl<'t> MeshText<'t> {
    pub(crate) fn elements(&self) -> Elements<'t> {
        Elements::within(self.text, self.triangles.clone())
    }
}

/// Triangles of a mesh, one after the other, that are one body to slicers.
#[derive(Clone, Copy)]
pub(crate) struct Unit<'u> {
    /// So many.
    pub(crate) triangles: usize,
    /// `None`: they stay as they are.
    pub(crate) change: Option<Change<'u>>,
}

/// What became of the triangles of a unit.
#[derive(Clone, Copy)]
pub(crate) struct Change<'u> {
    /// As they stand in the text.
    pub(crate) came: &'u [Record],
    /// The records that the edit is of: the same, or welded.
    pub(crate) now: &'u [Record],
    pub(crate) edit: &'u Edit,
}

/// One step through the triangles of a unit, in the order of the output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Fate {
    /// The next triangle of the text is one of the output.
    Kept,
    /// The same, turned.
    Turned,
    /// The same, with these corners.
    Moved([Point; 3]),
    /// The next triangle of the text is not in the output.
    Gone,
    /// A part of this triangle of the unit.
    Part(u32, [Point; 3]),
    /// A repair made it.
    New([Point; 3]),
}

impl Change<'_> {
    /// Goes through all triangles, those of the text in order.
    pub(crate) fn each(&self, mut step: impl FnMut(Fate)) {
        let mut at = 0;
        let walked: Result<(), Infallible> = self.edit.walk(self.now, |next| {
            match next {
                Step::Untouched(run) => {
                    for k in at..at + run.len() {
                        let now = self.now.get(k).map(record::corners).unwrap_or_default();
                        let is_same = self.came.get(k).is_some_and(|came| record::corners(came) == now);
                        step(if is_same { Fate::Kept } else { Fate::Moved(now) });
                    }
                    at += run.len();
                }
                Step::Changed(_, record, origin) => {
                    at += 1;
                    match origin {
                        FaceOrigin::Flipped(_) => step(Fate::Turned),
                        FaceOrigin::Moved(_) | FaceOrigin::Input(_) => step(Fate::Moved(record::corners(&record))),
                        other => {
                            step(Fate::Gone);
                            step(made(&record, other));
                        }
                    }
                }
                Step::Deleted(places) => {
                    at += places.len();
                    places.for_each(|_| step(Fate::Gone));
                }
                Step::Added(record, origin) => step(made(record, origin)),
            }
            Ok(())
        });
        let Ok(()) = walked;
    }
}

fn made(record: &Record, origin: FaceOrigin) -> Fate {
    let corners = record::corners(record);
    match origin.input_face() {
        Some(of) => Fate::Part(of, corners),
        None => Fate::New(corners),
    }
}

/// The numbers of the vertices of a changed mesh.
pub(crate) struct Plan<'t> {
    /// By vertex of the text: the number that triangles take instead. `NONE` where no changed unit uses it.
    canonical: Vec<u32>,
    /// Positions of the vertices that are new, unit by unit. Their numbers here go on behind those of the text.
    pub(crate) fresh: Vec<Point>,
    pub(crate) units: Vec<UnitPlan<'t>>,
    pub(crate) inserts: Vec<Insert>,
}

/// New vertices of a unit, and where they are put. PrusaSlicer takes all vertices from the smallest number of a volume to its largest for the
/// volume's own, so that new ones must not stand behind those of others (its `src/libslic3r/Format/3mf.cpp`, `_generate_volumes`).
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Insert {
    /// Before this vertex of the text.
    pub(crate) at: u32,
    /// Which of the new ones.
    pub(crate) fresh: Range<u32>,
    /// New ones that stand before these.
    before: u32,
}

/// What a changed unit needs to be written.
#[derive(Default)]
pub(crate) struct UnitPlan<'t> {
    /// The vertices of triangles that were moved, are parts or new, in the order of the output.
    pub(crate) faces: Vec<[u32; 3]>,
    /// Triangles of the text that have parts in the output.
    pub(crate) parted: BTreeMap<u32, Element<'t>>,
}

const NONE: u32 = u32::MAX;

impl<'t> Plan<'t> {
    /// O(n) in the triangles of changed units and of the edits. Memory: 4 bytes for each vertex of the text, some 60 for each of the largest unit.
    pub(crate) fn of(mesh: &MeshText<'t>, units: &[Unit<'_>]) -> Self {
        let canonical = vec![NONE; mesh.vertices.len()];
        let mut plan = Self { canonical, fresh: Vec::new(), units: Vec::new(), inserts: Vec::new() };
        let mut elements = mesh.elements();
        for unit in units {
            let before = plan.fresh.len() as u32;
            let mut end = 0;
            let unit_plan = match &unit.change {
                None => {
                    elements.by_ref().take(unit.triangles).for_each(drop);
                    UnitPlan::default()
                }
                Some(change) => plan.number(mesh, &mut elements, change, &mut end),
            };
            plan.units.push(unit_plan);
            let fresh = before..plan.fresh.len() as u32;
            if !fresh.is_empty() {
                let at = if units.len() == 1 { mesh.vertices.len() as u32 } else { end };
                plan.inserts.push(Insert { at, fresh, before: 0 });
            }
        }
        plan.inserts.sort_by_key(|insert| insert.at);
        let mut before = 0;
        for insert in &mut plan.inserts {
            insert.before = before;
            before += insert.fresh.len() as u32;
        }
        plan
    }

    /// `end` becomes the number behind the largest that the unit has.
    fn number(&mut self, mesh: &MeshText<'t>, elements: &mut Elements<'t>, change: &Change<'_>, end: &mut u32) -> UnitPlan<'t> {
        let mut wanted = BTreeSet::new();
        change.each(|fate| {
            if let Fate::Part(of, _) = fate {
                wanted.insert(of);
            }
        });
        let mut table = Weld::default();
        table.reset(change.came.len() / 2);
        // By place in the table.
        let mut first: Vec<u32> = Vec::new();
        let mut parted = BTreeMap::new();
        for (k, element) in elements.by_ref().take(change.came.len()).enumerate() {
            for vertex in element.vertices {
                *end = (*end).max(vertex.saturating_add(1));
                let Some(position) = mesh.vertices.get(vertex.into()) else { continue };
                let Some(canonical) = self.canonical.get_mut(vertex as usize) else { continue };
                if !position.iter().all(|x| x.is_finite()) {
                    *canonical = vertex;
                    continue;
                }
                let at = table.vertex(position) as usize;
                if at == first.len() {
                    first.push(vertex);
                }
                *canonical = first.get(at).copied().unwrap_or(vertex);
            }
            if wanted.contains(&(k as u32)) {
                parted.insert(k as u32, element);
            }
        }
        let mut faces = Vec::new();
        change.each(|fate| {
            let (Fate::Moved(corners) | Fate::Part(_, corners) | Fate::New(corners)) = fate else { return };
            faces.push(corners.map(|corner| {
                let at = table.vertex(corner) as usize;
                if at == first.len() {
                    first.push((mesh.vertices.len() + self.fresh.len()) as u32);
                    self.fresh.push(corner);
                }
                first.get(at).copied().unwrap_or_default()
            }));
        });
        UnitPlan { faces, parted }
    }

    /// The numbers that a triangle of a changed unit has in the output.
    pub(crate) fn canonical(&self, vertices: [u32; 3]) -> [u32; 3] {
        vertices.map(|vertex| self.canonical.get(vertex as usize).copied().filter(|own| *own != NONE).unwrap_or(vertex))
    }

    /// The numbers in the output of vertices that have these here.
    pub(crate) fn placed(&self, vertices: [u32; 3]) -> [u32; 3] {
        let of_text = self.canonical.len() as u32;
        vertices.map(|vertex| match vertex.checked_sub(of_text) {
            None => {
                let behind = self.inserts.partition_point(|insert| insert.at <= vertex);
                let last = behind.checked_sub(1).and_then(|last| self.inserts.get(last));
                vertex + last.map_or(0, |insert| insert.before + insert.fresh.len() as u32)
            }
            Some(fresh) => {
                let own = self.inserts.iter().find(|insert| insert.fresh.contains(&fresh));
                own.map_or(vertex, |insert| insert.at + insert.before + (fresh - insert.fresh.start))
            }
        })
    }

    /// The position of a vertex.
    pub(crate) fn position(&self, mesh: &MeshText<'_>, vertex: u32) -> Point {
        let fresh = || self.fresh.get((vertex as usize).checked_sub(mesh.vertices.len())?).copied();
        mesh.vertices.get(vertex.into()).or_else(fresh).unwrap_or_default()
    }
}
