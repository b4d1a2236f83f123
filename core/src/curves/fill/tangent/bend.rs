//! Surfaces beside the curves of blended ones, and these bent into the tangent planes of their neighbours.
//!
//! Surfaces with an equation, and faces that are given, are not changed: they give their planes. Two blended surfaces meet in the
//! planes halfway between those that they have by position alone, so each turns as little as can be. All are bent from what they
//! were by position, so no order is of account.

use rayon::prelude::*;

use super::super::coons::Coons;
use super::super::patch::{Patch, Task};
use super::super::report::Surface;
use super::super::spline::SplineSurface;
use super::flank::{self, Known};
use super::lacking;
use crate::curves::Use;
use crate::curves::vector::{Point, add, dot, scale, unit};

/// A grid of so many points each way tells whether a surface folds.
const FOLDS: u32 = 16;
/// Normals at ends where sides shrink to a point are taken at this share of the curve beside them.
const END: f64 = 1e-8;

/// A face beside a curve that is none of the outlines.
#[derive(Clone, Copy)]
pub struct Beside<'a> {
    /// Number of the curve.
    pub curve: usize,
    /// A vector across the face at a point of the curve. It must change evenly along the curve; of its two signs, any will do.
    pub normal: &'a (dyn Fn(Point) -> Option<Point> + Sync),
}

/// Where a curve is used: number of the outline, and its place in the outer loop, if it is in that.
type Place = (usize, Option<usize>);

/// All that may be beside a curve.
struct Scene<'a> {
    tasks: &'a [Task<'a>],
    patches: &'a [Patch],
    /// Of each outline that is a Coons surface.
    splines: Vec<Option<SplineSurface>>,
    /// Of each curve.
    places: Vec<Vec<Place>>,
    /// By number of curve.
    given: Vec<Beside<'a>>,
    smooth: f64,
}

/// Bends all Coons surfaces, where that brings their normals nearer to those beside them and folds none. O(control points), in
/// parallel.
pub(in super::super) fn bend(tasks: &[Task<'_>], patches: &mut [Patch], given: &[Beside<'_>]) {
    let Some(smooth) = tasks.first().map(|task| task.options.smooth) else { return };
    let mut given = given.to_vec();
    given.sort_by_key(|beside| beside.curve);
    let spline = |patch: &Patch| if let Surface::Coons(coons) = &patch.surface { coons.to_spline().ok() } else { None };
    let splines = patches.par_iter().map(spline).collect();
    let scene = Scene { tasks, patches, splines, places: places(tasks), given, smooth };
    let bent: Vec<Option<Patch>> = (0..tasks.len()).into_par_iter().map(|number| scene.bent(number)).collect();
    for (patch, bent) in patches.iter_mut().zip(bent) {
        if let Some(bent) = bent {
            *patch = bent;
        }
    }
}

