//! Boundary loops, in the direction in which a patch traverses them (METHODS A6, C1).
//!
//! A boundary edge is used by one triangle; its patch uses it the other way round. Where several holes meet in a vertex, the way
//! goes on to the fan that lies across the hole, so that filling joins all fans into one. A way that comes back to a vertex is
//! cut there into simple loops.

use crate::chunk;
use crate::fill::exact::Point;
use crate::shop::edges::Edges;
use crate::shop::{self, Shop, Vertex};

/// A simple boundary loop.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Loop {
    /// Vertices in the patch's direction, from the smallest.
    pub(crate) vertices: Vec<Vertex>,
    /// For each edge from a vertex to the next, the triangle on its other side.
    pub(crate) triangles: Vec<u32>,
}

impl Loop {
    pub(crate) fn points(&self, shop: &Shop) -> Vec<Point> {
        self.vertices.iter().map(|v| shop.positions[*v as usize]).collect()
    }

    /// For each edge, the third corner of the triangle on its other side.
    pub(crate) fn apexes(&self, shop: &Shop) -> Vec<Option<Point>> {
        let n = self.vertices.len();
        let apex = |i: usize| {
            let ends = [self.vertices[i], self.vertices[(i + 1) % n]];
            let apex = shop.triangles[self.triangles[i] as usize].v.into_iter().find(|v| !ends.contains(v));
            apex.map(|v| shop.positions[v as usize])
        };
        (0..n).map(apex).collect()
    }

    pub(crate) fn perimeter(&self, shop: &Shop) -> f64 {
        let n = self.vertices.len();
        (0..n).map(|i| shop.distance(self.vertices[i], self.vertices[(i + 1) % n])).sum()
    }
}

/// A boundary edge in the patch's direction.
#[derive(Clone, Copy)]
struct Rim {
    from: Vertex,
    to: Vertex,
    triangle: u32,
}

/// All boundary loops, by smallest vertex. Edges whose triangles do not agree around a vertex may leave open chains: these are in no
/// loop. O(n log n) in the boundary.
pub(crate) fn find(shop: &Shop, edges: &Edges) -> Vec<Loop> {
    let mut rims: Vec<Rim> = edges
        .iter()
        .filter(|e| e.is_boundary())
        .map(|e| {
            let (to, from) = e.directed(&e.uses[0]);
            Rim { from, to, triangle: e.uses[0].triangle }
        })
        .collect();
    rims.sort_unstable_by_key(|r| (r.from, r.to));
    let next = link(shop, edges, &rims);
    let mut seen = vec![false; rims.len()];
    let mut loops = Vec::new();
    for start in 0..rims.len() {
        let mut way: Vec<usize> = Vec::new();
        let mut at = start as u32;
        while at != chunk::NONE && !seen[at as usize] {
            seen[at as usize] = true;
            way.push(at as usize);
            at = next[at as usize];
        }
        cut_into_loops(&rims, &way, &mut loops);
    }
    loops.sort_by(|a, b| a.vertices.cmp(&b.vertices));
    loops
}

/// The edge after each edge.
fn link(shop: &Shop, edges: &Edges, rims: &[Rim]) -> Vec<u32> {
    let mut next = vec![chunk::NONE; rims.len()];
    let mut incoming: Vec<u32> = (0..rims.len() as u32).collect();
    incoming.sort_unstable_by_key(|r| (rims[*r as usize].to, *r));
    for group in incoming.chunk_by(|a, b| rims[*a as usize].to == rims[*b as usize].to) {
        let v = rims[group[0] as usize].to;
        let from = rims.partition_point(|r| r.from < v);
        let outgoing: Vec<u32> = (from..rims.len()).take_while(|r| rims[*r].from == v).map(|r| r as u32).collect();
        if let ([i], [o]) = (group, outgoing.as_slice()) {
            next[*i as usize] = *o;
        } else {
            for (i, o) in across(shop, edges, rims, v, group, &outgoing) {
                next[i as usize] = o;
            }
        }
    }
    next
}

/// Where more fans than this meet, their edges are paired as they come: comparing all with all would take quadratic time, and no order
/// makes surface of such a vertex.
const MAX_FANS: usize = 64;

