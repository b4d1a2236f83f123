//! Each operation does its work, and nothing else.

use super::*;
use crate::contract::progress::Quiet;
use crate::contract::report::{FaceOrigin, LoopClass, RepairName, RuleOutcome};
use crate::engine::mesh::Mesh;
use crate::testing::{Corners, cube, cuboid, reversed, shifted};

fn mesh(triangles: &[Corners]) -> Mesh {
    Mesh::from_triangles(triangles).unwrap()
}

fn limits() -> Limits {
    Limits { threads: 1, ..Limits::default() }
}

/// A box without its bottom and its top, and turned inside out: two holes, and one thing else that is wrong.
fn tube() -> Vec<Corners> {
    reversed(&cuboid([0.0; 3], [4.0, 4.0, 8.0])[4..])
}

#[test]
fn defects_are_counted() {
    let defects = find_defects(&mesh(&[cube(), tube()].concat()), &limits(), &Quiet).unwrap();
    assert_eq!((defects.boundary_edges, defects.boundary_loops, defects.components), (8, 2, 2));
    assert_eq!(defects.self_intersections, None, "not looked for");
}

/// Vertices of a loop are the caller's, the first ones where there are several.
#[test]
fn loops_are_found_with_their_vertices() {
    let (vertices, faces) = mesh(&tube()).into_parts();
    let twice = Mesh::new([&vertices[..], &vertices[..]].concat(), faces).unwrap();
    let found = find_loops(&twice, &limits(), &Quiet).unwrap();
    assert_eq!(found.len(), 2);
    let mut heights = Vec::new();
    for FoundLoop { vertices: way, facts } in &found {
        assert_eq!((way.len(), facts.vertices, facts.perimeter), (4, 4, 16.0));
        let height = vertices[way[0] as usize][2];
        assert!(way.iter().all(|v| (*v as usize) < vertices.len() && vertices[*v as usize][2] == height), "{way:?}");
        assert_eq!(facts.at, vertices[way[0] as usize]);
        heights.push(height);
    }
    heights.sort_by(f32::total_cmp);
    assert_eq!(heights, [0.0, 8.0]);
    assert!(found.iter().all(|found| found.facts.class != LoopClass::Crack));
    assert!(find_loops(&mesh(&cube()), &limits(), &Quiet).unwrap().is_empty());
}

#[test]
fn one_hole_is_filled_and_nothing_else_is_done() {
    let open = mesh(&tube());
    let top = Fill::default().only_loop(Some([0.0, 0.0, 8.0])).shape(PatchShape::Flat);
    let filled = fill(&open, &top, &limits(), &Quiet).unwrap();
    let added: Vec<Corners> = filled.mesh.view().triangles().skip(8).collect();
    assert_eq!(filled.origins[8..], [FaceOrigin::Repair(RepairName::Fill); 2]);
    assert!(added.as_flattened().iter().all(|p| p[2] == 8.0), "{added:?}");
    assert_eq!(filled.origins[..8], (0..8).map(FaceOrigin::Input).collect::<Vec<_>>()[..], "inside out as it was");
    assert_eq!(filled.report.loops_left.len(), 1);
    assert_eq!(filled.report.loops_left[0].reason, "only another loop was to be closed");

    let all = fill(&open, &Fill::default(), &limits(), &Quiet).unwrap();
    assert_eq!((all.mesh.faces().len(), all.report.after.unwrap().boundary_edges), (12, 0));
    let few = fill(&open, &Fill::default().max_edges(3), &limits(), &Quiet).unwrap();
    assert_eq!(few.mesh, open);
}

#[test]
fn a_place_that_no_loop_goes_through_fills_nothing() {
    for place in [[2.0, 2.0, 8.0], [f32::NAN; 3], [f32::INFINITY; 3]] {
        let filled = fill(&mesh(&tube()), &Fill::default().only_loop(Some(place)), &limits(), &Quiet).unwrap();
        assert_eq!(filled.mesh.faces().len(), 8);
    }
}

#[test]
fn a_lone_sheet_stays_open() {
    let sheet = mesh(&cube()[..2]);
    let closed = |how: &Fill| fill(&sheet, how, &limits(), &Quiet).unwrap().report.edit.added;
    assert_eq!(closed(&Fill::default()), 0);
    assert!(find_loops(&sheet, &limits(), &Quiet).unwrap().len() == 1);
}