fn places(tasks: &[Task<'_>]) -> Vec<Vec<Place>> {
    let count = tasks.iter().map(|task| task.strands.len()).max().unwrap_or(0);
    let mut places = vec![Vec::new(); count];
    for (number, task) in tasks.iter().enumerate() {
        let outer = task.outline.outer.iter().enumerate().map(|(part, one)| (one.curve, Some(part)));
        let inner = task.outline.inner.iter().flatten().map(|one| (one.curve, None));
        for (curve, part) in outer.chain(inner) {
            places.iter_mut().skip(curve).take(1).for_each(|places| places.push((number, part)));
        }
    }
    places
}

/// How a place on a side of the surface becomes a share of a curve: number of the side, its part, and whether the curve runs
/// against it.
struct Way {
    side: usize,
    span: [f64; 2],
    is_against: bool,
}

impl Way {
    fn new(coons: &Coons, part: usize, one: Use) -> Option<Self> {
        let &(number, from, to) = coons.spans.get(part)?;
        let (side, is_turned) = match (coons.sides, number) {
            (_, 0) => (0, false),
            (3 | 4, 1) => (1, false),
            (4, 2) | (2, 1) => (2, true),
            _ => (3, true),
        };
        let span = if is_turned { [1.0 - to, 1.0 - from] } else { [from, to] };
        (span[0] < span[1]).then_some(Self { side, span, is_against: one.is_reversed != is_turned })
    }

    fn share(&self, s: f64) -> f64 {
        let x = (s - self.span[0]) / (self.span[1] - self.span[0]);
        if self.is_against { 1.0 - x } else { x }
    }

    /// Parameters of the surface at a share.
    fn parameters(&self, share: f64) -> [f64; 2] {
        let x = if self.is_against { 1.0 - share } else { share };
        let s = self.span[0] + (self.span[1] - self.span[0]) * x;
        match self.side {
            0 => [s, 0.0],
            1 => [1.0, s],
            2 => [s, 1.0],
            _ => [0.0, s],
        }
    }
}

impl<'a> Scene<'a> {
    fn coons(&self, number: usize) -> Option<(&'a Coons, &SplineSurface)> {
        let Surface::Coons(coons) = &self.patches.get(number)?.surface else { return None };
        Some((&**coons, self.splines.get(number)?.as_ref()?))
    }

    fn bent(&self, number: usize) -> Option<Patch> {
        let (coons, spline) = self.coons(number)?;
        let (task, patch) = (self.tasks.get(number)?, self.patches.get(number)?);
        let parts = task.outline.outer.iter().enumerate();
        let known: Vec<Known<'_>> = parts.filter_map(|(part, one)| self.known(number, part, *one)).collect();
        if known.is_empty() {
            return None;
        }
        let (lacking, held) = lacking::lacking(spline, &known, self.smooth)?;
        let bent = coons.clone().bent(lacking);
        let whole = bent.to_spline().ok()?;
        let [before, _] = lacking::angles(spline, &known, &held);
        let [mean, largest] = lacking::angles(&whole, &known, &held);
        if mean >= before || bent.is_folded(FOLDS) {
            return None;
        }
        let mut report = patch.report.clone();
        (report.tangent, report.kink) = (held.len(), largest);
        task.bent(bent, report)
    }

    /// The normals beside a curve of an outline: those given, or those of the one other outline that has it.
    fn known(&'a self, number: usize, part: usize, one: Use) -> Option<Known<'a>> {
        let (coons, own) = self.coons(number)?;
        let way = Way::new(coons, part, one)?;
        let (side, span) = (way.side, way.span);
        let at = self.given.partition_point(|beside| beside.curve < one.curve);
        if let Some(beside) = self.given.get(at).filter(|beside| beside.curve == one.curve) {
            let normal = beside.normal;
            return Some(Known { side, span, normal: Box::new(move |_, point| normal(point)) });
        }
        let [a, b] = *self.places.get(one.curve)?.as_slice() else { return None };
        let (other, place) = if a == (number, Some(part)) { b } else { a };
        if let Surface::Carrier(carrier) = &self.patches.get(other)?.surface {
            return Some(Known { side, span, normal: Box::new(|_, point| carrier.normal(point)) });
        }
        let (coons, spline) = self.coons(other)?;
        let there = *self.tasks.get(other)?.outline.outer.get(place?)?;
        let beside = Way::new(coons, place?, there)?;
        // Both normals look the same way where the outlines run along the curve in different directions.
        let sign = if one.is_reversed == there.is_reversed { -1.0 } else { 1.0 };
        let normals = move |s: f64| {
            let share = way.share(s);
            Some([own.jet(way.parameters(share)).normal()?, scale(spline.jet(beside.parameters(share)).normal()?, sign)])
        };
        // Where they differ by more than is smooth, there shall be an edge.
        let width = span[1] - span[0];
        let is_smooth = |s: f64| normals(s).is_some_and(|[a, b]| dot(a, b) >= self.smooth);
        if ![END, 1.0 - END].into_iter().all(|x| is_smooth(span[0] + width * x)) {
            return None;
        }
        let (inside, within) = (flank::inside(span), move |s: f64| s.clamp(span[0] + END * width, span[1] - END * width));
        let halfway = move |s: f64, _| normals(inside(s)).or_else(|| normals(within(s))).and_then(|[a, b]| unit(add(a, b)));
        Some(Known { side, span, normal: Box::new(halfway) })
    }
}
