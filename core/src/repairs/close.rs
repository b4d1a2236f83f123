//! Closes boundary loops by triangulations between their vertices (METHODS C8, basic).

use std::collections::BTreeMap;

use super::work::Work;
use super::{annular, islands};
use crate::chunk::NONE;
use crate::fill::{self, FillSettings, Rim, Unfillable, strip};
use crate::holes;
use crate::holes::loops::{self, Loop};
use crate::parallel;
use crate::report::LoopLeft;
use crate::settings::Profile;
use crate::shop::components::{Components, Reversed, Through};
use crate::shop::{Origin, Shop, Vertex};
use crate::survey::Survey;

/// What was closed, by method, and what was not.
#[derive(Debug, Default)]
pub(super) struct Closed {
    pub(super) loops: u64,
    pub(super) by_method: BTreeMap<&'static str, u64>,
    pub(super) left: Vec<LoopLeft>,
}

/// Longest list of open loops in a report.
const LISTED: usize = 1000;

/// A patch that lies flat on the triangles around its loop is put in only below this share of its component's area: it closes a
/// notch, while a flat sheet would become a body of no thickness.
const MAX_FLAT_SHARE: f64 = 0.1;
/// And only for loops of at most so many edges.
const MAX_FLAT_EDGES: usize = 64;

/// Fills every loop that the profile admits. Patches are found in parallel and put in in the loops' order; one that meets an edge
/// that an earlier one has made is found anew, so that the result does not depend on the threads.
pub(super) fn fill_loops(survey: &Survey<'_>, work: &mut Work<'_>, profile: &Profile, threads: usize) -> Closed {
    let mut closed = Closed::default();
    closed.count(annular::bridge(survey, work, profile, threads), "annular");
    let islands = islands::bridge(survey, work, profile);
    closed.count(islands.closed, "islands");
    let bridges = islands.joints;
    let (shop, edges) = work.edges();
    let rims = loops::find(shop, edges);
    let diagonal = survey.bounds.diagonal();
    let patches = parallel::map(threads, rims.len(), |i| fill(shop, &rims[i], profile, diagonal, Neighbours::Heeded));
    let mut open: Vec<(&Loop, NotFilled)> = Vec::new();
    for (rim, patch) in rims.iter().zip(patches) {
        let patch = match patch {
            Ok(patch) if meets_new_edge(work, rim, &patch) => fill(work, rim, profile, diagonal, Neighbours::Heeded),
            other => other,
        };
        match patch {
            Ok(patch) => closed.put_in(work, rim, &patch, patch.method.name()),
            Err(reason) => open.push((rim, reason)),
        }
    }
    if !open.is_empty() {
        let (shop, edges) = work.edges();
        let components = Components::of(survey, shop, edges, &Reversed::none(survey), Through::EveryEdge);
        for (rim, reason) in open {
            let area = components.list[components.of_triangle[rim.triangles[0] as usize] as usize].extent.area as f64;
            let flat = match reason {
                NotFilled::Method(Unfillable::Blocked | Unfillable::CrossesItself) if rim.vertices.len() <= MAX_FLAT_EDGES => {
                    fill(work, rim, profile, diagonal, Neighbours::Ignored)
                        .ok()
                        .filter(|p| twice_area(survey, work, rim, p) <= area * MAX_FLAT_SHARE)
                }
                _ => None,
            };
            match flat {
                Some(patch) => closed.put_in(work, rim, &patch, "flat on its neighbours"),
                None => {
                    closed.leave(work, rim, reason);
                    // What joined an island to this rim leads nowhere now.
                    rim.triangles.iter().filter(|t| bridges.binary_search(t).is_ok()).for_each(|t| work.kill(*t));
                }
            }
        }
    }
    closed
}

/// Twice the area of a patch, in the survey's units.
fn twice_area(survey: &Survey<'_>, shop: &Shop, rim: &Loop, patch: &fill::Patch) -> f64 {
    let corners = |t: &[u32; 3]| t.map(|i| shop.positions[rim.vertices[i as usize] as usize]);
    patch.triangles.iter().map(|t| survey.measure.triangle(&corners(t)).area).sum::<i128>() as f64
}

impl Closed {
    fn put_in(&mut self, work: &mut Work<'_>, rim: &Loop, patch: &fill::Patch, how: &'static str) {
        for t in &patch.triangles {
            work.add(t.map(|i| rim.vertices[i as usize]), Origin::Patch, NONE);
        }
        self.count(1, how);
    }

    fn count(&mut self, loops: u64, how: &'static str) {
        if loops > 0 {
            self.loops += loops;
            *self.by_method.entry(how).or_default() += loops;
        }
    }

    fn leave(&mut self, shop: &Shop, rim: &Loop, reason: NotFilled) {
        if self.left.len() < LISTED {
            self.left.push(LoopLeft {
                at: shop.positions[rim.vertices[0] as usize],
                edges: rim.vertices.len() as u64,
                perimeter: rim.perimeter(shop),
                reason: reason.to_string(),
            });
        }
    }
}

