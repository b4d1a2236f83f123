//! Triangles that a step takes from a mesh, and those that it brings.

use crate::contract::report::{Features, Residue, Simplified, Smoothed};
use crate::engine::mesh::Mesh;
use crate::io::record::{self, Record};
use crate::output::edit::NewRecords;
use crate::util::bits;

/// The corners of a triangle.
type Corners = [[f32; 3]; 3];

/// Triangles that go and come, and the words for it.
pub(crate) struct Change {
    /// Numbers of triangles, a bit each.
    pub(crate) gone: Vec<u64>,
    pub(crate) added: NewRecords,
    pub(crate) told: Told,
}

/// The section of the report on a step.
#[derive(Clone, Debug)]
pub(crate) enum Told {
    Features(Features),
    Residue(Residue),
    Smoothed(Smoothed),
    Simplified(Simplified),
}

impl Change {
    /// The mesh stays as it is.
    pub(super) fn none(told: Told) -> Self {
        Self { gone: Vec::new(), added: NewRecords::default(), told }
    }

    /// Whether the mesh stays as it is.
    pub(crate) fn is_none(&self) -> bool {
        self.count_gone() == 0 && self.added.is_empty()
    }

    /// How many triangles go.
    pub(crate) fn count_gone(&self) -> u64 {
        bits::count(&self.gone)
    }
}

/// New triangles as records.
pub(super) fn encoded(triangles: impl Iterator<Item = Corners>) -> Vec<Record> {
    triangles.map(|corners| record::encode(corners, 0)).collect()
}

/// How many vertices of a mesh have other places now.
pub(super) fn vertices_moved(mesh: &Mesh, places: &[[f32; 3]]) -> u64 {
    mesh.vertices().iter().zip(places).filter(|(from, to)| from != to).count() as u64
}

/// Whether a triangle of a mesh has a vertex with another place.
pub(super) fn is_moved(mesh: &Mesh, places: &[[f32; 3]], face: &[u32; 3]) -> bool {
    face.iter().any(|vertex| mesh.vertices().get(*vertex as usize) != places.get(*vertex as usize))
}

/// The triangles of a mesh that other places of its vertices change: their numbers, a bit each, and what they become.
pub(super) fn moved(mesh: &Mesh, places: &[[f32; 3]]) -> (Vec<u64>, Vec<Record>) {
    let place = |vertex: u32| places.get(vertex as usize).copied().unwrap_or_default();
    let changed = || (0_u32..).zip(mesh.faces()).filter(|(_, face)| is_moved(mesh, places, face));
    let gone = bits::of(mesh.faces().len(), changed().map(|(number, _)| number));
    (gone, encoded(changed().map(|(_, face)| face.map(place))))
}

/// The triangles that go and come where another mesh takes the place of this one; `origins`: the triangle that each new one is, or [`u32::MAX`].
pub(super) fn replaced(mesh: &Mesh, (points, faces, origins): (&[[f32; 3]], &[[u32; 3]], &[u32])) -> (Vec<u64>, Vec<Record>) {
    let mut gone = bits::all(mesh.faces().len());
    origins.iter().for_each(|origin| bits::take(&mut gone, *origin as usize));
    let place = |vertex: u32| points.get(vertex as usize).copied().unwrap_or_default();
    let new = faces.iter().zip(origins).filter(|(_, origin)| **origin == u32::MAX);
    (gone, encoded(new.map(|(face, _)| face.map(place))))
}
