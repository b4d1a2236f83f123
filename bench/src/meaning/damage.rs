//! What goes wrong on the way of a mesh to a file.

use std::collections::BTreeMap;

use super::mesh::{Face, Mesh, V, key, minus, plus, times};
use super::random::Chance;
use super::shapes::apart;

/// Each face is lost with this probability; at least one is.
pub(super) fn lose(chance: &mut Chance, mesh: &Mesh, share: f64) -> Mesh {
    let count = ((mesh.0.len() as f64 * share).round() as usize).clamp(1, mesh.0.len().saturating_sub(1));
    lose_some(chance, mesh, count)
}

/// So many faces are lost.
pub(super) fn lose_some(chance: &mut Chance, mesh: &Mesh, count: usize) -> Mesh {
    let mut order: Vec<usize> = (0..mesh.0.len()).collect();
    chance.shuffle(&mut order);
    let mut lost = order[..count].to_vec();
    lost.sort_unstable();
    Mesh(mesh.0.iter().enumerate().filter(|(k, _)| lost.binary_search(k).is_err()).map(|(_, face)| *face).collect())
}

/// Faces whose middle is within `radius` of a place are lost.
pub(super) fn lose_near(mesh: &Mesh, place: V, radius: f64) -> Mesh {
    mesh.only(|face| apart(face.middle(), place) > radius)
}

/// The middle of any face.
pub(super) fn somewhere(chance: &mut Chance, mesh: &Mesh) -> V {
    mesh.0[chance.count(0, mesh.0.len() - 1)].middle()
}

/// So many connected faces about any one, fewer if its shell has no more: whether each face is of them.
pub(super) fn patch(chance: &mut Chance, mesh: &Mesh, share: f64) -> Vec<bool> {
    let mut at: BTreeMap<[u64; 3], Vec<usize>> = BTreeMap::new();
    for (k, face) in mesh.0.iter().enumerate() {
        face.p.iter().for_each(|&p| at.entry(key(p)).or_default().push(k));
    }
    let count = ((mesh.0.len() as f64 * share).round() as usize).max(1);
    let mut is_of = vec![false; mesh.0.len()];
    let mut found = vec![chance.count(0, mesh.0.len() - 1)];
    is_of[found[0]] = true;
    let mut next = 0;
    while next < found.len() && found.len() < count {
        for &k in mesh.0[found[next]].p.iter().flat_map(|&p| &at[&key(p)]) {
            if found.len() < count && !std::mem::replace(&mut is_of[k], true) {
                found.push(k);
            }
        }
        next += 1;
    }
    is_of
}

/// A connected patch is turned.
pub(super) fn flip_patch(chance: &mut Chance, mesh: &Mesh, share: f64) -> Mesh {
    let is_of = patch(chance, mesh, share);
    Mesh(mesh.0.iter().zip(is_of).map(|(face, is_of)| if is_of { face.turned() } else { *face }).collect())
}

/// Each face is turned with this probability.
pub(super) fn flip(chance: &mut Chance, mesh: &Mesh, share: f64) -> Mesh {
    Mesh(mesh.0.iter().map(|face| if chance.is(share) { face.turned() } else { *face }).collect())
}

/// Every part of the surface is moved by itself, by up to `most`: faces of CAD that were sewn badly.
pub(super) fn unsew(chance: &mut Chance, mesh: &Mesh, most: f64) -> Mesh {
    let parts = mesh.0.iter().map(|face| face.part).max().unwrap_or(0);
    let steps: Vec<V> = (0..=parts).map(|_| chance.step(most)).collect();
    let moved = |face: &Face| Face { p: face.p.map(|p| plus(p, steps[face.part as usize])), ..*face };
    Mesh(mesh.0.iter().map(moved).collect())
}

/// Every corner of every face is moved by itself.
pub(super) fn jitter(chance: &mut Chance, mesh: &Mesh, most: f64) -> Mesh {
    Mesh(mesh.0.iter().map(|face| Face { p: face.p.map(|p| plus(p, chance.step(most))), ..*face }).collect())
}

/// Faces are there twice, the second time moved by up to `most`.
pub(super) fn double(chance: &mut Chance, mesh: &Mesh, share: f64, most: f64) -> Mesh {
    let mut faces = mesh.0.clone();
    for face in &mesh.0 {
        if chance.is(share) {
            let p = if most > 0.0 { face.p.map(|p| plus(p, chance.step(most))) } else { face.p };
            faces.push(Face { p, ..*face });
        }
    }
    Mesh(faces)
}

/// Edges are split by one of their two triangles only.
pub(super) fn split_alone(chance: &mut Chance, mesh: &Mesh, share: f64) -> Mesh {
    let mut faces = Vec::new();
    for face in &mesh.0 {
        let [a, b, c] = face.p;
        if chance.is(share) {
            let middle = plus(a, times(minus(b, a), chance.from(0.3, 0.7)));
            faces.extend([Face { p: [a, middle, c], ..*face }, Face { p: [middle, b, c], ..*face }]);
        } else {
            faces.push(*face);
        }
    }
    Mesh(faces)
}

/// Faces without area: of an edge and a point of it, or of a vertex thrice.
pub(super) fn slivers(chance: &mut Chance, mesh: &Mesh, share: f64) -> Mesh {
    let mut faces = mesh.0.clone();
    for face in &mesh.0 {
        let [a, b, _] = face.p;
        if chance.is(share) {
            let third = if chance.is(0.5) { plus(a, times(minus(b, a), 0.5)) } else { b };
            faces.push(Face { p: [a, b, third], ..*face });
        }
    }
    Mesh(faces)
}

/// In any order.
pub(super) fn shuffled(chance: &mut Chance, mesh: &Mesh) -> Mesh {
    let mut faces = mesh.0.clone();
    chance.shuffle(&mut faces);
    Mesh(faces)
}

/// Most files are written in the order in which they were made; some are not.
pub(super) fn shuffled_if(chance: &mut Chance, mesh: &Mesh) -> Mesh {
    if chance.is(0.3) { shuffled(chance, mesh) } else { mesh.clone() }
}
