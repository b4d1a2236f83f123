//! Vertices in crowds, so that the neighbourhood of many at one place is looked at once.
//!
//! The corners of a fan that an exporter moved apart lie at one place, and each has all of the fan's edges around it: held one by one against
//! their neighbourhood, n of them take n² steps.

use super::{Submesh, Vertex};
use crate::geometry::distance::{place, share_along};
use crate::geometry::sums::Bounds;
use crate::util::each::Each;
use crate::util::radix::sort_by_number;
use crate::util::scatter::Hashing;
use crate::util::{parallel, steps};
use std::hash::BuildHasher;

/// Less than rounding adds to a length.
const ROUNDING: f64 = 1e-6;

/// A vertex of a crowd and how far it reaches.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Member {
    pub(crate) vertex: Vertex,
    pub(crate) reach: f64,
}

/// Vertices that are all within the reach of each other; often only one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Crowd {
    /// The place of its first member among all.
    pub(crate) first: u32,
    pub(crate) count: u32,
    /// Of its vertices.
    pub(crate) bounds: Bounds,
    /// The shortest and the longest reach of a member.
    pub(crate) least: f64,
    pub(crate) most: f64,
}

/// Vertices by their crowds.
pub(crate) struct Crowds {
    members: Vec<Member>,
    pub(crate) all: Vec<Crowd>,
}

impl Crowds {
    /// A crowd is within a cell of a grid that is so fine that no two of its points are out of reach. Members stay in the order of the vertices. O(n log n).
    pub(crate) fn of(submesh: &Submesh, vertices: &[Vertex], reach: impl Fn(Vertex) -> f64 + Sync, threads: usize) -> Self {
        let mut by_cell = parallel::gather(threads, vertices, |_, (_, vertex), all| {
            let member = Member { vertex, reach: reach(vertex) };
            let cell = Cell::of(submesh.positions[vertex as usize], member.reach);
            all.push((Hashing::default().hash_one(cell) as u32, cell, member));
        });
        sort_by_number(&mut by_cell, |(hash, ..)| *hash);
        // Cells of one hash apart from each other.
        by_cell
            .chunk_by_mut(|a, b| a.0 == b.0)
            .filter(|same| same.len() > 1)
            .for_each(|same| same.sort_by_key(|(_, cell, _)| *cell));
        let mut crowds = Self { members: by_cell.iter().map(|(.., member)| *member).collect(), all: Vec::new() };
        let mut first = 0;
        for together in by_cell.chunk_by(|a, b| a.1 == b.1) {
            crowds.add(submesh, first, together.len());
            first += together.len();
        }
        // In the order of the vertices again, not in that of the hashes: what one crowd has around it the next one meets in the cache.
        let Self { members, all } = &mut crowds;
        sort_by_number(all, |crowd| members[crowd.first as usize].vertex);
        crowds
    }

    /// Makes one crowd of some members, or one of each if they are not within reach of each other after all.
    fn add(&mut self, submesh: &Submesh, first: usize, count: usize) {
        let mut crowd =
            Crowd { first: first as u32, count: count as u32, bounds: Bounds::EMPTY, least: f64::INFINITY, most: 0.0 };
        for Member { vertex, reach } in &self.members[first..first + count] {
            crowd.bounds.include(&[submesh.positions[*vertex as usize]]);
            crowd.least = crowd.least.min(*reach);
            crowd.most = crowd.most.max(*reach);
        }
        if count > 1 && crowd.bounds.diagonal() * (1.0 + ROUNDING) > crowd.least {
            (first..first + count).for_each(|one| self.add(submesh, one, 1));
        } else {
            self.all.push(crowd);
        }
    }

    /// The members of a crowd.
    pub(crate) fn members(&self, crowd: &Crowd) -> &[Member] {
        &self.members[crowd.first as usize..(crowd.first + crowd.count) as usize]
    }

    /// A vertex of each of two crowds, smaller number first, that are within the reach of both. O(pairs), if there is none.
    pub(crate) fn pair_of(&self, submesh: &Submesh, one: &Crowd, other: &Crowd) -> Option<(Vertex, Vertex)> {
        self.members(one).iter().find_map(|a| {
            let near = |b: &&Member| {
                steps::count(1);
                submesh.distance(a.vertex, b.vertex) <= a.reach.min(b.reach)
            };
            let b = self.members(other).iter().find(near)?;
            Some((a.vertex.min(b.vertex), a.vertex.max(b.vertex)))
        })
    }
}

impl Crowd {
    /// May a member lie within its reach of the inside of this edge, and farther from its ends?
    pub(crate) fn may_have_one_on(&self, ends: [[f32; 3]; 2]) -> bool {
        let [a, b] = ends.map(place);
        let (lo, hi) = (place(self.bounds.lo), place(self.bounds.hi));
        let (middle, radius) = ((lo + hi) / 2.0, (hi - lo).length() / 2.0);
        let length = (b - a).length();
        let at = (middle - a).dot(b - a) / length;
        let is_off_the_ends = (at + radius).min(length - at + radius) > self.least * (1.0 - ROUNDING);
        let away = (middle - a - (b - a) * share_along(middle, a, b)).length();
        is_off_the_ends && away - radius <= self.most * (1.0 + ROUNDING)
    }
}

