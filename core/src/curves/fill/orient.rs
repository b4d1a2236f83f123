//! Which outlines to turn over, so that triangles agree across the curves that they share, and closed meshes face outwards.

use rayon::prelude::*;

use super::mesh::Mesh;
use crate::curves::vector::{cross, dot, sub};
use crate::util::each::Each;

/// An edge between two outlines, and whether both run along it in the same direction.
type Link = (u32, u32, bool);

/// Edges of a mesh that more than one outline may have.
#[derive(Clone, Copy, Debug)]
pub(super) struct Common<'a> {
    /// So many points at first are on curves.
    pub(super) rims: usize,
    /// Of each outline, whether all its edges to other points have a triangle on each side.
    pub(super) is_plain: &'a [bool],
}

/// For each outline, whether its triangles shall be reversed. Edges of more than two triangles tell nothing. Outlines that hang
/// together and are closed face outwards, or inwards if the first of them bounds a void; others go with the lowest of them. O(triangles + common
/// edges · log).
pub(super) fn flipped(mesh: &Mesh, outlines: usize, common: Common<'_>, is_void: impl Fn(usize) -> bool) -> Vec<bool> {
    let (links, open) = links(mesh, common);
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
    let volumes =
        volumes(mesh, &flips, |outline| component.get(outline).filter(|at| is_open.get(**at as usize) == Some(&false)).copied());
    for (flip, number) in flips.iter_mut().zip(&component) {
        let at = *number as usize;
        *flip ^= is_open.get(at) == Some(&false) && volumes.get(at).is_some_and(|volume| (*volume < 0.0) != is_void(at));
    }
    flips
}

/// Links between outlines, each once, and outlines with edges that no other triangle has.
fn links(mesh: &Mesh, common: Common<'_>) -> (Vec<Link>, Vec<u32>) {
    let own = |(&[a, b, c], &face): (&[u32; 3], &u32)| {
        let is_plain = common.is_plain.get(face as usize) == Some(&true);
        let edges = [(a, b), (b, c), (c, a)].into_iter();
        let may_be_common = move |&(a, b): &(u32, u32)| !is_plain || (a.max(b) as usize) < common.rims;
        edges.filter(may_be_common).map(move |(a, b)| (a.min(b), a.max(b), face, a < b))
    };
    let mut halves: Vec<(u32, u32, u32, bool)> = mesh.triangles.par_iter().zip(&mesh.face_of).flat_map_iter(own).collect();
    halves.par_sort_unstable();
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

/// Six times the volume of each component, as flipped, of those that are asked for.
fn volumes(mesh: &Mesh, flips: &[bool], component: impl Fn(usize) -> Option<u32>) -> Vec<f64> {
    let mut volumes = vec![0.0; flips.len()];
    let origin = mesh.points.first().copied().unwrap_or_default();
    for (triangle, face) in mesh.triangles.iter().zip(&mesh.face_of) {
        let Some(at) = component(*face as usize) else { continue };
        let [a, b, c] = triangle.each(|number| sub(mesh.points.get(number as usize).copied().unwrap_or(origin), origin));
        let sign = if flips.get(*face as usize) == Some(&true) { -1.0 } else { 1.0 };
        volumes.iter_mut().skip(at as usize).take(1).for_each(|volume| *volume += sign * dot(a, cross(b, c)));
    }
    volumes
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron, each face three triangles around a point within, the second face turned: it is turned back, whether edges to points
    /// within are known to be the own ones of their face or not.
    #[test]
    fn edges_within_an_outline_tell_nothing() {
        let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let faces = [[0, 2, 1], [0, 3, 1], [0, 3, 2], [1, 2, 3_usize]];
        let mut mesh = Mesh { points: corners.to_vec(), ..Mesh::default() };
        for (number, [a, b, c]) in faces.into_iter().enumerate() {
            let middle = mesh.points.len() as u32;
            mesh.points.push([0, 1, 2].map(|axis| (corners[a][axis] + corners[b][axis] + corners[c][axis]) / 3.0));
            mesh.triangles.extend([[a, b], [b, c], [c, a]].map(|[a, b]| [a as u32, b as u32, middle]));
            mesh.face_of.resize(mesh.triangles.len(), number as u32);
        }
        for is_plain in [&[true; 4][..], &[]] {
            assert_eq!(flipped(&mesh, 4, Common { rims: 4, is_plain }, |_| false), [false, true, false, false]);
        }
    }
}
