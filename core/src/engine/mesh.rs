//! A mesh in memory.

use rayon::prelude::*;

use crate::engine::shared_vertices::{self, Welded};
use crate::io::read::MAX_TRIANGLES;
use crate::io::record::{self, Record};
use crate::util::parallel;
use crate::util::words::Count;

/// Fewer records are made by one thread: starting more would take longer.
const MADE_BY_ONE: usize = 1 << 16;

/// A triangle mesh in memory: vertices, and faces of three of them each, which are seen from outside counter-clockwise.
///
/// Faces refer to vertices that are there; nothing else is promised. Coordinates may be anything (faces with one that is not finite are a
/// defect), vertices may be unused or share a position (two at one position are one to the engine), and faces may repeat a vertex.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    vertices: Vec<[f32; 3]>,
    faces: Vec<[u32; 3]>,
}

/// A [`Mesh`] whose arrays belong to someone else.
#[derive(Clone, Copy, Debug)]
pub struct MeshView<'m> {
    vertices: &'m [[f32; 3]],
    faces: &'m [[u32; 3]],
}

/// Why arrays are no mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "each variant says what its fields are")]
pub enum MeshError {
    /// A face refers to a vertex that is not there.
    #[error("face {face} refers to vertex {vertex}, and there are {} vertices", Count(.vertices))]
    NoVertex { face: usize, vertex: u32, vertices: usize },
    /// More faces than numbers of faces can tell apart.
    #[error("{} faces; a mesh can have {}", Count(.faces), Count(MAX_TRIANGLES))]
    TooManyFaces { faces: usize },
    /// More vertices than numbers of vertices can tell apart.
    #[error("{} vertices; a mesh can have 4 294 967 295", Count(.vertices))]
    TooManyVertices { vertices: usize },
}

impl Mesh {
    /// Of vertices and faces.
    ///
    /// ```
    /// use suture_core::{Mesh, MeshError};
    ///
    /// let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    /// assert!(Mesh::new(corners.clone(), vec![[0, 1, 2]]).is_ok());
    /// assert_eq!(Mesh::new(corners, vec![[0, 1, 3]]), Err(MeshError::NoVertex { face: 0, vertex: 3, vertices: 3 }));
    /// ```
    ///
    /// # Errors
    /// [`MeshError`]. O(faces).
    pub fn new(vertices: Vec<[f32; 3]>, faces: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        MeshView::new(&vertices, &faces)?;
        Ok(Self { vertices, faces })
    }

    /// Of a soup: triangles by the positions of their corners. Corners at one position become one vertex (−0.0 is 0.0), numbered by first
    /// appearance; a corner with a coordinate that is not finite becomes a vertex of its own, after all others. O(triangles).
    ///
    /// # Errors
    /// [`MeshError::TooManyFaces`], [`MeshError::TooManyVertices`].
    pub fn from_triangles(triangles: &[[[f32; 3]; 3]]) -> Result<Self, MeshError> {
        are_few_enough(triangles.len())?;
        Self::of_welded(shared_vertices::alone(triangles, |triangle| *triangle))
    }

    /// The same of records, on the threads of the pool that this one belongs to.
    ///
    /// # Errors
    /// As those of [`Self::from_triangles`].
    pub(crate) fn of_records(records: &[Record]) -> Result<Self, MeshError> {
        are_few_enough(records.len())?;
        Self::of_welded(shared_vertices::together(records, record::corners))
    }

    fn of_welded(welded: Result<Welded, usize>) -> Result<Self, MeshError> {
        let Welded { vertices, faces } = welded.map_err(|vertices| MeshError::TooManyVertices { vertices })?;
        Ok(Self { vertices, faces })
    }

    /// Of vertices, and faces that refer to these.
    pub(crate) fn of_parts(vertices: Vec<[f32; 3]>, faces: Vec<[u32; 3]>) -> Self {
        Self { vertices, faces }
    }

    /// Positions of the vertices.
    pub fn vertices(&self) -> &[[f32; 3]] {
        &self.vertices
    }

    /// The vertices of each face.
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// The vertices and the faces.
    pub fn into_parts(self) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
        (self.vertices, self.faces)
    }

    /// The same without its own arrays.
    pub fn view(&self) -> MeshView<'_> {
        MeshView { vertices: &self.vertices, faces: &self.faces }
    }
}

/// Can numbers tell so many faces apart?
fn are_few_enough(faces: usize) -> Result<(), MeshError> {
    if faces as u64 > MAX_TRIANGLES { Err(MeshError::TooManyFaces { faces }) } else { Ok(()) }
}

