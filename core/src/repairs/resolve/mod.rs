//! Crossings: bodies that cross each other, or themselves, become one.
//!
//! The triangles that cross something, and their neighbours, are cut along everything they meet ([`cut`], [`crate::geometry::arrange`]). Cells of space in
//! front of and behind their pieces, the other triangles of the workshop and the patches of sound surface are one where these join
//! ([`sides`]); behind each of them the winding number is larger by one than in front. One exact winding number a connected surface (`bodies`)
//! makes all of them known. Material is where the winding number is positive (Jacobson et al. 2013; Zhou et al. 2016): what has it on one
//! side only stays, so that a body inside out comes right and what lies inside of another one goes, whole patches as bits of the edit ([`embed`]).
//!
//! Where the surface was cut, new vertices are rounded to f32. Triangles that come to nothing by that leave every directed edge balanced, and
//! what crosses after it is resolved in the next round, with what it crosses, from the f32 coordinates. (Near zero f32 has places far closer to
//! each other than elsewhere, which are of no use: no place is finer than those at the file's largest coordinate, but for what has its place
//! exactly.) Before each round, features that are nearly one there are made one ([`near`]), the nearer the sooner, so that f32 has room
//! between those that are left (the iterated snap rounding of Valque & Lazard, SGP 2025, and CGAL 6.1 brings vertices to a coarser grid
//! instead, with 31 more bits). Rounds are counted, so that time decides nothing.
//!
//! Sheets that are open bound no material, and what crosses only them is left alone. Surfaces that cross each other, directly or by others, are a
//! **cluster**: one that contradicts itself (it says two things about a cell), does not come to an end or would not be closed is left as
//! it was, and the others are resolved without it.

mod cut;
mod dust;
mod embed;
mod near;
mod passes;
mod refill;
mod sides;
mod spread;
#[cfg(test)]
mod tests;
mod track;

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap, HashMap, HashSet};
use std::path::Path;

use self::cut::Cut;
pub(super) use self::refill::{Refill, refill_of};
use self::sides::Sides;
use self::spread::Level;
use self::track::Track;
use super::orient;
use super::overlay::Overlay;
use super::regions::Unsettled;
use super::work::Work;
use crate::contract::error::{Error, Result};
use crate::contract::progress::Progress;
use crate::contract::report::Region;
use crate::contract::settings::{Bodies, Limits, Profile};
use crate::detect::defects;
use crate::geometry::arrange::Arrange;
use crate::geometry::boxes;
use crate::geometry::position::Position;
use crate::geometry::sums::{Bounds, Extent};
use crate::submesh::components::{Component, Components, Reversed};
use crate::submesh::{Origin, Shop, Triangle, Vertex};
use crate::topology::survey::{Division, Survey};
use crate::util::steps;
use crate::util::union_find::NONE;

/// What was resolved.
#[derive(Clone, Debug, Default)]
pub(super) struct Resolved {
    /// Pairs of triangles that crossed.
    pub(super) pairs: u64,
    pub(super) rounds: u32,
    /// Farthest that a new vertex was moved to a place that f32 knows, or to the grid.
    pub(super) displaced: f64,
    /// Bodies that became part of others, and the volume that counted more than once.
    pub(super) bodies: u64,
    pub(super) volume: f64,
    /// Where cutting left bodies that no printer can see, which are dropped.
    pub(super) dust: Vec<Region>,
    /// The surface was looked at anew: patches have other numbers than before.
    pub(super) divided: bool,
    /// Why some surfaces were left as they were, and how many of them.
    pub(super) left: Vec<(Failure, u64)>,
    /// Each cluster that was resolved, and each that was left.
    pub(super) regions: Vec<Region>,
    pub(super) regions_left: Vec<Unsettled>,
    /// By triangle of the workshop, as far as it was there before: was its surface closed, and was it not left? Empty: no.
    pub(super) taken_part: Vec<bool>,
}

impl Resolved {
    fn too_many() -> Self {
        Self { left: vec![(Failure::TooMany, 1)], ..Self::default() }
    }
}

/// Why crossings are left.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Failure {
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

/// The step of new vertices, against the power of two above the largest coordinate: that of f32 there.
const FINEST: f64 = 1.0 / 16_777_216.0;

