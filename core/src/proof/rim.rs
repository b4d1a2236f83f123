//! The rim of a surface is mapped onto edges of the other one, so that it runs inside of no face.
//!
//! An edge is of the rim if triangles do not run along it as often one way as the other.

use crate::geometry::distance::{place, share_along};
use crate::proof::chain::Pair;
use crate::proof::pairing::Pairing;
use crate::proof::surface::{Spot, Surface, WALK};

/// Steps along a rim from one end of an edge to the other, at most.
const MOST: usize = 64;

/// The edges of the rim of a mesh.
pub(super) struct Rims {
    /// Has a vertex one?
    is_on: Vec<bool>,
    /// The smaller vertex first, in order.
    edges: Vec<[u32; 2]>,
}

impl Rims {
    /// Of the first mesh; `open` are all vertices whose triangles form no closed fan, so that only edges between two of them are looked at. O(n).
    pub(super) fn new(pairing: &Pairing<'_>) -> Self {
        let mut is_on = vec![false; pairing.points.len()];
        pairing.open.iter().for_each(|v| is_on[*v as usize] = true);
        let mut ways: Vec<([u32; 2], i32)> = Vec::new();
        if !pairing.open.is_empty() {
            for [a, b, c] in pairing.faces {
                let sides = [[*a, *b], [*b, *c], [*c, *a]].into_iter();
                let of_open = sides.filter(|ends| ends.iter().all(|v| is_on[*v as usize]));
                ways.extend(of_open.map(|[v, w]| if v < w { ([v, w], 1) } else { ([w, v], -1) }));
            }
        }
        ways.sort_unstable();
        let same = ways.chunk_by(|a, b| a.0 == b.0);
        let edges: Vec<[u32; 2]> =
            same.filter(|all| all.iter().map(|way| way.1).sum::<i32>() != 0).filter_map(|all| Some(all.first()?.0)).collect();
        is_on.fill(false);
        edges.as_flattened().iter().for_each(|v| is_on[*v as usize] = true);
        Self { is_on, edges }
    }

    /// The vertices that have one.
    pub(super) fn vertices(&self) -> impl Iterator<Item = usize> + '_ {
        self.is_on.iter().enumerate().filter(|(_, is_on)| **is_on).map(|(v, _)| v)
    }

    /// Is the edge between two vertices one?
    #[inline]
    pub(super) fn has(&self, v: u32, w: u32) -> bool {
        self.is_on[v as usize] && self.is_on[w as usize] && self.edges.binary_search(&[v.min(w), v.max(w)]).is_ok()
    }
}

/// The spot for a vertex of the rim: the nearest one on the rim around what it became, and from there on along it. None where there is no rim.
pub(super) fn image(surface: &Surface<'_>, pairing: &Pairing<'_>, v: usize) -> Option<(Spot, f64)> {
    let mut at = *pairing.became.get(v)?;
    let p = place(pairing.points[v]);
    let start = surface.at_vertex(at)?;
    let mut best = (start, p.distance(surface.position(&start)));
    let mut is_rim = best.1 == 0.0;
    for _ in 0..WALK {
        let mut next = None;
        for (face, k, other) in edges_at(surface, at) {
            is_rim = true;
            let corners = surface.corners(face);
            let t = share_along(p, corners[k], corners[(k + 1) % 3]);
            let mut shares = [0.0; 3];
            (shares[k], shares[(k + 1) % 3]) = (1.0 - t, t);
            let spot = Spot { face, shares };
            let distance = p.distance(surface.position(&spot));
            if distance < best.1 {
                (best, next) = ((spot, distance), Some(other));
            }
        }
        match next.filter(|_| best.0.shares.contains(&1.0)) {
            Some(other) => at = other,
            None => break,
        }
    }
    is_rim.then_some(best)
}

/// The edges of the rim at a vertex: a face, the corner from which the edge begins in it, and the vertex at the other end.
fn edges_at<'s>(surface: &'s Surface<'_>, v: u32) -> impl Iterator<Item = (u32, usize, u32)> + 's {
    let around = surface.around(v);
    let ways = move |v: u32, w: u32| {
        let runs =
            |f: &&u32| (0..3).any(|k| surface.faces[**f as usize][k] == v && surface.faces[**f as usize][(k + 1) % 3] == w);
        around.iter().filter(runs).count()
    };
    let sides = around.iter().flat_map(move |f| {
        let face = surface.faces[*f as usize];
        (0..3).filter(move |k| face[*k] == v || face[(*k + 1) % 3] == v).map(move |k| {
            let other = if face[k] == v { face[(k + 1) % 3] } else { face[k] };
            (*f, k, other)
        })
    });
    sides.filter(move |(_, _, other)| ways(v, *other) != ways(*other, v))
}

/// Do two spots lie on one edge?
pub(super) fn on_edge(surface: &Surface<'_>, spots: &[Spot; 2]) -> bool {
    let Some(face) = surface.common(spots.each_ref()) else { return false };
    let [Some(a), Some(b)] = [surface.within(&spots[0], face), surface.within(&spots[1], face)] else { return false };
    (0..3).any(|k| a[k] == 0.0 && b[k] == 0.0)
}

/// Appends what is between the ends of an edge along the rim; false if there is no way.
pub(super) fn between(surface: &Surface<'_>, [a, b]: [&Pair; 2], out: &mut Vec<Pair>) -> bool {
    if on_edge(surface, &[a.spot, b.spot]) {
        return true;
    }
    let corners = surface.faces[a.spot.face as usize].iter().zip(a.spot.shares);
    let ends: Vec<u32> = corners.filter(|(_, share)| *share > 0.0).map(|(v, _)| *v).collect();
    let first: Vec<(u32, u32)> = match ends[..] {
        [v] => edges_at(surface, v).map(|(_, _, w)| (v, w)).collect(),
        [v, w] => vec![(v, w), (w, v)],
        _ => return false,
    };
    let ways = first.into_iter().filter_map(|(from, to)| way(surface, [a, b], (from, to)));
    let farthest = |way: &Vec<Pair>| way.iter().map(|pair| pair.off).fold(0.0, f64::max);
    let Some(best) = ways.min_by(|x, y| farthest(x).total_cmp(&farthest(y))) else { return false };
    out.extend(best);
    true
}

/// The vertices from one end to the other, if one goes on from a vertex to the next one.
fn way(surface: &Surface<'_>, [a, b]: [&Pair; 2], (mut from, mut at): (u32, u32)) -> Option<Vec<Pair>> {
    let mut all = Vec::new();
    let mut behind = a.place;
    for _ in 0..MOST {
        let spot = surface.at_vertex(at)?;
        let position = surface.position(&spot);
        let t = share_along(position, behind, b.place);
        behind += (b.place - behind) * t;
        all.push(Pair { place: behind, spot, off: behind.distance(position) });
        if on_edge(surface, &[spot, b.spot]) {
            return Some(all);
        }
        let before = from;
        let mut next = edges_at(surface, at).map(|edge| edge.2).filter(|w| *w != before);
        let one = next.next()?;
        if next.any(|w| w != one) {
            return None;
        }
        (from, at) = (at, one);
    }
    None
}
