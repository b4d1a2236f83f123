//! Bodies that were turned, and have a cavity of nearly their own shape: what is between both is thinner than any printer's wall.
//!
//! A body that is inside out and a copy of it a little smaller, inside out as well, look like a body inside out and its cavity. The file does not tell
//! which of both it is.

use crate::geometry::boxes::BoxTree;
use crate::geometry::sums::Bounds;
use crate::submesh::components::{Component, Components};
use crate::topology::survey::Survey;

/// A wall is none if it is thinner than this share of the diagonal of its body's box.
const THIN: f64 = 1e-3;

/// Lines on bodies that were turned and have such a cavity. `turned`: by piece, which are as they were. O(n log n).
pub(crate) fn thin(survey: &Survey<'_>, pieces: &Components, turned: &[bool]) -> Vec<String> {
    let is_turned = |p: usize| turned.get(p) == Some(&true);
    let volume = |p: usize| {
        let volume = survey.measure.volume(pieces.list[p].extent);
        if is_turned(p) { -volume } else { volume }
    };
    let closed = |p: &usize| !pieces.list[*p].open;
    let bodies: Vec<usize> = (0..pieces.list.len()).filter(closed).filter(|p| is_turned(*p) && volume(*p) > 0.0).collect();
    let cavities: Vec<usize> = (0..pieces.list.len()).filter(closed).filter(|p| volume(*p) < 0.0).collect();
    if bodies.is_empty() || cavities.is_empty() {
        return Vec::new();
    }
    let tree = BoxTree::new(&cavities.iter().map(|p| pieces.list[*p].bounds).collect::<Vec<_>>());
    let mut met = Vec::new();
    let mut lines = Vec::new();
    for body in bodies {
        let piece: &Component = &pieces.list[body];
        tree.meeting(&piece.bounds, &mut met);
        let wall = |cavity: usize| (volume(body) + volume(cavity)) / survey.measure.area(piece.extent);
        let in_it = met.iter().map(|c| cavities[*c as usize]).filter(|c| piece.bounds.contains(&pieces.list[*c].bounds));
        let thinnest = in_it.map(wall).filter(|wall| *wall >= 0.0).min_by(f64::total_cmp);
        if let Some(wall) = thinnest.filter(|wall| *wall < THIN * piece.bounds.diagonal()) {
            let Bounds { lo, hi } = piece.bounds.normalised();
            lines.push(format!(
                "a body that was inside out has a cavity with a wall of {wall:.2e} around it, which may be a copy of it that is inside out as well: from \
                 {lo:?} to {hi:?}"
            ));
        }
    }
    lines
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
        assert_eq!(lines(&cavity(0.1), true), 0, "a wall");
        assert_eq!(lines(&cavity(0.01), false), 0, "the file says so");
        assert_eq!(lines(&cuboid([0.01; 3], [7.99; 3]), true), 0, "a body");
    }
}
