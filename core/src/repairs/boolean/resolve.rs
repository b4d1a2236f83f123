//! Crossings: bodies that cross each other, or themselves, become one.
//!
//! The triangles that cross something, and their neighbours, are cut along everything they meet (`cut`, [`crate::geometry::arrange`]). Cells of space in
//! front of and behind their pieces, the other triangles of the submesh and the regions of regular surface are one where these join
//! (`sides`); behind each of them the winding number is larger by one than in front. One exact winding number a connected surface (`bodies`)
//! makes all of them known. Material is where the winding number is positive (Jacobson et al. 2013; Zhou et al. 2016): what has it on one
//! side only stays, so that a body inside out comes right and what lies inside of another one goes, whole regions as bits of the edit (`embed`).
//!
//! Where the surface was cut, new vertices are rounded to f32. Triangles that come to nothing by that leave every directed edge balanced, and
//! what crosses after it is resolved in the next round, with what it crosses, from the f32 coordinates. (Near zero f32 has places far closer to
//! each other than elsewhere, which are of no use: no place is finer than those at the file's largest coordinate, but for what has its place
//! exactly.) Before each round, features that are nearly one there are made one (`near`), the nearer the sooner, so that f32 has room
//! between those that are left (the iterated snap rounding of Valque & Lazard, SGP 2025, and CGAL 6.1 brings vertices to a coarser grid
//! instead, with 31 more bits). Rounds are counted, so that time decides nothing.
//!
//! Sheets that are open bound no material, and what crosses only them is left alone. Surfaces that cross each other, directly or by others, are a
//! **cluster**: one that contradicts itself (it says two things about a cell), does not come to an end or would not be closed is left as
//! it was, and the others are resolved without it.

#[cfg(test)]
mod tests;

use crate::contract::report::RepairName;
use crate::geometry::arrange::Exact;
use crate::repairs::holes::fill;
use crate::repairs::shared::context::{Changes, Context, Done, Repair};
use crate::repairs::shared::pieces;
use std::path::Path;

use crate::contract::error::{Error, Result};
use crate::contract::progress::Progress;
use crate::contract::settings::{Limits, Profile};
use crate::geometry::arrange::Arrange;
use crate::geometry::sums::Extent;
use crate::repairs::boolean::clusters::Clusters;
use crate::repairs::boolean::perturb::Level;
pub(crate) use crate::repairs::boolean::refill::{Refill, refill_of};
use crate::repairs::boolean::rounds::Attempt;
use crate::repairs::boolean::state::{Before, FINEST, Failure, Halted, State, Stuck, coincident, corners};
pub(crate) use crate::repairs::boolean::state::{Resolved, join_in};
use crate::repairs::boolean::track::Track;
use crate::repairs::shared::overlay::Overlay;
use crate::repairs::shared::region_report::Unsettled;
use crate::repairs::shared::work::Work;
use crate::submesh::components::{Component, Components, Reversed};
use crate::submesh::{Origin, Vertex};
use crate::topology::survey::{Division, Survey};
use crate::util::ids::NONE;
use crate::util::words::{Count, Short};

/// Surfaces that cross each other, and the patches that were to be cut.
pub(crate) const REPAIR: Repair = Repair { name: RepairName::SelfIntersection, changes: Changes::Surface, run: account_for };

