//! How true a patch is to the surface that was there.

use std::collections::HashSet;

use serde::{Deserialize, Serialize};

use super::surface::{Surface, degrees};
use crate::mesh::{Triangle, Vector, Welded, cross, dot, length, minus, unit, wide};

/// A program's patch of a hole, measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Measured {
    /// Vertices that the patch has beside the rim's.
    pub(crate) added: usize,
    /// Largest distance of these from the surface; of none, there is no such thing.
    pub(crate) vertices: Option<f64>,
    /// Largest distance of any point of the patch's triangles (45 of each are looked at).
    pub(crate) triangles: f64,
    /// Largest angle along the rim between vertex normals, each triangle weighted by its angle there, and the surface's, in degrees;
    /// `None` if a vertex of the rim is not there any more.
    pub(crate) normals: Option<f64>,
    /// Edges of one triangle that are left.
    pub(crate) open_edges: usize,
    /// Input triangles that are not there any more.
    pub(crate) lost: usize,
}

/// Compares a mesh with the one that had the hole: what is new is the patch. `None` when nothing is.
pub(super) fn measure(surface: Surface, before: &[Triangle], after: &[Triangle]) -> Option<Measured> {
    let mut welded = Welded::default();
    let old = welded.faces(before);
    let known = welded.points.len();
    let now = welded.faces(after);
    let there: HashSet<_> = old.iter().copied().collect();
    let patch: Vec<_> = now.iter().filter(|face| !there.contains(*face)).collect();
    let at = |v: u32| wide(welded.points[v as usize]);
    let far = |p: Vector| surface.distance(p).0;
    let added: HashSet<u32> = patch.iter().copied().flatten().copied().filter(|&v| v as usize >= known).collect();
    let of_vertices = added.iter().map(|&v| far(at(v))).reduce(f64::max);
    let of_triangles = patch.iter().flat_map(|face| samples(face.map(at))).map(far).reduce(f64::max)?;
    let rim: HashSet<u32> = open(&old).into_iter().map(|(from, _)| from).collect();
    let now_there: HashSet<_> = now.iter().copied().collect();
    Some(Measured {
        added: added.len(),
        vertices: of_vertices,
        triangles: of_triangles,
        normals: tilt(surface, &now, &rim, at),
        open_edges: open(&now).len(),
        lost: old.iter().filter(|face| !now_there.contains(*face)).count(),
    })
}

/// Directed edges without their opposite.
fn open(faces: &[[u32; 3]]) -> Vec<(u32, u32)> {
    let ends = |face: &[u32; 3]| [(face[0], face[1]), (face[1], face[2]), (face[2], face[0])];
    let all: HashSet<_> = faces.iter().flat_map(ends).collect();
    all.iter().copied().filter(|&(a, b)| !all.contains(&(b, a))).collect()
}

/// A triangular grid of nine points to a side.
fn samples(corners: [Vector; 3]) -> impl Iterator<Item = Vector> {
    let weights = (0..=8).flat_map(|i| (0..=8 - i).map(move |j| [i, j, 8 - i - j].map(|w| f64::from(w) / 8.0)));
    weights.map(move |w| std::array::from_fn(|k| (0..3).map(|c| w[c] * corners[c][k]).sum()))
}

/// Largest angle between normals of the rim and the surface's; `None` if one of its vertices is gone. A mesh that was turned inside out as a whole is not blamed for it here.
fn tilt(surface: Surface, faces: &[[u32; 3]], rim: &HashSet<u32>, at: impl Fn(u32) -> Vector) -> Option<f64> {
    let mut normals = std::collections::BTreeMap::<u32, Vector>::new();
    for face in faces {
        for k in 0..3 {
            let v = face[k];
            if !rim.contains(&v) {
                continue;
            }
            let [a, b, c] = [v, face[(k + 1) % 3], face[(k + 2) % 3]].map(&at);
            let (along, across) = (unit(minus(b, a)), unit(minus(c, a)));
            let normal = cross(along, across);
            let weight = length(normal).atan2(dot(along, across));
            let (normal, sum) = (unit(normal), normals.entry(v).or_default());
            *sum = std::array::from_fn(|k| sum[k] + weight * normal[k]);
        }
    }
    let angles: Vec<f64> = normals.iter().map(|(&v, &sum)| degrees(unit(sum), surface.distance(at(v)).1)).collect();
    let turned = angles.iter().filter(|angle| **angle > 90.0).count() * 2 > angles.len();
    let largest = angles.iter().map(|angle| if turned { 180.0 - angle } else { *angle }).reduce(f64::max);
    largest.filter(|_| angles.len() == rim.len())
}

#[cfg(test)]
mod tests {
    use super::super::cut::{Hole, mesh};
    use super::*;

    /// A patch of one point in the hole's middle: its distance is the one it was given, all else is chord.
    #[test]
    fn a_fan_is_as_far_off_as_its_tip() {
        let hole = Hole { share: 0.1, sampling: 1.0 };
        for surface in Surface::ALL {
            let before = mesh(surface, hole);
            let mut welded = Welded::default();
            let old = welded.faces(&before);
            let middle = surface.at([0.0, 0.0]);
            let normal = surface.distance(middle).1;
            for lift in [0.0, 0.002] {
                let tip = std::array::from_fn(|k| (middle[k] + lift * normal[k]) as f32);
                let fan = open(&old).into_iter().map(|(a, b)| [welded.points[b as usize], welded.points[a as usize], tip]);
                let after: Vec<_> = before.iter().copied().chain(fan).collect();
                let found = measure(surface, &before, &after).unwrap();
                assert_eq!((found.added, found.open_edges, found.lost), (1, 0, 0));
                assert!((found.vertices.unwrap() - lift).abs() < 1e-6, "{surface:?} {found:?}");
                let chord = 0.5 * (hole.share * surface.radius()).powi(2) / surface.radius();
                assert!(found.triangles < lift + chord, "{surface:?} {found:?}");
                assert!(found.normals.unwrap() < 3.0, "{surface:?} {found:?}");
                // Inside out as a whole: nothing else is another triangle.
                let turned: Vec<_> = after.iter().map(|&[a, b, c]| [a, c, b]).collect();
                assert!((measure(surface, &before, &turned).unwrap().normals.unwrap() - found.normals.unwrap()).abs() < 1e-6);
            }
            assert_eq!(measure(surface, &before, &before), None);
        }
    }
}
