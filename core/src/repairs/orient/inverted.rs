//! Which closed pieces of surface are inside out.
//!
//! From the outside in: one of negative volume is, unless it lies in the material of others, whose cavity it is then. One that was coherent with an
//! inverted piece around it (of opposite sign: its cavity) is turned along. One that passes through the wall of another one of the same sign is no
//! cavity of that: in a file that is inside out both are bodies, and two cavities that meet are one.
//!
//! Of a piece that crosses no other, one point tells what it lies in, and so it is with one that large patches have closed. One that crosses the wall of a piece of opposite sign is a cavity that
//! pokes out, a cutter that was never subtracted, or a body inside out. Points spread over it tell what share of it lies in material; the larger
//! share decides, and what was to be guessed is told.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use crate::detect::bodies;
use crate::geometry::boxes::BoxTree;
use crate::geometry::sums::Bounds;
use crate::repairs::orient::points::spread;
use crate::repairs::shared::pieces::{are_patched, crossing_pieces};
use crate::repairs::shared::unsaid;
use crate::submesh::Submesh;
use crate::submesh::components::{Component, Components, Reversed};
use crate::topology::survey::Survey;
use crate::util::words::span;

/// Pieces that cross others of opposite sign and are looked at point by point: the largest. Of others one point tells.
const MOST: usize = 1024;

/// A piece of which this share lies in the material of others is plainly meant for a cavity.
const PLAINLY: f64 = 2.0 / 3.0;

/// A piece of which no more than this share does is plainly a body: it only touches others.
const TOUCHES: f64 = 0.02;

/// Pieces whose guesses are not told are together no more than this share of all volume.
const LEAST: f64 = 1e-3;

/// Pieces that are inside out.
#[derive(Debug, Default)]
pub(crate) struct Inverted {
    /// By piece.
    pub(crate) pieces: Vec<bool>,
    /// Guesses, each a line for people.
    pub(crate) doubts: Vec<String>,
    /// Cavities that cross the walls of others, ascending.
    pub(crate) poking_out: Vec<u32>,
    /// Those pieces that are no guess.
    pub(crate) plainly: Vec<u32>,
}

/// The pieces that wind around a point, ascending, with winding numbers.
type Around = Vec<(u32, i32)>;

/// The closed ones of all `pieces` that are inside out. A look at the chunks where pieces lie in others' boxes, and at those of what crosses.
pub(crate) fn inverted(survey: &Survey<'_>, submesh: &Submesh, pieces: &Components, reversed: &Reversed) -> Inverted {
    let pairs = survey.crossing_pairs.as_deref().unwrap_or_default().iter().map(|pair| pair.triangles);
    let crossing = crossing_pieces(survey, submesh, pieces, pairs);
    let around = bodies::surroundings(survey, submesh, pieces, reversed, |c| !c.open);
    let (by_points, unasked) = around_points(survey, submesh, pieces, reversed, &crossing);
    let mut all = All {
        list: &pieces.list,
        around: around.into_iter().map(|around| around.around).collect(),
        by_points,
        unasked,
        crossing,
        inverted: vec![false; pieces.list.len()],
    };
    all.decide();
    let guesses = all.guesses();
    Inverted { pieces: all.inverted, ..guesses }
}

/// All pieces, and which of them are known to be inside out.
struct All<'a> {
    list: &'a [Component],
    /// By piece: what winds around its first triangle.
    around: Vec<Around>,
    /// Of pieces that cross others: what winds around points spread over them.
    by_points: BTreeMap<u32, Vec<Around>>,
    /// Further pieces that cross others: they are too many for many points each, so that one point tells.
    unasked: Vec<u32>,
    /// The pieces that cross each other.
    crossing: Vec<[u32; 2]>,
    inverted: Vec<bool>,
}

