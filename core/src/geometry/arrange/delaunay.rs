//! A Delaunay triangulation of a triangle, to which points are added.
//!
//! In steps and ties after that of `manifold-rust` (Lars Brubaker, Apache-2.0), so that the result is the same. Of four points on a circle,
//! the diagonal with the lowest points in order of coordinates is taken, so that two triangles of one plane are divided alike.

use crate::geometry::arrange::flat::Flat;
use crate::util::ids::NONE;

#[derive(Clone, Copy, Debug)]
pub(crate) struct Tri {
    /// To the left.
    pub(crate) v: [usize; 3],
    /// The triangle across the side from corner `k` on, or [`NONE`].
    pub(crate) adjacent: [u32; 3],
    pub(crate) constrained: [bool; 3],
    pub(crate) alive: bool,
}

impl Tri {
    pub(crate) fn new(v: [usize; 3], adjacent: [u32; 3], constrained: [bool; 3]) -> Self {
        Self { v, adjacent, constrained, alive: true }
    }

    pub(crate) fn side_towards(&self, other: usize) -> usize {
        (0..2).find(|k| self.adjacent[*k] == other as u32).unwrap_or(2)
    }
}

pub(crate) struct Delaunay<'f> {
    pub(crate) flat: &'f Flat<'f>,
    pub(crate) triangles: Vec<Tri>,
    suspects: Vec<usize>,
    /// By point, the latest triangle that has it: one that lives.
    latest: Vec<u32>,
    /// By point, its place in the order of coordinates.
    rank: Vec<u32>,
}

/// Where a point lies in a triangle.
enum Place {
    Inside,
    Side(usize),
    Outside(usize),
}

impl<'f> Delaunay<'f> {
    /// The first three points, which turn to the left in this order.
    pub(crate) fn new(flat: &'f Flat<'f>, corners: [usize; 3]) -> Self {
        let mut order: Vec<usize> = (0..flat.len()).collect();
        order.sort_by(|a, b| flat.cmp(*a, *b));
        let mut rank = vec![0; flat.len()];
        order.iter().zip(0..).for_each(|(point, place)| rank[*point] = place);
        let triangles = vec![Tri::new(corners, [NONE; 3], [false; 3])];
        Self { flat, triangles, suspects: Vec::new(), latest: vec![0; flat.len()], rank }
    }

    pub(crate) fn record(&mut self, t: usize) {
        for v in self.triangles[t].v {
            self.latest[v] = t as u32;
        }
    }

    /// The first answer of a triangle around a point: from the latest on, to the left, then to the right.
    pub(crate) fn around<T>(&self, a: usize, mut ask: impl FnMut(usize) -> Option<T>) -> Option<T> {
        let first = self.latest[a] as usize;
        for to_the_left in [true, false] {
            let mut at = first;
            // Around a point no triangle comes twice.
            for _ in 0..=self.triangles.len() {
                if (to_the_left || at != first)
                    && let Some(answer) = ask(at)
                {
                    return Some(answer);
                }
                let t = &self.triangles[at];
                let k = t.v.iter().position(|v| *v == a)?;
                let next = t.adjacent[if to_the_left { k } else { (k + 2) % 3 }];
                if next == NONE || next as usize == first {
                    break;
                }
                at = next as usize;
            }
        }
        None
    }

    fn rewire(&mut self, t: usize, side: usize, new: usize) {
        let other = self.triangles[t].adjacent[side];
        if other != NONE {
            let other = &mut self.triangles[other as usize];
            let back = other.side_towards(t);
            other.adjacent[back] = new as u32;
        }
    }

    /// Adds a point in the triangle or on its border.
    pub(crate) fn insert(&mut self, p: usize) -> Option<()> {
        let mut at = self.triangles.iter().rposition(|t| t.alive)?;
        // A walk in a Delaunay triangulation comes to no triangle twice.
        for _ in 0..=self.triangles.len() {
            match self.place(p, at) {
                Place::Inside => {
                    self.split_inside(at, p);
                    return Some(());
                }
                Place::Side(side) => {
                    self.split_side(at, side, p);
                    return Some(());
                }
                Place::Outside(side) => at = self.triangles[at].adjacent[side] as usize,
            }
        }
        None
    }

    fn place(&self, p: usize, t: usize) -> Place {
        let t = &self.triangles[t];
        let turns = [0, 1, 2].map(|k| self.flat.turn(t.v[k], t.v[(k + 1) % 3], p));
        if turns.contains(&-1) {
            let beyond = (0..3).find(|k| turns[*k] < 0 && t.adjacent[*k] != NONE);
            return Place::Outside(beyond.unwrap_or(0));
        }
        turns.iter().position(|turn| *turn == 0).map_or(Place::Inside, Place::Side)
    }

