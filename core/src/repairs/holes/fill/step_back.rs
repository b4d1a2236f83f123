//! Patches that cross something are replaced by others, or taken back.

use super::closing::{Closing, FLAT, Neighbours, NotFilled, SMALL};
use crate::algorithms::fairing::ShapeSettings;
use crate::detect::holes::loops::Loop;
use crate::geometry::tri_tri;
use crate::repairs::holes::fair;
use crate::repairs::holes::patches::{Placed, of_submesh};
use crate::repairs::shared::collisions::{self, Obstacle};
use crate::repairs::shared::work::Work;
use crate::submesh::components::Reversed;
use crate::topology::survey::Survey;
use std::collections::BTreeMap;

/// A patch that crosses anything is made anew by the next method, or around what it crosses, so many times, and is revoked then: one of
/// many vertices, which takes long, fewer times than a small one.
pub(crate) const GUARD_ROUNDS: (usize, usize) = (2, 4);

/// No patch is looked for around more triangles than this: what is so much in the way leaves no room.
pub(crate) const MAX_OBSTACLES: usize = 48;

/// How many times shorter the edges of a patch are than those around, if it is to keep clear of another body.
const FINER: f64 = 2.0;

pub(crate) fn guard_rounds(patch: &Placed, rims: &[Loop]) -> usize {
    let vertices: usize = patch.rims.iter().map(|rim| rims[*rim as usize].vertices.len()).sum();
    if vertices > SMALL { GUARD_ROUNDS.0 } else { GUARD_ROUNDS.1 }
}

