use super::*;
use crate::submesh::components::Through;
use crate::testing::{Corners, cuboid, diagnose, records, reversed};

fn around(triangles: &[Corners]) -> Vec<Vec<(u32, i32)>> {
    let records = records(triangles);
    let d = diagnose(&records);
    let none = Reversed::none(&d.survey);
    let components =
        Components::of(&d.survey, &d.submesh, &crate::submesh::edges::Edges::of(&d.submesh), &none, Through::EveryEdge);
    surroundings(&d.survey, &d.submesh, &components, &none, |_| true).into_iter().map(|s| s.around).collect()
}

fn nested(size: u8) -> Vec<Corners> {
    cuboid([-f32::from(size); 3], [f32::from(size); 3])
}

#[test]
fn each_cube_winds_once_around_those_inside_it() {
    // Components are numbered by their first triangle: 0 is the largest.
    let got = around(&[nested(4), nested(2), nested(1)].concat());
    assert_eq!(got, [vec![], vec![(0, 1)], vec![(0, 1), (1, 1)]]);
    // A cavity winds the other way, so what floats in it is in nothing.
    let got = around(&[nested(4), reversed(&nested(2)), nested(1)].concat());
    assert_eq!(got, [vec![], vec![(0, 1)], vec![(0, 1), (1, -1)]]);
}

#[test]
fn a_box_inside_a_box_is_not_yet_a_body_inside_a_body() {
    // The small cube lies in the corner that the octahedron leaves free in its box.
    let got = around(&[octahedron(), cuboid([0.7; 3], [0.8; 3])].concat());
    assert_eq!(got, [vec![], vec![]]);
}

/// The unit octahedron: vertices on the axes, so that rays on the grid hit vertices and edges.
fn octahedron() -> Vec<Corners> {
    let signs = (0..8u8).map(|n| [0, 1, 2].map(|k| if n >> k & 1 == 1 { -1.0f32 } else { 1.0 }));
    let face = |[x, y, z]: [f32; 3]| {
        let [a, b, c] = [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]];
        if x * y * z > 0.0 { [a, b, c] } else { [a, c, b] }
    };
    signs.map(face).collect()
}

#[test]
fn each_direction_meets_what_lies_there_and_nothing_else() {
    // Cubes of side 2 around the middle: one in each direction along the axes, each at another distance.
    let middle = cuboid([-1.0; 3], [1.0; 3]);
    for axis in 0..3 {
        for backward in [false, true] {
            let mut by = [0.0; 3];
            by[axis] = if backward { -4.0 } else { 5.0 };
            let mesh = [middle.clone(), crate::testing::shifted(&middle, by)].concat();
            let records = records(&mesh);
            let d = diagnose(&records);
            let edges = crate::submesh::edges::Edges::of(&d.submesh);
            let none = Reversed::none(&d.survey);
            let components = Components::of(&d.survey, &d.submesh, &edges, &none, Through::EveryEdge);
            for (other, turned) in (0..3).flat_map(|k| [(k, false), (k, true)]) {
                let direction = Direction { axis: other, backward: turned };
                // On grid lines, where rays run through diagonals of faces.
                let asked = |component| [(direction, vec![Source { from: [0.0; 3], component }])];
                let met = |component| obstructed(&d.survey, &d.submesh, &components, &asked(component), |_| true).concat();
                assert_eq!(met(0), [(other, turned) == (axis, backward)], "{direction:?}, towards {by:?}");
                assert_eq!(met(1), [true], "out of the cube that is not the ray's own");
            }
        }
    }
}

#[test]
fn a_ray_through_a_vertex_or_an_edge_counts_once() {
    let crossings = |triangles: &[Corners], p| triangles.iter().map(|t| crossing(t, p)).sum::<i32>();
    for (p, where_to) in [([0.0, 0.0, 0.0], "the top vertex"), ([0.25, 0.0, 0.0], "an edge"), ([0.1, 0.2, 0.0], "a face")] {
        assert_eq!(crossings(&octahedron(), p), 1, "out through {where_to}");
        assert_eq!(crossings(&reversed(&octahedron()), p), -1, "{where_to}, inside out");
        assert_eq!(crossings(&octahedron(), [p[0], p[1], -5.0]), 0, "in at the bottom and out through {where_to}");
        assert_eq!(crossings(&octahedron(), [p[0], p[1], 5.0]), 0, "upwards from above {where_to}");
    }
    // Under the diagonal that the two triangles of a cube's top share.
    assert_eq!(crossings(&nested(1), [0.0; 3]), 1);
}
