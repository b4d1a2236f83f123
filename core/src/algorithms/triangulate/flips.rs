//! Edge flips in a triangulated polygon: an edge between two triangles is replaced by the other diagonal of the two.

use super::rim::Rim;
use crate::geometry::exact::at;
use crate::util::ids::NONE;
use glam::DVec3;

/// Flips for each triangle, at most. What is not planar need not settle by itself.
const WORK: usize = 16;

/// Steps of 1 − cos of the angle between normals, as in the minimum-weight triangulation.
const BEND_STEPS: f64 = 32.0;

/// An edge: from corner k of a triangle to corner k + 1.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge {
    pub(crate) triangle: usize,
    pub(crate) k: usize,
}

/// Two triangles on an edge, among triangles that know which one is across each edge (from corner k to corner k + 1; [`NONE`]: none).
pub(crate) struct Hinge {
    edge: Edge,
    /// The edge as seen from the triangle on its other side.
    pub(crate) other: Edge,
    /// The ends of the edge, then the corners opposite to it in the edge's triangle and in the other.
    pub(crate) quad: [u32; 4],
}

impl Hinge {
    /// `None` where nothing is across.
    pub(crate) fn at(triangles: &[[u32; 3]], across: &[[u32; 3]], edge: Edge) -> Option<Self> {
        let Edge { triangle: i, k } = edge;
        let j = across[i][k];
        if j == NONE {
            return None;
        }
        let j = j as usize;
        let l = across[j].iter().position(|&x| x as usize == i)?;
        let t = triangles[i];
        let quad = [t[k], t[(k + 1) % 3], t[(k + 2) % 3], triangles[j][(l + 2) % 3]];
        Some(Self { edge, other: Edge { triangle: j, k: l }, quad })
    }

    /// The two triangles on the other diagonal.
    pub(crate) fn flipped(&self) -> [[u32; 3]; 2] {
        let [a, b, c, d] = self.quad;
        [[c, a, d], [d, b, c]]
    }

    /// Puts them in place of the two.
    pub(crate) fn flip(&self, triangles: &mut [[u32; 3]], across: &mut [[u32; 3]]) {
        let (Edge { triangle: i, k }, Edge { triangle: j, k: l }) = (self.edge, self.other);
        let (bc, ca) = (across[i][(k + 1) % 3], across[i][(k + 2) % 3]);
        let (ad, db) = (across[j][(l + 1) % 3], across[j][(l + 2) % 3]);
        [triangles[i], triangles[j]] = self.flipped();
        across[i] = [ca, ad, j as u32];
        across[j] = [db, bc, i as u32];
        relink(across, ad, j, i);
        relink(across, bc, i, j);
    }
}

/// Triangle `t`, if it is one, has `to` across where it had `from`.
pub(crate) fn relink(across: &mut [[u32; 3]], t: u32, from: usize, to: usize) {
    if let Some(slots) = across.get_mut(t as usize) {
        for s in slots.iter_mut().filter(|s| **s as usize == from) {
            *s = to as u32;
        }
    }
}

/// A triangulated polygon whose edges can be flipped.
pub(super) struct Flips<'a> {
    rim: &'a Rim<'a>,
    triangles: Vec<[u32; 3]>,
    /// The triangle across the edge from corner k to corner k + 1; [`NONE`] across the rim.
    across: Vec<[u32; 3]>,
}

impl<'a> Flips<'a> {
    pub(super) fn new(rim: &'a Rim<'a>, triangles: Vec<[u32; 3]>) -> Self {
        let mut sides: Vec<(u32, u32, usize, usize)> = Vec::with_capacity(3 * triangles.len());
        for (i, t) in triangles.iter().enumerate() {
            sides.extend((0..3).map(|k| (t[k].min(t[(k + 1) % 3]), t[k].max(t[(k + 1) % 3]), i, k)));
        }
        sides.sort_unstable();
        let mut across = vec![[NONE; 3]; triangles.len()];
        for pair in sides.windows(2) {
            let ((a, b, i, k), (c, d, j, l)) = (pair[0], pair[1]);
            if (a, b) == (c, d) {
                across[i][k] = j as u32;
                across[j][l] = i as u32;
            }
        }
        Self { rim, triangles, across }
    }

    pub(super) fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    pub(super) fn into_triangles(self) -> Vec<[u32; 3]> {
        self.triangles
    }

    /// The triangles on both sides of an edge; `None` on the rim.
    pub(super) fn around(&self, edge: Edge) -> Option<Hinge> {
        Hinge::at(&self.triangles, &self.across, edge)
    }

