//! Small gaps zipped: vertices that face each other across a narrow gap become one.
//!
//! Two boundary vertices face each other when each is the other's nearest within a share of the edges around them, and the surfaces
//! they end point at each other. (The rims of a thin shell lie as near, but point the same way: they are left alone, as are two walls
//! with a clearance between them, which turn their backs to each other.) No vertex moves far, and bodies that can each be closed alone are
//! never zipped together: a gap between these is as likely a clearance. A merge that
//! would turn a triangle over, flatten it, or make an edge of more than two triangles is left out. So is one that leaves a vertex where
//! several fans meet: nothing beside it was merged, and two loops that only meet there would be closed each for itself.

use crate::contract::report::RepairName;
use crate::geometry::distance::{cosine, place};
use crate::repairs::shared::context::{Changes, Done, Repair};
use std::collections::BTreeSet;

use glam::DVec3;

use crate::contract::settings::Profile;
use crate::detect::holes::loops;
use crate::detect::holes::owners::Owners;
use crate::repairs::shared::admission;
use crate::repairs::shared::work::Work;
use crate::repairs::stitch::weld::STEADY;
use crate::submesh::components::Reversed;
use crate::submesh::edges::{Edge, Edges};
use crate::submesh::near::Tolerance;
use crate::submesh::{Submesh, Vertex, near};
use crate::topology::survey::Survey;

/// Narrow gaps.
pub(crate) const REPAIR: Repair = Repair {
    name: RepairName::Zip,
    changes: Changes::Surface,
    run: |cx| {
        let merged = zip(cx.survey, &mut cx.work, cx.tolerance, cx.profile);
        Ok(Done::count(merged, "vertices merged with the one that faces them across a narrow gap"))
    },
};

/// Facing: cosine between the directions in which the two surfaces end, at most.
const FACING: f64 = -0.5;
/// No vertex moves farther than this share of the diagonal.
const FARTHEST: f64 = 0.005;
/// The way between two walls makes at least this cosine with their normals.
const ASIDE: f64 = 0.7;
/// How often merges that made a defect are taken out and the rest tried again; then none is made.
const ATTEMPTS: usize = 8;

/// Zips gaps narrower than the profile's share of the shortest edges at their vertices, but for loops of kinds that the profile leaves open;
/// returns how many vertices were merged into another. O(n log n) in the boundary, and a copy of the submesh if anything is merged.
pub(crate) fn zip(survey: &Survey<'_>, work: &mut Work<'_>, tolerance: &Tolerance, profile: &Profile) -> u64 {
    if profile.gap_edge_share <= 0.0 {
        return 0;
    }
    let (submesh, edges) = work.edges();
    let left_open = left_open(submesh, edges, tolerance, profile);
    let mut pairs = facing(submesh, edges, profile, FARTHEST * survey.bounds.diagonal());
    pairs.retain(|pair| pair.iter().all(|v| left_open.binary_search(v).is_err()));
    if !pairs.is_empty() {
        leave_bodies_apart(survey, submesh, edges, &mut pairs);
    }
    if pairs.is_empty() {
        return 0;
    }
    let before = work.snapshot();
    for _ in 0..ATTEMPTS {
        let merged = merge(work, &pairs);
        let bad: BTreeSet<[Vertex; 2]> =
            merged.iter().filter(|(stay, _, most)| fans(work, *stay) > *most).map(|(_, pair, _)| *pair).collect();
        if bad.is_empty() {
            return merged.len() as u64;
        }
        work.restore(&before);
        pairs.retain(|pair| !bad.contains(pair));
    }
    0
}

/// Merges pairs in their order where that is valid, each into the vertex of more triangles; returns that one, the pair, and how many fans
/// the one of its vertices with most of them had.
fn merge(work: &mut Work<'_>, pairs: &[[Vertex; 2]]) -> Vec<(Vertex, [Vertex; 2], usize)> {
    let mut merged = Vec::new();
    for [v, w] in pairs.iter().copied() {
        let (stay, go) = if work.star(w).count() > work.star(v).count() { (w, v) } else { (v, w) };
        if may_merge(work, stay, go) {
            let most = fans(work, stay).max(fans(work, go));
            work.merge(stay, go);
            merged.push((stay, [v, w], most));
        }
    }
    merged
}

