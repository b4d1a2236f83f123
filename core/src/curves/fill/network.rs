//! Curves of many outlines divided once, so that outlines that share them share their points.

use rayon::prelude::*;

use super::grade;
use super::layout::Rim;
use super::options::{Options, Outline};
use super::poor::Split;
use super::space;
use super::strand::{Limits, Strand};
use crate::curves::Use;
use crate::curves::vector::{Point, distance};

/// Curves as outlines need them, by their numbers; `None` of those in no outline.
pub(super) type Strands<'a> = Vec<Option<Strand<'a>>>;

/// Points of the mesh on curves.
#[derive(Clone, Debug, Default)]
pub(super) struct Divided {
    /// All of them.
    pub(super) points: Vec<Point>,
    /// Rings of each outline.
    pub(super) rings: Vec<Vec<Vec<Rim>>>,
    /// The longest edge and the tolerance of each outline.
    pub(super) wanted: Vec<(f64, f64)>,
    /// Points of each curve.
    pub(super) curves: Vec<Samples>,
}

/// Parameters and numbers of the points of a curve.
type Samples = Vec<(f64, u32)>;

/// Divides curves, those of an outline no coarser than its entry of `longest`, if there is one, and gives the rings of outlines. O(points ·
/// log points).
pub(super) fn divide(strands: &Strands<'_>, outlines: &[Outline], options: &Options, longest: &[f64]) -> Divided {
    let (mut limits, wanted) = limits(strands, outlines, options);
    for (outline, longest) in outlines.iter().zip(longest) {
        for one in outline.rings().flatten() {
            limits.iter_mut().skip(one.curve).take(1).for_each(|limit| limit.size = limit.size.min(*longest));
        }
    }
    let pairs = strands.par_iter().zip(&limits);
    let mut samples: grade::Samples =
        pairs.map(|(strand, limits)| strand.as_ref().map(|strand| strand.samples(limits)).unwrap_or_default()).collect();
    let rings: Vec<Vec<&[Use]>> = outlines.iter().map(|outline| outline.rings().map(Vec::as_slice).collect()).collect();
    grade::graded(strands, &rings, &mut samples);
    let roots = joined(strands.len(), outlines);
    let mut divided = Divided { wanted, ..Divided::default() };
    let mut numbers: Vec<Option<u32>> = vec![None; 2 * strands.len()];
    let mut curves: Vec<Samples> = Vec::with_capacity(strands.len());
    for (curve, (strand, shares)) in strands.iter().zip(&samples).enumerate() {
        let mut points = Vec::with_capacity(shares.len());
        let Some(strand) = strand else {
            curves.push(points);
            continue;
        };
        for (at, share) in shares.iter().enumerate() {
            let end = (at == 0).then_some(2 * curve).or((at + 1 == shares.len()).then_some(2 * curve + 1));
            let root = end.and_then(|end| roots.get(end)).copied();
            let known = root.and_then(|root| numbers.get(root).copied().flatten());
            let number = known.unwrap_or_else(|| {
                divided.points.push(strand.point(*share));
                divided.points.len() as u32 - 1
            });
            if let Some(root) = root {
                numbers.iter_mut().skip(root).take(1).for_each(|known| *known = Some(number));
            }
            points.push((*share, number));
        }
        curves.push(points);
    }
    divided.curves = curves;
    divided.rings = outlines.par_iter().map(|outline| divided.rings_of(outline)).collect();
    divided
}

/// An edge is not divided below this part of its curve's length.
const SHARE: f64 = 1.0 / 2048.0;

impl Divided {
    fn rings_of(&self, outline: &Outline) -> Vec<Vec<Rim>> {
        outline.rings().map(|uses| ring(uses, &self.curves, &self.points)).collect()
    }

    /// Divides curves at shares of them, and gives the numbers of the outlines that have these. A place too near to another one is left out. Points that
    /// are there keep their numbers. O(uses + places · points of a curve).
    pub(super) fn split(&mut self, strands: &Strands<'_>, outlines: &[Outline], mut splits: Vec<Split>) -> Vec<usize> {
        splits.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let mut is_divided = vec![false; strands.len()];
        for (curve, share) in splits {
            let (Some(samples), Some(Some(strand))) = (self.curves.get_mut(curve), strands.get(curve)) else { continue };
            let at = samples.partition_point(|(other, _)| *other <= share);
            let (Some((low, _)), Some((high, _))) = (at.checked_sub(1).and_then(|at| samples.get(at)), samples.get(at)) else {
                continue;
            };
            // Two wishes for one edge differ where it begins a sharp corner: the second one is left to the next round.
            let is_new = is_divided.get(curve).is_some_and(|is_divided| !is_divided) || share - low > 0.2 * (high - low);
            if (share - low).min(high - share) < SHARE || !is_new {
                continue;
            }
            samples.insert(at, (share, self.points.len() as u32));
            self.points.push(strand.point(share));
            is_divided.iter_mut().skip(curve).take(1).for_each(|is_divided| *is_divided = true);
        }
        let has = |outline: &Outline| {
            let mut uses = outline.rings().flatten();
            uses.any(|one| is_divided.get(one.curve) == Some(&true))
        };
        let touched: Vec<usize> =
            outlines.iter().enumerate().filter(|(_, outline)| has(outline)).map(|(number, _)| number).collect();
        for number in &touched {
            let Some(rings) = outlines.get(*number).map(|outline| self.rings_of(outline)) else { continue };
            self.rings.iter_mut().skip(*number).take(1).for_each(|old| old.clone_from(&rings));
        }
        touched
    }
}

