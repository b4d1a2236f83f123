//! Which outlines to turn over, so that triangles agree across the curves that they share, and closed meshes face outwards.

use super::mesh::Mesh;
use crate::curves::vector::{cross, dot, sub};
use crate::util::each::Each;

/// An edge between two outlines, and whether both run along it in the same direction.
type Link = (u32, u32, bool);

/// For each outline, whether its triangles shall be reversed. Edges of more than two triangles tell nothing. Outlines that hang
/// together and are closed face outwards, or inwards if the first of them bounds a void; others go with the lowest of them. O(triangles · log).
pub(super) fn flipped(mesh: &Mesh, outlines: usize, is_void: impl Fn(usize) -> bool) -> Vec<bool> {
    let (links, open) = links(mesh);
    let mut neighbours: Vec<Vec<(u32, bool)>> = vec![Vec::new(); outlines];
    for &(a, b, is_same) in &links {
        for (from, to) in [(a, b), (b, a)] {
            neighbours.iter_mut().skip(from as usize).take(1).for_each(|list| list.push((to, is_same)));
        }
    }
    let mut flips: Vec<Option<bool>> = vec![None; outlines];
    let mut component = vec![0_u32; outlines];
    for start in 0..outlines {
        if flips.get(start) != Some(&None) {
            continue;
        }
        let mut stack = vec![(start, false)];
        while let Some((at, flip)) = stack.pop() {
            let Some(known) = flips.get_mut(at).filter(|known| known.is_none()) else { continue };
            *known = Some(flip);
            component.iter_mut().skip(at).take(1).for_each(|number| *number = start as u32);
            let next = neighbours.get(at).into_iter().flatten();
            stack.extend(next.map(|(to, is_same)| (*to as usize, flip != *is_same)));
        }
    }
    let mut flips: Vec<bool> = flips.into_iter().map(|flip| flip.unwrap_or(false)).collect();
    let mut is_open = vec![false; outlines];
    for face in open {
        let number = component.get(face as usize).copied().unwrap_or_default();
        is_open.iter_mut().skip(number as usize).take(1).for_each(|open| *open = true);
    }
    let volumes = volumes(mesh, &flips, &component);
    for (flip, number) in flips.iter_mut().zip(&component) {
        let at = *number as usize;
        *flip ^= is_open.get(at) == Some(&false) && volumes.get(at).is_some_and(|volume| (*volume < 0.0) != is_void(at));
    }
    flips
}

/// Links between outlines, each once, and outlines with edges that no other triangle has.
fn links(mesh: &Mesh) -> (Vec<Link>, Vec<u32>) {
    let mut halves = Vec::with_capacity(3 * mesh.triangles.len());
    for (&[a, b, c], &face) in mesh.triangles.iter().zip(&mesh.face_of) {
        halves.extend([(a, b), (b, c), (c, a)].each(|(a, b)| (a.min(b), a.max(b), face, a < b)));
    }
    halves.sort_unstable();
    let (mut links, mut open) = (Vec::new(), Vec::new());
    for group in halves.chunk_by(|one, other| (one.0, one.1) == (other.0, other.1)) {
        match group {
            [one, other] if one.2 != other.2 => links.push((one.2, other.2, one.3 == other.3)),
            [_, _] => {}
            [one] => open.push(one.2),
            _ => open.extend(group.iter().map(|one| one.2)),
        }
    }
    links.sort_unstable();
    links.dedup();
    (links, open)
}

/// Six times the volume of each component, as flipped.
fn volumes(mesh: &Mesh, flips: &[bool], component: &[u32]) -> Vec<f64> {
    let mut volumes = vec![0.0; flips.len()];
    let origin = mesh.points.first().copied().unwrap_or_default();
    for (triangle, face) in mesh.triangles.iter().zip(&mesh.face_of) {
        let [a, b, c] = triangle.each(|number| sub(mesh.points.get(number as usize).copied().unwrap_or(origin), origin));
        let sign = if flips.get(*face as usize) == Some(&true) { -1.0 } else { 1.0 };
        let at = component.get(*face as usize).copied().unwrap_or_default() as usize;
        volumes.iter_mut().skip(at).take(1).for_each(|volume| *volume += sign * dot(a, cross(b, c)));
    }
    volumes
}
