//! The repair of residue: vertices within regions move onto the intended surface.
//!
//! They move there directly. Smoothing by λ|μ would only damp the waves: it needs many passes for a long wave, it leaves the part of the
//! wave that the border pins, and its mean surface lies half a scallop above the contact points; the intended surface is known at each
//! vertex, so nothing has to be guessed. Vertices within a region whose place is not known take the mean of their neighbours'.

use super::found::{Found, Mesh};
use super::options::{Error, Options};
use crate::curves::vector::{Point, add, cross, dot, plain_norm, plain_unit, scale, sub};
use rayon::prelude::*;

/// Passes over vertices without a place of their own.
const FILLS: usize = 32;
/// Passes that draw back vertices of triangles that would turn over.
const RETREATS: usize = 24;
/// Cosine of the angle between a triangle's normal before and after, at least: 75°, for steps of a wall are steep.
const TURN: f64 = 0.26;

/// A repaired mesh; its triangles are those of the input.
#[derive(Clone, Debug)]
pub struct Repaired {
    /// Places of vertices.
    pub points: Vec<[f32; 3]>,
    /// For each vertex, whether it may not move: it belongs to a triangle outside the regions, or to a feature.
    pub is_fixed: Vec<bool>,
    /// How many vertices moved.
    pub moved: usize,
    /// The longest way of a vertex, in millimetres: neither surface is farther than this from the other.
    pub displacement: f64,
    /// Change of volume, in cubic millimetres; its size is no more than area times displacement.
    pub volume: f64,
}

/// Moves the vertices of regions onto the intended surface; all vertices of other triangles stay to the bit. O(triangles).
///
/// # Errors
/// [`Error::Stopped`]; [`Error::Vertex`] or [`Error::Mask`] if the mesh is not the one that was searched.
pub fn repair(mesh: Mesh<'_>, found: &Found, options: &Options<'_>) -> Result<Repaired, Error> {
    if found.labels.len() != mesh.faces.len() || found.targets.len() != mesh.points.len() {
        return Err(Error::Mask { mask: found.labels.len(), faces: mesh.faces.len() });
    }
    super::find::check(mesh, options)?;
    let faces: Vec<[u32; 3]> =
        mesh.faces.iter().zip(&found.labels).filter(|(_, label)| **label != u32::MAX).map(|(face, _)| *face).collect();
    let mut is_fixed = fixed(mesh, found);
    let mut wanted: Vec<[f32; 3]> = found.targets.clone();
    for ((wanted, point), is_fixed) in wanted.iter_mut().zip(mesh.points).zip(&is_fixed) {
        if *is_fixed {
            *wanted = *point;
        }
    }
    fill(mesh, &faces, &mut wanted, options)?;
    features(&faces, &wanted, &mut is_fixed, options);
    for ((wanted, point), is_fixed) in wanted.iter_mut().zip(mesh.points).zip(&is_fixed) {
        if *is_fixed {
            *wanted = *point;
        }
    }
    retreat(mesh, &faces, &mut wanted, options)?;
    Ok(measure(mesh, &faces, wanted, is_fixed))
}

/// Vertices of triangles outside, or of borders of the mesh; and those of no triangle.
fn fixed(mesh: Mesh<'_>, found: &Found) -> Vec<bool> {
    let mut is_fixed = vec![true; mesh.points.len()];
    for face in mesh.faces.iter().zip(&found.labels).filter(|(_, label)| **label != u32::MAX).map(|(face, _)| face) {
        face.iter().for_each(|vertex| is_fixed[*vertex as usize] = false);
    }
    let neighbours = super::regions::neighbours(mesh.points.len(), mesh.faces);
    for ((face, label), sides) in mesh.faces.iter().zip(&found.labels).zip(&neighbours) {
        if *label == u32::MAX {
            face.iter().for_each(|vertex| is_fixed[*vertex as usize] = true);
        }
        for side in (0..3).filter(|side| sides[*side] == u32::MAX) {
            is_fixed[face[side] as usize] = true;
            is_fixed[face[(side + 1) % 3] as usize] = true;
        }
    }
    is_fixed
}