/// Pairs the edges into and out of a vertex where several fans meet: each way in goes out along another fan, the one at the
/// smallest angle first; along its own fan only if nothing else is left.
fn across(shop: &Shop, edges: &Edges, rims: &[Rim], v: Vertex, incoming: &[u32], outgoing: &[u32]) -> Vec<(u32, u32)> {
    if incoming.len() > MAX_FANS {
        return incoming.iter().copied().zip(outgoing.iter().copied()).collect();
    }
    let fans = fans(shop, edges, v);
    let fan = |rim: u32| fans.iter().find(|(t, _)| *t == rims[rim as usize].triangle).map_or(chunk::NONE, |(_, f)| *f);
    let mut pairs: Vec<(bool, f64, u32, u32)> = Vec::new();
    for i in incoming {
        for o in outgoing {
            let cosine = shop::cosine(shop.vector(v, rims[*i as usize].from), shop.vector(v, rims[*o as usize].to));
            pairs.push((fan(*i) == fan(*o), -cosine, *i, *o));
        }
    }
    pairs.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then((a.2, a.3).cmp(&(b.2, b.3))));
    let mut chosen: Vec<(u32, u32)> = Vec::new();
    for (_, _, i, o) in pairs {
        if chosen.iter().all(|(a, b)| *a != i && *b != o) {
            chosen.push((i, o));
        }
    }
    chosen
}

/// The triangles around `v`, each with the smallest triangle of its fan.
fn fans(shop: &Shop, edges: &Edges, v: Vertex) -> Vec<(u32, u32)> {
    let mut star: Vec<u32> = shop.star(v).map(|(t, _)| t).collect();
    star.sort_unstable();
    let number = |t: u32| star.binary_search(&t).unwrap_or(0) as u32;
    let mut parents: Vec<u32> = (0..star.len() as u32).collect();
    for t in &star {
        for w in shop.triangles[*t as usize].v.into_iter().filter(|w| *w != v) {
            if let Some([a, b]) = edges.between(v, w).map(|e| e.uses) {
                chunk::unite(&mut parents, number(a.triangle), number(b.triangle));
            }
        }
    }
    (0..star.len() as u32).map(|i| (star[i as usize], star[chunk::find(&mut parents, i) as usize])).collect()
}

/// Cuts a way of consecutive edges wherever it comes back to a vertex. What does not close is left out.
fn cut_into_loops(rims: &[Rim], way: &[usize], loops: &mut Vec<Loop>) {
    let mut open: Vec<Rim> = Vec::new();
    let mut place: std::collections::HashMap<Vertex, usize> = std::collections::HashMap::new();
    for rim in way.iter().map(|r| rims[*r]) {
        place.insert(rim.from, open.len());
        open.push(rim);
        if let Some(start) = place.get(&rim.to).copied() {
            let closed: Vec<Rim> = open.drain(start..).collect();
            closed.iter().for_each(|r| {
                place.remove(&r.from);
            });
            loops.push(from_smallest(&closed));
        }
    }
}

fn from_smallest(rims: &[Rim]) -> Loop {
    let first = (0..rims.len()).min_by_key(|i| rims[*i].from).unwrap_or(0);
    let turned: Vec<Rim> = rims[first..].iter().chain(&rims[..first]).copied().collect();
    Loop { vertices: turned.iter().map(|r| r.from).collect(), triangles: turned.iter().map(|r| r.triangle).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Corners, diagnose, plate, records};

    /// Two square holes that meet in the middle of the plate.
    fn pinched() -> Vec<Corners> {
        plate(4, |x, y| !(x == y && (1..3).contains(&x)))
    }

    #[test]
    fn two_holes_that_meet_in_a_vertex_are_two_loops() {
        let records = records(&pinched());
        let d = diagnose(&records);
        let mut edges: Vec<usize> = find(&d.shop, &Edges::of(&d.shop)).iter().map(|l| l.vertices.len()).collect();
        edges.sort_unstable();
        assert_eq!(edges, [4, 4, 16], "and the rim of the plate");
    }

    #[test]
    fn a_loop_runs_against_the_triangles_beyond_it() {
        let records = records(&pinched());
        let d = diagnose(&records);
        for rim in find(&d.shop, &Edges::of(&d.shop)) {
            let n = rim.vertices.len();
            for i in 0..n {
                let (from, to) = (rim.vertices[i], rim.vertices[(i + 1) % n]);
                let v = d.shop.triangles[rim.triangles[i] as usize].v;
                assert!((0..3).any(|k| (v[k], v[(k + 1) % 3]) == (to, from)));
            }
        }
    }
}
