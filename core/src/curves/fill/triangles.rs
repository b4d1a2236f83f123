//! Triangles between rings of places in a plane: Delaunay's, with the rings as constraints.

use std::collections::BTreeSet;

use crate::util::each::Each;
use spade::handles::{DirectedEdgeHandle, FaceHandle, InnerTag};
use spade::{CdtEdge, ConstrainedDelaunayTriangulation, Point2, Triangulation};

type Cdt = ConstrainedDelaunayTriangulation<Point2<f64>>;
type Face<'a> = FaceHandle<'a, InnerTag, Point2<f64>, (), CdtEdge<()>, ()>;
type Edge<'a> = DirectedEdgeHandle<'a, Point2<f64>, (), CdtEdge<()>, ()>;

/// Places, those of the rings first and in their order, and triangles, all anticlockwise.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Flat {
    pub(super) places: Vec<[f64; 2]>,
    pub(super) triangles: Vec<[u32; 3]>,
}

/// Triangles within rings (the outer one anticlockwise, others clockwise), whose places are their corners. Rings may touch themselves and each other in
/// places that they share; `None` of those that cross. O(n log n).
pub(super) fn triangles(rings: &[Vec<[f64; 2]>]) -> Option<Flat> {
    let all: Vec<[f64; 2]> = rings.iter().flatten().copied().collect();
    let [low, high] = all.iter().fold([[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]], |[low, high], [x, y]| {
        [[low[0].min(*x), low[1].min(*y)], [high[0].max(*x), high[1].max(*y)]]
    });
    let size = (high[0] - low[0]).max(high[1] - low[1]);
    if all.len() < 3 || !(size > 0.0 && size.is_finite()) {
        return None;
    }
    let points: Vec<Point2<f64>> = all.iter().map(|[x, y]| Point2::new((x - low[0]) / size, (y - low[1]) / size)).collect();
    let (cdt, numbers, slits) = constrained(&points, rings)?;
    let is_inside = inside(&cdt, &slits);
    // Rings that lie in one another otherwise than they should have another area.
    let area: f64 = cdt.inner_faces().filter(|face| is_in(&is_inside, *face)).map(|face| face.area()).sum();
    let expected = rings.iter().map(|ring| shoelace(ring)).sum::<f64>() / (size * size);
    if !(expected > 0.0 && (area - expected).abs() <= 1e-6 * expected) {
        return None;
    }
    let mut flat = Flat { places: all, triangles: Vec::new() };
    let faces = cdt.inner_faces().filter(|face| is_in(&is_inside, *face));
    let number = |vertex: usize| numbers.get(vertex).copied().unwrap_or_default();
    flat.triangles = faces.map(|face| face.vertices().each(|vertex| number(vertex.fix().index()))).collect();
    Some(flat)
}

/// The triangulation with rings as constraints, for each vertex of it the number of its first place, and the edges that rings pass an even number of times: slits,
/// which have the same on both sides. Places go in by rounds, each
/// of about twice as many as the one before, chosen by scrambled numbers, and in the order of rings within a round, so that the last
/// place is a hint for the next (N. Amenta, S. Choi, G. Rote, *Incremental constructions con BRIO*, SoCG 2003): the expected time is
/// O(n log n) of any rings, and the order is always the same.
fn constrained(points: &[Point2<f64>], rings: &[Vec<[f64; 2]>]) -> Option<(Cdt, Vec<u32>, BTreeSet<[usize; 2]>)> {
    let mut cdt = Cdt::new();
    let mut handles = vec![cdt.insert(*points.first()?).ok()?; points.len()];
    let mut numbers = vec![0];
    let mut order: Vec<(u32, usize)> = (1..points.len()).map(|at| (scramble(at as u64).trailing_zeros(), at)).collect();
    order.sort_unstable_by_key(|(round, at)| (std::cmp::Reverse(*round), *at));
    let mut hint = *handles.first()?;
    for (_, at) in order {
        hint = cdt.insert_with_hint(*points.get(at)?, hint).ok()?;
        *handles.get_mut(at)? = hint;
        // Where rings touch, the first place in their order counts.
        match numbers.get_mut(hint.index()) {
            Some(number) => *number = at.min(*number as usize) as u32,
            None => numbers.push(at as u32),
        }
    }
    let (mut first, mut slits) = (0, BTreeSet::new());
    for ring in rings {
        let around = handles.get(first..first + ring.len())?;
        for (a, b) in around.iter().zip(around.iter().cycle().skip(1)) {
            if a == b || !cdt.can_add_constraint(*a, *b) {
                return None;
            }
            let ends = [a.index().min(b.index()), a.index().max(b.index())];
            if cdt.exists_constraint(*a, *b) {
                if !slits.remove(&ends) {
                    slits.insert(ends);
                }
                continue;
            }
            cdt.add_constraint(*a, *b);
        }
        first += ring.len();
    }
    Some((cdt, numbers, slits))
}

