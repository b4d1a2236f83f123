//! Simplification of triangle meshes by edge collapse, with what it changes bounded and proved.
//!
//! **In:** points, faces, which faces may change, what is wanted: a count, a share, a deviation.
//! **Out:** points, faces, where each face is from, and bounds of the distance both ways.
//! **Promise:** no triangle crosses another one that did not before; closed stays closed; what may not change has the same bits. The same
//! result for any number of threads.

mod cell;
mod guard;
mod legal;
mod net;
mod partition;
mod patch;
mod quadric;
mod queue;
mod rounds;
#[cfg(test)]
mod tests;

use rayon::prelude::*;

use crate::geometry::exact::Point;
use crate::geometry::sums::{Bounds, Extent, Measure};
use crate::proof::{self, Pairing, Proved};
use crate::simplify::cell::{LIMITS, Rules};
use crate::simplify::net::{Constraints, Net};
use crate::simplify::partition::Parting;
use crate::simplify::rounds::Goal;
use crate::util::ids::NONE;

/// Faces that a thread measures at once.
const BLOCK: usize = 1 << 12;

/// Vertices of a cell: its arrays stay in the cache of one core.
const CELL: usize = 12_000;

/// The largest mean of squared distances from the planes of a quadric, in squares of the deviation that is wanted. A surface goes about three times as far at
/// its farthest place as in the mean: of a bumpy torus, with 0.12 as many triangles are left as it takes, with 0.25 the deviation is missed in many places
/// (measured).
const LIMIT: f64 = 0.12;

/// Where the deviation is missed, half of it is aimed at instead, then a quarter; then all stays.
const STRICTER: f64 = 0.25;

/// So many times this is done for the places that missed it alone; then all is stricter each time. After three times, a few places of a bumpy sphere
/// were left, and to be stricter with all doubled the triangles (measured).
const LOCAL_ATTEMPTS: usize = 6;

/// The largest deviation where a count is wanted and no deviation is given, as a share of the diagonal of the box around all points: a count that is out
/// of reach is not paid for by the shape.
const MOST_DEVIATION: f64 = 0.01;

/// Rounds, at most: the share of vertices below each plane that parts cells, and the margin of the count. The first one leaves a margin, so that what
/// cells share is not left fine for good; later ones are for what others left between their cells.
const ROUNDS: [(f64, f64); 6] = [(0.5, 1.4), (0.41, 1.0), (0.56, 1.0), (0.46, 1.0), (0.61, 1.0), (0.38, 1.0)];

/// So many of them where no count is wanted: one for all, two for what cells share.
const ROUNDS_WITHOUT_COUNT: usize = 3;

/// Times that all is done to keep a deviation, at most.
const ATTEMPTS: usize = 8;

/// A mesh that is to be simplified.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Input<'a> {
    /// Positions of vertices, finite.
    pub points: &'a [Point],
    /// Vertices of faces.
    pub faces: &'a [[u32; 3]],
    /// Which faces may change; all of them if it is `None`.
    pub region: Option<&'a [bool]>,
    /// Which vertices stay as they are, besides those of faces that may not change.
    pub fixed: Option<&'a [bool]>,
}

/// Wishes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Options {
    /// Stop at so many triangles.
    pub triangles: Option<usize>,
    /// The largest distance between any point of one surface and the other surface, both ways, in the unit of the points. Where only a count is
    /// given, it is a hundredth of the diagonal of the box around the points; infinity is no bound.
    pub max_deviation: Option<f64>,
    /// Edges are features, and stay, where the normals of their triangles differ by more than this angle, in radians.
    pub feature_angle: Option<f64>,
    /// A collapse turns no triangle by more than this angle, in radians.
    pub max_turn: f64,
    /// New vertices may lie where the quadric is least, besides at the ends and in the middle of an edge.
    pub optimal: bool,
    /// Bounds of the deviation are proved, also where none is wanted.
    pub prove: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self { triangles: None, max_deviation: None, feature_angle: None, max_turn: 1.2, optimal: true, prove: true }
    }
}

/// Why nothing was simplified.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum Error {
    /// A face has a vertex that is not there.
    #[error("face {0} has a vertex that is not there")]
    NoVertex(usize),
    /// A coordinate is no number.
    #[error("vertex {0} has a coordinate that is not finite")]
    NotFinite(usize),
    /// More corners or vertices than numbers of 32 bits.
    #[error("the mesh is too large")]
    TooLarge,
}

/// Why no more was simplified.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub(crate) enum Ended {
    /// The count that was wanted is reached.
    Count,
    /// More would deviate too far.
    Deviation,
    /// No more edge may collapse: for what stays, the topology, the shape of triangles, or what they would cross.
    #[default]
    Edges,
}

