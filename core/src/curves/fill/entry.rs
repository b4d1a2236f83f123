//! Outlines filled: the way in.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use super::chords::{self, Chord};
use super::faces::Origin;
use super::layout::{Corner, Rim};
use super::mesh::Mesh;
use super::network::{self, Divided, Strands};
use super::options::{Continuity, Options, Outline};
use super::orient;
use super::patch::{Patch, Task};
use super::poor::Split;
use super::report::{Report, Surface};
use super::space;
use super::strand::Strand;
use super::tangent::{self, Beside};
use super::tried::Tried;
use crate::curves::curve::{Shape, Spline};
use crate::curves::vector::Point;

/// Edges of curves may be longer than those within by this factor.
const COARSER: f64 = 1.3;

/// Rounds in which curves are divided for the sake of triangles, at most.
const ROUNDS: u32 = 24;

/// Points of its rings that an outline may be meshed with in all rounds: so many, or so many times those that it has at first.
const MOST_WORK: (usize, usize) = (40_000, 3);

/// Times that all rounds are done again, at most.
const AGAIN: u32 = 3;
/// An outline whose triangles have not become better in so many rounds is too narrow to be divided.
const PATIENCE: u32 = 6;

/// Filled outlines.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Filled {
    /// Of each outline.
    pub surfaces: Vec<Surface>,
    /// Of all outlines.
    pub mesh: Mesh,
    /// Of each outline.
    pub reports: Vec<Report>,
    /// Curves as cubic B-splines on 0 to 1, where a Coons surface or one to a centre needs them.
    pub curves: Vec<Option<Spline>>,
}

/// Why nothing is filled.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FillError {
    /// An outline has a curve that there is none of.
    #[error("outline {outline} has the curve {curve}, which is none")]
    Unknown {
        /// Number of the outline.
        outline: usize,
        /// Number of the curve.
        curve: usize,
    },
    /// More than 2³² points.
    #[error("the mesh has more points than can be counted")]
    Large,
}

/// Fills outlines. `shapes` are those of the curves, by the numbers that outlines use (of curves that close gaps, too).
///
/// Each curve is divided once, by the finest wish of its outlines. An outline in a plane is trimmed from it; one on a cylinder,
/// cone, sphere or torus, from that; others are Coons surfaces of two to four sides (of two or three if no such surface is fixed by the
/// circles and straight lines of the outline, with the other curves no farther from it than 2 · 10⁻⁴ of the size), upon a surface of
/// revolution where one nearly has these, and with the tangent planes of their neighbours where [`Options::continuity`] asks for them; where they fold, heights of
/// a thin plate over a plane; where that crosses itself, a cone to a centre, or one for each curve, if no curves cross as seen from
/// there. What folds then is left, [`Surface::Fallback`].
///
/// O(points · log points), in parallel over curves and outlines.
///
/// # Errors
/// [`FillError`] of curves that do not exist, and of too many points.
pub fn fill(shapes: &[&Shape], outlines: &[Outline], options: &Options) -> Result<Filled, FillError> {
    fill_beside(shapes, outlines, &[], options)
}

