//! Boundary loops, in the direction in which a patch traverses them.
//!
//! A boundary edge is used by one triangle; its patch uses it the other way round. Where several holes meet in a vertex, the way
//! goes on to the fan that lies across the hole, so that filling joins all fans into one. A way that comes back to a vertex is
//! cut there into simple loops. A hole that reaches an edge where other surface meets goes on along that edge.

use std::collections::HashMap;

use crate::geometry::distance;
use crate::geometry::exact::Point;
use crate::submesh::edges::{Edge, Edges, Use};
use crate::submesh::{Submesh, Vertex};

/// A simple boundary loop.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Loop {
    /// Vertices in the patch's direction, from the smallest.
    pub(crate) vertices: Vec<Vertex>,
    /// For each edge from a vertex to the next, the triangle on its other side.
    pub(crate) triangles: Vec<u32>,
    /// Part of it runs along non-manifold edges, which lack a triangle.
    pub(crate) branches: bool,
    /// The way that it was cut from: loops of one way meet in vertices.
    pub(crate) way: u32,
}

impl Loop {
    pub(crate) fn points(&self, submesh: &Submesh) -> Vec<Point> {
        self.vertices.iter().map(|v| submesh.positions[*v as usize]).collect()
    }

    /// For each edge, the third corner of the triangle on its other side.
    pub(crate) fn apexes(&self, submesh: &Submesh) -> Vec<Option<Point>> {
        let n = self.vertices.len();
        let apex = |i: usize| {
            let ends = [self.vertices[i], self.vertices[(i + 1) % n]];
            let apex = submesh.triangles[self.triangles[i] as usize].v.into_iter().find(|v| !ends.contains(v));
            apex.map(|v| submesh.positions[v as usize])
        };
        (0..n).map(apex).collect()
    }

    /// This loop with another one put in where they meet; `None` if they do not. What comes of it is in one vertex twice.
    pub(crate) fn with(&self, other: &Loop) -> Option<Loop> {
        let at = self.vertices.iter().position(|v| other.vertices.contains(v))?;
        let from = other.vertices.iter().position(|v| *v == self.vertices[at])?;
        let put_in = |own: &[u32], others: &[u32]| {
            let turned = others[from..].iter().chain(&others[..from]);
            own[..at].iter().chain(turned).chain(&own[at..]).copied().collect()
        };
        Some(Loop {
            vertices: put_in(&self.vertices, &other.vertices),
            triangles: put_in(&self.triangles, &other.triangles),
            branches: self.branches || other.branches,
            way: self.way,
        })
    }

    pub(crate) fn perimeter(&self, submesh: &Submesh) -> f64 {
        let n = self.vertices.len();
        (0..n).map(|i| submesh.distance(self.vertices[i], self.vertices[(i + 1) % n])).sum()
    }
}

/// An edge that lacks a triangle, in the direction in which a patch would run through it.
#[derive(Clone, Copy)]
struct Rim {
    from: Vertex,
    to: Vertex,
    /// The triangle on its other side.
    triangle: u32,
    /// It has other triangles too, which are each other's neighbours.
    branches: bool,
}

/// The boundary of a submesh.
#[derive(Debug, Default)]
pub(crate) struct Boundary {
    /// All simple loops, by smallest vertex.
    pub(crate) loops: Vec<Loop>,
    /// The boundary edges that are in none, in runs, by first vertex: ways that end where the triangles around a vertex do not agree.
    pub(crate) chains: Vec<Vec<Vertex>>,
}

/// All boundary loops, by smallest vertex. O(n log n) in the boundary and the non-manifold edges.
pub(crate) fn find(submesh: &Submesh, edges: &Edges) -> Vec<Loop> {
    boundary(submesh, edges).loops
}

