//! The search for residue: vertices judged, triangles marked, regions described.

use super::cuts::{Cuts, Family};
use super::found::{Fit, Found, Kind, Mesh, RegionReport};
use super::frame::{self, Frame, SAMPLES};
use super::intended::{Limits, Scratch, Verdict, judge};
use super::options::{Corrections, Error, Options};
use super::regions::{clean, neighbours, pieces};
use super::sweep::nearest;
use crate::curves::vector::{Point, cross, plain_norm, sub};
use rayon::prelude::*;

/// Vertices that are judged one after the other by one thread; each begins with the cut that the one before it found.
const BLOCK: usize = 2048;
/// Tolerance, as a part of the tool's radius.
const TOLERANCE: f64 = 2e-4;
/// Greatest height of a scallop, as a part of the tool's radius.
const HEIGHT_MOST: f64 = 0.25;
/// Least height, in tolerances.
const HEIGHT_LEAST: f64 = 4.0;

/// The part of a verdict that is kept: 24 bytes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mark {
    target: [f32; 3],
    height: f32,
    step: f32,
    /// The part of the step along the axis; 2 more on a border; negative where nothing is intended.
    rise: f32,
}

impl Mark {
    const OUT: Self = Self { target: [f32::NAN; 3], height: 0.0, step: 0.0, rise: -1.0 };

    fn new(verdict: &Verdict) -> Self {
        let rise = verdict.rise as f32 + if verdict.is_border { 2.0 } else { 0.0 };
        let target = verdict.target.map(|x| x as f32);
        Self { target, height: verdict.height as f32, step: verdict.step as f32, rise }
    }

    fn is_known(&self) -> bool {
        self.rise >= 0.0
    }

    fn is_border(&self) -> bool {
        self.rise >= 2.0
    }

    /// Halves: none outside, one on a border, two within.
    fn weight(&self) -> u8 {
        if self.is_border() { 1 } else { 2 * u8::from(self.is_known()) }
    }
}

/// Finds what the cutter left.
///
/// A triangle is residue's if at least two of its vertices lie between passes that touch the part beside them (three halves and more,
/// where a vertex on the last pass counts half). O(vertices · log moves).
///
/// # Errors
/// [`Error`].
pub fn find(mesh: Mesh<'_>, cuts: &Cuts, options: &Options<'_>) -> Result<Found, Error> {
    check(mesh, options)?;
    let families = &cuts.families;
    let limits: Vec<Limits> = families.iter().map(|family| limits(mesh, family, options)).collect();
    let mut marks = vec![Mark::OUT; mesh.points.len()];
    let fit = mesh
        .points
        .par_chunks(BLOCK)
        .zip(marks.par_chunks_mut(BLOCK))
        .map_init(Scratch::default, |lent, (points, marks)| {
            (options.go_on)().then(|| block(points, families, &limits, (marks, lent)))
        })
        .try_reduce(Fit::default, |a, b| Some(a.and(b)));
    let fit = fit.ok_or(Error::Stopped)?;
    let height_min = options
        .height_min
        .unwrap_or_else(|| limits.iter().map(|limits| HEIGHT_LEAST * limits.tolerance).fold(f64::INFINITY, f64::min));
    regions(mesh, (marks, fit), height_min, options)
}

/// The axes of the path, where those of the mesh are not: the one exchange or turn of axes with which the path fits the mesh; `None` if there is no such
/// one, or several. Looks at some vertices alone. O(vertices + log moves).
///
/// # Errors
/// [`Error`].
pub fn frame(mesh: Mesh<'_>, cuts: &Cuts, options: &Options<'_>) -> Result<Option<Frame>, Error> {
    check(mesh, options)?;
    let families = &cuts.families;
    let limits: Vec<Limits> = families.iter().map(|family| limits(mesh, family, options)).collect();
    let step = mesh.points.len().div_ceil(SAMPLES).max(1);
    let sample: Vec<[f32; 3]> = mesh.points.iter().step_by(step).copied().collect();
    let frames: Vec<Frame> = Frame::all().collect();
    let fit = |frame: &Frame| {
        let points: Vec<[f32; 3]> = sample.iter().map(|point| frame.into_path(*point)).collect();
        let mut marks = vec![Mark::OUT; points.len()];
        (*frame, block(&points, families, &limits, (&mut marks, &mut Scratch::default())))
    };
    let fits: Vec<(Frame, Fit)> = frames.par_iter().map(fit).collect();
    Ok(frame::clear(&fits, sample.len()))
}