/// As [`fill`], beside faces that are none of the outlines, whose tangent planes blended surfaces get with [`Continuity::Tangent`].
///
/// # Errors
/// As [`fill`].
///
/// [`Continuity::Tangent`]: super::Continuity::Tangent
pub fn fill_beside(
    shapes: &[&Shape],
    outlines: &[Outline],
    beside: &[Beside<'_>],
    options: &Options,
) -> Result<Filled, FillError> {
    options.with_threads(|| made(shapes, (outlines, &[]), beside, options))
}

/// As [`fill`], with what a file says of its outlines, and the threads that there are.
pub(super) fn fill_told(shapes: &[&Shape], outlines: (&[Outline], &[Origin]), options: &Options) -> Result<Filled, FillError> {
    made(shapes, outlines, &[], options)
}

/// Fills outlines with the threads that there are.
fn made(
    shapes: &[&Shape],
    (outlines, origins): (&[Outline], &[Origin]),
    beside: &[Beside<'_>],
    options: &Options,
) -> Result<Filled, FillError> {
    let strands = strands(shapes, outlines)?;
    let tried: Vec<Tried> = (0..outlines.len())
        .map(|number| Tried { told: origins.get(number).and_then(|origin| origin.told), ..Tried::default() })
        .collect();
    let mut divided = network::divide(&strands, outlines, options, &[]);
    if options.size.is_none() {
        // Curves are divided as finely as their surfaces have to be, else triangles between both would be flat.
        let dry = tasks((&strands, &tried), (outlines, &[]), options, &divided, true);
        let longest: Vec<f64> = dry.par_iter().map(|task| COARSER * task.run().longest).collect();
        if network::is_coarser(&divided, &longest) {
            divided = network::divide(&strands, outlines, options, &longest);
        }
    }
    let mut patches = evened((&strands, &tried), outlines, options, &mut divided);
    let meshes: Vec<&[[Corner; 3]]> = patches.iter().map(|patch| patch.triangles.as_slice()).collect();
    let chords = chords::shared(&meshes, divided.curves.par_iter().map(Vec::as_slice));
    let tasks = tasks((&strands, &tried), (outlines, &chords), options, &divided, false);
    patches.par_iter_mut().zip(&tasks).filter(|(_, task)| !task.chords.is_empty()).for_each(|(patch, task)| *patch = task.run());
    if options.continuity == Continuity::Tangent {
        tangent::bend(&tasks, &mut patches, beside);
    }
    collected(divided.points, patches, (strands, outlines), origins)
}

/// Patches of outlines, whose curves are divided until triangles are even or for so many rounds. If some outlines were better before, all is done
/// again, and these wish nothing after the round in which they were best: it only makes those beside them finer. Where an outline lost its surface by that,
/// nothing that shares its curves wishes anything.
fn evened<'a>(
    known: (&'a Strands<'a>, &'a [Tried]),
    outlines: &'a [Outline],
    options: &'a Options,
    divided: &mut Divided,
) -> Vec<Patch> {
    let mut patches: Vec<Patch> = tasks(known, (outlines, &[]), options, divided, false).par_iter().map(Task::run).collect();
    if patches.iter().all(|patch| patch.splits.is_empty()) {
        return patches;
    }
    let before = divided.clone();
    let points = |rings: &[Vec<Rim>]| rings.iter().map(Vec::len).sum::<usize>();
    let mut work: Vec<usize> = divided.rings.iter().map(|rings| MOST_WORK.0.max(MOST_WORK.1 * points(rings))).collect();
    let mut limits = vec![ROUNDS; outlines.len()];
    for time in 0..=AGAIN {
        let (first, best) = rounds((known, outlines, options), divided, &mut patches, (&limits, &mut work));
        let mut is_any = false;
        for ((patch, (fewest, at)), limit) in patches.iter().zip(best).zip(&mut limits) {
            // An outline that has never become better is best before all rounds.
            if at < *limit && (patch.flaws() > fewest || (at == 0 && fewest > 0)) {
                (*limit, is_any) = (at, true);
            }
        }
        let is_lost = |number: &usize| first.get(number).is_some_and(|old| old.is_filled() && !patches[*number].is_filled());
        let lost: Vec<usize> = (0..outlines.len()).filter(is_lost).collect();
        for number in sharing(outlines, &lost) {
            (limits[number], is_any) = (0, true);
        }
        if !is_any || (time == AGAIN && lost.is_empty()) {
            break;
        }
        divided.clone_from(&before);
        for (number, patch) in first {
            patches.iter_mut().skip(number).take(1).for_each(|old| old.clone_from(&patch));
        }
    }
    patches
}

/// The outlines that have a curve of one of these. O(uses).
fn sharing(outlines: &[Outline], numbers: &[usize]) -> Vec<usize> {
    if numbers.is_empty() {
        return Vec::new();
    }
    let curves = |outline: &'_ Outline| -> Vec<usize> { outline.rings().flatten().map(|one| one.curve).collect() };
    let known: BTreeSet<usize> = numbers.iter().filter_map(|number| outlines.get(*number)).flat_map(curves).collect();
    (0..outlines.len()).filter(|number| curves(&outlines[*number]).iter().any(|curve| known.contains(curve))).collect()
}

/// The first patches of outlines that have changed, and the fewest poor triangles of each outline with the round of that.
type Rounds = (BTreeMap<usize, Patch>, Vec<(usize, u32)>);

/// Divides curves for the sake of outlines, of each in so many rounds at most.
fn rounds<'a>(
    (known, outlines, options): ((&'a Strands<'a>, &'a [Tried]), &'a [Outline], &'a Options),
    divided: &mut Divided,
    patches: &mut [Patch],
    (limits, work): (&[u32], &mut [usize]),
) -> Rounds {
    let mut first: BTreeMap<usize, Patch> = BTreeMap::new();
    let mut best: Vec<(usize, u32)> = patches.iter().map(|patch| (patch.flaws(), 0)).collect();
    for round in 0..=ROUNDS {
        let mut splits: Vec<Split> = Vec::new();
        for (((patch, (fewest, at)), limit), work) in patches.iter().zip(&mut best).zip(limits).zip(&*work) {
            if patch.flaws() < *fewest {
                (*fewest, *at) = (patch.flaws(), round);
            }
            splits.extend(patch.splits.iter().filter(|_| *work > 0 && round < (*limit).min(*at + PATIENCE)));
        }
        let touched = divided.split(known.0, outlines, splits);
        if touched.is_empty() {
            break;
        }
        for number in &touched {
            let points = divided.rings.get(*number).map_or(0, |rings| rings.iter().map(Vec::len).sum());
            work.iter_mut().skip(*number).take(1).for_each(|left| *left = left.saturating_sub(points));
        }
        let tasks = tasks(known, (outlines, &[]), options, divided, false);
        let again: Vec<(usize, Patch)> =
            touched.into_par_iter().filter_map(|number| Some((number, tasks.get(number)?.run()))).collect();
        for (number, patch) in again {
            if let Some(old) = patches.get_mut(number) {
                let old = std::mem::replace(old, patch);
                first.entry(number).or_insert(old);
            }
        }
    }
    (first, best)
}

/// The task of each outline.
fn tasks<'a>(
    (strands, tried): (&'a Strands<'a>, &'a [Tried]),
    (outlines, chords): (&'a [Outline], &'a [Vec<Chord>]),
    options: &'a Options,
    divided: &'a Divided,
    is_dry: bool,
) -> Vec<Task<'a>> {
    let wanted = divided.rings.iter().zip(&divided.wanted);
    let all = outlines.iter().zip(tried).zip(wanted).enumerate();
    all.map(|(number, ((outline, tried), (rings, &(longest, chord))))| Task {
        outline,
        strands,
        rings,
        options,
        longest,
        chord,
        is_dry,
        tried,
        chords: chords.get(number).map_or(&[], Vec::as_slice),
    })
    .collect()
}

/// All patches as one mesh.
fn collected(
    points: Vec<Point>,
    patches: Vec<Patch>,
    (strands, outlines): (Strands<'_>, &[Outline]),
    origins: &[Origin],
) -> Result<Filled, FillError> {
    let rims = points.len();
    let is_plain: Vec<bool> = patches.iter().map(|patch| patch.is_plain).collect();
    let mut filled = Filled { mesh: Mesh { points, ..Mesh::default() }, ..Filled::default() };
    filled.mesh.points.reserve_exact(patches.iter().map(|patch| patch.points.len()).sum());
    filled.mesh.triangles.reserve_exact(patches.iter().map(|patch| patch.triangles.len()).sum());
    for (number, patch) in patches.into_iter().enumerate() {
        let first = filled.mesh.points.len();
        if first + patch.points.len() >= u32::MAX as usize {
            return Err(FillError::Large);
        }
        let corner = |corner: Corner| match corner {
            Corner::Rim(number) => number,
            Corner::Inner(number) => first as u32 + number,
        };
        filled.mesh.triangles.extend(patch.triangles.iter().map(|triangle| triangle.map(corner)));
        filled.mesh.face_of.resize(filled.mesh.triangles.len(), number as u32);
        filled.mesh.points.extend(patch.points);
        filled.surfaces.push(patch.surface);
        filled.reports.push(patch.report);
    }
    let flipped = flipped(&mut filled, orient::Common { rims, is_plain: &is_plain }, origins);
    for (triangle, face) in filled.mesh.triangles.iter_mut().zip(&filled.mesh.face_of) {
        if flipped.get(*face as usize) == Some(&true) {
            triangle.swap(1, 2);
        }
    }
    filled.curves = used(strands, outlines, &filled.surfaces);
    filled.reports.iter_mut().zip(flipped).for_each(|(report, is_flipped)| report.is_flipped = is_flipped);
    Ok(filled)
}

/// Which outlines to turn over; those without a surface count as if they had a lid.
fn flipped(filled: &mut Filled, common: orient::Common<'_>, origins: &[Origin]) -> Vec<bool> {
    let Filled { surfaces, mesh, .. } = filled;
    let (points, triangles) = (mesh.points.len(), mesh.triangles.len());
    for (number, surface) in surfaces.iter().enumerate() {
        let Surface::Fallback(rings) = surface else { continue };
        for ring in rings {
            let places: Vec<Point> = ring.iter().filter_map(|place| mesh.points.get(*place as usize)).copied().collect();
            let top = mesh.points.len() as u32;
            mesh.points.push(space::mean(&places));
            mesh.triangles.extend(ring.iter().zip(ring.iter().cycle().skip(1)).map(|(a, b)| [*a, *b, top]));
        }
        mesh.face_of.resize(mesh.triangles.len(), number as u32);
    }
    let flipped =
        orient::flipped(mesh, surfaces.len(), common, |outline| origins.get(outline).is_some_and(|origin| origin.is_void));
    mesh.points.truncate(points);
    mesh.triangles.truncate(triangles);
    mesh.face_of.truncate(triangles);
    flipped
}

fn strands<'a>(shapes: &[&'a Shape], outlines: &[Outline]) -> Result<Strands<'a>, FillError> {
    let mut is_used = vec![false; shapes.len()];
    for (number, outline) in outlines.iter().enumerate() {
        for one in outline.rings().flatten() {
            let unknown = FillError::Unknown { outline: number, curve: one.curve };
            *is_used.get_mut(one.curve).ok_or(unknown)? = true;
        }
    }
    Ok(shapes.par_iter().zip(&is_used).map(|(shape, is_used)| is_used.then(|| Strand::new(shape))).collect())
}

