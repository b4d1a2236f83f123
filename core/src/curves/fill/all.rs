//! All outlines of a network of curves: the faces that its file says, or the loops that its curves form.

use std::collections::BTreeMap;

use super::entry::{FillError, Filled, fill};
use super::nest;
use super::options::{Options, Outline};
use crate::curves::curve::Shape;
use crate::curves::loops::{self, Loops};
use crate::curves::vector::{Point, distance, dot};
use crate::curves::{Network, Use};

/// Points at which two curves are compared, but one, and how far they may be apart there, in lengths.
const SAMPLES: u32 = 8;
const NEAR: f64 = 1e-5;

/// The outlines of a network, filled.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct FilledNetwork {
    /// The loops of its curves; of faces that the file says, none are looked for.
    pub loops: Option<Loops>,
    /// What was filled; numbers of curves are those of the network, and go on with those that close gaps.
    pub outlines: Vec<Outline>,
    /// What came of each.
    pub filled: Filled,
}

impl FilledNetwork {
    /// The shapes of all curves by their numbers.
    #[must_use]
    pub fn shapes<'n>(&'n self, network: &'n Network) -> Vec<&'n Shape> {
        let added = self.loops.iter().flat_map(|loops| &loops.added);
        network.curves.iter().chain(added).map(|curve| &curve.shape).collect()
    }
}

/// The outlines with one curve for those that run along each other: faces that are trimmed one by one each have their own, and meet along them.
fn with_shared_curves(shapes: &[&Shape], mut outlines: Vec<Outline>, doubles: &[(usize, usize)]) -> Vec<Outline> {
    let stands: BTreeMap<usize, (usize, bool)> = doubles
        .iter()
        .filter_map(|(own, other)| {
            let (a, b) = (*shapes.get(*own)?, *shapes.get(*other)?);
            are_one(a, b).then(|| (*own, (*other, run_against(a, b))))
        })
        .collect();
    for outline in &mut outlines {
        for one in std::iter::once(&mut outline.outer).chain(&mut outline.inner).flatten() {
            if let Some((other, is_against)) = stands.get(&one.curve) {
                *one = Use { curve: *other, is_reversed: one.is_reversed != *is_against };
            }
        }
    }
    outlines
}

/// Whether a curve may stand for another that it runs along: no point of it that is looked at is farther than the surfaces are held to their curves.
fn are_one(a: &Shape, b: &Shape) -> bool {
    let [low, high] = a.domain();
    let points: Vec<Point> = (0..=SAMPLES).map(|k| a.point(low + (high - low) * f64::from(k) / f64::from(SAMPLES))).collect();
    let room = NEAR * points.iter().zip(points.iter().skip(1)).map(|(p, q)| distance(*p, *q)).sum::<f64>();
    points.into_iter().all(|point| distance(point, b.point(b.nearest(point))) <= room)
}

/// Of two curves that run along each other, whether they do so in different directions: told in the middle of the first.
fn run_against(a: &Shape, b: &Shape) -> bool {
    let [low, high] = a.domain();
    let middle = low + 0.5 * (high - low);
    dot(a.derivative(middle), b.derivative(b.nearest(a.point(middle)))) < 0.0
}

/// Fills the faces that a file says, where it says any and `from_faces` asks for them; else the closed loops of its curves, of which those within others of
/// their plane bound holes. As [`fill`].
///
/// # Errors
/// As [`fill`].
pub fn fill_network(
    network: &Network,
    (from_faces, how): (bool, &loops::Options),
    options: &Options,
) -> Result<FilledNetwork, FillError> {
    let faces: Vec<Outline> = network.faces.iter().filter(|face| !face.outer.is_empty()).map(Outline::from).collect();
    if from_faces && !faces.is_empty() {
        let shapes: Vec<&Shape> = network.curves.iter().map(|curve| &curve.shape).collect();
        let outlines = with_shared_curves(&shapes, faces, &loops::find(network, how).doubles);
        let filled = fill(&shapes, &outlines, options)?;
        return Ok(FilledNetwork { loops: None, outlines, filled });
    }
    let found = loops::find(network, how);
    let shapes: Vec<&Shape> = network.curves.iter().chain(&found.added).map(|curve| &curve.shape).collect();
    let uses: Vec<_> = found.loops.iter().map(|own| own.uses.clone()).collect();
    let outlines = nest::outlines(&shapes, &uses);
    let filled = fill(&shapes, &outlines, options)?;
    drop(shapes);
    Ok(FilledNetwork { loops: Some(found), outlines, filled })
}