/// A number whose bits are as good as random (G. L. Steele, D. Lea, C. H. Flood, *Fast splittable pseudorandom number generators*,
/// OOPSLA 2014).
fn scramble(number: u64) -> u64 {
    let mixed = number.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    mixed ^ (mixed >> 31)
}

fn is_in(is_inside: &[bool], face: Face<'_>) -> bool {
    is_inside.get(face.fix().index()) == Some(&true)
}

/// Faces that an odd number of edges of rings separates from the outside. O(faces).
fn inside(cdt: &Cdt, slits: &BTreeSet<[usize; 2]>) -> Vec<bool> {
    let mut depth: Vec<Option<bool>> = vec![None; cdt.num_all_faces()];
    let outer = cdt.outer_face();
    let mut stack = vec![(outer.fix(), false)];
    while let Some((face, is_inside)) = stack.pop() {
        let Some(known) = depth.get_mut(face.index()).filter(|known| known.is_none()) else { continue };
        *known = Some(is_inside);
        // Edges of the hull have the outer face at their left.
        let bounds = |edge: Edge<'_>| {
            let [a, b] = [edge.from(), edge.to()].each(|vertex| vertex.fix().index());
            edge.is_constraint_edge() && !slits.contains(&[a.min(b), a.max(b)])
        };
        let mut cross = |edge: Edge<'_>| stack.push((edge.rev().face().fix(), is_inside != bounds(edge)));
        match cdt.face(face).as_inner() {
            Some(inner) => inner.adjacent_edges().into_iter().for_each(&mut cross),
            None => cdt.convex_hull().for_each(&mut cross),
        }
    }
    depth.into_iter().map(|known| known == Some(true)).collect()
}

/// The area within a ring, positive if that runs anticlockwise.
pub(super) fn shoelace(ring: &[[f64; 2]]) -> f64 {
    let Some(&[x, y]) = ring.first() else { return 0.0 };
    0.5 * ring.windows(2).map(|pair| (pair[0][0] - x) * (pair[1][1] - y) - (pair[0][1] - y) * (pair[1][0] - x)).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(side: f64, edges: usize) -> Vec<[f64; 2]> {
        let corners = [[0.0, 0.0], [side, 0.0], [side, side], [0.0, side], [0.0, 0.0]];
        let edge = |pair: &[[f64; 2]]| {
            let (a, b) = (pair[0], pair[1]);
            (0..edges).map(move |at| [0, 1].map(|axis| a[axis] + (b[axis] - a[axis]) * at as f64 / edges as f64))
        };
        corners.windows(2).flat_map(edge).collect()
    }

    #[test]
    fn a_square_with_a_hole_is_divided_and_a_bow_tie_refused() {
        let hole = vec![[1.0, 1.0], [1.0, 2.0], [2.0, 2.0], [2.0, 1.0]];
        // A polygon of n corners with h holes has n + 2h − 2 triangles.
        assert_eq!(triangles(&[square(4.0, 4), hole]).unwrap().triangles.len(), 20);
        assert_eq!(triangles(&[vec![[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]]), None);
        // Where a hole touches a corner of the outer ring, all is one polygon of seven corners; a slit from there to a hole changes nothing but the order.
        let touching = vec![[0.0, 0.0], [1.0, 2.0], [2.0, 1.0]];
        assert_eq!(triangles(&[square(4.0, 1), touching]).unwrap().triangles.len(), 5);
        let [a, b, c, d] = [[1.0, 1.0], [1.0, 2.0], [2.0, 2.0], [2.0, 1.0]];
        let slit = vec![[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0], [0.0, 0.0], a, b, c, d, a];
        assert_eq!(triangles(&[slit]).unwrap().triangles.len(), 8);
        // The hole is outside.
        let far = vec![[5.0, 5.0], [5.0, 6.0], [6.0, 6.0]];
        assert_eq!(triangles(&[square(4.0, 1), far]), None);
    }
}