/// Rounds of cutting and rounding.
const ROUNDS: u32 = 24;

/// Pairs may become more from round to round, but not more than so many times as many as at first, or as a few.
const GROWTH: usize = 4;
const FEW: usize = 1024;

/// Two triangles that cross a third one, where boxes around the cuts meet, of all triangles together: so many points may the cuts have in common, at
/// some hundred bytes each.
const MOST_MEETINGS: u64 = 1 << 24;

/// What cutting takes beside the workshop, for each of these meetings and for each pair that crosses. Measured: 415 MB for 78 000 pairs of two bodies
/// that cross everywhere, 1.9 GB for 229 000 pairs with 24 million meetings.
const BYTES_PER_MEETING: u64 = 48;
const BYTES_PER_PAIR: u64 = 4096;

/// What is nearer than so many steps of the finest grid, after the first round of cutting, is made one, and so many times farther after every
/// other one; but nothing beyond this share of the power of two above the largest coordinate.
const WIDER: f64 = 4.0;
const WIDEST: f64 = 1.0 / 4096.0;

/// Rounds after which what crosses is taken out, if it has not become half as much in the last one.
const REFILL_AFTER: u32 = 2;

/// And no patch in its place is farther away than this share of the power of two above the largest coordinate, nor than a width farther in each
/// round.
const FARTHEST: f64 = 1.0 / 256.0;

/// A closed surface is a flake if it is no thicker than this share of the step of new vertices.
const FLAKE: f64 = 1.0 / 16.0;

/// Times that everything is done anew without the clusters that failed.
const ATTEMPTS: usize = 12;

/// What it takes to look at the file again.
pub(super) struct Means<'a> {
    pub(super) path: &'a Path,
    pub(super) limits: &'a Limits,
    pub(super) progress: &'a dyn Progress,
}

/// Resolves the crossings of closed surfaces. `across`: were loops closed by patches that may cross anything? A pass over the file if anything
/// crosses; the rest goes by what does.
///
/// # Errors
/// [`Error::Starved`] when there is not memory enough.
pub(super) fn resolve(
    engine: &dyn Arrange,
    survey: &mut Survey<'_>,
    work: &mut Work<'_>,
    reversed: &mut Reversed,
    profile: &Profile,
    across: bool,
    means: &Means<'_>,
) -> Result<Resolved> {
    let no_copies = !work.edges().1.any_nonmanifold() || coincident(work).is_empty();
    if survey.crossing_pairs.as_ref().is_none_or(|known| known.is_empty() && no_copies && !across) {
        return Ok(Resolved::default());
    }
    let Some(overlay) = Overlay::of(survey, work, reversed) else { return Ok(Resolved::too_many()) };
    let Some(pairs) = overlay.crossing_pairs(survey, work) else { return Ok(Resolved::too_many()) };
    if pairs.is_empty() && no_copies {
        return Ok(Resolved::default());
    }
    divide(survey, work, reversed, corners(survey, work, &overlay, &pairs), means)?;
    let before = Before { triangles: work.triangles.clone(), reversed: reversed.clone() };
    let mut left: Vec<Failure> = Vec::new();
    let mut regions_left: Vec<Unsettled> = Vec::new();
    let mut blocked: Vec<bool> = Vec::new();
    let mut levels: Vec<Level> = Vec::new();
    let (mut bodies, mut volume) = (0, 0);
    let largest = above(survey.bounds.largest_coordinate());
    let mut state = State {
        survey,
        work,
        reversed,
        before,
        clusters: Clusters::default(),
        track: Track::default(),
        first_triangle: 0,
        first_vertex: 0,
        step: largest * FINEST,
    };
    let mut attempts = 0;
    loop {
        attempts += 1;
        let pieces = orient::pieces(state.survey, state.work, state.reversed);
        blocked.resize(pieces.list.len(), false);
        levels.resize(pieces.list.len(), Level::default());
        if attempts == 1 {
            (bodies, volume) = measured(&pieces);
        }
        if attempts > ATTEMPTS {
            // With all of them blocked there is nothing to fail with.
            blocked.fill(true);
        }
        state.clusters = Clusters::of(&pieces, &blocked);
        state.first_triangle = state.work.triangles.len() as u32;
        state.first_vertex = state.work.positions.len() as Vertex;
        let taken_part: Vec<bool> = (0..state.work.triangles.len() as u32).map(|t| state.clusters.holds(t)).collect();
        match state.attempt(engine, &overlay, &pairs, &levels, profile, means.limits) {
            Ok(resolved) => {
                state.drop_specks();
                let dust = state.drop_dust(&pieces);
                let (bodies_now, volume_now) = measured(&orient::pieces(state.survey, state.work, state.reversed));
                return Ok(Resolved {
                    bodies: bodies.saturating_sub(bodies_now),
                    volume: state.survey.measure.volume(Extent { area: 0, volume: volume - volume_now }),
                    left: counted(left),
                    regions: state.track.regions(&mut state.clusters),
                    regions_left,
                    taken_part,
                    dust,
                    divided: true,
                    ..resolved
                });
            }
            Err(Halted::NoMemory { needed, triangles }) => return Err(refused(means, needed, triangles)),
            Err(Halted::Stuck(Stuck { failure, triangles })) => {
                let failed = state.clusters.pieces_of(&triangles);
                state.restore();
                let again: Vec<(u32, Level)> = failed.iter().filter_map(|p| Some((*p, levels[*p as usize].next()?))).collect();
                if failure == Failure::Endless && !again.is_empty() {
                    again.into_iter().for_each(|(piece, level)| levels[piece as usize] = level);
                    continue;
                }
                regions_left.extend(state.unsettled(&failed, failure));
                left.extend(std::iter::repeat_n(failure, failed.len().max(1)));
                if failed.is_empty() {
                    blocked.fill(true);
                }
                failed.iter().for_each(|piece| blocked[*piece as usize] = true);
            }
        }
    }
}

