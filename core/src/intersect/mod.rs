//! The pairs of triangles of one chunk that intersect, decided exactly.
//!
//! A mesh intersects itself where two of its triangles meet beyond what they share, along a segment inside one of them or in
//! an area ([`Contact::is_crossing`]). What a chunk sees of the mesh is all triangles with a corner in its cell, and *visitors*, whose
//! box meets the cell without a corner in it. Every pair is **owned** by one cell, which decides it, so results do not depend on how
//! space was cut:
//!
//! * a pair that shares vertices by the cell where the lexicographically smallest of them is at home: all triangles around it are
//!   members there;
//! * a pair that shares none by the cell of the lowest corner of the overlap of their boxes: that point lies in both boxes, so
//!   both triangles are there, as members or visitors.
//!
//! In the order of the work: [`stars`] certifies vertices none of whose triangles can meet, [`tree`] finds pairs of overlapping
//! boxes, [`narrow`] separates what is clearly apart, and what is left is decided by exact predicates.
//!
//! Work can be quadratic in the size of a defect (a thousand copies of one triangle are half a million pairs), so pairs are
//! counted. A pair counts when its boxes overlap and it shares no vertex, or the smallest vertex it shares is not certified: a
//! property of the mesh. The owner counts it.

mod narrow;
mod stars;
#[cfg(test)]
mod tests;
mod tree;

use crate::chunk::NONE;
use crate::fill::cross::{Contact, self_intersection};
use crate::plan::HomeBox;
use narrow::Round;
use stars::Stars;
use tree::{Forest, Row, Visit, Walk};

pub(crate) use tree::bits;

/// What one cell sees of a mesh. All coordinates are finite, −0.0 does not occur.
pub(crate) struct Region<'a> {
    pub(crate) positions: &'a [[f32; 3]],
    /// Members in input order, then visitors. A triangle with a repeated vertex has [`NONE`] first and is left out.
    pub(crate) triangles: &'a [[u32; 3]],
    /// The exactly collinear ones, ascending; left out too.
    pub(crate) left_out: &'a [u32],
    /// By vertex.
    pub(crate) standing: &'a [Standing],
    pub(crate) cell: HomeBox,
}

/// What a cell knows of a vertex.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u8)]
pub(crate) enum Standing {
    /// At home in another cell.
    Away,
    /// At home here, and not sound.
    Unsound,
    /// At home here, in the middle of a closed, coherent fan without collinear triangles.
    Sound,
}

impl Region<'_> {
    #[inline(always)]
    fn corners(&self, t: [u32; 3]) -> [[f32; 3]; 3] {
        let [a, b, c] = t;
        [self.positions[a as usize], self.positions[b as usize], self.positions[c as usize]]
    }

    /// The triangles that are not left out, with their numbers.
    #[inline]
    fn solid_triangles(&self) -> impl Iterator<Item = (u32, [u32; 3])> {
        let mut left_out = self.left_out.iter().copied();
        let mut next = left_out.next().unwrap_or(NONE);
        self.triangles.iter().enumerate().filter_map(move |(i, t)| {
            if i as u32 == next {
                next = left_out.next().unwrap_or(NONE);
                return None;
            }
            (t[0] != NONE).then_some((i as u32, *t))
        })
    }
}

/// What is known of a vertex.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum State {
    /// At home in another cell.
    Away,
    /// At home here, and no two triangles around it meet beyond what they share.
    Certified,
    /// At home here, and nothing is known.
    Open,
}

/// Finds the self-intersections of one region after the other, and keeps its memory.
#[derive(Default)]
pub(crate) struct Finder {
    stars: Stars,
    states: Vec<State>,
    forest: Forest,
    waiting: Vec<[u32; 2]>,
    by_vertex: Vec<(u32, u32)>,
}

/// Bytes that a [`Finder`] takes for each triangle of a region: two rows, two keys, a group and boxes of the tree, 32 + 32 + 16 + 4 + 64,
/// and for up to three vertices each a view, a state and a turn.
pub(crate) const BYTES_PER_TRIANGLE: u64 = 148 + 3 * (size_of::<stars::View>() as u64 + 3);

/// Pairs that wait until they are separated four at a time.
const WAITING: usize = 256;

impl Finder {
    /// Calls `found` for each self-intersecting pair that the region's cell owns, once, the smaller number first; in an order that
    /// depends on the region. Returns how many pairs were counted; if they are more than `allowance`, it ended early.
    ///
    /// O(n log n) besides the pairs of overlapping boxes, of which those around a certified vertex and around a vertex of more
    /// than 256 triangles that is at home elsewhere cost nothing.
    pub(crate) fn pairs(&mut self, region: &Region<'_>, allowance: u64, mut found: impl FnMut(u32, u32, Contact)) -> u64 {
        self.stars.look(region);
        self.states.clear();
        self.states.extend(region.standing.iter().enumerate().map(|(v, standing)| match standing {
            Standing::Away => State::Away,
            Standing::Sound if self.stars.is_certified(v) => State::Certified,
            Standing::Sound | Standing::Unsound => State::Open,
        }));
        self.forest.build(region, &self.stars, &self.states);
        self.waiting.clear();
        let mut search = Search {
            region,
            states: &self.states,
            rows: &self.forest.rows,
            waiting: &mut self.waiting,
            counted: 0,
            allowance,
            found: &mut found,
        };
        let walked = Walk::new(&self.forest, &mut search).all();
        search.separate();
        if walked {
            search.around_hubs(&self.forest, &mut self.by_vertex);
        }
        search.counted
    }
}

