//! The exact topology of one chunk: which vertices at home there have a sound star, and which sound surface hangs together.
//!
//! A chunk sees every triangle around each vertex at home in it, so it decides those vertices' stars exactly and alone. A vertex
//! is **sound** when its triangles form one closed fan, coherently oriented: every directed edge that leaves it comes back exactly
//! once, in one cycle of at least three. Anything else (boundary, non-manifold edge, disagreement, several fans, duplicates, a
//! collinear triangle) makes it **unsound**, and all its triangles are reported to the workshop, which sorts out what is wrong.
//! Sound vertices that share a triangle belong to one **patch**: a coherent piece of surface.
//!
//! Tables are laid out to stay in an L2 cache at 32 k triangles a chunk; a worker keeps them from chunk to chunk.

use crate::members::Members;
use crate::plan::{ChunkId, HomeBox, Plan};
use crate::record::{self, Record};
use crate::sums::{Bounds, Extent, Measure};
use crate::weld::Weld;

/// No vertex, patch or triangle.
pub(crate) const NONE: u32 = u32::MAX;

/// A triangle that goes to the workshop, and which of its corners are unsound here (bit k: corner k).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Suspect {
    pub(crate) triangle: u32,
    pub(crate) unsound: u8,
}

/// A triangle that more than one chunk sees, or that is a suspect, with the patch of its sound corners at home here.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Link {
    pub(crate) triangle: u32,
    /// Number of the patch within the chunk.
    pub(crate) patch: u32,
}

/// What is summed over a patch: its triangles with three sound corners, all at home in one chunk.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patch {
    pub(crate) triangles: u64,
    pub(crate) extent: Extent,
    /// Of its sound vertices.
    pub(crate) bounds: Bounds,
    /// Smallest member with a sound corner in it.
    pub(crate) first: u32,
}

/// The patch of each member in list order.
#[derive(Clone, Debug, Default)]
pub(crate) enum Labels {
    /// All members with a sound corner belong to patch 0 of the chunk.
    #[default]
    One,
    /// Run-coded: count, then patch + 1 (0: none).
    Runs(Vec<u8>),
}

/// What one chunk contributes.
#[derive(Debug, Default)]
pub(crate) struct ChunkTopology {
    pub(crate) suspects: Vec<Suspect>,
    pub(crate) links: Vec<Link>,
    pub(crate) patches: Vec<Patch>,
    pub(crate) labels: Labels,
    /// Positions at home here.
    pub(crate) vertices: u64,
    /// Those used by a triangle with three distinct vertices.
    pub(crate) vertices_used: u64,
}

/// The tables of one worker, used again from chunk to chunk.
#[derive(Default)]
pub(crate) struct Scratch {
    vertices: Weld,
    home: Vec<bool>,
    /// Members: record number and vertices; a triangle with a repeated vertex has `NONE` first.
    numbers: Vec<u32>,
    triangles: Vec<[u32; 3]>,
    /// Vertex → its part of `around` starts here.
    starts: Vec<u32>,
    /// (next, previous) corner of each triangle around a vertex.
    around: Vec<[u32; 2]>,
    sound: Vec<bool>,
    collinear: Vec<u32>,
    parents: Vec<u32>,
    /// Patch of a sound home vertex, [`UNSOUND`] or [`AWAY`].
    states: Vec<u32>,
}

/// State of a vertex at home here whose star is not sound.
const UNSOUND: u32 = NONE - 1;
/// State of a vertex at home elsewhere.
const AWAY: u32 = NONE - 2;

/// Bytes that one worker needs for a chunk of `members` triangles, at most.
pub(crate) fn scratch_bytes(members: u64) -> u64 {
    // Slots 2 × 16 × 3, numbers 4, triangles 12, around 24, per vertex (up to three a triangle) 12 + 1 + 4 + 1 + 4 + 4.
    members * (96 + 4 + 12 + 24 + 3 * 26)
}

impl Scratch {
    /// Decides everything that can be decided inside `chunk`. O(members).
    pub(crate) fn solve(
        &mut self,
        records: &[Record],
        plan: &Plan,
        members: &Members,
        chunk: ChunkId,
        measure: &Measure,
    ) -> ChunkTopology {
        self.weld(records, members, chunk, plan.home_box(chunk));
        self.mark_collinear();
        self.judge_stars();
        self.unite_patches();
        self.collect(measure)
    }

