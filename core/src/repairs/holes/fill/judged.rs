//! What is to be said of patches: which are guesses that a person must look at, and which explain how the surface has changed.
//!
//! A flat patch on a flat rim is what is missing if the surface runs straight to the rim, as the walls of a box or a tube do. Where the
//! surface is bent there, and its mouth is wide against its body, much more may be missing (`mouth`).

use std::collections::BTreeMap;

use glam::DVec3;

use super::closing::{Closing, Judged};
use super::opposite::{self, Hole};
use super::rims::{END, GOES_ON, HOLE, axis, goes_on, height, is_round, lies_on, middle};
use super::{creases, mouth};
use crate::contract::settings::Profile;
use crate::detect::holes::loops::Loop;
use crate::detect::holes::owners;
use crate::geometry::flatness;
use crate::geometry::sums::Bounds;
use crate::repairs::holes::fair::{Beyond, Gathered};
use crate::repairs::holes::patches::{EXTENDED, ISLANDS, Placed, Planes};
use crate::repairs::shared::unsaid;
use crate::repairs::shared::work::Work;
use crate::submesh::components::Components;
use crate::submesh::{Submesh, Vertex};
use crate::topology::survey::Survey;
use crate::util::words::At;

/// Patches of planes are in doubt if another one differs by more than this share of all volume.
const IN_DOUBT: f64 = 0.001;
/// A body of less than this share of all volume is a detail, which nobody need look at; so is a corner of this share of its body.
const DETAIL: f64 = 0.1;
/// And so many times the share of volume that may change without a word is what a mouth must seem to lack: it is a rough estimate.
const ROUGH: f64 = 2.0;
/// A mouth of less than this share of the body's area is not wide.
const WIDE: f64 = 0.05;
/// A patch that continues the surface explains itself below this share of its body's area.
const WIDEST: f64 = 0.1;
/// A way through that is not drilled takes no more than this share of all volume without a word.
const WAY_THROUGH: f64 = 0.01;
/// A rim that rises and falls by more than so many times its height is ragged; that of a saddle does by 4 times.
const SADDLE: f64 = 5.0;
/// Mouths of one body that are held against each other, at most.
const MOST_MOUTHS: usize = 64;
/// Lines for people, at most.
const MOST_SAID: usize = 20;

/// The body that a patch is of.
#[derive(Clone, Copy)]
struct Body {
    area: f64,
    /// Signed.
    volume: f64,
    /// Of all bodies together.
    all: f64,
}

impl Body {
    /// The one that a triangle is of.
    fn of(survey: &Survey<'_>, bodies: &Components, triangle: u32, all: f64) -> Self {
        let extent = bodies.list[bodies.of_triangle[triangle as usize] as usize].extent;
        Self { area: survey.measure.area(extent), volume: survey.measure.volume(extent), all }
    }

    fn is_detail(&self) -> bool {
        self.volume.abs() < DETAIL * self.all
    }
}

impl Closing<'_> {
    /// Judges all patches that are in, and cross nothing. O(submesh), and a look at the surroundings of wide mouths.
    pub(crate) fn judge(&self, survey: &Survey<'_>, work: &mut Work<'_>, profile: &Profile) -> Judged {
        let mut judged = Judged::default();
        if !self.placed.iter().any(Placed::is_in) {
            return judged;
        }
        let bodies = work.components(survey);
        let submesh: &Submesh = work;
        let all = bodies.list.iter().map(|c| survey.measure.volume(c.extent).abs()).sum();
        for patch in self.placed.iter().filter(|patch| patch.is_in()) {
            let Some(first) = patch.living(submesh).next() else { continue };
            let body = Body::of(survey, &bodies, first, all);
            let doubt = match (patch.planes, patch.rims.as_slice()) {
                (Some(planes), _) if patch.method == EXTENDED => judged.planes(submesh, patch, planes, body),
                (_, [rim, islands @ ..]) if islands.is_empty() || patch.method == ISLANDS => {
                    judged.hole(survey, submesh, (patch, self.rim(*rim)), body, profile)
                }
                (_, [a, b]) => judged.ring(submesh, patch, [*a, *b].map(|rim| self.rim(rim)), body),
                _ => None,
            };
            judged.doubts.extend(doubt.map(|doubt| format!("{doubt}, at {}", At(submesh.points(first)[0]))));
        }
        let holes = opposite::holes(self, survey, submesh, &bodies);
        let is_detail = |hole: &Hole<'_>| Body::of(survey, &bodies, hole.first, all).is_detail();
        judged.doubts.extend(gone_on(submesh, &holes, is_detail));
        judged.doubts.extend(opposite::doubt(submesh, &holes));
        judged.doubts = unsaid::first(judged.doubts, MOST_SAID, |more| format!("{more} more patches are guesses like these"));
        judged
    }
}