/// A chord of the patch is an edge of the mesh by now.
fn meets_new_edge(shop: &Shop, rim: &Loop, patch: &fill::Patch) -> bool {
    let n = rim.vertices.len() as u32;
    patch.triangles.iter().any(|t| {
        (0..3).any(|k| {
            let (i, j) = (t[k], t[(k + 1) % 3]);
            j != (i + 1) % n && shop.has_edge(rim.vertices[i as usize], rim.vertices[j as usize])
        })
    })
}

/// Why a loop stays open.
#[derive(Debug, thiserror::Error)]
enum NotFilled {
    #[error("{0}")]
    Profile(String),
    #[error(transparent)]
    Method(#[from] Unfillable),
}

/// Whether a patch must not lie on the triangles around its loop.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Neighbours {
    Heeded,
    Ignored,
}

/// Whether the profile lets a loop be closed.
fn admitted(shop: &Shop, rim: &Loop, profile: &Profile, diagonal: f64) -> Result<(), NotFilled> {
    if !profile.fill_holes {
        return Err(NotFilled::Profile("the profile fills no holes".into()));
    }
    if rim.vertices.len() as u64 > u64::from(profile.max_hole_edges) {
        return Err(NotFilled::Profile(format!("more than the profile's {} edges", profile.max_hole_edges)));
    }
    let bound = profile.max_hole_perimeter_relative * diagonal;
    if rim.perimeter(shop) > bound {
        return Err(NotFilled::Profile(format!("longer than the profile's {bound:.3}")));
    }
    Ok(())
}

/// The same, for those who do not ask why.
pub(super) fn is_admitted(shop: &Shop, rim: &Loop, profile: &Profile, diagonal: f64) -> bool {
    admitted(shop, rim, profile, diagonal).is_ok()
}

/// Is there an edge between two vertices of loops?
pub(super) fn are_joined(shop: &Shop, a: Vertex, b: Vertex) -> bool {
    if shop.complete[a as usize] { shop.has_edge(a, b) } else { shop.has_edge(b, a) }
}

fn fill(shop: &Shop, rim: &Loop, profile: &Profile, diagonal: f64, neighbours: Neighbours) -> Result<fill::Patch, NotFilled> {
    admitted(shop, rim, profile, diagonal)?;
    let points = rim.points(shop);
    let apexes = if neighbours == Neighbours::Heeded { rim.apexes(shop) } else { Vec::new() };
    let forbidden = |i: u32, j: u32| are_joined(shop, rim.vertices[i as usize], rim.vertices[j as usize]);
    let settings = FillSettings { max_vertices: profile.max_hole_edges as usize, ..FillSettings::default() };
    let of_patch = Rim { points: &points, apexes: &apexes, forbidden: &forbidden };
    if neighbours == Neighbours::Heeded
        && let Some(patch) = holes::folds(shop, rim).and_then(|folds| strip::zip(&of_patch, folds).ok())
    {
        return Ok(patch);
    }
    Ok(fill::triangulate(&of_patch, &settings)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{After, after, cube, plate};

    /// A cube without its top.
    fn filled(profile: &Profile) -> After<Closed> {
        let mut open = cube();
        open.drain(2..4);
        after(&open, |d, _| fill_loops(&d.survey, &mut Work::new(&mut d.shop), profile, 1))
    }

    #[test]
    fn an_open_cube_is_closed() {
        let got = filled(&Profile::default());
        assert_eq!((got.result.loops, got.result.left.len(), got.untouched), (1, 0, 10));
        assert!(got.verdict.good && (got.defects.volume - 1.0).abs() < 1e-9, "{:?}", got.verdict);
    }

    #[test]
    fn what_the_profile_does_not_admit_is_left_and_said() {
        // The loop has four edges of length 1; the diagonal is 1.73.
        let few_edges = Profile { max_hole_edges: 3, ..Profile::default() };
        let short = Profile { max_hole_perimeter_relative: 2.0, ..Profile::default() };
        let none = Profile { fill_holes: false, ..Profile::default() };
        for (profile, words) in [(few_edges, "3 edges"), (short, "longer"), (none, "fills no holes")] {
            let got = filled(&profile);
            assert_eq!((got.result.loops, got.result.left.len(), got.defects.boundary_edges), (0, 1, 4));
            assert!(got.result.left[0].reason.contains(words), "{}", got.result.left[0].reason);
            assert_eq!((got.result.left[0].edges, got.result.left[0].perimeter), (4, 4.0));
        }
    }

    #[test]
    fn holes_that_meet_in_a_vertex_leave_one_fan_there() {
        let pinched = plate(4, |x, y| !(x == y && (1..3).contains(&x)));
        // The plate's own rim, of 16 edges, stays open.
        let profile = Profile { max_hole_edges: 4, ..Profile::default() };
        let got = after(&pinched, |d, _| {
            assert_eq!(d.defects.nonmanifold_vertices, 1, "a bow-tie");
            fill_loops(&d.survey, &mut Work::new(&mut d.shop), &profile, 1).loops
        });
        assert_eq!((got.result, got.defects.nonmanifold_vertices, got.defects.boundary_loops), (2, 0, 1));
    }
}