pub(super) fn check(mesh: Mesh<'_>, options: &Options<'_>) -> Result<(), Error> {
    let is_good = |face: &[u32; 3]| {
        face.iter().all(|vertex| mesh.points.get(*vertex as usize).is_some_and(|point| point.iter().all(|x| x.is_finite())))
    };
    if let Some(face) = mesh.faces.iter().position(|face| !is_good(face)) {
        return Err(Error::Vertex(face));
    }
    let mask = options.corrections.mask.len();
    if mask != 0 && mask != mesh.faces.len() {
        return Err(Error::Mask { mask, faces: mesh.faces.len() });
    }
    Ok(())
}

fn limits(mesh: Mesh<'_>, family: &Family, options: &Options<'_>) -> Limits {
    let radius = family.profile.radius;
    let greatest = mesh.points.iter().flatten().fold(0.0f32, |most, x| most.max(x.abs()));
    let rounding = 4.0 * f64::from(greatest) * f64::from(f32::EPSILON);
    let tolerance = options.tolerance.unwrap_or(TOLERANCE * radius + rounding);
    Limits { tolerance, height_max: options.height_max.unwrap_or(HEIGHT_MOST * radius) }
}

/// Judges a block of vertices; each begins with the cut that the one before it found.
fn block(points: &[[f32; 3]], families: &[Family], limits: &[Limits], (marks, lent): (&mut [Mark], &mut Scratch)) -> Fit {
    let (mut starts, mut fit) = (vec![None; families.len()], Fit::default());
    for (point, mark) in points.iter().zip(marks) {
        *mark = vertex(point.map(f64::from), families, limits, (&mut starts, lent, &mut fit));
    }
    fit
}

/// Judges a vertex by the cut nearest to it, or by the nearest one in another direction: short moves that join passes cut there too.
fn vertex(
    point: Point,
    families: &[Family],
    limits: &[Limits],
    (starts, lent, fit): (&mut [Option<u32>], &mut Scratch, &mut Fit),
) -> Mark {
    let mut best = None;
    for (number, ((family, limits), start)) in families.iter().zip(limits).zip(starts.iter_mut()).enumerate() {
        let most = limits.tolerance + 0.5 * limits.height_max;
        let Some(touch) = nearest(family, point, most, *start, None, &mut lent.stack) else { continue };
        *start = Some(touch.piece);
        if best.is_none_or(|(_, least, _): (usize, f64, _)| touch.distance < least) {
            best = Some((number, touch.distance, touch));
        }
    }
    let Some((number, distance, touch)) = best else { return Mark::OUT };
    let (Some(family), Some(limits)) = (families.get(number), limits.get(number)) else { return Mark::OUT };
    if distance < -limits.tolerance {
        fit.uncut += 1;
        return Mark::OUT;
    }
    fit.touched += usize::from(distance <= limits.tolerance);
    if let Some(verdict) = judge(family, point, touch, *limits, lent) {
        return Mark::new(&verdict);
    }
    let Some((course, _)) = family.direction(touch.piece, touch.at, 0.0) else { return Mark::OUT };
    let most = limits.tolerance + 0.5 * limits.height_max;
    let Some(other) = nearest(family, point, most, None, Some(course), &mut lent.stack) else { return Mark::OUT };
    judge(family, point, other, *limits, lent).map_or(Mark::OUT, |verdict| Mark::new(&verdict))
}

