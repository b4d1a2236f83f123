//! What an attempt works on: the survey, the submesh, its clusters, and all as it was before.

use crate::contract::report::Region;
use crate::contract::settings::{Bodies, Profile};
use crate::detect::defects;
use crate::geometry::position::Position;
use crate::repairs::boolean::clusters::Clusters;
use crate::repairs::boolean::track::Track;
use crate::repairs::shared::overlay::{Overlay, Standing, Which};
use crate::repairs::shared::region_report::Unsettled;
use crate::repairs::shared::snapshot::Snapshot;
use crate::repairs::shared::work::Work;
use crate::submesh::components::Reversed;
use crate::submesh::{Origin, Submesh, Vertex};
use crate::topology::survey::Survey;
use crate::util::ids::NONE;
use crate::util::scatter::Hashing;
use crate::util::steps;
use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap, HashMap, HashSet};

/// The step of new vertices, against the power of two above the largest coordinate: that of f32 there.
pub(crate) const FINEST: f64 = 1.0 / 16_777_216.0;

/// What is nearer than so many steps of the finest grid, after the first round of cutting, is made one, and so many times farther after every
/// other one; but nothing beyond this share of the power of two above the largest coordinate.
pub(crate) const WIDER: f64 = 4.0;

/// Why crossings are left.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Failure {
    NotArranged,
    Endless,
    Opened,
    Contradiction,
    TooMany,
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::NotArranged => "the triangles that cross could not be cut along each other",
            Self::Endless => "in single precision, cut surfaces cross again and again",
            Self::Opened => "the cut surface would not be closed",
            Self::Contradiction => "the surfaces do not tell what is inside",
            Self::TooMany => "too many triangles come close to each other",
        })
    }
}

/// Why an attempt failed, and triangles of the surfaces that it failed with; none if that is not known.
pub(crate) struct Stuck {
    pub(crate) failure: Failure,
    pub(crate) triangles: Vec<u32>,
}

impl Stuck {
    pub(crate) fn with(failure: Failure) -> Self {
        Self { failure, triangles: Vec::new() }
    }
}

/// Why an attempt ended before its time.
pub(crate) enum Halted {
    Stuck(Stuck),
    /// Whoever waits for it does not want it any more.
    Cancelled,
    /// It would have needed so many bytes.
    NoMemory {
        needed: u64,
        triangles: usize,
    },
}

impl From<Stuck> for Halted {
    fn from(stuck: Stuck) -> Self {
        Self::Stuck(stuck)
    }
}

pub(crate) type Tried<T> = Result<T, Halted>;

/// The mesh before an attempt, to go back to.
pub(crate) struct Before {
    pub(crate) triangles: Snapshot,
    pub(crate) reversed: Reversed,
}

/// Pairs of triangles of the submesh that cross, and what they were found with.
pub(crate) struct Met {
    pub(crate) crossing: Vec<[u32; 2]>,
    pub(crate) overlay: Overlay,
}

/// Counts and measures of the crossings that were resolved.
#[derive(Clone, Debug, Default)]
pub(crate) struct Resolved {
    /// Pairs of triangles that crossed.
    pub(crate) pairs: u64,
    pub(crate) rounds: u32,
    /// Farthest that a new vertex was moved to a place that f32 knows, or to the grid.
    pub(crate) displaced: f64,
    /// Bodies that became part of others, and the volume that counted more than once.
    pub(crate) bodies: u64,
    pub(crate) volume: f64,
    /// Where cutting left bodies that no printer can see, which are dropped.
    pub(crate) dust: Vec<Region>,
    /// The surface was looked at anew: regions have other numbers than before.
    pub(crate) divided: bool,
    /// Why some surfaces were left as they were, and how many of them.
    pub(crate) left: Vec<(Failure, u64)>,
    /// Each cluster that was resolved, and each that was left.
    pub(crate) regions: Vec<Region>,
    pub(crate) regions_left: Vec<Unsettled>,
    /// By triangle of the submesh, as far as it was there before: was its surface closed, and was it not left? Empty: no.
    pub(crate) taken_part: Vec<bool>,
}

impl Resolved {
    pub(crate) fn too_many() -> Self {
        Self { left: vec![(Failure::TooMany, 1)], ..Self::default() }
    }
}

/// The file while it is resolved.
pub(crate) struct State<'a, 'r, 'w> {
    pub(crate) survey: &'a mut Survey<'r>,
    pub(crate) work: &'a mut Work<'w>,
    pub(crate) reversed: &'a mut Reversed,
    pub(crate) before: Before,
    pub(crate) clusters: Clusters,
    pub(crate) track: Track,
    /// Triangles from here on are new ones, but for those that were fetched.
    pub(crate) first_triangle: u32,
    /// Vertices from here on are new ones.
    pub(crate) first_vertex: Vertex,
    /// They are on a grid of this step, but for what is exact in f32.
    pub(crate) step: f64,
}