/// Gives vertices without a place the mean of their neighbours', again and again; neighbours without a place do not count at first.
fn fill(mesh: Mesh<'_>, faces: &[[u32; 3]], wanted: &mut [[f32; 3]], options: &Options<'_>) -> Result<(), Error> {
    let is_open = |vertex: u32| !wanted[vertex as usize][0].is_finite();
    let sides = faces.iter().flat_map(|[a, b, c]| [(*a, *b), (*b, *a), (*b, *c), (*c, *b), (*c, *a), (*a, *c)]);
    let mut pairs: Vec<(u32, u32)> = sides.filter(|(from, _)| is_open(*from)).collect();
    pairs.sort_unstable();
    pairs.dedup();
    for _ in 0..FILLS {
        if pairs.is_empty() {
            break;
        }
        if !(options.go_on)() {
            return Err(Error::Stopped);
        }
        let mean = |pairs: &[(u32, u32)]| {
            let known = pairs.iter().map(|(_, other)| wanted[*other as usize]).filter(|place| place[0].is_finite());
            let (sum, count) =
                known.fold(([0.0; 3], 0.0), |(sum, count): (Point, f64), place| (add(sum, place.map(f64::from)), count + 1.0));
            let vertex = pairs.first()?.0 as usize;
            (count > 0.0).then(|| (vertex, scale(sum, 1.0 / count).map(|x| x as f32)))
        };
        let means: Vec<(usize, [f32; 3])> = pairs.chunk_by(|a, b| a.0 == b.0).filter_map(mean).collect();
        means.into_iter().for_each(|(vertex, mean)| wanted[vertex] = mean);
    }
    for (wanted, point) in wanted.iter_mut().zip(mesh.points).filter(|(wanted, _)| !wanted[0].is_finite()) {
        *wanted = *point;
    }
    Ok(())
}

fn corners(points: &[[f32; 3]], face: &[u32; 3]) -> [Point; 3] {
    face.map(|vertex| points[vertex as usize].map(f64::from))
}

fn normal(points: &[[f32; 3]], face: &[u32; 3]) -> Point {
    let [a, b, c] = corners(points, face);
    cross(sub(b, a), sub(c, a))
}

/// Fixes vertices of edges that are sharp on the intended surface too.
fn features(faces: &[[u32; 3]], wanted: &[[f32; 3]], is_fixed: &mut [bool], options: &Options<'_>) {
    let cosine = options.feature_degrees.to_radians().cos();
    let neighbours = super::regions::neighbours(wanted.len(), faces);
    let normals: Vec<Option<Point>> = faces.iter().map(|face| plain_unit(normal(wanted, face))).collect();
    // Borders of regions stand out from the surface beside them as far as the scallops that they cut: they are no features.
    let was_fixed = is_fixed.to_vec();
    let touches = |face: &[u32; 3]| face.iter().any(|vertex| was_fixed[*vertex as usize]);
    for ((face, sides), own) in faces.iter().zip(&neighbours).zip(&normals) {
        for (side, next) in sides.iter().enumerate().filter(|(_, next)| **next != u32::MAX) {
            let (Some(own), Some(other)) = (own, normals[*next as usize]) else { continue };
            if dot(*own, other) < cosine && !touches(face) && !touches(&faces[*next as usize]) {
                is_fixed[face[side] as usize] = true;
                is_fixed[face[(side + 1) % 3] as usize] = true;
            }
        }
    }
}

/// Draws vertices of triangles that would turn over, or lose their area, halfway back; at last, all the way.
fn retreat(mesh: Mesh<'_>, faces: &[[u32; 3]], wanted: &mut [[f32; 3]], options: &Options<'_>) -> Result<(), Error> {
    for step in 0..RETREATS {
        if !(options.go_on)() {
            return Err(Error::Stopped);
        }
        let is_bad = |face: &&[u32; 3]| {
            let (before, behind) = (normal(mesh.points, face), normal(wanted, face));
            let (long, short) = (plain_norm(before), plain_norm(behind));
            !(dot(before, behind) >= TURN * long * short && short >= 1e-3 * long) && long > 0.0
        };
        let mut bad: Vec<u32> = faces.par_iter().filter(is_bad).flat_map_iter(|face| *face).collect();
        if bad.is_empty() {
            break;
        }
        bad.sort_unstable();
        bad.dedup();
        for vertex in bad.iter().map(|vertex| *vertex as usize) {
            let (here, there) = (mesh.points[vertex], wanted[vertex]);
            let half = [0, 1, 2].map(|axis| 0.5 * (here[axis] + there[axis]));
            wanted[vertex] = if step + 8 >= RETREATS { here } else { half };
        }
    }
    Ok(())
}

fn measure(mesh: Mesh<'_>, faces: &[[u32; 3]], points: Vec<[f32; 3]>, is_fixed: Vec<bool>) -> Repaired {
    let way = |(a, b): (&[f32; 3], &[f32; 3])| plain_norm(sub(a.map(f64::from), b.map(f64::from)));
    let displacement = points.iter().zip(mesh.points).map(way).fold(0.0, f64::max);
    let moved = points.iter().zip(mesh.points).filter(|(a, b)| a != b).count();
    // Relative to a corner of the region, so that little is lost to rounding.
    let origin = faces.first().map_or([0.0; 3], |face| corners(mesh.points, face)[0]);
    let six = |points: &[[f32; 3]], face: &[u32; 3]| {
        let [a, b, c] = corners(points, face).map(|corner| sub(corner, origin));
        dot(a, cross(b, c))
    };
    let volume = faces.iter().map(|face| six(&points, face) - six(mesh.points, face)).sum::<f64>() / 6.0;
    Repaired { points, is_fixed, moved, displacement, volume }
}