/// Marks triangles, cleans up and describes regions.
fn regions(mesh: Mesh<'_>, (marks, fit): (Vec<Mark>, Fit), height_min: f64, options: &Options<'_>) -> Result<Found, Error> {
    let of = |face: &[u32; 3]| face.map(|vertex| marks.get(vertex as usize).copied().unwrap_or(Mark::OUT));
    let mut is_in: Vec<bool> = mesh.faces.par_iter().map(|face| of(face).iter().map(Mark::weight).sum::<u8>() > 3).collect();
    let neighbours = neighbours(mesh.points.len(), mesh.faces);
    if !(options.go_on)() {
        return Err(Error::Stopped);
    }
    let may_fill = |face: usize| mesh.faces.get(face).is_some_and(|face| of(face).iter().any(Mark::is_known));
    clean(&neighbours, &mut is_in, options.count_min, may_fill);
    correct(mesh, &mut is_in, options);
    let (numbers, sizes) = pieces(&neighbours, &is_in);
    drop(neighbours);
    let mut lists: Vec<Vec<u32>> = vec![Vec::new(); sizes.len()];
    for ((number, is_in), face) in numbers.iter().zip(&is_in).zip(0u32..) {
        if *is_in {
            lists[*number as usize].push(face);
        }
    }
    let mut labels = vec![u32::MAX; mesh.faces.len()];
    let mut reports = Vec::new();
    for list in lists.into_iter().filter(|list| !list.is_empty()) {
        let report = describe(mesh, &list, &of);
        let is_forced = report.height == 0.0;
        if report.height < height_min && !is_forced {
            continue;
        }
        list.iter().for_each(|face| labels[*face as usize] = reports.len() as u32);
        reports.push(report);
    }
    let targets = marks.iter().map(|mark| if mark.is_known() { mark.target } else { [f32::NAN; 3] }).collect();
    Ok(Found { labels, targets, regions: reports, fit })
}

/// For each triangle, whether corrections let it be residue's.
pub(super) fn allowed(mesh: Mesh<'_>, options: &Options<'_>) -> Vec<bool> {
    let mut is_in = vec![true; mesh.faces.len()];
    let Corrections { exclude, mask, .. } = options.corrections;
    let corrections = Corrections { exclude, mask, ..Corrections::default() };
    correct(mesh, &mut is_in, &Options { corrections, ..options.clone() });
    is_in
}

/// Corrections by hand.
fn correct(mesh: Mesh<'_>, is_in: &mut [bool], options: &Options<'_>) {
    let hand = &options.corrections;
    let holds = |boxes: &[super::options::Region], middle: Point| {
        boxes.iter().any(|[low, high]| (0..3).all(|axis| low[axis] <= middle[axis] && middle[axis] <= high[axis]))
    };
    for (face, is_in) in mesh.faces.iter().zip(is_in.iter_mut()) {
        if hand.include.is_empty() && hand.exclude.is_empty() {
            break;
        }
        let middle = mesh.middle(face);
        *is_in = (*is_in || holds(hand.include, middle)) && !holds(hand.exclude, middle);
    }
    for face in hand.triangles {
        if let Some(is_in) = is_in.get_mut(*face as usize) {
            *is_in = true;
        }
    }
    for (is_in, may) in is_in.iter_mut().zip(hand.mask) {
        *is_in &= may;
    }
}

/// Height, pitch, kind and size of a region.
fn describe(mesh: Mesh<'_>, list: &[u32], of: &impl Fn(&[u32; 3]) -> [Mark; 3]) -> RegionReport {
    let (mut area, mut stairs, mut known) = (0.0, 0.0, 0.0);
    let (mut heights, mut steps) = (Vec::new(), Vec::new());
    for face in list.iter().filter_map(|face| mesh.faces.get(*face as usize)) {
        let [a, b, c] = mesh.corners(face);
        let size = 0.5 * plain_norm(cross(sub(b, a), sub(c, a)));
        area += size;
        for mark in of(face).iter().filter(|mark| mark.is_known()) {
            heights.push(mark.height);
            steps.push(mark.step);
            known += size / 3.0;
            let rise = if mark.is_border() { mark.rise - 2.0 } else { mark.rise };
            // Passes that follow each other along the axis leave stairs, others ripples: 45° is between them.
            stairs += if f64::from(rise) > 0.5f64.sqrt() { size / 3.0 } else { 0.0 };
        }
    }
    let kind = if stairs > 0.5 * known { Kind::Stairs } else { Kind::Ripples };
    let agreeing = if kind == Kind::Stairs { stairs } else { known - stairs };
    let height = f64::from(share(&mut heights, 0.98)).max(0.0);
    RegionReport {
        kind,
        confidence: if area > 0.0 { agreeing / area } else { 0.0 },
        height,
        pitch: f64::from(share(&mut steps, 0.5)),
        area,
        triangles: list.len(),
    }
}

/// The number below which a part of all lies; 0 of none.
fn share(numbers: &mut [f32], part: f64) -> f32 {
    numbers.sort_unstable_by(f32::total_cmp);
    numbers.get((numbers.len() as f64 * part) as usize).or(numbers.last()).copied().unwrap_or(0.0)
}