/// Does with a triangle that was fetched what was done with the region that it belonged to.
pub(crate) fn join_in(work: &mut Work<'_>, reversed: &Reversed, t: u32) {
    let region = work.triangles[t as usize].region;
    if region == NONE {
        return;
    }
    if reversed.dropped[region as usize] {
        work.kill(t);
    } else if reversed.regions[region as usize] {
        work.flip(t);
    }
}

/// Triangles on the same three vertices, by twos: they are in no pair that crosses.
pub(crate) fn coincident(submesh: &Submesh) -> Vec<[u32; 2]> {
    by_twos(&defects::shared_vertex_sets(submesh))
}

/// As [`coincident`], of triangles on the vertices of one of these.
fn coincident_with(submesh: &Submesh, triangles: &[u32]) -> Vec<[u32; 2]> {
    by_twos(&defects::by_vertex_set_of(submesh, triangles))
}

fn by_twos(candidates: &[([Vertex; 3], u32)]) -> Vec<[u32; 2]> {
    let groups = candidates.chunk_by(|a, b| a.0 == b.0);
    groups.flat_map(|group| group.windows(2).map(|two| [two[0].1, two[1].1])).collect()
}

/// The corners of the triangles of some pairs, each once.
pub(crate) fn corners(survey: &Survey<'_>, submesh: &Submesh, overlay: &Overlay, pairs: &[[Standing; 2]]) -> Vec<[f32; 3]> {
    // Most are in several pairs.
    let mut triangles: Vec<Standing> = pairs.as_flattened().to_vec();
    triangles.sort_unstable();
    triangles.dedup();
    let mut positions: Vec<[f32; 3]> =
        triangles.into_iter().flat_map(|number| overlay.corners(survey, submesh, number)).collect();
    positions.sort_unstable_by_key(|p| Position::of(*p));
    positions.dedup();
    positions
}

