//! The edges of the submesh that have a complete end, with all their triangles.

use super::{Submesh, Vertex};

/// A triangle's use of an edge: the triangle, and a bit for its direction. (No submesh is of 2^31 triangles: its corners have numbers of 32 bits.)
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Use(u32);

impl Use {
    fn new(triangle: u32, forward: bool) -> Self {
        Self(triangle << 1 | u32::from(forward))
    }

    pub(crate) fn triangle(self) -> u32 {
        self.0 >> 1
    }

    /// The triangle runs from the edge's `low` end to its `high` end.
    pub(crate) fn forward(self) -> bool {
        self.0 & 1 == 1
    }
}

/// An edge: its ends, smaller number first, and all its triangles, ascending.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge<'a> {
    pub(crate) low: Vertex,
    pub(crate) high: Vertex,
    pub(crate) uses: &'a [Use],
}

impl Edge<'_> {
    pub(crate) fn is_boundary(&self) -> bool {
        self.uses.len() == 1
    }

    pub(crate) fn is_nonmanifold(&self) -> bool {
        self.uses.len() > 2
    }

    /// Two triangles that run through it in the same direction.
    pub(crate) fn is_inconsistent(&self) -> bool {
        self.uses.len() == 2 && self.uses[0].forward() == self.uses[1].forward()
    }

    /// Not used equally often in both directions.
    pub(crate) fn is_unbalanced(&self) -> bool {
        self.uses.iter().filter(|u| u.forward()).count() * 2 != self.uses.len()
    }

    /// Start and end in the direction of `used`.
    pub(crate) fn directed(&self, used: &Use) -> (Vertex, Vertex) {
        if used.forward() { (self.low, self.high) } else { (self.high, self.low) }
    }
}

/// All edges with a complete end, sorted by ends; one flat table.
pub(crate) struct Edges {
    ends: Vec<(Vertex, Vertex)>,
    /// For each low end the number of its first edge, and of the one after the last.
    firsts: Vec<u32>,
    starts: Vec<u32>,
    uses: Vec<Use>,
    any_nonmanifold: bool,
}

impl Edges {
    /// O(n log n) in the half-edges around one vertex, O(n) in the submesh.
    pub(crate) fn of(submesh: &Submesh) -> Self {
        // Counting sort by the low end, then each vertex's few edges by comparison.
        let mut starts = vec![0u32; submesh.positions.len() + 1];
        each_half(submesh, |low, _, _| starts[low as usize + 1] += 1);
        for v in 1..starts.len() {
            starts[v] += starts[v - 1];
        }
        let mut at = starts.clone();
        let mut table = vec![(0, Use(0)); *starts.last().unwrap_or(&0) as usize];
        each_half(submesh, |low, high, used| {
            table[at[low as usize] as usize] = (high, used);
            at[low as usize] += 1;
        });
        drop(at);
        let groups = |low: usize| starts[low] as usize..starts[low + 1] as usize;
        let mut count = 0;
        for low in 0..submesh.positions.len() {
            let part = &mut table[groups(low)];
            sort_by_high(part);
            count += part.chunk_by(|a, b| a.0 == b.0).count();
        }
        let mut edges = Self {
            ends: Vec::with_capacity(count),
            firsts: Vec::with_capacity(submesh.positions.len() + 1),
            starts: Vec::with_capacity(count + 1),
            uses: Vec::with_capacity(table.len()),
            any_nonmanifold: false,
        };
        edges.starts.push(0);
        for low in 0..submesh.positions.len() {
            edges.firsts.push(edges.ends.len() as u32);
            for group in table[groups(low)].chunk_by(|a, b| a.0 == b.0) {
                edges.ends.push((low as Vertex, group[0].0));
                edges.uses.extend(group.iter().map(|g| g.1));
                edges.starts.push(edges.uses.len() as u32);
                edges.any_nonmanifold |= group.len() > 2;
            }
        }
        edges.firsts.push(edges.ends.len() as u32);
        edges
    }

    pub(crate) fn len(&self) -> usize {
        self.ends.len()
    }