/// The boundary in loops, and what is in none. A boundary that runs into a non-manifold edge goes on along it, if that lacks a triangle
/// too: where the triangles around agree on their directions, the edges that lack one are a cycle (the boundary of a boundary is
/// nothing), and so every way closes. O(n log n) in the boundary and the non-manifold edges.
pub(crate) fn boundary(submesh: &Submesh, edges: &Edges) -> Boundary {
    let mut rims: Vec<Rim> = edges.iter().filter_map(|e| lacking(submesh, &e)).collect();
    rims.sort_unstable_by_key(|r| (r.from, r.to));
    let next = link(submesh, edges, &rims);
    let mut seen = vec![false; rims.len()];
    let mut boundary = Boundary::default();
    // A way that does not close is walked from its first edge.
    let mut is_first = vec![true; rims.len()];
    next.iter().filter(|n| **n != crate::util::ids::NONE).for_each(|n| is_first[*n as usize] = false);
    let firsts = (0..rims.len()).filter(|r| is_first[*r]);
    for start in firsts.chain(0..rims.len()) {
        let mut way: Vec<usize> = Vec::new();
        let mut at = start as u32;
        while at != crate::util::ids::NONE && !seen[at as usize] {
            seen[at as usize] = true;
            way.push(at as usize);
            at = next[at as usize];
        }
        cut_into_loops(&rims, start as u32, &way, &mut boundary);
    }
    boundary.loops.sort_by(|a, b| a.vertices.cmp(&b.vertices));
    boundary.chains.sort();
    boundary
}

/// An edge as the rim of a patch, if it lacks one triangle: a boundary edge, or a non-manifold one used once more in one direction than
/// in the other.
fn lacking(submesh: &Submesh, edge: &Edge<'_>) -> Option<Rim> {
    let used = match edge.uses {
        [used] => *used,
        uses if uses.len() % 2 == 1 => unpaired(submesh, edge)?,
        _ => return None,
    };
    let (to, from) = edge.directed(&used);
    Some(Rim { from, to, triangle: used.triangle(), branches: edge.uses.len() > 1 })
}

/// The triangle of a non-manifold edge that is left when the others are paired around it, each with the one that faces its back: two such
/// bound the same piece of a solid. `None` if more than one is left, or the edge has no length.
fn unpaired(submesh: &Submesh, edge: &Edge<'_>) -> Option<Use> {
    let axis = (submesh.place(edge.high) - submesh.place(edge.low)).normalize_or_zero();
    let u = axis.any_orthonormal_vector();
    let w = axis.cross(u);
    let mut around: Vec<(f64, Use)> = edge
        .uses
        .iter()
        .map(|used| {
            let ends = [edge.low, edge.high];
            let apex = submesh.triangles[used.triangle() as usize].v.into_iter().find(|v| !ends.contains(v)).unwrap_or(edge.low);
            let out = submesh.place(apex) - submesh.place(edge.low);
            (diamond_angle(out.dot(u), out.dot(w)), *used)
        })
        .collect();
    around.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.triangle().cmp(&b.1.triangle())));
    // Seen along the edge, a triangle that runs through it forward has the solid before it, in the order of angles; the other kind behind.
    // Twice around, so that a pair across the start is found.
    let n = around.len();
    let mut paired = vec![false; n];
    let mut waiting: Vec<usize> = Vec::new();
    for i in (0..2 * n).map(|i| i % n) {
        if paired[i] {
            continue;
        }
        if !around[i].1.forward() {
            if !waiting.contains(&i) {
                waiting.push(i);
            }
        } else if let Some(other) = waiting.pop() {
            (paired[i], paired[other]) = (true, true);
        }
    }
    let mut left = (0..n).filter(|i| !paired[*i]);
    left.next().filter(|_| left.next().is_none()).map(|i| around[i].1)
}

/// Grows with the angle of a direction, from 0 to 4 in one turn.
fn diamond_angle(x: f64, y: f64) -> f64 {
    let size = x.abs() + y.abs();
    if size == 0.0 {
        return 0.0;
    }
    let (x, y) = (x / size, y / size);
    match (x >= 0.0, y >= 0.0) {
        (true, true) => y,
        (false, true) => 1.0 - x,
        (false, false) => 2.0 - y,
        (true, false) => 3.0 + x,
    }
}