/// The corners of the triangles of some pairs, each once.
fn corners(survey: &Survey<'_>, shop: &Shop, overlay: &Overlay, pairs: &[[u32; 2]]) -> Vec<[f32; 3]> {
    let mut positions: Vec<[f32; 3]> = pairs.iter().flatten().flat_map(|number| overlay.corners(survey, shop, *number)).collect();
    positions.sort_unstable_by_key(|p| Position::of(*p));
    positions.dedup();
    positions
}

/// Gathers the stars of the vertices at these positions into the workshop, so that sound surface on the two sides of what crosses is two
/// patches.
fn divide(
    survey: &mut Survey<'_>,
    work: &mut Work<'_>,
    reversed: &mut Reversed,
    positions: Vec<[f32; 3]>,
    means: &Means<'_>,
) -> Result<()> {
    let Division { fetched, divided_from } = survey.divide(means.path, &positions, means.limits, means.progress)?;
    let first = work.extend_at(survey, &fetched, &positions);
    for t in first..work.triangles.len() as u32 {
        join_in(work, reversed, t);
    }
    work.follow_division(survey);
    let of = |all: &[bool]| divided_from.iter().map(|patch| all.get(*patch as usize) == Some(&true)).collect();
    *reversed = Reversed { patches: of(&reversed.patches), dropped: of(&reversed.dropped) };
    Ok(())
}

/// Does with a triangle that was fetched what was done with the patch that it belonged to.
pub(super) fn join_in(work: &mut Work<'_>, reversed: &Reversed, t: u32) {
    let patch = work.triangles[t as usize].patch;
    if patch == NONE {
        return;
    }
    if reversed.dropped[patch as usize] {
        work.kill(t);
    } else if reversed.patches[patch as usize] {
        work.turn(t);
    }
}

fn counted(mut failures: Vec<Failure>) -> Vec<(Failure, u64)> {
    failures.sort_unstable();
    failures.chunk_by(|a, b| a == b).map(|same| (same[0], same.len() as u64)).collect()
}

/// Closed bodies, and what all that is closed encloses.
fn measured(pieces: &Components) -> (u64, i128) {
    let closed = || pieces.list.iter().filter(|piece| !piece.open);
    let bodies = closed().filter(|piece| piece.extent.volume > 0).count() as u64;
    (bodies, closed().map(|piece| piece.extent.volume).sum())
}

/// Why an attempt failed, and triangles of the surfaces that it failed with; none if that is not known.
struct Stuck {
    failure: Failure,
    triangles: Vec<u32>,
}

