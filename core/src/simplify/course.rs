//! The course of a simplification: all at first, then the places again that missed the deviation.

use rayon::prelude::*;

use crate::geometry::tri_tri::Triangle;
use crate::proof::{Changes, Pairing, Verdict};
use crate::simplify::cell::{LIMITS, Rules};
use crate::simplify::held::Held;
use crate::simplify::legal;
use crate::simplify::net::{Constraints, Net};
use crate::simplify::parting::Parting;
use crate::simplify::partition::{EVERYWHERE, Planes};
use crate::simplify::rounds::{self, Goal};
use crate::simplify::task::{Barred, Ended, Input, Options, Outcome};
use crate::util::ids::NONE;

/// The largest mean of squared distances from the planes of a quadric, in squares of the deviation that is wanted. A surface goes about twice as far at its
/// farthest place as in the mean. With 0.12, a bumpy torus of 100 k triangles keeps up to a quarter more, and parts keep 1.4 % and 4 % more in the mean (for
/// a thousandth and a ten-thousandth of the diagonal); with 0.3 the deviation is missed in more places, which are finer in the end, and it takes twice as
/// long (measured).
const LIMIT: f64 = 0.2;

/// Where all is done anew, the aim, which is a square, is lowered as far as the deviation was missed, but to no less and no more than these shares of it:
/// one place may have missed it by far, and one that has by little shall not do so again.
const LOWER: [f64; 2] = [0.5, 0.7];

/// Where the deviation is missed, half of it is aimed at instead, then a quarter; then all stays.
const STRICTER: f64 = 0.25;

/// Rounds, at most: the share of vertices below each plane that parts cells, and the margin of the count. The first two leave a margin, so that what
/// cells share is not left fine for good; after the third one as many are left in all as are wanted, whatever cells share then. Later ones are for
/// collapses that were not allowed sooner.
///
/// Where a count is wanted, all quadrics are made anew after each round with a margin. Those of the mesh as it is then keep the others nearer to the input
/// than sums of all before do (Lindstrom & Turk, "Evaluation of memoryless simplification", IEEE TVCG 5(2), 1999, forget after each collapse): for a bumpy
/// torus of a million triangles to a fifth, the largest distance is 26 % less than if they are kept, the mean one 8 % (measured). New quadrics do not know
/// how far the mesh is from the input already. So the old ones are kept where a round stops short of its margin, since distance may be the limit: with new
/// ones a small part that ends so misses the deviation in more places, and keeps up to half more triangles (measured). One round does for one cell.
const ROUNDS: [(f64, f64); 6] = [(0.5, 1.4), (0.41, 1.1), (0.56, 0.0), (0.46, 0.0), (0.61, 0.0), (0.38, 0.0)];

/// So many of them where no count is wanted: one for all, two for what cells share.
const ROUNDS_WITHOUT_COUNT: usize = 3;

/// A mesh that is simplified, and how.
pub(super) struct Course<'a> {
    pub(super) input: &'a Input<'a>,
    pub(super) options: &'a Options,
    /// The largest deviation that may be.
    pub(super) most: f64,
    /// Vertices of a cell.
    pub(super) cell: usize,
    /// The cosine of the angle from which on an edge is a feature.
    pub(super) feature: f64,
    /// Cells multiply lengths by this power of two.
    pub(super) unit: f64,
    /// The part of [`LIMIT`] that is aimed at.
    pub(super) aim: f64,
}

/// A simplified mesh.
pub(super) struct Made {
    net: Net,
    /// The vertex that each of the input has become.
    became: Vec<u32>,
    ended: Ended,
    redone: usize,
}

