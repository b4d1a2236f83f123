//! Closes boundary loops: by a triangulation between their vertices, which is then shaped to continue the surface, where it has
//! room for that, and revoked where it crosses anything.

mod across;
mod closing;
mod creases;
mod doubts;
mod judged;
mod known;
mod mouth;
mod opposite;
mod rims;
mod splinters;
mod step_back;
mod strips;
mod together;

use crate::contract::report::{MOST_LISTED, RepairName};
use crate::repairs::shared::context::PatchAcross;
use crate::repairs::shared::context::{Changes, Done, Repair};
pub(crate) use closing::Closed;
use closing::{Closing, FLAT, Neighbours, NotFilled, left, meets_new_edge};

use crate::algorithms::fairing::{Method, ShapeSettings};
use crate::algorithms::triangulate::{self, Unfillable};
use crate::contract::report::LoopLeft;
use crate::contract::settings::{PatchShape, Profile};
use crate::detect::holes::{
    Shapes,
    loops::{self, Boundary, Loop},
    owners::Owners,
};
use crate::repairs::holes::fair;
use crate::repairs::holes::patches::in_words;
use crate::repairs::shared::admission::Admission;
use crate::repairs::shared::work::Work;
use crate::submesh::components::Reversed;
use crate::submesh::near::Tolerance;
use crate::submesh::{Submesh, Vertex};
use crate::topology::survey::Survey;
use crate::util::parallel;
use crate::util::words::Count;

/// Loops. Hands over what no patch closes.
pub(crate) const REPAIR: Repair = Repair {
    name: RepairName::Fill,
    changes: Changes::Surface,
    run: |cx| {
        let closed =
            fill_loops(cx.survey, &mut cx.work, &cx.reversed, cx.tolerance, (cx.profile, cx.handed.only_loop), cx.limits.threads);
        let parts: Vec<String> =
            closed.by_method.iter().map(|(method, count)| format!("{} {}", Count(*count), in_words(method))).collect();
        cx.account.loops_left = closed.left;
        (cx.handed.kept_open, cx.handed.kept_sheets) = (closed.kept_open, closed.kept_sheets);
        cx.handed.sheets = closed.sheets;
        cx.handed.across = closed.across;
        cx.account.doubts.extend(doubts::summed_up(closed.doubts));
        cx.account.doubts.extend(closed.judged.doubts);
        cx.handed.explained = closed.judged.explained;
        cx.account.explained.area += closed.judged.area;
        cx.account.explained.largest = closed.judged.largest;
        cx.account.explained.reached.add(&closed.judged.reached);
        if let Some(meant) = &mut cx.account.enclosed.meant {
            *meant += closed.judged.volume - closed.not_meant;
        }
        Ok(Done::count(closed.loops, format!("loops closed: {}", parts.join(", "))))
    },
};

/// Takes those patches back that are of surfaces which did not take part when crossings were resolved.
pub(crate) fn open_again(work: &mut Work<'_>, across: Vec<PatchAcross>, taken_part: &[bool]) -> Vec<LoopLeft> {
    let has_taken_part = |t: u32| taken_part.get(t as usize) == Some(&true);
    let back = across.into_iter().filter(|(triangles, _)| !triangles.clone().any(has_taken_part));
    back.map(|(triangles, left)| {
        triangles.for_each(|t| work.kill(t));
        left
    })
    .collect()
}

/// A patch that lies flat on the triangles around its loop is put in only below this share of its component's area: it closes a
/// notch, while a flat sheet would become a body of no thickness.
const MAX_FLAT_SHARE: f64 = 0.1;
/// And only for loops of at most so many edges.
const MAX_FLAT_EDGES: usize = 64;