impl Stuck {
    fn with(failure: Failure) -> Self {
        Self { failure, triangles: Vec::new() }
    }
}

/// Why an attempt ended before its time.
enum Halted {
    Stuck(Stuck),
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

type Tried<T> = std::result::Result<T, Halted>;

/// What everything was before.
struct Before {
    triangles: Vec<Triangle>,
    reversed: Reversed,
}

/// Pairs of triangles of the workshop that cross, and what they were found with.
struct Met {
    crossing: Vec<[u32; 2]>,
    overlay: Overlay,
}

/// Which triangles are of surfaces that take part: closed before anything was cut, and not blocked.
#[derive(Default)]
pub(super) struct Clusters {
    /// By triangle of the workshop and by patch, the piece of surface that it was part of, or [`NONE`].
    of_triangle: Vec<u32>,
    of_patch: Vec<u32>,
    takes_part: Vec<bool>,
    /// Pieces that cross each other are united.
    parents: Vec<u32>,
}

impl Clusters {
    fn of(pieces: &Components, blocked: &[bool]) -> Self {
        Self {
            of_triangle: pieces.of_triangle.clone(),
            of_patch: pieces.of_patch.clone(),
            takes_part: pieces.list.iter().zip(blocked).map(|(piece, blocked)| !piece.open && !blocked).collect(),
            parents: (0..pieces.list.len() as u32).collect(),
        }
    }

    fn takes_part(&self, piece: u32) -> bool {
        self.takes_part.get(piece as usize) == Some(&true)
    }

    pub(super) fn holds(&self, triangle: u32) -> bool {
        self.takes_part(self.of_triangle[triangle as usize])
    }

    pub(super) fn holds_patch(&self, patch: u32) -> bool {
        self.takes_part(self.of_patch[patch as usize])
    }

    /// All pieces that cross those of some triangles, and these, as far as they take part; ascending.
    fn pieces_of(&mut self, triangles: &[u32]) -> Vec<u32> {
        let pieces = triangles.iter().map(|t| self.of_triangle[*t as usize]).filter(|piece| *piece != NONE);
        let roots: BTreeSet<u32> =
            pieces.collect::<Vec<_>>().into_iter().map(|piece| crate::util::union_find::find(&mut self.parents, piece)).collect();
        let all = 0..self.parents.len() as u32;
        all.filter(|piece| self.takes_part(*piece) && roots.contains(&crate::util::union_find::find(&mut self.parents, *piece)))
            .collect()
    }
}

/// The file while it is resolved.
pub(super) struct State<'a, 'r, 'w> {
    survey: &'a mut Survey<'r>,
    work: &'a mut Work<'w>,
    reversed: &'a mut Reversed,
    before: Before,
    clusters: Clusters,
    track: Track,
    /// Triangles from here on are new ones, but for those that were fetched.
    first_triangle: u32,
    /// Vertices from here on are new ones.
    first_vertex: Vertex,
    /// They are on a grid of this step, but for what is exact in f32.
    step: f64,
}

