//! The patch while it is being shaped: triangles that know what is across each edge, in coordinates relative to the rim.

use glam::DVec3;

use super::coarse::CoarsePatch;
use crate::algorithms::triangulate::flips::{Edge, Hinge, relink};
use crate::geometry::exact::at;

use crate::util::ids::NONE;

/// Flips for each triangle, at most: what is not planar need not settle by itself.
const FLIPS: usize = 16;

/// A patch within its surroundings. Vertices below `fixed` are those of the coarse patch and stay where they are.
pub(super) struct Sheet<'a> {
    pub(super) points: Vec<DVec3>,
    pub(super) fixed: usize,
    /// Vertices below this stay, too: those beyond those of the coarse patch are on creases.
    pub(super) held: usize,
    pub(super) triangles: Vec<[u32; 3]>,
    /// The triangle across the edge from corner k to corner k + 1; [`NONE`] across the rim.
    across: Vec<[u32; 3]>,
    pub(super) around: &'a [[u32; 3]],
    /// For each vertex of the coarse patch: is it on the rim?
    pub(super) on_rim: Vec<bool>,
    /// The edge length wanted at each vertex; 0 where nobody asks.
    pub(super) scale: Vec<f64>,
    /// Edges of the surroundings between vertices of the rim, smaller vertex first, sorted: not to be made a second time.
    taken: Vec<[u32; 2]>,
    /// Edges of the patch along creases, likewise: not to be flipped.
    pub(super) creases: Vec<[u32; 2]>,
    pub(super) centre: DVec3,
    pub(super) unit: f64,
}

/// An edge from its smaller end.
pub(crate) fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

pub(crate) fn edges(t: [u32; 3]) -> [[u32; 2]; 3] {
    [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]
}

/// What is across each edge of each triangle; `None` where an edge has more than two, or two that disagree.
fn neighbours(triangles: &[[u32; 3]]) -> Option<Vec<[u32; 3]>> {
    let mut sides: Vec<([u32; 2], u32, u32)> = Vec::with_capacity(3 * triangles.len());
    for (i, t) in triangles.iter().enumerate() {
        sides.extend(edges(*t).iter().zip(0..).map(|(e, k)| (sorted(*e), i as u32, k)));
    }
    sides.sort_unstable();
    let mut across = vec![[NONE; 3]; triangles.len()];
    for same in sides.chunk_by(|a, b| a.0 == b.0) {
        match *same {
            [_] => {}
            [(_, i, k), (_, j, l)] => {
                let (i, k, j, l) = (i as usize, k as usize, j as usize, l as usize);
                if triangles[i][k] == triangles[j][l] {
                    return None;
                }
                across[i][k] = j as u32;
                across[j][l] = i as u32;
            }
            _ => return None,
        }
    }
    Some(across)
}

impl<'a> Sheet<'a> {
    /// `None` where the patch is no coherent 2-manifold with a border. O(n log n).
    pub(super) fn new(coarse: &CoarsePatch<'a>) -> Option<Self> {
        let across = neighbours(coarse.patch)?;
        let mut on_rim = vec![false; coarse.positions.len()];
        let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for (t, across) in coarse.patch.iter().zip(&across) {
            for (edge, _) in edges(*t).iter().zip(across).filter(|(_, there)| **there == NONE) {
                for &v in edge {
                    on_rim[v as usize] = true;
                    let p = at(&coarse.positions[v as usize]);
                    (lo, hi) = (lo.min(p), hi.max(p));
                }
            }
        }
        let (centre, unit) = ((lo + hi) * 0.5, (hi - lo).length() * 0.5);
        if !(unit > 0.0 && unit.is_finite()) {
            return None;
        }
        let between = |e: &[u32; 2]| e.iter().all(|&v| on_rim[v as usize]);
        let mut taken: Vec<[u32; 2]> = coarse.around.iter().flat_map(|t| edges(*t)).filter(between).map(sorted).collect();
        taken.sort_unstable();
        let mut sheet = Self {
            points: coarse.positions.iter().map(|p| (at(p) - centre) / unit).collect(),
            fixed: coarse.positions.len(),
            held: coarse.positions.len(),
            triangles: coarse.patch.to_vec(),
            across,
            around: coarse.around,
            on_rim,
            scale: Vec::new(),
            taken,
            creases: Vec::new(),
            centre,
            unit,
        };
        sheet.measure();
        Some(sheet)
    }

