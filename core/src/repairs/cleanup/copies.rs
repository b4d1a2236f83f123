//! Copies of triangles that are a little off: all three corners lie near those of another triangle, which faces the same way.
//!
//! Only a triangle that continues nothing goes: all three edges are its own, so nothing opens. What it lies on may be of the regular surface. Of two
//! that both continue nothing the first stays; they must lie nearer to each other, since a soup may have layers.
//!
//! A copy of which only some corners are off hangs on what it lies on, or on other copies, and continues nothing at one of its edges at least. Such
//! ones go where the surface is no farther from closed without them, those that hang together at once.

use crate::contract::report::RepairName;
use crate::contract::settings::Profile;
use crate::geometry::boxes::BoxTree;
use crate::geometry::distance::distance;
use crate::geometry::places::{Places, Stretch};
use crate::geometry::sums::Bounds;
use crate::repairs::cleanup::duplicates;
use crate::repairs::shared::context::{Changes, Done, Repair};
use crate::repairs::shared::work::Work;
use crate::submesh::edges::Edges;
use crate::submesh::near::{Tolerance, around};
use crate::submesh::{Submesh, Vertex};
use crate::topology::survey::Survey;

type Corners = [[f32; 3]; 3];

/// Copies that are a little off.
pub(crate) const REPAIR: Repair = Repair {
    name: RepairName::Duplicate,
    changes: Changes::Surface,
    run: |cx| {
        let dropped = drop_copies(cx.survey, &mut cx.work, cx.tolerance, cx.profile);
        Ok(Done::count(dropped, "triangles on the vertices of another one, or next to them"))
    },
};

/// Of the reach, where both continue nothing.
const UNSURE: f64 = 0.3;

/// A vertex of more triangles is not looked at for what lies on what.
const MOST_AROUND: usize = 64;

/// A triangle that continues nothing.
struct Lone {
    triangle: u32,
    corners: Corners,
    reach: f64,
}

impl Lone {
    /// Do its corners lie within a share of its reach of these, in the same direction?
    fn lies_on(&self, other: &Corners, share: f64) -> bool {
        (0..3).any(|turned| (0..3).all(|k| distance(self.corners[(k + turned) % 3], other[k]) <= share * self.reach))
    }
}

/// Drops copies; returns how many. O(n log n) in the triangles that continue nothing, and a pass over the surface if there are any.
pub(crate) fn drop_copies(survey: &Survey<'_>, work: &mut Work<'_>, tolerance: &Tolerance, profile: &Profile) -> u64 {
    let widest = tolerance.weld.max(profile.sew_relative * survey.bounds.diagonal());
    let (submesh, edges) = work.edges();
    if tolerance.weld <= 0.0 || !edges.iter().any(|e| e.is_boundary()) {
        return 0;
    }
    let widest = Tolerance { weld: widest, edge_share: tolerance.edge_share };
    let hanging = duplicates::spare(submesh, edges, &hanging(submesh, edges, &widest));
    hanging.iter().for_each(|t| work.kill(*t));
    // What hung on these may hang on nothing now.
    let (submesh, edges) = work.edges();
    let lone = lone(submesh, edges, &widest);
    if lone.is_empty() {
        return hanging.len() as u64;
    }
    let mut is_copy = on_regular(survey, &lone);
    let tree = BoxTree::new(&lone.iter().map(|l| around(&l.corners[..1], 0.0)).collect::<Vec<_>>());
    on_submesh(submesh, &lone, &tree, &mut is_copy);
    on_each_other(&lone, &tree, &mut is_copy);
    let doomed: Vec<u32> = lone.iter().zip(&is_copy).filter(|(_, is_copy)| **is_copy).map(|(l, _)| l.triangle).collect();
    doomed.iter().for_each(|t| work.kill(*t));
    (hanging.len() + doomed.len()) as u64
}

/// Triangles that continue nothing, by number.
fn lone(submesh: &Submesh, edges: &Edges, tolerance: &Tolerance) -> Vec<Lone> {
    let is_open = |a: Vertex, b: Vertex| edges.between(a, b).is_some_and(|e| e.is_boundary());
    let is_lone = |t: &u32| {
        let [a, b, c] = submesh.triangles[*t as usize].v;
        is_open(a, b) && is_open(b, c) && is_open(c, a)
    };
    let of = |t: u32| {
        let corners = submesh.points(t);
        Lone { triangle: t, corners, reach: reach(&corners, tolerance) }
    };
    submesh.living().filter(is_lone).map(of).collect()
}

fn reach(&[a, b, c]: &Corners, tolerance: &Tolerance) -> f64 {
    let shortest = distance(a, b).min(distance(b, c)).min(distance(c, a));
    tolerance.weld.min(tolerance.edge_share * shortest)
}

/// Triangles that lie on another one with which they have a corner in common, and continue nothing at one of their edges, by number. Of two such
/// ones the later.
fn hanging(submesh: &Submesh, edges: &Edges, tolerance: &Tolerance) -> Vec<u32> {
    let hangs = |t: u32| {
        let [a, b, c] = submesh.triangles[t as usize].v;
        [[a, b], [b, c], [c, a]].iter().any(|[a, b]| edges.between(*a, *b).is_some_and(|edge| edge.is_boundary()))
    };
    let lies_on_another = |t: &u32| {
        let corners = submesh.points(*t);
        let own = Lone { triangle: *t, corners, reach: reach(&corners, tolerance) };
        let is_under = |o: u32| o != *t && own.lies_on(&submesh.points(o), 1.0) && (o < *t || !hangs(o));
        let stars = submesh.triangles[*t as usize].v.into_iter().filter(|v| submesh.star(*v).nth(MOST_AROUND).is_none());
        stars.into_iter().any(|v| submesh.star(v).any(|(o, _)| is_under(o)))
    };
    submesh.living().filter(|t| hangs(*t) && lies_on_another(t)).collect()
}