/// The edge after each edge. Boundary edges go on among themselves where as many run into a vertex as out of it.
fn link(submesh: &Submesh, edges: &Edges, rims: &[Rim]) -> Vec<u32> {
    let mut next = vec![crate::util::ids::NONE; rims.len()];
    let mut incoming: Vec<u32> = (0..rims.len() as u32).collect();
    incoming.sort_unstable_by_key(|r| (rims[*r as usize].to, *r));
    for group in incoming.chunk_by(|a, b| rims[*a as usize].to == rims[*b as usize].to) {
        let v = rims[group[0] as usize].to;
        let from = rims.partition_point(|r| r.from < v);
        let outgoing: Vec<u32> = (from..rims.len()).take_while(|r| rims[*r].from == v).map(|r| r as u32).collect();
        if let ([i], [o]) = (group, outgoing.as_slice()) {
            next[*i as usize] = *o;
            continue;
        }
        let part = |all: &[u32]| all.iter().copied().partition(|r| !rims[*r as usize].branches);
        let (into, into_branches): (Vec<u32>, Vec<u32>) = part(group);
        let (out, out_branches): (Vec<u32>, Vec<u32>) = part(&outgoing);
        let mut pair = |incoming: &[u32], outgoing: &[u32]| {
            for (i, o) in across(submesh, edges, rims, v, incoming, outgoing) {
                next[i as usize] = o;
            }
        };
        if into.len() == out.len() {
            pair(&into, &out);
            pair(&into_branches, &out_branches);
        } else {
            pair(group, &outgoing);
        }
    }
    next
}

/// Where more fans than this meet, their edges are paired as they come: comparing all with all would take quadratic time, and no order
/// makes surface of such a vertex.
const MAX_FANS: usize = 64;