/// Fills every loop that the profile admits, or only the one through a place. Patches are found in parallel and put in in the loops' order; one that meets an edge
/// that an earlier one has made is found anew, so that the result does not depend on the threads.
pub(crate) fn fill_loops(
    survey: &Survey<'_>,
    work: &mut Work<'_>,
    reversed: &Reversed,
    tolerance: &Tolerance,
    (profile, only_loop): (&Profile, Option<[f32; 3]>),
    threads: usize,
) -> Closed {
    let (submesh, edges) = work.edges();
    let Boundary { loops: rims, mut chains } = loops::boundary(submesh, edges);
    let shapes = Shapes::of(submesh, &rims, threads);
    let owners = Owners::of(survey, submesh, edges, reversed, &rims);
    let admission = Admission::of(survey, work, &rims, &shapes, reversed, tolerance, (profile, only_loop));
    let mut closing = Closing::of(admission, profile);
    let first = closing.close_together(survey, work, rims, (shapes, owners), threads);
    closing.triangulate(work, first, threads);
    closing.close_flat(survey, work);
    if let Some(settings) = shape_settings(profile) {
        let all: Vec<usize> = (0..closing.placed.len()).collect();
        fair::smooth(survey, work, &mut closing.placed, &all, &settings, threads);
    }
    if profile.check_self_intersections {
        closing.guard(survey, work, reversed, shape_settings(profile), threads);
        closing.close_by_strips(survey, work, reversed, threads);
    }
    let balances = profile.resolve_crossings && profile.fill_holes && survey.crossing_pairs.is_some();
    let mut balancing = closing.close_slits(work, balances);
    let mut across = Vec::new();
    if profile.resolve_crossings && survey.crossing_pairs.is_some() {
        across = closing.close_across(work);
    }
    let mut unclosed = Vec::new();
    let first_balancing = across.len();
    if balances {
        unclosed = closing.balance(work, &mut across);
    }
    balancing += (across.len() - first_balancing) as u64;
    let mut judged = closing.judge(survey, work, profile);
    judged.doubts.extend(splinters::doubts(survey, work));
    let mut kept = Closed { judged, ..Closed::default() };
    closing.keep_open(work, &mut chains, &mut kept);
    let mut closed = closing.finish(work, kept);
    if balancing > 0 {
        closed.loops += balancing;
        *closed.by_method.entry(BALANCING.into()).or_insert(0) += balancing;
    }
    closed.left.extend(unclosed.into_iter().take(MOST_LISTED.saturating_sub(closed.left.len())));
    if !profile.fill_holes {
        closed.kept_open.extend(chains.iter().map(|chain| work.positions[chain[0] as usize]));
    }
    closed.across = across;
    // Where edges were balanced, they are in the loops there.
    let chains = if balances { &[] } else { &chains[..] };
    for chain in chains.iter().take(MOST_LISTED.saturating_sub(closed.left.len())) {
        let length = chain.windows(2).map(|w| work.distance(w[0], w[1])).sum();
        closed.left.push(left(work, chain[0], chain.len() - 1, length, &NO_LOOP));
    }
    closed
}

/// Closes the loops that run through places that are asked for, each for itself, whatever the profile says of loops: the surface was closed there
/// before it was cut out. What would cross anything stays open.
pub(crate) fn close_again(
    survey: &Survey<'_>,
    work: &mut Work<'_>,
    reversed: &Reversed,
    tolerance: &Tolerance,
    (profile, is_asked): (&Profile, &dyn Fn(Vertex) -> bool),
    threads: usize,
) {
    let free = Profile {
        fill_holes: true,
        close_sheets: true,
        leave_open: Vec::new(),
        max_hole_edges: u32::MAX,
        max_hole_perimeter_relative: f64::INFINITY,
        max_hole_perimeter_mm: 0.0,
        ..profile.clone()
    };
    let (submesh, edges) = work.edges();
    let rims: Vec<Loop> =
        loops::find(submesh, edges).into_iter().filter(|rim| rim.vertices.iter().all(|v| is_asked(*v))).collect();
    let shapes = Shapes::of(submesh, &rims, threads);
    let admission = Admission::of(survey, work, &rims, &shapes, reversed, tolerance, (&free, None));
    let mut closing = Closing::of(admission, profile);
    closing.may_add = false;
    closing.rims = rims;
    closing.triangulate(work, 0, threads);
    if let Some(settings) = shape_settings(profile) {
        let all: Vec<usize> = (0..closing.placed.len()).collect();
        fair::smooth(survey, work, &mut closing.placed, &all, &settings, threads);
    }
    if profile.check_self_intersections {
        closing.guard(survey, work, reversed, shape_settings(profile), threads);
    }
}