/// Whether any ring has an edge longer than the entry of its outline.
pub(super) fn is_coarser(divided: &Divided, longest: &[f64]) -> bool {
    divided.rings.iter().zip(longest).any(|(rings, longest)| {
        let pairs = rings.iter().flat_map(|ring| ring.iter().zip(ring.iter().cycle().skip(1)));
        pairs.into_iter().any(|(one, next)| distance(one.point, next.point) > *longest)
    })
}

fn ring(uses: &[Use], curves: &[Samples], points: &[Point]) -> Vec<Rim> {
    let mut ring = Vec::new();
    for (part, one) in uses.iter().enumerate() {
        let Some(samples) = curves.get(one.curve) else { continue };
        let rim = |&(share, vertex): &(f64, u32)| Rim {
            vertex,
            point: points.get(vertex as usize).copied().unwrap_or_default(),
            part: part as u32,
            share: if one.is_reversed { 1.0 - share } else { share },
        };
        let count = samples.len().saturating_sub(1);
        if one.is_reversed {
            ring.extend(samples.iter().rev().take(count).map(rim));
        } else {
            ring.extend(samples.iter().take(count).map(rim));
        }
    }
    ring
}

/// How finely each curve is divided, and for each outline its longest edge and tolerance.
fn limits(strands: &Strands<'_>, outlines: &[Outline], options: &Options) -> (Vec<Limits>, Vec<(f64, f64)>) {
    let free = Limits { chord: f64::INFINITY, angle: options.angle, size: options.size.unwrap_or(f64::INFINITY), least: 1 };
    let mut limits = vec![free; strands.len()];
    let length = |one: &Use| strands.get(one.curve).and_then(Option::as_ref).map_or(0.0, |strand| strand.length);
    let mut wanted = Vec::with_capacity(outlines.len());
    for outline in outlines {
        let uses = || outline.rings().flatten();
        let probes = uses().filter_map(|one| strands.get(one.curve).and_then(Option::as_ref)).flat_map(|strand| &strand.probes);
        let diagonal = space::size(&probes.copied().collect::<Vec<_>>());
        let chord = options.chord.unwrap_or(2e-3 * diagonal);
        let shortest = uses().map(length).filter(|length| *length > 1e-6 * diagonal).fold(f64::INFINITY, f64::min);
        wanted.push((options.size.unwrap_or(f64::INFINITY), chord));
        for uses in outline.rings() {
            let least = match uses.len() {
                1 => 8,
                2 => 2,
                _ => 1,
            };
            for one in uses {
                let Some(limit) = limits.get_mut(one.curve) else { continue };
                limit.chord = limit.chord.min(chord);
                limit.least = limit.least.max(least);
                if options.size.is_none() {
                    limit.size = limit.size.min(shortest.max(length(one) / 32.0));
                }
            }
        }
    }
    (limits, wanted)
}

/// Ends of curves (2 of each, by twice its number) that outlines join, each with the lowest of its kind. Near O(uses).
pub(super) fn joined(curves: usize, outlines: &[Outline]) -> Vec<usize> {
    let mut parents: Vec<usize> = (0..2 * curves).collect();
    let end = |one: &Use, is_last: bool| 2 * one.curve + usize::from(is_last != one.is_reversed);
    for uses in outlines.iter().flat_map(Outline::rings) {
        for (one, next) in uses.iter().zip(uses.iter().cycle().skip(1)) {
            let (a, b) = (root(&mut parents, end(one, true)), root(&mut parents, end(next, false)));
            let (low, high) = (a.min(b), a.max(b));
            parents.iter_mut().skip(high).take(1).for_each(|parent| *parent = low);
        }
    }
    (0..2 * curves).map(|at| root(&mut parents, at)).collect()
}

/// The lowest of a set; the way there is halved (R. E. Tarjan, J. van Leeuwen 1984).
fn root(parents: &mut [usize], mut at: usize) -> usize {
    loop {
        let parent = parents.get(at).copied().unwrap_or(at);
        if parent == at {
            return at;
        }
        let next = parents.get(parent).copied().unwrap_or(parent);
        parents.iter_mut().skip(at).take(1).for_each(|entry| *entry = next);
        at = next;
    }
}