/// Pairs the edges into and out of a vertex where several fans meet: each way in goes out along another fan, the one at the
/// smallest angle first; along its own fan only if nothing else is left.
fn across(submesh: &Submesh, edges: &Edges, rims: &[Rim], v: Vertex, incoming: &[u32], outgoing: &[u32]) -> Vec<(u32, u32)> {
    if incoming.len() > MAX_FANS {
        return incoming.iter().copied().zip(outgoing.iter().copied()).collect();
    }
    let fans = fans(submesh, edges, v);
    let fan = |rim: u32| fans.iter().find(|(t, _)| *t == rims[rim as usize].triangle).map_or(crate::util::ids::NONE, |(_, f)| *f);
    let mut pairs: Vec<(bool, f64, u32, u32)> = Vec::new();
    for i in incoming {
        for o in outgoing {
            let cosine = distance::cosine(submesh.vector(v, rims[*i as usize].from), submesh.vector(v, rims[*o as usize].to));
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
fn fans(submesh: &Submesh, edges: &Edges, v: Vertex) -> Vec<(u32, u32)> {
    let mut star: Vec<u32> = submesh.star(v).map(|(t, _)| t).collect();
    star.sort_unstable();
    let number = |t: u32| star.binary_search(&t).unwrap_or(0) as u32;
    let mut parents: Vec<u32> = (0..star.len() as u32).collect();
    for t in &star {
        for w in submesh.triangles[*t as usize].v.into_iter().filter(|w| *w != v) {
            if let Some([a, b]) = edges.between(v, w).map(|e| e.uses) {
                crate::util::union_find::unite(&mut parents, number(a.triangle()), number(b.triangle()));
            }
        }
    }
    (0..star.len() as u32).map(|i| (star[i as usize], star[crate::util::union_find::find(&mut parents, i) as usize])).collect()
}

/// Cuts a way of consecutive edges wherever it comes back to a vertex. What does not close is chains. Of non-manifold edges alone nothing
/// is made: nothing is missing there that a patch could restore.
fn cut_into_loops(rims: &[Rim], number: u32, way: &[usize], boundary: &mut Boundary) {
    let mut open: Vec<Rim> = Vec::new();
    let mut place: HashMap<Vertex, usize> = HashMap::new();
    for rim in way.iter().map(|r| rims[*r]) {
        place.insert(rim.from, open.len());
        open.push(rim);
        if let Some(start) = place.get(&rim.to).copied() {
            let closed: Vec<Rim> = open.drain(start..).collect();
            closed.iter().for_each(|r| {
                place.remove(&r.from);
            });
            if closed.iter().any(|r| !r.branches) {
                boundary.loops.push(from_smallest(&closed, number));
            }
        }
    }
    for chain in open.chunk_by(|a, b| !a.branches && !b.branches).filter(|chain| !chain[0].branches) {
        let last = chain.last().map(|r| r.to);
        boundary.chains.push(chain.iter().map(|r| r.from).chain(last).collect());
    }
}

fn from_smallest(rims: &[Rim], way: u32) -> Loop {
    let first = (0..rims.len()).min_by_key(|i| rims[*i].from).unwrap_or(0);
    let turned: Vec<Rim> = rims[first..].iter().chain(&rims[..first]).copied().collect();
    Loop {
        vertices: turned.iter().map(|r| r.from).collect(),
        triangles: turned.iter().map(|r| r.triangle).collect(),
        branches: turned.iter().any(|r| r.branches),
        way,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Corners, cube, diagnose, plate, records, reversed, shifted};

    /// Two square holes that meet in the middle of the plate.
    fn pinched() -> Vec<Corners> {
        plate(4, |x, y| !(x == y && (1..3).contains(&x)))
    }

    #[test]
    fn two_holes_that_meet_in_a_vertex_are_two_loops() {
        let records = records(&pinched());
        let d = diagnose(&records);
        let mut edges: Vec<usize> = find(&d.submesh, &Edges::of(&d.submesh)).iter().map(|l| l.vertices.len()).collect();
        edges.sort_unstable();
        assert_eq!(edges, [4, 4, 16], "and the rim of the plate");
    }

    #[test]
    fn a_loop_runs_against_the_triangles_beyond_it() {
        let records = records(&pinched());
        let d = diagnose(&records);
        for rim in find(&d.submesh, &Edges::of(&d.submesh)) {
            let n = rim.vertices.len();
            for i in 0..n {
                let (from, to) = (rim.vertices[i], rim.vertices[(i + 1) % n]);
                let v = d.submesh.triangles[rim.triangles[i] as usize].v;
                assert!((0..3).any(|k| (v[k], v[(k + 1) % 3]) == (to, from)));
            }
        }
    }

    /// Two cubes that touch along an edge, one of them without a side there.
    fn open_at_a_shared_edge() -> Vec<Corners> {
        let open = cube().into_iter().filter(|t| !t.iter().all(|p| p[0] == 1.0));
        open.chain(shifted(&cube(), [1.0, 1.0, 0.0])).collect()
    }

    #[test]
    fn a_hole_goes_on_along_an_edge_where_another_body_touches() {
        let records = records(&open_at_a_shared_edge());
        let d = diagnose(&records);
        let Boundary { loops, chains } = boundary(&d.submesh, &Edges::of(&d.submesh));
        assert_eq!((loops.len(), loops[0].vertices.len(), loops[0].branches, chains.len()), (1, 4, true, 0));
        // The triangle beyond the shared edge is the open cube's, not one of the two that close the other.
        let other = |t: &u32| d.submesh.points(*t).iter().all(|p| p[0] >= 1.0 && p[1] >= 1.0);
        assert!(!loops[0].triangles.iter().any(other));
    }

    #[test]
    fn what_is_in_no_loop_is_in_a_chain() {
        let mut holed = plate(3, |x, y| (x, y) != (1, 1));
        let beside = holed.iter().position(|t| t.iter().filter(|p| (1.0..=2.0).contains(&p[0]) && p[1] == 1.0).count() == 2);
        let beside = beside.unwrap();
        holed[beside] = reversed(&holed[beside..=beside])[0];
        let records = records(&holed);
        let d = diagnose(&records);
        let edges = Edges::of(&d.submesh);
        let Boundary { loops, chains } = boundary(&d.submesh, &edges);
        let in_loops: usize = loops.iter().map(|l| l.vertices.len()).sum();
        let in_chains: usize = chains.iter().map(|c| c.len() - 1).sum();
        assert!(in_chains > 0, "{loops:?}");
        assert_eq!(in_loops + in_chains, edges.iter().filter(|e| e.is_boundary()).count());
    }
}