    /// Flips the edge, if both new triangles are legal and the diagonal is allowed; gives the other triangle changed.
    fn flip(&mut self, edge: Edge, legal: impl Fn([u32; 3]) -> bool) -> Option<usize> {
        let hinge = self.around(edge)?;
        let [_, _, c, d] = hinge.quad;
        if !hinge.flipped().into_iter().all(legal) || !self.rim.allows(c, d) {
            return None;
        }
        hinge.flip(&mut self.triangles, &mut self.across);
        Some(hinge.other.triangle)
    }

    /// Flips wherever `better` says so and it is legal, until nothing changes or the bound is reached.
    pub(super) fn improve(&mut self, legal: impl Fn([u32; 3]) -> bool, better: impl Fn(&Self, Edge) -> bool) {
        let mut budget = WORK * self.triangles.len();
        let mut stack: Vec<u32> = (0..self.triangles.len() as u32).rev().collect();
        while let Some(triangle) = stack.pop().map(|i| i as usize) {
            for edge in [0, 1, 2].map(|k| Edge { triangle, k }) {
                if budget > 0
                    && better(self, edge)
                    && let Some(other) = self.flip(edge, &legal)
                {
                    budget -= 1;
                    let changed = [triangle, other];
                    stack.extend(changed.iter().flat_map(|&t| self.across[t]).filter(|&t| t != NONE));
                    break;
                }
            }
        }
    }

    /// Flips edges where that makes the sharpest bend around them smaller, or leaves it and makes the edge shorter.
    pub(super) fn smooth(&mut self) {
        let rim = self.rim;
        self.improve(|t| rim.admits(t), |mesh, edge| mesh.smoother(edge));
    }

    fn smoother(&self, edge: Edge) -> bool {
        let Some(Hinge { other, quad: [a, b, c, d], .. }) = self.around(edge) else { return false };
        let [pa, pb, pc, pd] = [a, b, c, d].map(|v| at(&self.rim.points[v as usize]));
        let normal = |p: DVec3, q: DVec3, r: DVec3| (q - p).cross(r - p).normalize_or_zero();
        let beyond = |e: Edge, step: usize| self.normal_beyond(Edge { triangle: e.triangle, k: (e.k + step) % 3 });
        let (bc, ca, ad, db) = (beyond(edge, 1), beyond(edge, 2), beyond(other, 1), beyond(other, 2));
        let bend = |p: DVec3, q: DVec3| if p == DVec3::ZERO || q == DVec3::ZERO { 0.0 } else { 1.0 - p.dot(q) };
        let worst =
            |pairs: [(DVec3, DVec3); 5]| (pairs.iter().map(|(p, q)| bend(*p, *q)).fold(0.0, f64::max) * BEND_STEPS) as u32;
        let (abc, bad) = (normal(pa, pb, pc), normal(pb, pa, pd));
        let (cad, dbc) = (normal(pc, pa, pd), normal(pd, pb, pc));
        let before = worst([(abc, bad), (abc, bc), (abc, ca), (bad, ad), (bad, db)]);
        let after = worst([(cad, dbc), (cad, ca), (cad, ad), (dbc, db), (dbc, bc)]);
        let (length, other_length) = ((pb - pa).length_squared(), (pd - pc).length_squared());
        after < before || (after == before && other_length < length * (1.0 - 1e-9))
    }

    /// Unit normal of the triangle across an edge, be it of the patch or of the mesh; zero: unknown.
    fn normal_beyond(&self, edge: Edge) -> DVec3 {
        let t = self.triangles[edge.triangle];
        match self.across[edge.triangle][edge.k] {
            NONE => self.rim.rim_edge(t[edge.k], t[(edge.k + 1) % 3]).map_or(DVec3::ZERO, |i| self.rim.normal_beyond(i)),
            other => {
                let [a, b, c] = self.rim.corners(self.triangles[other as usize]).map(|p| at(&p));
                (b - a).cross(c - a).normalize_or_zero()
            }
        }
    }

    /// Flips forbidden chords away where that is legal.
    pub(super) fn avoid_forbidden(&mut self, legal: impl Fn([u32; 3]) -> bool) {
        for triangle in 0..self.triangles.len() {
            for k in 0..3 {
                let t = self.triangles[triangle];
                if !self.rim.allows(t[k], t[(k + 1) % 3]) {
                    self.flip(Edge { triangle, k }, &legal);
                }
            }
        }
    }

    /// Are all chords allowed?
    pub(super) fn is_allowed(&self) -> bool {
        self.triangles.iter().all(|t| (0..3).all(|k| self.rim.allows(t[k], t[(k + 1) % 3])))
    }
}
