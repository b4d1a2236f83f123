//! Triangles that a step takes from a mesh, and those that it brings.

use crate::contract::report::{Features, Residue, Simplified, Smoothed};
use crate::engine::mesh::Mesh;
use crate::io::record::{self, Record};

/// The corners of a triangle.
type Corners = [[f32; 3]; 3];

/// Triangles that go and come, and the words for it.
pub(crate) struct Change {
    /// Numbers of triangles, ascending.
    pub(crate) gone: Vec<u32>,
    pub(crate) added: Vec<Corners>,
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
    /// Whether the mesh stays as it is.
    pub(crate) fn is_none(&self) -> bool {
        self.gone.is_empty() && self.added.is_empty()
    }

    /// New triangles as records.
    pub(crate) fn records(&self) -> Vec<Record> {
        self.added.iter().map(|corners| record::encode(*corners, 0)).collect()
    }
}

/// How many vertices of a mesh have other places now.
pub(super) fn vertices_moved(mesh: &Mesh, places: &[[f32; 3]]) -> u64 {
    mesh.vertices().iter().zip(places).filter(|(from, to)| from != to).count() as u64
}

/// Whether a triangle of a mesh has a vertex with another place.
pub(super) fn is_moved(mesh: &Mesh, places: &[[f32; 3]], face: &[u32; 3]) -> bool {
    face.iter().any(|vertex| mesh.vertices().get(*vertex as usize) != places.get(*vertex as usize))
}

/// The triangles of a mesh that other places of its vertices change: their numbers, and their new corners.
pub(super) fn moved(mesh: &Mesh, places: &[[f32; 3]]) -> (Vec<u32>, Vec<Corners>) {
    let place = |vertex: u32| places.get(vertex as usize).copied().unwrap_or_default();
    let changed = (0_u32..).zip(mesh.faces()).filter(|(_, face)| is_moved(mesh, places, face));
    changed.map(|(number, face)| (number, face.map(place))).unzip()
}

/// The triangles that go and come where another mesh takes the place of this one; `origins`: the triangle that each new one is, or [`u32::MAX`].
pub(super) fn replaced(mesh: &Mesh, (points, faces, origins): (&[[f32; 3]], &[[u32; 3]], &[u32])) -> (Vec<u32>, Vec<Corners>) {
    let mut stays = vec![false; mesh.faces().len()];
    for origin in origins {
        stays.iter_mut().skip(*origin as usize).take(1).for_each(|stays| *stays = true);
    }
    let gone = (0_u32..).zip(&stays).filter(|(_, stays)| !**stays).map(|(number, _)| number).collect();
    let place = |vertex: u32| points.get(vertex as usize).copied().unwrap_or_default();
    let new = faces.iter().zip(origins).filter(|(_, origin)| **origin == u32::MAX);
    (gone, new.map(|(face, _)| face.map(place)).collect())
}