/// The simplified mesh.
#[derive(Clone, Debug, Default)]
pub(crate) struct Outcome {
    /// Positions of vertices.
    pub points: Vec<Point>,
    /// Vertices of faces.
    pub faces: Vec<[u32; 3]>,
    /// For each face, the input's face that it is, with the same three positions; `u32::MAX` for a new one.
    pub origins: Vec<u32>,
    /// For each vertex of the input, the vertex that it has become.
    pub became: Vec<u32>,
    /// Bounds of the distance between the two surfaces, proved; `None` if they were not asked for.
    pub proved: Option<Proved>,
    /// Why no more was simplified.
    pub ended: Ended,
    /// The volume before and after, signed, as seen from the middle of the input's box; it means something where the surface is closed.
    pub volume: [f64; 2],
    /// Cells that were done again with exact tests of each collapse, since triangles crossed in them.
    #[allow(dead_code, reason = "tests count them")]
    pub redone: usize,
    /// How often all was done, with less and less aimed at where it was missed, until the deviation was kept.
    pub attempts: usize,
}

/// Simplifies a mesh. O(n log n), 150 bytes a triangle.
///
/// A deviation that is wanted is kept: where the proof finds more, less is aimed at there, and all is done again, with less aimed at each time; in
/// the end nothing is changed.
///
/// # Errors
/// [`Error`]: the input is no mesh.
pub(crate) fn simplify(input: &Input<'_>, options: &Options) -> Result<Outcome, Error> {
    in_cells(input, options, CELL)
}

fn in_cells(input: &Input<'_>, options: &Options, cell: usize) -> Result<Outcome, Error> {
    check(input)?;
    let mut held = Held { fixed: fixed(input), strict: vec![0; input.points.len()], attempt: 0 };
    let bounds = Bounds::of(input.points);
    let most = most(options, &bounds);
    for attempt in 0..ATTEMPTS {
        let (mut outcome, open) = attempt_one(input, options, &held, (most, cell));
        outcome.attempts = attempt + 1;
        if !options.prove && options.max_deviation.is_none() {
            return Ok(measured(outcome, input, &bounds));
        }
        let pairing = Pairing {
            points: input.points,
            faces: input.faces,
            new_points: &outcome.points,
            new_faces: &outcome.faces,
            became: &outcome.became,
            open: &open,
        };
        let (proved, far) = proof::prove(&pairing, most, options.max_deviation.is_none());
        outcome.proved = Some(proved);
        if proved.forward.max(proved.backward) <= most {
            if attempt > 0 && outcome.ended == Ended::Edges {
                outcome.ended = Ended::Deviation;
            }
            return Ok(measured(outcome, input, &bounds));
        }
        held.hold(input, &far, most);
    }
    held.fixed.fill(true);
    let (mut outcome, _) = attempt_one(input, options, &held, (most, cell));
    outcome.attempts = ATTEMPTS + 1;
    outcome.proved = Some(Proved::default());
    outcome.ended = Ended::Deviation;
    Ok(measured(outcome, input, &bounds))
}

/// The largest deviation that may be.
fn most(options: &Options, bounds: &Bounds) -> f64 {
    match (options.max_deviation, options.triangles) {
        (Some(most), _) => most.max(0.0),
        (None, Some(_)) => MOST_DEVIATION * bounds.diagonal(),
        (None, None) => f64::INFINITY,
    }
}

/// Fills in the volumes.
fn measured(mut outcome: Outcome, input: &Input<'_>, bounds: &Bounds) -> Outcome {
    let measure = Measure::new(bounds);
    outcome.volume = [(input.points, input.faces), (&outcome.points, &outcome.faces)].map(|(points, faces)| {
        let of = |block: &[[u32; 3]]| {
            let triangles: Vec<[Point; 3]> = block.iter().map(|face| face.map(|v| points[v as usize])).collect();
            measure.sum(&triangles)
        };
        let sums: Vec<Extent> = faces.par_chunks(BLOCK).map(of).collect();
        let mut all = Extent::default();
        sums.into_iter().for_each(|sum| all += sum);
        measure.volume(all)
    });
    outcome
}

/// Vertices that are held back, and more of them with each attempt.
struct Held {
    fixed: Vec<bool>,
    /// By which of the limits vertices are judged.
    strict: Vec<u8>,
    attempt: usize,
}