/// What becomes of overlapping boxes.
struct Search<'a, F> {
    region: &'a Region<'a>,
    states: &'a [State],
    rows: &'a [Row],
    /// Rows that overlap, without a common vertex.
    waiting: &'a mut Vec<[u32; 2]>,
    counted: u64,
    allowance: u64,
    found: &'a mut F,
}

impl<F: FnMut(u32, u32, Contact)> Visit for Search<'_, F> {
    #[inline]
    fn visit(&mut self, row: usize, first: usize, lanes: u32, sharing: u32) -> bool {
        for j in bits(lanes & !sharing) {
            self.waiting.push([row as u32, (first + j) as u32]);
        }
        // A vertex that both have and that is not open is away, so the pair is not owned here, or certified, so it is apart.
        if lanes & sharing != 0 && self.rows[row].is_open() {
            for j in bits(lanes & sharing) {
                self.sharing(self.rows[row].triangle, self.rows[first + j].triangle, NONE);
            }
        }
        if self.waiting.len() >= WAITING {
            self.separate();
        }
        self.counted <= self.allowance
    }
}

impl<F: FnMut(u32, u32, Contact)> Search<'_, F> {
    /// A pair of overlapping boxes with vertices in common. With `only`, nothing is done if another vertex is the smallest.
    fn sharing(&mut self, i: u32, j: u32, only: u32) {
        let [s, t] = [i, j].map(|i| self.region.triangles[i as usize]);
        let shared = || s.iter().filter(|v| t.contains(v));
        let position = |v: u32| self.region.positions[v as usize];
        let smallest = shared().copied().reduce(|u, v| if position(v) < position(u) { v } else { u });
        let Some(smallest) = smallest.filter(|v| only == NONE || *v == only) else { return };
        if self.states[smallest as usize] != State::Open {
            return;
        }
        self.counted += 1;
        if !shared().any(|v| self.states[*v as usize] == State::Certified) {
            let common = [s.map(|v| t.contains(&v)), t.map(|v| s.contains(&v))];
            self.decide(i, j, common);
        }
    }

    /// The pairs within each hub's tree whose smallest vertex is not the hub. That vertex is open; the hub is certified, or
    /// away and larger.
    fn around_hubs(&mut self, forest: &Forest, by_vertex: &mut Vec<(u32, u32)>) {
        for tree in forest.trees.iter().filter(|t| t.hub != NONE) {
            by_vertex.clear();
            for row in tree.rows.clone() {
                for v in self.region.triangles[forest.rows[row].triangle as usize] {
                    let smaller = self.region.positions[v as usize] < self.region.positions[tree.hub as usize];
                    if smaller && self.states[v as usize] == State::Open {
                        by_vertex.push((v, row as u32));
                    }
                }
            }
            by_vertex.sort_unstable();
            for around in by_vertex.chunk_by(|a, b| a.0 == b.0) {
                for (k, (v, row)) in around.iter().enumerate() {
                    let one = &forest.rows[*row as usize];
                    for (_, other) in &around[k + 1..] {
                        let other = &forest.rows[*other as usize];
                        if one.overlaps(other) {
                            self.sharing(one.triangle, other.triangle, *v);
                        }
                    }
                    if self.counted > self.allowance {
                        return;
                    }
                }
            }
        }
    }

    /// Counts and decides those waiting pairs that are owned here; none of them shares a vertex. What stays after each round
    /// closes up to fours.
    #[inline(never)]
    fn separate(&mut self) {
        let mut waiting = std::mem::take(self.waiting);
        let mut owned = 0;
        for k in 0..waiting.len() {
            let [one, other] = waiting[k].map(|row| &self.rows[row as usize]);
            waiting[owned] = [one.triangle, other.triangle];
            owned += usize::from(one.owns_lowest_corner(other) && one.same_plane(other));
        }
        waiting.truncate(owned);
        self.counted += owned as u64;
        for round in [Round::Planes, Round::Edges] {
            let mut kept = 0;
            for start in (0..waiting.len()).step_by(4) {
                let end = waiting.len().min(start + 4);
                let pair = |k: usize| {
                    let [i, j] = waiting[(start + k).min(end - 1)];
                    let [s, t] = [self.region.triangles[i as usize], self.region.triangles[j as usize]];
                    [s[0], s[1], s[2], t[0], t[1], t[2]].map(|v| &self.region.positions[v as usize])
                };
                let apart = narrow::apart(&[pair(0), pair(1), pair(2), pair(3)], round);
                for k in start..end {
                    waiting[kept] = waiting[k];
                    kept += usize::from(apart >> (k - start) & 1 == 0);
                }
            }
            waiting.truncate(kept);
        }
        for [i, j] in waiting.drain(..) {
            self.decide(i, j, [[false; 3]; 2]);
        }
        *self.waiting = waiting;
    }

    #[inline(always)]
    fn corners(&self, i: u32) -> [[f32; 3]; 3] {
        self.region.corners(self.region.triangles[i as usize])
    }

    /// Exactly. `common`: which corners of each are also corners of the other.
    fn decide(&mut self, i: u32, j: u32, common: [[bool; 3]; 2]) {
        if let Some(contact) = self_intersection(&self.corners(i), &self.corners(j), common) {
            (self.found)(i.min(j), i.max(j), contact);
        }
    }
}
