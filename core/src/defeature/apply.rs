//! Edits chosen and made.

use super::feature::{Feature, Kind, Outcome};
use super::features::{Candidate, Entry};
use super::mesh::{DefeatureError, Mesh};
use super::reason::Reason;
use super::remove::guard::{Star, closes};
use super::remove::pierce::Tree;
use super::remove::plan::{Edit, remade};
use super::segments::Segments;
use super::vector::{Point, distance};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// A triangle that an edit removes, and one that it relies on.
const GONE: u8 = 2;
const HELD: u8 = 1;

/// In place of the number in the input: of a triangle that was added.
const ADDED: u32 = u32::MAX;

/// The ends of an edge, the lower one first.
type Ends = [[u64; 3]; 2];

/// The mesh as it is after some rounds.
pub(crate) struct Work {
    pub(crate) mesh: Mesh,
    /// Numbers in the input; `ADDED` of what was added.
    origins: Vec<u32>,
    /// Triangles of the input.
    count: usize,
    /// Kind, centre and size of what was removed.
    done: Vec<(Kind, Point, f64)>,
}

/// What a round brought.
pub(crate) struct Round {
    /// Those of each edit.
    pub(crate) removed: Vec<Vec<Feature>>,
    pub(crate) left: Vec<Feature>,
    pub(crate) edits: Vec<Edit>,
}

impl Work {
    pub(crate) fn new(points: Vec<Point>, triangles: Vec<[u32; 3]>) -> Result<Self, DefeatureError> {
        let count = triangles.len();
        Ok(Self { mesh: Mesh::new(points, triangles)?, origins: (0..count as u32).collect(), count, done: Vec::new() })
    }

    /// Takes edits, in the order of the candidates, that do not meddle with those taken before.
    pub(crate) fn choose(&self, candidates: Vec<Candidate>, plans: Vec<Result<Edit, Reason>>) -> Round {
        let tree = if plans.iter().any(Result::is_ok) { Some(Tree::new(&self.mesh)) } else { None };
        let pierced = |edit: &Edit| {
            tree.as_ref().is_some_and(|tree| tree.is_pierced(&self.mesh, edit, |t| edit.removed.binary_search(&t).is_ok()))
        };
        let pierced: Vec<bool> = plans.par_iter().map(|plan| plan.as_ref().is_ok_and(pierced)).collect();
        let mut state = vec![0_u8; self.mesh.triangles.len()];
        let mut edges: BTreeSet<Ends> = BTreeSet::new();
        let mut round = Round { removed: Vec::new(), left: Vec::new(), edits: Vec::new() };
        for ((candidate, plan), is_pierced) in candidates.into_iter().zip(plans).zip(pierced) {
            // Part of a feature that is removed already, or what took the place of one: that would have no end.
            if candidate.entry.triangles.iter().any(|t| state[*t as usize] == GONE) || self.is_done(&candidate) {
                continue;
            }
            let edit = match plan {
                Ok(edit) => edit,
                Err(reason) => {
                    round.left.extend(self.features(candidate, Outcome::Left(reason)));
                    continue;
                }
            };
            let outcome = if is_pierced { Err(Reason::Pierced) } else { self.fits(&edit, &state, &edges) };
            match outcome {
                Ok((rim, own)) => {
                    rim.iter().for_each(|t| state[*t as usize] = HELD);
                    edges.extend(own);
                    edit.removed.iter().for_each(|t| state[*t as usize] = GONE);
                    round.removed.push(self.features(candidate, Outcome::Removed));
                    round.edits.push(edit);
                }
                Err(reason) => {
                    // What waits stays whole until its turn comes: a chamfer inside of it is not taken first.
                    if reason == Reason::Rounds {
                        candidate.entry.triangles.iter().for_each(|t| state[*t as usize] = HELD.max(state[*t as usize]));
                    }
                    round.left.extend(self.features(candidate, Outcome::Left(reason)));
                }
            }
        }
        round
    }

    /// Whether an edit meddles with none that was taken; then, the triangles beside it and its new edges. Two edits may both
    /// want an edge between the same two vertices: one of them waits.
    fn fits(&self, edit: &Edit, state: &[u8], edges: &BTreeSet<Ends>) -> Result<(Vec<u32>, Vec<Ends>), Reason> {
        let inside = |t: u32| edit.removed.binary_search(&t).is_ok();
        let halves = edit.removed.iter().flat_map(|t| 3 * t..3 * t + 3);
        let rim: Vec<u32> = halves.map(|half| self.mesh.across(half)).filter(|t| !inside(*t)).collect();
        let is_free = edit.removed.iter().all(|t| state[*t as usize] == 0) && rim.iter().all(|t| state[*t as usize] != GONE);
        let key = |v: u32| edit.at(&self.mesh, v).map(|x| (x + 0.0).to_bits());
        let ends = |a: u32, b: u32| if key(a) < key(b) { [key(a), key(b)] } else { [key(b), key(a)] };
        let own: Vec<Ends> = edit.triangles.iter().flat_map(|[a, b, c]| [ends(*a, *b), ends(*b, *c), ends(*c, *a)]).collect();
        if !is_free || own.iter().any(|ends| edges.contains(ends)) {
            return Err(Reason::Rounds);
        }
        Ok((rim, own))
    }

