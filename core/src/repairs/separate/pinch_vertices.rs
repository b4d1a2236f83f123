//! Surfaces that share a vertex for which there is no other place: one of them is closed without it.
//!
//! Where bodies meet in a vertex between slivers, no copy of it has a valid place ([`crate::repairs::separate::nonmanifold`]). The triangles of one fan go, then, and the
//! loop around them is closed (vertex removal: Schroeder, Zarge & Lorensen, "Decimation of triangle meshes", SIGGRAPH 1992): of all fans those
//! whose surface moves least (to the patch, or to what stays at the vertex, as of a needle that lies along it), and none that moves farther than a
//! copy might. What the new triangles cross, or meet in more than
//! the loop's edges, is tested exactly; a vertex with a patch that does is tried with its other fans, then left.

use crate::contract::report::RepairName;
use crate::repairs::separate::nonmanifold;
use crate::repairs::shared::context::{Changes, Done, Repair};
use std::collections::{BTreeMap, BTreeSet, HashSet};

use crate::contract::report::{Region, RegionMethod};
use crate::contract::settings::Profile;
use crate::geometry::sums::Bounds;
use crate::repairs::boolean::resolve::{Refill, join_in, refill_of};
use crate::repairs::separate::separated::Separated;
use crate::repairs::shared::overlay::Overlay;
use crate::repairs::shared::work::Work;
use crate::submesh::components::{Reversed, nonmanifold_vertices};
use crate::submesh::radial::RadialPairs;
use crate::submesh::{Origin, Submesh, Vertex};
use crate::topology::survey::Survey;
use crate::util::ids::NONE;

/// Surfaces that meet in vertices and edges: taken apart, or closed without their vertex.
pub(crate) const REPAIR: Repair = Repair {
    name: RepairName::Separate,
    changes: Changes::Surface,
    run: |cx| {
        let mut separated = nonmanifold::separate(cx.survey, &mut cx.work, &cx.reversed, cx.profile);
        unpin(cx.survey, &mut cx.work, &cx.reversed, cx.profile, &mut separated);
        cx.account.regions.append(&mut separated.regions);
        cx.handed.unsettled.append(&mut separated.regions_left);
        cx.handed.may_cross |= separated.edges > 0;
        Ok(Done::count(separated.vertices + separated.edges + separated.removed, separated.to_string()))
    },
};

/// How often it is tried with other fans, and then without the vertices that these fail at.
const ROUNDS: usize = 8;

/// Vertices, at most: where more are left, something else is wrong.
const MOST: usize = 1024;

/// The ways to close a vertex's fans without it, the one that moves least first.
struct Pinned {
    ways: Vec<Refill>,
    /// How many of them have to be, so that one fan is left.
    wanted: usize,
    /// The first way to try.
    from: usize,
}

/// Closes fans of vertices at which [`crate::repairs::separate::nonmanifold::separate`] left several. O(submesh) a round.
pub(crate) fn unpin(
    survey: &mut Survey<'_>,
    work: &mut Work<'_>,
    reversed: &Reversed,
    profile: &Profile,
    separated: &mut Separated,
) {
    if separated.left == 0 {
        return;
    }
    let vertices = nonmanifold_vertices(work, survey.threads());
    complete_around(survey, work, reversed, &vertices[..vertices.len().min(MOST)]);
    let (submesh, edges) = work.edges();
    let radial = RadialPairs::of(submesh, edges);
    let limit = profile.max_separation_relative * survey.bounds.diagonal();
    let mut all: BTreeMap<Vertex, Pinned> = BTreeMap::new();
    for v in vertices.iter().take(MOST) {
        all.extend(Pinned::at(submesh, &radial, *v, limit).map(|pinned| (*v, pinned)));
    }
    let before = work.snapshot();
    let met_before: HashSet<Vertex> = vertices.iter().copied().collect();
    for _ in 0..ROUNDS {
        if all.is_empty() {
            return;
        }
        let first = work.triangles.len() as u32;
        let (added_by, regions) = put_in(work, &all);
        match blamed(survey, work, reversed, first, &added_by, &met_before) {
            Some(blamed) if blamed.is_empty() => {
                separated.closed(survey, work, regions);
                return;
            }
            Some(blamed) => {
                for v in blamed {
                    let exhausted = all.get_mut(&v).is_none_or(|pinned| {
                        pinned.from += 1;
                        pinned.from + pinned.wanted > pinned.ways.len()
                    });
                    if exhausted {
                        all.remove(&v);
                    }
                }
            }
            None => all.clear(),
        }
        work.restore(&before);
    }
}

/// Fetches the stars of the neighbours of some vertices, so that what is closed there hangs together with what is around it.
fn complete_around(survey: &mut Survey<'_>, work: &mut Work<'_>, reversed: &Reversed, vertices: &[Vertex]) {
    // Copies that found no place.
    work.forget_unused();
    let around = vertices.iter().flat_map(|v| work.star(*v)).flat_map(|(t, _)| work.triangles[t as usize].v);
    let wanted: BTreeSet<Vertex> = around.filter(|v| !work.complete[*v as usize]).collect();
    if wanted.is_empty() {
        return;
    }
    let positions: Vec<[f32; 3]> = wanted.into_iter().map(|v| work.positions[v as usize]).collect();
    let new = survey.promote(&positions);
    let first = work.extend_at(survey, &new, &positions);
    (first..work.triangles.len() as u32).for_each(|t| join_in(work, reversed, t));
}