impl<'m> From<&'m Mesh> for MeshView<'m> {
    fn from(mesh: &'m Mesh) -> Self {
        mesh.view()
    }
}

impl<'m> MeshView<'m> {
    /// Of vertices and faces.
    ///
    /// # Errors
    /// [`MeshError`]. O(faces).
    pub fn new(vertices: &'m [[f32; 3]], faces: &'m [[u32; 3]]) -> Result<Self, MeshError> {
        if u32::try_from(vertices.len()).is_err() {
            return Err(MeshError::TooManyVertices { vertices: vertices.len() });
        }
        are_few_enough(faces.len())?;
        // Branch-free first; the culprit is looked for only if there is one.
        let largest = faces.as_flattened().iter().copied().max().unwrap_or(0);
        if largest as usize >= vertices.len()
            && let Some((face, corners)) = faces.iter().enumerate().find(|(_, f)| f.iter().any(|v| *v as usize >= vertices.len()))
        {
            let vertex = corners.iter().copied().max().unwrap_or(0);
            return Err(MeshError::NoVertex { face, vertex, vertices: vertices.len() });
        }
        Ok(Self { vertices, faces })
    }

    /// Positions of the vertices.
    pub fn vertices(&self) -> &'m [[f32; 3]] {
        self.vertices
    }

    /// The vertices of each face.
    pub fn faces(&self) -> &'m [[u32; 3]] {
        self.faces
    }

    /// The faces by the positions of their corners.
    pub fn triangles(&self) -> impl ExactSizeIterator<Item = [[f32; 3]; 3]> + use<'m> {
        let vertices = self.vertices;
        self.faces.iter().map(move |face| face.map(|v| vertices[v as usize]))
    }

    /// The same with arrays of its own.
    pub(crate) fn to_mesh(self) -> Mesh {
        Mesh { vertices: self.vertices.to_vec(), faces: self.faces.to_vec() }
    }

    /// The faces as the engine reads them; without normals, which it does not ask for, and attributes.
    pub(crate) fn records(&self, threads: usize) -> Vec<Record> {
        let record = |face: &[u32; 3]| record::assemble([0.0; 3], face.map(|v| self.vertices[v as usize]), 0);
        if threads < 2 || self.faces.len() < MADE_BY_ONE {
            return self.faces.iter().map(record).collect();
        }
        parallel::in_pool(threads, || self.faces.par_iter().map(record).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_at_one_position_are_one_vertex() {
        let (a, b, c, d) = ([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-0.0, 0.0, -0.0]);
        let mesh = Mesh::from_triangles(&[[b, a, c], [c, d, [5.0; 3]]]).unwrap();
        assert_eq!(mesh.faces(), [[0, 1, 2], [2, 1, 3]]);
        assert_eq!(mesh.vertices(), [b, a, c, [5.0; 3]]);
        assert_eq!(mesh.view().triangles().nth(1), Some([c, a, [5.0; 3]]));
    }

    /// NaN is no position that anything else could have, and infinity is none that a surface could run through.
    #[test]
    fn a_corner_that_is_not_finite_is_a_vertex_of_its_own_and_comes_last() {
        let odd = [f32::NAN, 0.0, f32::INFINITY];
        let mesh = Mesh::from_triangles(&[[odd, odd, [0.0; 3]], [[1.0; 3], [0.0; 3], [f32::INFINITY; 3]]]).unwrap();
        assert_eq!(mesh.faces(), [[2, 3, 0], [1, 0, 4]]);
        assert_eq!(mesh.vertices()[..2], [[0.0; 3], [1.0; 3]]);
        assert!(mesh.vertices()[2..].iter().all(|p| p.iter().any(|x| !x.is_finite())));
    }

    #[test]
    fn faces_refer_to_vertices_that_are_there() {
        let points = [[0.0; 3]; 3];
        assert!(MeshView::new(&points, &[]).is_ok() && MeshView::new(&[], &[]).is_ok());
        assert_eq!(MeshView::new(&[], &[[0; 3]]).unwrap_err(), MeshError::NoVertex { face: 0, vertex: 0, vertices: 0 });
        let error = MeshView::new(&points, &[[0, 1, 2], [0, u32::MAX, 7]]).unwrap_err();
        assert_eq!(error.to_string(), "face 1 refers to vertex 4294967295, and there are 3 vertices");
    }
}