#[test]
fn faces_are_turned_and_nothing_else_is_done() {
    let mut one_turned = cube();
    one_turned[5] = reversed(&one_turned[5..6])[0];
    let soup = [one_turned, reversed(&shifted(&cube(), [5.0; 3])), shifted(&cube()[..11], [0.0, 9.0, 0.0])].concat();
    for how in [Orient::default(), Orient::default().by_visibility(false)] {
        let oriented = orient(&mesh(&soup), &how, &limits(), &Quiet).unwrap();
        let flipped: Vec<u32> = oriented
            .origins
            .iter()
            .filter_map(|origin| match origin {
                FaceOrigin::Flipped(face) => Some(*face),
                FaceOrigin::Input(_) => None,
                other => panic!("{other:?}"),
            })
            .collect();
        assert_eq!(flipped, [&[5][..], &(12..24).collect::<Vec<_>>()].concat());
        assert_eq!(oriented.report.after.unwrap().boundary_edges, 3, "the hole stays");
    }
}

#[test]
fn bodies_that_cross_become_one() {
    let crossing = [cube(), shifted(&cube(), [0.5; 3]), cuboid([0.1; 3], [0.2; 3])].concat();
    let found = find_self_intersections(&mesh(&crossing), &limits(), &Quiet).unwrap();
    let pairs = found.pairs.unwrap();
    assert_eq!(pairs.len() as u64, found.counts.crossing_pairs + found.counts.overlapping_pairs);
    assert!(!pairs.is_empty() && pairs.iter().all(|p| p.faces[0] < 12 && (12..24).contains(&p.faces[1]) && !p.overlap));
    assert!(pairs.is_sorted_by_key(|p| p.faces));

    let united = union(&mesh(&crossing), &Union::default(), &limits(), &Quiet).unwrap();
    let after = united.report.after.unwrap();
    assert_eq!((after.components, after.self_intersections.unwrap().triangles), (1, 0));
    assert!((after.volume - (2.0 - 0.125)).abs() < 1e-6, "{}", after.volume);
    assert!(united.origins.iter().all(|o| o.input_face().is_some_and(|face| face < 24)), "what was enclosed is gone");
}

#[test]
fn only_what_is_seen_stays_if_that_is_asked_for() {
    let hollow = [cuboid([0.0; 3], [9.0; 3]), reversed(&cuboid([1.0; 3], [8.0; 3])), cuboid([3.0; 3], [4.0; 3])].concat();
    let faces = |how: &Union| union(&mesh(&hollow), how, &limits(), &Quiet).unwrap().mesh.faces().len();
    assert_eq!(faces(&Union::default()), 36);
    assert_eq!(faces(&Union::default().visible_only(true)), 12);
}

/// A box that lacks a side, which no other operation touches.
#[test]
fn what_is_no_solid_is_wrapped() {
    let mut open = cuboid([0.0; 3], [8.0; 3]);
    open.drain(2..4);
    let wrapped = wrap(&mesh(&open), &Wrap::default(), &limits(), &Quiet).unwrap();
    assert!(wrapped.report.verdict.good, "{:?}", wrapped.report.verdict);
    assert!(wrapped.origins.iter().all(|o| *o == FaceOrigin::Repair(RepairName::Wrap)) && !wrapped.origins.is_empty());
    let nothing = wrap(&mesh(&open), &Wrap::default().max_share(0.0), &limits(), &Quiet).unwrap();
    assert_eq!(nothing.mesh, mesh(&open));
    assert!(wrap(&mesh(&open), &Wrap::default().max_share(f64::NAN), &limits(), &Quiet).is_err());
}

#[test]
fn a_certificate_lists_every_rule() {
    let of = |triangles: &[Corners]| certificate(&mesh(triangles), &limits(), &Quiet).unwrap();
    let (good, bad) = (of(&cube()), of(&tube()));
    assert_eq!((good.printable, good.rules.len(), good.triangles), (true, crate::RULES.len(), 12));
    assert!(!bad.printable && bad.rules.iter().any(|rule| rule.outcome == RuleOutcome::Failed));
}
