//! Simplification of triangle meshes by edge collapse, with what it changes bounded and proved.
//!
//! **In:** points, faces, which faces may change, what is wanted: a count, a share, a deviation.
//! **Out:** points, faces, where each face is from, and bounds of the distance both ways.
//! **Promise:** no triangle crosses another one that did not before; closed stays closed; what may not change has the same bits. The same
//! result for any number of threads.

mod cell;
mod course;
mod crossed;
mod guard;
mod held;
mod legal;
mod net;
mod parting;
mod partition;
mod patch;
mod quadric;
mod queue;
mod rounds;
mod task;
#[cfg(test)]
mod tests;

use rayon::prelude::*;

use crate::geometry::exact::Point;
use crate::geometry::sums::{Bounds, Extent, Measure};
use crate::proof;
use crate::simplify::course::Course;
use crate::simplify::held::Held;
pub(crate) use crate::simplify::task::{Ended, Input, Options, Outcome};

/// Faces that a thread measures at once.
const BLOCK: usize = 1 << 12;

/// Vertices of a cell: its arrays stay in the cache of one core.
const CELL: usize = 12_000;

/// The largest deviation where a count is wanted and no deviation is given, as a share of the diagonal of the box around all points: a count that is out
/// of reach is not paid for by the shape.
pub(crate) const MOST_DEVIATION: f64 = 0.01;

/// Times that places which miss the deviation are done again, or all, at most.
const ATTEMPTS: usize = 16;

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

/// Simplifies a mesh. O(n log n), 150 bytes a triangle.
///
/// A deviation that is wanted is kept: where the proof finds more, the vertices there are parted again, less is aimed at, and these places alone are done
/// and proved anew, or all, where that would be nearly everything; in the end nothing is changed.
///
/// # Errors
/// [`Error`]: the input is no mesh.
pub(crate) fn simplify(input: &Input<'_>, options: &Options) -> Result<Outcome, Error> {
    in_cells(input, options, CELL)
}

fn in_cells(input: &Input<'_>, options: &Options, cell: usize) -> Result<Outcome, Error> {
    check(input)?;
    let mut held = Held::new(input);
    let bounds = Bounds::of(input.points);
    let most = most(options, &bounds);
    let feature = options.feature_angle.map_or(-2.0, f64::cos);
    let mut course = Course { input, options, most, cell, feature, unit: unit(bounds.diagonal()), aim: 1.0 };
    let mut made = course.first(&held);
    if !options.prove && options.max_deviation.is_none() {
        return Ok(measured(made.outcome(input), input, &bounds));
    }
    let enough = options.enough.or(options.max_deviation.filter(|most| most.is_finite())).unwrap_or(0.0);
    let mut verdict = proof::prove(&made.pairing(input), most, enough);
    let mut first = None;
    loop {
        let worst = verdict.proved.forward.max(verdict.proved.backward);
        if worst <= most {
            break;
        }
        held.hold(input, &verdict.far, most);
        if held.attempt > ATTEMPTS {
            return Ok(measured(course.unchanged(held.attempt), input, &bounds));
        }
        let first = first.get_or_insert_with(|| course.net(&held));
        if let Some(next) = course.redo(&made, first, &held) {
            verdict = proof::prove_again(&next.pairing(input), &made.changes(&next, input, &verdict), (most, enough));
            made = next;
        } else {
            course.aim_lower(worst);
            held.free(input);
            made = course.first(&held);
            verdict = proof::prove(&made.pairing(input), most, enough);
        }
    }
    let mut outcome = made.outcome(input);
    outcome.attempts = held.attempt + 1;
    outcome.proved = Some(verdict.proved);
    if held.attempt > 0 && outcome.ended == Ended::Edges {
        outcome.ended = Ended::Both;
    }
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

/// The power of two by which a length becomes about 1.
fn unit(length: f64) -> f64 {
    if length > 0.0 { 2.0_f64.powi(-length.log2().floor() as i32) } else { 1.0 }
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
