//! Corrections of residue from files: a brush, whose numbers are of the input's triangles, and a mask, which is a mesh.

use std::path::Path;

use glam::DVec3;
use rayon::prelude::*;

use crate::algorithms::wrap::tree::Tree;
use crate::engine::mesh::Mesh;
use crate::engine::work::Work;
use crate::io::read::MeshFile;
use crate::io::record;
use crate::residue::{Brush, BrushError};

/// Memory for each triangle of a mask: corners, welded vertices and faces, a tree.
const BYTES_A_TRIANGLE: u64 = 256;
/// Bytes of a brush, at most: 2³² numbers of triangles have ten digits, but no mesh that fits into memory has so many.
const BRUSH_BYTES: u64 = 1 << 30;
/// How far a centre may be from a mask that it lies on: roundings of coordinates in single precision, of the greatest one.
const ROUNDINGS: f64 = 8.0;
/// Centres that are asked for together.
const BLOCK: usize = 1024;

/// Where the triangles of a mesh come from.
pub(crate) struct Origins {
    /// For each the number of the input's triangle that it is, or is a part of; `None` for a new one.
    pub(crate) of: Vec<Option<u32>>,
    /// Triangles of the input.
    pub(crate) inputs: usize,
}

/// Corrections, as the search for residue takes them.
#[derive(Default)]
pub(super) struct FromFiles {
    /// Numbers of painted triangles.
    pub(super) triangles: Vec<u32>,
    /// For each triangle whether it is in the mask; empty without one.
    pub(super) mask: Vec<bool>,
}

/// Reads what the profile names; or why that cannot be.
pub(super) fn read(mesh: &Mesh, origins: &dyn Fn() -> Origins, work: Work<'_>) -> Result<FromFiles, String> {
    let settings = &work.profile.residue;
    let mut all = FromFiles::default();
    if !settings.brush.is_empty() {
        let path = &settings.brush;
        let bytes = bounded(Path::new(path)).map_err(|why| format!("{path}: {why}"))?;
        all.triangles = painted(&bytes, &origins()).map_err(|error| format!("{path}: {error}"))?;
    }
    if !settings.mask.is_empty() {
        all.mask = mask(Path::new(&settings.mask), mesh, work)?;
    }
    Ok(all)
}

/// A file that may be a brush.
fn bounded(path: &Path) -> Result<Vec<u8>, String> {
    let unread = |error: std::io::Error| format!("cannot be read: {error}");
    let length = std::fs::metadata(path).map_err(unread)?.len();
    if length > BRUSH_BYTES {
        return Err("it is too large for a list of triangles".into());
    }
    std::fs::read(path).map_err(unread)
}

/// The triangles of a mesh that come from painted ones.
fn painted(bytes: &[u8], origins: &Origins) -> Result<Vec<u32>, BrushError> {
    let painted = Brush::parse(bytes)?.painted(origins.inputs)?;
    let is_painted = |from: &Option<u32>| from.is_some_and(|from| painted.get(from as usize) == Some(&true));
    Ok((0..).zip(&origins.of).filter(|(_, from)| is_painted(from)).map(|(number, _)| number).collect())
}

/// For each triangle of a mesh whether its centre is on a mask or, where that is closed, within it.
fn mask(path: &Path, mesh: &Mesh, work: Work<'_>) -> Result<Vec<bool>, String> {
    // The line of an error has the path.
    let file =
        MeshFile::open(path, &work.limits.spool_folder(), work.limits, work.progress).map_err(|error| error.to_string())?;
    let shown = path.display();
    let needed = file.records().len() as u64 * BYTES_A_TRIANGLE;
    if needed > work.limits.memory_bytes {
        let [needed, given] = [needed, work.limits.memory_bytes].map(|bytes| bytes.div_ceil(1 << 20));
        return Err(format!("{shown}: a mask of so many triangles takes {needed} MiB of memory, and {given} MiB may be used"));
    }
    let corners: Vec<_> = file.records().iter().map(record::corners).collect();
    let masking = Mesh::of_records(file.records()).map_err(|error| format!("{shown}: {error}"))?;
    Ok(within(mesh, &masking, &corners))
}