impl Closing<'_> {
    /// Steps back where a patch crosses anything: to a finer shape, which keeps clear of another body near by; from the shape to the triangulation it came from, to another one around what it
    /// crosses, to the first one that crosses only bodies that the loop's own runs into already, to none. (What is closed for itself and runs
    /// into others is a solid still, which an open one is not.)
    pub(crate) fn guard(
        &mut self,
        survey: &Survey<'_>,
        work: &mut Work<'_>,
        reversed: &Reversed,
        shaping: Option<ShapeSettings>,
        threads: usize,
    ) {
        let finer = shaping.map(|settings| ShapeSettings { finer: FINER, ..settings });
        let mut is_new = vec![true; self.placed.len()];
        for round in 0..=GUARD_ROUNDS.1 {
            let mut patch_of = vec![None; work.triangles.len()];
            for (i, patch) in (0..).zip(&self.placed) {
                patch.triangles().for_each(|t| patch_of[t as usize] = Some(i));
            }
            let Some(crossed) = collisions::crossed(survey, work, reversed, &patch_of, |patch| is_new[patch as usize]) else {
                return;
            };
            is_new.fill(false);
            let refined = finer.map_or_else(Vec::new, |settings| {
                let numbers = self.to_refine(&crossed, round);
                self.refine((survey, work), &numbers, &settings, threads)
            });
            for (i, mut obstacles) in crossed {
                let i = i as usize;
                if self.placed[i].across {
                    obstacles.retain(|obstacle| !obstacle.met_already);
                }
                if obstacles.is_empty() {
                    continue;
                }
                is_new[i] = true;
                if refined.binary_search(&i).is_err() && !self.step_back(work, i, obstacles, round) {
                    self.revoke(work, i, &mut is_new);
                }
            }
            if !is_new.contains(&true) {
                return;
            }
        }
    }

    /// Patches that would make one body of two, and can still be tested once they are shaped anew.
    fn to_refine(&self, crossed: &BTreeMap<u32, Vec<Obstacle>>, round: usize) -> Vec<usize> {
        let joins = crossed.iter().filter(|(_, obstacles)| obstacles.iter().any(|obstacle| obstacle.joins));
        let numbers = joins.map(|(i, _)| *i as usize);
        numbers.filter(|i| !self.placed[*i].refined && round < guard_rounds(&self.placed[*i], &self.rims)).collect()
    }

    /// Shapes patches more finely than what is around, each once: where flat triangles between the vertices of curved surface cut into what lies
    /// close by, smaller ones do not. Returns those that were, ascending.
    fn refine(
        &mut self,
        (survey, work): (&Survey<'_>, &mut Work<'_>),
        numbers: &[usize],
        settings: &ShapeSettings,
        threads: usize,
    ) -> Vec<usize> {
        let mut before = Vec::new();
        for i in numbers {
            let patch = &mut self.placed[*i];
            patch.refined = true;
            let shaped: Vec<_> = patch.triangles().map(|t| work.triangles[t as usize].v).collect();
            let coarse = std::mem::take(&mut patch.coarse);
            if !coarse.is_empty() {
                patch.replace(work, &coarse);
            }
            before.push((shaped, coarse));
        }
        fair::smooth(survey, work, &mut self.placed, numbers, settings, threads);
        let mut finer = Vec::new();
        for (i, (shaped, coarse)) in numbers.iter().zip(before) {
            let patch = &mut self.placed[*i];
            if !patch.coarse.is_empty() {
                finer.push(*i);
            } else if !coarse.is_empty() {
                patch.replace(work, &shaped);
                patch.coarse = coarse;
            }
        }
        finer
    }

    /// Gives a patch up. Loops that it closed together are closed each for itself, where that is admitted.
    pub(crate) fn revoke(&mut self, work: &mut Work<'_>, i: usize, is_new: &mut Vec<bool>) {
        let rims = self.placed[i].rims.clone();
        if let [rim] = rims[..] {
            self.open.push((rim, NotFilled::Crosses));
            return;
        }
        for rim in rims {
            match self.fill(work, rim, Neighbours::Heeded, &[]) {
                Ok(patch) => {
                    self.put_in(work, rim, &patch, patch.method.name());
                    is_new.push(true);
                }
                Err(reason @ NotFilled::NotAdmitted(_)) => self.open.push((rim, reason)),
                Err(_) => self.open.push((rim, NotFilled::Crosses)),
            }
        }
    }

    /// Replaces a patch by the next one that may do, or by none.
    pub(crate) fn step_back(&mut self, work: &mut Work<'_>, i: usize, obstacles: Vec<Obstacle>, round: usize) -> bool {
        let again = round < guard_rounds(&self.placed[i], &self.rims);
        // What is put in in the last round would not be tested any more.
        let coarse = if again { std::mem::take(&mut self.placed[i].coarse) } else { Vec::new() };
        self.placed[i].coarse = Vec::new();
        let patch = &mut self.placed[i];
        if obstacles.iter().all(|obstacle| obstacle.met_already) && patch.spare.is_none() {
            let last = patch.triangles().map(|t| work.triangles[t as usize].v).collect();
            patch.spare = Some((patch.method, last));
        }
        patch.obstacles.extend(obstacles);
        patch.replace(work, &[]);
        let triangles = if !coarse.is_empty() {
            coarse
        } else if let (&[rim], true, true) = (patch.rims.as_slice(), patch.method != FLAT, again) {
            let tries: &[bool] = if self.rim(rim).vertices.len() > SMALL { &[false] } else { &[false, true] };
            let made = tries.iter().find_map(|across| {
                let heeded = self.placed[i].obstacles.iter().filter(|obstacle| !across || !obstacle.met_already);
                let heeded: Vec<tri_tri::Triangle> = heeded.map(|obstacle| obstacle.corners).collect();
                if heeded.len() > MAX_OBSTACLES {
                    return None;
                }
                self.fill(work, rim, Neighbours::Heeded, &heeded).ok().map(|patch| (patch, *across))
            });
            made.map_or_else(Vec::new, |(patch, across)| {
                (self.placed[i].method, self.placed[i].across) = (patch.method.name(), across);
                of_submesh(self.rim(rim), &patch)
            })
        } else {
            Vec::new()
        };
        let triangles = match self.placed[i].spare.take() {
            // It may run into what was put in since, which the next round shows.
            Some((method, spare)) if triangles.is_empty() && round < GUARD_ROUNDS.1 => {
                (self.placed[i].method, self.placed[i].across) = (method, true);
                spare
            }
            spare => {
                self.placed[i].spare = spare;
                triangles
            }
        };
        self.placed[i].replace(work, &triangles);
        !triangles.is_empty()
    }
}
