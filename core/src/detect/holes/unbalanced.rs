//! Loops over edges whose two directions are used unequally, as where three surfaces meet in an edge.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap, HashMap, HashSet};

use crate::detect::holes::loops::Loop;
use crate::submesh::edges::{Edge, Edges};
use crate::submesh::{Submesh, Vertex};

/// Vertices looked at, at most, to find the shortest ways back of [`unbalanced`]; from there on any way will do.
const MOST_LOOKED_AT: usize = 1 << 22;

/// Simple loops that cover every edge whose two directions are used unequally, except the edges of `apart_from`. A loop runs in the direction that
/// is used less often, so filling all loops balances all edges. Each loop closes by the shortest way, so that patches are small.
/// O(n log n) in the boundary and non-manifold edges for each loop, up to [`MOST_LOOKED_AT`] vertices for all loops together.
pub(crate) fn unbalanced<'l>(submesh: &Submesh, edges: &Edges, apart_from: impl Iterator<Item = &'l Loop>) -> Vec<Vec<Vertex>> {
    let mut ways: BTreeMap<Vertex, Vec<Vertex>> = BTreeMap::new();
    for edge in edges.iter().filter(Edge::is_unbalanced) {
        let forward = edge.uses.iter().filter(|used| used.forward()).count();
        let backward = edge.uses.len() - forward;
        let (from, to) = if forward > backward { (edge.high, edge.low) } else { (edge.low, edge.high) };
        ways.entry(from).or_default().extend(std::iter::repeat_n(to, forward.abs_diff(backward)));
    }
    let mut ways = Ways(ways);
    for rim in apart_from {
        ways.remove(&rim.vertices);
    }
    let mut loops = Vec::new();
    let mut looked_at = 0;
    let starts: Vec<Vertex> = ways.0.keys().copied().collect();
    for start in starts {
        while looked_at < MOST_LOOKED_AT {
            let Some(next) = ways.0.get(&start).and_then(|ends| ends.last().copied()) else { break };
            if let Some(found) = ways.shortest(submesh, next, start, &mut looked_at) {
                ways.remove(&found);
                loops.push(found);
            } else {
                ways.0.get_mut(&start).and_then(Vec::pop);
            }
        }
        ways.walk(start, &mut loops);
    }
    loops
}

/// Directed edges by where they begin, each as often as it lacks a triangle.
struct Ways(BTreeMap<Vertex, Vec<Vertex>>);

impl Ways {
    /// Takes the edges of a loop out, as far as they are there.
    fn remove(&mut self, loop_: &[Vertex]) {
        let n = loop_.len();
        for [a, b] in (0..n).map(|i| [loop_[i], loop_[(i + 1) % n]]) {
            if let Some(ends) = self.0.get_mut(&a)
                && let Some(place) = ends.iter().position(|end| *end == b)
            {
                ends.remove(place);
            }
        }
    }

    /// The shortest way, from a vertex to another one, of those of equal length that through lower vertices (Dijkstra 1959).
    fn shortest(&self, submesh: &Submesh, from: Vertex, to: Vertex, looked_at: &mut usize) -> Option<Vec<Vertex>> {
        let mut before: HashMap<Vertex, (f64, Vertex)> = HashMap::from([(from, (0.0, from))]);
        let mut done: HashSet<Vertex> = HashSet::new();
        // Lengths are not negative, so that their bits are in order.
        let mut next = BinaryHeap::from([Reverse((0u64, from))]);
        while let Some(Reverse((length, at))) = next.pop() {
            if at == to {
                let mut way = vec![to];
                while let Some(last) = way.last().copied().filter(|last| *last != from) {
                    way.push(before.get(&last)?.1);
                }
                way.reverse();
                return Some(way);
            }
            if !done.insert(at) {
                continue;
            }
            *looked_at += 1;
            for end in self.0.get(&at).into_iter().flatten() {
                let further = f64::from_bits(length) + submesh.distance(at, *end);
                if before
                    .get(end)
                    .is_none_or(|(known, by)| further < *known || further == *known && at < *by && !done.contains(end))
                {
                    before.insert(*end, (further, at));
                    next.push(Reverse((further.to_bits(), *end)));
                }
            }
        }
        None
    }

    /// Loops of whatever ways go on from a vertex, which are taken out.
    fn walk(&mut self, start: Vertex, loops: &mut Vec<Vec<Vertex>>) {
        let (mut way, mut places) = (vec![start], HashMap::from([(start, 0)]));
        while let Some(next) = way.last().and_then(|at| self.0.get_mut(at)?.pop()) {
            if let Some(place) = places.get(&next).copied() {
                loops.push(way[place..].to_vec());
                way.drain(place + 1..).for_each(|v| {
                    places.remove(&v);
                });
            } else {
                places.insert(next, way.len());
                way.push(next);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::holes::loops::find;
    use crate::testing::{Corners, cube, diagnose, records, shifted};

    #[test]
    fn what_three_surfaces_leave_unbalanced_is_a_loop_in_the_direction_that_lacks() {
        // A square across a cube, half way up: its rim lies on edges of the walls.
        let lower = cube().into_iter().filter(|t| !t.iter().all(|p| p[2] == 1.0));
        let upper = shifted(&cube(), [0.0, 0.0, 1.0]).into_iter().filter(|t| !t.iter().all(|p| p[2] == 1.0));
        let across: Vec<Corners> = cube().into_iter().filter(|t| t.iter().all(|p| p[2] == 1.0)).collect();
        let mesh: Vec<Corners> = lower.chain(upper).chain(across.clone()).collect();
        let records = records(&mesh);
        let d = diagnose(&records);
        let edges = Edges::of(&d.submesh);
        assert!(find(&d.submesh, &edges).is_empty(), "nothing is missing");
        let loops = unbalanced(&d.submesh, &edges, std::iter::empty());
        let [rim] = &loops[..] else { panic!("{loops:?}") };
        assert_eq!(rim.len(), 4);
        // The square's own triangles run the other way.
        let runs = |t: &Corners, from: Vertex, to: Vertex| {
            let p = |v: Vertex| d.submesh.positions[v as usize];
            (0..3).any(|k| (t[k], t[(k + 1) % 3]) == (p(to), p(from)))
        };
        assert!((0..4).all(|i| across.iter().any(|t| runs(t, rim[i], rim[(i + 1) % 4]))));
        // A loop that is to stay open is left out.
        let open = records_of_open_cube();
        let d = diagnose(&open);
        let edges = Edges::of(&d.submesh);
        let rims = find(&d.submesh, &edges);
        assert_eq!(
            (
                rims.len(),
                unbalanced(&d.submesh, &edges, rims.iter()).len(),
                unbalanced(&d.submesh, &edges, std::iter::empty()).len()
            ),
            (1, 0, 1)
        );
    }

    fn records_of_open_cube() -> Vec<crate::io::record::Record> {
        records(&cube().into_iter().filter(|t| !t.iter().all(|p| p[2] == 1.0)).collect::<Vec<_>>())
    }
}