impl Course<'_> {
    /// The input as a net.
    pub(super) fn net(&self, held: &Held) -> Net {
        let Input { points, faces, .. } = self.input;
        Net::new(points, faces, &Constraints { fixed: &held.fixed, strict: &held.strict, feature: self.feature })
    }

    /// Simplifies all.
    pub(super) fn first(&self, held: &Held) -> Made {
        self.reduce(self.net(held), (0..self.input.points.len() as u32).collect())
    }

    /// Less is aimed at everywhere, after a deviation of `worst`.
    pub(super) fn aim_lower(&mut self, worst: f64) {
        self.aim *= (self.most / worst).powi(2).clamp(LOWER[0], LOWER[1]);
    }

    /// Simplifies places again, for which less is aimed at since the last time. If no count is wanted, all else stays. Nothing where that would be most
    /// of the mesh.
    pub(super) fn redo(&self, made: &Made, first: &Net, held: &Held) -> Option<Made> {
        let mut is_parted = vec![false; made.net.points.len()];
        made.became.iter().zip(&held.is_raised).for_each(|(v, is_raised)| is_parted[*v as usize] |= *is_raised);
        let parting = Parting { input: self.input, first, net: &made.net, became: &made.became, is_parted };
        let (net, became) = parting.net(&held.fixed, &held.strict, self.options.triangles.is_none())?;
        let next = self.reduce(net, became);
        Some(Made { redone: made.redone + next.redone, ..next })
    }

    /// Simplifies a net, by rounds; `became`: the vertex of it that each of the input has become.
    fn reduce(&self, mut net: Net, mut became: Vec<u32>) -> Made {
        let cosine = |angle: f64| angle.clamp(0.0, std::f64::consts::FRAC_PI_2).cos();
        let shape = legal::Bounds { turn: cosine(self.options.max_turn), feature: self.feature };
        let most = (self.most * self.unit).powi(2);
        let limits = std::array::from_fn::<_, LIMITS, _>(|strict| LIMIT * self.aim * most * STRICTER.powi(strict as i32));
        let rules = Rules { shape, unit: self.unit, limits, optimal: self.options.optimal };
        let (mut redone, mut barred) = (0, Barred::default());
        let wanted = self.options.triangles.unwrap_or(0);
        let rounds = if wanted == 0 { ROUNDS_WITHOUT_COUNT } else { ROUNDS.len() };
        for (below, margin) in ROUNDS.into_iter().take(rounds) {
            if net.faces.len() <= wanted {
                break;
            }
            let before = net.faces.len();
            let is_whole = net.points.len() <= self.cell;
            let goal = Goal { triangles: wanted, margin: if is_whole { 0.0 } else { margin } };
            let within = self.input.within.unwrap_or(EVERYWHERE);
            let round = rounds::round(&mut net, rules, Planes { most: self.cell, below, within }, goal);
            became.par_iter_mut().for_each(|v| *v = round.became[*v as usize]);
            redone += round.redone;
            barred = round.barred;
            // A round with a margin may have nothing to do, and the next one much.
            if is_whole || (net.faces.len() == before && margin <= 1.0) {
                break;
            }
            if margin > 1.0 && wanted > 0 && round.is_reached && net.faces.len() > wanted {
                net.renew_quadrics(self.feature);
            }
        }
        let ended = match self.options.triangles {
            Some(wanted) if net.faces.len() <= wanted => Ended::Count,
            _ => barred.ended(),
        };
        Made { net, became, ended, redone }
    }

    /// The input as it is, since nothing else is as near to it as is wanted.
    pub(super) fn unchanged(&self, attempts: usize) -> Outcome {
        let Input { points, faces, .. } = *self.input;
        Outcome {
            points: points.to_vec(),
            faces: faces.to_vec(),
            origins: (0..faces.len() as u32).collect(),
            became: (0..points.len() as u32).collect(),
            proved: Some(crate::proof::Proved::default()),
            ended: Ended::Deviation,
            attempts,
            ..Outcome::default()
        }
    }
}

impl Made {
    /// The result.
    pub(super) fn outcome(self, input: &Input<'_>) -> Outcome {
        let Self { net, became, ended, redone } = self;
        let same = |(face, origin): (&[u32; 3], &u32)| {
            let was = input.faces[*origin as usize];
            let is_same = (0..3).all(|k| input.points[was[k] as usize] == net.points[face[k] as usize]);
            if is_same { *origin } else { NONE }
        };
        let origins = net.faces.iter().zip(&net.origins).map(same).collect();
        Outcome { points: net.points, faces: net.faces, origins, became, ended, redone, attempts: 1, ..Outcome::default() }
    }

    /// The input and this mesh.
    pub(super) fn pairing<'a>(&'a self, input: &Input<'a>) -> Pairing<'a> {
        Pairing {
            points: input.points,
            faces: input.faces,
            new_points: &self.net.points,
            new_faces: &self.net.faces,
            became: &self.became,
            open: &self.net.open,
        }
    }

    /// Faces that are gone in the next mesh, and those that came; those of which nothing was proved count as gone.
    pub(super) fn changes<'a>(&self, next: &Self, input: &Input<'_>, verdict: &'a Verdict) -> Changes<'a> {
        let triangle = |net: &Net, f: usize| -> Triangle { net.faces[f].map(|v| net.points[v as usize]) };
        let mut is_sure = vec![true; self.net.faces.len()];
        verdict.under.iter().for_each(|f| is_sure[*f as usize] = false);
        let mut places = vec![NONE; input.faces.len()];
        (0..).zip(&self.net.origins).for_each(|(f, origin)| places[*origin as usize] = f);
        let mut stays = vec![false; self.net.faces.len()];
        let mut is_fresh = vec![true; next.net.faces.len()];
        for (f, origin) in next.net.origins.iter().enumerate() {
            let at = places[*origin as usize] as usize;
            if is_sure.get(at).is_some_and(|is_sure| *is_sure) && triangle(&self.net, at) == triangle(&next.net, f) {
                (stays[at], is_fresh[f]) = (true, false);
            }
        }
        let gone = (0..stays.len()).filter(|f| !stays[*f]).map(|f| triangle(&self.net, f)).collect();
        Changes { gone, is_fresh, verdict }
    }
}
