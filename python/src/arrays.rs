//! Arrays of numpy as meshes, and back. Nothing is copied: a mesh is looked at where its arrays lie, and a result's arrays become numpy's.

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;
use suture_core::operations::{FoundIntersections, FoundLoop};
use suture_core::{FaceOrigin, MeshView, RepairName, RepairedMesh};

use crate::errors::{invalid, to_json};

pub(crate) type Vertices<'py> = PyReadonlyArray2<'py, f32>;
pub(crate) type Faces<'py> = PyReadonlyArray2<'py, u32>;

/// Vertices, faces, by face the kind of its origin and the face of the input it comes from, and the report.
pub(crate) type Repaired<'py> =
    (Bound<'py, PyArray2<f32>>, Bound<'py, PyArray2<u32>>, Bound<'py, PyArray1<u8>>, Bound<'py, PyArray1<i64>>, String);
/// The vertices of each loop, and its facts.
pub(crate) type Loops<'py> = Vec<(Bound<'py, PyArray1<u32>>, String)>;
/// The two faces of each pair, whether they overlap, and the counts.
pub(crate) type Pairs<'py> = (Option<(Bound<'py, PyArray2<u32>>, Bound<'py, PyArray1<bool>>)>, String);

/// Kinds of origins before the names of repairs.
pub(crate) const KINDS: [&str; 4] = ["input", "flipped", "moved", "part"];

/// The mesh of two arrays of three columns each.
pub(crate) fn view<'a>(vertices: &'a Vertices<'_>, faces: &'a Faces<'_>) -> PyResult<MeshView<'a>> {
    if vertices.as_array().ncols() != 3 || faces.as_array().ncols() != 3 {
        return Err(invalid("vertices and faces have three columns"));
    }
    let (vertices, faces) = (vertices.as_slice()?.as_chunks().0, faces.as_slice()?.as_chunks().0);
    MeshView::new(vertices, faces).map_err(|error| invalid(error.to_string()))
}

fn rows<T: numpy::Element>(py: Python<'_>, rows: Vec<[T; 3]>) -> PyResult<Bound<'_, PyArray2<T>>> {
    let count = rows.len();
    PyArray1::from_vec(py, rows.into_flattened()).reshape([count, 3])
}

pub(crate) fn repaired_arrays(py: Python<'_>, repaired: RepairedMesh) -> PyResult<Repaired<'_>> {
    let RepairedMesh { mesh, origins, report, .. } = repaired;
    let kind = |origin: &FaceOrigin| match origin {
        FaceOrigin::Input(_) => 0,
        FaceOrigin::Flipped(_) => 1,
        FaceOrigin::Moved(_) => 2,
        FaceOrigin::Part(_) => 3,
        FaceOrigin::Repair(name) => code(*name),
        _ => u8::MAX,
    };
    let kinds: Vec<u8> = origins.iter().map(kind).collect();
    let faces: Vec<i64> = origins.iter().map(|origin| origin.input_face().map_or(-1, i64::from)).collect();
    let (vertices, triangles) = mesh.into_parts();
    let report = to_json(&report)?;
    Ok((rows(py, vertices)?, rows(py, triangles)?, PyArray1::from_vec(py, kinds), PyArray1::from_vec(py, faces), report))
}

/// The kind of a face that a repair made.
fn code(name: RepairName) -> u8 {
    let place = RepairName::ALL.iter().position(|other| *other == name);
    place.map_or(u8::MAX, |place| (KINDS.len() + place) as u8)
}

pub(crate) fn loops(py: Python<'_>, found: Vec<FoundLoop>) -> PyResult<Loops<'_>> {
    found.into_iter().map(|found| Ok((PyArray1::from_vec(py, found.vertices), to_json(&found.facts)?))).collect()
}

pub(crate) fn pairs(py: Python<'_>, found: FoundIntersections) -> PyResult<Pairs<'_>> {
    let counts = to_json(&found.counts)?;
    let Some(pairs) = found.pairs else { return Ok((None, counts)) };
    let faces: Vec<u32> = pairs.iter().flat_map(|pair| pair.faces).collect();
    let overlap: Vec<bool> = pairs.iter().map(|pair| pair.overlap).collect();
    let faces = PyArray1::from_vec(py, faces).reshape([pairs.len(), 2])?;
    Ok((Some((faces, PyArray1::from_vec(py, overlap))), counts))
}