/// A cell of a grid for some reach.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
struct Cell {
    /// Of its size: a power of two.
    exponent: i32,
    at: [i64; 3],
}

impl Cell {
    /// Of the largest size that no two points in one cell are farther from each other than this.
    fn of(position: [f32; 3], reach: f64) -> Self {
        let exponent = (reach / 3f64.sqrt()).log2().floor();
        Self { exponent: exponent as i32, at: position.each(|x| (f64::from(x) * (-exponent).exp2()).floor() as i64) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::submesh::edges::Edges;
    use crate::submesh::near::{Tolerance, close_pairs, on_edges};
    use crate::testing::{Corners, diagnose, records};
    use crate::util::steps;
    use crate::util::union_find;
    use proptest::prelude::*;

    /// Triangles with a corner each near a place, all apart, as a fan's are whose corners were moved.
    fn moved_fan(n: u16) -> Vec<Corners> {
        let at = |i: u16| {
            let angle = f32::from(i) / f32::from(n) * std::f32::consts::TAU;
            [10.0 * angle.cos(), 10.0 * angle.sin(), 0.0]
        };
        (0..n).map(|i| [[1e-4 * (f32::from(i) * 2.0).sin(), 1e-4 * f32::from(i).cos(), 5.0], at(2 * i), at(2 * i + 1)]).collect()
    }

    #[test]
    fn what_many_vertices_at_one_place_are_near_to_takes_no_square_of_their_number() {
        let at = |n: usize| {
            let records = records(&moved_fan(n as u16));
            let d = diagnose(&records);
            let edges = Edges::of(&d.submesh);
            let tolerance = Tolerance { weld: 0.01, edge_share: 0.25 };
            let (steps, pairs) = steps::of(|| close_pairs(&d.submesh, &edges, &tolerance, 1));
            assert!(pairs.len() >= n - 1 && pairs.len() < n * 4, "{}", pairs.len());
            let (more, on) = steps::of(|| on_edges(&d.submesh, &edges, |v| tolerance.at(&d.submesh, v), 1));
            assert!(on.is_empty());
            steps + more
        };
        steps::assert_near_linear(400, at);
    }

    fn clouds() -> impl Strategy<Value = Vec<(Corners, u8)>> {
        // On a coarse grid with a little beside it: crowds of all sizes, near and far.
        let one = (0u8..3, 0u8..3, prop::array::uniform3(-1f32..1.0), 0u8..4, 1u8..20);
        prop::collection::vec(one, 2..60).prop_map(|all| {
            let corner = |x: u8, y: u8, [dx, dy, dz]: [f32; 3]| [f32::from(x) + dx * 0.2, f32::from(y) + dy * 0.2, dz * 0.2];
            let triangle = |(x, y, by, reach, size)| {
                let p: [f32; 3] = corner(x, y, by);
                let s = f32::from(size) * 0.3;
                ([p, [p[0] + s, p[1], p[2] + 3.0], [p[0], p[1] + s, p[2] + 3.0]], reach)
            };
            all.into_iter().map(triangle).collect()
        })
    }

    proptest! {
        #[test]
        fn crowds_connect_what_pairs_connect_and_find_the_edges_that_each_vertex_finds(cloud in clouds()) {
            let triangles: Vec<Corners> = cloud.iter().map(|(t, _)| *t).collect();
            let records = records(&triangles);
            let d = diagnose(&records);
            let (submesh, edges) = (&d.submesh, Edges::of(&d.submesh));
            let tolerance = Tolerance { weld: 0.3, edge_share: 0.25 };
            let vertices = crate::submesh::near::boundary_vertices(&edges);
            let roots = |pairs: &[(Vertex, Vertex)]| {
                let mut parents: Vec<u32> = (0..submesh.positions.len() as u32).collect();
                pairs.iter().for_each(|(a, b)| { union_find::unite(&mut parents, *a, *b); });
                (0..parents.len() as u32).map(|v| union_find::find(&mut parents, v)).collect::<Vec<_>>()
            };
            let reach = |v: Vertex| tolerance.at(submesh, v);
            let near = |a: Vertex, b: Vertex| submesh.distance(a, b) <= reach(a).min(reach(b));
            let all = |v: &Vertex| vertices.iter().filter(|w| *w > v).map(|w| (*v, *w)).collect::<Vec<_>>();
            let every: Vec<(Vertex, Vertex)> = vertices.iter().flat_map(all).filter(|(a, b)| near(*a, *b)).collect();
            let found = close_pairs(submesh, &edges, &tolerance, 2);
            prop_assert!(found.iter().all(|pair| every.contains(pair)));
            prop_assert_eq!(roots(&found), roots(&every));

            let one_by_one = |v: Vertex| {
                let of = |i: &u32| edges.get(*i as usize).is_boundary();
                let boundary: Vec<u32> = (0..edges.len() as u32).filter(of).collect();
                crate::submesh::near::nearest_of(submesh, &edges, &boundary, v, reach(v))
            };
            let mut want: Vec<_> = vertices.iter().filter_map(|v| one_by_one(*v)).collect();
            want.sort_by(|a, b| a.edge.cmp(&b.edge).then(a.at.total_cmp(&b.at)).then(a.vertex.cmp(&b.vertex)));
            prop_assert_eq!(on_edges(submesh, &edges, reach, 2), want);
        }
    }
}
