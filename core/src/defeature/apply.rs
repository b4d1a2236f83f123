//! Edits chosen and made.

use super::feature::{Feature, Outcome};
use super::features::Candidate;
use super::mesh::{DefeatureError, Mesh};
use super::reason::Reason;
use super::remove::pierce::Tree;
use super::remove::plan::Edit;
use super::vector::Point;
use std::collections::BTreeMap;

/// The mesh as it is after some rounds.
pub(crate) struct Work {
    pub(crate) mesh: Mesh,
    /// Numbers in the input; `u32::MAX` of what was added.
    origins: Vec<u32>,
    /// Triangles of the input.
    count: usize,
}

/// What a round brought.
pub(crate) struct Round {
    pub(crate) removed: Vec<Feature>,
    pub(crate) left: Vec<Feature>,
    pub(crate) edits: Vec<Edit>,
}

impl Work {
    pub(crate) fn new(points: Vec<Point>, triangles: Vec<[u32; 3]>) -> Result<Self, DefeatureError> {
        let count = triangles.len();
        Ok(Self { mesh: Mesh::new(points, triangles)?, origins: (0..count as u32).collect(), count })
    }

    /// Takes edits, in the order of the candidates, that do not meddle with those taken before.
    pub(crate) fn choose(&self, candidates: Vec<Candidate>, plans: Vec<Result<Edit, Reason>>) -> Round {
        /// A triangle that an edit removes, and one that it relies on.
        const GONE: u8 = 2;
        const HELD: u8 = 1;
        let tree = if plans.iter().any(Result::is_ok) { Some(Tree::new(&self.mesh)) } else { None };
        let mut state = vec![0_u8; self.mesh.triangles.len()];
        let mut round = Round { removed: Vec::new(), left: Vec::new(), edits: Vec::new() };
        for (candidate, plan) in candidates.into_iter().zip(plans) {
            // Part of a feature that is removed already.
            if candidate.triangles.iter().any(|t| state[*t as usize] == GONE) {
                continue;
            }
            let edit = match plan {
                Ok(edit) => edit,
                Err(reason) => {
                    round.left.push(self.feature(candidate, Outcome::Left(reason)));
                    continue;
                }
            };
            let inside = |t: u32| edit.removed.binary_search(&t).is_ok();
            let halves = || edit.removed.iter().flat_map(|t| 3 * t..3 * t + 3);
            let rim: Vec<u32> = halves().map(|half| self.mesh.across(half)).filter(|t| !inside(*t)).collect();
            let is_free = edit.removed.iter().all(|t| state[*t as usize] == 0) && rim.iter().all(|t| state[*t as usize] != GONE);
            let outcome = if is_free { Ok(()) } else { Err(Reason::Rounds) };
            let outcome = outcome.and_then(|()| match &tree {
                Some(tree) if tree.is_pierced(&self.mesh, &edit, inside) => Err(Reason::Pierced),
                _ => Ok(()),
            });
            match outcome {
                Ok(()) => {
                    rim.iter().for_each(|t| state[*t as usize] = HELD);
                    edit.removed.iter().for_each(|t| state[*t as usize] = GONE);
                    round.removed.push(self.feature(candidate, Outcome::Removed));
                    round.edits.push(edit);
                }
                Err(reason) => round.left.push(self.feature(candidate, Outcome::Left(reason))),
            }
        }
        round
    }

    fn feature(&self, candidate: Candidate, outcome: Outcome) -> Feature {
        let mut triangles: Vec<u32> =
            candidate.triangles.iter().map(|t| self.origins[*t as usize]).filter(|t| *t != u32::MAX).collect();
        triangles.sort_unstable();
        let Candidate { kind, centre, axis, size, length, depth, confidence, .. } = candidate;
        Feature { kind, centre, axis, size, length, depth, confidence, triangles, outcome }
    }

    /// Makes edits; leaves everything as it was where the mesh would not be closed and manifold.
    pub(crate) fn apply(&mut self, edits: Vec<Edit>) -> Result<(), DefeatureError> {
        let mut is_gone = vec![false; self.mesh.triangles.len()];
        let old = self.mesh.points.len();
        let mut points = self.mesh.points.clone();
        let mut added: Vec<[u32; 3]> = Vec::new();
        for edit in edits {
            edit.removed.iter().for_each(|t| is_gone[*t as usize] = true);
            let shift = (points.len() - old) as u32;
            points.extend(edit.fresh);
            added.extend(edit.triangles.into_iter().map(|t| t.map(|v| if (v as usize) < old { v } else { v + shift })));
        }
        let kept = || (0..is_gone.len()).filter(|t| !is_gone[*t]);
        let mut triangles: Vec<[u32; 3]> = kept().map(|t| self.mesh.triangles[t]).collect();
        let mut origins: Vec<u32> = kept().map(|t| self.origins[t]).collect();
        origins.resize(origins.len() + added.len(), u32::MAX);
        triangles.extend(added);
        weld(&points, &mut triangles, old);
        self.mesh = Mesh::new(points, triangles)?;
        self.origins = origins;
        Ok(())
    }

    /// The edit of the input that all rounds together are.
    pub(crate) fn edit(&self) -> (Vec<u32>, Vec<[[f32; 3]; 3]>) {
        let mut is_kept = vec![false; self.count];
        let mut added = Vec::new();
        for (triangle, origin) in self.mesh.triangles.iter().zip(&self.origins) {
            match is_kept.get_mut(*origin as usize) {
                Some(place) => *place = true,
                None => added.push(triangle.map(|v| self.mesh.at(v).map(|x| x as f32))),
            }
        }
        let gone = is_kept.iter().enumerate().filter(|(_, kept)| !**kept).map(|(t, _)| t as u32);
        (gone.collect(), added)
    }
}

/// New vertices of one place are one.
fn weld(points: &[Point], triangles: &mut [[u32; 3]], first: usize) {
    let mut by_place: BTreeMap<[u64; 3], u32> = BTreeMap::new();
    for vertex in triangles.iter_mut().flatten().filter(|v| **v as usize >= first) {
        if let Some(point) = points.get(*vertex as usize) {
            *vertex = *by_place.entry(point.map(f64::to_bits)).or_insert(*vertex);
        }
    }
}
