//! Which matches are made, and which vertices become one by them.

use crate::repairs::stitch::sew::rims::{Match, Rims};
use crate::submesh::{Submesh, Vertex};
use crate::util::union_find;

/// Vertices to be joined.
pub(crate) struct Chosen {
    /// Sets of two or more vertices that become one.
    pub(crate) clusters: Vec<Vec<Vertex>>,
    /// By place in [`Boundary::edges`](super::rims::Boundary::edges).
    pub(crate) is_used: Vec<bool>,
    /// Width of the widest match that was taken.
    pub(crate) widest: f64,
}

/// Takes the matches in their order where they go with those before.
pub(crate) fn of(submesh: &Submesh, rims: &Rims<'_>, matches: &[Match]) -> Chosen {
    let mut taken = Taken::of(submesh, &rims.boundary.vertices);
    let mut is_used = vec![false; rims.boundary.edges.len()];
    let mut widest = 0.0f64;
    for Match { width, edges, against } in matches {
        let [i, j] = edges.map(|i| i as usize);
        let [a, b] = [&rims.boundary.edges[i], &rims.boundary.edges[j]];
        let other = if *against { [b.ends[1], b.ends[0]] } else { b.ends };
        if !is_used[i] && !is_used[j] && a.triangle != b.triangle && taken.edge(a.ends, other, &rims.reach) {
            (is_used[i], is_used[j]) = (true, true);
            widest = widest.max(*width);
        }
    }
    Chosen { clusters: taken.clusters(), is_used, widest }
}

/// Which boundary vertices are one so far.
struct Taken<'m> {
    submesh: &'m Submesh,
    /// Boundary vertices, ascending; the sets are of their places here.
    vertices: &'m [Vertex],
    parents: Vec<u32>,
    /// By root.
    members: Vec<Vec<Vertex>>,
}

impl<'m> Taken<'m> {
    fn of(submesh: &'m Submesh, vertices: &'m [Vertex]) -> Self {
        let members = vertices.iter().map(|v| vec![*v]).collect();
        Self { submesh, vertices, parents: (0..vertices.len() as u32).collect(), members }
    }

    /// The set of a vertex; `None` if it is not on the boundary.
    fn root(&mut self, v: Vertex) -> Option<u32> {
        let place = self.vertices.binary_search(&v).ok()?;
        Some(union_find::find(&mut self.parents, place as u32))
    }

    /// Would a triangle have two corners in the set that these two make?
    fn flattens(&mut self, v: Vertex, w: Vertex) -> bool {
        let (Some(a), Some(b)) = (self.root(v), self.root(w)) else { return true };
        if a == b {
            return false;
        }
        let (few, other) = if self.members[a as usize].len() <= self.members[b as usize].len() { (a, b) } else { (b, a) };
        let around = self.around(&[few]);
        around.into_iter().any(|t| self.submesh.triangles[t as usize].v.into_iter().any(|x| self.root(x) == Some(other)))
    }

    /// Living triangles with a corner in one of these sets, each once.
    fn around(&self, roots: &[u32]) -> Vec<u32> {
        let members = roots.iter().flat_map(|root| &self.members[*root as usize]);
        let mut all: Vec<u32> = members.flat_map(|v| self.submesh.star(*v).map(|(t, _)| t)).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    fn unite(&mut self, v: Vertex, w: Vertex) {
        let (Some(a), Some(b)) = (self.root(v), self.root(w)) else { return };
        if a == b {
            return;
        }
        let mut all = std::mem::take(&mut self.members[a as usize]);
        all.append(&mut self.members[b as usize]);
        union_find::unite(&mut self.parents, a, b);
        if let Some(root) = self.root(v) {
            self.members[root as usize] = all;
        }
    }

    /// Makes two edges one, of two triangles and no more.
    fn edge(&mut self, a: [Vertex; 2], b: [Vertex; 2], reach: &[f64]) -> bool {
        let pairs = [(a[0], b[0]), (a[1], b[1])];
        let is_possible = pairs.iter().all(|(v, w)| !self.flattens(*v, *w) && self.hangs_together(*v, *w, reach));
        if !is_possible {
            return false;
        }
        let sets = pairs.map(|(v, w)| [self.root(v), self.root(w)].map(|root| root.unwrap_or(u32::MAX)));
        let ends = |taken: &mut Self, t: u32, set: [u32; 2]| {
            taken.submesh.triangles[t as usize].v.into_iter().any(|v| taken.root(v).is_some_and(|root| set.contains(&root)))
        };
        let around = self.around(&sets[0]);
        let along = around.into_iter().filter(|t| ends(self, *t, sets[1])).count();
        if along != 2 {
            return false;
        }
        pairs.into_iter().for_each(|(v, w)| self.unite(v, w));
        true
    }

    /// Each of the set that these two make lies within twice its reach of each other one.
    fn hangs_together(&mut self, v: Vertex, w: Vertex, reach: &[f64]) -> bool {
        let (Some(a), Some(b)) = (self.root(v), self.root(w)) else { return false };
        let (a, b) = (&self.members[a as usize], &self.members[b as usize]);
        a.iter().all(|x| b.iter().all(|y| self.submesh.distance(*x, *y) <= 2.0 * reach[*x as usize].min(reach[*y as usize])))
    }

    fn clusters(self) -> Vec<Vec<Vertex>> {
        let mut all: Vec<Vec<Vertex>> = self.members.into_iter().filter(|set| set.len() > 1).collect();
        all.iter_mut().for_each(|set| set.sort_unstable());
        all.sort_unstable();
        all
    }
}