    /// The lengths wanted at the rim: of the edges one step beyond it, which the rim's own sampling does not touch; where there are
    /// none, of those that lead away from it; where there are none, of the rim.
    fn measure(&mut self) {
        let n = self.fixed;
        let (mut beyond, mut away, mut along) = (vec![(0.0, 0.0); n], vec![(0.0, 0.0); n], vec![(0.0, 0.0); n]);
        for t in self.around {
            for [a, b] in edges(*t) {
                let length = self.points[a as usize].distance(self.points[b as usize]);
                let to = match [a, b].map(|v| self.on_rim[v as usize]) {
                    [false, false] => &mut beyond,
                    [true, true] => &mut along,
                    _ => &mut away,
                };
                for v in [a, b] {
                    let sum = &mut to[v as usize];
                    *sum = (sum.0 + length, sum.1 + 1.0);
                }
            }
        }
        let mut near = vec![(0.0, 0.0); n];
        for t in self.around {
            for [a, b] in edges(*t) {
                for [v, w] in [[a, b], [b, a]] {
                    let (there, sum) = (beyond[w as usize], &mut near[v as usize]);
                    if self.on_rim[v as usize] && there.1 > 0.0 {
                        *sum = (sum.0 + there.0, sum.1 + there.1);
                    }
                }
            }
        }
        for t in &self.triangles {
            for [a, b] in edges(*t) {
                if along[a as usize].1 == 0.0 {
                    let length = self.points[a as usize].distance(self.points[b as usize]);
                    along[a as usize] = (length, 1.0);
                }
            }
        }
        let mean = |sums: [(f64, f64); 3]| sums.iter().find(|s| s.1 > 0.0).map_or(0.0, |s| s.0 / s.1);
        self.scale = (0..n)
            .map(|v| {
                // A rim of longer edges cannot be divided, and triangles much shorter than these would be slivers there.
                let least = if along[v].1 > 0.0 { RIM_SHARE * along[v].0 / along[v].1 } else { 0.0 };
                mean([near[v], away[v], along[v]]).max(least)
            })
            .collect();
    }

    pub(super) fn corners(&self, t: [u32; 3]) -> [DVec3; 3] {
        t.map(|v| self.points[v as usize])
    }

    /// Twice the area, along the normal.
    pub(super) fn normal(&self, t: [u32; 3]) -> DVec3 {
        let [a, b, c] = self.corners(t);
        (b - a).cross(c - a)
    }

    pub(super) fn add_point(&mut self, point: DVec3, scale: f64) -> u32 {
        self.points.push(point);
        self.scale.push(scale);
        self.points.len() as u32 - 1
    }

    /// Puts a vertex into a triangle, which becomes three.
    pub(super) fn split_triangle(&mut self, i: usize, v: u32) {
        let ([a, b, c], [ab, bc, ca]) = (self.triangles[i], self.across[i]);
        let (j, k) = (self.triangles.len(), self.triangles.len() + 1);
        self.triangles[i] = [a, b, v];
        self.triangles.extend([[b, c, v], [c, a, v]]);
        self.across[i] = [ab, j as u32, k as u32];
        self.across.extend([[bc, k as u32, i as u32], [ca, i as u32, j as u32]]);
        relink(&mut self.across, bc, i, j);
        relink(&mut self.across, ca, i, k);
    }

    /// Puts a vertex on the edge from corner k, if it is not on the rim: two triangles become four.
    pub(super) fn split_edge(&mut self, i: usize, k: usize, v: u32) -> bool {
        let Some(Hinge { other: Edge { triangle: j, k: l }, quad: [a, b, c, d], .. }) = self.hinge(i, k) else { return false };
        let (bc, ca) = (self.across[i][(k + 1) % 3], self.across[i][(k + 2) % 3]);
        let (ad, db) = (self.across[j][(l + 1) % 3], self.across[j][(l + 2) % 3]);
        let (m, n) = (self.triangles.len(), self.triangles.len() + 1);
        self.triangles[i] = [a, v, c];
        self.triangles[j] = [v, a, d];
        self.triangles.extend([[v, b, c], [b, v, d]]);
        self.across[i] = [j as u32, m as u32, ca];
        self.across[j] = [i as u32, ad, n as u32];
        self.across.extend([[n as u32, bc, i as u32], [m as u32, j as u32, db]]);
        relink(&mut self.across, bc, i, m);
        relink(&mut self.across, db, j, n);
        true
    }