    /// Numbers the vertices of all members.
    #[inline(never)]
    fn weld(&mut self, records: &[Record], members: &Members, chunk: ChunkId, cell: HomeBox) {
        self.numbers.clear();
        self.triangles.clear();
        let expected: usize = members.runs(chunk).map(|(_, count)| count as usize).sum();
        // Half a vertex a triangle is the rule; a soup has three, and grows the table.
        self.vertices.reset(expected / 2);
        self.numbers.reserve(expected);
        self.triangles.reserve(expected);
        // A triangle mostly shares vertices with the one before it: comparing is cheaper than looking up.
        let mut last = [(NONE, [0f32; 3]); 3];
        for (first, count) in members.runs(chunk) {
            let run = &records[first as usize..(first + count) as usize];
            for (i, record) in run.iter().enumerate() {
                let [p, q, r] = record::corners(record);
                let a = self.vertex_near(p, &last);
                let b = self.vertex_near(q, &last);
                let c = self.vertex_near(r, &last);
                last = [(a, p), (b, q), (c, r)];
                self.numbers.push(first + i as u32);
                self.triangles.push(if a == b || b == c || c == a { [NONE, a, b] } else { [a, b, c] });
            }
        }
        self.home.clear();
        self.home.extend(self.vertices.positions().iter().map(|p| cell.holds(*p)));
    }

    /// The vertex at `p`, which may be one of the `last` three.
    #[inline]
    fn vertex_near(&mut self, p: [f32; 3], last: &[(u32, [f32; 3]); 3]) -> u32 {
        let same = |q: &[f32; 3]| (p[0] == q[0]) & (p[1] == q[1]) & (p[2] == q[2]);
        match last.iter().find(|(vertex, q)| same(q) && *vertex != NONE) {
            Some((vertex, _)) => *vertex,
            None => self.vertices.vertex(p),
        }
    }

    /// Exactly collinear triangles: their vertices are unsound, so that the workshop sees the neighbours they must be closed with.
    #[inline(never)]
    fn mark_collinear(&mut self) {
        self.collinear.clear();
        let positions = self.vertices.positions();
        for (i, t) in self.triangles.iter().enumerate() {
            if t[0] != NONE {
                let [a, b, c] = t.map(|v| &positions[v as usize]);
                if is_collinear(a, b, c) {
                    self.collinear.push(i as u32);
                }
            }
        }
    }

    /// Gathers the triangles around each home vertex and tests whether they are one closed coherent fan.
    #[inline(never)]
    fn judge_stars(&mut self) {
        let vertices = self.home.len();
        self.starts.clear();
        self.starts.resize(vertices + 2, 0);
        for t in self.triangles.iter().filter(|t| t[0] != NONE) {
            for v in t {
                // Away vertices have incomplete stars: not kept.
                self.starts[*v as usize + 2] += u32::from(self.home[*v as usize]);
            }
        }
        for v in 0..vertices {
            self.starts[v + 2] += self.starts[v + 1];
        }
        let total = self.starts[vertices + 1] as usize;
        self.around.clear();
        self.around.resize(total, [0; 2]);
        for t in self.triangles.iter().filter(|t| t[0] != NONE) {
            for (k, v) in t.iter().enumerate() {
                if self.home[*v as usize] {
                    let at = &mut self.starts[*v as usize + 1];
                    self.around[*at as usize] = [t[(k + 1) % 3], t[(k + 2) % 3]];
                    *at += 1;
                }
            }
        }
        self.sound.clear();
        self.sound.resize(vertices, false);
        for v in 0..vertices {
            if self.home[v] {
                self.sound[v] = is_closed_fan(&mut self.around[self.starts[v] as usize..self.starts[v + 1] as usize]);
            }
        }
        for i in &self.collinear {
            for v in self.triangles[*i as usize] {
                self.sound[v as usize] = false;
            }
        }
    }

    /// Union of sound home vertices that share a triangle.
    #[inline(never)]
    fn unite_patches(&mut self) {
        self.parents.clear();
        self.parents.extend(0..self.home.len() as u32);
        for t in self.triangles.iter().filter(|t| t[0] != NONE) {
            let sound = t.map(|v| self.sound[v as usize]);
            if sound[0] && sound[1] {
                unite(&mut self.parents, t[0], t[1]);
            }
            if sound[2] && (sound[0] || sound[1]) {
                unite(&mut self.parents, t[2], if sound[0] { t[0] } else { t[1] });
            }
        }
    }

