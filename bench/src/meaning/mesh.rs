//! Meshes while they are made: triangles of wide coordinates, each of a part of the surface (a face of CAD).

use std::collections::BTreeMap;

use crate::space::bounds;
pub(super) use crate::space::{Vector as V, cross, dot, length, minus, plus, times, unit};

/// A triangle, and the part of the surface that it belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Face {
    pub(super) p: [V; 3],
    pub(super) part: u32,
}

/// Triangles; corners that are one vertex have equal coordinates.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Mesh(pub(super) Vec<Face>);

/// Two directions square to `axis` and to each other.
pub(super) fn beside(axis: V) -> [V; 2] {
    let other = if axis[0].abs() < 0.6 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let u = unit(cross(axis, other));
    [u, cross(axis, u)]
}

impl Face {
    pub(super) fn middle(&self) -> V {
        std::array::from_fn(|k| (self.p[0][k] + self.p[1][k] + self.p[2][k]) / 3.0)
    }

    /// Its direction, as long as twice its area.
    pub(super) fn normal(&self) -> V {
        cross(minus(self.p[1], self.p[0]), minus(self.p[2], self.p[0]))
    }

    pub(super) fn turned(self) -> Self {
        let [a, b, c] = self.p;
        Self { p: [a, c, b], ..self }
    }
}

/// A vertex by its exact coordinates.
pub(super) fn key(p: V) -> [u64; 3] {
    p.map(|x| (x + 0.0).to_bits())
}

impl Mesh {
    /// Inside out.
    pub(super) fn turned(&self) -> Self {
        Self(self.0.iter().map(|face| face.turned()).collect())
    }

    /// Every corner moved by a rule of its place alone.
    pub(super) fn map(&self, rule: impl Fn(V) -> V) -> Self {
        Self(self.0.iter().map(|face| Face { p: face.p.map(&rule), ..*face }).collect())
    }

    pub(super) fn moved(&self, by: V) -> Self {
        self.map(|p| plus(p, by))
    }

    /// Both, the parts of the other numbered on.
    pub(super) fn and(&self, other: &Self) -> Self {
        let next = self.0.iter().map(|face| face.part + 1).max().unwrap_or(0);
        let others = other.0.iter().map(|face| Face { part: face.part + next, ..*face });
        Self(self.0.iter().copied().chain(others).collect())
    }

    /// The faces that `keep` says yes to.
    pub(super) fn only(&self, keep: impl Fn(&Face) -> bool) -> Self {
        Self(self.0.iter().copied().filter(|face| keep(face)).collect())
    }

    pub(super) fn area(&self) -> f64 {
        self.0.iter().map(|face| length(face.normal()) / 2.0).sum()
    }

    pub(super) fn volume(&self) -> f64 {
        self.0.iter().map(|face| dot(face.p[0], cross(face.p[1], face.p[2])) / 6.0).sum()
    }

    /// Its lowest and highest coordinates.
    pub(super) fn corners(&self) -> [V; 2] {
        bounds(self.0.iter().flat_map(|face| face.p))
    }

    /// Diagonal of its box.
    pub(super) fn size(&self) -> f64 {
        let [lo, hi] = self.corners();
        length(minus(hi, lo))
    }

    pub(super) fn outward(self) -> Self {
        if self.volume() < 0.0 { self.turned() } else { self }
    }

    /// Edges longer than `longest` are halved, by both of their triangles alike, until there are none. Vertices of one place stay of
    /// one place, and equal surfaces of two bodies stay equal.
    pub(super) fn finer(&self, longest: f64) -> Self {
        let mut faces = self.0.clone();
        loop {
            let mut next = Vec::with_capacity(2 * faces.len());
            faces.iter().for_each(|face| halve(face, longest, &mut next));
            if next.len() == faces.len() {
                return Self(faces);
            }
            faces = next;
        }
    }

    /// By vertex, the unit mean of the directions of its triangles, large ones counting more.
    pub(super) fn normals(&self) -> BTreeMap<[u64; 3], V> {
        let mut normals = BTreeMap::new();
        for face in &self.0 {
            for p in face.p {
                let sum = normals.entry(key(p)).or_insert([0.0; 3]);
                *sum = plus(*sum, face.normal());
            }
        }
        normals.values_mut().for_each(|normal| *normal = unit(*normal));
        normals
    }
}

/// The parts of a triangle whose long edges are halved.
fn halve(face: &Face, longest: f64, out: &mut Vec<Face>) {
    let [a, b, c] = face.p;
    let long = |a: V, b: V| length(minus(a, b)) > longest;
    let middle = |a: V, b: V| -> V { std::array::from_fn(|k| (a[k] + b[k]) / 2.0) };
    let mut push = |p: [V; 3]| out.push(Face { p, ..*face });
    let marked = [long(a, b), long(b, c), long(c, a)];
    // Turned so that the cases are one each.
    let (turn, count) = match marked {
        [false, false, false] => return push(face.p),
        [true, false, false] | [true, true, false] | [true, true, true] => (0, marked),
        [false, true, false] | [false, true, true] => (1, marked),
        _ => (2, marked),
    };
    let p = [face.p[turn], face.p[(turn + 1) % 3], face.p[(turn + 2) % 3]];
    let [a, b, c] = p;
    let ab = middle(a, b);
    match count.iter().filter(|long| **long).count() {
        1 => [[a, ab, c], [ab, b, c]].into_iter().for_each(push),
        2 => {
            let bc = middle(b, c);
            [[ab, b, bc], [a, ab, bc], [a, bc, c]].into_iter().for_each(push);
        }
        _ => {
            let (bc, ca) = (middle(b, c), middle(c, a));
            [[a, ab, ca], [ab, b, bc], [bc, c, ca], [ab, bc, ca]].into_iter().for_each(push);
        }
    }
}