impl State<'_, '_, '_> {
    /// The pairs that cross now, after these triangles have changed: pairs from before, of which neither has, still do. Where that is kept,
    /// their pieces are to be united.
    pub(crate) fn met(&mut self, before: Vec<[u32; 2]>, profile: &Profile, changed: impl Fn(u32) -> bool + Sync) -> Tried<Met> {
        let too_many = || Stuck::with(Failure::TooMany);
        self.check_closed()?;
        let overlay = Overlay::of(self.survey, self.work, self.reversed).ok_or_else(too_many)?;
        let met = overlay.met_by(self.survey, self.work, &changed).ok_or_else(too_many)?;
        let pairs: Vec<[Standing; 2]> = met.iter().map(|pair| pair.triangles).collect();
        // Others on the same vertices were a pair before, and are as they were.
        let mut asked: Vec<u32> = (0..self.work.triangles.len() as u32).filter(|t| changed(*t)).collect();
        asked.extend(before.as_flattened());
        let coincident = coincident_with(self.work, &asked);
        let mut crossing = self.crossing(&overlay, &pairs, coincident, profile);
        crossing.extend(before.into_iter().filter(|pair| pair.iter().all(|t| self.work.lives(*t) && !changed(*t))));
        crossing.iter_mut().for_each(|pair| pair.sort_unstable());
        crossing.sort_unstable();
        crossing.dedup();
        Ok(Met { crossing, overlay })
    }

    /// These triangles, and with them those whose edges run along edges there: where surfaces pass through each other edge along edge, no two
    /// triangles cross, and yet one side of the one is not one cell. `None` if that is too much work to tell.
    pub(crate) fn with_edges_along(&mut self, overlay: &Overlay, crossing: &BTreeSet<u32>) -> Option<BTreeSet<u32>> {
        let pieces: BTreeSet<u32> = crossing.iter().map(|t| self.clusters.of_triangle[*t as usize]).collect();
        let (mut seen, mut asked): (HashSet<Vertex, Hashing>, HashSet<u32, Hashing>) = Default::default();
        grown(crossing, |fresh| {
            let corners: BTreeSet<Vertex> = fresh.iter().flat_map(|t| self.work.triangles[*t as usize].v).collect();
            let corners = corners.into_iter().filter(|v| seen.insert(*v));
            let around: BTreeSet<u32> = corners.flat_map(|v| self.work.star(v)).map(|(t, _)| t).collect();
            let new: Vec<u32> = around.into_iter().filter(|t| self.clusters.holds(*t) && asked.insert(*t)).collect();
            if new.is_empty() {
                return Some(Vec::new());
            }
            let pairs = overlay.edges_along(self.survey, self.work, &new)?;
            let pairs = self.in_submesh(overlay, &pairs);
            let crosses = |t: &u32| pieces.contains(&self.clusters.of_triangle[*t as usize]);
            Some(pairs.into_iter().filter(|pair| pair.iter().all(crosses)).flatten().collect())
        })
    }

    /// The pairs of triangles that take part, in the submesh; where bodies are to be kept, only of one and the same.
    /// `coincident`: those on the same vertices.
    pub(crate) fn crossing(
        &mut self,
        overlay: &Overlay,
        pairs: &[[Standing; 2]],
        coincident: Vec<[u32; 2]>,
        profile: &Profile,
    ) -> Vec<[u32; 2]> {
        let mut crossing = self.in_submesh(overlay, pairs);
        crossing.extend(coincident);
        crossing.retain(|pair| {
            let [a, b] = pair.map(|t| self.clusters.of_triangle[t as usize]);
            self.clusters.takes_part(a) && self.clusters.takes_part(b) && (profile.bodies != Bodies::Keep || a == b)
        });
        crossing
    }

    /// The pieces of these pairs are of one cluster from now on.
    pub(crate) fn unite(&mut self, crossing: &[[u32; 2]]) {
        for pair in crossing {
            let [a, b] = pair.map(|t| self.clusters.of_triangle[t as usize]);
            crate::util::union_find::unite(&mut self.clusters.parents, a, b);
        }
    }

    /// Pairs of triangles as the submesh numbers them, where they are fetched to if need be, with all around them.
    pub(crate) fn in_submesh(&mut self, overlay: &Overlay, pairs: &[[Standing; 2]]) -> Vec<[u32; 2]> {
        let is_here = |number: &Standing| {
            overlay
                .changed_of(*number)
                .is_some_and(|t| self.work.triangles[t as usize].v.iter().all(|v| self.work.complete[*v as usize]))
        };
        let missing: Vec<[Standing; 2]> = pairs.iter().filter(|pair| !pair.iter().all(is_here)).copied().collect();
        self.complete(corners(self.survey, self.work, overlay, &missing));
        let wanted = pairs.as_flattened().iter().filter_map(|number| overlay.record_of(*number));
        let mut of_record: HashMap<u32, u32, Hashing> = wanted.map(|record| (record, NONE)).collect();
        if !of_record.is_empty() {
            for t in self.work.living() {
                if let Origin::Input(record) = self.work.triangles[t as usize].origin
                    && let Some(there) = of_record.get_mut(&record)
                {
                    *there = t;
                }
            }
        }
        let triangle = |number: Standing| match overlay.which(number) {
            Which::Submesh(t) => Some(t),
            Which::Record(record) => of_record.get(&record).copied().filter(|t| *t != NONE),
        };
        pairs.iter().filter_map(|[a, b]| Some([triangle(*a)?, triangle(*b)?])).collect()
    }

    /// Fetches the stars of the vertices at these positions that are not here.
    pub(crate) fn complete(&mut self, mut positions: Vec<[f32; 3]>) {
        positions.sort_unstable_by_key(|p| Position::of(*p));
        positions.dedup();
        let known = self.work.by_position_of(positions.iter().copied().map(Position::of));
        positions.retain(|p| known.get(&Position::of(*p)).is_none_or(|v| !self.work.complete[*v as usize]));
        if positions.is_empty() {
            return;
        }
        let new = self.survey.promote(&positions);
        let first = self.work.extend_at(self.survey, &new, &positions);
        for t in first..self.work.triangles.len() as u32 {
            let mut triangle = self.work.triangles[t as usize];
            let region = triangle.region;
            self.clusters.of_triangle.push(if region == NONE { NONE } else { self.clusters.of_region[region as usize] });
            join_in(self.work, self.reversed, t);
            // They are no part of their region any more, whatever becomes of the attempt.
            if region != NONE {
                if self.before.reversed.regions[region as usize] {
                    triangle.turn();
                }
                triangle.alive = !self.before.reversed.dropped[region as usize];
            }
            self.before.triangles.push(triangle);
        }
    }

    /// Triangles that came without a surface are of that of the record that they are parts of; those of regions, of that of a neighbour.
    pub(crate) fn follow(&mut self) {
        let first = self.clusters.of_triangle.len();
        let all = self.work.triangles.len();
        let mut left: Vec<usize> = (first..all).collect();
        if left.is_empty() {
            return;
        }
        let record = |t: usize| match self.work.triangles[t].origin {
            Origin::Input(record) | Origin::Part(record) => Some(record),
            Origin::Added(_) => None,
        };
        let wanted: HashSet<u32, Hashing> = left.iter().filter_map(|t| record(*t)).collect();
        let known = (0..first).filter_map(|t| Some((record(t).filter(|r| wanted.contains(r))?, self.clusters.of_triangle[t])));
        let piece_of: HashMap<u32, u32, Hashing> = known.filter(|(_, piece)| *piece != NONE).collect();
        let pieces = left.iter().map(|t| record(*t).and_then(|r| piece_of.get(&r).copied()).unwrap_or(NONE));
        self.clusters.of_triangle.extend(pieces.collect::<Vec<_>>());
        left.retain(|t| self.clusters.of_triangle[*t] == NONE);
        follow_neighbours(self.work, &left, &mut self.clusters.of_triangle);
    }

    /// Every edge of what takes part must be used as often in one direction as in the other. They were at a mark of the submesh, if there is one.
    pub(crate) fn check_closed(&mut self) -> Tried<()> {
        let holds = |t: u32| self.clusters.holds(t);
        if self.work.edges_since_mark().is_some_and(|edges| edges.into_iter().all(|ends| is_closed_at(self.work, ends, holds))) {
            return Ok(());
        }
        let mut triangles = Vec::new();
        let (_, edges) = self.work.edges();
        for edge in edges.iter().filter(|edge| edge.uses.len() != 2 || edge.is_unbalanced()) {
            let own = || edge.uses.iter().filter(|used| self.clusters.holds(used.triangle()));
            let balance: i64 = own().map(|used| if used.forward() { 1 } else { -1 }).sum();
            if balance != 0 {
                triangles.extend(own().map(|used| used.triangle()));
            }
        }
        if triangles.is_empty() { Ok(()) } else { Err(Stuck { failure: Failure::Opened, triangles }.into()) }
    }
}