fn account_for(cx: &mut Context<'_, '_>) -> Result<Done> {
    cx.handed.may_cross = !cx.profile.resolve_crossings;
    if !cx.profile.resolve_crossings {
        return Ok(Done::count(0, ""));
    }
    let across = cx.handed.has_skirts || !cx.handed.across.is_empty();
    let means = Means { path: cx.path, limits: cx.limits, progress: cx.progress };
    let mut resolved = resolve(&Exact, cx.survey, &mut cx.work, &mut cx.reversed, cx.profile, across, &means)?;
    cx.handed.dust = resolved.dust.len() as u64;
    let open = fill::open_again(&mut cx.work, std::mem::take(&mut cx.handed.across), &resolved.taken_part);
    cx.account.take_back(RepairName::Fill, open.len() as u64);
    let changed = resolved.divided || !open.is_empty();
    cx.account.loops_left.extend(open);
    cx.account.regions.append(&mut resolved.regions);
    cx.account.regions.append(&mut resolved.dust);
    cx.account.enclose(resolved.bodies, resolved.volume);
    cx.handed.unsettled.append(&mut resolved.regions_left);
    cx.handed.may_cross |= !resolved.left.is_empty();
    let left = resolved.left.iter().map(|(failure, pieces)| format!("of {} pieces of surface: {failure}", Count(*pieces)));
    cx.handed.intersections_left.extend(left);
    let Resolved { pairs, rounds, displaced, bodies, volume, .. } = resolved;
    let note = format!(
        "pairs of triangles that crossed; rounds: {rounds}, vertices moved by at most {}, bodies that became part of others: \
         {}, with {} units³ of them",
        Short(displaced),
        Count(bodies),
        Short(volume)
    );
    Ok(Done { changed, ..Done::count(pairs, note) })
}

/// A closed surface is a flake if it is no thicker than this share of the step of new vertices.
const FLAKE: f64 = 1.0 / 16.0;

/// Times that everything is done anew without the clusters that failed.
const ATTEMPTS: usize = 12;

/// Path, limits and progress with which a file is looked at again.
pub(crate) struct Means<'a> {
    pub(crate) path: &'a Path,
    pub(crate) limits: &'a Limits,
    pub(crate) progress: &'a dyn Progress,
}