/// Says where sharp edges may go on across holes that were closed flat, and where walls may go on from a mouth to another one. O(patches), and mouths².
fn gone_on(submesh: &Submesh, holes: &[Hole<'_>], is_detail: impl Fn(&Hole<'_>) -> bool) -> Vec<String> {
    let mut doubts = Vec::new();
    let mut mouths: BTreeMap<u32, Vec<&Hole<'_>>> = BTreeMap::new();
    // A short rim hides little.
    let is_large = |hole: &&Hole<'_>| hole.mouth.perimeter.powi(3) >= GOES_ON * hole.volume;
    for hole in holes.iter().filter(is_large).filter(|hole| !is_detail(hole)) {
        let at = At(submesh.points(hole.first)[0]);
        let told = |volume: f64| Some(volume / hole.volume).filter(|share| *share > GOES_ON).map(|share| share * 100.0);
        doubts.extend(told(across(submesh, hole)).map(|share| {
            format!("sharp edges end at a hole and may go on across it: {share:.1} % of the body would differ, at {at}")
        }));
        let of_body = mouths.entry(hole.body).or_default();
        if of_body.len() < MOST_MOUTHS && hole.goes_on.abs() <= END {
            let between = of_body.iter().map(|other| opposite::between(&hole.mouth, &other.mouth)).fold(0.0, f64::max);
            doubts.extend(told(between).map(|share| {
                format!(
                    "two mouths of one body face each other: a piece in between may be missing, {share:.1} % of the body, at {at}"
                )
            }));
            of_body.push(hole);
        }
    }
    doubts
}

/// The size of the volume by which the body would differ if sharp edges went on across a hole.
fn across(submesh: &Submesh, hole: &Hole<'_>) -> f64 {
    let from = hole.mouth.middle;
    let straight = if hole.patch.method == EXTENDED { creases::STRAIGHT } else { creases::ARC };
    creases::beyond(submesh, hole.rim, straight, (under_patch(submesh, hole.patch, from), from)).abs()
}

impl Judged {
    fn planes(&mut self, submesh: &Submesh, patch: &Placed, planes: Planes, body: Body) -> Option<String> {
        let share = planes.in_doubt / body.all;
        if share > IN_DOUBT {
            let share = share * 100.0;
            return Some(format!(
                "planes around a hole meet in several ways, which differ by {share:.1} % of all volume; one was taken"
            ));
        }
        if planes.assumed && planes.volume.abs() > IN_DOUBT * body.all {
            return Some("a face of which hardly anything is left was put in at right angles to what is around".into());
        }
        if planes.reaches && planes.volume.abs() > DETAIL * body.volume.abs() && !body.is_detail() {
            let share = planes.volume / body.volume * 100.0;
            return Some(format!(
                "planes were let go on to where they meet, around {share:.0} % of the body: they may have ended before"
            ));
        }
        self.explain(submesh, patch);
        self.volume += planes.volume * body.volume.signum();
        None
    }

    /// One that nothing speaks against: it is small against its body, or of planes that are known.
    fn explain(&mut self, submesh: &Submesh, patch: &Placed) {
        patch.living(submesh).for_each(|t| self.reached.include(&submesh.points(t)));
        self.count(submesh, patch, area(submesh, patch));
    }

    /// Adds a patch of this area to those that nothing speaks against.
    fn count(&mut self, submesh: &Submesh, patch: &Placed, area: f64) {
        self.area += area;
        self.explained.extend(patch.triangles());
        if self.largest.is_none_or(|(largest, _)| area > largest) {
            let mut bounds = Bounds::EMPTY;
            patch.living(submesh).for_each(|t| bounds.include(&submesh.points(t)));
            self.largest = Some((area, bounds));
        }
    }

    /// A patch over a hole, around its islands if there are any.
    fn hole(
        &mut self,
        survey: &Survey<'_>,
        submesh: &Submesh,
        (patch, rim): (&Placed, &Loop),
        body: Body,
        profile: &Profile,
    ) -> Option<String> {
        if breaks_off(submesh, rim, body) {
            return Some("the surface ends in a ragged edge, and was closed along it: more of it may be missing".into());
        }
        if patch.coarse.is_empty() || area(submesh, patch) < WIDE * body.area {
            self.flat(survey, submesh, (patch, rim), body, profile)
        } else {
            self.shaped(submesh, patch, body, profile)
        }
    }

    /// A ring between two rims.
    fn ring(&mut self, submesh: &Submesh, patch: &Placed, rims: [&Loop; 2], body: Body) -> Option<String> {
        if is_drilled(submesh, rims) {
            self.explain(submesh, patch);
            return None;
        }
        let doubt = way_through(submesh, patch, rims, body);
        if doubt.is_none() && area(submesh, patch) < WIDEST * body.area {
            self.explain(submesh, patch);
        }
        doubt
    }