/// Vertices on loops that the profile leaves open, ascending.
pub(crate) fn left_open(submesh: &Submesh, edges: &Edges, tolerance: &Tolerance, profile: &Profile) -> Vec<Vertex> {
    if profile.leave_open.is_empty() {
        return Vec::new();
    }
    let rims = loops::find(submesh, edges);
    let left = admission::left_open(submesh, edges, &rims, tolerance, profile);
    let mut vertices: Vec<Vertex> = left.flat_map(|(rim, _)| rim.vertices.iter().copied()).collect();
    vertices.sort_unstable();
    vertices.dedup();
    vertices
}

/// Drops pairs of which each vertex is on a body of its own. O(regions + submesh).
fn leave_bodies_apart(survey: &Survey<'_>, submesh: &Submesh, edges: &Edges, pairs: &mut Vec<[Vertex; 2]>) {
    let rims = loops::find(submesh, edges);
    let owners = Owners::of(survey, submesh, edges, &Reversed::none(survey), &rims);
    let mut rim_of: Vec<(Vertex, usize)> =
        rims.iter().enumerate().flat_map(|(i, rim)| rim.vertices.iter().map(move |v| (*v, i))).collect();
    rim_of.sort_unstable();
    let rim = |v: Vertex| {
        let at = rim_of.partition_point(|(w, _)| *w < v);
        rim_of.get(at).filter(|(w, _)| *w == v).map(|(_, i)| *i)
    };
    pairs.retain(|[v, w]| !rim(*v).zip(rim(*w)).is_some_and(|(a, b)| owners.stand(a, b)));
}

