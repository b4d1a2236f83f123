use super::*;

/// Closes a loop; each edge with a place in the surface beyond it.
fn closed(rim: &[(Point, Point)], may_add: bool) -> Option<Extended> {
    let points: Vec<Point> = rim.iter().map(|(p, _)| *p).collect();
    let apexes: Vec<Option<Point>> = rim.iter().map(|(_, apex)| Some(*apex)).collect();
    extend(&Rim { points: &points, apexes: &apexes, obstacles: &[], forbidden: &|_, _| false }, may_add)
}

/// A box of 2 by 3 by 4 without the faces at x = 2 and y = 3. The vertical edge between these is still to be found.
fn two_faces_lost() -> Vec<(Point, Point)> {
    vec![
        ([2.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
        ([2.0, 3.0, 0.0], [0.0, 0.0, 0.0]),
        ([0.0, 3.0, 0.0], [0.0, 0.0, 0.0]),
        ([0.0, 3.0, 4.0], [0.0, 0.0, 4.0]),
        ([2.0, 3.0, 4.0], [0.0, 0.0, 4.0]),
        ([2.0, 0.0, 4.0], [0.0, 0.0, 4.0]),
    ]
}

/// A cube's corner at the origin, of which a triangle is missing in each of three faces; the cube lies where coordinates are positive.
fn corner_lost() -> Vec<(Point, Point)> {
    vec![
        ([1.0, 0.0, 0.0], [3.0, 0.0, 3.0]),
        ([1.0, 0.0, 1.0], [3.0, 0.0, 3.0]),
        ([0.0, 0.0, 1.0], [0.0, 3.0, 3.0]),
        ([0.0, 1.0, 1.0], [0.0, 3.0, 3.0]),
        ([0.0, 1.0, 0.0], [3.0, 3.0, 0.0]),
        ([1.0, 1.0, 0.0], [3.0, 3.0, 0.0]),
    ]
}

#[test]
fn two_faces_of_a_box_meet_in_its_edge() {
    for may_add in [false, true] {
        let made = closed(&two_faces_lost(), may_add).unwrap();
        assert!(made.added.is_empty() && !made.assumed);
        assert_eq!(made.triangles.len(), 4);
        let has_edge = |t: &[u32; 3]| t.contains(&1) && t.contains(&4);
        assert_eq!(made.triangles.iter().filter(|t| has_edge(t)).count(), 2, "{:?}", made.triangles);
    }
}

#[test]
fn three_faces_of_a_cube_meet_in_its_corner() {
    let made = closed(&corner_lost(), true).unwrap();
    assert_eq!(made.added, [[0.0; 3]]);
    assert_eq!(made.triangles.len(), 6);
    assert!(closed(&corner_lost(), false).is_none(), "there is no vertex for it");
}

#[test]
fn a_loop_on_bent_surface_tells_no_planes() {
    // Around the top of a ball, up and down.
    let rim: Vec<(Point, Point)> = (0..8)
        .map(|i| {
            let turn = std::f32::consts::TAU * i as f32 / 8.0;
            let [r, z] = if i % 2 == 0 { [0.6, 0.8] } else { [0.8, 0.6] };
            ([r * turn.cos(), r * turn.sin(), z], [turn.cos(), turn.sin(), 0.0])
        })
        .rev()
        .collect();
    assert!(closed(&rim, true).is_none());
}

#[test]
fn a_flat_loop_is_no_matter_of_several_planes() {
    let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let rim: Vec<(Point, Point)> = square.iter().map(|[x, y]| ([*x, *y, 0.0], [3.0 * x - 1.0, 3.0 * y - 1.0, 0.0])).collect();
    assert!(closed(&rim, true).is_none());
    let points: Vec<Point> = rim.iter().map(|(p, _)| *p).collect();
    assert!(lie_in_a_plane(&points));
    let corners: Vec<Point> = corner_lost().iter().map(|(p, _)| *p).collect();
    assert!(!lie_in_a_plane(&corners));
}

#[test]
fn a_shallow_arc_is_no_face() {
    // A square hole in a cylinder's wall, which bulges by a hundredth.
    let arc = |x: f32| 0.01 - 0.01 * (x - 1.0) * (x - 1.0);
    let mut rim: Vec<(Point, Point)> = Vec::new();
    let steps: Vec<f32> = (0..8).map(|i| i as f32 / 4.0).collect();
    rim.extend(steps.iter().map(|x| ([*x, 0.0, arc(*x)], [*x, -1.0, arc(*x)])));
    rim.extend(steps.iter().map(|y| ([2.0, *y, 0.0], [3.0, *y, arc(3.0)])));
    rim.extend(steps.iter().map(|x| ([2.0 - x, 2.0, arc(*x)], [2.0 - x, 3.0, arc(*x)])));
    rim.extend(steps.iter().map(|y| ([0.0, 2.0 - y, 0.0], [-1.0, 2.0 - y, arc(-1.0)])));
    assert!(closed(&rim, true).is_none());
}

/// A box's corner that was lost along triangles: five places of the loop lie in a plane, by the way the box was cut up.
fn corner_lost_along_triangles() -> Vec<(Point, Point)> {
    vec![
        ([4.0, 4.0, 0.0], [4.0, 4.0, 3.0]),
        ([4.0, 2.0, 3.0], [4.0, 0.0, 6.0]),
        ([4.0, 0.0, 3.0], [2.0, 0.0, 6.0]),
        ([2.0, 0.0, 3.0], [0.0, 0.0, 3.0]),
        ([0.0, 0.0, 0.0], [0.0, 4.0, 0.0]),
        ([2.0, 2.0, 0.0], [0.0, 4.0, 0.0]),
    ]
}

#[test]
fn a_corner_that_surface_tells_is_not_cut_off() {
    let made = closed(&corner_lost_along_triangles(), true).unwrap();
    assert_eq!(made.added, [[4.0, 0.0, 0.0]], "{made:?}");
    assert!(made.told && made.in_doubt == 0.0, "{made:?}");
}

/// The end of a beam: of its outline, the loop has one side and a part of the next one.
#[test]
fn a_face_of_which_the_loop_has_hardly_more_than_an_edge_is_assumed() {
    for (part, is_known) in [(1.0, false), (5.0, true)] {
        let places = [[0.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 2.0, part], [-9.0, 1.0, 1.0], [0.0, 2.0, 6.0], [0.0, 0.0, 6.0]];
        let beyond = [Some(-DVec3::Z), Some(DVec3::Y), None, None];
        let found = witness(&[0, 1, 2, 4, 5], DVec3::X, &beyond, 1e-5, &places);
        assert_eq!(matches!(found, Witness::Corners), is_known, "{part}");
        assert_eq!(matches!(found, Witness::Assumed), !is_known, "{part}");
    }
}