/// Fitted curves of outlines whose surfaces are blended from them.
fn used(strands: Strands<'_>, outlines: &[Outline], surfaces: &[Surface]) -> Vec<Option<Spline>> {
    let mut is_used = vec![false; strands.len()];
    let blended = |surface: &Surface| matches!(surface, Surface::Coons(_) | Surface::Centre { .. } | Surface::Fans { .. });
    for (outline, _) in outlines.iter().zip(surfaces).filter(|(_, surface)| blended(surface)) {
        for one in &outline.outer {
            is_used.iter_mut().skip(one.curve).take(1).for_each(|used| *used = true);
        }
    }
    let spline = |(strand, is_used): (Option<Strand<'_>>, bool)| strand.filter(|_| is_used)?.into_fitted();
    strands.into_iter().zip(is_used).map(spline).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron whose last face has no surface: the others face outwards all the same, and it is to be closed the way that agrees with them.
    #[test]
    fn outlines_without_a_surface_count_for_what_is_outside() {
        let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let plane = Surface::Heights(crate::curves::Frame::around([0.0; 3], [0.0, 0.0, 1.0]));
        for (is_inward, is_ring_turned) in [(false, false), (true, false), (false, true), (true, true)] {
            let mut triangles = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2]];
            let mut ring = vec![1, 2, 3];
            if is_inward {
                triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
            }
            if is_ring_turned {
                ring.reverse();
            }
            let surfaces = vec![plane.clone(), plane.clone(), plane.clone(), Surface::Fallback(vec![ring])];
            let mesh = Mesh { points: points.clone(), triangles, face_of: vec![0, 1, 2] };
            let mut filled = Filled { surfaces, mesh: mesh.clone(), ..Filled::default() };
            let common = orient::Common { rims: 4, is_plain: &[] };
            assert_eq!(flipped(&mut filled, common, &[]), [is_inward, is_inward, is_inward, is_ring_turned]);
            assert_eq!(filled.mesh, mesh);
        }
    }
}