/// Why a chain of boundary edges stays open.
const NO_LOOP: &str = "no loop, but a chain that ends where the triangles around disagree on their directions";
/// What is said of those that were closed.
const BALANCING: &str = "where surfaces meet or disagree (to be cut along what they cross)";

fn shape_settings(profile: &Profile) -> Option<ShapeSettings> {
    let method = match profile.patch_shape {
        PatchShape::Flat => return None,
        PatchShape::Fair => Method::Fair,
        PatchShape::Coons => Method::Coons,
        PatchShape::Implicit => Method::Implicit,
    };
    Some(ShapeSettings { method, ..ShapeSettings::default() })
}

/// Twice the area of a patch, in the survey's units.
fn twice_area(survey: &Survey<'_>, submesh: &Submesh, rim: &Loop, patch: &triangulate::Patch) -> f64 {
    let corners = |t: &[u32; 3]| t.map(|i| submesh.positions[rim.vertices[i as usize] as usize]);
    patch.triangles.iter().map(|t| survey.measure.triangle(&corners(t)).area).sum::<i128>() as f64
}

/// All of it on a diagnosis, for tests.
#[cfg(test)]
pub(crate) fn fill(d: &mut crate::diagnosis::Diagnosis<'_>, profile: &Profile) -> Closed {
    let unturned = Reversed::none(&d.survey);
    // What nothing closes without crossing something is another pass's then.
    let profile = Profile { resolve_crossings: false, ..profile.clone() };
    fill_loops(&d.survey, &mut Work::new(&mut d.submesh), &unturned, &d.tolerance, (&profile, None), 1)
}

impl Closing<'_> {
    /// Closes the loops from number `first` on, each for itself.
    pub(crate) fn triangulate(&mut self, work: &mut Work<'_>, first: usize, threads: usize) {
        let submesh: &Submesh = work;
        let patches = parallel::map(threads, self.rims.len() - first, |i| {
            let rim = (first + i) as u32;
            (self.extend(submesh, rim), self.fill(submesh, rim, Neighbours::Heeded, &[]))
        });
        for (rim, (extended, patch)) in (first as u32..).zip(patches) {
            if let Some(extended) = extended.filter(|e| !meets_new_edge(work, self.rim(rim), &e.triangles)) {
                self.put_in_extended(work, rim, &extended);
                continue;
            }
            let patch = match patch {
                Ok(patch) if meets_new_edge(work, self.rim(rim), &patch.triangles) => {
                    self.fill(work, rim, Neighbours::Heeded, &[])
                }
                other => other,
            };
            match patch {
                Ok(patch) => self.put_in(work, rim, &patch, patch.method.name()),
                Err(reason) => self.open.push((rim, reason)),
            }
        }
    }

    /// Small loops for which nothing else was found are closed flat on the triangles around.
    pub(crate) fn close_flat(&mut self, survey: &Survey<'_>, work: &mut Work<'_>) {
        if self.open.is_empty() {
            return;
        }
        let components = work.components(survey);
        for (rim, reason) in std::mem::take(&mut self.open) {
            let loop_ = self.rim(rim);
            let area = components.list[components.of_triangle[loop_.triangles[0] as usize] as usize].extent.area as f64;
            let flat = match reason {
                NotFilled::Method(Unfillable::Blocked | Unfillable::CrossesItself) if loop_.vertices.len() <= MAX_FLAT_EDGES => {
                    self.fill(work, rim, Neighbours::Ignored, &[])
                        .ok()
                        .filter(|p| twice_area(survey, work, loop_, p) <= area * MAX_FLAT_SHARE)
                }
                _ => None,
            };
            match flat {
                Some(patch) => self.put_in(work, rim, &patch, FLAT),
                None => self.open.push((rim, reason)),
            }
        }
    }
}

#[cfg(test)]
mod tests;