/// Resolves the crossings of closed surfaces. `across`: were loops closed by patches that may cross anything? A pass over the file if anything
/// crosses; the rest goes by what does.
///
/// # Errors
/// [`Error::Starved`] when there is not memory enough.
pub(crate) fn resolve(
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
    let before = Before { triangles: work.snapshot(), reversed: reversed.clone() };
    let largest = above(survey.bounds.largest_coordinate());
    let state = State {
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
    attempt_until_done(
        state,
        &Attempt {
            engine,
            overlay: &overlay,
            pairs: &pairs,
            levels: &[],
            profile,
            limits: means.limits,
            progress: means.progress,
        },
        means,
    )
}

/// Clusters that attempts which failed have left.
#[derive(Default)]
struct Failed {
    left: Vec<Failure>,
    regions: Vec<Unsettled>,
    /// By piece: it takes no part any more.
    blocked: Vec<bool>,
    /// By piece.
    levels: Vec<Level>,
}

impl Failed {
    /// Takes in why an attempt failed, once all is as it was: the surfaces that it failed with are tried in another way, or not any more.
    fn learn(&mut self, state: &mut State<'_, '_, '_>, Stuck { failure, triangles }: Stuck) {
        let failed = state.clusters.pieces_of(&triangles);
        state.restore();
        let again: Vec<(u32, Level)> = failed.iter().filter_map(|p| Some((*p, self.levels[*p as usize].next()?))).collect();
        if failure == Failure::Endless && !again.is_empty() {
            again.into_iter().for_each(|(piece, level)| self.levels[piece as usize] = level);
            return;
        }
        self.regions.extend(state.unsettled(&failed, failure));
        self.left.extend(std::iter::repeat_n(failure, failed.len().max(1)));
        if failed.is_empty() {
            self.blocked.fill(true);
        }
        failed.iter().for_each(|piece| self.blocked[*piece as usize] = true);
    }
}

/// Attempts, each without the clusters that failed before.
fn attempt_until_done(mut state: State<'_, '_, '_>, by: &Attempt<'_>, means: &Means<'_>) -> Result<Resolved> {
    let mut failed = Failed::default();
    let mut at_first = None;
    let mut attempts = 0;
    loop {
        attempts += 1;
        let pieces = pieces::pieces(state.survey, state.work, state.reversed);
        failed.blocked.resize(pieces.list.len(), false);
        failed.levels.resize(pieces.list.len(), Level::default());
        let (bodies, volume) = *at_first.get_or_insert_with(|| measured(&pieces));
        if attempts > ATTEMPTS {
            // With all of them blocked there is nothing to fail with.
            failed.blocked.fill(true);
        }
        state.clusters = Clusters::of(&pieces, &failed.blocked);
        state.first_triangle = state.work.triangles.len() as u32;
        state.first_vertex = state.work.positions.len() as Vertex;
        let taken_part: Vec<bool> = (0..state.work.triangles.len() as u32).map(|t| state.clusters.holds(t)).collect();
        match state.attempt(&Attempt { levels: &failed.levels, ..*by }) {
            Ok(resolved) => {
                let left = state.drop_specks();
                let (dust, left) = state.drop_dust(&pieces, left);
                let (bodies_now, volume_now) = measured(&left);
                return Ok(Resolved {
                    bodies: bodies.saturating_sub(bodies_now),
                    volume: state.survey.measure.volume(Extent { area: 0, volume: volume - volume_now }),
                    left: counted(failed.left),
                    regions: state.track.regions(&mut state.clusters),
                    regions_left: failed.regions,
                    taken_part,
                    dust,
                    divided: true,
                    ..resolved
                });
            }
            Err(Halted::NoMemory { needed, triangles }) => return Err(refused(means, needed, triangles)),
            Err(Halted::Cancelled) => return Err(Error::cancelled(means.path, RepairName::SelfIntersection.as_str())),
            Err(Halted::Stuck(stuck)) => failed.learn(&mut state, stuck),
        }
    }
}

/// Gathers the stars of the vertices at these positions into the submesh, so that regular surface on the two sides of what crosses is two
/// patches.
fn divide(
    survey: &mut Survey<'_>,
    work: &mut Work<'_>,
    reversed: &mut Reversed,
    positions: Vec<[f32; 3]>,
    means: &Means<'_>,
) -> Result<()> {
    work.forget_edges();
    let Division { fetched, divided_from } = survey.divide(means.path, &positions, means.limits, means.progress)?;
    let first = work.extend_at(survey, &fetched, &positions);
    for t in first..work.triangles.len() as u32 {
        join_in(work, reversed, t);
    }
    work.follow_division(survey);
    let of = |all: &[bool]| divided_from.iter().map(|region| all.get(*region as usize) == Some(&true)).collect();
    *reversed = Reversed { regions: of(&reversed.regions), dropped: of(&reversed.dropped) };
    Ok(())
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

impl State<'_, '_, '_> {
    /// Drops closed surfaces of nothing but parts of triangles that are no thicker than what rounding moves: they are nothing but that. So do those
    /// with other triangles, too, that are far thinner: what was cut off one and is next to nothing. Returns the pieces that there are then.
    fn drop_specks(&mut self) -> Components {
        let pieces = pieces::pieces(self.survey, self.work, self.reversed);
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
        for piece in pieces.of_region.iter().filter(|piece| **piece != NONE) {
            (is_flake[*piece as usize], is_speck[*piece as usize]) = (false, false);
        }
        let goes = |t: u32| {
            let piece = pieces.of_triangle[t as usize] as usize;
            is_speck[piece] || is_flake[piece] && is_cut[piece]
        };
        let specks: Vec<u32> = self.work.living().filter(|t| goes(*t)).collect();
        if specks.is_empty() {
            return pieces;
        }
        specks.into_iter().for_each(|t| self.work.kill(t));
        pieces::pieces(self.survey, self.work, self.reversed)
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

/// What cutting so many triangles along each other needs, beside what there is.
fn refused(means: &Means<'_>, needed: u64, triangles: usize) -> Error {
    let mebibytes = |bytes: u64| bytes.div_ceil(1 << 20);
    Error::Starved {
        path: means.path.into(),
        reason: format!(
            "cutting {} triangles along what they cross needs about {} MiB of memory",
            Count(triangles),
            Count(mebibytes(needed))
        ),
        advice: format!(
            "the budget is {} MiB: raise --memory, or leave crossings (resolve_crossings)",
            Count(means.limits.memory_bytes >> 20)
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
