//! Simplification of triangle meshes by edge collapse, with what it changes bounded and proved.
//!
//! **In:** points, faces, which faces may change, what is wanted: a count, a share, a deviation.
//! **Out:** points, faces, where each face is from, and bounds of the distance both ways.
//! **Promise:** no triangle crosses another one that did not before; closed stays closed; what may not change has the same bits. The same
//! result for any number of threads.

mod cell;
mod guard;
mod heap;
mod legal;
mod net;
mod partition;
mod patch;
mod quadric;
mod rounds;
#[cfg(test)]
mod tests;

use crate::geometry::exact::Point;
use crate::proof::{self, Pairing, Proved};
use crate::simplify::cell::Rules;
use crate::simplify::net::{Constraints, Net};
use crate::simplify::partition::Parting;
use crate::simplify::rounds::Goal;
use crate::util::ids::NONE;

/// Vertices of a cell: its arrays stay in the cache of one core.
const CELL: usize = 12_000;

/// The largest value of a quadric, in squares of the deviation that is wanted: a quadric is a sum over many planes, so that a bumpy surface whose
/// quadrics are up to the square itself deviates by half as much (measured).
const LIMIT: f64 = 2.0;

/// Times that all is done to keep a deviation, at most.
const ATTEMPTS: usize = 6;

/// What is to be simplified.
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

/// What is wanted.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Options {
    /// Stop at so many triangles.
    pub triangles: Option<usize>,
    /// The largest distance between any point of one surface and the other surface, both ways, in the unit of the points.
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
    /// Cells that were done again with exact tests of each collapse, since triangles crossed in them.
    #[allow(dead_code, reason = "tests count them")]
    pub redone: usize,
    /// How often all was done, with more and more vertices held, until the deviation was kept.
    pub attempts: usize,
}

/// Simplifies a mesh. O(n log n), 150 bytes a triangle.
///
/// A deviation that is wanted is kept: where the proof finds more, the vertices there are held, and all is done again, with more held each time; in
/// the end nothing is changed.
///
/// # Errors
/// [`Error`]: the input is no mesh.
pub(crate) fn simplify(input: &Input<'_>, options: &Options) -> Result<Outcome, Error> {
    in_cells(input, options, CELL)
}

fn in_cells(input: &Input<'_>, options: &Options, cell: usize) -> Result<Outcome, Error> {
    check(input)?;
    let mut fixed = fixed(input);
    let most = options.max_deviation.unwrap_or(f64::INFINITY);
    for attempt in 0..ATTEMPTS {
        let mut outcome = attempt_one(input, options, &fixed, cell);
        outcome.attempts = attempt + 1;
        if !options.prove && options.max_deviation.is_none() {
            return Ok(outcome);
        }
        let pairing = Pairing {
            points: input.points,
            faces: input.faces,
            new_points: &outcome.points,
            new_faces: &outcome.faces,
            became: &outcome.became,
        };
        let (proved, far) = proof::prove(&pairing, most);
        outcome.proved = Some(proved);
        if proved.forward.max(proved.backward) <= most {
            return Ok(outcome);
        }
        hold(input, &far, attempt, &mut fixed);
    }
    let mut outcome = attempt_one(input, options, &vec![true; input.points.len()], cell);
    outcome.attempts = ATTEMPTS + 1;
    outcome.proved = Some(Proved::default());
    Ok(outcome)
}

/// Holds the vertices of triangles that went too far, and more around them each time.
fn hold(input: &Input<'_>, far: &[u32], rings: usize, fixed: &mut [bool]) {
    let mut is_near = vec![false; fixed.len()];
    far.iter().flat_map(|f| input.faces[*f as usize]).for_each(|v| is_near[v as usize] = true);
    for _ in 0..rings {
        let before = is_near.clone();
        for face in input.faces.iter().filter(|face| face.iter().any(|v| before[*v as usize])) {
            face.iter().for_each(|v| is_near[*v as usize] = true);
        }
    }
    fixed.iter_mut().zip(is_near).for_each(|(fixed, near)| *fixed |= near);
}

fn attempt_one(input: &Input<'_>, options: &Options, fixed: &[bool], cell: usize) -> Outcome {
    let cosine = |angle: f64| angle.clamp(0.0, std::f64::consts::FRAC_PI_2).cos();
    let feature = options.feature_angle.map_or(-2.0, f64::cos);
    let mut net = Net::new(input.points, input.faces, &Constraints { fixed, feature });
    let limit = options.max_deviation.map_or(f64::INFINITY, |d| LIMIT * d * d);
    let shape = legal::Bounds { turn: cosine(options.max_turn), feature };
    let rules = Rules { shape, limit, optimal: options.optimal };
    let mut became: Vec<u32> = (0..input.points.len() as u32).collect();
    let mut redone = 0;
    let wanted = options.triangles.unwrap_or(0);
    for (below, margin) in [(0.5, 1.4), (0.41, 1.0), (0.56, 1.0)] {
        if net.faces.len() <= wanted {
            break;
        }
        let before = net.faces.len();
        let is_whole = net.points.len() <= cell;
        let goal = Goal { triangles: wanted, margin };
        let (map, again) = rounds::round(&mut net, rules, Parting { most: cell, below }, goal);
        became.iter_mut().filter(|v| **v != NONE).for_each(|v| *v = map[*v as usize]);
        redone += again;
        if is_whole || net.faces.len() == before {
            break;
        }
    }
    let same = |(face, origin): (&[u32; 3], &u32)| {
        let was = input.faces[*origin as usize];
        let is_same = (0..3).all(|k| input.points[was[k] as usize] == net.points[face[k] as usize]);
        if is_same { *origin } else { NONE }
    };
    let origins = net.faces.iter().zip(&net.origins).map(same).collect();
    Outcome { points: net.points, faces: net.faces, origins, became, proved: None, redone, attempts: 0 }
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