/// Is an edge used as often in one direction as in the other by the triangles that are held? What has no complete end, or two triangles in both
/// directions, is not asked about.
fn is_closed_at(submesh: &Submesh, [a, b]: [Vertex; 2], holds: impl Fn(u32) -> bool) -> bool {
    if !submesh.complete[a as usize] && !submesh.complete[b as usize] {
        return true;
    }
    let (mut all, mut held, mut count) = (0, 0, 0);
    for t in submesh.at_edge(a, b) {
        let v = submesh.triangles[t as usize].v;
        let way = if [(v[0], v[1]), (v[1], v[2]), (v[2], v[0])].contains(&(a, b)) { 1 } else { -1 };
        (all, count) = (all + way, count + 1);
        held += if holds(t) { way } else { 0 };
    }
    held == 0 || count == 2 && all == 0
}

/// Gives each of these triangles, ascending, the smallest piece of the triangles at its corners, and so on from neighbour to neighbour. They
/// have their turns in rounds, each in their order, as soon as a neighbour has a piece. O(stars · log).
pub(crate) fn follow_neighbours(submesh: &Submesh, left: &[usize], piece_of: &mut [u32]) {
    let mut waiting: HashMap<Vertex, Vec<usize>> = HashMap::new();
    // By vertex the smallest piece around it.
    let mut least: HashMap<Vertex, u32> = HashMap::new();
    let mut turns: BinaryHeap<Reverse<(u32, usize)>> = BinaryHeap::new();
    for t in left {
        for v in submesh.triangles[*t].v {
            waiting.entry(v).or_default().push(*t);
            let around = || submesh.star(v).map(|(o, _)| piece_of[o as usize]).min().unwrap_or(NONE);
            if *least.entry(v).or_insert_with(around) != NONE {
                turns.push(Reverse((0, *t)));
            }
        }
    }
    while let Some(Reverse((round, t))) = turns.pop() {
        steps::count(1);
        if piece_of[t] != NONE {
            continue;
        }
        let v = submesh.triangles[t].v;
        let piece = v.iter().filter_map(|v| least.get(v)).min().copied().unwrap_or(NONE);
        piece_of[t] = piece;
        // A dead triangle is nobody's neighbour.
        for v in v.iter().filter(|_| submesh.lives(t as u32)) {
            let least = least.entry(*v).or_insert(NONE);
            if *least == NONE {
                let waiting = waiting.remove(v).unwrap_or_default();
                turns.extend(waiting.into_iter().map(|o| Reverse((round + u32::from(o <= t), o))));
            }
            *least = piece.min(*least);
        }
    }
}

/// These triangles and all that `beside` finds beside new ones, until there are none. `beside` is asked once about each triangle.
pub(crate) fn grown(start: &BTreeSet<u32>, mut beside: impl FnMut(&[u32]) -> Option<Vec<u32>>) -> Option<BTreeSet<u32>> {
    let mut all = start.clone();
    let mut fresh: Vec<u32> = start.iter().copied().collect();
    while !fresh.is_empty() {
        steps::count(fresh.len());
        fresh = beside(&fresh)?;
        fresh.retain(|t| all.insert(*t));
    }
    Some(all)
}