    fn split_inside(&mut self, t: usize, p: usize) {
        let Tri { v, adjacent, constrained, .. } = self.triangles[t];
        let base = self.triangles.len();
        for k in 0..3 {
            let (next, last) = (base + (k + 1) % 3, base + (k + 2) % 3);
            let sides = [adjacent[k], next as u32, last as u32];
            self.triangles.push(Tri::new([v[k], v[(k + 1) % 3], p], sides, [constrained[k], false, false]));
        }
        for k in 0..3 {
            self.rewire(t, k, base + k);
            self.record(base + k);
        }
        self.triangles[t].alive = false;
    }

    fn split_side(&mut self, t: usize, side: usize, p: usize) {
        let other = self.triangles[t].adjacent[side];
        let first = self.split_one_side(t, side, p);
        if other != NONE {
            let back = self.triangles[other as usize].side_towards(t);
            let second = self.split_one_side(other as usize, back, p);
            // The first half here faces the second half there.
            for (here, there) in [(first, second + 1), (first + 1, second)] {
                self.triangles[here].adjacent[0] = there as u32;
                self.triangles[there].adjacent[0] = here as u32;
            }
        }
    }

    /// Replaces (a, b, c) by (a, p, c) and (p, b, c). Returns the number of the first.
    fn split_one_side(&mut self, t: usize, side: usize, p: usize) -> usize {
        let Tri { v, adjacent, constrained, .. } = self.triangles[t];
        let at = [side, (side + 1) % 3, (side + 2) % 3];
        let ([a, b, c], [ab, bc, ca], [with_ab, with_bc, with_ca]) =
            (at.map(|k| v[k]), at.map(|k| adjacent[k]), at.map(|k| constrained[k]));
        let first = self.triangles.len();
        self.triangles.push(Tri::new([a, p, c], [ab, first as u32 + 1, ca], [with_ab, false, with_ca]));
        self.triangles.push(Tri::new([p, b, c], [ab, bc, first as u32], [with_ab, with_bc, false]));
        self.rewire(t, at[1], first + 1);
        self.rewire(t, at[2], first);
        self.record(first);
        self.record(first + 1);
        self.triangles[t].alive = false;
        first
    }

    /// Flips what is not Delaunay, from the new triangles on (Lawson).
    pub(crate) fn legalize(&mut self, first_new: usize) {
        self.suspects.extend(first_new..self.triangles.len());
        while let Some(t) = self.suspects.pop() {
            if self.triangles[t].alive && (0..3).any(|side| self.try_flip(t, side)) {
                let count = self.triangles.len();
                self.suspects.extend([count - 2, count - 1]);
            }
        }
    }

    /// Ends: a flip lowers the surface lifted onto a paraboloid, or lets it be and lowers the diagonals' ranks.
    fn try_flip(&mut self, t: usize, side: usize) -> bool {
        let here = self.triangles[t];
        let other = here.adjacent[side];
        if here.constrained[side] || other == NONE {
            return false;
        }
        let there = self.triangles[other as usize];
        let back = there.side_towards(t);
        let [a, b, c] = [0, 1, 2].map(|k| here.v[(side + k) % 3]);
        let d = there.v[(back + 2) % 3];
        let diagonal = |u: usize, v: usize| (self.rank[u].min(self.rank[v]), self.rank[u].max(self.rank[v]));
        let wanted = match self.flat.in_circle(here.v, d) {
            0 => diagonal(c, d) < diagonal(a, b),
            turn => turn > 0,
        };
        if !wanted || self.flat.turn(a, d, c) <= 0 || self.flat.turn(d, b, c) <= 0 {
            return false;
        }
        self.flip([t, other as usize], [side, back]);
        true
    }

    /// Replaces (a, b, c) and (b, a, d) by (a, d, c) and (d, b, c).
    fn flip(&mut self, [t, n]: [usize; 2], [side, back]: [usize; 2]) {
        let (here, there) = (self.triangles[t], self.triangles[n]);
        let [a, b, c] = [0, 1, 2].map(|k| here.v[(side + k) % 3]);
        let d = there.v[(back + 2) % 3];
        let (bc, ca, ad, db) = ((side + 1) % 3, (side + 2) % 3, (back + 1) % 3, (back + 2) % 3);
        let first = self.triangles.len();
        let second = first + 1;
        self.triangles.push(Tri::new(
            [a, d, c],
            [there.adjacent[ad], second as u32, here.adjacent[ca]],
            [there.constrained[ad], false, here.constrained[ca]],
        ));
        self.triangles.push(Tri::new(
            [d, b, c],
            [there.adjacent[db], here.adjacent[bc], first as u32],
            [there.constrained[db], here.constrained[bc], false],
        ));
        self.rewire(t, bc, second);
        self.rewire(t, ca, first);
        self.rewire(n, ad, first);
        self.rewire(n, db, second);
        self.record(first);
        self.record(second);
        self.triangles[t].alive = false;
        self.triangles[n].alive = false;
    }
}