impl State<'_, '_, '_> {
    fn attempt(
        &mut self,
        engine: &dyn Arrange,
        overlay: &Overlay,
        pairs: &[[u32; 2]],
        levels: &[Level],
        profile: &Profile,
        limits: &Limits,
    ) -> Tried<Resolved> {
        let mut resolved = Resolved::default();
        self.track = Track::default();
        let too_many = || Stuck::with(Failure::TooMany);
        let mut crossing = self.crossing(overlay, pairs, profile);
        self.unite(&crossing);
        resolved.pairs = crossing.len() as u64;
        let most = crossing.len().max(FEW) * GROWTH;
        let mut latest: Option<Overlay> = None;
        if let Some((met, moved)) = self.spread(&crossing, levels, profile)? {
            resolved.displaced = moved;
            (crossing, latest) = (met.crossing, Some(met.overlay));
        }
        // What is nearer is made one, and what is taken out has its patch within the limit.
        let (mut width, mut limit) = (self.step, self.step * WIDER);
        while !crossing.is_empty() {
            let triangles: BTreeSet<u32> = crossing.iter().flatten().copied().collect();
            if resolved.rounds == ROUNDS || resolved.rounds > 0 && crossing.len() > most {
                return Err(Stuck { failure: Failure::Endless, triangles: triangles.into_iter().collect() }.into());
            }
            tracing::debug!(round = resolved.rounds, pairs = crossing.len(), triangles = triangles.len(), "Crossings.");
            let meetings = meetings(|t| Bounds::of(&self.work.points(t)), &crossing);
            let meetings = meetings.map_err(|worst| Stuck { failure: Failure::TooMany, triangles: vec![worst] })?;
            let needed =
                crate::stream::budget::workshop_bytes(self.work.triangles.len() as u64, self.work.positions.len() as u64)
                    + meetings * BYTES_PER_MEETING
                    + crossing.len() as u64 * BYTES_PER_PAIR;
            if needed > limits.memory_bytes {
                return Err(Halted::NoMemory { needed, triangles: triangles.len() });
            }
            resolved.rounds += 1;
            self.track.crossed(self.work, &self.clusters, &triangles, resolved.rounds);
            let pairs_before = crossing.len();
            let along = self.with_edges_along(latest.as_ref().unwrap_or(overlay), &triangles).ok_or_else(too_many)?;
            let first_new = self.work.triangles.len() as u32;
            resolved.displaced = resolved.displaced.max(self.round(engine, &triangles, &along, limits.threads)?);
            let met = self.met(crossing, profile, |t| t >= first_new)?;
            self.unite(&met.crossing);
            tracing::debug!(pairs = met.crossing.len(), "Cut.");
            width = (width * WIDER).min(self.step / FINEST * WIDEST);
            limit = (limit * WIDER).min(self.step / FINEST * FARTHEST);
            let (mut met, mut moved) = self.draw_near(met, width, profile)?;
            if resolved.rounds >= REFILL_AFTER && 2 * met.crossing.len() >= pairs_before {
                let refilled;
                (met, refilled) = self.refill(met, limit, profile)?;
                moved = moved.max(refilled);
            }
            resolved.displaced = resolved.displaced.max(moved);
            let is_impatient = |t: &u32| {
                let piece = self.clusters.of_triangle[*t as usize];
                levels.get(piece as usize) == Some(&Level::Impatient)
            };
            if resolved.rounds == 1 && met.crossing.len() >= pairs_before.max(FEW) {
                let triangles: Vec<u32> = met.crossing.iter().flatten().copied().collect();
                if triangles.iter().any(is_impatient) {
                    return Err(Stuck { failure: Failure::Endless, triangles }.into());
                }
            }
            (crossing, latest) = (met.crossing, Some(met.overlay));
        }
        Ok(resolved)
    }

    /// The pairs that cross now, after these triangles have changed: pairs from before, of which neither has, still do. Where that is kept,
    /// their pieces are to be united.
    fn met(&mut self, before: Vec<[u32; 2]>, profile: &Profile, changed: impl Fn(u32) -> bool + Sync) -> Tried<Met> {
        let too_many = || Stuck::with(Failure::TooMany);
        self.check_closed()?;
        let overlay = Overlay::of(self.survey, self.work, self.reversed).ok_or_else(too_many)?;
        let met = overlay.met_by(self.survey, self.work, &changed).ok_or_else(too_many)?;
        let pairs: Vec<[u32; 2]> = met.iter().map(|pair| pair.triangles).collect();
        let mut crossing = self.crossing(&overlay, &pairs, profile);
        crossing.extend(before.into_iter().filter(|pair| pair.iter().all(|t| self.work.lives(*t) && !changed(*t))));
        crossing.iter_mut().for_each(|pair| pair.sort_unstable());
        crossing.sort_unstable();
        crossing.dedup();
        Ok(Met { crossing, overlay })
    }

    /// These triangles, and with them those whose edges run along edges there: where surfaces pass through each other edge along edge, no two
    /// triangles cross, and yet one side of the one is not one cell. `None` if that is too much work to tell.
    fn with_edges_along(&mut self, overlay: &Overlay, crossing: &BTreeSet<u32>) -> Option<BTreeSet<u32>> {
        let pieces: BTreeSet<u32> = crossing.iter().map(|t| self.clusters.of_triangle[*t as usize]).collect();
        let (mut seen, mut asked): (HashSet<Vertex>, HashSet<u32>) = Default::default();
        grown(crossing, |fresh| {
            let corners: BTreeSet<Vertex> = fresh.iter().flat_map(|t| self.work.triangles[*t as usize].v).collect();
            let corners = corners.into_iter().filter(|v| seen.insert(*v));
            let around: BTreeSet<u32> = corners.flat_map(|v| self.work.star(v)).map(|(t, _)| t).collect();
            let new: Vec<u32> = around.into_iter().filter(|t| self.clusters.holds(*t) && asked.insert(*t)).collect();
            if new.is_empty() {
                return Some(Vec::new());
            }
            let pairs = overlay.edges_along(self.survey, self.work, &new)?;
            let pairs = self.in_shop(overlay, &pairs);
            let crosses = |t: &u32| pieces.contains(&self.clusters.of_triangle[*t as usize]);
            Some(pairs.into_iter().filter(|pair| pair.iter().all(crosses)).flatten().collect())
        })
    }

    /// Cuts, decides and rounds once. Returns how far vertices were moved.
    fn round(&mut self, engine: &dyn Arrange, crossing: &BTreeSet<u32>, along: &BTreeSet<u32>, threads: usize) -> Tried<f64> {
        let clusters = &self.clusters;
        let cut = Cut::of(engine, self.work, along, |t| clusters.holds(t), threads);
        let cut = cut.ok_or_else(|| Stuck::with(Failure::NotArranged))?;
        let sides = Sides::of(self.survey, self.work, &cut, &self.clusters);
        let windings = sides.windings(self.survey, self.work, self.reversed, &cut, crossing, &self.clusters);
        self.apply(&cut, &sides, &windings)
    }

    /// The pairs of triangles that take part, in the workshop; where bodies are to be kept, only of one and the same.
    fn crossing(&mut self, overlay: &Overlay, pairs: &[[u32; 2]], profile: &Profile) -> Vec<[u32; 2]> {
        let mut crossing = self.in_shop(overlay, pairs);
        crossing.extend(coincident(self.work));
        crossing.retain(|pair| {
            let [a, b] = pair.map(|t| self.clusters.of_triangle[t as usize]);
            self.clusters.takes_part(a) && self.clusters.takes_part(b) && (profile.bodies != Bodies::Keep || a == b)
        });
        crossing
    }

    /// The pieces of these pairs are of one cluster from now on.
    fn unite(&mut self, crossing: &[[u32; 2]]) {
        for pair in crossing {
            let [a, b] = pair.map(|t| self.clusters.of_triangle[t as usize]);
            crate::util::union_find::unite(&mut self.clusters.parents, a, b);
        }
    }

    /// Pairs of triangles as the workshop numbers them, where they are fetched to if need be, with all around them.
    fn in_shop(&mut self, overlay: &Overlay, pairs: &[[u32; 2]]) -> Vec<[u32; 2]> {
        self.complete(corners(self.survey, self.work, overlay, pairs));
        let of_record: HashMap<u32, u32> = self
            .work
            .living()
            .filter_map(|t| match self.work.triangles[t as usize].origin {
                Origin::Input(record) => Some((record, t)),
                Origin::Part(_) | Origin::Patch => None,
            })
            .collect();
        let triangle = |number: u32| overlay.changed_of(number).or_else(|| of_record.get(&number).copied());
        pairs.iter().filter_map(|[a, b]| Some([triangle(*a)?, triangle(*b)?])).collect()
    }

    /// Fetches the stars of the vertices at these positions that are not here.
    fn complete(&mut self, mut positions: Vec<[f32; 3]>) {
        positions.sort_unstable_by_key(|p| Position::of(*p));
        positions.dedup();
        let known = self.work.by_position();
        positions.retain(|p| known.get(&Position::of(*p)).is_none_or(|v| !self.work.complete[*v as usize]));
        if positions.is_empty() {
            return;
        }
        let new = self.survey.promote(&positions);
        let first = self.work.extend_at(self.survey, &new, &positions);
        for t in first..self.work.triangles.len() as u32 {
            let mut triangle = self.work.triangles[t as usize];
            let patch = triangle.patch;
            self.clusters.of_triangle.push(if patch == NONE { NONE } else { self.clusters.of_patch[patch as usize] });
            join_in(self.work, self.reversed, t);
            // They are no part of their patch any more, whatever becomes of the attempt.
            if patch != NONE {
                if self.before.reversed.patches[patch as usize] {
                    triangle.v.swap(1, 2);
                }
                triangle.alive = !self.before.reversed.dropped[patch as usize];
            }
            self.before.triangles.push(triangle);
        }
    }

    /// Triangles that came without a surface are of that of the record that they are parts of; those of patches, of that of a neighbour.
    fn follow(&mut self) {
        let first = self.clusters.of_triangle.len();
        let all = self.work.triangles.len();
        let mut left: Vec<usize> = (first..all).collect();
        if left.is_empty() {
            return;
        }
        let record = |t: usize| match self.work.triangles[t].origin {
            Origin::Input(record) | Origin::Part(record) => Some(record),
            Origin::Patch => None,
        };
        let wanted: HashSet<u32> = left.iter().filter_map(|t| record(*t)).collect();
        let known = (0..first).filter_map(|t| Some((record(t).filter(|r| wanted.contains(r))?, self.clusters.of_triangle[t])));
        let piece_of: HashMap<u32, u32> = known.filter(|(_, piece)| *piece != NONE).collect();
        let pieces = left.iter().map(|t| record(*t).and_then(|r| piece_of.get(&r).copied()).unwrap_or(NONE));
        self.clusters.of_triangle.extend(pieces.collect::<Vec<_>>());
        left.retain(|t| self.clusters.of_triangle[*t] == NONE);
        follow_neighbours(self.work, &left, &mut self.clusters.of_triangle);
    }

    /// Every edge of what takes part must be used as often in one direction as in the other.
    fn check_closed(&mut self) -> Tried<()> {
        let mut triangles = Vec::new();
        let (_, edges) = self.work.edges();
        for edge in edges.iter().filter(|edge| edge.uses.len() != 2 || edge.is_unbalanced()) {
            let own = || edge.uses.iter().filter(|used| self.clusters.holds(used.triangle));
            let balance: i64 = own().map(|used| if used.forward { 1 } else { -1 }).sum();
            if balance != 0 {
                triangles.extend(own().map(|used| used.triangle));
            }
        }
        if triangles.is_empty() { Ok(()) } else { Err(Stuck { failure: Failure::Opened, triangles }.into()) }
    }

    /// Drops closed surfaces of nothing but parts of triangles that are no thicker than what rounding moves: they are nothing but that. So do those
    /// with other triangles, too, that are far thinner: what was cut off one and is next to nothing.
    fn drop_specks(&mut self) {
        let pieces = orient::pieces(self.survey, self.work, self.reversed);
        let measure = &self.survey.measure;
        let thickness = |piece: &Component| measure.volume(piece.extent).abs() / measure.area(piece.extent);
        let flakes = pieces.list.iter().map(|piece| !piece.open && thickness(piece) <= self.step * FLAKE);
        let mut is_flake: Vec<bool> = flakes.collect();
        let mut is_speck: Vec<bool> = pieces.list.iter().map(|piece| !piece.open && thickness(piece) <= self.step).collect();
        let mut is_cut = vec![false; pieces.list.len()];
        for t in self.work.living() {
            let piece = pieces.of_triangle[t as usize] as usize;
            let as_read = matches!(self.work.triangles[t as usize].origin, Origin::Input(_));
            is_cut[piece] |= !as_read && t >= self.first_triangle;
            is_speck[piece] &= !as_read;
        }
        for piece in pieces.of_patch.iter().filter(|piece| **piece != NONE) {
            (is_flake[*piece as usize], is_speck[*piece as usize]) = (false, false);
        }
        let goes = |t: u32| {
            let piece = pieces.of_triangle[t as usize] as usize;
            is_speck[piece] || is_flake[piece] && is_cut[piece]
        };
        let specks: Vec<u32> = self.work.living().filter(|t| goes(*t)).collect();
        specks.into_iter().for_each(|t| self.work.kill(t));
    }

    /// What a cluster that is left, of these pieces, is told by, once all is as it was; `None` if nothing of it is known.
    fn unsettled(&self, pieces: &[u32], failure: Failure) -> Option<Unsettled> {
        let region = self.track.left(pieces, failure.to_string());
        let own = |t: &u32| {
            let piece = self.clusters.of_triangle.get(*t as usize).copied().unwrap_or(NONE);
            if pieces.is_empty() { self.clusters.takes_part(piece) } else { pieces.binary_search(&piece).is_ok() }
        };
        let first = self.work.living().find(own)?;
        (region.count > 0).then(|| Unsettled { region, at: self.work.points(first)[0] })
    }

    fn restore(&mut self) {
        self.work.restore(&self.before.triangles);
        self.reversed.clone_from(&self.before.reversed);
    }
}