    #[inline(never)]
    fn collect(&mut self, measure: &Measure) -> ChunkTopology {
        let mut out = ChunkTopology {
            suspects: Vec::new(),
            links: Vec::new(),
            patches: Vec::new(),
            labels: Labels::One,
            vertices: self.home.iter().filter(|h| **h).count() as u64,
            vertices_used: (0..self.home.len()).filter(|v| self.starts[*v] != self.starts[*v + 1]).count() as u64,
        };
        self.number_patches(&mut out.patches);
        let mut labels = LabelWriter::default();
        for (i, t) in self.triangles.iter().enumerate() {
            let triangle = self.numbers[i];
            if t[0] == NONE {
                out.suspects.push(Suspect { triangle, unsound: 0 });
                labels.push(NONE);
                continue;
            }
            let (mut unsound, mut away, mut patch) = (0u8, false, NONE);
            for (k, v) in t.iter().enumerate() {
                match self.states[*v as usize] {
                    AWAY => away = true,
                    UNSOUND => unsound |= 1 << k,
                    of => patch = of,
                }
            }
            labels.push(patch);
            if unsound != 0 {
                out.suspects.push(Suspect { triangle, unsound });
            }
            if patch == NONE {
                continue;
            }
            let sums = &mut out.patches[patch as usize];
            sums.first = sums.first.min(triangle);
            if unsound != 0 || away {
                out.links.push(Link { triangle, patch });
            } else {
                sums.triangles += 1;
                sums.extent += measure.triangle(&t.map(|v| self.vertices.positions()[v as usize]));
            }
        }
        if out.patches.len() > 1 {
            out.labels = Labels::Runs(labels.finish());
        }
        out
    }

    #[inline(never)]
    fn number_patches(&mut self, patches: &mut Vec<Patch>) {
        self.states.clear();
        self.states.extend(self.home.iter().map(|home| if *home { UNSOUND } else { AWAY }));
        for (v, position) in self.vertices.positions().iter().enumerate() {
            if !self.sound[v] {
                continue;
            }
            // The root is the smallest of its union, so it has been numbered before all others.
            let root = find(&mut self.parents, v as u32) as usize;
            if root == v {
                self.states[v] = patches.len() as u32;
                patches.push(Patch { triangles: 0, extent: Extent::default(), bounds: Bounds::EMPTY, first: NONE });
            }
            self.states[v] = self.states[root];
            patches[self.states[root] as usize].bounds.include(&[*position]);
        }
    }
}

/// Whether the (next, previous) pairs around a vertex form a single cycle of at least three in which no corner stands twice: each
/// triangle's previous corner is exactly one other's next. May reorder the pairs.
#[inline]
fn is_closed_fan(around: &mut [[u32; 2]]) -> bool {
    match around.len() {
        0..3 => false,
        3..=SHORT_FAN => short_fan_is_closed(around),
        _ => long_fan_is_closed(around),
    }
}

/// Compares each previous corner with all next ones at once.
#[inline]
fn short_fan_is_closed(around: &[[u32; 2]]) -> bool {
    let mut next = [NONE; SHORT_FAN];
    for (n, t) in next.iter_mut().zip(around) {
        *n = t[0];
    }
    let (mut after, mut seen) = ([0u8; SHORT_FAN], 0u32);
    for (successor, t) in after.iter_mut().zip(around) {
        let equal = (0..SHORT_FAN).fold(0u32, |mask, j| mask | u32::from(next[j] == t[1]) << j);
        // None: a boundary. Two: an edge of more than two triangles.
        if !equal.is_power_of_two() {
            return false;
        }
        *successor = equal.trailing_zeros() as u8;
        seen |= equal;
    }
    if seen + 1 != 1 << around.len() {
        return false;
    }
    // A permutation; it is one cycle when the way back to the start takes all steps.
    let mut at = 0;
    for _ in 1..around.len() {
        at = after[usize::from(at)];
        if at == 0 {
            return false;
        }
    }
    true
}

/// Most triangles of a fan that is tested by comparing all with all; longer ones are sorted.
const SHORT_FAN: usize = 8;

#[cold]
fn long_fan_is_closed(around: &mut [[u32; 2]]) -> bool {
    around.sort_unstable();
    if around.windows(2).any(|w| w[0][0] == w[1][0]) {
        return false;
    }
    let start = around[0][0];
    let mut at = start;
    for step in 1..=around.len() {
        match around.binary_search_by_key(&at, |t| t[0]) {
            Ok(i) => at = around[i][1],
            Err(_) => return false,
        }
        if at == start {
            return step == around.len();
        }
    }
    false
}

/// Exactly collinear (or coincident) corners. Nearly all triangles are told apart by their normal in f32: with differences and
/// products rounded to 2⁻²⁴ each, its error is below 2⁻²¹ of the product of the two sides. What over- or underflows does not pass and
/// is decided exactly. (Written without arrays, which would be stored and loaded again in other widths.)
#[inline]
pub(crate) fn is_collinear(a: &[f32; 3], b: &[f32; 3], c: &[f32; 3]) -> bool {
    let (ux, uy, uz) = (b[0] - a[0], b[1] - a[1], b[2] - a[2]);
    let (vx, vy, vz) = (c[0] - a[0], c[1] - a[1], c[2] - a[2]);
    let (nx, ny, nz) = (uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx);
    let bound = (ux * ux + uy * uy + uz * uz) * (vx * vx + vy * vy + vz * vz) * 1e-12;
    !(nx * nx + ny * ny + nz * nz > bound && bound > f32::MIN_POSITIVE) && is_collinear_exact(a, b, c)
}