    /// Is there an edge of more than two triangles?
    pub(crate) fn any_nonmanifold(&self) -> bool {
        self.any_nonmanifold
    }

    pub(crate) fn get(&self, i: usize) -> Edge<'_> {
        let (low, high) = self.ends[i];
        Edge { low, high, uses: &self.uses[self.starts[i] as usize..self.starts[i + 1] as usize] }
    }

    /// In order of (low, high).
    pub(crate) fn iter(&self) -> impl Iterator<Item = Edge<'_>> {
        (0..self.len()).map(|i| self.get(i))
    }

    /// The edge between two vertices, if it has a complete end and a triangle.
    pub(crate) fn between(&self, a: Vertex, b: Vertex) -> Option<Edge<'_>> {
        self.number(a, b).map(|i| self.get(i as usize))
    }

    /// Its number.
    pub(crate) fn number(&self, a: Vertex, b: Vertex) -> Option<u32> {
        let (low, high) = (a.min(b) as usize, a.max(b));
        let of_low = *self.firsts.get(low)? as usize..*self.firsts.get(low + 1)? as usize;
        let place = self.ends[of_low.clone()].binary_search_by_key(&high, |(_, high)| *high).ok()?;
        Some((of_low.start + place) as u32)
    }
}

/// Visits what each living triangle has of the edges with a complete end, by triangle: the ends, smaller number first, and the use.
#[inline(always)]
fn each_half(submesh: &Submesh, mut visit: impl FnMut(Vertex, Vertex, Use)) {
    for t in submesh.living() {
        let v = submesh.triangles[t as usize].v;
        for k in 0..3 {
            let (a, b) = (v[k], v[(k + 1) % 3]);
            if submesh.complete[a as usize] || submesh.complete[b as usize] {
                visit(a.min(b), a.max(b), Use::new(t, a < b));
            }
        }
    }
}

/// Sorts what begins at one vertex by the other end; of one edge the triangles, which ascend, stay in their order.
fn sort_by_high(part: &mut [(Vertex, Use)]) {
    /// So many are sorted sooner one by one.
    const FEW: usize = 16;
    if part.len() > FEW {
        part.sort_unstable_by_key(|(high, used)| (*high, used.triangle()));
        return;
    }
    for i in 1..part.len() {
        let mut at = i;
        while at > 0 && part[at - 1].0 > part[at].0 {
            part.swap(at - 1, at);
            at -= 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Edges;
    use crate::testing::{diagnose, plate, records, reversed};

    #[test]
    fn a_square_has_four_boundary_edges_and_a_diagonal() {
        let records = records(&plate(1, |_, _| true));
        let edges = Edges::of(&diagnose(&records).submesh);
        assert_eq!(edges.len(), 5);
        assert_eq!(edges.iter().filter(|e| e.is_boundary() && e.is_unbalanced()).count(), 4);
        let diagonal = edges.iter().find(|e| e.uses.len() == 2).unwrap();
        assert!(!diagonal.is_inconsistent() && !diagonal.is_unbalanced() && !diagonal.is_nonmanifold());
        // Its two triangles run through it in opposite directions, and it is found from either end.
        let [a, b] = [diagonal.uses[0], diagonal.uses[1]].map(|u| diagonal.directed(&u));
        assert_eq!(a, (b.1, b.0));
        assert_eq!(edges.number(diagonal.high, diagonal.low), edges.number(diagonal.low, diagonal.high));
    }

    #[test]
    fn a_turned_triangle_disagrees_and_a_third_makes_the_edge_nonmanifold() {
        let mut square = plate(1, |_, _| true);
        square[1] = reversed(&square[1..])[0];
        let turned = records(&square);
        assert_eq!(Edges::of(&diagnose(&turned).submesh).iter().filter(|e| e.is_inconsistent() && e.is_unbalanced()).count(), 1);
        square.push([[0.0; 3], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        let three = records(&square);
        let edges = Edges::of(&diagnose(&three).submesh);
        // Three uses are no longer a disagreement of two.
        assert_eq!(edges.iter().filter(|e| e.is_nonmanifold() && !e.is_inconsistent()).count(), 1);
    }
}