    /// Remembers what was removed.
    pub(crate) fn note(&mut self, removed: &[Vec<Feature>]) {
        self.done.extend(removed.iter().flatten().map(|f| (f.kind, f.centre, f.size)));
    }

    /// Whether a feature of this kind, place and size was removed before.
    fn is_done(&self, candidate: &Candidate) -> bool {
        let near = |centre: Point, size: f64| {
            (size - candidate.entry.size).abs() <= 0.01 * size && distance(centre, candidate.entry.centre) <= 0.01 * size
        };
        self.done.iter().any(|(kind, centre, size)| *kind == candidate.entry.kind && near(*centre, *size))
    }

    /// The features of a candidate: itself, then those that go with it.
    fn features(&self, candidate: Candidate, outcome: Outcome) -> Vec<Feature> {
        let of_input = |triangles: &[u32]| {
            let mut own: Vec<u32> = triangles.iter().map(|t| self.origins[*t as usize]).filter(|t| *t != ADDED).collect();
            own.sort_unstable();
            own
        };
        let Candidate { mut entry, confidence, kin, .. } = candidate;
        let mut of_kin: Vec<u32> = kin.iter().flat_map(|k| k.triangles.iter().copied()).collect();
        of_kin.sort_unstable();
        entry.triangles.retain(|t| of_kin.binary_search(t).is_err());
        let feature = |Entry { kind, centre, axis, size, length, depth, triangles }| {
            let triangles = of_input(&triangles);
            Feature { kind, centre, axis, size, length, depth, confidence, triangles, outcome }
        };
        std::iter::once(entry).chain(kin).map(feature).collect()
    }

    /// Makes edits, and gives the segments of the new mesh; leaves everything as it was where the mesh would not be closed and
    /// manifold.
    pub(crate) fn apply(&mut self, edits: &[Edit], segments: &Segments) -> Result<Segments, DefeatureError> {
        let mut is_gone = vec![false; self.mesh.triangles.len()];
        let old = self.mesh.points.len();
        let mut points = self.mesh.points.clone();
        let (mut added, mut owners, mut joined) = (Vec::new(), Vec::new(), Vec::<(u32, u32)>::new());
        for edit in edits {
            edit.removed.iter().for_each(|t| is_gone[*t as usize] = true);
            let shift = (points.len() - old) as u32;
            points.extend(&edit.fresh);
            added.extend(edit.triangles.iter().map(|t| t.map(|v| if (v as usize) < old { v } else { v + shift })));
            owners.extend(&edit.owners);
            joined.extend(&edit.joined);
        }
        joined.sort_unstable();
        joined.dedup();
        joined.retain(|(one, other)| segments.continues(&self.mesh, *one, *other));
        let kept: Vec<u32> = (0..is_gone.len() as u32).filter(|t| !is_gone[*t as usize]).collect();
        let mut triangles: Vec<[u32; 3]> = kept.iter().map(|t| self.mesh.triangles[*t as usize]).collect();
        let mut origins: Vec<u32> = kept.iter().map(|t| self.origins[*t as usize]).collect();
        origins.resize(kept.len() + owners.len(), ADDED);
        triangles.extend(added);
        weld(&points, &mut triangles, old);
        self.mesh = Mesh::new(points, triangles)?;
        self.origins = origins;
        Ok(segments.carried(&self.mesh, &kept, &owners, &joined))
    }

    /// Makes faces anew that go on where features were: vertices of former rims inside of them go.
    pub(crate) fn tidy(&mut self, segments: &Segments) {
        let grown = self.origins.iter().zip(&segments.of).filter(|(origin, _)| **origin == ADDED).map(|(_, s)| *s);
        let mut numbers: Vec<u32> = grown.collect();
        numbers.sort_unstable();
        numbers.dedup();
        if numbers.is_empty() {
            return;
        }
        let star = Star::new(&self.mesh);
        let remade = |number: &u32| {
            let edit = remade(&self.mesh, segments, *number)?;
            closes(&self.mesh, &edit, &star).ok()?;
            Some(edit)
        };
        let mut edits: Vec<Edit> = numbers.par_iter().filter_map(remade).collect();
        // Two faces may both want an edge between the same two vertices.
        let mut seen: BTreeSet<(u32, u32)> = BTreeSet::new();
        edits.retain(|edit| {
            let sides = edit.triangles.iter().flat_map(|[a, b, c]| [(*a, *b), (*b, *c), (*c, *a)]);
            let mut own: Vec<(u32, u32)> = sides.map(|(a, b)| (a.min(b), a.max(b))).collect();
            own.sort_unstable();
            // Inner edges are there twice.
            let inner: Vec<(u32, u32)> = own.windows(2).filter(|w| w[0] == w[1]).map(|w| w[0]).collect();
            let is_free = inner.iter().all(|side| !seen.contains(side));
            if is_free {
                seen.extend(inner);
            }
            is_free
        });
        // Where they do not go together, all stays as it is.
        let _ = self.apply(&edits, segments);
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