    pub(super) fn across(&self) -> &[[u32; 3]] {
        &self.across
    }

    /// Do the surroundings have this edge?
    pub(super) fn is_taken(&self, a: u32, b: u32) -> bool {
        self.taken.binary_search(&sorted([a, b])).is_ok()
    }

    fn hinge(&self, triangle: usize, k: usize) -> Option<Hinge> {
        Hinge::at(&self.triangles, &self.across, Edge { triangle, k })
    }

    /// The triangle across an edge.
    fn beyond(&self, i: usize, k: usize) -> Option<usize> {
        let j = self.across[i][k];
        (j != NONE).then_some(j as usize)
    }

    /// Is there an edge between the two already, in the surroundings or in the patch? `i` is a triangle at `c`.
    fn linked(&self, i: usize, c: u32, d: u32) -> bool {
        if self.is_taken(c, d) {
            return true;
        }
        // Round the vertex one way, then, if that ends at the rim, the other.
        for turn in [0, 2] {
            let mut at = i;
            // A star is no larger than the patch.
            for _ in 0..self.triangles.len() {
                let t = self.triangles[at];
                if t.contains(&d) {
                    return true;
                }
                let Some(k) = t.iter().position(|&v| v == c) else { return false };
                match self.beyond(at, (k + turn) % 3) {
                    Some(next) if next == i => return false,
                    Some(next) => at = next,
                    None => break,
                }
            }
        }
        false
    }

    /// Flips edges that are not Delaunay, opposite angles together being more than two right ones, wherever the two triangles are
    /// convex as seen along their normals and the other diagonal is no edge yet. Bounded by a count.
    pub(super) fn relax(&mut self) {
        let mut budget = FLIPS * self.triangles.len();
        let mut stack: Vec<u32> = (0..self.triangles.len() as u32).rev().collect();
        let mut waiting = vec![true; self.triangles.len()];
        while let Some(i) = stack.pop().map(|i| i as usize) {
            waiting[i] = false;
            for k in 0..3 {
                if budget > 0
                    && let Some(j) = self.flip(i, k)
                {
                    budget -= 1;
                    for t in [i, j].into_iter().flat_map(|t| [t as u32].into_iter().chain(self.across[t])).filter(|&t| t != NONE)
                    {
                        if !waiting[t as usize] {
                            waiting[t as usize] = true;
                            stack.push(t);
                        }
                    }
                    break;
                }
            }
        }
    }

    fn flip(&mut self, i: usize, k: usize) -> Option<usize> {
        let hinge = self.hinge(i, k)?;
        let ([a, b, c, d], j) = (hinge.quad, hinge.other.triangle);
        let [pa, pb, pc, pd] = [a, b, c, d].map(|v| self.points[v as usize]);
        let angle = |apex: DVec3| {
            let (p, q) = (pa - apex, pb - apex);
            (p.dot(q), p.cross(q).length())
        };
        // The sine of the sum of both angles.
        let ((cos_c, sin_c), (cos_d, sin_d)) = (angle(pc), angle(pd));
        let size = (cos_c * cos_c + sin_c * sin_c).sqrt() * (cos_d * cos_d + sin_d * sin_d).sqrt();
        let obtuse = sin_c * cos_d + cos_c * sin_d < -1e-9 * size;
        if !obtuse {
            return None;
        }
        let up = self.normal(self.triangles[i]) + self.normal(self.triangles[j]);
        let convex = hinge.flipped().into_iter().all(|t| self.normal(t).dot(up) > 0.0);
        if !convex || self.creases.binary_search(&sorted([a, b])).is_ok() || self.linked(i, c, d) {
            return None;
        }
        hinge.flip(&mut self.triangles, &mut self.across);
        Some(j)
    }

    /// All triangles: the patch's, then those around.
    pub(super) fn all(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        self.triangles.iter().chain(self.around).copied()
    }
}

/// The smallest edge length at the rim as a share of the rim's own edges.
const RIM_SHARE: f64 = 0.25;
