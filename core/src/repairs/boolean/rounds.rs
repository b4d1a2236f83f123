//! Rounds of cutting, rounding, and drawing near, until nothing crosses any more.

use std::collections::BTreeSet;

use crate::contract::progress::Progress;
use crate::contract::settings::{Limits, Profile};
use crate::geometry::arrange::Arrange;
use crate::geometry::sums::Bounds;
use crate::repairs::boolean::cells::SpaceCells;
use crate::repairs::boolean::cut::Cut;
use crate::repairs::boolean::meetings::meetings;
use crate::repairs::boolean::perturb::Level;
use crate::repairs::boolean::state::{FINEST, Failure, Halted, Met, Resolved, State, Stuck, Tried, WIDER, coincident};
use crate::repairs::boolean::track::Track;
use crate::repairs::shared::overlay::{Overlay, Standing};
use crate::stream::budget;

/// Rounds of cutting and rounding.
const ROUNDS: u32 = 24;

/// Pairs may become more from round to round, but not more than so many times as many as at first, or as a few.
const GROWTH: usize = 4;

const FEW: usize = 1024;

/// What cutting takes beside the submesh, for each of these meetings, for each pair that crosses and for each triangle of such. Measured: 160 MB for
/// 49 000 triangles in 112 000 pairs, most of which overlap; for as many triangles as pairs 160 MB (100 000, large ones) and 240 MB (110 000, small ones,
/// with as many again around them).
const BYTES_PER_MEETING: u64 = 48;

pub(crate) const BYTES_PER_PAIR: u64 = 1280;

pub(crate) const BYTES_PER_TRIANGLE: u64 = 1280;

/// Cutting leaves about so many pieces of a triangle.
const PIECES: u64 = 4;

const WIDEST: f64 = 1.0 / 4096.0;

/// Rounds after which what crosses is taken out, if it has not become half as much in the last one.
const REFILL_AFTER: u32 = 2;

/// And no patch in its place is farther away than this share of the power of two above the largest coordinate, nor than a width farther in each
/// round.
const FARTHEST: f64 = 1.0 / 256.0;

/// The engine, the mesh and its pairs that an attempt begins with.
#[derive(Clone, Copy)]
pub(crate) struct Attempt<'a> {
    pub(crate) engine: &'a dyn Arrange,
    pub(crate) overlay: &'a Overlay,
    /// All that crosses, as the overlay numbers triangles.
    pub(crate) pairs: &'a [[Standing; 2]],
    /// By piece.
    pub(crate) levels: &'a [Level],
    pub(crate) profile: &'a Profile,
    pub(crate) limits: &'a Limits,
    pub(crate) progress: &'a dyn Progress,
}

/// How near features are made one before a round, and how far a patch may lie from what it replaces.
struct Reach {
    width: f64,
    limit: f64,
}

