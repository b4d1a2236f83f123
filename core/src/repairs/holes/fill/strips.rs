//! Two holes whose patches cross what runs through them: the sides of the way from one to the other are missing, as of a sleeve around a shaft.

use glam::DVec3;

use super::closing::{Closing, NotFilled};
use crate::detect::holes::{
    Shapes,
    loops::Loop,
    owners::{self, Owners},
};
use crate::repairs::holes::annular;
use crate::repairs::holes::patches::Placed;
use crate::repairs::shared::collisions;
use crate::repairs::shared::work::Work;
use crate::submesh::components::Reversed;
use crate::submesh::{Submesh, Vertex};
use crate::topology::survey::Survey;

/// No more loops than this are looked at.
const MOST_LOOPS: usize = 256;

/// A strip that was put in, and the patch that it takes the place of, with its triangles.
struct Attempt {
    strip: usize,
    rims: [u32; 2],
    instead: Option<(usize, Vec<[Vertex; 3]>)>,
}

/// Volume under a triangle, seen from a point.
fn volume_under(submesh: &Submesh, t: u32, from: DVec3) -> f64 {
    let [a, b, c] = submesh.triangles[t as usize].v.map(|v| submesh.place(v) - from);
    a.dot(b.cross(c)) / 6.0
}

impl Closing<'_> {
    /// Closes loops that no patch closes without crossing anything by a strip to another loop of the same surface, which may be closed already: if
    /// the strip crosses nothing, it stays.
    pub(crate) fn close_by_strips(&mut self, survey: &Survey<'_>, work: &mut Work<'_>, reversed: &Reversed, threads: usize) {
        let pairs = self.strips_to_try(survey, work, reversed, threads);
        if pairs.is_empty() {
            return;
        }
        let mut attempts = self.put_in_strips(work, &pairs, threads);
        let mut patch_of = vec![None; work.triangles.len()];
        for (i, patch) in (0..).zip(&self.placed) {
            patch.triangles().for_each(|t| patch_of[t as usize] = Some(i));
        }
        let is_strip = |patch: u32| attempts.iter().any(|attempt| attempt.strip == patch as usize);
        let crossed = collisions::crossed(survey, work, reversed, &patch_of, is_strip);
        attempts.retain_mut(|attempt| {
            let stays = crossed.as_ref().is_some_and(|crossed| !crossed.contains_key(&(attempt.strip as u32)));
            if !stays {
                self.placed[attempt.strip].replace(work, &[]);
                if let Some((patch, triangles)) = attempt.instead.take() {
                    self.placed[patch].replace(work, &triangles);
                }
            }
            stays
        });
        let middle = survey.measure.middle();
        for attempt in &attempts {
            let caps = attempt.rims.map(|rim| owners::fan(work, &self.rim(rim).vertices, middle).0);
            let strip: f64 = self.placed[attempt.strip].triangles().map(|t| volume_under(work, t, middle)).sum();
            self.not_meant += caps[0] + caps[1] - strip;
        }
        self.open.retain(|(rim, _)| !attempts.iter().any(|attempt| attempt.rims.contains(rim)));
    }

    /// Loops that are open since every patch crosses something, each with the nearest one that a strip may lead to: one like it, or one that is
    /// closed by a patch of its own.
    fn strips_to_try(&self, survey: &Survey<'_>, work: &mut Work<'_>, reversed: &Reversed, threads: usize) -> Vec<[u32; 2]> {
        let open: Vec<u32> =
            self.open.iter().filter(|(_, reason)| matches!(reason, NotFilled::Crosses)).map(|(rim, _)| *rim).collect();
        if open.is_empty() {
            return Vec::new();
        }
        let (submesh, edges) = work.edges();
        let owners = Owners::of(survey, submesh, edges, reversed, &self.rims);
        let shapes = Shapes::of(submesh, &self.rims, threads);
        let mut free = vec![false; self.rims.len()];
        open.iter().for_each(|rim| free[*rim as usize] = true);
        for patch in self.placed.iter().filter(|patch| patch.count > 0) {
            if let [rim] = patch.rims[..] {
                free[rim as usize] = true;
            }
        }
        let mut pairs = Vec::new();
        for rim in open.into_iter().take(MOST_LOOPS) {
            if !std::mem::replace(&mut free[rim as usize], false) {
                continue;
            }
            if let Some(other) = shapes.across(rim as usize, &owners).into_iter().find(|other| free[*other]) {
                free[other] = false;
                pairs.push([rim, other as u32]);
            }
        }
        pairs
    }

    /// Puts in strips in place of the patches that there are.
    fn put_in_strips(&mut self, work: &mut Work<'_>, pairs: &[[u32; 2]], threads: usize) -> Vec<Attempt> {
        let rims: Vec<[&Loop; 2]> = pairs.iter().map(|pair| pair.map(|rim| &self.rims[rim as usize])).collect();
        let (mut attempts, placed) = (Vec::new(), &mut self.placed);
        annular::bridge(work, &rims, threads, |work, i, triangles| {
            let of_other = |patch: &Placed| patch.count > 0 && patch.rims == [pairs[i][1]];
            let instead = placed.iter().position(of_other).map(|patch| {
                let before = placed[patch].triangles().map(|t| work.triangles[t as usize].v).collect();
                placed[patch].replace(work, &[]);
                (patch, before)
            });
            attempts.push(Attempt { strip: placed.len(), rims: pairs[i], instead });
            placed.push(Placed::put_in(work, pairs[i].to_vec(), triangles, "annular"));
        });
        attempts
    }
}