/// Pairs of boundary vertices that face each other, the nearest first; none farther apart than `widest`, unless the profile says how far.
fn facing(submesh: &Submesh, edges: &Edges, profile: &Profile, widest: f64) -> Vec<[Vertex; 2]> {
    let widest = if profile.max_gap_mm > 0.0 { profile.max_gap_mm } else { widest };
    let vertices = near::boundary_vertices(edges);
    let outward = ends(submesh, edges);
    let reach: Vec<f64> = vertices.iter().map(|v| (submesh.shortest_edge(*v) * profile.gap_edge_share).min(widest)).collect();
    let nearest = near::nearest_apart(submesh, &vertices, &reach);
    let mut pairs: Vec<(f64, [Vertex; 2])> = Vec::new();
    for (i, found) in nearest.iter().enumerate() {
        // Mutual, and each pair once.
        if let Some(j) = found.filter(|j| *j > i && nearest[*j] == Some(i)) {
            let (v, w) = (vertices[i], vertices[j]);
            if cosine(outward[v as usize], outward[w as usize]) < FACING && !are_back_to_back(submesh, v, w) {
                pairs.push((submesh.distance(v, w), [v, w]));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    pairs.into_iter().map(|(_, pair)| pair).collect()
}

/// Do the surfaces at two vertices face opposite ways, one behind the other?
fn are_back_to_back(submesh: &Submesh, v: Vertex, w: Vertex) -> bool {
    let normal = |v: Vertex| submesh.star(v).map(|(t, _)| submesh.normal(t)).sum::<DVec3>();
    let (of_v, of_w, way) = (normal(v), normal(w), submesh.vector(v, w));
    cosine(of_v, of_w) < 0.0 && [of_v, of_w].iter().any(|normal| cosine(*normal, way).abs() > ASIDE)
}

/// Fans around a vertex: sets of triangles that hang together by edges at it.
fn fans(submesh: &Submesh, v: Vertex) -> usize {
    let star: Vec<u32> = submesh.star(v).map(|(t, _)| t).collect();
    let mut spokes: Vec<(Vertex, u32)> = (0..star.len() as u32)
        .flat_map(|i| submesh.triangles[star[i as usize] as usize].v.into_iter().filter(|w| *w != v).map(move |w| (w, i)))
        .collect();
    spokes.sort_unstable();
    let mut parents: Vec<u32> = (0..star.len() as u32).collect();
    for pair in spokes.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        crate::util::union_find::unite(&mut parents, pair[0].1, pair[1].1);
    }
    (0..star.len() as u32).filter(|i| crate::util::union_find::find(&mut parents, *i) == *i).count()
}

/// For each boundary vertex the direction in which its surface ends: away from the triangles, across their boundary edges.
fn ends(submesh: &Submesh, edges: &Edges) -> Vec<DVec3> {
    let mut all = vec![DVec3::ZERO; submesh.positions.len()];
    for edge in edges.iter().filter(Edge::is_boundary) {
        let t = edge.uses[0].triangle();
        let Some(apex) = submesh.triangles[t as usize].v.into_iter().find(|v| *v != edge.low && *v != edge.high) else {
            continue;
        };
        let along = submesh.vector(edge.low, edge.high);
        let from_apex = submesh.vector(apex, edge.low);
        let part = from_apex.dot(along) / along.dot(along).max(f64::MIN_POSITIVE);
        for v in [edge.low, edge.high] {
            all[v as usize] += from_apex - part * along;
        }
    }
    all
}

/// Would the mesh stay as valid as it is?
fn may_merge(submesh: &Submesh, stay: Vertex, go: Vertex) -> bool {
    let corners = |t: u32| submesh.triangles[t as usize].v;
    if submesh.has_edge(go, stay) {
        return false;
    }
    let mut neighbours: Vec<Vertex> = submesh.star(go).flat_map(|(t, _)| corners(t)).filter(|x| *x != go).collect();
    neighbours.sort_unstable();
    neighbours.dedup();
    let uses = |v: Vertex, x: Vertex| submesh.at_edge(v, x).count();
    // An edge that both have becomes one.
    let manifold = neighbours.iter().all(|x| {
        let shared = uses(stay, *x);
        shared == 0 || shared + uses(go, *x) <= 2
    });
    manifold
        && submesh.star(go).all(|(t, k)| {
            let before = submesh.points(t);
            let mut after = before;
            after[k] = submesh.positions[stay as usize];
            cosine(normal(before), normal(after)) >= STEADY
        })
}

fn normal(corners: [[f32; 3]; 3]) -> DVec3 {
    let [a, b, c] = corners.map(place);
    (b - a).cross(c - a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contract::report::LoopClass;
    use crate::testing::{Corners, after, plate, reversed, shifted};

    /// A plate cut along its middle line, where the right side stands this far off at three vertices.
    fn slit(gap: f32) -> Vec<Corners> {
        let open = |p: [f32; 3]| if p[0] == 12.0 && (1.0..=3.0).contains(&p[1]) { [12.0 + gap, p[1], p[2]] } else { p };
        let right = plate(24, |x, _| x >= 12).into_iter().map(|t| t.map(open));
        plate(24, |x, _| x < 12).into_iter().chain(right).collect()
    }

    #[test]
    fn rims_that_face_each_other_across_a_narrow_gap_are_joined() {
        let zipped = |gap: f32, share: f64| {
            let profile = Profile { gap_edge_share: share, ..Profile::default() };
            after(&slit(gap), |d, _| zip(&d.survey, &mut Work::new(&mut d.submesh), &d.tolerance, &profile))
        };
        let got = zipped(0.125, 0.35);
        // Only the rim of the plate is left.
        assert_eq!((got.result, got.defects.boundary_loops, got.defects.boundary_edges), (3, 1, 96));
        assert_eq!(got.defects.nonmanifold_edges + got.defects.inconsistent_edges, 0);
        assert_eq!(zipped(0.5, 0.35).result, 0, "too wide for its edges");
        assert_eq!(zipped(0.25, 0.35).result, 0, "too wide for the model, whose diagonal is 34");
        assert_eq!(zipped(0.125, 0.0).result, 0, "switched off");
    }

    #[test]
    fn two_walls_with_a_clearance_between_them_are_left_alone() {
        // Each lacks the same cells, so that vertices face each other across both the holes and the clearance, which is narrower.
        let hole = |x: u8, y: u8| (8..16).contains(&x) && (8..16).contains(&y);
        let lower = plate(24, |x, y| !hole(x, y));
        let upper = shifted(&reversed(&plate(24, |x, y| !hole(x, y))), [8.0, 0.0, 0.125]);
        let got = after(&[lower, upper].concat(), |d, _| {
            zip(&d.survey, &mut Work::new(&mut d.submesh), &d.tolerance, &Profile::default())
        });
        assert_eq!(got.result, 0);
    }

    #[test]
    fn two_boxes_without_the_sides_that_face_each_other_are_not_zipped() {
        let got = after(&[open_box(0.0, false), open_box(10.02, true)].concat(), |d, _| {
            zip(&d.survey, &mut Work::new(&mut d.submesh), &d.tolerance, &Profile::default())
        });
        assert_eq!((got.result, got.defects.boundary_loops), (0, 2));
    }

    /// A cube of ten, from this height up, without its top or without its bottom.
    fn open_box(z: f32, top: bool) -> Vec<Corners> {
        let corner = |i: u8| [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]][usize::from(i % 4)];
        let at = |i: u8, up: bool| [corner(i)[0], corner(i)[1], if up { z + 10.0 } else { z }];
        let sides = (0..4)
            .flat_map(|i| [[at(i, false), at(i + 1, false), at(i + 1, true)], [at(i, false), at(i + 1, true), at(i, true)]]);
        let lid = if top {
            [[at(0, true), at(1, true), at(2, true)], [at(0, true), at(2, true), at(3, true)]]
        } else {
            [[at(0, false), at(2, false), at(1, false)], [at(0, false), at(3, false), at(2, false)]]
        };
        sides.chain(lid).collect()
    }

    #[test]
    fn the_rims_of_a_thin_shell_are_left_alone() {
        // As near as above, but both surfaces end in the same direction.
        let bottom = reversed(&plate(2, |_, _| true));
        let top = shifted(&plate(2, |_, _| true), [0.0, 0.0, 0.125]);
        let got = after(&[bottom, top].concat(), |d, _| {
            zip(&d.survey, &mut Work::new(&mut d.submesh), &d.tolerance, &Profile::default())
        });
        assert_eq!(got.result, 0);
    }

    #[test]
    fn loops_of_a_kind_that_the_profile_leaves_open_are_not_zipped() {
        // The right side of a slit of nine vertices stands off evenly, or is jagged.
        let open = |jag: f32| -> Vec<Corners> {
            let off = |p: [f32; 3]| match p {
                [12.0, y, z] if (2.0..=10.0).contains(&y) => [12.04, y, z + if (y as u8).is_multiple_of(2) { jag } else { -jag }],
                _ => p,
            };
            let right = plate(24, |x, y| x >= 12 && y < 12).into_iter().map(|t| t.map(off));
            plate(24, |x, y| x < 12 && y < 12).into_iter().chain(right).collect()
        };
        let zipped = |jag: f32, leave_open: &[LoopClass]| {
            let profile = Profile { leave_open: leave_open.to_vec(), ..Profile::default() };
            after(&open(jag), |d, _| zip(&d.survey, &mut Work::new(&mut d.submesh), &d.tolerance, &profile)).result
        };
        for (jag, class, other) in [(0.0, LoopClass::Gap, LoopClass::Misaligned), (0.12, LoopClass::Misaligned, LoopClass::Gap)] {
            assert_eq!(zipped(jag, &[class]), 0, "{class:?}");
            assert_eq!(zipped(jag, &[other]), zipped(jag, &[]), "{class:?}");
            assert!(zipped(jag, &[]) > 0, "{class:?}");
        }
    }

    #[test]
    fn plates_that_come_near_at_a_single_vertex_are_not_merged_there() {
        let left = plate(2, |_, _| true);
        // Its corner at the upper middle of the left plate's side, from which it leads away.
        let right = shifted(&plate(2, |_, _| true), [2.125, 0.0, 0.0]).into_iter();
        let right = right.map(|t| t.map(|[x, y, z]| if y == 1.0 { [x, y, z] } else { [x + 1.0, y, z] }));
        let open: Vec<Corners> = left.into_iter().chain(right).collect();
        let got = after(&open, |d, _| {
            let (submesh, edges) = (&d.submesh, Edges::of(&d.submesh));
            assert_eq!(facing(submesh, &edges, &Profile::default(), 1.0).len(), 1);
            zip(&d.survey, &mut Work::new(&mut d.submesh), &d.tolerance, &Profile::default())
        });
        assert_eq!((got.result, got.defects.nonmanifold_vertices, got.defects.boundary_loops), (0, 0, 2));
    }
}