impl State<'_, '_, '_> {
    /// Resolves what crosses in all clusters, or says with which triangles it failed.
    pub(crate) fn attempt(&mut self, by: &Attempt<'_>) -> Tried<Resolved> {
        let mut resolved = Resolved::default();
        self.track = Track::default();
        let mut crossing = self.crossing(by.overlay, by.pairs, coincident(self.work), by.profile);
        self.unite(&crossing);
        resolved.pairs = crossing.len() as u64;
        let most = crossing.len().max(FEW) * GROWTH;
        let mut latest: Option<Overlay> = None;
        if let Some((met, moved)) = self.perturb(&crossing, by.levels, by.profile)? {
            resolved.displaced = moved;
            (crossing, latest) = (met.crossing, Some(met.overlay));
        }
        let mut reach = Reach { width: self.step, limit: self.step * WIDER };
        while !crossing.is_empty() {
            if by.progress.cancelled() {
                return Err(Halted::Cancelled);
            }
            let triangles: BTreeSet<u32> = crossing.iter().flatten().copied().collect();
            if resolved.rounds == ROUNDS || resolved.rounds > 0 && crossing.len() > most {
                return Err(Stuck { failure: Failure::Endless, triangles: triangles.into_iter().collect() }.into());
            }
            tracing::debug!(round = resolved.rounds, pairs = crossing.len(), triangles = triangles.len(), "Crossings.");
            self.check_memory(&crossing, triangles.len(), by.limits)?;
            resolved.rounds += 1;
            self.track.crossed(self.work, &self.clusters, &triangles, resolved.rounds);
            let pairs_before = crossing.len();
            let cut = self.cut(by, latest.as_ref().unwrap_or(by.overlay), crossing, &triangles, &mut resolved)?;
            let met = self.bring_together(by, cut, &mut reach, pairs_before, &mut resolved)?;
            if resolved.rounds == 1 && met.crossing.len() >= pairs_before.max(FEW) {
                self.check_patience(by, &met)?;
            }
            (crossing, latest) = (met.crossing, Some(met.overlay));
        }
        Ok(resolved)
    }

    /// Refuses a cut that needs more memory than there is.
    fn check_memory(&self, crossing: &[[u32; 2]], triangles: usize, limits: &Limits) -> Tried<()> {
        let meetings = meetings(|t| Bounds::of(&self.work.points(t)), crossing);
        let meetings = meetings.map_err(|worst| Stuck { failure: Failure::TooMany, triangles: vec![worst] })?;
        let (all, vertices) = (self.work.triangles.len() as u64, self.work.positions.len() as u64);
        let cutting = budget::bare_submesh_bytes(all, vertices)
            + meetings * BYTES_PER_MEETING
            + crossing.len() as u64 * BYTES_PER_PAIR
            + triangles as u64 * BYTES_PER_TRIANGLE;
        let needed = self.survey.heap_bytes() + cutting.max(budget::submesh_bytes(all + triangles as u64 * PIECES, vertices));
        if needed > limits.memory_bytes { Err(Halted::NoMemory { needed, triangles }) } else { Ok(()) }
    }

    /// Cuts these triangles along what they cross. Returns what crosses then.
    fn cut(
        &mut self,
        by: &Attempt<'_>,
        overlay: &Overlay,
        crossing: Vec<[u32; 2]>,
        triangles: &BTreeSet<u32>,
        resolved: &mut Resolved,
    ) -> Tried<Met> {
        let along = self.with_edges_along(overlay, triangles).ok_or_else(|| Stuck::with(Failure::TooMany))?;
        let first_new = self.work.triangles.len() as u32;
        resolved.displaced = resolved.displaced.max(self.round(by.engine, triangles, &along, by.limits.threads)?);
        let met = self.met(crossing, by.profile, |t| t >= first_new)?;
        self.unite(&met.crossing);
        tracing::debug!(pairs = met.crossing.len(), "Cut.");
        Ok(met)
    }

    /// What is nearer than the reach, which grows, is made one; where that does not help, what crosses is replaced by patches.
    fn bring_together(
        &mut self,
        by: &Attempt<'_>,
        met: Met,
        reach: &mut Reach,
        pairs_before: usize,
        resolved: &mut Resolved,
    ) -> Tried<Met> {
        reach.width = (reach.width * WIDER).min(self.step / FINEST * WIDEST);
        reach.limit = (reach.limit * WIDER).min(self.step / FINEST * FARTHEST);
        let (mut met, mut moved) = self.draw_near(met, reach.width, by.profile)?;
        if resolved.rounds >= REFILL_AFTER && 2 * met.crossing.len() >= pairs_before {
            let refilled;
            (met, refilled) = self.refill(met, reach.limit, by.profile)?;
            moved = moved.max(refilled);
        }
        resolved.displaced = resolved.displaced.max(moved);
        Ok(met)
    }

    /// Ends the attempt where the first round left no fewer pairs, if a surface there can be tried in another way.
    fn check_patience(&self, by: &Attempt<'_>, met: &Met) -> Tried<()> {
        let is_impatient = |t: &u32| {
            let piece = self.clusters.of_triangle[*t as usize];
            by.levels.get(piece as usize) == Some(&Level::Impatient)
        };
        let triangles: Vec<u32> = met.crossing.iter().flatten().copied().collect();
        if triangles.iter().any(is_impatient) {
            return Err(Stuck { failure: Failure::Endless, triangles }.into());
        }
        Ok(())
    }

    /// Cuts, decides and rounds once. Returns how far vertices were moved.
    fn round(&mut self, engine: &dyn Arrange, crossing: &BTreeSet<u32>, along: &BTreeSet<u32>, threads: usize) -> Tried<f64> {
        let clusters = &self.clusters;
        let cut = Cut::of(engine, self.work, along, |t| clusters.holds(t), threads);
        let cut = cut.ok_or_else(|| Stuck::with(Failure::NotArranged))?;
        let sides = SpaceCells::of(self.survey, self.work, &cut, &self.clusters);
        let windings = sides.windings(self.survey, self.work, self.reversed, &cut, crossing, &self.clusters);
        self.apply(&cut, &sides, &windings)
    }
}