impl Pinned {
    /// `None` if the fans are not all closed and complete, or not enough of them can be closed within the limit.
    fn at(submesh: &Submesh, radial: &RadialPairs, v: Vertex, limit: f64) -> Option<Self> {
        let fans = radial.fans(submesh, v)?;
        let is_complete = |t: &u32| submesh.triangles[*t as usize].v.iter().all(|v| submesh.complete[*v as usize]);
        let wanted = fans.len().checked_sub(1).filter(|wanted| *wanted > 0)?;
        let fans: Vec<Vec<u32>> = fans.iter().map(|fan| fan.iter().map(|half| half.triangle).collect()).collect();
        let complete = fans.iter().filter(|fan| fan.iter().all(is_complete));
        let way = |fan: &Vec<u32>| {
            let beside: Vec<u32> = fans.iter().filter(|other| *other != fan).flatten().copied().collect();
            refill_of(submesh, fan.clone(), &beside, limit)
        };
        let mut ways: Vec<Refill> = complete.filter_map(way).collect();
        ways.sort_by(|a, b| a.moved.total_cmp(&b.moved).then_with(|| a.triangles.cmp(&b.triangles)));
        (ways.len() >= wanted).then_some(Self { ways, wanted, from: 0 })
    }
}

/// Puts the patches of all vertices in, but where another vertex has taken the triangles. Returns whose each new triangle is, and what was done.
fn put_in(work: &mut Work<'_>, all: &BTreeMap<Vertex, Pinned>) -> (Vec<Vertex>, Vec<Region>) {
    let (mut added_by, mut regions) = (Vec::new(), Vec::new());
    for (v, pinned) in all {
        for Refill { triangles, patches, moved } in &pinned.ways[pinned.from..pinned.from + pinned.wanted] {
            if triangles.iter().any(|t| !work.lives(*t)) {
                continue;
            }
            let mut bounds = Bounds::EMPTY;
            triangles.iter().for_each(|t| bounds.include(&work.points(*t)));
            triangles.iter().for_each(|t| work.kill(*t));
            for corners in patches {
                work.add(*corners, Origin::Added(RepairName::Separate), NONE);
                added_by.push(*v);
            }
            let Bounds { lo, hi } = bounds.normalised();
            let count = triangles.len() as u64;
            regions.push(Region {
                method: RegionMethod::Refilled,
                bounds: [lo, hi],
                count,
                rounds: 0,
                moved: *moved,
                reason: None,
            });
        }
    }
    (added_by, regions)
}

/// The vertices whose patches have no area somewhere, cross anything, or make edges or vertices that more surfaces share. `None` if that is too
/// much work to tell.
fn blamed(
    survey: &Survey<'_>,
    work: &mut Work<'_>,
    reversed: &Reversed,
    first: u32,
    added_by: &[Vertex],
    met_before: &HashSet<Vertex>,
) -> Option<BTreeSet<Vertex>> {
    let by = |t: u32| t.checked_sub(first).map(|n| added_by[n as usize]);
    let added = first..work.triangles.len() as u32;
    let mut blamed: BTreeSet<Vertex> = added.clone().filter(|t| work.is_collinear(*t)).filter_map(by).collect();
    let (submesh, edges) = work.edges();
    let of_pairs = edges.iter().filter(|edge| edge.uses.len() > 2).flat_map(|edge| edge.uses).map(|used| used.triangle());
    blamed.extend(of_pairs.filter_map(by));
    let met: HashSet<Vertex> =
        nonmanifold_vertices(submesh, survey.threads()).into_iter().filter(|v| !met_before.contains(v)).collect();
    blamed.extend(added.filter(|t| submesh.triangles[*t as usize].v.iter().any(|v| met.contains(v))).filter_map(by));
    let overlay = Overlay::of(survey, submesh, reversed)?;
    let pairs = overlay.met_by(survey, submesh, |t| t >= first)?;
    let numbers = pairs.iter().flat_map(|pair| pair.triangles);
    blamed.extend(numbers.filter_map(|number| overlay.changed_of(number)).filter_map(by));
    Some(blamed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{After, after, cube, shifted};

    fn unpinned(limit: f64) -> After<Separated> {
        let mesh = [cube(), shifted(&cube(), [1.0; 3])].concat();
        let profile = Profile { max_separation_relative: limit, ..Profile::default() };
        after(&mesh, |d, turned| {
            let mut separated = Separated { left: 1, ..Separated::default() };
            unpin(&mut d.survey, &mut Work::new(&mut d.submesh), turned, &profile, &mut separated);
            separated
        })
    }

    #[test]
    fn one_of_two_bodies_is_closed_without_the_vertex_that_they_share() {
        let got = unpinned(1.0);
        assert!(got.verdict.good, "{:?}", got.verdict);
        assert_eq!((got.result.removed, got.result.left, got.defects.bodies), (1, 0, 2));
        // A corner of one of the unit cubes is gone.
        let Separated { farthest, .. } = got.result;
        assert!((0.2..1.2).contains(&farthest) && (1.0..1.9).contains(&got.defects.volume), "{farthest} {}", got.defects.volume);
    }

    #[test]
    fn nothing_moves_farther_than_the_limit() {
        let got = unpinned(1e-4);
        assert_eq!((got.result.removed, got.result.left, got.defects.nonmanifold_vertices), (0, 1, 1));
    }
}