fn within(mesh: &Mesh, mask: &Mesh, corners: &[[[f32; 3]; 3]]) -> Vec<bool> {
    let is_closed = is_closed(mask.faces());
    let tree = if is_closed { Tree::winding(corners) } else { Tree::new(corners) };
    let greatest = mesh.vertices().iter().chain(mask.vertices()).flatten().fold(0.0f32, |most, x| most.max(x.abs()));
    let near = ROUNDINGS * f64::from(greatest) * f64::from(f32::EPSILON);
    let of = |faces: &[[u32; 3]]| {
        let centres: Vec<DVec3> = faces.iter().map(|face| centre(mesh, face)).collect();
        let windings = if is_closed { tree.winding_numbers(&centres) } else { vec![0.0; centres.len()] };
        let is_in = |(centre, winding): (&DVec3, &f64)| winding.abs() > 0.5 || tree.is_within(*centre, near);
        centres.iter().zip(&windings).map(is_in).collect::<Vec<bool>>()
    };
    mesh.faces().par_chunks(BLOCK).flat_map_iter(of).collect()
}

fn centre(mesh: &Mesh, face: &[u32; 3]) -> DVec3 {
    let corner = |vertex: u32| mesh.vertices().get(vertex as usize).map_or(DVec3::ZERO, |p| DVec3::from(p.map(f64::from)));
    let [a, b, c] = face.map(corner);
    (a + b + c) / 3.0
}

/// Whether each edge has as many triangles on its one side as on its other.
fn is_closed(faces: &[[u32; 3]]) -> bool {
    let sides = |[a, b, c]: &[u32; 3]| [(*a, *b), (*b, *c), (*c, *a)];
    let mut edges: Vec<(u32, u32, bool)> =
        faces.iter().flat_map(sides).filter(|(a, b)| a != b).map(|(a, b)| (a.min(b), a.max(b), a < b)).collect();
    edges.sort_unstable();
    edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)).all(|same| 2 * same.iter().filter(|edge| edge.2).count() == same.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    type Corners = [[f32; 3]; 3];

    /// The unit cube's twelve triangles, at a place and of a size.
    fn cube(at: [f32; 3], size: f32) -> Vec<Corners> {
        let point = |n: usize| [n & 1, n >> 1 & 1, n >> 2].map(|bit| bit as f32);
        let square = |[a, b, c, d]: [usize; 4]| [[a, b, c], [a, c, d]];
        let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let placed = |n: usize| {
            let p = point(n);
            [0, 1, 2].map(|k| at[k] + size * p[k])
        };
        sides.into_iter().flat_map(square).map(|face| face.map(placed)).collect()
    }

    fn of(mesh: &[Corners], mask: &[Corners]) -> Vec<usize> {
        let (mesh, welded) = (Mesh::from_triangles(mesh).unwrap(), Mesh::from_triangles(mask).unwrap());
        within(&mesh, &welded, mask).iter().enumerate().filter(|(_, is_in)| **is_in).map(|(number, _)| number).collect()
    }

    /// A closed mask counts with what it holds; an open one with what lies on it, and with nothing under it.
    #[test]
    fn a_mask_is_a_solid_or_a_surface() {
        let part = cube([0.0; 3], 1.0);
        assert_eq!(of(&part, &cube([-1.0; 3], 3.0)), (0..12).collect::<Vec<_>>());
        // Its lower half: the centres of the bottom, and of each side's triangle that has its long edge below.
        let lower = of(&part, &cube([-1.0, -1.0, -2.5], 3.0));
        let below = |corners: &Corners| corners.iter().map(|p| p[2]).sum::<f32>() < 1.5;
        assert_eq!(lower, (0..12).filter(|n| below(&part[*n])).collect::<Vec<_>>());
        // The cube without its top: a triangle of its bottom lies on it, and one within it does not.
        let open: Vec<Corners> = [&part[..2], &part[4..]].concat();
        let inner = cube([0.25; 3], 0.5);
        assert_eq!(of(&[&part[..], &inner].concat(), &open), [0, 1, 4, 5, 6, 7, 8, 9, 10, 11]);
        assert_eq!(of(&inner, &part), (0..12).collect::<Vec<_>>());
    }

    /// A brush paints by the input's numbers, whatever became of their order; what is new is not painted.
    #[test]
    fn a_brush_has_the_numbers_of_the_input() {
        let origins = Origins { of: vec![Some(0), Some(2), None, Some(3), Some(3)], inputs: 4 };
        assert_eq!(painted(b"3 1", &origins), Ok(vec![3, 4]));
        assert_eq!(painted(b"2", &origins), Ok(vec![1]));
        assert_eq!(painted(b"4", &origins), Err(BrushError::Beyond { number: 4, triangles: 4 }));
    }
}
