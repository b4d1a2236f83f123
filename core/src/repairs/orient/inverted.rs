//! Which closed pieces of surface are inside out.
//!
//! From the outside in: one of negative volume is, unless it lies in the material of others, whose cavity it is then. One that was coherent with an
//! inverted piece around it (of opposite sign: its cavity) is turned along. One that passes through the wall of another one of the same sign is no
//! cavity of that: in a file that is inside out both are bodies, and two cavities that meet are one.
//!
//! Of a piece that crosses no other, one point tells what it lies in. One that crosses the wall of a piece of opposite sign is a cavity that
//! pokes out, a cutter that was never subtracted, or a body inside out. Points spread over it tell what share of it lies in material; the larger
//! share decides, and what was to be guessed is told.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use crate::detect::bodies;
use crate::geometry::boxes::BoxTree;
use crate::geometry::sums::Bounds;
use crate::repairs::orient::points::spread;
use crate::repairs::shared::pieces::crossing_pieces;
use crate::submesh::Submesh;
use crate::submesh::components::{Components, Reversed};
use crate::topology::survey::Survey;

/// Pieces that cross others of opposite sign and are looked at point by point: the largest. Of others one point tells.
const MOST: usize = 1024;

/// A piece of which this share lies in the material of others is plainly meant for a cavity.
const PLAINLY: f64 = 0.75;

/// What is inside out.
#[derive(Debug, Default)]
pub(crate) struct Inverted {
    /// By piece.
    pub(crate) pieces: Vec<bool>,
    /// Guesses, each a line for people.
    pub(crate) doubts: Vec<String>,
}

/// What winds around a point, ascending, with winding numbers.
type Around = Vec<(u32, i32)>;

/// The closed ones of all `pieces` that are inside out. A look at the chunks where pieces lie in others' boxes, and at those of what crosses.
pub(crate) fn inverted(survey: &Survey<'_>, submesh: &Submesh, pieces: &Components, reversed: &Reversed) -> Inverted {
    let list = &pieces.list;
    let around = bodies::surroundings(survey, submesh, pieces, reversed, |c| !c.open);
    let sign = |c: u32| list[c as usize].extent.volume.signum();
    let size = |c: u32| list[c as usize].extent.volume.abs();
    let pairs = survey.crossing_pairs.as_deref().unwrap_or_default().iter().map(|pair| pair.triangles);
    let crossing = crossing_pieces(survey, submesh, pieces, pairs);
    let by_points = around_points(survey, submesh, pieces, reversed, &crossing);
    // What lies in fewer pieces is decided first, and what is larger.
    let mut order: Vec<u32> = (0..list.len() as u32).filter(|c| !list[*c as usize].open).collect();
    order.sort_by_key(|c| (around[*c as usize].around.len(), Reverse(size(*c))));
    // Whose wall a piece inside an open one is, nobody knows.
    let open: Vec<Bounds> = list.iter().filter(|c| c.open).map(|c| c.bounds).collect();
    let tree = BoxTree::new(&open);
    let mut met = Vec::new();
    let mut found = Inverted { pieces: vec![false; list.len()], doubts: Vec::new() };
    for c in order {
        tree.meeting(&list[c as usize].bounds, &mut met);
        if met.iter().any(|o| open[*o as usize].contains(&list[c as usize].bounds)) {
            continue;
        }
        let passes_through = |o: u32| sign(c) == sign(o) && crossing.binary_search(&[c.min(o), c.max(o)]).is_ok();
        let by_one = || vec![around[c as usize].around.clone()];
        let mut points = by_points.get(&c).cloned().unwrap_or_else(by_one);
        points.iter_mut().for_each(|point| point.retain(|(o, _)| *o != c && !passes_through(*o)));
        let inverted = &mut found.pieces;
        // The piece directly around: itself inside most others.
        let depth = |o: &u32| (around[*o as usize].around.len(), Reverse(*o));
        let direct = around_most(&points).into_iter().max_by_key(depth);
        let along = direct.is_some_and(|o| inverted[o as usize] && sign(o) == -sign(c));
        let winding = |(o, w): &(u32, i32)| if inverted[*o as usize] { -w } else { *w };
        let in_material = points.iter().filter(|point| point.iter().map(winding).sum::<i32>() >= 1).count();
        let share = in_material as f64 / points.len() as f64;
        let is_negative = (sign(c) < 0) ^ along && sign(c) != 0;
        inverted[c as usize] = along ^ (is_negative && share < 0.5);
        if is_negative && share > 0.0 && share < PLAINLY {
            let meant = if share < 0.5 { "a body" } else { "a cavity" };
            let Bounds { lo, hi } = list[c as usize].bounds.normalised();
            found.doubts.push(format!(
                "surface that faces inward crosses other bodies, and {:.0} % of it lies in their material: it was taken for {meant}, from {lo:?} to {hi:?}",
                share * 100.0
            ));
        }
    }
    found
}

/// What winds around most of the points.
fn around_most(points: &[Around]) -> Vec<u32> {
    let mut counts: BTreeMap<u32, usize> = BTreeMap::new();
    points.iter().flatten().for_each(|(o, _)| *counts.entry(*o).or_insert(0) += 1);
    counts.into_iter().filter(|(_, count)| *count as f64 >= PLAINLY * points.len() as f64).map(|(o, _)| o).collect()
}

/// For each closed piece that crosses one of opposite sign, and is to be looked at, what winds around points spread over it.
fn around_points(
    survey: &Survey<'_>,
    submesh: &Submesh,
    pieces: &Components,
    reversed: &Reversed,
    crossing: &[[u32; 2]],
) -> BTreeMap<u32, Vec<Around>> {
    let list = &pieces.list;
    let sign = |c: u32| if list[c as usize].open { 0 } else { list[c as usize].extent.volume.signum() };
    let opposed = crossing.iter().filter(|[a, b]| sign(*a) * sign(*b) < 0);
    let mut asked: Vec<u32> = opposed.flatten().copied().collect();
    asked.sort_by_key(|c| (Reverse(list[*c as usize].extent.volume.abs()), *c));
    asked.dedup();
    asked.truncate(MOST);
    let points = spread(survey, submesh, reversed, pieces, &asked);
    let places: Vec<[f64; 3]> = points.iter().map(|(_, place)| *place).collect();
    let mut all: BTreeMap<u32, Vec<Around>> = BTreeMap::new();
    for ((piece, _), around) in points.iter().zip(bodies::surfaces_around(survey, submesh, pieces, reversed, &places)) {
        all.entry(*piece).or_default().push(around);
    }
    all
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
    fn a_body_that_a_body_inside_out_stands_beside_or_in_is_not_turned() {
        assert_eq!(turned(&[reversed(&host()), cuboid([9.0; 3], [10.0; 3])]), (1, 0));
        // It is no cavity of that: most of it lies outside.
        assert_eq!(turned(&[reversed(&host()), bar(24.0)]), (1, 0));
    }
}