/// The patches that lie on a triangle of the regular surface.
fn on_regular(survey: &Survey<'_>, lone: &[Lone]) -> Vec<bool> {
    let boxes: Vec<Bounds> = lone.iter().map(|l| around(&l.corners, l.reach)).collect();
    let places = Places::of(&boxes);
    let lying_on = |stretch: &Stretch, corners: &Corners, visit: &mut dyn FnMut(u32)| {
        places.each_meeting(stretch, &Bounds::of(corners), |l| {
            if lone[l as usize].lies_on(corners, 1.0) {
                visit(l);
            }
        });
    };
    let found = survey.visit_regular_near(
        |_| true,
        |reach| places.within(reach).map(|stretch| (stretch, Vec::new())),
        |(stretch, _), bounds| places.enter(stretch, bounds),
        |(stretch, _), corners| {
            let mut is_under = false;
            lying_on(stretch, corners, &mut |_| is_under = true);
            is_under
        },
        |(stretch, found): &mut (Stretch, Vec<u32>), triangle, _| {
            lying_on(stretch, &crate::io::record::corners(&survey.records[triangle as usize]), &mut |l| found.push(l));
        },
    );
    let mut is_copy = vec![false; lone.len()];
    found.into_iter().flat_map(|(_, found)| found).for_each(|l| is_copy[l as usize] = true);
    is_copy
}

/// Marks those that lie on a triangle of the submesh that continues something. `tree`: of their first corners.
fn on_submesh(submesh: &Submesh, lone: &[Lone], tree: &BoxTree, is_copy: &mut [bool]) {
    let most = lone.iter().map(|l| l.reach).fold(0.0, f64::max);
    let mut found = Vec::new();
    for t in submesh.living().filter(|t| lone.binary_search_by_key(t, |l| l.triangle).is_err()) {
        let corners = submesh.points(t);
        for corner in corners {
            tree.meeting(&around(&[corner], most), &mut found);
            found.iter().filter(|l| lone[**l as usize].lies_on(&corners, 1.0)).for_each(|l| is_copy[*l as usize] = true);
        }
    }
}

/// Marks the later ones of those that lie on each other.
fn on_each_other(lone: &[Lone], tree: &BoxTree, is_copy: &mut [bool]) {
    let mut found = Vec::new();
    for (i, first) in lone.iter().enumerate() {
        if is_copy[i] {
            continue;
        }
        for corner in first.corners {
            tree.meeting(&around(&[corner], UNSURE * first.reach), &mut found);
            for later in found.iter().map(|l| *l as usize).filter(|l| *l > i) {
                is_copy[later] |= first.lies_on(&lone[later].corners, UNSURE);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{after, cube, reversed, shifted};

    fn dropped(mesh: &[Corners]) -> (u64, u64) {
        let got = after(mesh, |d, _| drop_copies(&d.survey, &mut Work::new(&mut d.submesh), &d.tolerance, &Profile::default()));
        (got.result, got.defects.triangles)
    }

    #[test]
    fn a_copy_a_little_off_goes_and_what_is_regular_under_it_stays() {
        let copy = shifted(&cube()[3..4], [1e-3; 3]);
        assert_eq!(dropped(&[cube(), copy].concat()), (1, 12));
    }

    #[test]
    fn the_first_of_two_that_continue_nothing_stays() {
        let soup: Vec<Corners> =
            cube().iter().zip(0u8..).flat_map(|(t, i)| shifted(&[*t], [f32::from(i) * 1e-4, 0.0, 0.0])).collect();
        let copies = shifted(&soup, [0.0, 1e-4, 0.0]);
        assert_eq!(dropped(&[soup, copies].concat()), (12, 12));
    }

    /// Copies of both halves of a side of a cube, each with a corner of its own, have the edge between them in common: neither could go alone.
    #[test]
    fn copies_that_hang_together_go_together() {
        let mut copies = cube()[2..4].to_vec();
        let common: Vec<[f32; 3]> = copies[0].iter().filter(|p| copies[1].contains(p)).copied().collect();
        assert_eq!(common.len(), 2);
        copies.iter_mut().flatten().filter(|p| !common.contains(p)).for_each(|p| p[0] += 1e-3);
        assert_eq!(dropped(&[cube(), copies.clone()].concat()), (2, 12));
        assert_eq!(dropped(&[cube(), copies[..1].to_vec()].concat()), (1, 12));
        // A fin stays.
        copies.iter_mut().flatten().filter(|p| !common.contains(p)).for_each(|p| p[0] += 0.3);
        assert_eq!(dropped(&[cube(), copies].concat()), (0, 14));
    }

    #[test]
    fn what_faces_the_other_way_is_no_copy_nor_is_what_lies_farther_off() {
        let triangle = &cube()[3..4];
        let back = shifted(&reversed(triangle), [1e-3; 3]);
        let far = shifted(triangle, [0.0, 0.0, 0.3]);
        assert_eq!(dropped(&[cube(), back].concat()).0, 0);
        assert_eq!(dropped(&[cube(), far].concat()).0, 0);
    }
}
