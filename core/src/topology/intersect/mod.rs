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
//! In the order of the work: [`stars`] and [`hubs`] certify vertices none of whose triangles can meet, [`tree`] and [`walk`] find pairs of overlapping
//! boxes (where these select badly, by [`slabs`] as well), [`narrow`] finds what is clearly apart or clearly crosses, and what is left is decided by exact predicates.
//!
//! Work can be quadratic in the size of a defect, so pairs are counted. A pair counts when its boxes overlap and it shares no
//! vertex, or the smallest vertex it shares is not certified: a property of the mesh. The owner counts it. Of triangles of the same three
//! vertices ([`copies`]) one is looked at for all, and each of the others counts as one pair.

mod copies;
mod curve;
mod hubs;
mod lanes;
mod narrow;
mod real;
mod slabs;
mod stars;
#[cfg(test)]
mod tests;
mod tree;
mod upward;
mod view;
mod walk;

use crate::geometry::axis::Axis;
use crate::geometry::tri_tri::Contact;
use crate::util::ids::NONE;
use copies::Copies;
use lanes::{Lanes, Pairs};
use narrow::Neighbours;
use stars::Stars;
use tree::Forest;
use view::State;
pub(crate) use view::{CellView, Standing};
use walk::{Visit, Walk};

pub(crate) use lanes::bits;
pub(crate) use narrow::leave_out_apart;

/// Pairs with common vertices that are gathered before they are decided.
const NEIGHBOURS: usize = 128;

/// How far a search goes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    /// Pairs that may be counted.
    pub(crate) allowance: u64,
    /// Boxes select badly: a pair counts, and is tested, only if its [`slabs`] overlap, too. More work for each triangle, and less for each
    /// pair.
    pub(crate) askew: bool,
    /// A line around which triangles may lie at different angles, if askew.
    pub(crate) around: Option<Axis>,
}

impl Effort {
    /// Each pair whose boxes overlap.
    pub(crate) const ALL: Self = Self { allowance: u64::MAX, askew: false, around: None };
}

/// More than any search allows, so few that no sum of it is too large for a number.
const TOO_MANY: u64 = 1 << 40;

/// Pairs that a cell may come across that others own, beside 64 for each triangle, before boxes are said to select badly.
const MOST_BESIDE: u64 = 1 << 22;

/// Finds the self-intersections of one view after the other, and keeps its memory.
#[derive(Default)]
pub(crate) struct Finder {
    stars: Stars,
    states: Vec<State>,
    forest: Forest,
    copies: Copies,
    waiting: Pairs,
    neighbours: Vec<Neighbours>,
    by_vertex: Vec<(u32, u32)>,
}

/// Bytes that a [`Finder`] takes for each triangle of a view: its part of the tree, and of the copies.
pub(crate) const BYTES_PER_TRIANGLE: u64 = tree::BYTES_PER_TRIANGLE + copies::BYTES_PER_TRIANGLE;

/// A look at hubs takes no more, and these are not there meanwhile.
const _: () = assert!(hubs::BYTES_PER_TRIANGLE <= BYTES_PER_TRIANGLE);

/// And, if askew, its slabs.
pub(crate) const SLAB_BYTES_PER_TRIANGLE: u64 = tree::SLAB_BYTES_PER_TRIANGLE;

/// And for each vertex a view, a standing, a state and a turn.
pub(crate) const BYTES_PER_VERTEX: u64 = size_of::<stars::View>() as u64 + 3;

impl Finder {
    /// Calls `found` for the self-intersecting pairs that the view's cell owns, each once, in an order that depends on the view: for
    /// those of one of the first triangles with one of the others, or if there are no others, for each two of the first; both lists
    /// ascend. Returns how many pairs were counted; if they are more than allowed, it ended early. What is found does not depend on whether the search is `askew`, what is counted does.
    ///
    /// O(n log n) besides the pairs of overlapping boxes, of which those around a certified vertex and around a vertex of more
    /// than 256 triangles that is at home elsewhere cost nothing.
    pub(crate) fn pairs(&mut self, view: &CellView<'_>, effort: Effort, mut found: impl FnMut(&[u32], &[u32], Contact)) -> u64 {
        self.prepare(view);
        if effort.askew {
            self.forest.add_slabs(view, effort.around.as_ref());
        }
        let copies = &self.copies;
        let mut each = |i: u32, j: u32, contact: Contact| {
            found(copies.of(i).unwrap_or(&[i]), copies.of(j).unwrap_or(&[j]), contact);
        };
        self.waiting.clear();
        self.neighbours.clear();
        let mut search = Search {
            view,
            states: &self.states,
            forest: &self.forest,
            waiting: &mut self.waiting,
            neighbours: &mut self.neighbours,
            counted: 0,
            allowance: effort.allowance,
            beside: 0,
            most_beside: if effort.askew { u64::MAX } else { MOST_BESIDE + 64 * view.triangles.len() as u64 },
            found: &mut each,
        };
        let walked = if self.forest.has_slabs() {
            Walk::<_, true>::new(&self.forest, &mut search).all()
        } else {
            Walk::<_, false>::new(&self.forest, &mut search).all()
        };
        search.separate();
        if walked {
            search.around_hubs(&self.forest, &mut self.by_vertex);
        }
        search.decide_neighbours();
        let mut counted = search.counted;
        for same in copies.groups() {
            let smallest = view.triangles[same[0] as usize].into_iter().min_by(|v, w| by_position(view, *v, *w));
            if smallest.is_some_and(|v| self.states[v as usize] == State::Open) {
                counted += same.len() as u64 - 1;
                found(same, &[], Contact::Overlap);
            }
        }
        counted
    }