/// Gives each of these triangles, ascending, the smallest piece of the triangles at its corners, and so on from neighbour to neighbour. They
/// have their turns in rounds, each in their order, as soon as a neighbour has a piece. O(stars · log).
fn follow_neighbours(shop: &Shop, left: &[usize], piece_of: &mut [u32]) {
    let mut waiting: HashMap<Vertex, Vec<usize>> = HashMap::new();
    // By vertex the smallest piece around it.
    let mut least: HashMap<Vertex, u32> = HashMap::new();
    let mut turns: BinaryHeap<Reverse<(u32, usize)>> = BinaryHeap::new();
    for t in left {
        for v in shop.triangles[*t].v {
            waiting.entry(v).or_default().push(*t);
            let around = || shop.star(v).map(|(o, _)| piece_of[o as usize]).min().unwrap_or(NONE);
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
        let v = shop.triangles[t].v;
        let piece = v.iter().filter_map(|v| least.get(v)).min().copied().unwrap_or(NONE);
        piece_of[t] = piece;
        // A dead triangle is nobody's neighbour.
        for v in v.iter().filter(|_| shop.lives(t as u32)) {
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
fn grown(start: &BTreeSet<u32>, mut beside: impl FnMut(&[u32]) -> Option<Vec<u32>>) -> Option<BTreeSet<u32>> {
    let mut all = start.clone();
    let mut fresh: Vec<u32> = start.iter().copied().collect();
    while !fresh.is_empty() {
        steps::count(fresh.len());
        fresh = beside(&fresh)?;
        fresh.retain(|t| all.insert(*t));
    }
    Some(all)
}

/// How many points the cuts of these pairs may have in common, at most; if they are too many, the triangle on which most others come close to
/// each other.
fn meetings(bounds: impl Fn(u32) -> Bounds, crossing: &[[u32; 2]]) -> std::result::Result<u64, u32> {
    let mut cuts: BTreeMap<u32, Vec<Bounds>> = BTreeMap::new();
    for [a, b] in crossing {
        let common = bounds(*a).overlap(&bounds(*b));
        common.into_iter().for_each(|common| [a, b].iter().for_each(|t| cuts.entry(**t).or_default().push(common)));
    }
    let (mut all, mut worst) = (0, (0, NONE));
    for (t, boxes) in cuts {
        let meetings = boxes::meetings(boxes, MOST_MEETINGS);
        worst = worst.max((meetings, t));
        all += meetings;
        if all > MOST_MEETINGS {
            return Err(worst.1);
        }
    }
    Ok(all)
}

/// What cutting so many triangles along each other needs, beside what there is.
fn refused(means: &Means<'_>, needed: u64, triangles: usize) -> Error {
    let mebibytes = |bytes: u64| bytes.div_ceil(1 << 20);
    Error::Starved {
        path: means.path.into(),
        reason: format!("cutting {triangles} triangles along what they cross needs about {} MiB of memory", mebibytes(needed)),
        advice: format!(
            "the budget is {} MiB: raise --memory, or leave crossings (resolve_crossings)",
            means.limits.memory_bytes >> 20
        ),
    }
}

/// The power of two above a coordinate.
fn above(coordinate: f32) -> f64 {
    let mut power = 1.0f64;
    let coordinate = f64::from(coordinate).max(f64::from(f32::MIN_POSITIVE));
    while power <= coordinate {
        power *= 2.0;
    }
    while power / 2.0 > coordinate {
        power /= 2.0;
    }
    power
}

/// Triangles on the same three vertices, by twos: they are in no pair that crosses.
fn coincident(shop: &Shop) -> Vec<[u32; 2]> {
    let candidates = defects::by_vertex_set(shop);
    let groups = candidates.chunk_by(|a, b| a.0 == b.0);
    groups.flat_map(|group| group.windows(2).map(|two| [two[0].1, two[1].1])).collect()
}