    fn flat(
        &mut self,
        survey: &Survey<'_>,
        submesh: &Submesh,
        (patch, rim): (&Placed, &Loop),
        body: Body,
        profile: &Profile,
    ) -> Option<String> {
        let size = area(submesh, patch);
        if size < WIDE * body.area {
            self.explain(submesh, patch);
            return None;
        }
        let beyond = Beyond::of(survey, submesh, std::iter::once(patch));
        let around = Gathered::of(submesh, &beyond, patch);
        let more = if around.is_cut() { 0.0 } else { mouth::beyond(&around, size) };
        let volume = body.volume.abs();
        if !body.is_detail() && more > ROUGH * profile.max_volume_change * volume {
            let share = 100.0 * size / body.area;
            return Some(format!(
                "a mouth of {share:.0} % of its body's area was closed, while the surface is bent there: much more may be missing"
            ));
        }
        let across = axis(submesh, rim);
        if flatness::is_ragged(height(submesh, rim, across), across.length()) {
            return None;
        }
        self.count(submesh, patch, size);
        None
    }

    /// A patch that continues the surface is in doubt if it encloses much more, or less, than a flat one would.
    fn shaped(&mut self, submesh: &Submesh, patch: &Placed, body: Body, profile: &Profile) -> Option<String> {
        let from = submesh.place(patch.coarse[0][0]);
        let differ = (under_patch(submesh, patch, from) - under(submesh, patch.coarse.iter().copied(), from)).abs();
        let share = differ / body.volume.abs();
        if share <= profile.max_volume_change {
            if area(submesh, patch) < WIDEST * body.area {
                self.explain(submesh, patch);
            }
            return None;
        }
        (!body.is_detail())
            .then(|| format!("a patch that continues the surface differs from a flat one by {:.1} % of the body", share * 100.0))
    }
}

/// A way through a wall, which caps on both holes would have left closed.
fn way_through(submesh: &Submesh, patch: &Placed, rims: [&Loop; 2], body: Body) -> Option<String> {
    if !rims.iter().all(|rim| goes_on(submesh, rim) >= HOLE) {
        return None;
    }
    let from = middle(submesh, rims[0]);
    // Cones over the loops; the first one is seen from its own middle.
    let caps = axis(submesh, rims[1]).dot(middle(submesh, rims[1]) - from) / 3.0;
    let share = (under_patch(submesh, patch, from) - caps).abs() / body.all;
    (share > WAY_THROUGH).then(|| {
        format!(
            "two holes back to back were closed as a way through, {:.1} % of all volume; the skins may have been lost",
            share * 100.0
        )
    })
}

/// Are two holes the ends of what was drilled? Both are round, and one lies on the other, seen along the axis.
fn is_drilled(submesh: &Submesh, rims: [&Loop; 2]) -> bool {
    if !rims.iter().all(|rim| is_round(submesh, rim) && goes_on(submesh, rim) >= HOLE) {
        return false;
    }
    lies_on(submesh, rims)
}

/// Does all of a body end raggedly there? Where walls end at a plane, or at a bent surface, a face is missing; else nothing says how far they went.
fn breaks_off(submesh: &Submesh, rim: &Loop, body: Body) -> bool {
    let across = axis(submesh, rim);
    !body.is_detail()
        && owners::is_large(across.length(), body.volume)
        && goes_on(submesh, rim).abs() <= END
        && is_ragged(submesh, rim, across)
}

/// Does a rim rise and fall all along?
fn is_ragged(submesh: &Submesh, rim: &Loop, across: DVec3) -> bool {
    let height = height(submesh, rim, across);
    let n = rim.vertices.len();
    let step = |i: usize| submesh.vector(rim.vertices[i], rim.vertices[(i + 1) % n]).dot(across).abs();
    let way = (0..n).map(step).sum::<f64>() / across.length();
    flatness::is_ragged(height, across.length()) && way > SADDLE * height
}

/// The signed volume between a place and a patch.
fn under_patch(submesh: &Submesh, patch: &Placed, from: DVec3) -> f64 {
    under(submesh, patch.living(submesh).map(|t| submesh.triangles[t as usize].v), from)
}

/// The signed volume between a place and triangles.
fn under(submesh: &Submesh, triangles: impl Iterator<Item = [Vertex; 3]>, from: DVec3) -> f64 {
    let of = |t: [Vertex; 3]| {
        let [a, b, c] = t.map(|v| submesh.place(v) - from);
        a.cross(b).dot(c) / 6.0
    };
    triangles.map(of).sum()
}

fn area(submesh: &Submesh, patch: &Placed) -> f64 {
    patch.living(submesh).map(|t| submesh.normal(t).length() / 2.0).sum()
}