    /// The triangles of the same vertices in the last view: pairs are found for all of a group, or for none.
    pub(crate) fn copies(&self) -> &Copies {
        &self.copies
    }
}

fn by_position(view: &CellView<'_>, v: u32, w: u32) -> std::cmp::Ordering {
    view.positions[v as usize].partial_cmp(&view.positions[w as usize]).unwrap_or(std::cmp::Ordering::Equal)
}

/// What comes before the walk, compiled for different processors. Sums and products are the same on all of them: in the same order,
/// and none fused.
impl Finder {
    #[cold]
    fn look_at_doubtful(&mut self, view: &CellView<'_>, hubs: &[u32]) {
        (self.forest, self.copies) = Default::default();
        self.stars.settle(hubs, &hubs::look(view, hubs));
    }

    fn prepare(&mut self, view: &CellView<'_>) {
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512vl") && is_x86_feature_detected!("avx512bw")
            {
                // SAFETY: the processor has what it is compiled for.
                return unsafe { self.prepare_avx512(view) };
            }
            if is_x86_feature_detected!("avx2") {
                // SAFETY: as above.
                return unsafe { self.prepare_avx2(view) };
            }
        }
        self.prepare_by(view);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f,avx512vl,avx512bw")]
    fn prepare_avx512(&mut self, view: &CellView<'_>) {
        self.prepare_by(view);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn prepare_avx2(&mut self, view: &CellView<'_>) {
        self.prepare_by(view);
    }

    #[inline(always)]
    fn prepare_by(&mut self, view: &CellView<'_>) {
        self.stars.look(view);
        let doubtful = self.stars.doubtful_hubs(view);
        if !doubtful.is_empty() {
            self.look_at_doubtful(view, &doubtful);
        }
        self.states.clear();
        self.states.extend(view.standing.iter().enumerate().map(|(v, standing)| match standing {
            Standing::Away => State::Away,
            Standing::Regular if self.stars.is_certified(v) => State::Certified,
            Standing::Irregular if self.stars.is_hub(v) && self.stars.is_certified(v) => State::Certified,
            Standing::Regular | Standing::Irregular => State::Open,
        }));
        self.forest.build(view, &self.stars, &self.states, &mut self.copies);
    }
}

/// The vertices of each triangle that are also vertices of the other.
#[inline(always)]
fn common_vertices(s: [u32; 3], t: [u32; 3]) -> [[bool; 3]; 2] {
    let among = |v: u32, t: [u32; 3]| (v == t[0]) | (v == t[1]) | (v == t[2]);
    [[among(s[0], t), among(s[1], t), among(s[2], t)], [among(t[0], s), among(t[1], s), among(t[2], s)]]
}

/// What becomes of overlapping boxes.
struct Search<'a, F> {
    view: &'a CellView<'a>,
    states: &'a [State],
    forest: &'a Forest,
    /// Rows that overlap, without a common vertex.
    waiting: &'a mut Pairs,
    /// Pairs with one or two common vertices.
    neighbours: &'a mut Vec<Neighbours>,
    counted: u64,
    allowance: u64,
    /// Pairs that overlap here and are owned elsewhere; of more than most, all count.
    beside: u64,
    most_beside: u64,
    found: &'a mut F,
}

impl<F: FnMut(u32, u32, Contact)> Visit for Search<'_, F> {
    #[inline(always)]
    fn visit(&mut self, with: impl Lanes, row: usize, first: usize, lanes: u32, sharing: u32) -> bool {
        if lanes & !sharing != 0 {
            with.append(self.waiting, row as u32, first as u32, lanes & !sharing);
        }
        // A vertex that both have and that is not open is away, so the pair is not owned here, or certified, so it is apart.
        if lanes & sharing != 0 && self.forest.is_open(row) {
            self.all_sharing(row, first, lanes & sharing);
        }
        if self.waiting.is_full() {
            self.separate();
        }
        self.counted <= self.allowance
    }
}