#[cold]
fn is_collinear_exact(a: &[f32; 3], b: &[f32; 3], c: &[f32; 3]) -> bool {
    [[0, 1], [1, 2], [2, 0]].iter().all(|[x, y]| {
        let p = |v: &[f32; 3]| robust::Coord { x: f64::from(v[*x]), y: f64::from(v[*y]) };
        robust::orient2d(p(a), p(b), p(c)) == 0.0
    })
}

/// Root of `v`, halving the path.
#[inline]
pub(crate) fn find(parents: &mut [u32], mut v: u32) -> u32 {
    while parents[v as usize] != v {
        let up = parents[parents[v as usize] as usize];
        parents[v as usize] = up;
        v = up;
    }
    v
}

/// The smaller root wins, so that the result does not depend on the order of unions.
#[inline]
pub(crate) fn unite(parents: &mut [u32], a: u32, b: u32) {
    let (a, b) = (find(parents, a), find(parents, b));
    parents[a.max(b) as usize] = a.min(b);
}

#[derive(Default)]
struct LabelWriter {
    bytes: Vec<u8>,
    patch: u32,
    count: u64,
}

impl LabelWriter {
    #[inline]
    fn push(&mut self, patch: u32) {
        if patch != self.patch {
            self.flush();
            self.patch = patch;
        }
        self.count += 1;
    }

    fn flush(&mut self) {
        if self.count > 0 {
            crate::members::put_varint(&mut self.bytes, self.count);
            crate::members::put_varint(&mut self.bytes, u64::from(self.patch.wrapping_add(1)));
        }
        self.count = 0;
    }

    fn finish(mut self) -> Vec<u8> {
        self.flush();
        self.bytes.shrink_to_fit();
        self.bytes
    }
}

impl Labels {
    /// The patch of each member in list order, [`NONE`] where it has none; for [`Labels::One`] always patch 0.
    pub(crate) fn iter(&self) -> impl Iterator<Item = u32> + '_ {
        let mut rest: &[u8] = match self {
            Self::One => &[],
            Self::Runs(bytes) => bytes,
        };
        let (mut left, mut patch) = if matches!(self, Self::One) { (u64::MAX, 0) } else { (0, NONE) };
        std::iter::from_fn(move || {
            if left == 0 {
                left = crate::members::take_varint(&mut rest)?;
                patch = (crate::members::take_varint(&mut rest)? as u32).wrapping_sub(1);
            }
            left -= 1;
            Some(patch)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (next, previous) pairs of `n` triangles around a vertex, corners numbered from `from`, in an order that is not the cycle's.
    fn fan(n: u32, from: u32) -> Vec<[u32; 2]> {
        (0..n).map(|i| i * 7 % n).map(|i| [from + i, from + (i + 1) % n]).collect()
    }

    /// On both sides of the border between the two ways of testing, which is at eight.
    const SIZES: [u32; 4] = [3, 8, 9, 30];

    #[test]
    fn a_closed_fan_is_sound() {
        for n in SIZES {
            assert!(is_closed_fan(&mut fan(n, 0)), "{n}");
        }
        assert!(!is_closed_fan(&mut fan(2, 0)), "two triangles back to back enclose nothing");
    }

    #[test]
    fn a_fan_with_one_fault_is_not() {
        for n in SIZES {
            // A gap.
            let mut missing = fan(n, 0);
            missing.pop();
            assert!(!is_closed_fan(&mut missing), "missing of {n}");
            // An edge of three triangles.
            let mut doubled = fan(n, 0);
            doubled.push(doubled[1]);
            assert!(!is_closed_fan(&mut doubled), "doubled of {n}");
            // Two edges whose triangles disagree.
            let mut turned = fan(n, 0);
            turned[1].reverse();
            assert!(!is_closed_fan(&mut turned), "reversed of {n}");
        }
    }

    #[test]
    fn two_cycles_through_one_vertex_are_not() {
        // Each triangle has exactly one after it, but it is two fans (a bow-tie): only counting the steps tells.
        for (n, m) in [(3, 3), (4, 4), (3, 6), (15, 15)] {
            let mut both = [fan(n, 0), fan(m, n)].concat();
            assert!(!is_closed_fan(&mut both), "{n} and {m}");
        }
        // Both cycles go through corner 0: an edge of four triangles.
        let mut shared = [fan(5, 0), fan(5, 5).iter().map(|t| t.map(|v| if v == 5 { 0 } else { v })).collect()].concat();
        assert!(!is_closed_fan(&mut shared));
    }
}