impl All<'_> {
    fn sign(&self, piece: u32) -> i128 {
        self.list[piece as usize].extent.volume.signum()
    }

    fn decide(&mut self) {
        let size = |c: u32| self.list[c as usize].extent.volume.abs();
        // What lies in fewer pieces is decided first, and what is larger.
        let mut order: Vec<u32> = (0..self.list.len() as u32).filter(|c| !self.list[*c as usize].open).collect();
        order.sort_by_key(|c| (self.around[*c as usize].len(), Reverse(size(*c))));
        // Whose wall a piece inside an open one is, nobody knows.
        let open: Vec<Bounds> = self.list.iter().filter(|c| c.open).map(|c| c.bounds).collect();
        let (tree, mut met) = (BoxTree::new(&open), Vec::new());
        for c in order {
            let bounds = &self.list[c as usize].bounds;
            tree.meeting(bounds, &mut met);
            if met.iter().any(|o| open[*o as usize].contains(bounds)) {
                continue;
            }
            let points = self.points(c);
            let direct = self.directly_around(&points);
            let along = direct.is_some_and(|o| self.inverted[o as usize] && self.sign(o) == -self.sign(c));
            let is_negative = if along { self.sign(c) > 0 } else { self.sign(c) < 0 };
            self.inverted[c as usize] = along ^ (is_negative && self.share_in_material(&points) < 0.5);
        }
    }

    /// What winds around points of a piece, but for itself, and what it passes through.
    fn points(&self, c: u32) -> Vec<Around> {
        let passes_through = |o: u32| self.sign(c) == self.sign(o) && self.crossing.binary_search(&[c.min(o), c.max(o)]).is_ok();
        let by_one = || vec![self.around[c as usize].clone()];
        let mut points = self.by_points.get(&c).cloned().unwrap_or_else(by_one);
        points.iter_mut().for_each(|point| point.retain(|(o, _)| *o != c && !passes_through(*o)));
        points
    }

    /// Of what winds around at least half of the points, the piece that is itself inside most others.
    fn directly_around(&self, points: &[Around]) -> Option<u32> {
        let mut counts: BTreeMap<u32, usize> = BTreeMap::new();
        points.iter().flatten().for_each(|(o, _)| *counts.entry(*o).or_insert(0) += 1);
        let most = counts.into_iter().filter(|(_, count)| 2 * count >= points.len()).map(|(o, _)| o);
        most.max_by_key(|o| (self.around[*o as usize].len(), Reverse(*o)))
    }

    /// The share of the points that lie in material.
    fn share_in_material(&self, points: &[Around]) -> f64 {
        let winding = |(o, w): &(u32, i32)| if self.inverted[*o as usize] { -w } else { *w };
        let in_material = points.iter().filter(|point| point.iter().map(winding).sum::<i32>() >= 1).count();
        in_material as f64 / points.len() as f64
    }

    /// Lines on what was to be guessed, and what was taken for cavities.
    fn guesses(&self) -> Inverted {
        let closed = self.list.iter().filter(|piece| !piece.open);
        let size = |c: &u32| self.list[*c as usize].extent.volume.abs() as f64;
        let all: f64 = closed.map(|piece| piece.extent.volume.abs() as f64).sum();
        let guessed: Vec<(u32, String)> =
            self.by_points.keys().chain(&self.unasked).filter_map(|c| Some((*c, self.guess(*c)?))).collect();
        let told = unsaid::told(&guessed.iter().map(|(c, _)| size(c)).collect::<Vec<_>>(), LEAST * all);
        let mut told: Vec<(u32, String)> =
            guessed.into_iter().zip(told).filter(|(_, told)| *told).map(|(guess, _)| guess).collect();
        let is_cavity = |c: &&u32| (self.sign(**c) < 0) != self.inverted[**c as usize];
        let poking_out: Vec<u32> = self.by_points.keys().filter(is_cavity).copied().collect();
        let plainly = poking_out.iter().copied().filter(|c| told.iter().all(|(other, _)| other != c)).collect();
        told.sort_by(|a, b| size(&b.0).total_cmp(&size(&a.0)).then(a.0.cmp(&b.0)));
        let doubts = unsaid::summed_up(told.into_iter().map(|(_, line)| line).collect());
        Inverted { pieces: Vec::new(), doubts, poking_out, plainly }
    }

    /// Words on a piece that crosses others and faces inward, if its meaning was to be guessed.
    fn guess(&self, c: u32) -> Option<String> {
        let (was_negative, is_turned) = (self.sign(c) < 0, self.inverted[c as usize]);
        let share = self.by_points.contains_key(&c).then(|| self.share_in_material(&self.points(c)));
        let meant = match (was_negative, is_turned) {
            (true, true) if share.is_none_or(|share| share > TOUCHES) => "a body",
            (true, false) | (false, true) if share.is_none_or(|share| share < PLAINLY) => "a cavity",
            _ => return None,
        };
        let bounds = self.list[c as usize].bounds.normalised();
        let share = share.map_or("an unknown part".into(), |share| format!("{:.0} %", share * 100.0));
        Some(format!(
            "surface that faces inward crosses other bodies, and {share} of it lies in their material: it was taken for {meant}, {}",
            span([bounds.lo, bounds.hi])
        ))
    }
}