impl<F: FnMut(u32, u32, Contact)> Search<'_, F> {
    #[inline(never)]
    fn all_sharing(&mut self, row: usize, first: usize, lanes: u32) {
        for j in bits(lanes) {
            self.sharing(self.forest.triangle(row), self.forest.triangle(first + j), NONE);
        }
    }

    /// A pair of overlapping boxes with vertices in common. With `only`, nothing is done if another vertex is the smallest.
    fn sharing(&mut self, i: u32, j: u32, only: u32) {
        let [s, t] = [i, j].map(|i| self.view.triangles[i as usize]);
        let common = common_vertices(s, t);
        let position = |v: u32| self.view.positions[v as usize];
        let (mut smallest, mut first, mut count, mut certified) = (NONE, 0, 0, false);
        for k in (0..3).filter(|k| common[0][*k]) {
            if count == 0 || position(s[k]) < position(smallest) {
                (smallest, first) = (s[k], k);
            }
            certified |= self.states[s[k] as usize] == State::Certified;
            count += 1;
        }
        if count == 0 || (only != NONE && smallest != only) || self.states[smallest as usize] != State::Open {
            return;
        }
        self.counted += 1;
        if certified {
            return;
        }
        if count == 3 {
            return self.view.decide(i, j, common, self.found);
        }
        let apart_from_s = |order: [usize; 3]| order.into_iter().find(|k| !common[1][*k]).map_or(NONE, |k| t[k]);
        let (next, last) = (apart_from_s([0, 1, 2]), apart_from_s([2, 1, 0]));
        let vertices = [[s[first], s[(first + 1) % 3], s[(first + 2) % 3]], [smallest, next, last]];
        self.neighbours.push(Neighbours { triangles: [i, j], vertices });
        if self.neighbours.len() == NEIGHBOURS {
            self.decide_neighbours();
        }
    }

    /// Decides the waiting pairs with one or two common vertices.
    #[inline(never)]
    fn decide_neighbours(&mut self) {
        let Self { view, neighbours, found, .. } = self;
        let [crossing, unsure] = narrow::sort(view, neighbours);
        for Neighbours { triangles: [i, j], .. } in &neighbours[..crossing] {
            found(*i.min(j), *i.max(j), Contact::Cross);
        }
        for Neighbours { triangles: [i, j], .. } in &neighbours[crossing..crossing + unsure] {
            let [s, t] = [i, j].map(|i| view.triangles[*i as usize]);
            view.decide(*i, *j, common_vertices(s, t), found);
        }
        neighbours.clear();
    }

    /// The pairs within each hub's tree whose smallest vertex is not the hub. That vertex is open; the hub is certified, or
    /// away and larger.
    fn around_hubs(&mut self, forest: &Forest, by_vertex: &mut Vec<(u32, u32)>) {
        for tree in forest.trees.iter().filter(|t| t.hub != NONE) {
            by_vertex.clear();
            for row in tree.rows.clone() {
                for v in self.view.triangles[forest.triangle(row) as usize] {
                    let smaller = self.view.positions[v as usize] < self.view.positions[tree.hub as usize];
                    if smaller && self.states[v as usize] == State::Open {
                        by_vertex.push((v, row as u32));
                    }
                }
            }
            by_vertex.sort_unstable();
            for around in by_vertex.chunk_by(|a, b| a.0 == b.0) {
                for (k, (v, row)) in around.iter().enumerate() {
                    let row = *row as usize;
                    for other in around[k + 1..].iter().map(|(_, row)| *row as usize) {
                        if forest.overlap(row, other) {
                            self.sharing(forest.triangle(row), forest.triangle(other), *v);
                        }
                    }
                    if self.counted > self.allowance {
                        return;
                    }
                }
            }
        }
    }

    /// Counts and decides those waiting pairs that are owned here; none of them shares a vertex.
    #[inline(never)]
    fn separate(&mut self) {
        let Self { view, forest, waiting, found, .. } = self;
        let pairs = waiting.as_mut_slice();
        let mut owned = 0;
        for k in 0..pairs.len() {
            let [row, other] = pairs[k].map(|row| row as usize);
            pairs[owned] = [forest.triangle(row), forest.triangle(other)];
            owned += usize::from(forest.owns_pair(row, other));
        }
        self.counted += owned as u64;
        self.beside += (pairs.len() - owned) as u64;
        if self.beside > self.most_beside {
            self.counted = TOO_MANY;
        }
        let [crossing, unsure] = narrow::sort(view, &mut pairs[..owned]);
        for [i, j] in &pairs[..crossing] {
            found(*i.min(j), *i.max(j), Contact::Cross);
        }
        for [i, j] in &pairs[crossing..crossing + unsure] {
            view.decide(*i, *j, [[false; 3]; 2], found);
        }
        waiting.clear();
    }
}
