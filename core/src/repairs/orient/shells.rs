//! Shells in each other of nearly the same shape: what is between both is thinner than any printer's wall.
//!
//! Of two that face the same way the inner one is a copy (`copies`). A body that is inside out and has such a cavity may be two bodies inside out, or
//! turned with it: the file does not tell, so it is told (`thin`).

use crate::geometry::boxes::BoxTree;
use crate::repairs::shared::unsaid;
use crate::submesh::components::{Component, Components};
use crate::topology::survey::Survey;
use crate::util::words::span;

/// A wall is none if it is thinner than this share of the diagonal of its body's box ...
const NO_WALL: f64 = 1e-3;
/// ... and hardly one below this share.
const THIN: f64 = 5e-3;
/// Specks of which nothing is told are together no more than this share of all volume.
const SPECK: f64 = 1e-3;

/// Shells that lie closely in a larger one: with its number, and how thick the wall between both is. `outer`, `inner`: which closed pieces may be so.
/// O(n log n).
fn close_in(
    survey: &Survey<'_>,
    pieces: &Components,
    (outer, inner): (&[usize], &[usize]),
    most: f64,
    mut found: impl FnMut(usize, usize, f64),
) {
    if outer.is_empty() || inner.is_empty() {
        return;
    }
    let tree = BoxTree::new(&inner.iter().map(|p| pieces.list[*p].bounds).collect::<Vec<_>>());
    let mut met = Vec::new();
    let volume = |p: usize| survey.measure.volume(pieces.list[p].extent).abs();
    for o in outer {
        let piece: &Component = &pieces.list[*o];
        tree.meeting(&piece.bounds, &mut met);
        for i in met.iter().map(|i| inner[*i as usize]).filter(|i| i != o && piece.bounds.contains(&pieces.list[*i].bounds)) {
            let wall = (volume(*o) - volume(i)) / survey.measure.area(piece.extent);
            if (0.0..most * piece.bounds.diagonal()).contains(&wall) {
                found(*o, i, wall);
            }
        }
    }
}

/// Closed pieces next to the inside of another one that faces the same way, each with that one, the inner ones ascending. It is not asked whether
/// they cross.
pub(crate) fn copies(survey: &Survey<'_>, pieces: &Components) -> Vec<[u32; 2]> {
    let mut all = Vec::new();
    for sign in [1, -1] {
        let of_sign = |p: &usize| !pieces.list[*p].open && pieces.list[*p].extent.volume.signum() == sign;
        let same: Vec<usize> = (0..pieces.list.len()).filter(of_sign).collect();
        close_in(survey, pieces, (&same, &same), NO_WALL, |outer, inner, _| all.push([inner as u32, outer as u32]));
    }
    all.sort_unstable();
    all
}

/// Lines on bodies that were turned and have such a cavity. `turned`: by piece, which are as they were. O(n log n).
pub(crate) fn thin(survey: &Survey<'_>, pieces: &Components, turned: &[bool]) -> Vec<String> {
    let is_turned = |p: usize| turned.get(p) == Some(&true);
    let volume = |p: usize| {
        let volume = survey.measure.volume(pieces.list[p].extent);
        if is_turned(p) { -volume } else { volume }
    };
    let closed = |p: &usize| !pieces.list[*p].open;
    let all: f64 = (0..pieces.list.len()).filter(closed).map(|p| volume(p).abs()).sum();
    let is_body = |p: &usize| is_turned(*p) && volume(*p) > 0.0;
    let bodies: Vec<usize> = (0..pieces.list.len()).filter(closed).filter(is_body).collect();
    let cavities: Vec<usize> = (0..pieces.list.len()).filter(closed).filter(|p| volume(*p) < 0.0).collect();
    let mut found: Vec<(usize, f64)> = Vec::new();
    close_in(survey, pieces, (&bodies, &cavities), THIN, |body, _, wall| {
        if found.last().is_none_or(|(last, _)| *last != body) {
            found.push((body, wall));
        }
    });
    let told = unsaid::told(&found.iter().map(|(body, _)| volume(*body)).collect::<Vec<_>>(), SPECK * all);
    let line = |(body, wall): (usize, f64)| {
        let bounds = pieces.list[body].bounds.normalised();
        format!(
            "a body that was inside out has a cavity with a wall of {wall:.2e} around it, which may be a copy of it that is inside out as well: {}",
            span([bounds.lo, bounds.hi])
        )
    };
    unsaid::summed_up(found.into_iter().zip(told).filter(|(_, told)| *told).map(|(found, _)| line(found)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::repairs::shared::pieces;
    use crate::repairs::shared::work::Work;
    use crate::testing::{Corners, after, cuboid, reversed};

    /// Lines on a box of 8 by 8 by 8 and what is in it, if the box was turned or not.
    fn lines(inside: &[Corners], is_turned: bool) -> usize {
        let host = cuboid([0.0; 3], [8.0; 3]);
        let mesh = [if is_turned { reversed(&host) } else { host }, inside.to_vec()].concat();
        let found = after(&mesh, |d, turned| {
            let pieces = pieces::pieces(&d.survey, &mut Work::new(&mut d.submesh), turned);
            thin(&d.survey, &pieces, &[is_turned, false])
        });
        found.result.len()
    }

    #[test]
    fn a_cavity_that_leaves_no_wall_in_a_turned_body_may_be_a_copy() {
        let cavity = |wall: f32| reversed(&cuboid([wall; 3], [8.0 - wall; 3]));
        assert_eq!(lines(&cavity(0.01), true), 1);
        assert_eq!(lines(&cavity(0.15), true), 0, "a wall");
        assert_eq!(lines(&cavity(0.01), false), 0, "the file says so");
        assert_eq!(lines(&cuboid([0.01; 3], [7.99; 3]), true), 0, "a body");
    }
}