/// For each closed piece that crosses one of opposite sign, and is to be looked at, what winds around points spread over it; and those that are too many.
fn around_points(
    survey: &Survey<'_>,
    submesh: &Submesh,
    pieces: &Components,
    reversed: &Reversed,
    crossing: &[[u32; 2]],
) -> (BTreeMap<u32, Vec<Around>>, Vec<u32>) {
    let list = &pieces.list;
    let sign = |c: u32| if list[c as usize].open { 0 } else { list[c as usize].extent.volume.signum() };
    let opposed = crossing.iter().filter(|[a, b]| sign(*a) * sign(*b) < 0);
    let mut asked: Vec<u32> = opposed.flatten().copied().collect();
    asked.sort_by_key(|c| (Reverse(list[*c as usize].extent.volume.abs()), *c));
    asked.dedup();
    let patched = are_patched(survey, submesh, pieces);
    asked.retain(|c| !patched[*c as usize]);
    let unasked = asked.split_off(asked.len().min(MOST));
    let points = spread(survey, submesh, reversed, pieces, &asked);
    let places: Vec<[f64; 3]> = points.iter().map(|(_, place)| *place).collect();
    let mut all: BTreeMap<u32, Vec<Around>> = BTreeMap::new();
    for ((piece, _), around) in points.iter().zip(bodies::surfaces_around(survey, submesh, pieces, reversed, &places)) {
        all.entry(*piece).or_default().push(around);
    }
    (all, unasked)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::repairs::shared::pieces;
    use crate::repairs::shared::work::Work;
    use crate::testing::{Corners, after, cuboid, reversed};

    /// How many are inside out, and how many guesses there were.
    fn turned(bodies: &[Vec<Corners>]) -> (usize, usize) {
        let got = after(&bodies.concat(), |d, turned| {
            let work = &mut Work::new(&mut d.submesh);
            let pieces = pieces::pieces(&d.survey, work, turned);
            inverted(&d.survey, work, &pieces, turned)
        });
        (got.result.pieces.iter().filter(|inverted| **inverted).count(), got.result.doubts.len())
    }

    fn host() -> Vec<Corners> {
        cuboid([0.0; 3], [8.0; 3])
    }

    /// From x = 1 up to here, square.
    fn bar(to: f32) -> Vec<Corners> {
        cuboid([1.0, 3.0, 3.0], [to, 4.0, 4.0])
    }

    #[test]
    fn a_cavity_that_pokes_out_stays_one() {
        assert_eq!(turned(&[host(), reversed(&bar(8.125))]), (0, 0));
        // Of the whole inside out, too.
        assert_eq!(turned(&[reversed(&host()), bar(8.125)]), (2, 0));
        // Two that meet are one cavity.
        let second = cuboid([1.5, 3.5, 3.5], [6.0, 4.5, 4.5]);
        assert_eq!(turned(&[host(), reversed(&bar(8.125)), reversed(&second)]), (0, 0));
    }

    #[test]
    fn of_what_lies_half_in_material_the_larger_part_decides_and_it_is_told() {
        assert_eq!(turned(&[host(), reversed(&bar(12.0))]), (0, 1));
        assert_eq!(turned(&[host(), reversed(&bar(24.0))]), (1, 1));
    }

    #[test]
    fn many_guesses_that_are_each_too_small_for_a_word_are_told_together() {
        // Half in the host's wall, and each less than a thousandth of it.
        let small = |i: u8| {
            let (x, y) = (f32::from(i % 6) + 1.0, f32::from(i / 6) + 1.0);
            reversed(&cuboid([x, y, 7.75], [x + 0.5, y + 0.5, 8.75]))
        };
        let with = |count: u8| turned(&[host()].into_iter().chain((0..count).map(small)).collect::<Vec<_>>()).1;
        assert_eq!(with(1), 0);
        // Ten are named, the others counted.
        assert_eq!(with(36), 11);
    }

    #[test]
    fn a_body_that_a_body_inside_out_stands_beside_or_in_is_not_turned() {
        assert_eq!(turned(&[reversed(&host()), cuboid([9.0; 3], [10.0; 3])]), (1, 0));
        // It is no cavity of that: most of it lies outside.
        assert_eq!(turned(&[reversed(&host()), bar(24.0)]), (1, 0));
    }
}