impl Held {
    /// Less is aimed at for the vertices of triangles that went too far, by as much as they did, and for more around them each time.
    fn hold(&mut self, input: &Input<'_>, far: &[(u32, f64)], most: f64) {
        // By how many limits each vertex is judged more strictly; each one is of half the distance of the one before.
        let mut more = vec![0_u8; self.fixed.len()];
        for (f, bound) in far {
            let halves = (bound / most).log2().ceil().clamp(1.0, LIMITS as f64) as u8;
            input.faces[*f as usize].into_iter().for_each(|v| more[v as usize] = more[v as usize].max(halves));
        }
        for _ in 0..=self.attempt {
            let before = more.clone();
            for face in input.faces {
                let most = face.iter().map(|v| before[*v as usize]).fold(0, u8::max);
                face.iter().for_each(|v| more[*v as usize] = more[*v as usize].max(most));
            }
        }
        for ((fixed, strict), more) in self.fixed.iter_mut().zip(&mut self.strict).zip(more) {
            *strict = strict.saturating_add(more);
            *fixed |= usize::from(*strict) >= LIMITS;
        }
        self.attempt += 1;
    }
}

/// Simplifies once. Returns the input's vertices whose triangles form no closed fan, too.
fn attempt_one(input: &Input<'_>, options: &Options, held: &Held, (most, cell): (f64, usize)) -> (Outcome, Vec<u32>) {
    let cosine = |angle: f64| angle.clamp(0.0, std::f64::consts::FRAC_PI_2).cos();
    let feature = options.feature_angle.map_or(-2.0, f64::cos);
    let mut net = Net::new(input.points, input.faces, &Constraints { fixed: &held.fixed, strict: &held.strict, feature });
    let shape = legal::Bounds { turn: cosine(options.max_turn), feature };
    let limit = LIMIT * most * most * STRICTER.powi(held.attempt.saturating_sub(LOCAL_ATTEMPTS) as i32);
    let limits = std::array::from_fn(|strict| limit * STRICTER.powi(strict as i32));
    let rules = Rules { shape, limits, optimal: options.optimal };
    let mut became: Vec<u32> = (0..input.points.len() as u32).collect();
    let (mut redone, mut is_limited) = (0, false);
    let wanted = options.triangles.unwrap_or(0);
    let rounds = if wanted == 0 { ROUNDS_WITHOUT_COUNT } else { ROUNDS.len() };
    for (below, margin) in ROUNDS.into_iter().take(rounds) {
        if net.faces.len() <= wanted {
            break;
        }
        let before = net.faces.len();
        let is_whole = net.points.len() <= cell;
        let goal = Goal { triangles: wanted, margin };
        let round = rounds::round(&mut net, rules, Parting { most: cell, below }, goal);
        became.par_iter_mut().filter(|v| **v != NONE).for_each(|v| *v = round.became[*v as usize]);
        redone += round.redone;
        is_limited = round.is_limited;
        // A round with a margin may have nothing to do, and the next one much.
        if is_whole || (net.faces.len() == before && margin <= 1.0) {
            break;
        }
    }
    let ended = match options.triangles {
        Some(wanted) if net.faces.len() <= wanted => Ended::Count,
        _ if is_limited => Ended::Deviation,
        _ => Ended::Edges,
    };
    let same = |(face, origin): (&[u32; 3], &u32)| {
        let was = input.faces[*origin as usize];
        let is_same = (0..3).all(|k| input.points[was[k] as usize] == net.points[face[k] as usize]);
        if is_same { *origin } else { NONE }
    };
    let origins = net.faces.iter().zip(&net.origins).map(same).collect();
    let outcome = Outcome { points: net.points, faces: net.faces, origins, became, ended, redone, ..Outcome::default() };
    (outcome, net.open)
}

fn check(input: &Input<'_>) -> Result<(), Error> {
    if input.faces.len() >= (u32::MAX / 3) as usize || input.points.len() >= u32::MAX as usize {
        return Err(Error::TooLarge);
    }
    let is_there = |face: &[u32; 3]| face.iter().all(|v| (*v as usize) < input.points.len());
    if let Some(face) = input.faces.iter().position(|face| !is_there(face)) {
        return Err(Error::NoVertex(face));
    }
    let is_finite = |p: &Point| p.iter().all(|x| x.is_finite());
    input.points.iter().position(|p| !is_finite(p)).map_or(Ok(()), |v| Err(Error::NotFinite(v)))
}

/// Vertices that stay as they are: those of faces that may not change.
fn fixed(input: &Input<'_>) -> Vec<bool> {
    let mut fixed = vec![false; input.points.len()];
    if let Some(own) = input.fixed {
        fixed.iter_mut().zip(own).for_each(|(fixed, own)| *fixed = *own);
    }
    if let Some(region) = input.region {
        for (f, face) in input.faces.iter().enumerate() {
            if !region.get(f).copied().unwrap_or(false) {
                face.iter().for_each(|v| fixed[*v as usize] = true);
            }
        }
    }
    fixed
}
